//! Consistent values of systems of index 2 and 3, computed from the constraints stated by the problem.

use nalgebra::{DMatrix, DVector};

use crate::draw::rounded;
use crate::inconsistent::{Inconsistent, norm};
use crate::problem::{Problem, StepError, VariableKind};
use crate::tolerances::UNTESTED;

/// Maximum number of iterations of each of the two searches.
const ITERATIONS: usize = 30;
/// Relative displacement of central differences: the cube root of the unit roundoff.
const DIFFERENCE: f64 = 6e-6;
/// A constraint is redundant if a singular value is below this fraction of the largest one. The rows and columns of the
/// matrix are [scaled](Scaling).
const RANK: f64 = 1e-9;
/// A matrix has full column rank if all pivots are above this fraction of the largest one. The limit is larger than
/// [`RANK`], because pivots and singular values differ.
const FULL_RANK: f64 = 1e-6;
/// Accepted residual of an equation, relative to its terms. Difference quotients have errors of about 1e-10.
const RESIDUAL_TOLERANCE: f64 = 1e-6;
/// Accepted residual, relative to the change caused by rounding of y and ẏ.
const ROUNDING: f64 = 100.0;

/// Moves y onto the constraints stated by the problem ([`Problem::constraints`]). The change is the smallest in the
/// norm with the weights `distance`, usually [`Tolerances::distance`](crate::Tolerances::distance). Then corrects ẏ of
/// the differential variables and y of the algebraic variables so that F(t, y, ẏ) = 0 and the constraints remain
/// satisfied, d/dt c(t, y) = 0.
///
/// The two computations use the Gauss–Newton method with full matrices of difference quotients, which cost about n
/// evaluations of F per iteration. They are intended for mechanisms and networks, not for bodies with many thousands of
/// unknowns. For index 2 and 3, F alone does not determine the multipliers, but F and d/dt c = 0 together do.
///
/// # Shapes
/// `kinds`, `y`, `y_dot`, `weights`, `distance`: the number of unknowns.
///
/// # Errors
/// Returns [`Inconsistent::NoConstraints`] if the problem does not state constraints, [`Inconsistent::NotFound`] if the
/// search does not converge, [`Inconsistent::Contradicted`] if the constraints are incompatible with F, and errors of
/// the problem. The input values of y and ẏ are then unchanged.
pub fn project_onto_constraints<P: Problem>(
    problem: &mut P,
    kinds: &[VariableKind],
    (t, t_first): (f64, f64),
    y: &mut [f64],
    y_dot: &mut [f64],
    weights: &[f64],
    distance: &[f64],
) -> Result<(), Inconsistent> {
    if problem.n_constraints() == 0 {
        return Err(Inconsistent::NoConstraints);
    }
    let mut state =
        State { kinds, t, span: (t_first - t).abs(), y: y.to_vec(), y_dot: y_dot.to_vec() };
    state.move_onto_constraints(problem, weights, distance)?;
    state.follow(problem, weights)?;
    y.copy_from_slice(&state.y);
    y_dot.copy_from_slice(&state.y_dot);
    Ok(())
}

struct State<'a> {
    kinds: &'a [VariableKind],
    t: f64,
    /// Time from the start to the first output.
    span: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl State<'_> {
    /// Applies Newton's method to c(t, y) = 0; each step is the shortest in the norm of `distance`.
    fn move_onto_constraints<P: Problem>(
        &mut self,
        problem: &mut P,
        weights: &[f64],
        distance: &[f64],
    ) -> Result<(), Inconsistent> {
        let (n, m) = (self.y.len(), problem.n_constraints());
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let mut c = DVector::zeros(m);
            problem.constraints(self.t, &self.y, c.as_mut_slice())?;
            let mut matrix = DMatrix::zeros(m, n);
            let largest = largest(&self.y);
            for (j, weight) in distance.iter().enumerate() {
                let step = DIFFERENCE * scale(self.y[j], largest);
                let t = self.t;
                let of = |y: &[f64], out: &mut [f64]| problem.constraints(t, y, out);
                let mut column = central(of, &mut self.y, j, step, m)?;
                column /= *weight;
                matrix.set_column(j, &column);
            }
            // Rows may have different units and may therefore differ by many orders of magnitude. They are scaled, so
            // that the numerical rank does not depend on units.
            for (mut row, c) in matrix.row_iter_mut().zip(c.iter_mut()) {
                let size = row.norm();
                if size > 0.0 {
                    row /= size;
                    *c /= size;
                }
            }
            let step = least_squares(matrix, &c)?;
            let moved: Vec<f64> = step.iter().zip(distance).map(|(s, w)| s / w).collect();
            self.y.iter_mut().zip(&moved).for_each(|(y, s)| *y -= s);
            let size = norm(&moved, weights);
            if !size.is_finite() {
                return Err(Inconsistent::NotFound { norm: size });
            }
            // Newton's method converges quadratically until the correction consists of rounding errors.
            if size == 0.0 || (size < 1.0 && size > 0.1 * last) {
                return Ok(());
            }
            last = size;
        }
        Err(Inconsistent::NotFound { norm: last })
    }

    /// Computes ẏ of the differential variables and y of the algebraic variables from F = 0 and d/dt c = 0.
    fn follow<P: Problem>(&mut self, problem: &mut P, weights: &[f64]) -> Result<(), Inconsistent> {
        let (n, rows) = (self.y.len(), self.y.len() + problem.n_constraints());
        let mut last = f64::INFINITY;
        for iteration in 1..=ITERATIONS {
            let residual = self.equations(problem)?;
            let mut matrix = DMatrix::zeros(rows, n);
            for j in 0..n {
                let step = self.difference(j);
                let value = *self.sought(j);
                *self.sought(j) = value + step;
                let ahead = self.equations(problem)?;
                *self.sought(j) = value - step;
                let behind = self.equations(problem)?;
                *self.sought(j) = value;
                matrix.set_column(j, &((ahead - behind) / (2.0 * step)));
            }
            let step = Scaling::of(&matrix, weights).least_squares(&matrix, &residual)?;
            for j in 0..n {
                *self.sought(j) -= step[j];
            }
            let sizes = [largest(&self.y), largest(&self.y_dot)];
            let relative = (0..n).map(|j| match step[j].abs() {
                0.0 => 0.0,
                moved => moved / moved.max(sizes[usize::from(self.is_rate(j))]),
            });
            let size = relative.fold(0.0, f64::max);
            if !step.iter().all(|step| step.is_finite()) {
                return Err(Inconsistent::NotFound { norm: f64::NAN });
            }
            if size == 0.0 || (size < 1e-6 && size > 0.1 * last) || iteration == ITERATIONS {
                return self.expect_solved(problem, &matrix, weights);
            }
            last = size;
        }
        Ok(())
    }

    /// Checks that the residual of each equation is small relative to the terms of the equation, in scaled units.
    fn expect_solved<P: Problem>(
        &mut self,
        problem: &mut P,
        matrix: &DMatrix<f64>,
        weights: &[f64],
    ) -> Result<(), Inconsistent> {
        let residual = self.equations(problem)?;
        let rows = Scaling::of(matrix, weights).rows;
        let terms = |i: usize| -> f64 {
            let row = (0..matrix.ncols()).map(|j| (matrix[(i, j)], self.is_rate(j), j));
            row.map(|(a, rate, j)| (a * if rate { self.y_dot[j] } else { self.y[j] }).abs()).sum()
        };
        let sizes: Vec<f64> = (0..residual.len()).map(|i| rows[i] * terms(i)).collect();
        let most = sizes.iter().copied().fold(0.0, f64::max);
        let rounding = self.rounding(problem, &residual)?;
        let wrong = |i: &usize| {
            let of_terms = RESIDUAL_TOLERANCE * (sizes[*i] + 1e-3 * most);
            rows[*i] * residual[*i].abs() > of_terms + ROUNDING * rows[*i] * rounding[*i]
        };
        match (0..residual.len()).find(wrong) {
            None => Ok(()),
            Some(equation) => {
                Err(Inconsistent::Contradicted { equation, residual: residual[equation] })
            }
        }
    }

    /// Returns the increment of the unknown ẏ_j or y_j for difference quotients.
    fn difference(&mut self, j: usize) -> f64 {
        let largest = largest(if self.is_rate(j) { &self.y_dot } else { &self.y });
        DIFFERENCE * scale(*self.sought(j), largest)
    }

    /// Returns the largest change of each equation when the last digits of y and ẏ change.
    fn rounding<P: Problem>(
        &self,
        problem: &mut P,
        equations: &DVector<f64>,
    ) -> Result<DVector<f64>, StepError> {
        let mut largest = DVector::zeros(equations.len());
        for trial in 0..2 {
            let (y, y_dot) = (rounded(&self.y, trial, 0), rounded(&self.y_dot, trial, 1));
            let state = State { y, y_dot, ..*self };
            let change = (state.equations(problem)? - equations).abs();
            largest = largest.sup(&change);
        }
        Ok(largest)
    }

    fn is_rate(&self, j: usize) -> bool {
        self.kinds[j] == VariableKind::Differential
    }

    /// Returns unknown j: ẏ_j for a differential variable, or y_j for an algebraic variable.
    fn sought(&mut self, j: usize) -> &mut f64 {
        match self.is_rate(j) {
            true => &mut self.y_dot[j],
            false => &mut self.y[j],
        }
    }

    /// Evaluates F(t, y, ẏ), followed by d/dt c(t, y) along ẏ.
    fn equations<P: Problem>(&self, problem: &mut P) -> Result<DVector<f64>, StepError> {
        let (n, m) = (self.y.len(), problem.n_constraints());
        let mut all = DVector::zeros(n + m);
        let (f, rates) = all.as_mut_slice().split_at_mut(n);
        problem.residual(self.t, &self.y, &self.y_dot, f)?;
        let motion = largest(&self.y_dot);
        let span = match motion > 0.0 {
            true => self.span.min((largest(&self.y) / motion).max(f64::MIN_POSITIVE)),
            false => self.span,
        };
        let dt = DIFFERENCE * if span > 0.0 { span } else { 1.0 };
        let mut at = |dt: f64, out: &mut [f64]| {
            let moved = (0..n).map(|j| match self.is_rate(j) {
                true => self.y[j] + dt * self.y_dot[j],
                false => self.y[j],
            });
            problem.constraints(self.t + dt, &moved.collect::<Vec<_>>(), out)
        };
        let mut behind = vec![0.0; m];
        at(dt, rates)?;
        at(-dt, &mut behind)?;
        for (rate, behind) in rates.iter_mut().zip(behind) {
            *rate = (*rate - behind) / (2.0 * dt);
        }
        Ok(all)
    }
}

/// Computes the derivative of a function of y with m values with respect to y_j.
fn central(
    mut function: impl FnMut(&[f64], &mut [f64]) -> Result<(), StepError>,
    y: &mut [f64],
    j: usize,
    step: f64,
    m: usize,
) -> Result<DVector<f64>, StepError> {
    let (mut ahead, mut behind) = (DVector::zeros(m), DVector::zeros(m));
    let value = y[j];
    y[j] = value + step;
    let first = function(y, ahead.as_mut_slice());
    y[j] = value - step;
    let second = function(y, behind.as_mut_slice());
    y[j] = value;
    first.and(second)?;
    Ok((ahead - behind) / (2.0 * step))
}

/// Scaling factors for the rows and columns of a matrix. Columns are scaled by the tolerances, and rows are then
/// normalized, so that results do not depend on the units of equations and variables. Columns of [untested](UNTESTED)
/// variables remain unscaled, because the tolerances of these variables do not indicate a unit.
struct Scaling {
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Scaling {
    fn of(matrix: &DMatrix<f64>, weights: &[f64]) -> Self {
        let mut columns: Vec<f64> = weights.iter().map(|w| 1.0 / w).collect();
        if columns.iter().any(|c| *c >= UNTESTED) {
            columns.fill(1.0);
        }
        let row = |i: usize| {
            let entries = (0..columns.len()).map(|j| matrix[(i, j)] * columns[j]);
            match entries.fold(0.0, f64::hypot) {
                0.0 => 1.0,
                length => 1.0 / length,
            }
        };
        let rows = (0..matrix.nrows()).map(row).collect();
        Self { rows, columns }
    }

    /// Returns the minimizer x of ‖R (A x − b)‖ for which ‖C⁻¹ x‖ is smallest.
    fn least_squares(
        &self,
        a: &DMatrix<f64>,
        b: &DVector<f64>,
    ) -> Result<DVector<f64>, Inconsistent> {
        let Self { rows, columns } = self;
        let entry = |i: usize, j: usize| rows[i] * a[(i, j)] * columns[j];
        let b = DVector::from_fn(b.len(), |i, _| rows[i] * b[i]);
        let x = least_squares(DMatrix::from_fn(a.nrows(), a.ncols(), entry), &b)?;
        Ok(DVector::from_fn(x.len(), |j, _| columns[j] * x[j]))
    }
}

/// Computes the vector x of minimum norm that minimizes ‖A x − b‖. If A clearly has full column rank, a QR factorization
/// is used instead of a singular value decomposition, which costs many times as much.
fn least_squares(a: DMatrix<f64>, b: &DVector<f64>) -> Result<DVector<f64>, Inconsistent> {
    if !a.iter().chain(b.iter()).all(|x| x.is_finite()) {
        return Err(Inconsistent::NotFound { norm: f64::NAN });
    }
    let n = a.ncols();
    if a.nrows() >= n {
        let qr = a.clone().col_piv_qr();
        let r = qr.r();
        let pivots = r.diagonal().abs();
        if pivots.min() > FULL_RANK * pivots.max() {
            let mut x = b.clone();
            qr.q_tr_mul(&mut x);
            let mut x = x.rows(0, n).into_owned();
            let is_solved = r.solve_upper_triangular_mut(&mut x);
            qr.p().inv_permute_rows(&mut x);
            return is_solved.then_some(x).ok_or(Inconsistent::NotFound { norm: f64::NAN });
        }
    }
    let svd = a.svd(true, true);
    let least = RANK * svd.singular_values.max();
    svd.solve(b, least).map_err(|_| Inconsistent::NotFound { norm: f64::NAN })
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Returns max(|x|, `largest`/1000), or 1 if both are zero.
fn scale(x: f64, largest: f64) -> f64 {
    match x.abs().max(1e-3 * largest) {
        0.0 => 1.0,
        size => size,
    }
}

#[cfg(test)]
mod tests;
