//! Shared test utilities: random numbers, reference values and a small integrator.

use myovib_oscillators::{Generator, Network};
use nalgebra_sparse::CscMatrix;
use serde_json::Value;

/// Returns `n` reproducible numbers in (−1, 1).
pub(crate) fn random(seed: u32, n: usize) -> Vec<f64> {
    Generator::ChaCha8.uniform(seed, n).iter().map(|x| 2.0 * x - 1.0).collect()
}

/// Returns the published values of case S9. Their file states the source.
pub(crate) fn references() -> Value {
    serde_json::from_str(include_str!("../../../../data/references/s9_oscillators.json")).unwrap()
}

/// Converts a JSON list to numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Returns max |a − b|.
///
/// # Panics
/// Panics if a difference is NaN, which `f64::max` would ignore.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, |largest, difference| {
        assert!(!difference.is_nan(), "{a:?} {b:?}");
        f64::max(largest, difference)
    })
}

/// Returns ṡ = −F(s, 0; c).
pub(crate) fn rhs(network: &Network, s: &[f64], forcing: &[f64]) -> Vec<f64> {
    let mut f = vec![0.0; s.len()];
    network.residual(s, &vec![0.0; s.len()], forcing, &mut f);
    f.iter().map(|x| -x).collect()
}

/// Returns a ∂F/∂s + b ∂F/∂ṡ.
pub(crate) fn jacobian(network: &Network, s: &[f64], a: f64, b: f64) -> CscMatrix<f64> {
    let pattern = network.jacobian_pattern().clone();
    let mut values = vec![f64::NAN; pattern.nnz()];
    network.jacobian(s, a, b, &mut values);
    CscMatrix::try_from_pattern_and_values(pattern, values).unwrap()
}

/// Integrates from `s` at t = 0 to `t_end` without forcing, in `n_steps` equal steps.
pub(crate) fn integrate(network: &Network, s: &[f64], t_end: f64, n_steps: usize) -> Vec<f64> {
    let h = t_end / n_steps as f64;
    (0..n_steps).fold(s.to_vec(), |s, _| step(network, |_| 0.0, 0.0, &s, h))
}

/// Performs one step from `s` at time `t` under the forcing `c(t)`, which is equal in all directions.
///
/// The method extrapolates the modified midpoint rule to order 12. It has no error control, so each test states
/// why its step is small enough.
pub(crate) fn step(
    network: &Network,
    c: impl Fn(f64) -> f64,
    t: f64,
    s: &[f64],
    h: f64,
) -> Vec<f64> {
    const LEVELS: usize = 6;
    let f = |t: f64, s: &[f64]| rhs(network, s, &vec![c(t); network.n_channels()]);
    let substeps = |level: usize| 2 * (level + 1);
    let mut previous: Vec<Vec<f64>> = Vec::new();
    for level in 0..LEVELS {
        let mut row = vec![midpoint(f, t, s, h, substeps(level))];
        for (k, coarse) in previous.iter().enumerate() {
            let ratio = substeps(level) as f64 / substeps(level - 1 - k) as f64;
            let factor = 1.0 / (ratio * ratio - 1.0);
            row.push(axpy(&row[k], factor, &axpy(&row[k], -1.0, coarse)));
        }
        previous = row;
    }
    previous.swap_remove(LEVELS - 1)
}

fn midpoint(f: impl Fn(f64, &[f64]) -> Vec<f64>, t: f64, s: &[f64], h: f64, n: usize) -> Vec<f64> {
    let h = h / n as f64;
    let (mut before, mut now) = (s.to_vec(), axpy(s, h, &f(t, s)));
    for k in 1..n {
        let next = axpy(&before, 2.0 * h, &f(t + k as f64 * h, &now));
        before = std::mem::replace(&mut now, next);
    }
    now
}

fn axpy(x: &[f64], factor: f64, direction: &[f64]) -> Vec<f64> {
    x.iter().zip(direction).map(|(x, d)| x + factor * d).collect()
}
