//! Jacobians from difference quotients.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::coloring::color;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError};

/// Minimum displacement of h ẏ, in units of the rounding error of y. It limits the error of the quotient to a
/// thousandth of ∂F/∂y.
const RESOLVED: f64 = 1e4;

/// If the displacement exceeds this fraction of both the variable and its change in the step, fine displacements are
/// also tried. For a quadratic F, this fraction is the relative error of the quotient.
const COARSE: f64 = 0.1;

/// Fine displacement (small increment of a difference quotient) as a fraction of the variable or of its change in the
/// step. For a quadratic F, the quotient is
/// accurate to four digits. The fraction is much larger than √ε to limit rounding errors, because the slow solutions of
/// stiff equations may depend on small differences between large entries.
const FRACTION: f64 = 1e-4;

/// Ratio of the second fine displacement to the first. Both have the same direction, so that a variable at the edge of
/// the domain of F remains in the domain. Rounding changes F by whole units in the last place, so two quotients that
/// are dominated by rounding do not agree.
const SECOND: f64 = 0.7;

/// Maximum relative difference of two fine quotients that are not dominated by rounding.
const AGREEMENT: f64 = 1e-2;

/// Factor by which a displacement without any effect is enlarged.
const ENLARGEMENT: f64 = 1e4;

/// Maximum difference between the quotients for the two fine displacements, relative to the difference between the
/// first of these quotients and the usual quotient. Below this ratio, the error of the usual quotient is much larger
/// than the rounding error of the fine quotients.
const SIGNIFICANCE: f64 = 0.1;

/// Workspace for a Jacobian from one-sided differences, with one evaluation per color.
///
/// Unknown j is displaced by
///
/// ```text
/// δ_j = max(√ε |y_j|, √ε |h ẏ_j|, 1/w_j), in the direction of h ẏ_j,
/// ```
///
/// as in the dense and banded difference Jacobians of IDA (SUNDIALS, IDALS). For a ∂F/∂y + b ∂F/∂ẏ, y_j is displaced by
/// a σ and ẏ_j by b σ with σ = δ_j / max(|a|, |b h|), so that |a σ| and |b h σ| are at most δ_j. For ∂F/∂ẏ alone, the
/// [displacements](rate_displacement) are shorter. If such a displacement is close to the rounding error of the largest
/// variable, its quotient is compared with the quotient for the usual displacement: rounding errors divided by a short
/// step may exceed ∂F/∂y where the terms of ∂F/∂ẏ cancel, as in sums of nodal equations of circuits.
///
/// If the residual cannot be evaluated after the displacement, the unknowns of this color are displaced by [other
/// amounts](Perturbation). A smaller time step would not help, because it does not reduce 1/w_j.
///
/// The tolerance 1/w_j may be much larger than the variable and its change in the step, for example for the amount of a
/// trace species. F may then be nonlinear over the displacement. Such a variable is also displaced by a
/// [fraction](FRACTION) of its value or of its change in the step, whichever is larger. The resulting change of F may
/// be smaller than the rounding error of F, for example if the variable is added to a much larger one. Therefore, the
/// evaluation is repeated with [another displacement](SECOND), and the quotients are used only for entries for which
/// both agree.
///
/// If a displacement has no effect in a combined matrix, it is [enlarged](Self::enlarge).
#[derive(Debug, Clone)]
pub(crate) struct Differences {
    groups: Vec<Vec<usize>>,
    /// Whether coarse displacements are compared with fine ones.
    refines: bool,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    base: Vec<f64>,
    moved: Vec<f64>,
    increments: Vec<f64>,
    /// Maximum norm of y.
    largest: f64,
    /// Difference quotients of a group of columns for the first fine displacement.
    fine: Vec<f64>,
    /// Number of residual evaluations so far, including failed ones.
    pub(crate) evaluations: u64,
}

impl Differences {
    pub(crate) fn new(pattern: &SparsityPattern, refines: bool) -> Self {
        let n = pattern.major_dim();
        Self {
            groups: color(pattern),
            refines,
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            base: vec![0.0; n],
            moved: vec![0.0; n],
            increments: vec![0.0; n],
            largest: 0.0,
            fine: Vec::new(),
            evaluations: 0,
        }
    }

    /// Computes a ∂F/∂y + b ∂F/∂ẏ by difference quotients and writes it to `values`, in the order of the pattern.
    pub(crate) fn evaluate<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        pattern: &SparsityPattern,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.y.copy_from_slice(at.y);
        self.y_dot.copy_from_slice(at.y_dot);
        self.largest = at.y.iter().fold(0.0, |largest, y| largest.max(y.abs()));
        self.evaluations += 1;
        problem.residual(at.t, at.y, at.y_dot, &mut self.base)?;
        for group in 0..self.groups.len() {
            self.move_within_the_domain(problem, pattern, at, (a, b), group)?;
            for (entry, quotient) in self.quotients(pattern, group) {
                values[entry] = quotient;
            }
            let is_refined = |&j: &usize| self.fine_displacement(at, a, j).is_some();
            if self.groups[group].iter().any(is_refined) {
                self.refine(problem, pattern, at, (a, b), group, values)?;
            }
            if a != 0.0 && b != 0.0 {
                self.enlarge(problem, pattern, at, (a, b), group, values)?;
            }
            for &j in &self.groups[group] {
                (self.y[j], self.y_dot[j]) = (at.y[j], at.y_dot[j]);
            }
        }
        Ok(())
    }

    /// Returns the entries of a group: their positions in the pattern and their difference quotients.
    fn quotients<'a>(
        &'a self,
        pattern: &'a SparsityPattern,
        group: usize,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.groups[group].iter().flat_map(move |&j| {
            let entries = (pattern.major_offsets()[j]..).zip(pattern.lane(j));
            entries.map(move |(entry, &i)| {
                let change = self.moved[i] - self.base[i];
                (entry, change / self.increments[j])
            })
        })
    }

    /// Replaces the difference quotients of a group by quotients with fine displacements where the latter are more accurate.
    fn refine<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        pattern: &SparsityPattern,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        group: usize,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let scale = a.abs().max((b * at.step).abs());
        let mut fine = std::mem::take(&mut self.fine);
        fine.clear();
        for factor in [1.0, SECOND] {
            for k in 0..self.groups[group].len() {
                let j = self.groups[group][k];
                // Quotients of unknowns without a displacement are not finite and are not used.
                let size = self.fine_displacement(at, a, j).unwrap_or(0.0);
                self.displace(at, j, (a, b), factor * size / scale);
            }
            self.evaluations += 1;
            match problem.residual(at.t, &self.y, &self.y_dot, &mut self.moved) {
                Ok(()) => {}
                Err(StepError::Recoverable(_)) => break,
                Err(error) => return Err(error),
            }
            if fine.is_empty() {
                fine.extend(self.quotients(pattern, group).map(|(_, quotient)| quotient));
                continue;
            }
            for ((entry, second), &first) in self.quotients(pattern, group).zip(&fine) {
                if is_better([first, second], values[entry]) {
                    values[entry] = first;
                }
            }
        }
        self.fine = fine;
        Ok(())
    }

    /// Enlarges displacements that have no effect on F, up to √ε times the largest variable. The effect of a short
    /// displacement may be lost by rounding of F, for example if the variable is zero, has a small absolute tolerance
    /// and is added to a much larger variable. The matrix would then be singular.
    fn enlarge<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        pattern: &SparsityPattern,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        group: usize,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let scale = a.abs().max((b * at.step).abs());
        let limit = f64::EPSILON.sqrt() * self.largest;
        let entries = |j: usize| pattern.major_offsets()[j]..pattern.major_offsets()[j + 1];
        let has_effect = |values: &[f64], j: usize| values[entries(j)].iter().any(|v| *v != 0.0);
        let is_lost = |&j: &usize| {
            let size = displacement(at, j, Perturbation::Usual).abs();
            !entries(j).is_empty() && !has_effect(values, j) && size < limit
        };
        // An empty list allocates no memory.
        let mut lost: Vec<usize> = self.groups[group].iter().copied().filter(is_lost).collect();
        let mut factor = 1.0;
        while !lost.is_empty() {
            factor *= ENLARGEMENT;
            for &j in &self.groups[group] {
                (self.y[j], self.y_dot[j]) = (at.y[j], at.y_dot[j]);
            }
            let wanted = |j: usize| factor * displacement(at, j, Perturbation::Usual);
            for &j in &lost {
                let wanted = wanted(j);
                self.displace(at, j, (a, b), wanted.abs().min(limit).copysign(wanted) / scale);
            }
            self.evaluations += 1;
            match problem.residual(at.t, &self.y, &self.y_dot, &mut self.moved) {
                Ok(()) if self.is_finite(pattern, group) => {}
                Ok(()) | Err(StepError::Recoverable(_)) => break,
                Err(error) => return Err(error),
            }
            lost.retain(|&j| {
                // The first displacement with an effect may change F by only a few rounding errors. Its quotient is
                // then inaccurate, so one larger displacement is tried.
                let is_last = has_effect(values, j) || wanted(j).abs() >= limit;
                for (entry, &i) in entries(j).zip(pattern.lane(j)) {
                    values[entry] = (self.moved[i] - self.base[i]) / self.increments[j];
                }
                !is_last
            });
        }
        Ok(())
    }

    /// Returns the fine displacement of unknown j or, if `a` is 0, of h ẏ_j. Difference quotients for this displacement
    /// are compared with those for the usual displacement. Returns `None` if no comparison is necessary.
    fn fine_displacement(&self, at: &Linearization<'_>, a: f64, j: usize) -> Option<f64> {
        if !self.refines {
            return None;
        }
        if a != 0.0 {
            return is_coarse(at, j).then(|| FRACTION * extent(at, j));
        }
        let fine = rate_displacement(at, j);
        (fine.abs() < RESOLVED * f64::EPSILON * self.largest).then_some(fine)
    }

    /// Displaces y_j by a · `wanted` and ẏ_j by b · `wanted`.
    fn displace(&mut self, at: &Linearization<'_>, j: usize, (a, b): (f64, f64), wanted: f64) {
        self.y[j] = at.y[j] + a * wanted;
        // Use the displacement after rounding in y, so that the quotient refers to the actual change.
        let sigma = match a {
            0.0 => wanted,
            _ => (self.y[j] - at.y[j]) / a,
        };
        self.y_dot[j] = at.y_dot[j] + b * sigma;
        self.increments[j] = sigma;
    }

    /// Perturbs the unknowns of a group and evaluates the residual. Tries all perturbations in turn until an evaluation
    /// succeeds. If all evaluations fail, returns the first error. If the results contain non-finite values, the caller
    /// reports the position of such a value.
    fn move_within_the_domain<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        pattern: &SparsityPattern,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        group: usize,
    ) -> Result<(), StepError> {
        let scale = a.abs().max((b * at.step).abs());
        let mut first = Ok(());
        for perturbation in Perturbation::ALL {
            for k in 0..self.groups[group].len() {
                let j = self.groups[group][k];
                let size = match (a, perturbation, self.fine_displacement(at, a, j)) {
                    (0.0, Perturbation::Usual, None) => rate_displacement(at, j),
                    _ => displacement(at, j, perturbation),
                };
                self.displace(at, j, (a, b), size / scale);
            }
            self.evaluations += 1;
            match problem.residual(at.t, &self.y, &self.y_dot, &mut self.moved) {
                Ok(()) if self.is_finite(pattern, group) => return Ok(()),
                Ok(()) => {}
                Err(refused @ StepError::Recoverable(_)) => first = first.and(Err(refused)),
                Err(error) => return Err(error),
            }
        }
        first
    }

    /// Returns whether the residual is still finite in the rows that depend on the group and were finite before.
    fn is_finite(&self, pattern: &SparsityPattern, group: usize) -> bool {
        let mut rows = self.groups[group].iter().flat_map(|&j| pattern.lane(j));
        rows.all(|&i| self.moved[i].is_finite() || !self.base[i].is_finite())
    }
}

/// Displacement of the unknowns.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Perturbation {
    /// By δ_j.
    Usual,
    /// By −δ_j.
    Back,
    /// Away from zero by δ_j, computed with √ε/w_j instead of 1/w_j, so that a positive variable remains positive even if it is
    /// close to zero.
    SlightlyAway,
    /// Toward zero, by the same distance.
    SlightlyToward,
}

impl Perturbation {
    /// All perturbations in the order in which they are tried. Small perturbations come last, because they are more
    /// affected by rounding.
    const ALL: [Self; 4] = [Self::Usual, Self::Back, Self::SlightlyAway, Self::SlightlyToward];
}

/// Returns the signed displacement of ẏ_j multiplied by h, for a displacement of ẏ alone.
///
/// The usual displacement would change ẏ by the tolerance divided by h. If h is short, this change may be far outside
/// the range in which F is linear in ẏ. A smaller displacement is sufficient if its effect on F is large compared with
/// the effect of the rounding error of y.
fn rate_displacement(at: &Linearization<'_>, j: usize) -> f64 {
    let motion = at.step * at.y_dot[j];
    let size = f64::EPSILON.sqrt() * motion.abs().max(1.0 / at.weights[j]);
    size.max(RESOLVED * f64::EPSILON * at.y[j].abs()).copysign(motion)
}

/// Returns the larger of |y_j| and the change of variable j in the step.
fn extent(at: &Linearization<'_>, j: usize) -> f64 {
    at.y[j].abs().max((at.step * at.y_dot[j]).abs())
}

/// Returns whether the tolerance of variable j is so large, relative to the variable, that F may be nonlinear over this
/// distance. Returns `false` near the smallest representable numbers, which have too few digits for fine displacements.
fn is_coarse(at: &Linearization<'_>, j: usize) -> bool {
    let extent = extent(at, j);
    let is_resolved = FRACTION * extent > f64::MIN_POSITIVE / f64::EPSILON;
    is_resolved && 1.0 / at.weights[j] > COARSE * extent
}

/// Returns whether two fine quotients determine an entry more accurately than the usual quotient. A quotient of zero is
/// not used, because it may be caused by rounding. The quotient of an unknown that is not displaced is infinite if the
/// row depends on another displaced unknown whose entry is missing in the pattern.
fn is_better([first, second]: [f64; 2], usual: f64) -> bool {
    let noise = (first - second).abs();
    first.is_normal()
        && second.is_finite()
        && noise <= AGREEMENT * first.abs().max(second.abs())
        && noise <= SIGNIFICANCE * (first - usual).abs()
}

/// Returns the signed perturbation of unknown j.
pub(crate) fn displacement(at: &Linearization<'_>, j: usize, perturbation: Perturbation) -> f64 {
    let motion = at.step * at.y_dot[j];
    let size = f64::EPSILON.sqrt() * extent(at, j);
    let usual = || size.max(1.0 / at.weights[j]).copysign(motion);
    let slight = || {
        let away = if at.y[j] == 0.0 { motion } else { at.y[j] };
        size.max(f64::EPSILON.sqrt() / at.weights[j]).copysign(away)
    };
    match perturbation {
        Perturbation::Usual => usual(),
        Perturbation::Back => -usual(),
        Perturbation::SlightlyAway => slight(),
        Perturbation::SlightlyToward => -slight(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Jacobian;

    /// F_0 = √y_0 + 2 √y_1 and F_1 = √y_1 + ẏ_1, which are defined only for y ≥ 0 and y ≤ `above`.
    struct Roots {
        stated: bool,
        above: f64,
        calls: u64,
    }

    impl Problem for Roots {
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
            self.calls += 1;
            let outside = y.iter().any(|&y| y < 0.0 || y > self.above);
            if self.stated && outside {
                return Err(StepError::Recoverable(format!("{y:?}")));
            }
            let [p, q] = [y[0], y[1]].map(|y| if outside { f64::NAN } else { y.sqrt() });
            r.copy_from_slice(&[p + 2.0 * q, q + v[1]]);
            Ok(())
        }
    }

    /// Returns the absolute errors of the four entries at y = (1e-4, 4e-4) for a tolerance of 1e-3, and the number of
    /// evaluations.
    fn differenced(problem: &mut Roots, y_dot: [f64; 2]) -> Result<([f64; 4], u64), StepError> {
        let at = Linearization {
            t: 0.0,
            y: &[1e-4, 4e-4],
            y_dot: &y_dot,
            step: 1.0,
            weights: &[1e3; 2],
        };
        let mut jacobian = Jacobian::of(problem);
        let mut values = [0.0; 4];
        jacobian.combined(problem, &at, (1.0, 0.0), &mut values)?;
        let exact = [50.0, 0.0, 50.0, 25.0];
        let errors = std::array::from_fn(|k| (values[k] - exact[k]).abs());
        Ok((errors, jacobian.residual_evaluations()))
    }

    #[test]
    fn differences_stay_where_the_residual_can_be_evaluated() {
        for stated in [true, false] {
            let new = |above| Roots { stated, above, calls: 0 };
            // The first perturbation of one column leaves the domain, but the second one does not. The tolerance is ten
            // times y_0, so fine displacements are also used for both columns.
            let mut problem = new(f64::INFINITY);
            let (errors, counted) = differenced(&mut problem, [1e-9, -1e-9]).unwrap();
            assert_eq!((counted, problem.calls), (8, 8));
            // The next term of the expansion of the square root is a quarter of this bound.
            assert!(errors.iter().all(|e| *e < 50.0 * FRACTION), "{errors:?}");
            // Displacements by the tolerance leave the domain in both directions. For displacements of √ε y, truncation
            // and rounding errors are both about 50 √ε; the bound is ten times as large.
            let mut problem = new(5e-4);
            let (errors, counted) = differenced(&mut problem, [1e-9, -1e-9]).unwrap();
            assert_eq!((counted, problem.calls), (11, 11));
            assert!(errors.iter().all(|e| *e < 50.0 * 1.5e-7), "{errors:?}");
        }
    }

    #[test]
    fn the_first_failure_is_returned_if_no_perturbation_is_possible() {
        let mut stated = Roots { stated: true, above: f64::INFINITY, calls: 0 };
        let mut at = Linearization {
            t: 0.0,
            y: &[0.0, 0.0],
            y_dot: &[-1.0, 1.0],
            step: 1.0,
            weights: &[1e3; 2],
        };
        let mut differences = Differences::new(&crate::problem::full_pattern(2), true);
        let pattern = crate::problem::full_pattern(2);
        let mut values = [0.0; 4];
        // At zero, a displacement in the other direction remains in the domain.
        differences.evaluate(&mut stated, &pattern, &at, (1.0, 0.0), &mut values).unwrap();
        assert_eq!(differences.evaluations, 4);
        stated.above = 0.0;
        let error = differences.evaluate(&mut stated, &pattern, &at, (1.0, 0.0), &mut values);
        // √ε |h ẏ| < 1/w: the first displacement is −1e-3.
        assert_eq!(error.unwrap_err().to_string(), "[-0.001, 0.0]");
        assert_eq!(differences.evaluations, 4 + 5);
        at.y = &[-1.0, -1.0];
        let error = differences.evaluate(&mut stated, &pattern, &at, (1.0, 0.0), &mut values);
        assert_eq!(error.unwrap_err().to_string(), "[-1.0, -1.0]");
        assert_eq!(differences.evaluations, 4 + 5 + 1);
    }

    /// A capacitor between two nodes, each with a conductance to ground.
    struct Capacitor;

    impl Problem for Capacitor {
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
            let current = 1e-6 * (v[0] - v[1]);
            r.copy_from_slice(&[current + 1e-3 * y[0], -current + 1e-3 * (y[1] - 1.0)]);
            Ok(())
        }
    }

    /// Regression test: the integration of the amplifier of the IVP test set, which has index 1 and derivatives that
    /// cancel, stopped after five steps of about 1e-11 s, because a variable at zero was perturbed by √ε times its
    /// tolerance.
    #[test]
    fn canceling_derivatives_cancel_in_short_steps() {
        let step = 1e-12;
        let at = Linearization {
            t: 0.0,
            y: &[0.0, 3.0],
            y_dot: &[51.3, 51.2],
            step,
            weights: &[1e8, 1.0 / (3e-4 + 1e-8)],
        };
        let mut jacobian = Jacobian::of(&Capacitor);
        let mut parts = [[0.0; 4]; 2];
        let [df_dy, df_dyp] = &mut parts;
        jacobian.parts(&mut Capacitor, &at, [df_dy, df_dyp]).unwrap();
        for column in df_dyp.chunks_exact(2) {
            // The rounding error of F divided by the tolerance is 2e-19/1e-8, much smaller than the conductance.
            let sum = (column[0] + column[1]) / step;
            assert!(sum.abs() < 1e-3 * 1e-3, "{df_dyp:?}");
        }
    }
    /// Decay of y_0, with a constant sum of y_0 and y_1.
    struct Sum;

    impl Problem for Sum {
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
            r.copy_from_slice(&[v[0] + y[0], y[0] + y[1] - 1.0]);
            Ok(())
        }
    }

    /// Regression test: BDF stopped at the start of Robertson's problem with an absolute tolerance of 1e-16.
    #[test]
    fn displacements_below_the_rounding_of_other_variables_are_enlarged() {
        let at = Linearization {
            t: 0.0,
            y: &[1.0, 0.0],
            y_dot: &[-1.0, 0.0],
            step: 1e-6,
            weights: &[1e6, 1e20],
        };
        let mut jacobian = Jacobian::of(&Sum);
        let mut values = [0.0; 4];
        jacobian.combined(&mut Sum, &at, (1.0, 1e6), &mut values).unwrap();
        let exact = [1e6 + 1.0, 1.0, 0.0, 1.0];
        // The rounding error of the second row, 1e-16, is divided by displacements of 1e-8 or more.
        let errors = values.iter().zip(exact).map(|(v, e)| (v - e).abs() / e.max(1.0));
        assert!(errors.fold(0.0, f64::max) < 1e-6, "{values:?}");
        assert_eq!(jacobian.residual_evaluations(), 6);
    }
}
