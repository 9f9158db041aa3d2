//! Generalised conjugate residuals with the directions of all right-hand sides.

use crate::dense::add_scaled;

/// Solves K x = r for one right-hand side after another by generalised conjugate residuals
/// (Eisenstat, Elman, Schultz 1983).
///
/// Each direction p is kept with q = K p, the q orthonormal; a new right-hand side starts with what
/// the directions of those before can do for it. With K near the identity, as preconditioned by the
/// factors of a frozen Jacobian, a few directions are enough for all.
#[derive(Debug, Default)]
pub(super) struct Krylov {
    /// (p, q), of which the first `used` belong to this K.
    directions: Vec<[Vec<f64>; 2]>,
    used: usize,
    /// Weights of the inner product, the same for all right-hand sides of a K.
    weights: Vec<f64>,
    /// The largest ‖r − K r‖/‖r‖ seen with this K.
    contraction: Option<f64>,
}

/// Most directions of one K.
const MOST: usize = 60;

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stalled {
    /// The norm of the residual left.
    pub(super) norm: f64,
    /// The right-hand side, of several that are solved for at once.
    pub(super) column: usize,
}

impl Stalled {
    /// Of the only right-hand side.
    fn at(norm: f64) -> Self {
        Self { norm, column: 0 }
    }
}

impl Krylov {
    /// Forgets the directions: K is another one. `weights` say how components count together.
    pub(super) fn restart(&mut self, weights: &[f64]) {
        self.used = 0;
        self.contraction = None;
        self.weights.clear();
        self.weights.extend_from_slice(weights);
    }

    /// The norm that right-hand sides have in common.
    pub(super) fn norm(&self, r: &[f64]) -> f64 {
        norm(r, &self.weights)
    }

    /// How many directions there are for this K.
    pub(super) fn directions(&self) -> usize {
        self.used
    }

    /// Adds the solution of K d = `r` to `x`, up to an error with a norm, with the weights of this
    /// right-hand side, of about `tolerance`. `apply` replaces v by K v.
    ///
    /// K being near the identity, what is left of r is added in the end, which leaves r − K r: as
    /// much smaller as the right-hand sides before have shown.
    ///
    /// # Shapes
    /// `wanted`: a weight for each component; all slices are of one length.
    pub(super) fn solve<E: From<Stalled>>(
        &mut self,
        x: &mut [f64],
        r: &mut [f64],
        wanted: &[f64],
        tolerance: f64,
        mut apply: impl FnMut(&mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self {
            directions,
            used,
            weights,
            contraction,
        } = self;
        for [p, q] in &directions[..*used] {
            project(x, r, p, q, weights);
        }
        loop {
            let size = norm(r, wanted);
            if contraction.unwrap_or(1.0) * size <= tolerance {
                add_scaled(x, 1.0, r);
                return Ok(());
            }
            if *used == MOST || !size.is_finite() {
                return Err(Stalled::at(size).into());
            }
            if *used == directions.len() {
                let zero = vec![0.0; r.len()];
                directions.push([zero.clone(), zero]);
            }
            let (known, rest) = directions.split_at_mut(*used);
            let [p, q] = &mut rest[0];
            p.copy_from_slice(r);
            q.copy_from_slice(r);
            apply(q)?;
            let left = difference(p, q, wanted) / size;
            *contraction = Some(contraction.map_or(left, |largest| largest.max(left)));
            for [p_k, q_k] in known.iter() {
                let share = inner(q, q_k, weights);
                add_scaled(p, -share, p_k);
                add_scaled(q, -share, q_k);
            }
            let length = norm(q, weights);
            if !(length > 0.0 && length.is_finite()) {
                return Err(Stalled::at(size).into());
            }
            p.iter_mut().for_each(|p| *p /= length);
            q.iter_mut().for_each(|q| *q /= length);
            project(x, r, p, q, weights);
            *used += 1;
        }
    }
}

/// Takes the part along q from r, and adds what it is the image of to x.
fn project(x: &mut [f64], r: &mut [f64], p: &[f64], q: &[f64], weights: &[f64]) {
    let share = inner(r, q, weights);
    add_scaled(x, share, p);
    add_scaled(r, -share, q);
}

/// The mean of w² a b.
fn inner(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let products = |[a, b, w]: [f64; 3]| (a * w) * (b * w);
    mean([a, b, weights], products)
}

fn norm(a: &[f64], weights: &[f64]) -> f64 {
    inner(a, a, weights).sqrt()
}

/// The norm of a − b.
fn difference(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let squares = |[a, b, w]: [f64; 3]| ((a - b) * w).powi(2);
    mean([a, b, weights], squares).sqrt()
}

/// The mean of a function of three vectors' components, summed in lanes so that it becomes vector
/// instructions.
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

    /// K = I + 0.3 × (cyclic shift), which is normal with eigenvalues on a circle about 1.
    fn apply(v: &mut [f64]) -> Result<(), Stalled> {
        let last = v.to_vec();
        for (i, v) in v.iter_mut().enumerate() {
            *v += 0.3 * last[(i + 1) % last.len()];
        }
        Ok(())
    }

    #[test]
    fn solutions_solve_and_a_second_one_needs_fewer_directions() {
        let n = 40;
        let weights = vec![1.0; n];
        let mut krylov = Krylov::default();
        krylov.restart(&weights);
        let mut counts = Vec::new();
        // The second right-hand side is the image of the first.
        let first: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut second = first.clone();
        apply(&mut second).unwrap();
        for b in [first, second] {
            let (mut x, mut r) = (vec![0.0; n], b.clone());
            let before = krylov.used;
            krylov
                .solve(&mut x, &mut r, &weights, 1e-10, apply)
                .unwrap();
            counts.push(krylov.used - before);
            apply(&mut x).unwrap();
            let left = x.iter().zip(&b).map(|(x, b)| (x - b).abs());
            // The error is √n from mean to largest.
            assert!(left.fold(0.0, f64::max) < 1e-9);
        }
        assert!(counts[0] > 3 && counts[1] <= 1, "{counts:?}");
    }

    #[test]
    fn an_operator_that_loses_its_argument_is_no_endless_loop() {
        let zero = |v: &mut [f64]| {
            v.fill(0.0);
            Ok::<(), Stalled>(())
        };
        let mut krylov = Krylov::default();
        krylov.restart(&[1.0]);
        let stalled = krylov.solve(&mut [0.0], &mut [1.0], &[1.0], 1e-3, zero);
        assert_eq!(stalled, Err(Stalled::at(1.0)));
    }
}
