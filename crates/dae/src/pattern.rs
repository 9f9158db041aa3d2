//! Detection of entries missing in the pattern of a Jacobian.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::differences::{Perturbation, displacement};
use crate::draw::{draw, rounded};
use crate::jacobian::Jacobian;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError};

/// An entry of the Jacobian that its pattern does not contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingEntry {
    /// Index of the equation.
    pub row: usize,
    /// Index of the variable on which the equation depends.
    pub column: usize,
    /// Whether the entry belongs to ∂F/∂ẏ; otherwise it belongs to ∂F/∂y.
    pub is_rate_matrix: bool,
}

impl std::error::Error for MissingEntry {}

impl std::fmt::Display for MissingEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { row, column, .. } = self;
        let what = if self.is_rate_matrix { "the derivative of " } else { "" };
        write!(
            f,
            "equation {row} depends on {what}y[{column}], but the pattern has no entry in row {row}, column \
             {column} (counted from 0): the pattern must contain the entries of ∂F/∂y and of ∂F/∂ẏ"
        )
    }
}

/// A row is examined if the Jacobian does not explain more than this fraction of its change.
///
/// The errors of difference quotients, relative to the terms |J| |d| of the row, are about √ε = 1.5e-8 for
/// displacements of √ε times a variable, and about the tolerance for displacements by a tolerance. A hundredth is much
/// larger than these errors, and an entry below a hundredth of its row barely slows down Newton's method.
const UNACCOUNTED: f64 = 1e-2;

/// Largest change of the residual that may be caused by rounding, relative to the change caused by rounding of y and ẏ.
pub(crate) const ROUNDING: f64 = 100.0;

/// Number of directions tried. In a single direction, the effect of a missing entry may be attributed to an entry of
/// the same color if the two variables change by similar amounts. The probability of this is about one fifth if the
/// missing entry is a tenth of its row.
pub(crate) const DIRECTIONS: u64 = 4;

/// Number of rows examined for each direction, in order of decreasing error. Several rows are needed, because a row
/// without missing entries may also have a large error if it is strongly nonlinear.
const ROWS: usize = 8;

/// Searches for entries missing in the [pattern](Problem::jacobian_pattern) of a Jacobian.
///
/// If the pattern is incomplete, difference quotients with coloring add the missing entries to other entries. Newton's
/// method then converges slowly or not at all, and steps are short. An integrator does not detect the reason.
///
/// The change of the residual in four directions d, in y and in ẏ, is compared with J d. The components of y change by
/// their tolerances and, in a second test, by equal displacements. If the difference in a row exceeds rounding and a
/// hundredth of |J| |d|, only the variables outside the pattern of the row are perturbed, and bisection finds the
/// variable that changes the row. Therefore, every reported entry is in fact missing, even if the residual is strongly
/// nonlinear. A missing entry is not found if it is smaller than a hundredth of its row at the given state.
///
/// The check costs three Jacobians, 21 evaluations of the residual, one more for each examined row, and 2 log₂ n
/// evaluations to locate an entry. For a full pattern, it costs nothing. Failed evaluations are ignored, because the
/// integrator reports errors of functions.
///
/// # Errors
/// Returns the missing entry.
///
/// # Examples
/// ```
/// use myovib_dae::{Linearization, Problem, SparsityPattern, StepError, check_pattern};
///
/// /// ẏ0 = y1, ẏ1 = −y0, with the pattern of a diagonal.
/// struct Circle;
/// impl Problem for Circle {
///     fn n_unknowns(&self) -> usize {
///         2
///     }
///     fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
///         r.copy_from_slice(&[v[0] - y[1], v[1] + y[0]]);
///         Ok(())
///     }
///     fn jacobian_pattern(&self) -> SparsityPattern {
///         SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 1, 2], vec![0, 1]).unwrap()
///     }
/// }
///
/// let at = Linearization {
///     t: 0.0,
///     y: &[1.0, 0.0],
///     y_dot: &[0.0, -1.0],
///     step: 1e-3,
///     weights: &[1e6; 2],
/// };
/// let missing = check_pattern(&mut Circle, &at).unwrap_err();
/// // One of the two.
/// assert_eq!((missing.row + missing.column, missing.is_rate_matrix), (1, false));
/// ```
pub fn check_pattern<P: Problem + ?Sized>(
    problem: &mut P,
    at: &Linearization<'_>,
) -> Result<(), MissingEntry> {
    let n = problem.n_unknowns();
    let mut jacobian = Jacobian::of(problem).coarse();
    if jacobian.pattern().nnz() == n * n {
        return Ok(());
    }
    // Derivatives have no tolerance, so they are perturbed by √ε, in the trial directions and in difference quotients.
    let weights = [f64::EPSILON.sqrt().recip(), 1.0].map(|weight| vec![weight; n]);
    let [at_rate, quotients] =
        [&weights[0], &weights[1]].map(|weights| Linearization { step: 1.0, weights, ..*at });
    let equal = vec![1.0 / equal_displacement(at.y); n];
    let at_equal = Linearization { weights: &equal, ..*at };
    let trials = [(at, at, false), (&at_equal, &at_equal, false), (&at_rate, &quotients, true)];
    for (at, quotients, is_rate_matrix) in trials {
        let found = find(problem, &mut jacobian, [at, quotients], is_rate_matrix);
        if let Ok(Some((row, column))) = found {
            return Err(MissingEntry { row, column, is_rate_matrix });
        }
    }
    Ok(())
}

/// Returns a common displacement for all variables, √ε times the largest variable. With displacements by the
/// tolerances, the effect of a large variable would hide the effect of a variable with the value 0.
pub(crate) fn equal_displacement(y: &[f64]) -> f64 {
    let largest = y.iter().fold(0.0_f64, |largest, y| largest.max(y.abs()));
    f64::EPSILON.sqrt() * if largest > 0.0 { largest } else { 1.0 }
}

/// Returns the row and column of a missing entry of ∂F/∂y or ∂F/∂ẏ. The state is given twice, with weights for the
/// trial directions and with weights for the difference quotients.
fn find<P: Problem + ?Sized>(
    problem: &mut P,
    jacobian: &mut Jacobian,
    [at, quotients]: [&Linearization<'_>; 2],
    is_rate_matrix: bool,
) -> Result<Option<(usize, usize)>, StepError> {
    let mut values = vec![0.0; jacobian.pattern().nnz()];
    let coefficients = if is_rate_matrix { (0.0, 1.0) } else { (1.0, 0.0) };
    jacobian.combined(problem, quotients, coefficients, &mut values)?;
    let pattern = jacobian.pattern();
    let mut probe = Probe::new(problem, *at, is_rate_matrix)?;
    let mut cleared = vec![false; at.y.len()];
    for trial in 0..DIRECTIONS {
        let Unexplained { direction: d, rows } =
            probe.unexplained_rows(trial, pattern, &values, &cleared)?;
        for (row, bound) in rows {
            if let Some(column) = probe.outside(pattern, row, &d, bound)? {
                return Ok(Some((row, column)));
            }
            cleared[row] = true;
        }
    }
    Ok(None)
}

/// Direction d, and rows whose change along d differs from the product of the matrix and d.
pub(crate) struct Unexplained {
    pub(crate) direction: Vec<f64>,
    /// Rows and the bounds that their errors exceed, with the largest ratio of error to bound first.
    pub(crate) rows: Vec<(usize, f64)>,
}

/// Changes of a residual near a state.
pub(crate) struct Probe<'a, P: ?Sized> {
    problem: &'a mut P,
    at: Linearization<'a>,
    /// Whether ẏ is perturbed instead of y.
    is_rate_matrix: bool,
    base: Vec<f64>,
    /// Change of the residual caused by rounding of y and ẏ.
    pub(crate) rounding: Vec<f64>,
}

impl<'a, P: Problem + ?Sized> Probe<'a, P> {
    pub(crate) fn new(
        problem: &'a mut P,
        at: Linearization<'a>,
        is_rate_matrix: bool,
    ) -> Result<Self, StepError> {
        let mut base = vec![0.0; at.y.len()];
        problem.residual(at.t, at.y, at.y_dot, &mut base)?;
        let mut probe = Self { problem, at, is_rate_matrix, rounding: vec![0.0; base.len()], base };
        for trial in 0..2 {
            let change = probe.change(&rounded(at.y, trial, 0), &rounded(at.y_dot, trial, 1))?;
            for (rounding, change) in probe.rounding.iter_mut().zip(change) {
                *rounding = rounding.max(change.abs());
            }
        }
        Ok(probe)
    }

    /// Returns F(t, y, ẏ) minus its value at the original state, or an error if the result is not finite.
    fn change(&mut self, y: &[f64], y_dot: &[f64]) -> Result<Vec<f64>, StepError> {
        let mut change = vec![0.0; y.len()];
        self.problem.residual(self.at.t, y, y_dot, &mut change)?;
        for (change, base) in change.iter_mut().zip(&self.base) {
            *change -= base;
        }
        match change.iter().all(|change| change.is_finite()) {
            true => Ok(change),
            false => Err(StepError::Recoverable("not finite".to_owned())),
        }
    }

    /// Returns the change of the residual when some variables or their derivatives change by d.
    pub(crate) fn change_along(
        &mut self,
        columns: impl IntoIterator<Item = usize>,
        d: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let (mut y, mut y_dot) = (self.at.y.to_vec(), self.at.y_dot.to_vec());
        let moved = if self.is_rate_matrix { &mut y_dot } else { &mut y };
        for j in columns {
            moved[j] += d[j];
        }
        self.change(&y, &y_dot)
    }

    /// Returns a direction with components of random signs, and the change of F along this direction. If F cannot be
    /// evaluated after this change, a shorter direction that points away from zero is used.
    pub(crate) fn in_a_direction(&mut self, trial: u64) -> Result<(Vec<f64>, Vec<f64>), StepError> {
        let (at, n) = (self.at, self.base.len());
        let usual = |j| displacement(&at, j, Perturbation::Usual);
        let slight = |j| displacement(&at, j, Perturbation::SlightlyAway);
        let random: Vec<f64> = (0..n).map(|j| draw(trial, j) * usual(j)).collect();
        let away: Vec<f64> = (0..n).map(|j| draw(trial, j).abs() * slight(j)).collect();
        match self.change_along(0..n, &random) {
            Err(StepError::Recoverable(_)) => {}
            change => return Ok((random, change?)),
        }
        let change = self.change_along(0..n, &away)?;
        Ok((away, change))
    }

    /// Returns a direction, and the rows whose change along this direction is not explained by the matrix with these
    /// `values`. The rows in `cleared` are excluded.
    pub(crate) fn unexplained_rows(
        &mut self,
        trial: u64,
        pattern: &SparsityPattern,
        values: &[f64],
        cleared: &[bool],
    ) -> Result<Unexplained, StepError> {
        let (d, change) = self.in_a_direction(trial)?;
        let (mut difference, mut scale) = (change.clone(), vec![0.0; d.len()]);
        for ((column, row), value) in pattern.entries().zip(values) {
            difference[row] -= value * d[column];
            scale[row] += (value * d[column]).abs();
        }
        let bound = |i: usize| {
            let of_terms = UNACCOUNTED * change[i].abs().max(scale[i]);
            of_terms.max(ROUNDING * self.rounding[i])
        };
        let ratio = |i: usize| difference[i].abs() / bound(i);
        let mut rows: Vec<usize> =
            (0..d.len()).filter(|&i| !cleared[i] && ratio(i) > 1.0).collect();
        rows.sort_by(|&i, &k| ratio(k).total_cmp(&ratio(i)));
        rows.truncate(ROWS);
        let rows = rows.into_iter().map(|i| (i, bound(i))).collect();
        Ok(Unexplained { direction: d, rows })
    }

    /// Returns a variable that changes the row but is not in its pattern. Returns `None` if all such variables together
    /// change the row by at most `bound`.
    fn outside(
        &mut self,
        pattern: &SparsityPattern,
        row: usize,
        d: &[f64],
        bound: f64,
    ) -> Result<Option<usize>, StepError> {
        let has_none = |&j: &usize| pattern.lane(j).binary_search(&row).is_err();
        let all: Vec<usize> = (0..d.len()).filter(has_none).collect();
        let mut size = |columns: &[usize]| -> Result<f64, StepError> {
            let change = self.change_along(columns.iter().copied(), d)?;
            Ok(change[row].abs())
        };
        if size(&all)? <= bound {
            return Ok(None);
        }
        let column = bisect(&all, &mut size)?;
        let moves_it = size(&[column])? > ROUNDING * self.rounding[row];
        Ok(moves_it.then_some(column))
    }
}

/// Finds a column with a large `size` by bisection: repeatedly chooses the half with the larger size.
pub(crate) fn bisect(
    mut columns: &[usize],
    mut size: impl FnMut(&[usize]) -> Result<f64, StepError>,
) -> Result<usize, StepError> {
    while columns.len() > 1 {
        let halves: [&[usize]; 2] = columns.split_at(columns.len() / 2).into();
        let sizes = [size(halves[0])?, size(halves[1])?];
        columns = halves[usize::from(sizes[1] > sizes[0])];
    }
    Ok(columns[0])
}
