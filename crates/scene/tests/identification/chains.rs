//! Derivatives of chains: ∂F/∂p for all their constants, and derivatives of order parameters compared with differences
//! of runs.

use std::path::Path;

use myovib_scene::sensitivity::{Parameterized, Precision, compute};
use myovib_scene::watch::Watcher;

use crate::derivatives::outputs_agree;
use crate::fits::{fitted, measure};
use crate::{SMALL, scene, set};

/// A chain of six oscillators at a point, with linear and cubic restoring forces, whose order parameters are observed.
const CHAIN: &str = "[[chain]]\nname = \"tissue\"\noscillators = 6\nfrequency_spread = 0.477464829275686\nduffing = 40.0\ngain = 1e6\n\
                     at = [0.03, 0.005]\ncomponent = [1.0, 2.0]\ninitial = 0.2\n\
                     [[probe]]\nname = \"order\"\ntype = \"coherence\"\nchain = \"tissue\"\ninterval = 0.05\n";

/// Checks that constants of the body affect a chain through the driving motion, and that constants of a chain do not
/// affect the body or other chains.
#[test]
fn order_parameters_have_the_derivatives_of_differences_of_runs() {
    let keys = [
        "chain[0].gain",
        "material[0].c10",
        "chain[0].van_der_pol",
        "chain[0].duffing",
        "traction[0].y.amplitude",
        "chain[0].coupling",
        "chain[0].frequency",
        "chain[0].frequency_spread",
        "chain[0].initial",
    ];
    let tight = [
        "traction[0].y.shift=1",
        "integrator.oscillators.rtol=1e-10",
        "integrator.oscillators.atol=1e-12",
    ];
    expect_sharp(&keys, outputs_agree(&keys, CHAIN, &tight));
}

/// Checks a body whose tensions and relaxing stresses are unknowns, and whose motion starts with a velocity.
#[test]
fn chains_beside_tensions_and_stress_that_relaxes_have_their_derivatives() {
    let keys = ["material[0].c10", "chain[0].gain"];
    let rest = [
        "integrator.oscillators.rtol=1e-10",
        "integrator.oscillators.atol=1e-12",
        "initial_state={ type = \"velocity\", value = [0.0, 0.1] }",
        "traction[0].y.shift=1",
    ];
    for own in [
        &["material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }]"][..],
        &[
            "material[0].fiber=[1, 0]",
            "material[0].active={ type = \"bestel\", contractility = 1e4 }",
        ],
    ] {
        let overrides = [&rest[..], &SMALL[..2], own, &["probe[0].at=[0.05, 0.0]"]].concat();
        expect_sharp(&keys, outputs_agree(&keys, CHAIN, &overrides));
    }
}

/// Asserts that the effect of each key is far above the tolerance of the comparison.
fn expect_sharp(keys: &[&str], sharpness: Vec<f64>) {
    for (key, times) in keys.iter().zip(sharpness) {
        assert!(times > 50.0, "{key}: {times}");
    }
}

#[test]
fn a_key_may_be_written_with_dots() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["chain.0.gain"], CHAIN);
    let it = Parameterized::load(&path, &[]).unwrap();
    assert_eq!(it.parameters[0].key, "chain[0].gain");
}

/// Checks that sensitivities integrate chains and body as one system, even if the scene requests separate steps.
#[test]
fn the_key_for_separate_steps_leaves_sensitivities_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "chain[0].gain"], CHAIN);
    let samples = ["separate", "together"].map(|chains| {
        let own = set(&["time.end=0.1", "chain[0].at=[0.05, 0.0]"]);
        let chains = set(&[&*format!("integrator.chains={chains}")]);
        let it = Parameterized::load(&path, &[set(&SMALL), own, chains].concat()).unwrap();
        compute(&it, Precision::OfMotion, Watcher::NOBODY).unwrap().samples
    });
    let [separate, together] = samples;
    assert_eq!(separate.len(), together.len());
    for (one, other) in separate.iter().zip(&together) {
        assert_eq!(one.values, other.values);
        assert_eq!(one.derivatives, other.derivatives);
        assert!(one.derivatives.len() == 2);
    }
}

/// Checks that each parameter affects only its own chain, at many places of an incompressible body.
#[test]
fn each_chain_has_separate_parameters() {
    let keys = ["chain[1].coupling", "chain[0].initial", "chain[1].gain"];
    let second = "[[chain]]\nname = \"edge\"\noscillators = 3\ninitial = 0.1\ngain = 1e4\n\
                  [[probe]]\nname = \"edge\"\ntype = \"coherence\"\nchain = \"edge\"\ninterval = 0.05\n";
    let overrides = [
        "traction[0].y.shift=1",
        "solid.bulk_modulus=inf",
        "chain[1].at={ vertices = \"load\" }",
        "integrator.oscillators.rtol=1e-10",
        "integrator.oscillators.atol=1e-12",
    ];
    let sharpness = outputs_agree(&keys, &format!("{CHAIN}{second}"), &overrides);
    expect_sharp(&keys, sharpness);
}

/// Checks oscillators at rest: modulus and argument of an order parameter are then not differentiable with respect to
/// the positions. The table has no entry at such times, and sums over time exclude them.
#[test]
fn an_order_parameter_at_rest_has_no_derivative() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["chain[0].initial"], CHAIN);
    let own = set(&[
        "chain[0].initial=0",
        "parameter[0].scale=0.1",
        "time.end=0.1",
        "chain[0].at=[0.05, 0.0]",
    ]);
    let it = Parameterized::load(&path, &[set(&SMALL), own].concat()).unwrap();
    let curves = compute(&it, Precision::OfMotion, Watcher::NOBODY).unwrap();
    let angle = curves.outputs.iter().position(|name| name == "order.Psi_arg");
    let k = angle.unwrap();
    for sample in &curves.samples {
        let of_angle = sample.derivatives[0][k];
        assert_eq!(of_angle.is_nan(), sample.t == 0.0, "{}: {of_angle}", sample.t);
    }
    assert!(curves.importance()[k][0].is_finite());
}

/// Checks that sensitivities and fits integrate chains only for outputs that measure them.
#[test]
fn outputs_of_the_body_are_computed_without_the_chains() {
    let folder = tempfile::tempdir().unwrap();
    let chain = CHAIN.replace("[0.03, 0.005]", "[0.05, 0.0]");
    let output = "[[output]]\nname = \"tip\"\nprobe = \"origin\"\ncolumn = \"u_y\"\n";
    let write = |name: &str, keys: &[&str], more: &str| {
        let own = folder.path().join(name);
        std::fs::create_dir(&own).unwrap();
        scene(&own, keys, more)
    };
    let keys = ["material[0].c10", "chain[0].gain"];
    let curves = |path: &Path| {
        let it =
            Parameterized::load(path, &[set(&SMALL), set(&["time.end=0.1"])].concat()).unwrap();
        compute(&it, Precision::OfMotion, Watcher::NOBODY).unwrap()
    };
    let without = curves(&write("without", &keys[..1], output));
    let with = curves(&write("with", &keys, &format!("{output}{chain}")));
    assert_eq!(without.cost.steps, with.cost.steps);
    for (one, other) in without.samples.iter().zip(&with.samples) {
        assert_eq!(one.values, other.values);
        assert_eq!(other.derivatives, [one.derivatives[0].clone(), vec![0.0]]);
    }
    // All columns are outputs here, but only the body is measured.
    let alone = write("alone", &keys[..1], "");
    let data = folder.path().join("measured.csv");
    measure(&alone, &[&SMALL[..2], &["material[0].c10=1.3e4", SMALL[2]]].concat(), 0.0, &data);
    let fits = [alone, write("beside", &keys[..1], &chain)].map(|path| {
        let fit = fitted(path, data.clone(), &SMALL, |options| options).unwrap();
        (fit.fit.values, fit.runs)
    });
    assert_eq!(fits[0], fits[1]);
}
