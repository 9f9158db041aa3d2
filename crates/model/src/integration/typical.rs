//! Typical magnitudes of a body's unknowns, estimated from its size, stiffness, density and loads.

use myovib_fem::Law;

use super::settings::AbsoluteTolerances;
use crate::analysis::support::extent;
use crate::muscle::Muscle;
use crate::muscle::activation::Activation;
use crate::signal::Signal;

/// Number of intervals at which loads are sampled. It is prime: with a round number of samples, a load with a round
/// number of periods could vanish at all sample times.
const INTERVALS: u32 = 997;
/// Maximum number of breaks of a load at which, and between which, the load is also sampled.
const BREAKS: usize = 100;
/// Approximate number of prescribed components whose motion is sampled.
const MOVED: usize = 100;
/// Ratio of an absolute tolerance to the product of the relative tolerance and a typical magnitude. Unknowns below a
/// tenth of the typical magnitude are computed with the same absolute accuracy as this tenth.
const SMALL: f64 = 0.1;
/// Typical strain of a body that starts at rest and has no load with a known size, such as a body with feedback alone.
const UNKNOWN_STRAIN: f64 = 1e-2;
/// Smallest resolved change of the strain, relative to the strain under all loads. Rounding errors are far smaller.
const SMALLEST_CHANGE: f64 = 1e-6;

/// Typical magnitudes of the unknowns of a body.
///
/// They follow from a strain ε. It is the largest of the following values, but at most 1:
/// - σ/G with the stress σ = f L/V + T and the shear modulus G (σ if it exceeds G), where f is the sum of the
///   magnitudes of the nodal force components on the body at rest, L its length, V its volume and T its active tension;
/// - a prescribed displacement divided by L;
/// - at the start, displacements divided by L and velocities divided by the speed c = √(G/ρ) of shear waves.
///
/// In a motion that starts in equilibrium, given loads, tensions and displacements are measured from their values at
/// the start, unless nothing changes. The ratio of a response to its typical magnitude is thus the same in all units
/// and, for small strains, for all magnitudes of the load. Slender bodies move by more than ε L when they bend, so
/// their tolerances are stricter than necessary.
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
    /// Returns the magnitudes for the loads of `muscle` up to the time `t_end` (s) and for the start of its motion.
    pub fn of(muscle: &Muscle, t_end: f64, start: TypicalStart) -> Self {
        let magnitudes = |signal: &Signal| largest(signal, t_end, 0.0);
        let Scale { strain, modulus } = match start {
            TypicalStart::At(start) => Scale::of(muscle, magnitudes, start),
            TypicalStart::Equilibrium => {
                let all = Scale::of(muscle, magnitudes, [0.0; 2]);
                let change = |signal: &Signal| largest(signal, t_end, signal.at(0.0).value);
                let changes = Scale::of(muscle, change, [0.0; 2]);
                match changes.strain > 0.0 {
                    true => Scale {
                        strain: changes.strain.max(SMALLEST_CHANGE * all.strain),
                        ..changes
                    },
                    false => all,
                }
            }
        };
        let strain = if strain > 0.0 { strain } else { UNKNOWN_STRAIN };
        let length = extent(muscle);
        let speed = (modulus / mean_density(muscle)).sqrt();
        Self {
            displacement: strain * length,
            velocity: strain * speed,
            pressure: strain * modulus,
            pressure_rate: strain * modulus * speed / length,
        }
    }

    /// Returns absolute tolerances equal to `rtol` times a tenth of these magnitudes.
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

/// Start of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TypicalStart {
    /// Largest displacement (m) and velocity (m/s) at the start.
    At([f64; 2]),
    /// Equilibrium under the loads at the start.
    Equilibrium,
}

/// Typical strain and stiffness of a body.
struct Scale {
    strain: f64,
    /// The shear modulus or the stress, whichever is larger, Pa.
    modulus: f64,
}

impl Scale {
    /// Returns the scale for signals of the given sizes and the largest displacement (m) and velocity (m/s) at the
    /// start.
    fn of(muscle: &Muscle, size: impl Fn(&Signal) -> f64, start: [f64; 2]) -> Self {
        let (length, volume) = (extent(muscle), muscle.solid.volume());
        let stress = total_force(muscle, &size) * length / volume + tension(muscle, &size);
        let modulus = mean_shear_modulus(muscle).max(stress).max(f64::MIN_POSITIVE);
        let speed = (modulus / mean_density(muscle)).sqrt();
        let moved = muscle.prescribed.iter().step_by(1 + muscle.prescribed.len() / MOVED);
        let moved = moved.map(|prescribed| size(&prescribed.signal));
        let moved = moved.fold(start[0], f64::max);
        let strain = (stress / modulus).max(moved / length).max(start[1] / speed).min(1.0);
        Self { strain, modulus }
    }
}

/// Returns the time (s) in which shear waves cross the body.
pub(crate) fn transit_time(muscle: &Muscle) -> f64 {
    extent(muscle) / (mean_shear_modulus(muscle) / mean_density(muscle)).sqrt()
}

/// Returns the reciprocal of the shear compliance averaged over the volume (Reuss average), Pa.
fn mean_shear_modulus(muscle: &Muscle) -> f64 {
    let space = muscle.solid.space();
    let (mut compliance, mut volume) = (0.0, 0.0);
    for (element, shear) in shear_moduli(muscle).enumerate() {
        let measure = space.measure_of(element);
        compliance += measure / shear;
        volume += measure;
    }
    volume / compliance
}

/// Returns the shear modulus of each element at rest, Pa.
fn shear_moduli(muscle: &Muscle) -> impl Iterator<Item = f64> {
    let solid = &muscle.solid;
    let mut last: Option<(&Law, f64)> = None;
    solid.laws().iter().enumerate().map(move |(element, law)| {
        let shear = match last {
            Some((same, shear)) if same == law => shear,
            _ => law.moduli()[1],
        };
        last = Some((law, shear));
        solid.mean_factor(element) * shear
    })
}

/// Returns the longest edge (m) and the speed of shear waves at rest (m/s) of the element that a wave takes longest to
/// cross.
pub fn slowest_element(muscle: &Muscle) -> [f64; 2] {
    let (solid, space) = (&muscle.solid, muscle.solid.space());
    let corners = |element: usize| &space.element_nodes(element)[..=space.dimension()];
    let edge = |a: usize, b: usize| {
        let parts = space.node_point(a).iter().zip(space.node_point(b)).map(|(a, b)| a - b);
        parts.fold(0.0, f64::hypot)
    };
    let longest = |element: usize| {
        let nodes = corners(element);
        let all = nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| edge(a, b)));
        all.fold(0.0, f64::max)
    };
    let elements = shear_moduli(muscle).zip(solid.densities()).enumerate();
    let elements =
        elements.map(|(element, (shear, density))| [longest(element), (shear / density).sqrt()]);
    let time = |[length, speed]: &[f64; 2]| length / speed;
    elements.max_by(|a, b| time(a).total_cmp(&time(b))).unwrap_or([0.0, f64::INFINITY])
}

/// Returns the mean density (kg/m³), even for a body whose inertia is neglected.
pub(crate) fn mean_density(muscle: &Muscle) -> f64 {
    mass(muscle) / muscle.solid.volume()
}

/// Returns the mass (kg; in 2D, kg per meter of thickness), even for a body whose inertia is neglected.
pub fn mass(muscle: &Muscle) -> f64 {
    let (solid, space) = (&muscle.solid, muscle.solid.space());
    let densities = solid.densities().iter().enumerate();
    densities.map(|(element, density)| density * space.measure_of(element)).sum()
}

/// Returns the sum of the absolute nodal force components of all loads (N) for signals of the given sizes.
fn total_force(muscle: &Muscle, size: impl Fn(&Signal) -> f64) -> f64 {
    let loads = muscle.loads.iter();
    let mut total: f64 = loads.map(|load| load.magnitude() * size(load.signal())).sum();
    let n = muscle.solid.space().n_components();
    for load in &muscle.surface_loads {
        total += load.magnitude(n) * size(load.signal());
    }
    total
}

/// Returns the largest active tension, Pa.
fn tension(muscle: &Muscle, size: impl Fn(&Signal) -> f64) -> f64 {
    let tensions = muscle.activations.iter().map(|(number, activation)| match activation {
        Activation::Given(signal) => muscle.largest_tension_factor(*number) * size(signal),
        Activation::Bestel(model) => model.tension,
        Activation::Coherence { unsynchronized } => *unsynchronized,
        Activation::Line { tension, .. } => *tension,
    });
    tensions.fold(0.0, |max, tension| max.max(tension.abs()))
}

/// Returns the largest distance of a signal from `origin` between 0 and `t_end`. The signal is sampled at equidistant
/// times, at its breaks and midway between its breaks.
fn largest(signal: &Signal, t_end: f64, origin: f64) -> f64 {
    let uniform = (0..=INTERVALS).map(|i| t_end * f64::from(i) / f64::from(INTERVALS));
    let mut breaks = vec![0.0];
    breaks.extend(signal.breaks(0.0, t_end).take(BREAKS).map(|at| at.t));
    let between = breaks.windows(2).map(|two| 0.5 * (two[0] + two[1]));
    let times = uniform.chain(between).chain(breaks.iter().copied());
    times.fold(0.0, |max, t| max.max((signal.at(t).value - origin).abs()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use myovib_fem::{DofMap, Solid, Space, generate, load};

    use super::*;
    use crate::muscle::load::Load;
    use crate::muscle::parameters::Parameters;
    use crate::signal::formula::Sine;

    fn typical(scale: [f64; 3], amplitude: f64) -> TypicalValues {
        let start = TypicalStart::At([0.0; 2]);
        let [length, time, mass] = scale;
        let signal = Signal::constant(amplitude / (mass / (length * time * time)));
        TypicalValues::of(&muscle(scale, signal), 1.0 / time, start)
    }

    fn muscle(scale: [f64; 3], signal: Signal) -> Muscle {
        // Units of length, time and mass in m, s and kg.
        let [length, time, mass] = scale;
        let pressure = mass / (length * time * time);
        let mesh = generate::beam(0.1 / length, 0.02 / length, [4, 1]).unwrap();
        let space = Arc::new(Space::taylor_hood(&mesh));
        let nodes = space.nodes_of("fixed").unwrap();
        let dofs = DofMap::clamped(&space, &nodes).unwrap();
        let law = Law::MooneyRivlin { c10: 5e3 / pressure, c01: 0.0 };
        let density = 1e3 * length.powi(3) / mass;
        let load = load::traction(&space, "load", [0.0, 1.0]).unwrap();
        let solid = Solid::uniform(space, dofs, law, density).unwrap();
        let parameters = Parameters::new(0.0, 0.0, 1e6 / pressure).unwrap();
        let mut muscle = Muscle::unloaded(solid, parameters);
        muscle.loads = vec![Load::new(&load, signal)];
        muscle
    }

    /// Regression: under a constant tension of 8 G, a small vibration had an error of 3 %.
    #[test]
    fn constant_loads_of_an_equilibrium_have_no_size() {
        let of = |signal: &Signal, start| {
            TypicalValues::of(&muscle([1.0; 3], signal.clone()), 1.0, start)
        };
        let constant = Signal::constant(50.0);
        let rest = of(&constant, TypicalStart::At([0.0; 2]));
        assert_eq!(of(&constant, TypicalStart::Equilibrium), rest);
        let vibration = Signal::from(Sine { amplitude: 0.05, frequency: 0.5, phase: 0.0 });
        let both = Signal::sum(vec![constant, vibration]);
        let found = of(&both, TypicalStart::Equilibrium);
        // The peak is at most half an interval from the largest sample: 1 - cos(π/2/997). The rounding of 50 + 0.05 is
        // added.
        assert!((found.displacement / (1e-3 * rest.displacement) - 1.0).abs() < 2e-6);
    }

    /// Regression: absolute tolerances were fixed numbers in SI units, and the same body in other units took up to 70
    /// times as many steps.
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
                    (found.pressure_rate * pressure / time, expected.pressure_rate),
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
