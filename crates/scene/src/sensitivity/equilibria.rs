//! Outputs of equilibria on a loading path and the derivatives of these outputs.

use std::ops::ControlFlow;

use myovib_model::statics::{self, Control, EquilibriumDerivatives, PathState, Shortfall};
use myovib_model::{ModelError, Muscle, sensitivity::Stencil};

use super::curves::{Cost, Output, Readings, Sample};
use super::parameters::{At, Parameterized, STEP, body};
use crate::Error;
use crate::probe::StateAt;
use crate::run::statics::{at_rest, unknowns};
use crate::watch::{Watcher, search};

/// Bodies at neighboring values of a parameter, from which difference quotients are computed.
struct Neighbors {
    stencil: Stencil,
    /// Distance between adjacent parameter values.
    step: f64,
    muscles: Vec<Muscle>,
}

impl Neighbors {
    /// Returns, for each body, the offset of its parameter value, its weight in the difference quotient, and the body
    /// itself.
    fn points(&self) -> impl Iterator<Item = (f64, f64, &Muscle)> {
        let points = self.stencil.points().iter().zip(&self.muscles);
        points.map(|((k, weight), muscle)| (k * self.step, weight / self.step, muscle))
    }

    fn weighted(&self) -> Vec<(f64, &Muscle)> {
        let points = self.points();
        points.map(|(_, weight, muscle)| (weight, muscle)).collect()
    }

    /// Returns the derivatives of the outputs that `read` returns at `state`. `slope` contains the derivatives of the
    /// unknowns.
    fn derivative(
        &self,
        state: &PathState,
        slope: &[f64],
        read: impl Fn(&Muscle, &[f64]) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut sum = Vec::new();
        for (distance, weight, muscle) in self.points() {
            let mut moved = state.clone();
            let unknowns_near = moved.displacement.iter_mut().chain(&mut moved.pressure);
            unknowns_near.zip(slope).for_each(|(x, s)| *x += distance * s);
            let values = read(muscle, &unknowns(&moved))?;
            sum.resize(values.len(), 0.0);
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
        Ok(sum)
    }
}

/// Computes the outputs of the equilibria at the given load factors, in the same order. If requested, also computes
/// their derivatives.
///
/// The path also passes through the load factors of the scene. This may be necessary to stay on the same branch.
///
/// The derivatives of the unknowns are solutions of linear systems with the factorized tangent of each equilibrium. The
/// explicit derivatives of the equations and of the probes are difference quotients of order 4 between bodies at
/// neighboring parameter values.
///
/// # Errors
/// Fails if the scene is invalid at these values, if a load is not reached, or if a tangent is singular.
pub fn equilibria(
    scene: &Parameterized,
    values: &[f64],
    outputs: &[Output],
    loads: &[f64],
    with_derivatives: bool,
    watcher: Watcher<'_>,
) -> Result<(Vec<Sample>, Cost), Error> {
    let at = scene.at(values)?;
    let body = body(&at)?;
    let t = at.t_end;
    let readings = Readings::new(&at, outputs)?;
    let here = At { scene, values, body };
    let neighbors = |j: usize| {
        let (stencil, step, muscles) =
            here.around(j, STEP, |value| Ok(here.neighbor(j, value)?.muscle))?;
        Ok(Neighbors { stencil, step, muscles })
    };
    let count = if with_derivatives { values.len() } else { 0 };
    let neighbors: Vec<Neighbors> = (0..count).map(neighbors).collect::<Result<_, Error>>()?;
    let stencils: Vec<_> = neighbors.iter().map(Neighbors::weighted).collect();
    let mut derivatives =
        EquilibriumDerivatives::new(&body.muscle, body.formulation, t, &stencils)?;

    let mut sample = |state: &PathState| {
        let read_as = |muscle: &Muscle, y: &[f64], is_accepted: bool| {
            let muscle = muscle.under_part_of_loads(state.load);
            let mut dae = at_rest(&muscle, body.formulation, t)?;
            let at = StateAt { t, y, y_dot: &vec![0.0; y.len()] };
            match is_accepted {
                true => readings.accepted_values(&mut dae, at),
                false => readings.values(&mut dae, at),
            }
        };
        let read = |muscle: &Muscle, y: &[f64]| read_as(muscle, y, false);
        let y = unknowns(state);
        let x = [&state.displacement[..], &state.pressure].concat();
        let slopes = match neighbors.is_empty() {
            true => Vec::new(),
            false => derivatives.at(&x, state.load)?,
        };
        let derivatives = neighbors.iter().zip(&slopes);
        let derivatives = derivatives.map(|(near, slope)| near.derivative(state, slope, read));
        Ok(Sample {
            t: state.load,
            values: read_as(&body.muscle, &y, true)?,
            derivatives: derivatives.collect::<Result<_, ModelError>>()?,
        })
    };
    let mut samples: Vec<Sample> = Vec::with_capacity(loads.len());
    let mut failed = None;
    let path = with_own_loads(loads, &at.loads()?);
    let end = statics::follow(
        &body.muscle,
        body.formulation,
        t,
        &Control::Load(path),
        &mut search(watcher),
        &mut |state| {
            if !loads.contains(&state.load) {
                return ControlFlow::Continue(());
            }
            match sample(&state) {
                Ok(found) => {
                    samples.push(found);
                    ControlFlow::Continue(())
                }
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        },
    )?;
    match (failed, end.shortfall) {
        (Some(error), _) => return Err(error),
        (None, Some(Shortfall::Interrupted)) => {
            return Err(Error::Stopped("interrupted".to_owned()));
        }
        (None, Some(shortfall)) => return Err(shortfall.error(end.reached).into()),
        (None, None) => {}
    }
    let n = samples.len() as u64;
    let with = if neighbors.is_empty() { 0 } else { n };
    let cost = Cost {
        steps: end.load_steps as u64,
        // Each iteration and each prediction at the start of a step takes one factorization.
        factorizations: (end.newton_iterations + end.load_steps) as u64 + with,
        sensitivity_solves: n * neighbors.len() as u64,
    };
    Ok((samples, cost))
}

/// Inserts the scene's `own` load factors between the given `loads`. Returns only `loads` if they decrease or if any
/// load factor is negative.
fn with_own_loads(loads: &[f64], own: &[f64]) -> Vec<f64> {
    let mut path = loads.to_vec();
    let last = loads.iter().copied().fold(0.0, f64::max);
    path.extend(own.iter().filter(|load| **load < last));
    path.sort_by(f64::total_cmp);
    path.dedup();
    match loads.is_sorted() && path.iter().all(|load| *load >= 0.0) {
        true => path,
        false => loads.to_vec(),
    }
}
