//! Typical magnitudes of a body's unknowns, from its size, stiffness, density and loads.

use myovib_fem::Law;

use super::settings::AbsoluteTolerances;
use crate::analysis::support::extent;
use crate::muscle::Muscle;
use crate::muscle::activation::Activation;
use crate::signal::Signal;

/// Number of intervals at which loads are sampled. It is prime: a load with a round number of periods would vanish at all
/// times of a round number of samples.
const INTERVALS: u32 = 997;
/// Maximum number of breaks of a load around which it is sampled too.
const BREAKS: usize = 100;
/// Approximate number of moved components of which the motion is sampled.
const MOVED: usize = 100;
/// Ratio of an absolute tolerance to the relative tolerance of a typical magnitude: unknowns below a tenth of it have the
/// absolute accuracy of that tenth.
const SMALL: f64 = 0.1;
/// Typical strain of a body that starts at rest and on which nothing acts that has a size, such as a feedback alone.
const UNKNOWN_STRAIN: f64 = 1e-2;

/// Typical magnitudes of the unknowns of a body.
///
/// They follow from a strain ε, the largest of
/// - σ/G with the stress σ = f L/V + T and the shear modulus G (σ if it exceeds G); f is the sum of the magnitudes of
///   the nodal forces on the body at rest, L its length, V its volume and T its active tension,
/// - a prescribed displacement divided by L,
/// - displacements divided by L, and velocities divided by the speed c = √(G/ρ) of shear waves, at the start,
///
/// and at most 1. A load and its response thus have the same ratio in all units and, for small strains, for all magnitudes
/// of the load. Slender bodies bend farther than εL; their tolerances are on the safe side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TypicalValues {
    /// ε L, m.
    pub displacement: f64,
    /// ε c, m/s.
    pub velocity: f64,
    /// ε G, Pa.
    pub pressure: f64,
    /// ε G c/L, Pa/s.
    pub pressure_rate: f64,
}

impl TypicalValues {
    /// Returns the magnitudes for the loads of `muscle` up to the time `t_end` (s). `start` contains the largest
    /// displacement (m) and velocity (m/s) at the start.
    pub fn of(muscle: &Muscle, t_end: f64, start: [f64; 2]) -> Self {
        let solid = &muscle.solid;
        let (length, volume) = (extent(muscle), solid.volume());
        let stress = total_force(muscle, t_end) * length / volume + tension(muscle, t_end);
        let modulus = mean_shear_modulus(muscle)
            .max(stress)
            .max(f64::MIN_POSITIVE);
        let speed = (modulus / mean_density(muscle)).sqrt();
        let moved = muscle
            .prescribed
            .iter()
            .step_by(1 + muscle.prescribed.len() / MOVED);
        let moved = moved.map(|prescribed| largest(&prescribed.signal, t_end));
        let moved = moved.fold(start[0], f64::max);
        let strain = (stress / modulus)
            .max(moved / length)
            .max(start[1] / speed)
            .min(1.0);
        let strain = if strain > 0.0 { strain } else { UNKNOWN_STRAIN };
        Self {
            displacement: strain * length,
            velocity: strain * speed,
            pressure: strain * modulus,
            pressure_rate: strain * modulus * speed / length,
        }
    }

    /// Returns the absolute tolerances with the relative tolerance `rtol` of a tenth of these magnitudes.
    pub fn tolerances(&self, rtol: f64) -> AbsoluteTolerances {
        let fraction = SMALL * rtol;
        AbsoluteTolerances {
            displacement: fraction * self.displacement,
            velocity: fraction * self.velocity,
            pressure: fraction * self.pressure,
            multiplier: fraction * self.pressure_rate,
        }
    }
}

/// Returns the time in which shear waves cross the body, s.
pub(crate) fn transit_time(muscle: &Muscle) -> f64 {
    extent(muscle) / (mean_shear_modulus(muscle) / mean_density(muscle)).sqrt()
}

/// Returns the shear modulus of the mean compliance over the volume (Reuss average), Pa.
fn mean_shear_modulus(muscle: &Muscle) -> f64 {
    let (solid, mesh) = (&muscle.solid, muscle.solid.space().mesh());
    let (mut compliance, mut volume) = (0.0, 0.0);
    let mut last: Option<(&Law, f64)> = None;
    for (element, law) in solid.laws().iter().enumerate() {
        let shear = match last {
            Some((same, shear)) if same == law => shear,
            _ => law.moduli()[1],
        };
        last = Some((law, shear));
        let measure = mesh.measure_of(element);
        compliance += measure / (solid.mean_factor(element) * shear);
        volume += measure;
    }
    volume / compliance
}

/// Returns the mean density, kg/m³, also for a body whose inertia is neglected.
pub(crate) fn mean_density(muscle: &Muscle) -> f64 {
    let (solid, mesh) = (&muscle.solid, muscle.solid.space().mesh());
    let densities = solid.densities().iter().enumerate();
    let masses = densities.map(|(element, density)| density * mesh.measure_of(element));
    masses.sum::<f64>() / solid.volume()
}

/// Returns the sum of the magnitudes of the nodal forces of all loads, N, each at its largest value up to the time `t_end`.
fn total_force(muscle: &Muscle, t_end: f64) -> f64 {
    let loads = muscle.loads.iter();
    let mut total: f64 = loads
        .map(|load| load.magnitude() * largest(load.signal(), t_end))
        .sum();
    let n = muscle.solid.space().n_components();
    for load in &muscle.surface_loads {
        total += load.magnitude(n) * largest(load.signal(), t_end);
    }
    total
}

/// Returns the largest active tension, Pa.
fn tension(muscle: &Muscle, t_end: f64) -> f64 {
    let tensions = muscle
        .activations
        .iter()
        .map(|(_, activation)| match activation {
            Activation::Given(signal) => largest(signal, t_end),
            Activation::Bestel(model) => model.tension,
            Activation::Coherence { unsynchronized } => *unsynchronized,
            Activation::Line { tension, .. } => *tension,
        });
    tensions.fold(0.0, |most, tension| most.max(tension.abs()))
}

/// Returns the largest magnitude of a function between 0 and `t_end` at samples and around its breaks.
fn largest(signal: &Signal, t_end: f64) -> f64 {
    let uniform = (0..=INTERVALS).map(|i| t_end * f64::from(i) / f64::from(INTERVALS));
    let mut breaks = vec![0.0];
    breaks.extend(signal.breaks(0.0, t_end).take(BREAKS).map(|at| at.t));
    let between = breaks.windows(2).map(|two| 0.5 * (two[0] + two[1]));
    let times = uniform.chain(between).chain(breaks.iter().copied());
    times.fold(0.0, |most, t| most.max(signal.at(t).value.abs()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use myovib_fem::{DofMap, Solid, Space, generate, load};

    use super::*;
    use crate::muscle::load::Load;
    use crate::muscle::parameters::Parameters;

    fn typical(scale: [f64; 3], amplitude: f64) -> TypicalValues {
        // Units of length, time and mass in m, s and kg.
        let [length, time, mass] = scale;
        let pressure = mass / (length * time * time);
        let mesh = generate::beam(0.1 / length, 0.02 / length, [4, 1]).unwrap();
        let space = Arc::new(Space::taylor_hood(&mesh));
        let nodes = space.nodes_of("fixed").unwrap();
        let dofs = DofMap::clamped(&space, &nodes).unwrap();
        let law = Law::MooneyRivlin {
            c10: 5e3 / pressure,
            c01: 0.0,
        };
        let density = 1e3 * length.powi(3) / mass;
        let load = load::traction(&space, "load", [0.0, 1.0]).unwrap();
        let solid = Solid::uniform(space, dofs, law, density).unwrap();
        let parameters = Parameters::new(0.0, 0.0, 1e6 / pressure).unwrap();
        let mut muscle = Muscle::unloaded(solid, parameters);
        let signal = Signal::constant(amplitude / pressure);
        muscle.loads = vec![Load::new(&load, signal)];
        TypicalValues::of(&muscle, 1.0 / time, [0.0; 2])
    }

    /// Regression: absolute tolerances were numbers of SI units, and the same body in other units took up to 70 times as
    /// many steps.
    #[test]
    fn magnitudes_follow_units_and_loads() {
        let si = typical([1.0, 1.0, 1.0], 50.0);
        // Σ|f| = 50 Pa × 0.02 m; × L/V = × 0.1 m/(0.1 m × 0.02 m): σ = 50 Pa, and G = 1e4 Pa.
        let expected = TypicalValues {
            displacement: 5e-3 * 0.1,
            velocity: 5e-3 * 10_f64.sqrt(),
            pressure: 50.0,
            pressure_rate: 50.0 * 10_f64.sqrt() / 0.1,
        };
        for scale in [[1.0, 1.0, 1.0], [1e-3, 1.0, 1e3], [1e-6, 1e-6, 1e-12]] {
            let [length, time, mass] = scale;
            let pressure = mass / (length * time * time);
            for factor in [1.0, 1e-3] {
                let found = typical(scale, 50.0 * factor);
                for (found, expected) in [
                    (found.displacement * length, expected.displacement),
                    (found.velocity * length / time, expected.velocity),
                    (found.pressure * pressure, expected.pressure),
                    (
                        found.pressure_rate * pressure / time,
                        expected.pressure_rate,
                    ),
                ] {
                    // Sums of tens of rounded terms.
                    let error = (found / (factor * expected) - 1.0).abs();
                    assert!(error < 1e-13, "{scale:?}: {found} {expected}");
                }
            }
        }
        // A few roundings.
        let pressure = si.tolerances(1e-3).pressure;
        assert!((pressure / (1e-4 * si.pressure) - 1.0).abs() < 1e-15);
        // Stresses above the modulus.
        assert_eq!(typical([1.0; 3], 1e6).displacement, 0.1);
        assert_eq!(typical([1.0; 3], 0.0).displacement, 0.1 * UNKNOWN_STRAIN);
    }
}
