//! A probe of the scene: what it measures, and the CSV file it fills.

use std::fs::{self, File, OpenOptions};
use std::path::Path;

use anyhow::Context;
use myovib_fem::rod::PointValue;
use myovib_model::{Measurement, ModelError, Quantity, SampleTimes};
use myovib_oscillators::Coherence;

use super::energy::EnergyBalance;
use super::system::{System, muscle_of};
use crate::csv::CsvWriter;
use crate::scene::Scene;
use crate::scene_file::feedback::Feedback;
use crate::scene_file::output::{self, Probe, ProbeKind};

/// What a probe measures.
pub(super) enum What {
    /// Values at places, or averages.
    Places(Vec<Measurement>),
    /// The sum of support forces over these nodes.
    Reaction(Vec<usize>),
    /// Energies.
    Energy(EnergyBalance),
    /// Order parameters of a network.
    Coherence(usize),
    /// States of a network of so many oscillators.
    Oscillators(usize, usize),
    /// The factors of the stiffness that the feedbacks give, by these names.
    Feedback(Vec<String>),
    /// Displacement and velocity of the rod at a position.
    Rod(PointValue),
}

/// The quantities of the model that a scene names.
pub(super) fn quantities(names: &[output::Quantity]) -> Vec<Quantity> {
    let quantity = |name: &output::Quantity| match name {
        output::Quantity::U => Quantity::Displacement,
        output::Quantity::V => Quantity::Velocity,
        output::Quantity::P => Quantity::Pressure,
        output::Quantity::J => Quantity::VolumeRatio,
        output::Quantity::Stress => Quantity::Stress,
        output::Quantity::VonMises => Quantity::VonMises,
    };
    names.iter().map(quantity).collect()
}

impl What {
    /// What `kind` means in this scene, whose parts have been checked to be there.
    pub(super) fn new(kind: &ProbeKind, scene: &Scene) -> Result<Self, ModelError> {
        let space = || match &scene.body {
            Some(body) => Ok(body.muscle.solid.space()),
            None => Err(ModelError::NoSuchPart { part: "muscle" }),
        };
        let network = |name: &str| {
            let found = scene.chains.iter().position(|chain| chain.name == name);
            found.ok_or(ModelError::NoSuchPart {
                part: "chain of that name",
            })
        };
        let one = |measurement| Ok(Self::Places(vec![measurement]));
        match kind {
            ProbeKind::Point {
                at,
                quantities: names,
            } => one(Measurement::at(space()?, *at, &quantities(names))?),
            ProbeKind::Average {
                group,
                quantities: names,
            } => one(Measurement::average(space()?, group, &quantities(names))?),
            ProbeKind::Line {
                from,
                to,
                points,
                quantities: names,
            } => {
                let (space, quantities) = (space()?, quantities(names));
                let place = |i: usize| {
                    let s = i as f64 / (points - 1) as f64;
                    [0, 1].map(|axis| (1.0 - s) * from[axis] + s * to[axis])
                };
                let measure = |i| Measurement::at(space, place(i), &quantities);
                Ok(Self::Places(
                    (0..*points).map(measure).collect::<Result<_, _>>()?,
                ))
            }
            ProbeKind::Reaction { group } => Ok(Self::Reaction(space()?.nodes_of(group)?)),
            ProbeKind::Energy => Ok(Self::Energy(EnergyBalance::default())),
            ProbeKind::Coherence { chain } => Ok(Self::Coherence(network(chain)?)),
            ProbeKind::Oscillators { chain } => {
                let k = network(chain)?;
                Ok(Self::Oscillators(k, scene.chains[k].chain.omega.len()))
            }
            ProbeKind::Feedback => {
                let feedbacks = scene.file.feedback.iter();
                let factor = |feedback: &Feedback| format!("factor_{}", feedback.chain);
                Ok(Self::Feedback(feedbacks.map(factor).collect()))
            }
            ProbeKind::Rod { at } => match &scene.rod {
                Some(rod) => Ok(Self::Rod(rod.rod().displacement_at(*at)?)),
                None => Err(ModelError::NoSuchPart { part: "rod" }),
            },
        }
    }

    /// Names of the columns after the time.
    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Self::Places(one) if one.len() == 1 => {
                one[0].names().into_iter().map(str::to_owned).collect()
            }
            Self::Places(several) => several
                .iter()
                .enumerate()
                .flat_map(|(i, m)| m.names().into_iter().map(move |name| format!("{name}_{i}")))
                .collect(),
            Self::Reaction(_) => ["R_x", "R_y"].map(str::to_owned).into(),
            Self::Energy(_) => EnergyBalance::NAMES.map(str::to_owned).into(),
            Self::Coherence(_) => ["Psi_abs", "Psi_arg", "chi_abs"].map(str::to_owned).into(),
            Self::Oscillators(_, n) => {
                let numbered = |letter| (1..=*n).map(move |i| format!("{letter}_{i}"));
                numbered("y").chain(numbered("w")).collect()
            }
            Self::Feedback(names) => names.clone(),
            Self::Rod(_) => ["u", "v"].map(str::to_owned).into(),
        }
    }

    /// Whether ẏ is needed.
    pub(super) fn needs_rates(&self) -> bool {
        matches!(self, Self::Reaction(_))
    }

    /// How many places have a stress computed for one row.
    pub(super) fn stress_evaluations(&self) -> u64 {
        match self {
            Self::Places(measurements) => measurements
                .iter()
                .map(|m| m.stress_evaluations() as u64)
                .sum(),
            _ => 0,
        }
    }

    /// The values at a time; an energy balance gives those of the time it was advanced to.
    pub(super) fn values<P: System + ?Sized>(
        &self,
        system: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let no_network = ModelError::NoSuchPart { part: "chain" };
        match self {
            Self::Places(measurements) => {
                let (dae, range) = muscle_of(system, y)?;
                let snapshot = dae.snapshot(t, &y[range]);
                let mut values = Vec::new();
                for measurement in measurements {
                    measurement.read(&snapshot, &mut values);
                }
                Ok(values)
            }
            Self::Reaction(nodes) => {
                let (dae, range) = muscle_of(system, y)?;
                let force = dae.unbalanced_force(t, &y[range.clone()], &y_dot[range])?;
                let sum = |axis| nodes.iter().map(|node| force[2 * node + axis]).sum();
                Ok(vec![sum(0), sum(1)])
            }
            Self::Energy(balance) => Ok(balance.row().into()),
            Self::Coherence(k) => {
                let (network, range) = system.network(*k).ok_or(no_network)?;
                let (position, velocity) = y[range].split_at(network.n_oscillators());
                let coherence = Coherence::new(network.omega(), position, velocity);
                let centroid = coherence.centroid;
                Ok(vec![
                    centroid.norm(),
                    centroid.arg(),
                    coherence.phase.norm(),
                ])
            }
            Self::Oscillators(k, _) => {
                let (_, range) = system.network(*k).ok_or(no_network)?;
                Ok(y[range].to_vec())
            }
            Self::Feedback(_) => Ok(system.stiffness_factors(y)),
            Self::Rod(point) => {
                let n = system.rod().map_or(0, |rod| rod.rod().n_free());
                Ok(vec![point.of(&y[..n]), point.of(&y[n..2 * n])])
            }
        }
    }
}

/// A probe with its file and its times.
pub(super) struct Recorder {
    pub(super) times: SampleTimes,
    pub(super) what: What,
    csv: CsvWriter<File>,
}

impl Recorder {
    /// Opens the probe's file; a run that goes on at `resume_at` keeps the rows up to there.
    pub(super) fn open(
        probe: &Probe,
        what: What,
        t_end: f64,
        folder: &Path,
        resume_at: Option<f64>,
    ) -> anyhow::Result<Self> {
        let path = folder.join(format!("{}.csv", probe.name));
        let context = || format!("cannot write {}", path.display());
        let names = what.names();
        let header: Vec<&str> = std::iter::once("t")
            .chain(names.iter().map(String::as_str))
            .collect();
        let times = SampleTimes::new(probe.every, t_end);
        let (csv, times) = match resume_at {
            None => {
                let file = File::create(&path).with_context(context)?;
                (CsvWriter::new(file, &header).with_context(context)?, times)
            }
            Some(t) => {
                let rows = keep_rows(&path, t)?;
                let file = OpenOptions::new()
                    .append(true)
                    .open(&path)
                    .with_context(context)?;
                (CsvWriter::continued(file, header.len()), times.skip(rows))
            }
        };
        Ok(Self { times, what, csv })
    }

    /// Writes a row.
    pub(super) fn write(&mut self, t: f64, values: &[f64]) -> Result<(), ModelError> {
        let row: Vec<f64> = std::iter::once(t).chain(values.iter().copied()).collect();
        Ok(self.csv.row(&row)?)
    }
}

/// Cuts a CSV file after the last whole row with a time up to `t`; the number of rows that stay.
fn keep_rows(path: &Path, t: f64) -> anyhow::Result<u64> {
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let time = |line: &str| {
        line.split(',')
            .next()
            .and_then(|word| word.parse::<f64>().ok())
    };
    let belongs = |line: &&str| line.ends_with('\n') && time(line).is_some_and(|time| time <= t);
    let mut lines = text.split_inclusive('\n');
    let header = lines.next().unwrap_or_default();
    let rows: Vec<&str> = lines.take_while(belongs).collect();
    let kept = header.to_owned() + &rows.concat();
    crate::atomic_file::save(path, kept)?;
    Ok(rows.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_after_the_checkpoint_and_torn_lines_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("origin.csv");
        fs::write(&path, "t,u\n0.0,1\n1.0,2\n2.0,3\n2.5,").unwrap();
        assert_eq!(keep_rows(&path, 1.5).unwrap(), 2);
        assert_eq!(fs::read_to_string(&path).unwrap(), "t,u\n0.0,1\n1.0,2\n");
        fs::write(&path, "t,u\n0.0,1\n1.0").unwrap();
        assert_eq!(keep_rows(&path, 1.5).unwrap(), 1);
    }
}
