//! Generalized conjugate residuals for one right-hand side.

use crate::dense::add_scaled;

/// Solves K x = r by generalized conjugate residuals (Eisenstat, Elman, Schultz 1983).
///
/// Each direction p is stored with q = K p, and the vectors q are orthogonal. A few directions are sufficient, because
/// K is preconditioned by the factors of a frozen Jacobian and therefore close to the identity.
#[derive(Debug, Default)]
pub(super) struct Krylov {
    /// Directions p with q and 1/|q|². The first `used` directions belong to the last solve.
    directions: Vec<Direction>,
    used: usize,
}

#[derive(Debug, Default)]
struct Direction {
    p: Vec<f64>,
    q: Vec<f64>,
    inverse: f64,
}

/// Maximum number of directions per solve.
const MAX_DIRECTIONS: usize = 60;

/// Reason why a solve failed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the linear solver {}", outcome(*norm))]
pub(super) struct Stalled {
    /// Norm of the remaining residual.
    pub(super) norm: f64,
    /// Index of the right-hand side, if there are several.
    pub(super) column: usize,
}

fn outcome(norm: f64) -> String {
    match norm.is_finite() {
        true => format!("stagnates at {norm:.1e} times the tolerance"),
        false => "finds no finite solution".to_owned(),
    }
}

impl Stalled {
    /// Creates the error of a solve with a single right-hand side.
    fn at(norm: f64) -> Self {
        Self { norm, column: 0 }
    }
}

impl Krylov {
    /// Returns the number of directions used in the last solve.
    pub(super) fn directions(&self) -> usize {
        self.used
    }

    /// Adds the solution of K d = `r` to `x` with a residual norm of about `tolerance`. `apply` replaces v by K v.
    ///
    /// At the end, the remaining residual r is added to the solution. As K is close to the identity, the new residual
    /// r − K r is smaller. Its norm is estimated from the contraction measured for the last direction.
    ///
    /// # Shapes
    /// `weights`: relative weights of the components; all slices have the same length.
    pub(super) fn solve<E: From<Stalled>>(
        &mut self,
        x: &mut [f64],
        r: &mut [f64],
        weights: &[f64],
        tolerance: f64,
        mut apply: impl FnMut(&mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { directions, used } = self;
        *used = 0;
        let mut contraction = 1.0;
        loop {
            let size = norm(r, weights);
            if contraction * size <= tolerance {
                add_scaled(x, 1.0, r);
                return Ok(());
            }
            if *used == MAX_DIRECTIONS || !size.is_finite() {
                return Err(Stalled::at(size).into());
            }
            if *used == directions.len() {
                directions.push(Direction::default());
            }
            let (known, rest) = directions.split_at_mut(*used);
            let Direction { p, q, inverse } = &mut rest[0];
            for copy in [&mut *p, &mut *q] {
                copy.clear();
                copy.extend_from_slice(r);
            }
            apply(q)?;
            contraction = difference(p, q, weights) / size;
            for other in known.iter() {
                let share = inner(q, &other.q, weights) * other.inverse;
                add_scaled(p, -share, &other.p);
                add_scaled(q, -share, &other.q);
            }
            *inverse = 1.0 / inner(q, q, weights);
            if !(*inverse > 0.0 && inverse.is_finite()) {
                return Err(Stalled::at(size).into());
            }
            // Remove the component along q from r, and add the corresponding multiple of p to x.
            let share = inner(r, q, weights) * *inverse;
            add_scaled(x, share, p);
            add_scaled(r, -share, q);
            *used += 1;
        }
    }
}

/// Returns the mean of w² a b.
fn inner(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let products = |[a, b, w]: [f64; 3]| (a * w) * (b * w);
    mean([a, b, weights], products)
}

/// Returns the root mean square of w a.
pub(super) fn norm(a: &[f64], weights: &[f64]) -> f64 {
    inner(a, a, weights).sqrt()
}

/// Returns the norm of a − b.
fn difference(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let squares = |[a, b, w]: [f64; 3]| ((a - b) * w).powi(2);
    mean([a, b, weights], squares).sqrt()
}

/// Returns the mean of a function of the components of three vectors. The sum is computed in SIMD lanes.
fn mean([a, b, w]: [&[f64]; 3], of: impl Fn([f64; 3]) -> f64) -> f64 {
    const LANES: usize = 8;
    let (a, a_left) = a.as_chunks::<LANES>();
    let (b, b_left) = b.as_chunks::<LANES>();
    let (w, w_left) = w.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for ((a, b), w) in a.iter().zip(b).zip(w) {
        for (lane, sum) in lanes.iter_mut().enumerate() {
            *sum += of([a[lane], b[lane], w[lane]]);
        }
    }
    let left = a_left.iter().zip(b_left).zip(w_left);
    let left: f64 = left.map(|((a, b), w)| of([*a, *b, *w])).sum();
    let n = LANES * a.len() + a_left.len();
    (lanes.iter().sum::<f64>() + left) / n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes v ← K v with K = I + 0.3 × (cyclic shift), which is normal with eigenvalues on a circle around 1.
    fn apply(v: &mut [f64]) -> Result<(), Stalled> {
        let last = v.to_vec();
        for (i, v) in v.iter_mut().enumerate() {
            *v += 0.3 * last[(i + 1) % last.len()];
        }
        Ok(())
    }

    /// Each direction reduces the residual by a factor of 0.3 or less, so ten digits require at most 19 directions,
    /// including the final addition of the residual.
    #[test]
    fn solutions_leave_no_more_than_the_tolerance_and_little_less() {
        let n = 40;
        let weights = vec![1.0; n];
        let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let (mut krylov, mut x, mut r) = (Krylov::default(), vec![0.0; n], b.clone());
        krylov.solve(&mut x, &mut r, &weights, 1e-10, apply).unwrap();
        assert!((3..=18).contains(&krylov.directions()), "{krylov:?}");
        apply(&mut x).unwrap();
        let left = difference(&x, &b, &weights);
        assert!((1e-13..1e-10).contains(&left), "{left:e}");
    }

    #[test]
    fn a_zero_operator_stops_the_iteration() {
        let zero = |v: &mut [f64]| {
            v.fill(0.0);
            Ok::<(), Stalled>(())
        };
        let mut krylov = Krylov::default();
        let stalled = krylov.solve(&mut [0.0], &mut [1.0], &[1.0], 1e-3, zero);
        assert_eq!(stalled, Err(Stalled::at(1.0)));
    }
}
