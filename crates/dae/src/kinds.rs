//! Detection of differential variables, that is, variables whose derivatives occur in F.

use crate::coloring::color;
use crate::draw::draw;
use crate::problem::{Problem, StepError, VariableKind};

/// Number of random perturbations in each test. For a single perturbation, terms may cancel, or an even function may
/// have the same value as before.
const TRIALS: u64 = 2;

/// Ratio of successive sizes of perturbations. A term c ẏ_j is lost by rounding if the other terms of the equation are
/// 1/ε times as large. The next size detects a term that is at least 1e-14 times as large as the other terms.
const GROWTH: f64 = 1e14;

/// Factor by which perturbations are reduced if they leave the domain of F, √ε.
const SHORT: f64 = 1.5e-8;

/// Largest perturbation, relative to 1 + |ẏ|.
const LARGEST: f64 = 1e300;

/// Variables whose derivatives occur in F at a state, and equations in which derivatives occur.
///
/// The same rule determines differential variables ([`kinds_at`]) and equations that contain a derivative
/// ([`check_start`](crate::check_start)). If the problem has a [`jacobian`](Problem::jacobian), the rule looks for
/// nonzero entries of ∂F/∂ẏ, at ẏ and at other derivatives. Otherwise, it looks for any change of F when ẏ_j is
/// perturbed by about 1 + |ẏ_j|. As long as F does not change, the perturbation is increased, up to 1e300 (1 + |ẏ_j|).
/// Therefore, a coefficient is detected in any unit, and is treated as zero only if it is exactly zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RateDependence {
    pub(crate) variables: Vec<bool>,
    pub(crate) equations: Vec<bool>,
}

impl RateDependence {
    /// Applies the rule at (t, y, ẏ).
    ///
    /// # Errors
    /// Returns errors of the problem at the state itself. Failed evaluations at other states are ignored.
    pub(crate) fn at<P: Problem + ?Sized>(
        problem: &mut P,
        (t, y, y_dot): (f64, &[f64], &[f64]),
    ) -> Result<Self, StepError> {
        let n = y.len();
        let found = Self { variables: vec![false; n], equations: vec![false; n] };
        let mut search = Search { problem, t, y, y_dot, found };
        match search.by_jacobian() {
            Err(StepError::NoJacobian) => search.by_differences()?,
            evaluated => evaluated?,
        }
        Ok(search.found)
    }
}

struct Search<'a, P: ?Sized> {
    problem: &'a mut P,
    t: f64,
    y: &'a [f64],
    y_dot: &'a [f64],
    found: RateDependence,
}

impl<P: Problem + ?Sized> Search<'_, P> {
    /// Marks the variables and equations of nonzero entries of ∂F/∂ẏ. The matrix is also evaluated at other
    /// derivatives, because the derivative of ẏ_j² is zero at ẏ_j = 0.
    fn by_jacobian(&mut self) -> Result<(), StepError> {
        let pattern = self.problem.jacobian_pattern();
        let mut values = vec![0.0; pattern.nnz()];
        let given = self.y_dot.to_vec();
        for trial in 0..=TRIALS {
            let y_dot = match trial {
                0 => given.clone(),
                _ => (0..given.len()).map(|j| self.moved(trial, j, 1.0)).collect(),
            };
            let evaluated = self.problem.jacobian(self.t, self.y, &y_dot, 0.0, 1.0, &mut values);
            match evaluated {
                Err(_) if trial > 0 => continue,
                evaluated => evaluated?,
            }
            for ((column, row), value) in pattern.entries().zip(&values) {
                // Non-finite entries at the state are reported when the integration first evaluates the Jacobian.
                if *value != 0.0 && (trial == 0 || value.is_finite()) {
                    self.found.variables[column] = true;
                    self.found.equations[row] = true;
                }
            }
        }
        Ok(())
    }

    /// Perturbs derivatives until F changes. First perturbs the derivatives in groups of columns without common rows,
    /// by 1 + |ẏ_j|. Then perturbs all remaining derivatives together and, if F changes, each group separately.
    fn by_differences(&mut self) -> Result<(), StepError> {
        let n = self.y.len();
        let mut base = vec![0.0; n];
        self.problem.residual(self.t, self.y, self.y_dot, &mut base)?;
        let pattern = self.problem.jacobian_pattern();
        let groups = color(&pattern);
        let mut size = 1.0;
        while size <= LARGEST {
            for trial in 0..TRIALS {
                let unaffected: Vec<usize> = (0..n).filter(|&j| !self.found.variables[j]).collect();
                let is_first = size == 1.0 && trial == 0;
                if unaffected.is_empty()
                    || (!is_first && self.changed(&unaffected, (trial, size), &base).is_empty())
                {
                    continue;
                }
                for group in &groups {
                    let mut group = group.clone();
                    group.retain(|&j| !self.found.variables[j]);
                    let rows = match group.is_empty() {
                        true => continue,
                        false => self.changed(&group, (trial, size), &base),
                    };
                    for &j in &group {
                        let lane = pattern.lane(j);
                        self.found.variables[j] |=
                            lane.iter().any(|row| rows.binary_search(row).is_ok());
                    }
                    rows.iter().for_each(|&row| self.found.equations[row] = true);
                }
            }
            size *= GROWTH;
        }
        Ok(())
    }

    /// Returns the equations that change when the derivatives of these variables are perturbed. If F cannot be
    /// evaluated after the perturbation, the opposite sign or a smaller size is used. A value that becomes non-finite
    /// counts as changed, because it would remain finite if the coefficient were zero.
    fn changed(
        &mut self,
        columns: &[usize],
        (trial, size): (u64, f64),
        base: &[f64],
    ) -> Vec<usize> {
        let mut y_dot = self.y_dot.to_vec();
        let mut residual = vec![0.0; base.len()];
        for factor in [1.0, -1.0, SHORT, -SHORT] {
            for &j in columns {
                y_dot[j] = self.moved(trial, j, factor * size);
            }
            let evaluated = self.problem.residual(self.t, self.y, &y_dot, &mut residual);
            if evaluated.is_ok() {
                let pairs = residual.iter().zip(base).enumerate();
                let changed = pairs.filter(|(_, (new, base))| new != base && base.is_finite());
                return changed.map(|(row, _)| row).collect();
            }
        }
        Vec::new()
    }

    /// Returns ẏ_j perturbed by about `size` (1 + |ẏ_j|).
    fn moved(&self, trial: u64, j: usize, size: f64) -> f64 {
        let v = self.y_dot[j];
        v + (size * (1.0 + v.abs()) * draw(trial, j)).clamp(-f64::MAX, f64::MAX)
    }
}

/// Returns the kind of each variable as stated by the problem ([`Problem::kinds`]). If the problem does not state
/// kinds, a variable is differential if ∂F/∂ẏ_j is not zero at (t, y, ẏ), and algebraic otherwise.
///
/// Coefficients of any size are detected, in any unit. If the problem implements the [`jacobian`](Problem::jacobian),
/// its entries are examined. Otherwise, ẏ_j is perturbed by 1 + |ẏ_j| and, as long as F does not change, by larger
/// amounts.
///
/// If the coefficient of a derivative is zero at the start but not later, the derivative is not detected. Such a
/// problem must state its [`kinds`](Problem::kinds).
///
/// # Errors
/// Returns errors of the problem.
pub fn kinds_at<P: Problem + ?Sized>(
    problem: &mut P,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Vec<VariableKind>, StepError> {
    if let Some(kinds) = problem.kinds() {
        return Ok(kinds);
    }
    let found = RateDependence::at(problem, (t, y, y_dot))?;
    let kind = |is_differential| match is_differential {
        true => VariableKind::Differential,
        false => VariableKind::Algebraic,
    };
    Ok(found.variables.into_iter().map(kind).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use VariableKind::{Algebraic, Differential};

    /// C u̇ + u/R − I = 0 and w − u² = 0.
    struct Node {
        c: f64,
        has_jacobian: bool,
    }

    impl Problem for Node {
        fn n_unknowns(&self) -> usize {
            2
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = self.c * v[0] + y[0] / 1e3 - 5e-3;
            r[1] = y[1] - y[0] * y[0];
            Ok(())
        }

        fn jacobian(
            &mut self,
            _: f64,
            y: &[f64],
            _: &[f64],
            a: f64,
            b: f64,
            values: &mut [f64],
        ) -> Result<(), StepError> {
            if !self.has_jacobian {
                return Err(StepError::NoJacobian);
            }
            values.copy_from_slice(&[b * self.c + a / 1e3, -2.0 * a * y[0], 0.0, a]);
            Ok(())
        }
    }

    /// Regression test: a variable with a coefficient below 1e-10 was classified as algebraic and excluded from the
    /// error test.
    #[test]
    fn a_coefficient_of_any_size_makes_a_variable_differential() {
        for exponent in (-300..=300).step_by(10).chain([-11, -12, -13]) {
            for has_jacobian in [false, true] {
                for u in [0.0, 5.0, 1e6] {
                    let c = 10_f64.powi(exponent);
                    let mut node = Node { c, has_jacobian };
                    let kinds = kinds_at(&mut node, 0.0, &[u, u * u], &[0.0, 0.0]).unwrap();
                    assert_eq!(kinds, [Differential, Algebraic], "{c:e} {has_jacobian} {u}");
                    let at = (0.0, &[u, u * u][..], &[0.0; 2][..]);
                    let found = RateDependence::at(&mut node, at).unwrap();
                    assert_eq!(found.equations, [true, false], "{c:e} {has_jacobian} {u}");
                }
            }
        }
        for has_jacobian in [false, true] {
            let mut node = Node { c: 0.0, has_jacobian };
            let kinds = kinds_at(&mut node, 0.0, &[5.0, 25.0], &[0.0, 0.0]).unwrap();
            assert_eq!(kinds, [Algebraic; 2]);
        }
    }

    /// One equation in ẏ.
    struct Of(fn(f64) -> Result<f64, StepError>);

    impl Problem for Of {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            _: f64,
            _: &[f64],
            v: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = self.0(v[0])?;
            Ok(())
        }
    }

    /// Checks that derivatives are detected in nonlinear functions, which may keep their value after a perturbation of
    /// ẏ, have a zero derivative, or be undefined.
    #[test]
    fn a_nonlinear_derivative_is_found() {
        type Function = fn(f64) -> Result<f64, StepError>;
        let functions: [(Function, f64); 5] = [
            (|v| Ok(v * v), 0.0),
            (|v| Ok(v * v - 1.0), 1.0),
            (|v| Ok(v.powi(3) + v), 0.0),
            (|v| Ok((1e-20 * v).sinh()), 0.0),
            (|v| Ok(v.sqrt()), 0.0),
        ];
        for (function, v) in functions {
            let kinds = kinds_at(&mut Of(function), 0.0, &[1.0], &[v]).unwrap();
            assert_eq!(kinds, [Differential]);
        }
        let mut one_sided = Of(|v| {
            if v < 0.0 {
                return Err(StepError::Recoverable("below zero".into()));
            }
            Ok(v)
        });
        assert_eq!(kinds_at(&mut one_sided, 0.0, &[1.0], &[0.0]).unwrap(), [Differential]);
        let mut nowhere = Of(|_| Err(StepError::Recoverable("outside".into())));
        assert!(kinds_at(&mut nowhere, 0.0, &[1.0], &[0.0]).is_err());
    }
}
