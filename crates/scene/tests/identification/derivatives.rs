//! Compares ∂F/∂p with differences of residuals, and ∂u/∂p with differences of runs.

use myovib_dae::{Parameters as _, Problem};
use myovib_model::sensitivity::{Dependences, Stencil};
use myovib_model::{Muscle, MuscleDae, Parameters};
use myovib_scene::sensitivity::{Parameterized, Precision, SceneParameter, follow, outputs};
use myovib_scene::watch::Watcher;
use rand::{Rng, SeedableRng};

use crate::{SMALL, scene, set};

/// One parameter for each way in which a scene's equations depend on a number.
const KEYS: [&str; 10] = [
    "material[0].c10",
    "material[0].c01",
    "material[0].density",
    "solid.bulk_modulus",
    "solid.rayleigh_mass",
    "solid.rayleigh_stiffness",
    "traction[0].y.amplitude",
    "traction[0].y.frequency",
    "traction[0].y.steepness",
    "traction[0].y.shift",
];

/// The formulations with values of κ and β that they support.
pub(crate) const CASES: [(&str, &str, &str); 9] = [
    ("displacement", "1e5", "0"),
    ("position", "1e5", "0"),
    ("velocity", "1e5", "0"),
    ("velocity", "inf", "0"),
    ("stabilized", "inf", "0"),
    ("rate", "1e5", "1e-4"),
    ("rate", "inf", "1e-4"),
    ("implicit-rate", "1e5", "1e-4"),
    ("implicit-rate", "inf", "1e-4"),
];

/// Returns the overrides of a coarse cantilever in this formulation.
pub(crate) fn case((formulation, kappa, beta): (&str, &str, &str)) -> Vec<String> {
    let own = [
        format!("solid.formulation={formulation}"),
        format!("solid.bulk_modulus={kappa}"),
        format!("solid.rayleigh_stiffness={beta}"),
    ];
    [set(&SMALL), own.into()].concat()
}

/// Returns the muscle with another value of parameter j.
fn moved(it: &Parameterized, j: usize, value: f64) -> Muscle {
    let mut muscle = it.scene.body.as_ref().unwrap().muscle.clone();
    let Parameters { alpha, beta, .. } = muscle.parameters;
    let kappa = muscle.parameters.kappa();
    let parameters = match KEYS[j] {
        "solid.bulk_modulus" => Parameters::new(alpha, beta, 1.0 / value),
        "solid.rayleigh_mass" => Parameters::new(value, beta, kappa),
        "solid.rayleigh_stiffness" => Parameters::new(alpha, value, kappa),
        _ => {
            let mut values = it.values();
            values[j] = value;
            return it.at(&values).unwrap().body.unwrap().muscle;
        }
    };
    muscle.parameters = parameters.unwrap();
    muscle
}

/// Compares the derivatives for every parameter, formulation and kind of κ with finite differences whose steps are
/// shorter than the steps of the program.
#[test]
fn residuals_have_the_derivatives_of_their_differences() {
    let folder = tempfile::tempdir().unwrap();
    for (formulation, kappa, beta) in CASES {
        let scales = set(&["parameter[3].scale=1e-5", "parameter[5].scale=1e-4"]);
        let overrides = [case((formulation, kappa, beta)), scales].concat();
        let path = scene(folder.path(), &KEYS, "");
        let it = Parameterized::load(&path, &overrides).unwrap();
        let case = format!("{formulation}, κ = {kappa}, β = {beta}");
        let sizes = residuals_agree(&it, |j, value| moved(&it, j, value), &case);
        for (key, size) in KEYS.iter().zip(sizes) {
            // A zero derivative would pass the comparison.
            assert!(size > 0.0, "{formulation}, {key}");
        }
    }
}

/// Compares ∂F/∂p in a random state with differences between the bodies that `moved` returns. Returns the largest entry
/// for each parameter.
fn residuals_agree(
    it: &Parameterized,
    moved: impl Fn(usize, f64) -> Muscle,
    case: &str,
) -> Vec<f64> {
    let body = it.scene.body.as_ref().unwrap();
    let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation).unwrap();
    let n = dae.n_unknowns();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    // The displacements are far smaller than an element, so that no element is inverted.
    let mut state =
        |size: f64| -> Vec<f64> { (0..n).map(|_| size * rng.random_range(-1.0..1.0)).collect() };
    let (t, y, y_dot) = (0.37, state(1e-5), state(1e-3));
    let mut dependences = it.dependences(&it.values()).unwrap();
    let of_parameter = |(j, parameter): (usize, &SceneParameter)| {
        let mut ours = vec![0.0; n];
        dependences.derivative(&mut dae, j, t, &y, &y_dot, &mut ours).unwrap();
        let value = it.values()[j];
        let residual = |value: f64| {
            let mut dae = MuscleDae::for_analysis(moved(j, value), body.formulation);
            let mut residual = vec![0.0; n];
            dae.residual(t, &y, &y_dot, &mut residual).unwrap();
            residual
        };
        // The difference is one-sided near 0, because 1/κ and β cannot be negative.
        let delta = 1e-4 * if value == 0.0 { parameter.scale } else { value };
        let below = if value == 0.0 { value } else { value - delta };
        let (high, low) = (residual(value + delta), residual(below));
        let span = value + delta - below;
        let size = ours.iter().fold(0.0_f64, |size, f| size.max(f.abs()));
        let forces = high.iter().fold(0.0_f64, |size, f| size.max(f.abs()));
        // The truncation error for the frequency is (2π t δ)²/6 = 6e-7 with δ = 8e-4; for the other parameters it is
        // smaller. The rounding error is ε times all forces, divided by δ.
        let allowed = 2e-6 * size + 4.0 * f64::EPSILON * forces / span;
        for i in 0..n {
            let difference = (high[i] - low[i]) / span;
            assert!(
                (ours[i] - difference).abs() <= allowed,
                "{case}, {}, row {i}: {} {difference}",
                parameter.key,
                ours[i]
            );
        }
        size
    };
    it.parameters.iter().enumerate().map(of_parameter).collect()
}

/// Checks the constants of relaxation, the stiffness of a region, and the breaks of a load that is rising at the time
/// of the comparison.
#[test]
fn relaxation_stiffness_and_breaks_have_their_derivatives_in_all_formulations() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "material[0].prony[0].relative_modulus",
        "material[0].prony[1].relaxation_time",
        "material[0].prony[2].relative_modulus",
        "material[0].stress_scale",
        "material[0].c10",
        "traction[1].y.start",
        "traction[1].y.rise",
    ];
    let step = "[[traction]]\ngroup = \"load\"\n\
                y = { type = \"step\", value = 50.0, start = 0.3, rise = 0.2 }\n";
    let path = scene(folder.path(), &keys, step);
    let terms = "material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }, { relative_modulus = 0.3, relaxation_time = 0.1 }, \
                 { relative_modulus = 0.0, relaxation_time = 1.0 }]";
    for one in CASES {
        // A weight of 0 is at the end of its allowed range.
        let more = set(&[terms, "material[0].stress_scale=1.5", "parameter[2].scale=0.1"]);
        let it = Parameterized::load(&path, &[case(one), more].concat()).unwrap();
        let moved = |j: usize, value: f64| {
            let mut values = it.values();
            values[j] = value;
            it.at(&values).unwrap().body.unwrap().muscle
        };
        let sizes = residuals_agree(&it, moved, &format!("{one:?}"));
        assert!(sizes.iter().all(|size| *size > 0.0), "{one:?}: {sizes:?}");
    }
}

/// Checks the constants of materials, foundations and tensions in bodies whose constants differ between elements.
#[test]
fn constants_of_materials_beds_and_tensions_have_their_derivatives() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "solid.bulk_modulus",
        "solid.rayleigh_mass",
        "material[1].bulk_modulus",
        "material[1].shear_modulus",
        "material[1].rayleigh_stiffness",
        "material[0].viscosity",
        "material[0].active.contractility",
        "elastic_foundation[0].stiffness",
        "elastic_foundation[0].damping",
    ];
    let more = "[[region]]\nname = \"hard\"\ncenter = [0.03, 0.0]\nradii = [0.03, 0.02]\n\
                [[material]]\ngroup = \"hard\"\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
                shear_modulus = 2e5\nbulk_modulus = 3e5\nrayleigh_stiffness = 2e-4\n\
                [[elastic_foundation]]\ngroup = \"load\"\nstiffness = 1e4\ndamping = 10.0\n";
    let path = scene(folder.path(), &keys, more);
    let it = Parameterized::load(
        &path,
        &set(&[
            "material[0].fiber=[1, 0]",
            "material[0].viscosity=10",
            "material[0].active={ type = \"bestel\", contractility = 1e4 }",
        ]),
    )
    .unwrap();
    let moved = |j: usize, value: f64| {
        let mut values = it.values();
        values[j] = value;
        it.at(&values).unwrap().body.unwrap().muscle
    };
    let sizes = residuals_agree(&it, moved, "materials");
    assert!(sizes.iter().all(|size| *size > 0.0), "{sizes:?}");
}

#[test]
fn outputs_have_the_derivatives_of_differences_of_runs() {
    let keys = [
        "material[0].c10",
        "solid.bulk_modulus",
        "solid.rayleigh_stiffness",
        "traction[0].y.frequency",
    ];
    outputs_agree(&keys, "", &["traction[0].y.shift=1"]);
}

/// Checks a step function whose breaks are within the run.
#[test]
fn outputs_have_the_derivatives_by_the_breaks_of_a_load() {
    let keys = ["traction[1].y.start", "traction[1].y.rise", "material[0].stress_scale"];
    let step = "[[traction]]\ngroup = \"load\"\n\
                y = { type = \"step\", value = 50.0, start = 0.01, rise = 0.03 }\n";
    outputs_agree(&keys, step, &SMALL);
}

/// Checks a body with an end rotated by one field of displacements while another field stretches the body.
#[test]
fn outputs_have_the_derivatives_by_the_sizes_of_displacements_that_vary() {
    let keys = ["prescribed_displacement[0].x.value", "prescribed_displacement[1].x.value"];
    let step = "{ type = \"step\", value = 0.1, rise = 0.04 }";
    let entry = |distribution: &str| {
        format!(
            "[[prescribed_displacement]]\ngroup = \"load\"\nx = {step}\nspatial_factor = \"{distribution}\"\n"
        )
    };
    outputs_agree(&keys, &(entry("-y") + &entry("0.01 + y^2")), &SMALL);
}

/// Checks a run with Prony terms, whose internal stresses are unknowns when sensitivities are computed.
#[test]
fn outputs_of_stress_that_relaxes_have_the_derivatives_of_differences_of_runs() {
    let keys = [
        "material[0].c10",
        "material[0].prony[0].relative_modulus",
        "material[0].prony[1].relaxation_time",
        "solid.rayleigh_stiffness",
    ];
    let terms = "material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }, { relative_modulus = 0.3, relaxation_time = 0.1 }]";
    outputs_agree(&keys, "", &[&[terms, "traction[0].y.shift=1"], &SMALL[..]].concat());
}

/// Compares sensitivities of outputs at the start and the end with differences of runs without sensitivities, at a
/// tolerance of 1e-8. Returns for each key the ratio of the largest derivative to the allowed error.
pub(crate) fn outputs_agree(keys: &[&str], more: &str, overrides: &[&str]) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let probe = "[[probe]]\nname = \"stress\"\ntype = \"point\"\nat = [0.01, 0.0]\n\
                 quantities = [\"stress\"]\ninterval = 0.05\n";
    let path = scene(folder.path(), keys, &format!("{probe}{more}"));
    let times = [0.0, 0.05];
    let own = [
        "time.end=0.05",
        "integrator.method=radau9",
        "integrator.rtol=1e-8",
        "integrator.atol.u=1e-12",
        "integrator.atol.v=1e-10",
        "integrator.atol.p=1e-6",
        "integrator.atol.p_rate=1e-4",
    ];
    let it = Parameterized::load(&path, &set(&[&own[..], overrides].concat())).unwrap();
    let watcher = Watcher { interrupt: None, progress: &() };
    let outputs = outputs(&it.scene).unwrap();
    let run = |values: &[f64], dependences: Dependences| {
        let scene = it.at(values).unwrap();
        let (samples, _) =
            follow(&scene, &outputs, &times, (dependences, Precision::default()), watcher).unwrap();
        samples
    };
    let values = it.values();
    let ours = run(&values, it.dependences(&values).unwrap());
    let of_key = |(j, key): (usize, &&str)| {
        let mut sharpness = 0.0_f64;
        let delta = 3e-3 * values[j];
        let terms = Stencil::Central.points().iter().map(|(k, weight)| {
            let mut moved = values.clone();
            moved[j] += k * delta;
            (weight / delta, run(&moved, Dependences::default()))
        });
        let terms: Vec<_> = terms.collect();
        let all = (0..times.len()).flat_map(|i| (0..outputs.len()).map(move |k| (i, k)));
        for (i, k) in all {
            let (own, name) = (ours[i].values[k], &outputs[k].name);
            let terms = terms.iter().map(|(weight, run)| weight * run[i].values[k]);
            let difference: f64 = terms.sum();
            let [difference, ours] =
                [difference, ours[i].derivatives[j][k]].map(|of_p| values[j] * of_p);
            // The truncation error (δ/p ωt/2)⁴ is 4e-6 of the derivative, with ωt up to 30 for waves from a sudden
            // start. The relative error of 1e-7 of the runs is divided by the step of 3e-3; it is relative to the
            // output, or for stresses to the multiplier. The absolute tolerances divided by 3e-3 matter for outputs
            // that are zero by symmetry. Order parameters, whose size is 1, have the errors of 1e-10 of the
            // oscillators.
            let (_, column) = name.split_once('.').unwrap();
            let (own, absolute) = match column.get(..1) {
                Some("u") => (own, 1e-12),
                Some("P" | "c") => (0.0, 1e-10),
                _ => (own, 1e-6),
            };
            let allowed = 1e-4 * (difference.abs() + own.abs()) + absolute / 3e-3;
            assert!(
                (ours - difference).abs() <= allowed,
                "d {name}/d {key} at {} s: {ours:e} {difference:e}, output {own:e}",
                times[i],
            );
            sharpness = sharpness.max(difference.abs() / allowed);
        }
        sharpness
    };
    keys.iter().enumerate().map(of_key).collect()
}

/// Checks that steps, factors and outputs are bitwise equal to the results of a run without sensitivities. Most steps reuse
/// an old Jacobian, some of them with a new h, which requires the unchanged matrices.
#[test]
fn runs_with_sensitivities_take_the_steps_of_the_plain_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "solid.bulk_modulus"], "");
    let it = Parameterized::load(
        &path,
        &set(&["time.end=0.3", "traction[0].y.shift=1", "integrator.method=radau9"]),
    )
    .unwrap();
    let watcher = Watcher { interrupt: None, progress: &() };
    let outputs = outputs(&it.scene).unwrap();
    let run = |dependences: Dependences| {
        let (samples, cost) = follow(
            &it.scene,
            &outputs,
            &[0.1, 0.2, 0.3],
            (dependences, Precision::default()),
            watcher,
        )
        .unwrap();
        let values: Vec<_> = samples.into_iter().map(|sample| sample.values).collect();
        (values, cost.steps, cost.factorizations)
    };
    let plain = run(Dependences::default());
    assert_eq!(run(it.dependences(&it.values()).unwrap()), plain);
    println!("{} steps, {} factorizations", plain.1, plain.2);
    // With three factorizations per step, no Jacobian would be reused.
    assert!(plain.2 < 3 * plain.1, "no Jacobian is kept");
}
