//! Derivatives ∂F/∂p, computed from residuals of muscles with perturbed parameters.

use std::cell::OnceCell;

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, Problem, StepError};

use super::chain::ChainDependence;
use super::stencil::Stencil;
use super::tangents::Tangents;
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;

/// Dependence of a muscle on one parameter: a stencil of perturbed muscles.
///
/// The derivative of any computed quantity is w_0 times its value for the muscle itself plus the sum of w_k times its
/// value for each perturbed muscle k. Perturbed muscles are built like the muscle itself, so no formula is implemented
/// twice.
#[derive(Debug, Clone)]
pub struct Dependence {
    parameter: Parameter,
    own_weight: f64,
    perturbed: Vec<(f64, MuscleDae)>,
    scope: Scope,
    /// Derivative ∂y_0/∂p of the initial state; empty if zero.
    start: Vec<f64>,
}

/// Part of the model that a parameter affects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scope {
    /// Any part. All equations are evaluated.
    Global,
    ElementForces,
    /// Only terms outside the element integrals. The integrals are shared with the unperturbed muscle.
    OutsideElements,
    Loads,
}

impl Dependence {
    /// Creates the dependence on a parameter in which the equations are affine. In `other`, the parameter is larger by
    /// `distance`, which may be as large as the parameter itself. The finite difference is exact up to rounding errors.
    pub fn affine(
        parameter: Parameter,
        formulation: Formulation,
        other: Muscle,
        distance: f64,
    ) -> Self {
        let model = MuscleDae::for_analysis(other, formulation);
        Self {
            parameter,
            own_weight: -1.0 / distance,
            perturbed: vec![(1.0 / distance, model)],
            scope: Scope::Global,
            start: Vec::new(),
        }
    }

    /// Creates the dependence on a parameter in which the equations are smooth. The derivative is a fourth-order finite
    /// difference of the `muscles` at the points of `stencil`, with step `delta`.
    pub fn smooth(
        parameter: Parameter,
        formulation: Formulation,
        muscles: Vec<Muscle>,
        (stencil, delta): (Stencil, f64),
    ) -> Self {
        let weights = stencil.points().iter().map(|(_, weight)| weight / delta);
        let model = |muscle| MuscleDae::for_analysis(muscle, formulation);
        Self {
            parameter,
            own_weight: 0.0,
            perturbed: weights.zip(muscles.into_iter().map(model)).collect(),
            scope: Scope::Global,
            start: Vec::new(),
        }
    }

    /// Creates the dependence on a parameter that only affects the initial state.
    pub fn of_start(parameter: Parameter) -> Self {
        Self {
            parameter,
            own_weight: 0.0,
            perturbed: Vec::new(),
            scope: Scope::Global,
            start: Vec::new(),
        }
    }

    /// Sets the derivative of the initial state.
    #[must_use]
    pub fn starting(self, start: Vec<f64>) -> Self {
        Self { start, ..self }
    }

    /// Returns the derivative ∂y_0/∂p of the initial state; empty if zero.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// Returns the muscles of the stencil, including `own`, with their weights.
    pub fn stencil<'a>(&'a self, own: &'a Muscle) -> Vec<(f64, &'a Muscle)> {
        let perturbed = self.perturbed.iter();
        let perturbed = perturbed.map(|(weight, model)| (*weight, model.muscle()));
        std::iter::once((self.own_weight, own)).chain(perturbed).collect()
    }

    /// Declares that the parameter does not affect the element integrals, so that perturbed muscles require no element
    /// passes. Examples are parameters of inertia or damping, and of compressibility if the pressure is an unknown.
    #[must_use]
    pub fn outside_elements(self) -> Self {
        Self { scope: Scope::OutsideElements, ..self }
    }

    /// Declares that the parameter only affects the law's stress, so that only element forces are computed for it.
    #[must_use]
    pub fn on_forces(self) -> Self {
        Self { scope: Scope::ElementForces, ..self }
    }

    /// Declares that the parameter only affects loads, so that only loads are computed for it.
    #[must_use]
    pub fn on_loads(self) -> Self {
        Self { scope: Scope::Loads, ..self }
    }

    /// Returns the derivative of a quantity at a given state. `read` computes the quantity for a muscle, and `own` is
    /// its value for the unperturbed muscle.
    ///
    /// # Errors
    /// Errors of `read`.
    pub(crate) fn reading_derivative(
        &mut self,
        own: &[f64],
        read: &mut dyn FnMut(&mut MuscleDae) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut sum: Vec<f64> = own.iter().map(|own| self.own_weight * own).collect();
        for (weight, model) in &mut self.perturbed {
            for (sum, value) in sum.iter_mut().zip(read(model)?) {
                *sum += *weight * value;
            }
        }
        Ok(sum)
    }
}

/// Dependence of a muscle on several parameters.
#[derive(Debug, Default)]
pub struct Dependences {
    list: Vec<Parameter>,
    all: Vec<Dependence>,
    /// Dependence of the chains on the parameters; empty without chains.
    pub(super) chains: Vec<Option<ChainDependence>>,
    /// Copy of the muscle used for evaluations, so that the matrices of the integrator's muscle remain valid for the
    /// next factorization.
    copy: Option<Box<MuscleDae>>,
    /// Tangents, set at the first step; `None` if they cannot be stored.
    tangents: OnceCell<Option<Box<Tangents>>>,
    /// Results at the last state, which all parameters share.
    evaluation: Evaluation,
    residual: Vec<f64>,
}

/// State at which the element integrals of the copy were computed, and the residual at this state.
#[derive(Debug, Default)]
struct Evaluation {
    t: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    /// The residual, computed on request.
    residual: Option<Vec<f64>>,
}

impl Dependences {
    /// Creates the dependences of a muscle without chains.
    pub fn new(all: Vec<Dependence>) -> Self {
        Self { list: all.iter().map(|one| one.parameter.clone()).collect(), all, ..Self::default() }
    }

    /// Adds the dependences of the muscle's chains on the same parameters.
    #[must_use]
    pub fn with_chains(self, chains: Vec<Option<ChainDependence>>) -> Self {
        Self { chains, ..self }
    }

    /// Returns the number of parameters.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// Returns ∂y_0/∂p for each parameter. Each derivative has `n` components.
    pub(super) fn starts(&self, n: usize) -> Vec<Vec<f64>> {
        let of = |one: &Dependence| match one.start.is_empty() {
            true => vec![0.0; n],
            false => one.start.clone(),
        };
        self.all.iter().map(of).collect()
    }

    /// Returns the dependence on parameter j.
    ///
    /// # Panics
    /// Panics if the parameter does not exist.
    pub fn get_mut(&mut self, j: usize) -> &mut Dependence {
        &mut self.all[j]
    }

    /// Computes the element integrals at a state unless they are available. Also computes the residual if it is needed
    /// and not available.
    fn ensure_evaluated(
        &mut self,
        dae: &MuscleDae,
        (t, y, y_dot): (f64, &[f64], &[f64]),
        needs_residual: bool,
    ) -> Result<(), StepError> {
        let evaluation = &mut self.evaluation;
        let copy = copy_of(&mut self.copy, dae);
        if !(evaluation.t == t && evaluation.y == y && evaluation.y_dot == y_dot) {
            // A failure invalidates all results.
            evaluation.y.clear();
            evaluation.residual = None;
            copy.integrate_at(t, y, y_dot)?;
            evaluation.t = t;
            evaluation.y.extend_from_slice(y);
            evaluation.y_dot.clear();
            evaluation.y_dot.extend_from_slice(y_dot);
        }
        if needs_residual && evaluation.residual.is_none() {
            let mut residual = vec![0.0; y.len()];
            copy.sum_rows(t, y, y_dot, &mut residual);
            evaluation.residual = Some(residual);
        }
        Ok(())
    }
}

/// Returns a copy of the system. The copy is created at the first call.
pub(super) fn copy_of<'a, P: Clone>(slot: &'a mut Option<Box<P>>, dae: &P) -> &'a mut P {
    slot.get_or_insert_with(|| Box::new(dae.clone()))
}

impl Parameters<MuscleDae> for Dependences {
    fn linearize(
        &mut self,
        problem: &mut MuscleDae,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        jacobian.parts(copy_of(&mut self.copy, problem), at, parts)
    }

    fn keep_tangents(
        &mut self,
        problem: &mut MuscleDae,
        place: usize,
        at: &Linearization<'_>,
    ) -> Result<bool, StepError> {
        self.tangents.get_or_init(|| Tangents::new(problem).map(Box::new));
        let Some(Some(tangents)) = self.tangents.get_mut() else {
            return Ok(false);
        };
        tangents.keep(problem, place, (at.t, at.y, at.y_dot))?;
        Ok(true)
    }

    fn subtract_tangents(
        &mut self,
        place: usize,
        at: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        match self.tangents.get_mut() {
            Some(Some(tangents)) => tangents.subtract(place, at, out, n_columns),
            _ => Ok(()),
        }
    }

    fn list(&self) -> &[Parameter] {
        &self.list
    }

    fn derivative(
        &mut self,
        problem: &mut MuscleDae,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let Dependence { own_weight, perturbed, scope, .. } = &mut self.all[j];
        if *scope == Scope::Loads {
            out.fill(0.0);
            problem.add_load(t, y, -*own_weight, out);
            for (weight, model) in perturbed {
                model.add_load(t, y, -*weight, out);
            }
            return Ok(());
        }
        if *scope == Scope::ElementForces {
            out.fill(0.0);
            for (weight, model) in perturbed {
                model.integrate_at(t, y, y_dot)?;
                model.add_forces(*weight, out);
            }
            let own_weight = *own_weight;
            if own_weight != 0.0 {
                self.ensure_evaluated(problem, (t, y, y_dot), false)?;
                copy_of(&mut self.copy, problem).add_forces(own_weight, out);
            }
            return Ok(());
        }
        let needs_residual = *own_weight != 0.0;
        if needs_residual || *scope == Scope::OutsideElements {
            self.ensure_evaluated(problem, (t, y, y_dot), needs_residual)?;
        }
        let Self { all, copy, evaluation, residual, .. } = self;
        let Dependence { own_weight, perturbed, scope, .. } = &mut all[j];
        match *own_weight {
            0.0 => out.fill(0.0),
            weight => {
                let own = out.iter_mut().zip(evaluation.residual.iter().flatten());
                own.for_each(|(o, f)| *o = weight * f);
            }
        }
        residual.resize(out.len(), 0.0);
        for (weight, model) in perturbed {
            match *scope == Scope::OutsideElements {
                true => model.residual_with_integrals_of(
                    copy_of(copy, problem),
                    (t, y, y_dot),
                    residual,
                )?,
                false => model.residual(t, y, y_dot, residual)?,
            }
            let residual = residual.iter();
            out.iter_mut().zip(residual).for_each(|(o, f)| *o += *weight * f);
        }
        Ok(())
    }
}
