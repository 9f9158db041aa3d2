//! ∂F/∂p by residuals of muscles that differ in p.

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, Problem, StepError};

use super::chain::ChainDependence;
use super::stencil::Stencil;
use super::tangents::Tangents;
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;

/// How a muscle depends on one parameter: a stencil of muscles that differ in it.
///
/// Whatever a muscle computes, its derivative is w_0 times that of the muscle itself and w_k times
/// that of its twin k. The twins are composed as the muscle is, so that no formula is written twice.
#[derive(Debug, Clone)]
pub struct Dependence {
    parameter: Parameter,
    own_weight: f64,
    twins: Vec<(f64, MuscleDae)>,
    acts: Acts,
    /// ∂y_0/∂p; empty where it is zero.
    start: Vec<f64>,
}

/// Where a parameter acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Acts {
    /// Who knows.
    Anywhere,
    /// On the forces of elements alone.
    OnForces,
    /// Not within elements: the twins' element integrals are the muscle's own.
    OutsideElements,
    /// On the loads alone.
    OnLoads,
}

impl Dependence {
    /// A parameter that the equations are affine in: in `other` it is larger by `distance`, which
    /// may be as large as the parameter. The difference is exact to rounding.
    pub fn affine(
        parameter: Parameter,
        formulation: Formulation,
        other: Muscle,
        distance: f64,
    ) -> Self {
        let twin = MuscleDae::for_analysis(other, formulation);
        Self {
            parameter,
            own_weight: -1.0 / distance,
            twins: vec![(1.0 / distance, twin)],
            acts: Acts::Anywhere,
            start: Vec::new(),
        }
    }

    /// A parameter that the equations depend on smoothly: the difference of order 4 of the muscles that
    /// `stencil` asks for, in steps of `delta`.
    pub fn smooth(
        parameter: Parameter,
        formulation: Formulation,
        muscles: Vec<Muscle>,
        (stencil, delta): (Stencil, f64),
    ) -> Self {
        let weights = stencil.points().iter().map(|(_, weight)| weight / delta);
        let twin = |muscle| MuscleDae::for_analysis(muscle, formulation);
        Self {
            parameter,
            own_weight: 0.0,
            twins: weights.zip(muscles.into_iter().map(twin)).collect(),
            acts: Acts::Anywhere,
            start: Vec::new(),
        }
    }

    /// A parameter that the start alone depends on.
    pub fn of_start(parameter: Parameter) -> Self {
        Self {
            parameter,
            own_weight: 0.0,
            twins: Vec::new(),
            acts: Acts::Anywhere,
            start: Vec::new(),
        }
    }

    /// The same, with the derivative of the state in which the motion starts.
    #[must_use]
    pub fn starting(self, start: Vec<f64>) -> Self {
        Self { start, ..self }
    }

    /// ∂y_0/∂p; empty where it is zero.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// The muscles that differ in the parameter, `own` among them, with their weights in a derivative.
    pub fn stencil<'a>(&'a self, own: &'a Muscle) -> Vec<(f64, &'a Muscle)> {
        let twins = self.twins.iter();
        let twins = twins.map(|(weight, twin)| (*weight, twin.muscle()));
        std::iter::once((self.own_weight, own))
            .chain(twins)
            .collect()
    }

    /// The same, of a parameter that nothing within elements depends on: inertia, damping, or the
    /// compressibility where the pressure is an unknown. No twin passes over them then.
    #[must_use]
    pub fn outside_elements(self) -> Self {
        Self {
            acts: Acts::OutsideElements,
            ..self
        }
    }

    /// The same, of a parameter of the law's stress. Nothing but the forces of elements is computed for it
    /// then.
    #[must_use]
    pub fn on_forces(self) -> Self {
        Self {
            acts: Acts::OnForces,
            ..self
        }
    }

    /// The same, of a parameter of loads. Nothing but loads is computed for it then.
    #[must_use]
    pub fn on_loads(self) -> Self {
        Self {
            acts: Acts::OnLoads,
            ..self
        }
    }

    /// The parameter.
    pub fn parameter(&self) -> &Parameter {
        &self.parameter
    }

    /// The derivative of `read` at a given state, of what a muscle's own value is `own`.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn of_reading(
        &mut self,
        own: &[f64],
        read: &mut dyn FnMut(&mut MuscleDae) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut sum: Vec<f64> = own.iter().map(|own| self.own_weight * own).collect();
        for (weight, twin) in &mut self.twins {
            for (sum, value) in sum.iter_mut().zip(read(twin)?) {
                *sum += *weight * value;
            }
        }
        Ok(sum)
    }
}

/// How a muscle depends on several parameters.
#[derive(Debug, Default)]
pub struct Dependences {
    list: Vec<Parameter>,
    all: Vec<Dependence>,
    /// How chains depend on them; empty for none.
    pub(super) chains: Vec<Option<ChainDependence>>,
    /// The muscle itself again, whose matrices are nobody's: those of the integrator's are kept for its next
    /// factorisation.
    again: Option<Box<MuscleDae>>,
    tangents: Kept,
    /// The muscle's own residual at the last state, for which all parameters ask.
    known: Known,
    residual: Vec<f64>,
}

/// Tangents, once it is known whether they can be kept.
#[derive(Debug, Default)]
enum Kept {
    #[default]
    Unknown,
    Not,
    Are(Box<Tangents>),
}

/// What is known at a state, at which the copy's element integrals are.
#[derive(Debug, Default)]
struct Known {
    t: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    /// The residual, once asked for.
    residual: Option<Vec<f64>>,
}

impl Dependences {
    /// All of a muscle's.
    pub fn new(all: Vec<Dependence>) -> Self {
        Self {
            list: all.iter().map(|one| one.parameter.clone()).collect(),
            all,
            ..Self::default()
        }
    }

    /// The same, of a muscle with chains that depend on them too.
    #[must_use]
    pub fn with_chains(self, chains: Vec<Option<ChainDependence>>) -> Self {
        Self { chains, ..self }
    }

    /// Their number.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// ∂y_0/∂p for each, of `n` unknowns.
    pub(super) fn starts(&self, n: usize) -> Vec<Vec<f64>> {
        let of = |one: &Dependence| match one.start.is_empty() {
            true => vec![0.0; n],
            false => one.start.clone(),
        };
        self.all.iter().map(of).collect()
    }

    /// The one on parameter j.
    ///
    /// # Panics
    /// If there is none.
    pub fn get_mut(&mut self, j: usize) -> &mut Dependence {
        &mut self.all[j]
    }

    /// Evaluates the element integrals at a state, if they are not known, and the residual if that is
    /// `wanted` and not known.
    fn know(
        &mut self,
        dae: &MuscleDae,
        (t, y, y_dot): (f64, &[f64], &[f64]),
        wanted: bool,
    ) -> Result<(), StepError> {
        let known = &mut self.known;
        let copy = again(&mut self.again, dae);
        if !(known.t == t && known.y == y && known.y_dot == y_dot) {
            // Nothing is known after a failure.
            known.y.clear();
            known.residual = None;
            copy.integrate_at(t, y, y_dot)?;
            known.t = t;
            known.y.extend_from_slice(y);
            known.y_dot.clear();
            known.y_dot.extend_from_slice(y_dot);
        }
        if wanted && known.residual.is_none() {
            let mut residual = vec![0.0; y.len()];
            copy.sum_rows(t, y, y_dot, &mut residual);
            known.residual = Some(residual);
        }
        Ok(())
    }
}

/// A copy of the muscle, made once.
fn again<'a>(slot: &'a mut Option<Box<MuscleDae>>, dae: &MuscleDae) -> &'a mut MuscleDae {
    slot.get_or_insert_with(|| Box::new(dae.clone()))
}

impl Parameters<MuscleDae> for Dependences {
    fn linearise(
        &mut self,
        problem: &mut MuscleDae,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        jacobian.parts(again(&mut self.again, problem), at, parts)
    }

    fn keep_tangents(
        &mut self,
        problem: &mut MuscleDae,
        place: usize,
        at: &Linearization<'_>,
    ) -> Result<bool, StepError> {
        if matches!(self.tangents, Kept::Unknown) {
            self.tangents = match Tangents::new(problem) {
                Some(tangents) => Kept::Are(Box::new(tangents)),
                None => Kept::Not,
            };
        }
        let Kept::Are(tangents) = &mut self.tangents else {
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
        match &mut self.tangents {
            Kept::Are(tangents) => tangents.subtract(place, at, out, n_columns),
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
        let Dependence {
            own_weight,
            twins,
            acts,
            ..
        } = &mut self.all[j];
        if *acts == Acts::OnLoads {
            out.fill(0.0);
            problem.add_load(t, y, -*own_weight, out);
            for (weight, twin) in twins {
                twin.add_load(t, y, -*weight, out);
            }
            return Ok(());
        }
        if *acts == Acts::OnForces {
            out.fill(0.0);
            for (weight, twin) in twins {
                twin.integrate_at(t, y, y_dot)?;
                twin.add_forces(*weight, out);
            }
            let own_weight = *own_weight;
            if own_weight != 0.0 {
                self.know(problem, (t, y, y_dot), false)?;
                again(&mut self.again, problem).add_forces(own_weight, out);
            }
            return Ok(());
        }
        let wanted = *own_weight != 0.0;
        if wanted || *acts == Acts::OutsideElements {
            self.know(problem, (t, y, y_dot), wanted)?;
        }
        let Self {
            all,
            again: copy,
            known,
            residual,
            ..
        } = self;
        let Dependence {
            own_weight,
            twins,
            acts,
            ..
        } = &mut all[j];
        match *own_weight {
            0.0 => out.fill(0.0),
            weight => {
                let own = out.iter_mut().zip(known.residual.iter().flatten());
                own.for_each(|(o, f)| *o = weight * f);
            }
        }
        residual.resize(out.len(), 0.0);
        for (weight, twin) in twins {
            match *acts == Acts::OutsideElements {
                true => twin.residual_beside(again(copy, problem), (t, y, y_dot), residual)?,
                false => twin.residual(t, y, y_dot, residual)?,
            }
            let residual = residual.iter();
            out.iter_mut()
                .zip(residual)
                .for_each(|(o, f)| *o += *weight * f);
        }
        Ok(())
    }
}
