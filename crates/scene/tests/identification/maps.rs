//! Stiffness maps against forward sensitivities.

use myovib_scene::sensitivity::{
    Parameterized, Precision, StiffnessMap, Unsupported, follow, outputs, unsupported_in_map,
};
use myovib_scene::watch::Watcher;
use myovib_scene::{Error, Scene};

use crate::derivatives::{CASES, case};
use crate::{scene, set};

/// Error of forward sensitivities of probes, which are central differences with the step ε^(1/3). Their error is
/// ε^(2/3) = 4e-11 for values of size 1, and about ten times as large if the derivative is ten times smaller than its
/// terms.
const ROUNDING: f64 = 1e-9;

/// The same error for rates and κ = ∞. For an unknown reason, two factorizations that differ by rounding errors changed
/// results by up to 5e-10 and 9e-9; other cases changed by less than 1 %. This value is ten times the larger change.
const ROUNDING_OF_RATES: f64 = 1e-7;

/// Returns the relative change of each output's RMS per relative change of each parameter, computed with forward
/// sensitivities solved to rounding errors. All parameters are factors of a stress.
fn by_forward(it: &Parameterized) -> Vec<Vec<f64>> {
    let wanted = outputs(&it.scene).unwrap();
    let (every, t_end) = (it.scene.file().probe[0].interval, it.scene.t_end);
    let n = (t_end / every).round() as usize;
    let times: Vec<f64> = (0..=n).map(|k| (k as f64 * every).min(t_end)).collect();
    let dependences = (it.dependences(&it.values()).unwrap(), Precision::Fraction(1e-9));
    let (samples, _) = follow(&it.scene, &wanted, &times, dependences, Watcher::NOBODY).unwrap();
    let change = |j: usize, k: usize| {
        let squares: f64 = samples.iter().map(|s| s.values[k].powi(2)).sum();
        let products = samples.iter().map(|s| s.values[k] * s.derivatives[j][k]);
        it.values()[j] * products.sum::<f64>() / squares
    };
    let of = |k: usize| (0..it.parameters.len()).map(|j| change(j, k)).collect();
    (0..wanted.len()).map(of).collect()
}

/// Compares the sum of a map over the elements of each material with the forward sensitivity to the stiffness of the
/// material.
fn expect_sums(it: &Parameterized, case: &str, rounding: f64) {
    let map = StiffnessMap::of(&it.scene, Watcher::NOBODY).unwrap();
    let regions = &it.scene.body.as_ref().unwrap().regions;
    let names = outputs(&it.scene).unwrap();
    for (name, totals) in names.iter().zip(by_forward(it)) {
        let Some(own) = map.outputs.iter().find(|own| own.name == name.name) else {
            assert!(map.omitted.contains(&name.name), "{case}, {}", name.name);
            continue;
        };
        for (material, total) in totals.into_iter().enumerate() {
            let elements = own.elements.iter().zip(regions);
            let of_material = elements.filter(|(_, region)| **region == material);
            let sum: f64 = of_material.map(|(own, _)| own).sum();
            assert!(
                (sum - total).abs() <= rounding && total.abs() > 1e4 * rounding,
                "{case}, {}, material {material}: {sum} {total}",
                name.name
            );
        }
    }
}

/// Checks that the adjoint, which goes back over all steps from checkpoints, and forward sensitivities give the same
/// derivatives of displacements and velocities.
#[test]
fn the_elements_add_up_to_the_whole_in_all_formulations() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].stress_scale"], "");
    for one in CASES {
        let more = set(&["probe[0].quantities=[\"u\", \"p\", \"v\"]"]);
        let it = Parameterized::load(&path, &[case(one), more].concat()).unwrap();
        let rounding = if one.0 == "rate" && one.1 == "inf" { ROUNDING_OF_RATES } else { ROUNDING };
        expect_sums(&it, &format!("{one:?}"), rounding);
    }
}

/// Checks two materials, a load that rises between two kinks, a motion that starts with a velocity, outputs on an
/// average and a line, and tension and viscosity, which are not part of the stress of the law.
#[test]
fn elements_of_a_material_add_up_to_its_stiffness() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["material[0].stress_scale", "material[1].stress_scale"];
    let more = "[[region]]\nname = \"hard\"\ncenter = [0.03, 0.0]\nradii = [0.03, 0.02]\n\
                [[material]]\ngroup = \"hard\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e5\n\
                stress_scale = 0.7\nrayleigh_stiffness = 2e-4\n\
                [[traction]]\ngroup = \"load\"\n\
                y = { type = \"step\", value = 50.0, start = 0.3, rise = 0.2 }\n\
                [[probe]]\nname = \"end\"\ntype = \"average\"\ngroup = \"load\"\ninterval = 0.01\n\
                [[probe]]\nname = \"axis\"\ntype = \"line\"\nfrom = [0.01, 0.01]\nto = [0.09, 0.01]\npoints = 2\n\
                quantities = [\"u\", \"v\"]\ninterval = 0.01\n\
                [initial_state]\ntype = \"velocity\"\nvalue = [0.0, 0.01]\n";
    let path = scene(folder.path(), &keys, more);
    let own = set(&[
        "material[0].fiber=[1, 0]",
        "material[0].viscosity=10",
        "material[0].active={ type = \"bestel\", contractility = 1e4 }",
        "time.end=0.7",
    ]);
    let it = Parameterized::load(&path, &[case(CASES[5]), own].concat()).unwrap();
    expect_sums(&it, "two materials", ROUNDING);
}

/// Checks that driven chains do not change the map, and that their coherence is excluded from its outputs.
#[test]
fn driven_chains_do_not_change_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &[], "");
    let short = set(&["time.end=0.1"]);
    let map = |more: &[String]| {
        let scene = Scene::load(&path, &[&case(CASES[5])[..], &short, more].concat()).unwrap();
        StiffnessMap::of(&scene, Watcher::NOBODY).unwrap()
    };
    let listening = set(&[
        "chain=[{ name = \"c\", at = [0.05, 0.0] }]",
        "probe=[{ name = \"origin\", type = \"point\", at = [0.05, 0.0], interval = 0.01, quantities = [\"u\"] }, \
         { name = \"order\", type = \"coherence\", chain = \"c\", interval = 0.005 }]",
    ]);
    let [with, without] = [map(&listening), map(&[])];
    assert_eq!(with.outputs, without.outputs);
    assert_eq!(with.omitted[0], "order.Psi_abs");
}

/// Checks that scenes without a map are rejected because of their first unsupported feature.
#[test]
fn features_without_a_map_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &[], "");
    for (overrides, feature) in [
        (
            "material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }]",
            Unsupported::Prony,
        ),
        ("initial_state={ type = \"equilibrium\" }", Unsupported::Equilibrium),
        ("analysis=static", Unsupported::MapAnalysis),
        (
            "traction[0].y={ type = \"step\", value = 1.0, start = 0.1, rise = 0 }",
            Unsupported::Jump,
        ),
    ] {
        let scene = Scene::load(&path, &[case(CASES[5]), set(&[overrides])].concat()).unwrap();
        let found = unsupported_in_map(&scene).map(|(found, _)| found);
        assert_eq!(found, Some(feature), "{overrides}");
        let error = StiffnessMap::of(&scene, Watcher::NOBODY).unwrap_err();
        assert!(matches!(error, Error::Input(_)), "{error:?}");
    }
    let pressures = set(&["probe[0].quantities=[\"p\"]"]);
    let scene = Scene::load(&path, &[case(CASES[5]), pressures].concat()).unwrap();
    let error = StiffnessMap::of(&scene, Watcher::NOBODY).unwrap_err();
    assert!(matches!(error, Error::Input(_)), "{error:?}");
}

/// Checks that a constant output of zero has no relative change.
#[test]
fn a_body_at_rest_has_an_empty_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &[], "");
    let still = set(&["traction[0].y=0.0", "time.end=0.1"]);
    let scene = Scene::load(&path, &[case(CASES[5]), still].concat()).unwrap();
    let map = StiffnessMap::of(&scene, Watcher::NOBODY).unwrap();
    assert_eq!((map.outputs.len(), map.solves), (2, 0));
    assert!(map.outputs.iter().all(|own| own.total().is_nan()));
}
