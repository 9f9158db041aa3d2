//! A probe of the scene: what it measures, and the CSV file it fills.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use myovib_fem::rod::PointValue;
use myovib_model::{Measurement, ModelError, SampleTimes};
use myovib_oscillators::Coherence;

use super::cut::cut;
use super::energy::EnergyBalance;
use super::folder::table_of;
use super::system::{System, muscle_of, stress_needs_rates};
use crate::atomic_file;
use crate::csv::{CsvWriter, Written};
use crate::scene::Scene;
use crate::scene_file::feedback::Feedback;
use crate::scene_file::output::{Probe, ProbeKind};
use crate::{Error, InputError};

/// What a probe measures.
pub(crate) enum What {
    /// Values at places, or averages.
    Places(Vec<Measurement>),
    /// The sum of support forces over these nodes, in so many dimensions.
    Reaction(Vec<usize>, usize),
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

impl What {
    /// What `kind` means in this scene, whose parts have been checked to be there.
    pub(crate) fn new(kind: &ProbeKind, scene: &Scene) -> Result<Self, ModelError> {
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
            ProbeKind::Point { at, quantities } => one(Measurement::at(space()?, at, quantities)?),
            ProbeKind::Average { group, quantities } => {
                one(Measurement::average(space()?, group, quantities)?)
            }
            ProbeKind::Line {
                from,
                to,
                points,
                quantities,
            } => {
                let space = space()?;
                let place = |i: usize| {
                    let s = i as f64 / (points - 1) as f64;
                    let ends = from.iter().zip(to);
                    ends.map(|(a, b)| (1.0 - s) * a + s * b)
                        .collect::<Vec<f64>>()
                };
                let measure = |i| Measurement::at(space, place(i), quantities);
                Ok(Self::Places(
                    (0..*points).map(measure).collect::<Result<_, _>>()?,
                ))
            }
            ProbeKind::Reaction { group } => {
                let space = space()?;
                Ok(Self::Reaction(space.nodes_of(group)?, space.dimension()))
            }
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
    pub(crate) fn names(&self) -> Vec<String> {
        match self {
            Self::Places(one) if one.len() == 1 => one[0].names(),
            Self::Places(several) => several
                .iter()
                .enumerate()
                .flat_map(|(i, m)| m.names().into_iter().map(move |name| format!("{name}_{i}")))
                .collect(),
            Self::Reaction(_, dimension) => {
                let names = ["R_x", "R_y", "R_z"].into_iter().take(*dimension);
                names.map(str::to_owned).collect()
            }
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

    /// Names of all columns.
    pub(super) fn columns(&self) -> Vec<String> {
        std::iter::once("t".to_owned())
            .chain(self.names())
            .collect()
    }

    /// Whether ẏ is needed.
    pub(crate) fn needs_rates<P: System + ?Sized>(&self, system: &mut P, y: &[f64]) -> bool {
        match self {
            Self::Reaction(..) => true,
            Self::Places(measurements) => {
                measurements.iter().any(Measurement::has_stress) && stress_needs_rates(system, y)
            }
            _ => false,
        }
    }

    /// Whether the column with this number is an angle, which jumps by a full turn.
    pub(super) fn is_angle(&self, column: usize) -> bool {
        matches!(self, Self::Coherence(_)) && column == 1
    }

    /// Whether it is a function of the state, and not of the time before it.
    pub(crate) fn is_of_state(&self) -> bool {
        !matches!(self, Self::Energy(_))
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
    pub(crate) fn values<P: System + ?Sized>(
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
                let rates = y_dot.get(range.clone()).unwrap_or_default();
                let snapshot = dae.snapshot(t, &y[range], rates);
                let mut values = Vec::new();
                for measurement in measurements {
                    measurement.read(&snapshot, &mut values);
                }
                Ok(values)
            }
            Self::Reaction(nodes, dimension) => {
                let (dae, range) = muscle_of(system, y)?;
                let force = dae.unbalanced_force(t, &y[range.clone()], &y_dot[range])?;
                let sum = |axis| {
                    nodes
                        .iter()
                        .map(|node| force[dimension * node + axis])
                        .sum()
                };
                Ok((0..*dimension).map(sum).collect())
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
            // Those of tensions come after.
            Self::Feedback(names) => Ok(system.factors(y)[..names.len()].to_vec()),
            Self::Rod(point) => {
                let n = system.rod().map_or(0, |rod| rod.rod().n_free());
                Ok(vec![point.of(&y[..n]), point.of(&y[n..2 * n])])
            }
        }
    }
}

/// What the probes measure, located in the mesh.
pub(super) fn measurements(scene: &Scene) -> Result<Vec<What>, InputError> {
    let probes = scene.file.probe.iter().enumerate();
    probes
        .map(|(i, probe)| scene.at(&format!("probe[{i}]"), What::new(&probe.kind, scene)))
        .collect()
}

/// A probe with its file and its times.
pub(super) struct Recorder {
    pub(super) times: SampleTimes,
    pub(super) what: What,
    path: PathBuf,
    csv: CsvWriter<File>,
}

impl Recorder {
    /// Begins the probe's file, of which there is none.
    pub(super) fn new(probe: &Probe, what: What, t_end: f64, folder: &Path) -> Result<Self, Error> {
        let path = folder.join(table_of(&probe.name));
        let names = what.columns();
        let header: Vec<&str> = names.iter().map(String::as_str).collect();
        // What lies there was removed; what has come since, a link for one, is not followed.
        let csv = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&path)
            .and_then(|file| CsvWriter::new(file, &header))
            .map_err(Error::file("write", &path))?;
        Ok(Self {
            times: SampleTimes::new(probe.every, t_end),
            what,
            path,
            csv,
        })
    }

    /// Goes on with the probe's file after what a checkpoint counts on; the rows beyond are cut.
    /// Says so when they were not whole.
    pub(super) fn resumed(
        probe: &Probe,
        what: What,
        t_end: f64,
        folder: &Path,
        written: &Written,
    ) -> Result<(Self, Option<String>), Error> {
        let path = folder.join(table_of(&probe.name));
        let (file, note) = cut(&path, written)?;
        let times = SampleTimes::new(probe.every, t_end).skip(written.rows);
        let n_columns = what.names().len() + 1;
        let recorder = Self {
            times,
            what,
            path,
            csv: CsvWriter::continued(file, n_columns, written.clone()),
        };
        Ok((recorder, note))
    }

    /// Writes a row.
    pub(super) fn write(&mut self, t: f64, values: &[f64]) -> Result<(), ModelError> {
        let row: Vec<f64> = std::iter::once(t).chain(values.iter().copied()).collect();
        let written = self.csv.row(&row);
        written.map_err(|error| cannot_write(&self.path, error))
    }

    /// What is in the file.
    pub(super) fn written(&self) -> &Written {
        self.csv.written()
    }

    /// Waits until the rows are on the disk, in the file that has the probe's name.
    pub(super) fn sync(&self) -> Result<(), ModelError> {
        // A file that was removed takes rows as long as it is open, and they are lost.
        let checked = fs::symlink_metadata(&self.path).and_then(|there| {
            match there.len() == self.written().bytes {
                true => atomic_file::sync(self.csv.sink()),
                false => Err(io::Error::other("it was changed while the run went on")),
            }
        });
        checked.map_err(|error| cannot_write(&self.path, error))
    }
}

/// What the system said, with the file's name.
pub(super) fn cannot_write(path: &Path, error: io::Error) -> ModelError {
    let message = format!("cannot write `{}`: {error}", path.display());
    ModelError::Output(io::Error::new(error.kind(), message))
}
