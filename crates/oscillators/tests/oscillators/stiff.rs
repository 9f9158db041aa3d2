//! Van der Pol's oscillator with μ = 1000, problem `vdpolm` of the Test Set. Only implicit methods can integrate
//! it efficiently, so the test detects a wrong Jacobian.

use nalgebra::{DMatrix, DVector};

use crate::common::{jacobian, numbers, references};
use crate::known::van_der_pol;
use myovib_oscillators::Network;

/// Number of columns of the extrapolation tableau, which is the order of the method.
const ORDER: usize = 8;

/// Takes `n` steps of the linearly implicit Euler method over a total length h, with the Jacobian evaluated at
/// `frozen`: (∂F/∂s + n/h ∂F/∂ṡ) Δs = −F(s, 0).
fn implicit_euler(network: &Network, frozen: &[f64], h: f64, n: usize) -> DVector<f64> {
    let size = network.n_states();
    let factors = DMatrix::from(&jacobian(network, frozen, 1.0, n as f64 / h)).lu();
    let mut s = DVector::from_column_slice(frozen);
    for _ in 0..n {
        let mut f = DVector::zeros(size);
        network.residual(s.as_slice(), &vec![0.0; size], &[0.0], f.as_mut_slice());
        s -= factors.solve(&f).unwrap();
    }
    s
}

/// Returns the extrapolated state after a step of length `h`, and the last correction as an error estimate.
fn extrapolated(network: &Network, s: &DVector<f64>, h: f64) -> (DVector<f64>, f64) {
    let mut previous: Vec<DVector<f64>> = Vec::new();
    for n in 1..=ORDER {
        let mut row = vec![implicit_euler(network, s.as_slice(), h, n)];
        for (k, coarse) in previous.iter().enumerate() {
            let ratio = n as f64 / (n - 1 - k) as f64;
            let next = &row[k] + (&row[k] - coarse) / (ratio - 1.0);
            row.push(next);
        }
        previous = row;
    }
    // The error is relative to position and velocity. The magnitude of the velocity is replaced by 1e-3 where it
    // is smaller.
    let correction = &previous[ORDER - 1] - &previous[ORDER - 2];
    let error = (correction[0] / s[0].abs().max(1.0)).hypot(correction[1] / s[1].abs().max(1e-3));
    (previous.swap_remove(ORDER - 1), error)
}

/// Integrates from `s` over `t_end` with the local error per step below `tolerance`. Returns the state and the number
/// of steps.
fn integrate(network: &Network, s: [f64; 2], t_end: f64, tolerance: f64) -> (DVector<f64>, usize) {
    let (mut t, mut h, mut steps) = (0.0, 1e-6, 0);
    let mut s = DVector::from_column_slice(&s);
    while t < t_end {
        h = f64::min(h, t_end - t);
        let (next, error) = extrapolated(network, &s, h);
        if error <= tolerance {
            (t, s, steps) = (t + h, next, steps + 1);
        }
        // A NaN error, which results from an overflow, shortens the step like a large error.
        let factor = 0.8 * (tolerance / error).powf(1.0 / ORDER as f64);
        h *= if factor.is_finite() { factor.clamp(0.2, 4.0) } else { 0.2 };
    }
    (s, steps)
}

#[test]
fn the_stiff_oscillator_matches_the_test_set() {
    let published = &references()["vdpolm"];
    let y = numbers(&published["y"]);
    let network = van_der_pol(published["vdp_mu"].as_f64().unwrap(), 1.0).network().unwrap();
    let t_end = published["t"].as_f64().unwrap();
    let (s, steps) = integrate(&network, [2.0, 0.0], t_end, 1e-10);
    // Between its jumps, the flow is contractive, so the error at the end is at most the tolerance of one step.
    assert!((s[0] - y[0]).abs() < 1e-10 * y[0].abs(), "{:e}", s[0] - y[0]);
    assert!((s[1] - y[1]).abs() < 1e-10 * y[1].abs(), "{:e}", s[1] - y[1]);
    // With the correct Jacobian, 1200 steps suffice. If stability limited the step to h < 2/(3 μ), 3 million steps
    // would be necessary.
    assert!(steps < 2500, "{steps}");
}
