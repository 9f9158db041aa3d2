//! Unusual values of a body. They are allowed but probably mistakes, such as a wrong unit or power of ten.
//!
//! The bounds are far outside the range of values for tissue, so a finding is almost certainly a mistake.

mod loads;
mod materials;

use std::ops::RangeInclusive;

use myovib_model::advice::{Finding, Remedy};
use myovib_model::check::readable;
use myovib_model::support::extent;

use self::materials::{CHECKS, Part};
use super::Body;
use crate::scene_file::SceneFile;

/// Maximum length of a body (m).
const LONGEST: f64 = 100.0;
/// Maximum mass of a body (kg, or kg per meter of thickness). This is the mass of a whale.
const HEAVIEST: f64 = 2e5;
/// Range of the lengths (m) of tissue samples and organs.
const LENGTHS: RangeInclusive<f64> = 1e-4..=3.0;
/// Description of a problem, and of the usual values.
type Unusual = (String, &'static str);

/// Returns the first problem found by each check of the body, its materials and its loads.
pub(super) fn findings(file: &SceneFile, body: &Body, t_end: f64) -> Vec<Finding> {
    let Some(solid) = &file.solid else {
        return Vec::new();
    };
    let drive = body.muscle.forcing_frequency();
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
        .chain(materials::kink(&parts))
        .chain(loads::strong_load(file, body, t_end, &parts))
        .chain(loads::large_displacement(file, body, t_end));
    all.map(|(problem, usual)| Finding {
        fields: Vec::new(),
        problem,
        remedies: vec![Remedy::Scene(usual)],
    })
    .collect()
}

/// Returns the mean `spatial_factor` over the elements of a material.
fn mean_factor(body: &Body, material: usize) -> f64 {
    let elements = body.regions.iter().enumerate();
    let factors = elements.filter(|(_, region)| **region == material);
    let factors = factors.map(|(element, _)| body.muscle.solid.mean_factor(element));
    let (n, sum) = factors.fold((0.0, 0.0), |(n, sum), factor| (n + 1.0, sum + factor));
    if n == 0.0 { 1.0 } else { sum / n }
}

/// Checks the length and mass of the body.
fn size(body: &Body, parts: &[Part]) -> Option<Unusual> {
    let space = body.muscle.solid.space();
    let (length, dimension) = (extent(&body.muscle), space.dimension());
    let measure =
        |(element, region): (usize, &usize)| parts[*region].density * space.measure_of(element);
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
        let per = if dimension == 2 { "kg per meter of thickness" } else { "kg" };
        let problem = format!(
            "mesh: the body is {} m long and its mass is {} {per}",
            readable(length),
            readable(mass)
        );
        (problem, unit)
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use myovib_fem::Law;

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
            // The masses are 1e7 kg and 1e5 kg per meter of thickness.
            (
                &["mesh.width=100.0", "mesh.height=100.0"][..],
                &["mesh.width=10.0", "mesh.height=10.0"][..],
                "mesh.scale = 1e-3",
            ),
            (
                &["mesh.width=101.0", "mesh.height=1e-3", "material[0].density=101.0"],
                &["mesh.width=99.0", "mesh.height=1e-3", "material[0].density=101.0"],
                "mesh.scale = 1e-3",
            ),
            // The bound is 2/3 of 1e4 Pa.
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
                &["material[0].density=1e6", "mesh.width=0.1", "mesh.height=0.1"],
                &["material[0].density=1.0", "material[0].shear_modulus=80.0", "traction=[]"],
                "waves of 1 to 10 m/s",
            ),
            // The bound is 5/(2π 8 Hz) = 0.0995 s.
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
                // In one of the 500 periods, a sample is within 1e-5 of the amplitude.
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
            assert!(words.len() == 1 && words[0].contains(printed), "{wrong:?}: {words:?}");
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

    /// Regression: `check` reported nothing for a tendon joined to a muscle, for which Newton's method failed.
    #[test]
    fn stiff_fibers_beside_a_softer_material_are_reported() {
        let group = "group=[{ name = \"tendon\", members = \"elements\", type = \"half-space\", point = [0.5, 0.0], normal = [1.0, 0.0] }]";
        let is_reported = |shear_modulus: f64, c3: f64| {
            let materials = format!(
                "material=[{{ law = \"neo-hooke\", density = 1e3, shear_modulus = {shear_modulus:?} }}, {{ group = \"tendon\", \
                 law = \"transverse-mooney-rivlin\", density = 1e3, c10 = 2.5e4, c3 = {c3:?}, c4 = 46.4, stretch_max = 1.03, \
                 c5 = 5e8, fiber = [1.0, 0.0] }}]"
            );
            found(&[group, &materials]).iter().any(|text| text.contains("k = 1e-6"))
        };
        assert!(is_reported(1e4, 2.7e6));
        // 100 times the shear modulus is 5e6 Pa.
        assert!(!is_reported(1e4, 1e5));
        // The other material is not softer.
        assert!(!is_reported(6e4, 2.7e6));
    }

    /// Checks that a static analysis ignores unusual damping. It also ignores an unusual density unless the body has
    /// weight.
    #[test]
    fn unusual_values_without_effect_are_not_reported() {
        let at_rest =
            ["analysis=static", "solid.rayleigh_stiffness=1.0", "material[0].density=1.0"];
        assert_eq!(found(&at_rest), Vec::<String>::new());
        let weight = "body_force=[{ y = -9.81 }]";
        assert_eq!(found(&[&at_rest[..], &[weight]].concat()).len(), 1);
    }

    /// Checks that the moduli equal the constants of isotropic laws. The constants of small-strain laws are exact.
    #[test]
    fn moduli_at_rest_are_those_of_the_laws() {
        let law = |name, constants: &[(&str, f64)]| Law::named(name, constants).unwrap().moduli();
        for (found, expected) in [
            (law("mooney-rivlin", &[("c10", 1e4), ("c01", 2e2)]), [0.0, 2.04e4]),
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
                // The tolerance covers a few rounding errors of values of about 1e4 Pa.
                assert!((found - expected).abs() < 1e-10 * 2e4, "{found} {expected}");
            }
        }
    }
}
