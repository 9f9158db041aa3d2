//! Detection of entries of a problem's Jacobian that differ from difference quotients.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::linearization::Linearization;
use crate::pattern::{DIRECTIONS, Probe, ROUNDING, Unexplained, bisect, equal_displacement};
use crate::problem::{Problem, StepError};

/// An entry of a problem's Jacobian that differs from difference quotients of the residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrongEntry {
    /// Index of the equation.
    pub row: usize,
    /// Index of the variable.
    pub column: usize,
    /// Whether the entry belongs to ∂F/∂ẏ; otherwise it belongs to ∂F/∂y.
    pub is_rate_matrix: bool,
    /// The entry provided by the problem.
    pub stated: f64,
    /// The difference quotient.
    pub quotient: f64,
}

impl std::error::Error for WrongEntry {}

impl std::fmt::Display for WrongEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { row, column, .. } = self;
        let matrix = if self.is_rate_matrix { "∂F/∂ẏ" } else { "∂F/∂y" };
        write!(
            f,
            "the Jacobian looks wrong: {matrix} has {:.6e} in row {row}, column {column} (counted from 0), \
             but finite differences of the residual give {:.6e}",
            self.stated, self.quotient
        )
    }
}

/// Minimum relative error of a wrong entry. One-sided quotients at a kink are less accurate.
const WRONG: f64 = 0.02;
const WRONG_AT_KINK: f64 = 0.1;

/// Maximum relative difference between quotients for two displacements.
const AGREEMENT: f64 = 0.01;

/// Maximum factor by which displacements are enlarged for columns with small entries. Over longer displacements, F may
/// be nonlinear.
const ENLARGEMENT: f64 = 1e3;

/// Compares the exact [`jacobian`](Problem::jacobian) of a problem with difference quotients of the residual.
///
/// The change of the residual in four directions d, in y and in ẏ, is compared with J d. The components of y change by
/// their tolerances, by equal displacements, and by displacements in inverse proportion to the largest entry of their
/// column. If the difference in a row exceeds rounding errors and a hundredth of |J| |d|, the entry is found by
/// bisection and confirmed by central differences with two displacements. A wrong entry is not found if its relative
/// error is below 0.02 (0.1 at kinks), if it is much smaller than the other entries of its row and of its column, or if
/// it is wrong only at other states. At a kink, values between the slopes on the two sides are accepted. The check
/// accepts problems without a Jacobian and ignores failed evaluations.
///
/// # Errors
/// Returns the first wrong entry.
pub fn check_jacobian<P: Problem + ?Sized>(
    problem: &mut P,
    at: &Linearization<'_>,
) -> Result<(), WrongEntry> {
    let pattern = problem.jacobian_pattern();
    let mut parts = [vec![0.0; pattern.nnz()], vec![0.0; pattern.nnz()]];
    let [df_dy, df_dyp] = &mut parts;
    if problem.jacobian_parts(at.t, at.y, at.y_dot, [df_dy, df_dyp]).is_err() {
        return Ok(());
    }
    let equal = vec![1.0 / equal_displacement(at.y); at.y.len()];
    let scaled = column_weights(&equal, &pattern, &parts[0]);
    let [at_equal, at_scaled] = [&equal, &scaled].map(|weights| Linearization { weights, ..*at });
    // Derivatives have no tolerance, so they are perturbed by 1 + |ẏ|.
    let weights: Vec<f64> = at.y_dot.iter().map(|v| 1.0 / (1.0 + v.abs())).collect();
    let at_rate = Linearization { step: 1.0, weights: &weights, ..*at };
    for (at, is_rate_matrix) in
        [(at, false), (&at_equal, false), (&at_scaled, false), (&at_rate, true)]
    {
        let values = &parts[usize::from(is_rate_matrix)];
        let matrix = Stated { pattern: &pattern, values };
        if let Ok(Some((row, column, quotient))) = find(problem, matrix, at, is_rate_matrix) {
            return Err(WrongEntry {
                row,
                column,
                is_rate_matrix,
                stated: matrix.entry(row, column),
                quotient,
            });
        }
    }
    Ok(())
}

/// Returns weights divided by the ratio of the largest entry of the matrix to the largest entry of the column, so that
/// all columns have similar effects. For example, the columns of multipliers may contain only small entries.
fn column_weights(weights: &[f64], pattern: &SparsityPattern, values: &[f64]) -> Vec<f64> {
    let mut sizes = vec![0.0_f64; weights.len()];
    for ((column, _), value) in pattern.entries().zip(values) {
        sizes[column] = sizes[column].max(value.abs());
    }
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let ratio = |size: f64| if size > 0.0 { (largest / size).min(ENLARGEMENT) } else { 1.0 };
    weights.iter().zip(sizes).map(|(weight, size)| weight / ratio(size)).collect()
}

/// The matrix provided by the problem.
#[derive(Clone, Copy)]
struct Stated<'a> {
    pattern: &'a SparsityPattern,
    values: &'a [f64],
}

impl Stated<'_> {
    fn entry(&self, row: usize, column: usize) -> f64 {
        let start = self.pattern.major_offsets()[column];
        match self.pattern.lane(column).binary_search(&row) {
            Ok(place) => self.values[start + place],
            Err(_) => 0.0,
        }
    }

    /// Returns the product of a row, restricted to the given columns, and d.
    fn product(&self, row: usize, columns: &[usize], d: &[f64]) -> f64 {
        let terms = columns.iter().map(|&j| self.entry(row, j) * d[j]);
        terms.sum()
    }
}

/// Returns the row and column of a wrong entry, and the corresponding difference quotient.
fn find<P: Problem + ?Sized>(
    problem: &mut P,
    matrix: Stated<'_>,
    at: &Linearization<'_>,
    is_rate_matrix: bool,
) -> Result<Option<(usize, usize, f64)>, StepError> {
    let n = at.y.len();
    let mut probe = Probe::new(problem, *at, is_rate_matrix)?;
    let visible = if is_rate_matrix { 0.0 } else { equal_displacement(at.y) };
    let mut cleared = vec![false; n];
    for trial in 0..DIRECTIONS {
        let Unexplained { direction: d, rows } =
            probe.unexplained_rows(trial, matrix.pattern, matrix.values, &cleared)?;
        for (row, _) in rows {
            let all: Vec<usize> = (0..n).collect();
            let column = bisect(&all, |half| {
                let change = probe.change_along(half.iter().copied(), &d)?;
                Ok((change[row] - matrix.product(row, half, &d)).abs())
            })?;
            if let Some(quotient) = confirmed(&mut probe, (row, column), matrix, &d, visible)? {
                return Ok(Some((row, column, quotient)));
            }
            cleared[row] = true;
        }
    }
    Ok(None)
}

/// Returns the difference quotient of an entry if the quotient is reliable and differs from the stated entry. If F
/// contains large constants, the effect of displacements below `visible` may be lost by rounding.
fn confirmed<P: Problem + ?Sized>(
    probe: &mut Probe<'_, P>,
    (row, column): (usize, usize),
    matrix: Stated<'_>,
    d: &[f64],
    visible: f64,
) -> Result<Option<f64>, StepError> {
    let rounding = ROUNDING * probe.rounding[row];
    let mut one_sided = |factor: f64| -> Result<f64, StepError> {
        let scaled: Vec<f64> = d.iter().map(|d| factor * d).collect();
        Ok(probe.change_along([column], &scaled)?[row] / scaled[column])
    };
    let [ahead, behind] = [one_sided(1.0)?, one_sided(-1.0)?];
    let long = 0.5 * (ahead + behind);
    let [near_ahead, near_behind] = [one_sided(0.25)?, one_sided(-0.25)?];
    let short = 0.5 * (near_ahead + near_behind);
    let stated = matrix.entry(row, column);
    let size = long.abs().max(short.abs());
    let is_smooth = (long - short).abs() <= AGREEMENT * size.max(stated.abs());
    // At a kink, the entry may be the slope on one side or, if the kink is smoothed over a shorter distance, a value
    // between the two slopes. For a smooth function, the two slopes approach each other as the displacement decreases.
    let is_kink = (near_ahead - near_behind).abs() > 0.5 * (ahead - behind).abs();
    let nearest = match is_kink {
        true => stated.clamp(ahead.min(behind), ahead.max(behind)),
        false => long,
    };
    let difference = (nearest - stated).abs();
    let smallest = if is_kink { WRONG_AT_KINK } else { WRONG };
    let is_wrong =
        difference > smallest * size.max(stated.abs()) && difference * d[column].abs() > rounding;
    if !(is_smooth && is_wrong) {
        return Ok(None);
    }
    let factor = visible / d[column].abs();
    if factor > 1.0
        && let (Ok(ahead), Ok(behind)) = (one_sided(factor), one_sided(-factor))
        && (0.5 * (ahead + behind) - stated).abs() <= smallest * stated.abs()
    {
        return Ok(None);
    }
    Ok(Some(long))
}
