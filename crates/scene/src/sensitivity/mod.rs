//! Sensitivities of a scene's outputs.
//!
//! [`Parameterized`] is a scene with its parameters. [`outputs`] returns the observed columns of its probes. [`follow`]
//! runs the scene and samples the outputs and their derivatives at given times. Similarly, [`respond`] samples outputs
//! at frequencies, and [`equilibria`] samples outputs at load factors. [`compute`] samples at the intervals of the
//! scene's probes and returns [`Curves`]. [`StiffnessMap`] contains the sensitivities to the stiffness of each element.

mod chains;
mod curves;
mod equilibria;
mod frequency;
mod influence;
mod map;
mod parameters;
mod start;
mod unsupported;
mod wave;

pub use curves::{Cost, Output, Precision, Sample, follow, outputs, settings};
pub use equilibria::equilibria;
pub use frequency::respond;
pub use influence::SceneParameter;
pub(crate) use influence::first_jump;
pub use map::{OutputMap, StiffnessMap};
pub use parameters::Parameterized;
pub use unsupported::{Unsupported, unsupported, unsupported_in_map};

use myovib_model::SampleTimes;
use serde_json::{Value, json};

use crate::scene_file::Analysis;
use crate::watch::Watcher;
use crate::{Error, Scene};

/// Outputs and derivatives at equal intervals in time, or at the load factors of a path.
#[derive(Debug, Clone)]
pub struct Curves {
    /// Independent variable of the samples.
    pub abscissa: Abscissa,
    pub parameters: Vec<String>,
    pub outputs: Vec<String>,
    /// Typical sizes p̄ of the parameters. Derivatives are multiplied by these sizes to make them comparable.
    pub scales: Vec<f64>,
    pub samples: Vec<Sample>,
    /// Work of the run.
    pub cost: Cost,
}

/// Independent variable of outputs and measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// Time (s).
    Time,
    /// Frequency (Hz).
    Frequency,
    /// Load factor.
    Load,
}

impl Abscissa {
    /// Returns the independent variable of a scene's analysis.
    pub(crate) fn of(scene: &Scene) -> Self {
        match scene.file.analysis {
            Analysis::Response => Self::Frequency,
            Analysis::Static => Self::Load,
            _ => Self::Time,
        }
    }

    /// Returns the column name of the variable.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "t",
            Self::Frequency => "f",
            Self::Load => "load",
        }
    }
}

const MOST_SAMPLES: f64 = 5000.0;

/// Computes the sensitivities of a scene's outputs. They are sampled at the smallest interval of the outputs' probes,
/// or at the load factors of a path.
pub fn compute(
    scene: &Parameterized,
    precision: Precision,
    watcher: Watcher<'_>,
) -> Result<Curves, Error> {
    if let Some((feature, path)) = unsupported(&scene.scene) {
        return Err(feature.at(&scene.scene, &path).into());
    }
    let outputs = outputs(&scene.scene)?;
    let abscissa = Abscissa::of(&scene.scene);
    let values = scene.values();
    let (samples, cost) = match abscissa {
        Abscissa::Load => {
            let loads = scene.scene.loads()?;
            equilibria(scene, &values, &outputs, &loads, true, watcher)?
        }
        Abscissa::Time | Abscissa::Frequency => {
            let times = sample_times(&scene.scene, &outputs);
            let requested = (scene.dependences(&values)?, precision);
            follow(&scene.scene, &outputs, &times, requested, watcher)?
        }
    };
    Ok(Curves {
        abscissa,
        parameters: scene.parameters.iter().map(SceneParameter::label).collect(),
        scales: scene.parameters.iter().map(|p| p.scale).collect(),
        outputs: outputs.into_iter().map(|output| output.name).collect(),
        samples,
        cost,
    })
}

/// Returns times at the smallest sampling interval of the outputs' probes.
fn sample_times(scene: &Scene, outputs: &[Output]) -> Vec<f64> {
    let t_end = scene.t_end;
    let probes = outputs.iter().map(|output| output.every(scene));
    let every = probes.fold(t_end, f64::min).max(t_end / MOST_SAMPLES);
    let mut times = SampleTimes::new(every, t_end);
    std::iter::from_fn(|| times.due(t_end)).collect()
}

impl Curves {
    /// Returns the RMS over time of p̄ ∂u/∂p divided by the RMS of u, for each output u and parameter p. This is the
    /// relative change of u if p changes by its typical size. Samples without a derivative are excluded. The result is
    /// NaN if the output is always zero or has no derivatives.
    pub fn importance(&self) -> Vec<Vec<f64>> {
        let ratio = |j: usize, k: usize| {
            let both = self.samples.iter().map(|s| [s.derivatives[j][k], s.values[k]]);
            let known = both.filter(|[derivative, _]| !derivative.is_nan());
            let sums = known.fold([0.0; 2], |[d, u], [derivative, value]| {
                [d + derivative * derivative, u + value * value]
            });
            (sums[0] / sums[1]).sqrt()
        };
        let output = |k: usize| {
            let scales = self.scales.iter().enumerate();
            scales.map(|(j, scale)| scale * ratio(j, k)).collect()
        };
        (0..self.outputs.len()).map(output).collect()
    }

    /// Returns the column names: the time or load factor, the outputs, and d OUTPUT/d PARAMETER.
    pub fn columns(&self) -> Vec<String> {
        let derivatives = self.outputs.iter().flat_map(|output| {
            let by = move |parameter: &String| format!("d {output}/d {parameter}");
            self.parameters.iter().map(by)
        });
        let abscissa = std::iter::once(self.abscissa.name().to_owned());
        abscissa.chain(self.outputs.iter().cloned()).chain(derivatives).collect()
    }

    pub fn rows(&self) -> Vec<Vec<f64>> {
        let row = |sample: &Sample| {
            let mut row = vec![sample.t];
            row.extend(&sample.values);
            for k in 0..self.outputs.len() {
                row.extend(sample.derivatives.iter().map(|of_p| of_p[k]));
            }
            row
        };
        self.samples.iter().map(row).collect()
    }

    /// Returns the body of the JSON document.
    pub fn document(&self) -> Value {
        json!({
            "parameters": self.parameters,
            "scales": self.scales,
            "outputs": self.outputs,
            "importance": self.importance(),
            "cost": self.cost,
            "columns": self.columns(),
            "rows": self.rows(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests outputs with a kink at one of three samples, and an output without derivatives.
    #[test]
    fn samples_without_a_derivative_are_excluded() {
        let sample = |t: f64, values: [f64; 2], derivatives: [f64; 2]| Sample {
            t,
            values: values.into(),
            derivatives: vec![derivatives.into()],
        };
        let curves = Curves {
            abscissa: Abscissa::Time,
            parameters: vec!["p".to_owned()],
            outputs: vec!["u".to_owned(), "v".to_owned()],
            scales: vec![10.0],
            samples: vec![
                sample(0.0, [5.0, 1.0], [f64::NAN; 2]),
                sample(1.0, [2.0, 1.0], [1.0, f64::NAN]),
                sample(2.0, [2.0, 1.0], [-1.0, f64::NAN]),
            ],
            cost: Cost::default(),
        };
        let importance = curves.importance();
        assert_eq!(importance[0], [5.0]);
        assert!(importance[1][0].is_nan());
    }
}
