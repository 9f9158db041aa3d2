//! A muscle whose internal stresses are internal variables of its integrator instead of unknowns.

use std::slice::from_ref;

use myovib_dae::{Problem, StepError, VariableKind};
use myovib_fem::RelaxationRegion;
use myovib_fem::material::PronyTerm;
use myovib_radau::{
    InternalVariableGroup, InternalVariableProblem, InternalVariables, RelaxationTerm,
};
use nalgebra_sparse::pattern::SparsityPattern;

use super::MuscleDae;
use crate::error::ModelError;
use crate::field::Field;
use crate::start::Consistent;

/// The problem of a [`MuscleDae`] without its last block of unknowns, the internal stresses Q of Prony terms. The
/// stress S of the law drives the internal stresses, and their response is the overstress H = Σ g S − Σ Q.
pub(crate) struct InternalVariableDae {
    dae: MuscleDae,
    /// Number of unknowns without internal stresses.
    n: usize,
    /// Changes of S at the quadrature points.
    rates: [Vec<f64>; 1],
    /// Internal stresses for the next computation of consistent values.
    internal: Vec<f64>,
}

impl InternalVariableDae {
    /// Returns the problem of `dae` and its internal variables. The internal variables start from the internal stresses
    /// in `y` and have the absolute tolerance `absolute` (Pa).
    ///
    /// # Panics
    /// Panics if `dae` has no internal stresses.
    pub(crate) fn new(mut dae: MuscleDae, y: &[f64], absolute: f64) -> (Self, InternalVariables) {
        let internal = dae.layout.range(Field::InternalStress);
        let internal = internal.expect("a body with Prony terms");
        let solid = &dae.muscle.solid;
        let term = |term: &PronyTerm| RelaxationTerm { weight: term.weight, time: term.time };
        let part = |part: &RelaxationRegion| InternalVariableGroup {
            slots: part.slots.clone(),
            terms: part.prony.terms().iter().map(term).collect(),
        };
        let variables = InternalVariables {
            parts: solid.relaxation_regions().iter().map(part).collect(),
            start: y[internal.clone()].to_vec(),
            absolute,
        };
        let slots = vec![0.0; solid.n_slots()];
        dae.overstress = Some(slots.clone());
        let (n, rates) = (internal.start, [slots]);
        let internal = variables.start.clone();
        let problem = Self { dae, n, rates, internal };
        (problem, variables)
    }

    /// Sets the internal stresses for further computations of [consistent](Consistent) values.
    pub(crate) fn keep(&mut self, internal: Vec<f64>) {
        self.internal = internal;
    }

    pub(crate) fn dae(&self) -> &MuscleDae {
        &self.dae
    }

    /// Returns the muscle for evaluations outside the time integration.
    pub(crate) fn dae_mut(&mut self) -> &mut MuscleDae {
        &mut self.dae
    }
}

impl MuscleDae {
    /// Sets H = 0 for all further evaluations, as in a body in equilibrium. The evaluations then expect vectors without
    /// internal stresses.
    pub(crate) fn relax_overstress(&mut self) {
        let n_slots = self.muscle.solid.n_slots();
        self.overstress = (n_slots > 0).then(|| vec![0.0; n_slots]);
    }
}

impl Consistent for InternalVariableDae {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        let mut state = self.dae.consistent(t, &[y, &self.internal].concat())?;
        state.iter_mut().for_each(|values| values.truncate(self.n));
        Ok(state)
    }
}

impl Problem for InternalVariableDae {
    fn n_unknowns(&self) -> usize {
        self.n
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.dae.residual(t, y, y_dot, residual)
    }

    /// Returns an empty pattern, because the full matrix is never assembled.
    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::zeros(self.n, self.n)
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let kinds = self.dae.kinds()?;
        Some(kinds[..self.n].to_vec())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        let indices = self.dae.indices()?;
        Some(indices[..self.n].to_vec())
    }

    fn component_name(&self, i: usize) -> String {
        self.dae.component_name(i)
    }
}

impl InternalVariableProblem for InternalVariableDae {
    fn driving_quantity(&mut self, t: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        self.dae.expand(t, y, None);
        self.dae.counters.relaxing_solve_passes += 1;
        let (solid, work) = (&self.dae.muscle.solid, &self.dae.work);
        solid.driving_stresses(&work.displacement, out);
        Ok(())
    }

    fn driving_change(&mut self, change: &[f64], out: &mut [f64]) {
        let dae = &mut self.dae;
        dae.counters.relaxing_solve_passes += 1;
        let moved = dae.layout.range(Field::Displacement);
        let moved = &change[moved.expect("all formulations have q")];
        let solid = &dae.muscle.solid;
        dae.work.expanded.fill(0.0);
        solid.dofs().expand(moved, &mut dae.work.expanded);
        let (at, moved) = (dae.matrices.relaxing_at(), from_ref(&dae.work.expanded));
        solid.driving_stress_rates(at, moved, &mut self.rates);
        out.copy_from_slice(&self.rates[0]);
    }

    fn response(&mut self) -> &mut [f64] {
        self.dae.overstress.as_deref_mut().unwrap_or_default()
    }
}

/// Gives access to the muscle whose matrices are condensed.
impl AsMut<MuscleDae> for InternalVariableDae {
    fn as_mut(&mut self) -> &mut MuscleDae {
        &mut self.dae
    }
}

impl AsMut<Self> for MuscleDae {
    fn as_mut(&mut self) -> &mut Self {
        self
    }
}
