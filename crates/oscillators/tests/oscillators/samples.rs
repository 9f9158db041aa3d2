//! Numerical integration of known solutions: case S9 of the reference values.

use std::f64::consts::PI;

use crate::common::{distance, integrate, numbers, references, rhs};
use crate::known::{ChainMode, van_der_pol};
use myovib_oscillators::{Coefficients, Network};

/// Returns the amplitude and the period of the limit cycle, measured from one crest (w = 0, decreasing) to the
/// next.
fn limit_cycle(network: &Network, h: f64, duration: f64) -> (f64, f64) {
    let mut s = vec![2.0, 0.0];
    let mut crests = Vec::new();
    for k in 0..(duration / h) as usize {
        let next = integrate(network, &s, h, 1);
        if s[1] > 0.0 && next[1] <= 0.0 {
            // Newton's method for w(t) = 0. Each iterate takes one step from the same state.
            let (mut offset, mut crest) = (0.0, s.clone());
            for _ in 0..20 {
                offset -= crest[1] / rhs(network, &crest, &[0.0])[1];
                crest = integrate(network, &s, offset, 1);
            }
            crests.push((k as f64 * h + offset, crest[0]));
        }
        s = next;
    }
    let [.., before, last] = crests[..] else { panic!("two crests") };
    (last.1, last.0 - before.0)
}

/// Checks the published limit cycle of Van der Pol's oscillator with μ = ω, whose period is proportional to 1/ω.
#[test]
fn van_der_pol_reaches_the_published_limit_cycle() {
    let published = &references()["limit_cycle"];
    let (amplitude, period) =
        (published["amplitude"].as_f64().unwrap(), published["period"].as_f64().unwrap());
    for omega in [1.0, 16.0 * PI] {
        let network = van_der_pol(omega, omega).network().unwrap();
        // Perturbations decrease by e^{-7} per revolution, so after 8 revolutions only rounding errors remain: the
        // errors of 10³ steps and, in the difference of two times, the rounding of ω t ≈ 60.
        let (a, t) = limit_cycle(&network, 0.05 / omega, 60.0 / omega);
        assert!((a - amplitude).abs() < 1e-12, "A = {a:.15}");
        assert!((t - period / omega).abs() < 2e-12 / omega, "T = {t:.15}");
    }
}

fn wave() -> ChainMode {
    let published = &references()["chain_mode"];
    ChainMode {
        n_oscillators: 5,
        wave_number: 1,
        omega: 16.0 * PI,
        coefficients: Coefficients::default(),
        amplitude: published["amplitude"].as_f64().unwrap(),
    }
}

#[test]
fn the_frequencies_of_small_waves_are_the_published_ones() {
    let published = &references()["chain_mode"];
    for (wave_number, frequency) in numbers(&published["frequencies"]).into_iter().enumerate() {
        let squared = ChainMode { wave_number, ..wave() }.squared_frequency();
        // The error is the rounding of a few operations.
        assert!((squared.sqrt() - frequency).abs() < 8.0 * f64::EPSILON * frequency);
    }
    let lambda = wave().exponent();
    let exponent = numbers(&published["exponent"]);
    assert!((lambda.re - exponent[0]).abs() < 8.0 * f64::EPSILON * exponent[1]);
    assert!((lambda.im - exponent[1]).abs() < 8.0 * f64::EPSILON * exponent[1]);
}

#[test]
fn a_small_wave_on_the_chain_is_the_closed_form() {
    let mode = wave();
    let published = numbers(&references()["chain_mode"]["y_at_1"]);
    // The references agree with the closed form to their stated 12 digits.
    assert!(distance(&mode.states(1.0)[..5], &published) < 1e-12 * 4e-6);
    let network = mode.chain().network().unwrap();
    let integrated = integrate(&network, &mode.states(0.0), 1.0, 1000);
    // The nonlinear terms are y² ≈ 2e-11 relative to the damping. At t = 1, their effect is μ t times this ratio:
    // 4e-11 · y. Displacements reach 4.4e-6.
    let error = distance(&integrated[..5], &published) / 4.4e-6;
    assert!(error < 4e-11, "{error:e}");
    // With an amplitude a thousand times smaller, only the rounding errors of the integration remain.
    let tiny = ChainMode { amplitude: 1e-9, ..mode };
    let integrated = integrate(&network, &tiny.states(0.0), 1.0, 1000);
    let error = distance(&integrated, &tiny.states(1.0)) / 4.4e-9 / (16.0 * PI);
    assert!(error < 1e-12, "{error:e}");
}
