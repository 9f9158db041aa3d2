//! Sensitivities of outputs to the stiffness of each element.

use myovib_dae::Problem;
use myovib_model::sensitivity::{AdjointWork, LinearMisfit, RecordedIntegrator};
use myovib_model::{Integrator, MuscleDae};
use serde_json::{Value, json};

use super::curves::{Output, Readings, outputs, sample, settings};
use super::parameters::body;
use super::sample_times;
use super::unsupported::unsupported_in_map;
use crate::probe::StateAt;
use crate::run::start::initial;
use crate::scene::Scene;
use crate::vtu::CellField;
use crate::watch::Watcher;
use crate::{Error, InputError};

/// Sensitivity of the RMS of each output to the stiffness of each element. Chains driven by the body are not computed.
#[derive(Debug, Clone)]
pub struct StiffnessMap {
    pub scene: Scene,
    /// Maps of the outputs that are displacements or velocities.
    pub outputs: Vec<OutputMap>,
    /// Names of the other outputs.
    pub omitted: Vec<String>,
    pub steps: u64,
    /// Number of real and complex transposed solves.
    pub solves: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct OutputMap {
    pub name: String,
    /// For each element, the relative change of the output's RMS over time divided by the relative change of the
    /// element's elastic stress. NaN if the output is always zero.
    pub elements: Vec<f64>,
}

impl OutputMap {
    /// Returns the sensitivity to the stiffness of the whole body.
    pub fn total(&self) -> f64 {
        self.elements.iter().sum()
    }
}

impl StiffnessMap {
    /// Computes one run and its discrete adjoint for each output.
    ///
    /// # Errors
    /// Fails if these derivatives are not available for the scene, if the motion of the body cannot start, or if the
    /// integration stops before the end.
    pub fn of(scene: &Scene, watcher: Watcher<'_>) -> Result<Self, Error> {
        if let Some((feature, path)) = unsupported_in_map(scene) {
            return Err(feature.at(scene, &path).into());
        }
        let body = body(scene)?;
        let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let all = outputs(scene)?;
        let functionals = Readings::new(scene, &all)?.functionals(&dae);
        let (mut wanted, mut unknowns, mut omitted) = (Vec::new(), Vec::new(), Vec::new());
        for (output, functional) in all.into_iter().zip(functionals) {
            match functional {
                Some(own) => {
                    wanted.push(output);
                    unknowns.push(own);
                }
                None => omitted.push(output.name),
            }
        }
        if wanted.is_empty() {
            let error = InputError::new("no output is a displacement or a velocity");
            let (place, next) = match scene.file.output.is_empty() {
                true => ("probe", "add a [[probe]] with quantities = [\"u\"]"),
                false => ("output", "add an [[output]] with a column of u or v"),
            };
            return Err(scene.wrong(place, error.next(next)).into());
        }
        let [y, y_dot] = initial(body, &mut dae, watcher)?;
        let mut integrator =
            RecordedIntegrator::starting_at(dae, &settings(&body.settings), [&y, &y_dot])
                .map_err(|error| Error::from(error).before_any_output())?;
        let samples = follow(scene, &wanted, &mut integrator, watcher)?;
        let mut map = Self {
            scene: scene.clone(),
            outputs: Vec::new(),
            omitted,
            steps: integrator.counts().steps,
            solves: 0,
        };
        for (k, (Output { name, .. }, unknowns)) in wanted.into_iter().zip(unknowns).enumerate() {
            // For c = u / Σ u², the derivatives of ln √Σ u² and of Σ c u are equal.
            let squares: f64 = samples.iter().map(|(_, values)| values[k].powi(2)).sum();
            let weighed = samples.iter().map(|(t, values)| (*t, values[k] / squares));
            let misfit =
                LinearMisfit { unknowns: &unknowns, samples: &weighed.collect::<Vec<_>>() };
            let elements = match squares {
                0.0 => vec![f64::NAN; body.muscle.solid.space().n_elements()],
                _ => {
                    let (elements, work) =
                        integrate_adjoint(&mut integrator, misfit, &name, watcher)?;
                    map.solves += work.real_solves + work.complex_solves;
                    elements
                }
            };
            map.outputs.push(OutputMap { name, elements });
        }
        Ok(map)
    }

    /// Returns, for each output, the sensitivity of each element divided by the element's share of the volume. This
    /// density does not depend on the size of elements. Its mean over the body is the total sensitivity.
    pub fn densities(&self) -> Result<Vec<CellField>, Error> {
        let space = body(&self.scene)?.muscle.solid.space();
        let whole = space.measure();
        let of = |output: &OutputMap| CellField {
            name: output.name.clone(),
            values: output
                .elements
                .iter()
                .enumerate()
                .map(|(e, own)| (e, own * whole / space.measure_of(e)))
                .collect(),
        };
        Ok(self.outputs.iter().map(of).collect())
    }

    /// Returns the body of the JSON document.
    pub fn document(&self) -> Value {
        let outputs = self.outputs.iter().map(|output| {
            json!({ "name": output.name, "total": output.total(), "elements": output.elements })
        });
        json!({
            "outputs": outputs.collect::<Vec<_>>(),
            "omitted": self.omitted,
            "steps": self.steps,
            "solves": self.solves,
        })
    }
}

/// Returns the derivative of a misfit with respect to the stiffness of each element, and the computational work.
/// Progress reports contain the name of the output.
fn integrate_adjoint(
    integrator: &mut RecordedIntegrator,
    misfit: LinearMisfit<'_>,
    name: &str,
    watcher: Watcher<'_>,
) -> Result<(Vec<f64>, AdjointWork), Error> {
    let mut on_step = |t: f64| {
        watcher.progress.on_progress(&|| format!("{name}: back at t = {t:.3} s"));
        !watcher.is_interrupted()
    };
    let by_stiffness = integrator.by_stiffness(misfit, &mut on_step);
    match watcher.is_interrupted() {
        true => Err(Error::Stopped("interrupted".to_owned())),
        false => Ok(by_stiffness?),
    }
}

/// Integrates to the end and returns the time and the outputs of each sample.
fn follow(
    scene: &Scene,
    outputs: &[Output],
    integrator: &mut RecordedIntegrator,
    watcher: Watcher<'_>,
) -> Result<Vec<(f64, Vec<f64>)>, Error> {
    let mut samples = Vec::new();
    let readings = Readings::new(scene, outputs)?;
    let times = sample_times(scene, outputs);
    sample(scene, integrator, &times, watcher, |integrator, _, t| {
        let n = integrator.problem().n_unknowns();
        let mut state = [vec![0.0; n], vec![0.0; n]];
        for (derivative, out) in state.iter_mut().enumerate() {
            integrator.dense_output(t, derivative as u32, out)?;
        }
        let [y, y_dot] = &state;
        let at = StateAt { t, y, y_dot };
        let values = readings.accepted_values(integrator.problem_mut(), at)?;
        samples.push((t, values));
        Ok(())
    })?;
    Ok(samples)
}
