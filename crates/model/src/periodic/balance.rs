//! Harmonic balance for nearly linear motions.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use myovib_dae::{LinearSolver, Linearization, Problem, StepError};
use num_complex::Complex64;

const HARMONICS: usize = 10;
/// Number of sample times per period. With at least 3 H + 1 sample times for H harmonics, products of two harmonics are
/// not aliased to any of the H harmonics.
const TIMES: usize = 32;
const MAX_ITERATIONS: usize = 30;
/// If the ratio of consecutive corrections exceeds this value, the motion is not considered nearly linear.
const CONTRACTION: f64 = 0.5;

/// Returns y at the start of the periodic motion near the constant state `y`. Returns `None` if the motion is not
/// nearly linear or if `interrupt` is set.
///
/// Applies Newton's method to the coefficients of Σ ŷ_k e^(ikωt), with the Jacobian at the constant state. Each
/// harmonic therefore has a separate linear system with the matrix ∂F/∂y + ikω ∂F/∂ẏ. The iteration ends when the
/// corrections in each of the `blocks` are below `tolerance` times the largest value in the block.
///
/// # Errors
/// Errors of the problem, and errors due to singular matrices. For example, if an equation determines only a rate, the
/// mean value is undetermined.
pub fn balance<P: Problem, M: LinearSolver<P>>(
    problem: &mut P,
    matrices: &mut M,
    [start, end]: [f64; 2],
    y: &[f64],
    blocks: &[Range<usize>],
    tolerance: f64,
    interrupt: Option<&AtomicBool>,
) -> Result<Option<Vec<f64>>, StepError> {
    let (n, omega) = (y.len(), TAU / (end - start));
    let shifts: Vec<Complex64> =
        (1..=HARMONICS).map(|k| Complex64::new(0.0, k as f64 * omega)).collect();
    let rest = vec![0.0; n];
    let step = (end - start) / TIMES as f64;
    let at = Linearization { t: start, y, y_dot: &rest, step, weights: &vec![1.0 / tolerance; n] };
    matrices.evaluate(problem, &at)?;
    matrices.set_up(problem, 0.0, &shifts)?;
    let mut mean = y.to_vec();
    let mut waves = vec![vec![Complex64::ZERO; n]; HARMONICS];
    let mut last = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        let mut constant = vec![0.0; n];
        let mut parts = vec![vec![Complex64::ZERO; n]; HARMONICS];
        for i in 0..TIMES {
            if interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return Ok(None);
            }
            let phase = |k: usize| Complex64::cis(TAU * (k * i % TIMES) as f64 / TIMES as f64);
            let (mut value, mut rate, mut residual) = (mean.clone(), vec![0.0; n], vec![0.0; n]);
            for (k, (wave, shift)) in waves.iter().zip(&shifts).enumerate() {
                let (wave_value, wave_rate) = (phase(k + 1), shift * phase(k + 1));
                for j in 0..n {
                    value[j] += (wave_value * wave[j]).re;
                    rate[j] += (wave_rate * wave[j]).re;
                }
            }
            problem.residual(start + step * i as f64, &value, &rate, &mut residual)?;
            let share = -1.0 / TIMES as f64;
            constant.iter_mut().zip(&residual).for_each(|(c, r)| *c += share * r);
            for (k, part) in parts.iter_mut().enumerate() {
                let factor = 2.0 * share * phase(k + 1).conj();
                part.iter_mut().zip(&residual).for_each(|(c, r)| *c += factor * r);
            }
        }
        matrices.solve_real(problem, &mut constant)?;
        mean.iter_mut().zip(&constant).for_each(|(y, change)| *y += change);
        for (k, (wave, part)) in waves.iter_mut().zip(&mut parts).enumerate() {
            matrices.solve_complex(problem, k, part)?;
            wave.iter_mut().zip(&*part).for_each(|(y, change)| *y += change);
        }
        if !(mean.iter().all(|y| y.is_finite()) && waves.iter().flatten().all(|y| y.is_finite())) {
            return Ok(None);
        }
        let of = |mean: &[f64], waves: &[Vec<Complex64>], block: &Range<usize>| {
            let largest = |j: usize| mean[j].abs() + waves.iter().map(|y| y[j].norm()).sum::<f64>();
            block.clone().map(largest).fold(0.0, f64::max)
        };
        let changes = blocks.iter().map(|block| match of(&mean, &waves, block) {
            size if size > 0.0 => of(&constant, &parts, block) / size,
            size => size,
        });
        let change = changes.fold(0.0, f64::max);
        if change <= tolerance {
            let at_start = |j: usize| mean[j] + waves.iter().map(|y| y[j].re).sum::<f64>();
            return Ok(Some((0..n).map(at_start).collect()));
        }
        if change > CONTRACTION * last {
            return Ok(None);
        }
        last = change;
    }
    Ok(None)
}
