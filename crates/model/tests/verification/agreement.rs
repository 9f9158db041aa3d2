//! Different formulations of a body agree in the limit of small tolerances and fine meshes.

use myovib_model::{Formulation, Signal, formula, paper};

use crate::common::{accurate, history, loaded_block, relative_difference};

const TIP: [f64; 2] = [1.1, 1.0];
const T_END: f64 = 0.4;
const EVERY: f64 = 0.02;

/// A load that is slow compared with the first mode (about 1 Hz for the meter-sized block); it
/// bends the body by 10 %.
fn load() -> Signal {
    Signal::from(formula::Sine { amplitude: 400.0, frequency: 1.0, phase: 0.0 })
}

#[test]
fn incompressible_formulations_agree_as_tolerances_tighten() {
    let block = || loaded_block(1, paper::LAW, f64::INFINITY, 0.0, load());
    let at = |formulation, rtol| {
        history(block(), formulation, &accurate(formulation, rtol, T_END), TIP, EVERY)
    };
    let reference = at(Formulation::Stabilized, 1e-7);
    for formulation in [Formulation::Position, Formulation::Velocity, Formulation::Stabilized] {
        let errors: Vec<f64> =
            [1e-3, 1e-5].map(|rtol| relative_difference(&at(formulation, rtol), &reference)).into();
        // BDF 2: the global error is proportional to rtol^(2/3), a factor of 21 for 1e-3 to 1e-5;
        // half of the digits are required.
        assert!(errors[1] < errors[0] / 5.0, "{formulation}: {errors:?}");
        assert!(errors[1] < 5e-3, "{formulation}: {errors:?}");
    }
}

#[test]
fn the_damped_formulations_agree_and_tend_to_the_undamped_one() {
    let at = |formulation, beta| {
        let block = loaded_block(1, paper::LAW, f64::INFINITY, beta, load());
        history(block, formulation, &accurate(formulation, 1e-6, T_END), TIP, EVERY)
    };
    let undamped = at(Formulation::Position, 0.0);
    let gaps: Vec<f64> = [1e-3, 1e-4, 1e-5]
        .map(|beta| {
            let implicit = at(Formulation::ImplicitRate, beta);
            let explicit = at(Formulation::Rate, beta);
            // Two formulations of the same physics differ by the integration error for rtol = 1e-6, as above.
            let between = relative_difference(&explicit, &implicit);
            assert!(between < 1e-3, "beta = {beta}: {between:e}");
            relative_difference(&implicit, &undamped)
        })
        .into();
    // Linear in β until the integration error is reached.
    assert!(gaps[1] < gaps[0] / 3.0, "{gaps:?}");
    assert!(gaps[2] < gaps[1], "{gaps:?}");
}

#[test]
fn displacement_and_position_agree_under_refinement() {
    const MIDDLE: [f64; 2] = [0.5, 0.6];
    let at = |levels, formulation| {
        let block = loaded_block(levels, paper::LAW, 1e5, 0.0, load());
        history(block, formulation, &accurate(formulation, 1e-5, 0.1), MIDDLE, EVERY)
    };
    let gaps: Vec<f64> = [1, 2, 3]
        .map(|levels| {
            let ours = at(levels, Formulation::Displacement);
            relative_difference(&ours, &at(levels, Formulation::Position))
        })
        .into();
    // The difference of two discretizations of one problem decreases with the mesh width. Because of the singular
    // corners of the clamped edge, it decreases more slowly than the order of the elements suggests.
    assert!(gaps[1] < gaps[0] / 1.5 && gaps[2] < gaps[1] / 1.5, "{gaps:?}");
}
