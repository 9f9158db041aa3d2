//! Compares ∂y_0/∂p with differences of consistent initial values, and checks results that depend on this derivative.

use myovib_model::sensitivity::Stencil;
use myovib_model::{Field, MuscleDae};
use myovib_scene::sensitivity::Parameterized;
use myovib_scene::watch::Watcher;

use crate::derivatives::{CASES, case, outputs_agree};
use crate::{SMALL, scene, set};

/// A force with a nonzero value and a nonzero rate at the start, and an equilibrium under it.
const LOADED: [&str; 2] = [
    "traction[0].y={ type = \"sum\", of = [20.0, { type = \"sine\", amplitude = 10.0, frequency = 3.0 }] }",
    "initial_state={ type = \"equilibrium\" }",
];
const WEIGHT: &str = "[[body_force]]\ny = -9.81\n";
const RELAXING: &str = "material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }]";
const MOVING: &str = "initial_state={ type = \"velocity\", value = [0.2, 0.1] }";

/// Compares ∂y_0/∂p, block by block, with central differences of recomputed initial values. Returns the largest entry
/// for each parameter.
fn starts_agree(it: &Parameterized, case: &str) -> Vec<f64> {
    let values = it.values();
    let body = it.scene.body.as_ref().unwrap();
    let dae = MuscleDae::new(body.muscle.clone(), body.formulation).unwrap();
    let start = |values: &[f64]| {
        let body = it.at(values).unwrap().body.unwrap();
        let mut dae = MuscleDae::for_analysis(body.muscle.clone(), body.formulation);
        body.initial_values(&mut dae, Watcher::NOBODY).unwrap().unwrap()[0].clone()
    };
    let y = start(&values);
    let mut dependences = it.dependences(&values).unwrap();
    let (beta, kappa) = (body.muscle.parameters.beta, body.muscle.parameters.kappa());
    let largest = |of: &[f64]| of.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let of_parameter = |j: usize| {
        let ours = dependences.get_mut(j).start();
        let delta = 2e-3 * values[j].abs();
        let terms = Stencil::Central.points().iter().map(|(k, weight)| {
            let mut moved = values.clone();
            moved[j] += k * delta;
            (weight / delta, start(&moved))
        });
        let terms: Vec<_> = terms.collect();
        for (field, range) in dae.layout().blocks() {
            let off = range.clone().map(|i| {
                let difference = terms.iter().map(|(weight, start)| weight * start[i]);
                ours[i] - difference.sum::<f64>()
            });
            let off = largest(&off.collect::<Vec<_>>());
            // The truncation error of the difference is (δ/p)⁴ = 2e-11 of the derivative, times factors up to 5!. The
            // error of the initial values depends on the block: 1e-13 for solved equations; κ times 1e-15 for J − 1;
            // and if damping determines only the sum of λ and β λ̇, the error of 1e-11 at which the iteration for λ
            // ends, and the same error in its difference quotients in time. These errors are multiplied by the sum of
            // the weights, 1.5, and divided by δ here and by δ/2 in the program.
            let size = |field| dae.layout().range(field).map_or(0.0, |own| largest(&y[own]));
            let of_pressure = match field {
                Field::PressureRate => 2e-11 / beta * size(Field::Pressure),
                Field::Pressure if kappa.is_finite() => 1e-15 * kappa,
                Field::Pressure if beta > 0.0 => 2e-11 * size(Field::Pressure),
                _ => 0.0,
            };
            let rounding = 4.5 * (1e-13 * size(*field) + of_pressure) / delta;
            let allowed = 1e-8 * largest(&ours[range.clone()]) + rounding;
            let key = &it.parameters[j].key;
            assert!(off <= allowed, "{case}, {key}, {field}: {off:e} {allowed:e}");
        }
        largest(ours)
    };
    (0..values.len()).map(of_parameter).collect()
}

/// Returns the parameters of a list, without κ if it is infinite.
fn keys<'k>(all: &[&'k str], kappa: &str) -> Vec<&'k str> {
    let keys = all.iter().copied();
    keys.filter(|key| kappa != "inf" || *key != "solid.bulk_modulus").collect()
}

#[test]
fn equilibria_have_the_derivatives_of_their_differences() {
    let folder = tempfile::tempdir().unwrap();
    let all = [
        "material[0].c10",
        "material[0].density",
        "material[0].stress_scale",
        "material[0].prony[0].relative_modulus",
        "solid.bulk_modulus",
        "traction[0].y.of[0]",
        "traction[0].y.of[1].amplitude",
        "body_force[0].y",
    ];
    for one in CASES {
        let keys = keys(&all, one.1);
        let path = scene(folder.path(), &keys, WEIGHT);
        let more = set(&[&LOADED[..], &[RELAXING]].concat());
        let it = Parameterized::load(&path, &[case(one), more].concat()).unwrap();
        let sizes = starts_agree(&it, &format!("{one:?}"));
        for (key, size) in keys.iter().zip(sizes) {
            // A sine is zero at t = 0. Its rate only changes pressures of an incompressible body with damping.
            let is_at_rest = key.ends_with("amplitude") && !(one.1 == "inf" && one.2 != "0");
            assert!(size > 0.0 || is_at_rest, "{one:?}, {key}");
        }
    }
}

#[test]
fn velocities_of_the_start_have_the_derivatives_of_their_differences() {
    let folder = tempfile::tempdir().unwrap();
    let all = ["initial_state.value[0]", "initial_state.value[1]", "material[0].c10"];
    for one in CASES {
        let path = scene(folder.path(), &all, "");
        let it =
            Parameterized::load(&path, &[case(one), set(&[RELAXING, MOVING])].concat()).unwrap();
        let sizes = starts_agree(&it, &format!("{one:?}"));
        assert!(sizes[0] > 0.0 && sizes[1] > 0.0, "{one:?}: {sizes:?}");
    }
}

#[test]
fn motions_from_an_equilibrium_have_the_derivatives_of_differences_of_runs() {
    let keys = [
        "material[0].c10",
        "material[0].prony[0].relaxation_time",
        "solid.bulk_modulus",
        "traction[0].y.of[0]",
        "traction[0].y.of[1].frequency",
        "body_force[0].y",
    ];
    for of_kappa in ["1e5", "inf"] {
        let kappa = format!("solid.bulk_modulus={of_kappa}");
        let more = [&LOADED[..], &SMALL, &[RELAXING, &kappa]].concat();
        outputs_agree(&self::keys(&keys, of_kappa), WEIGHT, &more);
    }
}

#[test]
fn motions_from_a_velocity_have_the_derivatives_of_differences_of_runs() {
    let keys = ["initial_state.value[1]", "initial_state.value[0]", "material[0].c10"];
    for of_kappa in ["1e5", "inf"] {
        let kappa = format!("solid.bulk_modulus={of_kappa}");
        outputs_agree(&keys, "", &[&SMALL[..], &[MOVING, &kappa]].concat());
    }
}
