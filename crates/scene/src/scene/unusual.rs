//! Unusual values of a body, which are allowed but probably mistakes, such as a wrong unit or power
//! of ten.
//!
//! The bounds are far outside the range of tissue, so a finding is almost certainly a mistake.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use myovib_fem::Law;
use myovib_model::Signal;
use myovib_model::advice::{Finding, Remedy};
use myovib_model::check::readable;

use super::Body;
use crate::scene_file::material::Material;
use crate::scene_file::solid::Solid;
use crate::scene_file::{Analysis, SceneFile};

/// Range of densities, from a tenth of water's density to the density of heavy metals, kg/m³.
const DENSITIES: RangeInclusive<f64> = 100.0..=2e4;
/// Range of shear wave speeds in tissue, m/s. Bodies outside this range probably use other units.
const SHEAR_WAVES: RangeInclusive<f64> = 0.1..=20.0;
/// Smallest shear modulus, Pa. The softest solid tissues, embryos and brain, have about 100.
const SOFTEST: f64 = 50.0;
/// Maximum ratio of viscous to elastic stress at the driving frequency. Tissue has 0.05 to 1; the
/// material would flow above 5.
const MOST_LOSS: f64 = 5.0;
/// Maximum ratio of load to shear modulus. At this tension, a neo-Hookean bar is 2.6 times as long,
/// and a pressure in a neo-Hookean cavity makes it grow without bound (Gent and Lindley 1959).
const MOST_LOAD: f64 = 2.5;
/// Maximum length of a body, m.
const LONGEST: f64 = 100.0;
/// Maximum mass of a body, kg, or kg per meter of thickness: the mass of a whale.
const HEAVIEST: f64 = 2e5;
/// Range of the lengths of tissue samples and organs, m.
const LENGTHS: RangeInclusive<f64> = 1e-4..=3.0;
/// Number of intervals at which loads are sampled. It is prime, because a load with a round number of periods could
/// vanish at all sample times of a round number of samples.
const TIMES: u32 = 997;

/// Description of a problem and of the usual values.
type Unusual = (String, &'static str);

/// Properties of a material.
struct Part {
    law: Law,
    density: f64,
    kappa: f64,
    beta: f64,
    /// Bulk and shear modulus at small strains, Pa; the bulk modulus includes κ.
    bulk: f64,
    shear: f64,
    /// Highest driving frequency of the body, Hz, if any.
    drive: Option<f64>,
}

/// Condition on the scene under which a check is performed, and the check of each material.
type Check = (fn(&SceneFile) -> bool, fn(&Part) -> Option<Unusual>);

/// Checks of materials.
const CHECKS: [Check; 4] = [
    (|_| true, volume),
    (|_| true, softness),
    (has_mass, mass),
    (|file| file.analysis == Analysis::Dynamic, damping),
];

/// Returns the first problem that each check finds: of the materials, and for one check of the loads.
pub(super) fn findings(file: &SceneFile, body: &Body, t_end: f64) -> Vec<Finding> {
    let Some(solid) = &file.solid else {
        return Vec::new();
    };
    let drive = body.muscle.drive();
    let materials = file.material.iter().enumerate();
    let parts: Vec<Part> = materials
        .map(|(i, material)| Part::new(material, mean_factor(body, i), solid, drive))
        .collect();
    let counting = CHECKS.iter().filter(|(counts, _)| counts(file));
    let of_materials = counting.filter_map(|(_, check)| {
        let mut printed = parts.iter().map(check).enumerate();
        printed.find_map(|(i, printed)| {
            let (problem, usual) = printed?;
            Some((format!("material[{i}]: {problem}"), usual))
        })
    });
    let all = size(body, &parts)
        .into_iter()
        .chain(of_materials)
        .chain(strong_load(file, body, t_end, &parts))
        .chain(long_way(file, body, t_end));
    all.map(|(problem, usual)| Finding {
        fields: Vec::new(),
        problem,
        remedies: vec![Remedy::Scene(usual)],
    })
    .collect()
}

/// Returns the mean of the `spatial_factor` of a material over its elements.
fn mean_factor(body: &Body, material: usize) -> f64 {
    let elements = body.regions.iter().enumerate();
    let factors = elements.filter(|(_, region)| **region == material);
    let factors = factors.map(|(element, _)| body.muscle.solid.mean_factor(element));
    let (n, sum) = factors.fold((0.0, 0.0), |(n, sum), factor| (n + 1.0, sum + factor));
    if n == 0.0 { 1.0 } else { sum / n }
}

impl Part {
    fn new(material: &Material, factor: f64, solid: &Solid, drive: Option<f64>) -> Self {
        let law = material.stiffened();
        let law = law.expect("the body was made of this law").scaled(factor);
        let kappa = material.bulk_modulus.unwrap_or(solid.bulk_modulus).0;
        let [own, shear] = law.moduli();
        Self {
            law,
            density: material.density,
            kappa,
            beta: material
                .rayleigh_stiffness
                .unwrap_or(solid.rayleigh_stiffness),
            // The energy of a complete law contains the volumetric part.
            bulk: if law.description().complete {
                own
            } else {
                own + kappa
            },
            shear,
            drive,
        }
    }
}

/// Returns the length of the body along the axis in which it is longest, m.
fn length(body: &Body) -> f64 {
    let space = body.muscle.solid.space();
    let (coordinates, dimension) = (space.coordinates(), space.dimension());
    let extent = |axis: usize| {
        let along = coordinates.iter().skip(axis).step_by(dimension).copied();
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    (0..dimension).map(extent).fold(0.0, f64::max)
}

/// Checks length and mass of the body.
fn size(body: &Body, parts: &[Part]) -> Option<Unusual> {
    let space = body.muscle.solid.space();
    let (length, dimension) = (length(body), space.dimension());
    let measure = |(element, region): (usize, &usize)| {
        parts[*region].density * space.mesh().measure_of(element)
    };
    let mass: f64 = body.regions.iter().enumerate().map(measure).sum();
    (length > LONGEST || mass > HEAVIEST).then(|| {
        let unit = match length {
            _ if LENGTHS.contains(&(1e-3 * length)) => {
                "if the mesh is in mm, set `mesh.scale = 1e-3`"
            }
            _ if LENGTHS.contains(&(1e-6 * length)) => {
                "if the mesh is in µm, set `mesh.scale = 1e-6`"
            }
            _ => "give coordinates in m and densities in kg/m³",
        };
        let per = if dimension == 2 {
            "kg per meter of thickness"
        } else {
            "kg"
        };
        let problem = format!(
            "mesh: the body is {} m long and its mass is {} {per}",
            readable(length),
            readable(mass)
        );
        (problem, unit)
    })
}

/// Checks for a negative Poisson's ratio (3 K − 2 G)/(2 (3 K + G)), which means K < 2/3 G.
fn volume(part: &Part) -> Option<Unusual> {
    let Part {
        kappa, bulk, shear, ..
    } = *part;
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    (poisson < 0.0).then(|| {
        let problem = format!(
            "bulk_modulus = {} Pa with a shear modulus of {} Pa: Poisson's ratio is {}, so the body thickens when pulled",
            readable(kappa),
            readable(shear),
            two_digits(poisson)
        );
        (problem, "use a bulk_modulus far above the shear modulus (in tissue at least a hundred times as large), or `inf`")
    })
}

/// Checks that a body with a density in SI units is not softer than tissue.
fn softness(part: &Part) -> Option<Unusual> {
    (DENSITIES.contains(&part.density) && part.shear < SOFTEST).then(|| {
        let problem = format!("the shear modulus at rest is {} Pa", readable(part.shear));
        (
            problem,
            "give moduli in Pa: 5 kPa is 5e3; tissue has 1e2 to 1e6",
        )
    })
}

/// Formats a number between -1 and 1, except 0, with its first two digits.
fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().log10().floor()) as usize;
    format!("{value:.decimals$}")
}

/// Returns whether the density has an effect.
fn has_mass(file: &SceneFile) -> bool {
    let has_inertia = !matches!(file.analysis, Analysis::Static | Analysis::QuasiStatic);
    has_inertia || !file.body_force.is_empty()
}

/// Checks that the density or the speed √(G/ρ) is in the range of tissue.
fn mass(part: &Part) -> Option<Unusual> {
    let speed = (part.shear / part.density).sqrt();
    let is_usual = DENSITIES.contains(&part.density) || SHEAR_WAVES.contains(&speed);
    (!is_usual).then(|| {
        let problem = format!(
            "a density of {} kg/m³: shear waves travel at {} m/s",
            readable(part.density),
            readable(speed)
        );
        (
            problem,
            "give it in kg/m³: tissue has about 1000, which is 1 g/cm³, and waves of 1 to 10 m/s",
        )
    })
}

/// Checks viscous stress, which is ωβ times the elastic stress at an angular frequency ω. Without a
/// driving frequency, the speed of the body is unknown and nothing is checked.
fn damping(part: &Part) -> Option<Unusual> {
    let Part { beta, drive, .. } = *part;
    let frequency = drive?;
    let loss = TAU * frequency * beta;
    (loss > MOST_LOSS).then(|| {
        let problem = format!(
            "rayleigh_stiffness = {beta:e} s makes the viscous stress {loss:.1} times the elastic stress at {} Hz",
            readable(frequency)
        );
        (problem, "use a smaller rayleigh_stiffness, in s: in tissue the viscous stress is 0.05 to 1 times the elastic stress")
    })
}

/// Returns the first load far above the shear modulus of the stiffest material. Laws with fibers
/// are skipped: they stiffen without bound, so their modulus at rest does not limit loads.
fn strong_load(file: &SceneFile, body: &Body, t_end: f64, parts: &[Part]) -> Option<Unusual> {
    let shear = parts.iter().map(|part| part.shear).fold(0.0, f64::max);
    if parts.iter().any(|part| part.law.has_fibers()) {
        return None;
    }
    let times = times(file, t_end);
    let most = |signal: &Signal| {
        let values = times.iter().map(|t| signal.at(*t).value.abs());
        values.fold(0.0, f64::max)
    };
    loads(file, body).find_map(|(path, signal)| {
        let load = most(signal);
        (load > MOST_LOAD * shear).then(|| {
            let problem = format!(
                "{path} reaches {} Pa, {:.1} times the shear modulus at rest, {} Pa",
                readable(load),
                load / shear,
                readable(shear)
            );
            (
                problem,
                "check the unit, Pa: loads far above the modulus invert elements",
            )
        })
    })
}

/// Checks that supports move less than the length of the body.
fn long_way(file: &SceneFile, body: &Body, t_end: f64) -> Option<Unusual> {
    // A rotation moves a support by up to twice its distance from the axis.
    if file
        .prescribed_displacement
        .iter()
        .any(|own| own.rotation.is_some())
    {
        return None;
    }
    let length = length(body);
    let times = times(file, t_end);
    let distances = body.muscle.prescribed.iter().flat_map(|moved| {
        let at = |t: &f64| moved.signal.at(*t).value.abs();
        times.iter().map(at)
    });
    let most = distances.fold(0.0, f64::max);
    (most > length).then(|| {
        let problem = format!(
            "a [[prescribed_displacement]] reaches {} m, and the body is {} m long",
            readable(most),
            readable(length)
        );
        (problem, "give it in m: 1 mm is 1e-3")
    })
}

/// Returns the times at which loads are sampled.
fn times(file: &SceneFile, t_end: f64) -> Vec<f64> {
    match file.analysis {
        Analysis::Static => vec![t_end],
        Analysis::Modes => file
            .modes
            .iter()
            .filter_map(|modes| modes.preload_time)
            .collect(),
        Analysis::Response => {
            let response = file.response.iter();
            response.filter_map(|own| own.preload_time).collect()
        }
        Analysis::Dynamic | Analysis::QuasiStatic => {
            let all = (0..=TIMES).map(|i| t_end * f64::from(i) / f64::from(TIMES));
            all.collect()
        }
        Analysis::Periodic => Vec::new(),
    }
}

/// Returns tractions and surface loads in Pa with their keys. A distribution may contain the unit of a load, so such
/// loads are excluded.
fn loads<'a>(file: &SceneFile, body: &'a Body) -> impl Iterator<Item = (&'a str, &'a Signal)> {
    let tractions = file.traction.iter().enumerate();
    let distributed = tractions.filter(|(_, traction)| traction.spatial_factor.is_some());
    let mut excluded: Vec<String> = distributed
        .map(|(i, _)| format!("traction[{i}]."))
        .collect();
    excluded.extend(["body_force", "point_force"].map(str::to_owned));
    let mut loads = body.keyed_loads().collect::<Vec<_>>();
    loads.retain(|(key, _)| !excluded.iter().any(|other| key.starts_with(other)));
    loads.into_iter()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Scene;

    const SQUARE: &str = r#"
[time]
end = 1.0
[mesh]
type = "rectangle"
width = 1.0
height = 1.0
cells = [2, 2]
[solid]
bulk_modulus = 1e5
rayleigh_stiffness = 1e-4
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "right"
x = { type = "ramped-sine", amplitude = 100.0, frequency = 8.0 }
y = { type = "ramped-sine", amplitude = 100.0, frequency = 8.0 }
"#;

    fn found(set: &[&str]) -> Vec<String> {
        let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
        let scene = Scene::build("scene.toml", SQUARE, &set, Path::new(""));
        let findings = scene.expect("a valid scene").unusual();
        findings.iter().map(ToString::to_string).collect()
    }

    /// Regression: `check` accepted all of these scenes. The second scene of each pair is on the valid side of the
    /// bound.
    #[test]
    fn unusual_values_are_reported_and_plausible_values_are_not() {
        assert_eq!(found(&[]), Vec::<String>::new());
        for (wrong, right, printed) in [
            // 1e7 kg and 1e5 kg per meter of thickness.
            (
                &["mesh.width=100.0", "mesh.height=100.0"][..],
                &["mesh.width=10.0", "mesh.height=10.0"][..],
                "mesh.scale = 1e-3",
            ),
            (
                &[
                    "mesh.width=101.0",
                    "mesh.height=1e-3",
                    "material[0].density=101.0",
                ],
                &[
                    "mesh.width=99.0",
                    "mesh.height=1e-3",
                    "material[0].density=101.0",
                ],
                "mesh.scale = 1e-3",
            ),
            // 2/3 of 1e4 Pa.
            (
                &["solid.bulk_modulus=6.6e3"],
                &["solid.bulk_modulus=6.7e3"],
                "Poisson's ratio is -0.0034",
            ),
            (
                &["material[0].shear_modulus=49.0", "traction=[]"],
                &["material[0].shear_modulus=51.0", "traction=[]"],
                "the shear modulus at rest is 49",
            ),
            // The body is 1 m long.
            (
                &[
                    "prescribed_displacement=[{ group = \"right\", y = { type = \"step\", value = 1.1, rise = 0.1 } }]",
                    "traction=[]",
                ],
                &[
                    "prescribed_displacement=[{ group = \"right\", y = { type = \"step\", value = 0.9, rise = 0.1 } }]",
                    "traction=[]",
                ],
                "1 mm is 1e-3",
            ),
            (
                &["material[0].density=1.0"],
                &["material[0].density=101.0"],
                "shear waves travel at 100.000 m/s",
            ),
            // The wave speed is √(80 / 1) = 8.9 m/s, for a body in other units.
            (
                &[
                    "material[0].density=1e6",
                    "mesh.width=0.1",
                    "mesh.height=0.1",
                ],
                &[
                    "material[0].density=1.0",
                    "material[0].shear_modulus=80.0",
                    "traction=[]",
                ],
                "waves of 1 to 10 m/s",
            ),
            // 5/(2π 8 Hz) = 0.0995 s.
            (
                &["solid.rayleigh_stiffness=0.1"],
                &["solid.rayleigh_stiffness=0.099"],
                "5.0 times the elastic stress at 8.000 Hz",
            ),
            (
                &["traction[0].y={ type = \"step\", value = 2.6e4, rise = 0.1 }"],
                &["traction[0].y={ type = \"step\", value = 2.4e4, rise = 0.1 }"],
                "traction[0].y reaches 26000.000 Pa, 2.6 times",
            ),
            (
                // One of the 500 periods is sampled within 1e-5 of its amplitude.
                &["traction[0].y={ type = \"sine\", amplitude = 2.6e4, frequency = 500.0 }"],
                &["traction[0].y={ type = \"sine\", amplitude = 2.4e4, frequency = 500.0 }"],
                "traction[0].y reaches",
            ),
            (
                &[
                    "pressure=[{ group = \"top\", value = { type = \"step\", value = 2.6e4, rise = 0.1 } }]",
                ],
                &[
                    "pressure=[{ group = \"top\", value = { type = \"step\", value = 2.4e4, rise = 0.1 } }]",
                ],
                "pressure[0].value reaches 26000.000 Pa, 2.6 times",
            ),
        ] {
            let words = found(wrong);
            assert!(
                words.len() == 1 && words[0].contains(printed),
                "{wrong:?}: {words:?}"
            );
            assert_eq!(found(right), Vec::<String>::new(), "{right:?}");
        }
    }

    /// Regression: the check of damping reported a finding for a short run without a vibrating load.
    #[test]
    fn damping_is_looked_at_where_something_vibrates() {
        let short = ["time.end=1e-3", "solid.rayleigh_stiffness=0.1"];
        let step =
            "traction[0]={ group = \"right\", y = { type = \"step\", value = 1.0, rise = 1e-3 } }";
        assert_eq!(found(&short).len(), 1);
        assert_eq!(found(&[&short[..], &[step]].concat()), Vec::<String>::new());
    }

    /// Checks that the density of a weightless body is not checked at rest, and neither is its damping.
    #[test]
    fn unusual_values_without_effect_are_not_reported() {
        let at_rest = [
            "analysis=static",
            "solid.rayleigh_stiffness=1.0",
            "material[0].density=1.0",
        ];
        assert_eq!(found(&at_rest), Vec::<String>::new());
        let weight = "body_force=[{ y = -9.81 }]";
        assert_eq!(found(&[&at_rest[..], &[weight]].concat()).len(), 1);
    }

    /// Checks that the moduli equal the constants of isotropic laws; constants of small-strain laws
    /// are exact.
    #[test]
    fn moduli_at_rest_are_those_of_the_laws() {
        let law = |name, constants: &[(&str, f64)]| Law::named(name, constants).unwrap().moduli();
        for (found, expected) in [
            (
                law("mooney-rivlin", &[("c10", 1e4), ("c01", 2e2)]),
                [0.0, 2.04e4],
            ),
            (law("small-strain", &[("shear_modulus", 5e3)]), [0.0, 5e3]),
            // K = λ + 2/3 μ.
            (
                law(
                    "st-venant-kirchhoff",
                    &[("first_lame_parameter", 3e3), ("shear_modulus", 6e3)],
                ),
                [7e3, 6e3],
            ),
        ] {
            for (found, expected) in found.into_iter().zip(expected) {
                // A few rounding errors of 1e4 Pa.
                assert!((found - expected).abs() < 1e-10 * 2e4, "{found} {expected}");
            }
        }
    }
}
