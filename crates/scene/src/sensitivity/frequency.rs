//! Outputs of harmonic responses and the derivatives of these outputs.

use std::f64::consts::TAU;

use myovib_model::harmonic::{Amplitude, DynamicStiffness, HarmonicResponse, Neighbors};
use myovib_model::{ModelError, statics::Equilibrium};
use num_complex::Complex64;

use super::curves::{Output, Sample};
use super::parameters::{At, Parameterized, body};
use crate::probe::HarmonicMotion;
use crate::response::{PRELOAD, Part, Values, equilibrium};
use crate::scene::Body;
use crate::watch::Watcher;
use crate::{Error, Scene};

/// Relative step of the difference quotients of order 4 between equations at neighboring parameter values. Truncation
/// errors and the effect of errors in the equilibria are both below 1e-9.
const STEP: f64 = 1e-3;

/// Computes the outputs of a response at ascending frequencies and, if requested, their derivatives. The derivatives
/// take additional solves with the same factorization. They include the dependence of the equilibrium under a preload
/// on the parameters.
///
/// # Errors
/// Fails if the scene is invalid at these values, or if an equilibrium or a factorization fails.
pub fn respond(
    scene: &Parameterized,
    values: &[f64],
    outputs: &[Output],
    frequencies: &[f64],
    with_derivatives: bool,
    watcher: Watcher<'_>,
) -> Result<Vec<Sample>, Error> {
    let at = scene.at(values)?;
    let body = body(&at)?;
    let all = Values::of_scene(&at)?;
    let ratios = at.file.response.iter().flat_map(|response| &response.ratio);
    let names = at.file.probe.iter().map(|probe| &probe.name);
    let names: Vec<&String> = names.chain(ratios.map(|ratio| &ratio.name)).collect();
    let index = |output: &Output| all.first(names[output.probe]) + output.column / Part::ALL.len();
    let chosen: Vec<usize> = outputs.iter().map(index).collect();
    let all = all.only(&chosen);
    let response = HarmonicResponse::about(
        &body.muscle,
        body.formulation,
        &preloaded(&at, body, watcher)?,
        &body.excitation,
    )?;
    let here = At { scene, values, body };
    let neighbors = |j: usize| {
        let (stencil, step, bodies) = here.around(j, STEP, |value| {
            let near = here.neighbor(j, value)?;
            let rest = preloaded(&at, &near, watcher)?;
            Ok(DynamicStiffness::about(&near.muscle, near.formulation, &rest, &near.excitation)?)
        })?;
        Ok(Neighbors::new(stencil, step, bodies))
    };
    let count = if with_derivatives { values.len() } else { 0 };
    let neighbors = (0..count).map(neighbors);
    let neighbors = neighbors.collect::<Result<Vec<_>, Error>>()?;
    let read = |stiffness: &DynamicStiffness, amplitude: &Amplitude| {
        all.read_probes(&HarmonicMotion::Body(stiffness, amplitude))
    };
    let rows =
        response.map_with_derivatives(frequencies, &neighbors, |amplitude, derivatives| {
            if watcher.is_interrupted() {
                return Err(ModelError::Interrupted);
            }
            let s = amplitude.s;
            let motion = HarmonicMotion::Body(response.stiffness(), amplitude);
            let values = all.read(s, &motion)?;
            let derivatives = neighbors.iter().zip(derivatives).map(|(near, derivative)| {
                let changes = near.differentiate(amplitude, derivative, read)?;
                let change = |k: &usize| all.change(*k, s, &values, &changes);
                Ok(chosen.iter().map(change).collect::<Vec<_>>())
            });
            let derivatives = derivatives.collect::<Result<Vec<_>, ModelError>>()?;
            Ok((chosen.iter().map(|k| values[*k]).collect::<Vec<_>>(), derivatives))
        })?;
    if rows.len() < frequencies.len() {
        return Err(Error::Stopped("interrupted".to_owned()));
    }
    let samples = rows.into_iter().map(|(frequency, (values, derivatives))| {
        let omega = TAU * frequency;
        let derivative = |of_p: &Vec<Complex64>| {
            let pairs = values.iter().zip(of_p).zip(outputs);
            let real = pairs.map(|((z, dz), output)| match output.shear_wave {
                Some(wave) => wave.derivative(omega, *z, *dz),
                None => Part::of_column(output.column).derivative(*z, *dz),
            });
            real.collect()
        };
        let value = |(z, output): (&Complex64, &Output)| match output.shear_wave {
            Some(wave) => wave.of(omega, *z),
            None => Part::of_column(output.column).of(*z),
        };
        Sample {
            t: frequency,
            values: values.iter().zip(outputs).map(value).collect(),
            derivatives: derivatives.iter().map(derivative).collect(),
        }
    });
    Ok(samples.collect())
}

/// Returns the equilibrium about which a body vibrates.
fn preloaded(scene: &Scene, body: &Body, watcher: Watcher<'_>) -> Result<Equilibrium, Error> {
    let response = scene.file.response.as_ref();
    let preload_time = response.and_then(|response| response.preload_time);
    let key = (PRELOAD, preload_time);
    let (found, _) = equilibrium(scene, &body.muscle, body.formulation, key, watcher)?;
    Ok(found)
}
