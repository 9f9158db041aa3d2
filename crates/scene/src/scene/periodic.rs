//! Checks for a periodic state: its frequency, and the periodicity of the loads.

use myovib_model::{IntegratorKind, RodDae, Signal};

use super::Body;
use super::builder::Builder;
use super::contraction::chains_that_act;
use crate::InputError;
use crate::scene_file::integrator::IntegratorSettings;

/// Number of times per period at which values are compared. It is prime, because harmonics of a load may vanish at
/// simple fractions of its period.
const TIMES: u32 = 97;
/// Numbers of periods after which the loads are compared with their earlier values.
const PERIODS: [f64; 3] = [1.0, 2.0, 7.0];
/// Maximum number of times that the number of periods is doubled in the search for a time from which rising loads
/// repeat.
const DOUBLINGS: i32 = 16;
/// Allowed change of a load after a period, relative to its maximum. It covers the rounding of a frequency such as
/// 33.333.
const CHANGE: f64 = 1e-6;
/// If a load grows by more than this fraction of its maximum over many periods, it does not repeat yet. The fraction is
/// larger than the error of a maximum of sampled values.
const GROWTH: f64 = 0.1;

/// Rounding of a constant load, relative to its maximum.
const ROUNDING: f64 = 1e-12;

/// Replaces BDF by the default method, because finite differences of the period map require small errors. Returns a note
/// if the method was replaced.
pub(super) fn without_bdf(wanted: &mut IntegratorSettings) -> Option<String> {
    (wanted.method == IntegratorKind::Bdf).then(|| {
        let default = IntegratorSettings::default();
        wanted.method = default.method;
        wanted.multiplier_weights = default.multiplier_weights;
        wanted.max_order = default.max_order;
        wanted.projection_interval = default.projection_interval;
        let name = wanted.method.name();
        format!("a periodic state is computed by {name} instead of integrator.method = \"bdf\"")
    })
}

impl Builder<'_> {
    /// Returns the frequency (Hz) of the periodic state, and the start (s) of a period from which the loads repeat.
    ///
    /// # Errors
    /// Fails if a part of the scene does not support periodic states, or if the loads have no common period.
    pub(super) fn periodic(
        &self,
        body: Option<&Body>,
        rod: Option<&RodDae>,
    ) -> Result<[f64; 2], InputError> {
        if let Some(chain) = chains_that_act(self.file).next() {
            let error = InputError::new(format!(
                "the chain `{chain}` acts on the body: such periodic states are not supported"
            ));
            let error = error.next("remove the feedback, or use analysis = \"dynamic\"");
            return Err(self.wrong("analysis", error));
        }
        if body.is_some_and(|body| body.muscle.models().next().is_some()) {
            let error = InputError::new(
                "the activation model `bestel` describes a single beat, which does not repeat",
            );
            let error = error.next("use a tension of type = \"given\"");
            return Err(self.wrong("analysis", error));
        }
        let of_energy = |(i, probe): (usize, &crate::scene_file::output::Probe)| {
            let is_energy = matches!(probe.kind, crate::probe::ProbeKind::Energy(_));
            is_energy.then_some(i)
        };
        if let Some(i) = self.file.probe.iter().enumerate().find_map(of_energy) {
            let error = InputError::new("an energy balance requires an analysis from its start");
            let error = error.next("remove this probe, or use analysis = \"dynamic\"");
            return Err(self.wrong(&format!("probe[{i}].type"), error));
        }
        let signals = signals(body, rod);
        let periodic = self.file.periodic.clone().unwrap_or_default();
        let frequency = match periodic.frequency {
            Some(frequency) => frequency,
            None => self.only_frequency(&signals)?,
        };
        let change_from = |start: f64| {
            let mut signals = signals.iter();
            signals.find_map(|(path, signal)| Some((path, change(signal, start, frequency)?)))
        };
        let starts: Vec<f64> = match periodic.start_time {
            Some(start) => vec![start],
            None => {
                let periods = (0..DOUBLINGS).map(|k| f64::from(1 << k) / frequency);
                std::iter::once(0.0).chain(periods).collect()
            }
        };
        let mut first = None;
        for start in starts {
            match change_from(start) {
                None if signals.iter().all(|(_, signal)| is_constant(signal, start, frequency)) => {
                    return Err(self.no_periodic_load());
                }
                None => return Ok([frequency, start]),
                Some(change) => first = first.or(Some(change)),
            }
        }
        let Some((path, (t, change))) = first else {
            return Ok([frequency, 0.0]);
        };
        let error = InputError::new(format!(
            "the load does not repeat after 1/{frequency} s: it changes by {change:.1e} at t = {t:.4} s"
        ));
        let error = error
            .allowed("constants, and sines with multiples of this frequency")
            .next("set periodic.frequency; all load frequencies must be multiples of it");
        Err(self.wrong(path, error))
    }

    fn no_periodic_load(&self) -> InputError {
        let error = InputError::new("no load or displacement is periodic");
        let error = error.next(
            "use a sine for one of them, for example y = { type = \"sine\", amplitude = 100.0, \
             frequency = 8.0 } in a [[traction]]",
        );
        self.wrong("analysis", error)
    }

    /// Returns the common frequency (Hz) of all periodic loads.
    fn only_frequency(&self, signals: &[(String, &Signal)]) -> Result<f64, InputError> {
        let frequencies = signals.iter().filter_map(|(_, signal)| signal.frequency());
        let mut frequencies: Vec<f64> = frequencies.collect();
        frequencies.sort_by(f64::total_cmp);
        frequencies.dedup();
        match frequencies[..] {
            [frequency] => Ok(frequency),
            [] => Err(self.no_periodic_load()),
            _ => {
                let frequencies: Vec<String> = frequencies.iter().map(f64::to_string).collect();
                let error = InputError::new("the loads have several frequencies")
                    .found(format!("{} Hz", frequencies.join(", ")))
                    .next(
                        "set periodic.frequency in Hz; all load frequencies must be multiples of it",
                    );
                Err(self.wrong("analysis", error))
            }
        }
    }
}

/// Returns whether a function has the same value throughout a period.
fn is_constant(signal: &Signal, start: f64, frequency: f64) -> bool {
    let time = |i: u32| start + (f64::from(i) + 0.5) / f64::from(TIMES) / frequency;
    let values = || (0..TIMES).map(|i| signal.at(time(i)).value);
    let largest = values().map(f64::abs).fold(0.0, f64::max);
    let first = signal.at(time(0)).value;
    values().all(|value| (value - first).abs() <= ROUNDING * largest)
}

/// Returns the functions of time of the loads and motions with their paths in the scene.
fn signals<'a>(body: Option<&'a Body>, rod: Option<&'a RodDae>) -> Vec<(String, &'a Signal)> {
    let mut signals = Vec::new();
    if let Some(body) = body {
        let muscle = &body.muscle;
        let mut keys = body.load_keys.clone();
        let motions = std::iter::repeat_n("prescribed_displacement", muscle.prescribed.len());
        keys.extend(motions.map(str::to_owned));
        // The remaining signals belong to obstacles and tensions.
        let keys = keys.into_iter().chain(std::iter::repeat("analysis".to_owned()));
        signals.extend(keys.zip(muscle.signals()));
    }
    signals.extend(rod.map(|rod| ("rod.load".to_owned(), rod.signal())));
    signals
}

/// Returns a time at which a load does not repeat, and the amount of the change.
fn change(signal: &Signal, start: f64, frequency: f64) -> Option<(f64, f64)> {
    let period = 1.0 / frequency;
    let times = |start: f64| {
        (0..TIMES).map(move |i| start + period * (f64::from(i) + 0.5) / f64::from(TIMES))
    };
    let value = |t: f64| signal.at(t).value;
    let largest_from = |start: f64| times(start).map(|t| value(t).abs()).fold(0.0, f64::max);
    let largest = largest_from(start);
    // A load may be zero for many periods before it starts.
    let growth = (0..DOUBLINGS).find_map(|k| {
        let later = start + f64::from(1 << k) * period;
        let change = largest_from(later) - largest;
        (change > GROWTH * largest).then_some((later, change))
    });
    if growth.is_some() {
        return growth;
    }
    let mut changes = times(start).flat_map(|t| {
        let later = PERIODS.map(|n| (t, (value(t + n * period) - value(t)).abs()));
        later.into_iter()
    });
    changes.find(|(_, change)| *change > CHANGE * largest || change.is_nan())
}
