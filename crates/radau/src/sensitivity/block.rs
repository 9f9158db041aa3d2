//! Generalized conjugate residuals for several right-hand sides at once.

use pulp::{Arch, Simd};
use pulp_macro::with_simd;

use super::krylov::Stalled;

/// Solves K x = r for several columns by generalized conjugate residuals (Eisenstat, Elman, Schultz
/// 1983) with separate search directions for each column.
///
/// K is close to the identity, because it is preconditioned by the factors of a frozen Jacobian. Therefore, few or no
/// search directions are needed. Each application of K processes all columns at once.
#[derive(Debug, Default)]
pub(super) struct Block {
    /// p, −K p, and |K p|⁻² of each column.
    directions: Vec<Direction>,
    /// ‖r − K r‖/‖r‖ in the last solve that measured it; `None` means 1.
    contraction: Option<f64>,
}

#[derive(Debug, Default)]
struct Direction {
    p: Vec<f64>,
    /// −K p.
    q: Vec<f64>,
    /// 1/|q|² of each column; 0 for a converged column.
    inverse: Vec<f64>,
}

/// Maximum number of directions per solve.
const MAX_DIRECTIONS: usize = 60;

/// Lower bound for the contraction assumed in the next solve if Newton's method needed only one correction, because the
/// contraction may have changed.
const LEAST_TRUST: f64 = 0.1;

impl Block {
    /// Adds the solutions of K d = `r` to `x` with an error norm of about `tolerance` in each column. `apply` writes −K
    /// v to its second argument.
    ///
    /// At the end, the remaining residual r is added to the solution. The new residual, r − K r, is smaller than r by a
    /// factor, the contraction. The first solve measures the contraction. Later solves assume a slightly larger value,
    /// as Newton's method does between steps, but at least the contraction that Newton's method measured in this step
    /// with the same factors.
    ///
    /// # Shapes
    /// `x`, `r`: one or more stages. Each stage has as many values as `weights`, stored row by row with `n_columns`
    /// values per row.
    pub(super) fn solve<E: From<Stalled>>(
        &mut self,
        x: &mut [f64],
        r: &mut [f64],
        (weights, n_columns): (&[f64], usize),
        [tolerance, of_newton]: [f64; 2],
        mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let columns = Columns { weights, n_columns };
        let least = if of_newton > 0.0 { of_newton } else { LEAST_TRUST };
        let trusted = self.contraction.map(|c| c.powf(0.8).max(least));
        let mut contraction = trusted.unwrap_or(1.0);
        let mut measured: Option<f64> = None;
        let mut sizes = columns.norms(r);
        let mut used = 0;
        loop {
            let (column, worst) = largest(&sizes);
            if contraction * worst <= tolerance {
                x.iter_mut().zip(&*r).for_each(|(x, r)| *x += r);
                self.contraction = measured.or(trusted);
                return Ok(());
            }
            if used == MAX_DIRECTIONS || !worst.is_finite() {
                return Err(Stalled { norm: worst, column }.into());
            }
            if used == self.directions.len() {
                self.directions.push(Direction::default());
            }
            let (known, rest) = self.directions.split_at_mut(used);
            let Direction { p, q, inverse } = &mut rest[0];
            q.resize(r.len(), 0.0);
            apply(r, q)?;
            let mut sums = columns.sums(r, q);
            let unsolved = sums.iter().zip(&sizes).filter(|(_, size)| **size > tolerance);
            let ratio = unsolved.map(|([left, ..], size)| left.sqrt() / size);
            let ratio = ratio.fold(0.0, f64::max);
            measured = Some(measured.map_or(ratio, |largest| largest.max(ratio)));
            contraction = measured.unwrap_or(1.0).min(1.0);
            p.clear();
            p.extend_from_slice(r);
            for other in known.iter() {
                let shares = columns.products(q, &other.q);
                let shares = shares.iter().zip(&other.inverse).map(|(s, i)| -s * i);
                let shares: Vec<f64> = shares.collect();
                columns.add_scaled(p, &shares, &other.p);
                columns.add_scaled(q, &shares, &other.q);
            }
            if !known.is_empty() {
                sums = columns.sums(r, q);
            }
            let lost =
                |([_, square, _], size): (&[f64; 3], &f64)| *square == 0.0 && *size > tolerance;
            if let Some(column) = sums.iter().zip(&sizes).position(lost) {
                let norm = sizes[column];
                return Err(Stalled { norm, column }.into());
            }
            let invert = |s: f64| if s > 0.0 { 1.0 / s } else { 0.0 };
            inverse.clear();
            inverse.extend(sums.iter().map(|[_, square, _]| invert(*square)));
            let shares = sums.iter().zip(&*inverse).map(|([.., s], i)| -s * i);
            let shares: Vec<f64> = shares.collect();
            sizes = columns.step([x, r], [p, q], &shares);
            used += 1;
        }
    }
}

/// Returns the index and value of the maximum; a NaN counts as the largest.
fn largest(sizes: &[f64]) -> (usize, f64) {
    let sizes = sizes.iter().copied().enumerate();
    sizes.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// Weighted sums over the columns of the stages.
struct Columns<'w> {
    weights: &'w [f64],
    n_columns: usize,
}

/// Number of rows processed together, so that vector instructions can be used for any number of columns.
pub(super) const ROWS: usize = 8;

impl Columns<'_> {
    /// Returns the norm of each column.
    fn norms(&self, a: &[f64]) -> Vec<f64> {
        let squares = self.products(a, a);
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// Returns the mean of w² a b over each column.
    fn products(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let sums = self.sums(a, b);
        sums.into_iter().map(|[.., product]| product).collect()
    }

    /// Returns the means of w² (a + b)², w² b² and w² a b over each column.
    fn sums(&self, a: &[f64], b: &[f64]) -> Vec<[f64; 3]> {
        let zeros = vec![0.0; ROWS * self.n_columns];
        let mut lanes = [zeros.clone(), zeros.clone(), zeros];
        add_squares(&mut lanes, self.weights, a, b);
        let of = |j: usize| {
            let column = (j, self.n_columns);
            lanes.each_ref().map(|lanes| mean_of_column(lanes, column, a.len()))
        };
        (0..self.n_columns).map(of).collect()
    }

    /// Computes y ← y + share · x with a separate share for each column.
    fn add_scaled(&self, y: &mut [f64], shares: &[f64], x: &[f64]) {
        let shares = &shares.repeat(ROWS);
        add_scaled(y, shares, x);
    }

    /// Computes x ← x + share · p and r ← r + share · q with a separate share for each column. Returns the norms of r.
    fn step(&self, [x, r]: [&mut [f64]; 2], [p, q]: [&[f64]; 2], shares: &[f64]) -> Vec<f64> {
        let mut lanes = vec![0.0; ROWS * self.n_columns];
        let length = r.len();
        step(&mut lanes, self.weights, &shares.repeat(ROWS), [x, r], [p, q]);
        let columns = (0..self.n_columns).map(|j| (j, self.n_columns));
        let squares = columns.map(|column| mean_of_column(&lanes, column, length));
        squares.map(f64::sqrt).collect()
    }
}

/// Returns the mean of one column from partial sums in SIMD lanes over `length` values of several columns.
pub(super) fn mean_of_column(lanes: &[f64], (j, n_columns): (usize, usize), length: usize) -> f64 {
    let sum: f64 = lanes.iter().skip(j).step_by(n_columns).sum();
    sum / (length / n_columns) as f64
}

/// Accumulates w² (a + b)², w² b² and w² a b in SIMD lanes.
#[with_simd(add_squares = Arch::new())]
#[inline(always)]
fn add_squares_with<S: Simd>(
    _: S,
    lanes: &mut [Vec<f64>; 3],
    weights: &[f64],
    a: &[f64],
    b: &[f64],
) {
    let (length, width) = (weights.len(), lanes[0].len());
    let [of_sums, squares, products] = lanes;
    for (a, b) in a.chunks_exact(length).zip(b.chunks_exact(length)) {
        let parts = a.chunks(width).zip(b.chunks(width));
        for ((a, b), w) in parts.zip(weights.chunks(width)) {
            let n = a.len();
            let (b, w) = (&b[..n], &w[..n]);
            let of_sums = &mut of_sums[..n];
            let (squares, products) = (&mut squares[..n], &mut products[..n]);
            for k in 0..n {
                let (a, b) = (a[k] * w[k], b[k] * w[k]);
                of_sums[k] += (a + b) * (a + b);
                squares[k] += b * b;
                products[k] += a * b;
            }
        }
    }
}

/// Computes y ← y + share · x. The `shares` are repeated periodically.
#[with_simd(add_scaled = Arch::new())]
#[inline(always)]
fn add_scaled_with<S: Simd>(_: S, y: &mut [f64], shares: &[f64], x: &[f64]) {
    let width = shares.len();
    for (y, x) in y.chunks_mut(width).zip(x.chunks(width)) {
        let n = y.len();
        let (x, shares) = (&x[..n], &shares[..n]);
        for k in 0..n {
            y[k] += shares[k] * x[k];
        }
    }
}

/// Computes x ← x + share · p and r ← r + share · q, where the shares are repeated periodically. Sums w² r² in SIMD
/// lanes.
#[with_simd(step = Arch::new())]
#[inline(always)]
fn step_with<S: Simd>(
    _: S,
    lanes: &mut [f64],
    weights: &[f64],
    shares: &[f64],
    [x, r]: [&mut [f64]; 2],
    [p, q]: [&[f64]; 2],
) {
    let (length, width) = (weights.len(), lanes.len());
    let mut start = 0;
    while start < x.len() {
        // Each stage starts at the beginning of a row.
        let within = start % length;
        let n = width.min(length - within);
        let (x, r) = (&mut x[start..][..n], &mut r[start..][..n]);
        let (p, q) = (&p[start..][..n], &q[start..][..n]);
        let (w, shares) = (&weights[within..][..n], &shares[..n]);
        let lanes = &mut lanes[..n];
        for k in 0..n {
            x[k] += shares[k] * p[k];
            r[k] += shares[k] * q[k];
            lanes[k] += (r[k] * w[k]) * (r[k] * w[k]);
        }
        start += n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes v ← −K v with K = I + 0.3 × (cyclic shift of rows), a normal matrix whose eigenvalues are on a circle
    /// around 1. For the last of three columns, K is the identity.
    fn apply(v: &[f64], out: &mut [f64]) -> Result<(), Stalled> {
        for (k, out) in out.iter_mut().enumerate() {
            let shifted = if k % 3 == 2 { 0.0 } else { v[(k + 3) % v.len()] };
            *out = -(v[k] + 0.3 * shifted);
        }
        Ok(())
    }

    #[test]
    fn columns_are_solved_together_and_a_second_solve_trusts_the_first() {
        let n = 40;
        let weights = vec![1.0; 3 * n / 2];
        let mut block = Block::default();
        let b: Vec<f64> = (0..3 * n).map(|k| (k as f64).sin()).collect();
        for (tolerance, applications) in [(1e-10, 15..25), (0.5, 0..1)] {
            let (mut x, mut r) = (vec![0.0; 3 * n], b.clone());
            let mut count = 0;
            let counted = |v: &[f64], out: &mut [f64]| {
                count += 1;
                apply(v, out)
            };
            block.solve(&mut x, &mut r, (&weights, 3), [tolerance, 0.0], counted).unwrap();
            assert!(applications.contains(&count), "{count}");
            let mut image = vec![0.0; 3 * n];
            apply(&x, &mut image).unwrap();
            let left = image.iter().zip(&b).map(|(q, b)| (q + b).abs());
            // The largest error is at most √n times the mean.
            let left = left.fold(0.0, f64::max);
            assert!(left < 7.0 * tolerance, "{left:e}");
        }
    }

    #[test]
    fn a_zero_operator_stops_the_iteration() {
        let zero = |_: &[f64], out: &mut [f64]| {
            out.fill(0.0);
            Ok::<(), Stalled>(())
        };
        let (weights, mut r) = ([1.0], [1.0]);
        let solved = Block::default().solve(&mut [0.0], &mut r, (&weights, 1), [1e-3, 0.0], zero);
        assert_eq!(solved, Err(Stalled { norm: 1.0, column: 0 }));
    }
}
