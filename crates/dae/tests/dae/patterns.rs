//! Checks of the exact patterns of samples, complete or with one entry removed.

use myovib_conformance::samples::*;
use myovib_dae::{
    Jacobian, Linearization, MissingEntry, Problem, SparsityPattern, StepError, Tolerances,
    check_pattern,
};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// A sample with the given sparsity pattern and without a Jacobian.
struct Sparse<'a> {
    sample: &'a mut dyn Sample,
    pattern: SparsityPattern,
}

impl Problem for Sparse<'_> {
    fn n_unknowns(&self) -> usize {
        self.sample.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.sample.residual(t, y, v, r)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone()
    }
}

/// Returns the two parts of a sample's Jacobian as full matrices, by columns.
fn parts(sample: &mut dyn Sample, (t, y, v): (f64, &[f64], &[f64])) -> [Vec<f64>; 2] {
    let (n, weights) = (y.len(), vec![1e6; y.len()]);
    let at = Linearization { t, y, y_dot: v, step: 1.0, weights: &weights };
    let mut jacobian = Jacobian::of(sample);
    let pattern = jacobian.pattern().clone();
    let mut values = [vec![0.0; pattern.nnz()], vec![0.0; pattern.nnz()]];
    let [df_dy, df_dyp] = &mut values;
    jacobian.parts(sample, &at, [df_dy, df_dyp]).unwrap();
    values.map(|values| {
        let mut full = vec![0.0; n * n];
        for ((column, row), value) in pattern.entries().zip(values) {
            full[column * n + row] = value;
        }
        full
    })
}

fn pattern_of(n: usize, entries: &[bool]) -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for column in entries.chunks(n) {
        rows.extend((0..n).filter(|&i| column[i]));
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows).unwrap()
}

/// Returns the perturbation of unknown j in difference quotients.
fn perturbation(at: &Linearization<'_>, j: usize) -> f64 {
    let size = f64::max(at.y[j].abs(), (at.step * at.y_dot[j]).abs());
    f64::max(f64::EPSILON.sqrt() * size, 1.0 / at.weights[j])
}

/// Checks that nothing is reported for a sample with its complete pattern. Each removed entry must be reported if it
/// contributes more than a twentieth of its row, scaled by the tolerances at the start.
fn judge(sample: &mut dyn Sample) {
    let start = sample.start();
    let n = start.y.len();
    let mut entries = vec![false; n * n];
    for trial in 0..3 {
        let mut random = StdRng::seed_from_u64(trial);
        let mut near = |values: &[f64]| -> Vec<f64> {
            let near = |x: &f64| x + 0.01 * (1.0 + x.abs()) * random.random_range(0.5..1.0);
            values.iter().map(near).collect()
        };
        let there = (start.t, &near(&start.y)[..], &near(&start.y_dot)[..]);
        for part in parts(sample, there) {
            for (entry, value) in entries.iter_mut().zip(part) {
                *entry |= value != 0.0;
            }
        }
    }
    let mut weights = vec![0.0; n];
    Tolerances::scalar(1e-6, 1e-6).write_weights(&start.y, &mut weights);
    let at = Linearization {
        t: start.t,
        y: &start.y,
        y_dot: &start.y_dot,
        step: 1e-6,
        weights: &weights,
    };
    // Contribution of each entry to its row, for the perturbations that the check uses.
    let units = [f64::EPSILON.sqrt().recip(), 1.0].map(|weight| vec![weight; n]);
    let [at_rate, quotients] =
        [&units[0], &units[1]].map(|weights| Linearization { step: 1.0, weights, ..at });
    let pattern = pattern_of(n, &vec![true; n * n]);
    let mut full = Sparse { sample, pattern };
    let mut moves = |[at, quotients]: [&Linearization<'_>; 2], coefficients| {
        let mut values = vec![0.0; n * n];
        let mut jacobian = Jacobian::of(&full);
        jacobian.combined(&mut full, quotients, coefficients, &mut values).unwrap();
        for (k, value) in values.iter_mut().enumerate() {
            *value = (*value * perturbation(at, k / n)).abs();
        }
        values
    };
    let moved = [moves([&at, &at], (1.0, 0.0)), moves([&at_rate, &quotients], (0.0, 1.0))];
    let mut check = |entries: &[bool]| {
        let pattern = pattern_of(n, entries);
        check_pattern(&mut Sparse { sample, pattern }, &at)
    };
    assert_eq!(check(&entries), Ok(()));
    let mut reported = 0;
    for missing in (0..n * n).filter(|&k| entries[k]) {
        let (column, row) = (missing / n, missing % n);
        let share = |part: &[f64]| {
            let of_row = (0..n).map(|j| part[j * n + row]).sum::<f64>();
            part[missing] / of_row
        };
        let mut less = entries.clone();
        less[missing] = false;
        let found = check(&less);
        if let Err(missing) = found {
            assert_eq!((missing.row, missing.column), (row, column));
            reported += 1;
        } else {
            let shares = [share(&moved[0]), share(&moved[1])];
            assert!(!shares.iter().any(|share| *share > 0.05), "{row}, {column}");
        }
    }
    assert!(reported > 0);
}

#[test]
fn complete_patterns_pass_and_removed_entries_are_named() {
    use MechanicalForm::{Index1, Index2, Index3, Stabilized};
    let mut samples: Vec<Box<dyn Sample>> = vec![
        Box::new(Robertson),
        Box::new(Akzo),
        Box::new(Heat2d::new(5)),
        Box::new(LinearIndex1),
        Box::new(JayIndex2),
        Box::new(Oscillator { omega: 3.0 }),
        Box::new(ScaledLinear { p: 2.0, q: 0.6 }),
        Box::new(ScaledJay { c: 1.5, w: 0.8 }),
        Box::new(VanDerPol { vdp_mu: 1000.0 }),
        Box::new(Differentiated::new(Doubler)),
        Box::new(Differentiated::new(Amplifier)),
        Box::new(Differentiated::new(CapacitorLoop)),
        Box::new(Differentiated::new(TimeScales)),
        Box::new(Differentiated::new(Pulses)),
        Box::new(Differentiated::new(Pipes::new(true))),
        Box::new(Differentiated::new(Pipes::new(false))),
        Box::new(Differentiated::new(Skate)),
        Box::new(Differentiated::new(Bridge)),
        Box::new(Differentiated::new(Inverters)),
        Box::new(Differentiated::new(Pump)),
    ];
    for form in [Index1, Index2, Index3, Stabilized] {
        samples.push(Box::new(Pendulum::new(form)));
        samples.push(Box::new(Differentiated::new(Constrained::new(SliderCrank, form))));
        samples.push(Box::new(Differentiated::new(Constrained::new(FourBar, form))));
        samples.push(Box::new(Differentiated::new(Constrained::new(Press, form))));
        samples.push(Box::new(Differentiated::new(Constrained::new(SphericalPendulums, form))));
        samples.push(Box::new(Differentiated::new(Constrained::new(Charges, form))));
        samples.push(Box::new(CarAxis::new(form)));
    }
    for mut sample in samples {
        judge(&mut *sample);
    }
}

/// F of n variables, with a diagonal pattern.
struct Diagonal<F>(usize, F);

impl<F: FnMut(&[f64], &[f64], &mut [f64]) -> Result<(), StepError>> Problem for Diagonal<F> {
    fn n_unknowns(&self) -> usize {
        self.0
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        (self.1)(y, v, r)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        let n = self.0;
        let entries: Vec<bool> = (0..n * n).map(|k| k / n == k % n).collect();
        pattern_of(n, &entries)
    }
}

fn check_diagonal(
    y: &[f64],
    residual: impl FnMut(&[f64], &[f64], &mut [f64]) -> Result<(), StepError>,
) -> Result<(), MissingEntry> {
    let n = y.len();
    let (y_dot, weights) = (vec![0.0; n], vec![1e6; n]);
    let at = Linearization { t: 0.0, y, y_dot: &y_dot, step: 1.0, weights: &weights };
    check_pattern(&mut Diagonal(n, residual), &at)
}

/// Uses the product H D H x with the Householder matrix H = 1 − 2 u uᵀ and D = 3. It is equal to 3 x, but every row
/// contains rounding errors from all components of x.
#[test]
fn rounding_errors_are_not_entries() {
    let n = 16;
    let reflect = |x: &mut Vec<f64>| {
        let sum = 2.0 * x.iter().sum::<f64>() / x.len() as f64;
        x.iter_mut().for_each(|x| *x -= sum);
    };
    let mut random = StdRng::seed_from_u64(1);
    let numbers = std::iter::repeat_with(|| 1e3 * random.random_range(-1.0_f64..1.0).powi(9));
    let y: Vec<f64> = numbers.take(n).collect();
    let mut rounded = 0;
    let found = check_diagonal(&y, |y, v, r| {
        let mut x = y.to_vec();
        reflect(&mut x);
        x.iter_mut().for_each(|x| *x *= 3.0);
        reflect(&mut x);
        rounded += (0..n).filter(|&i| x[i] != 3.0 * y[i]).count();
        (0..n).for_each(|i| r[i] = v[i] + 1e-9 * x[i]);
        // These rows contain only rounding errors.
        (0..n / 2).for_each(|i| r[i] = x[i] - 3.0 * y[i]);
        Ok(())
    });
    assert_eq!(found, Ok(()));
    assert!(rounded > n);
}

/// Uses zero concentrations, so that most directions leave the domain.
#[test]
fn entries_are_found_at_the_border_of_the_domain() {
    let n = 10;
    let found = check_diagonal(&vec![0.0; n], |y, v, r| {
        if y.iter().any(|y| *y < 0.0) {
            return Err(StepError::Recoverable("negative".to_owned()));
        }
        (0..n).for_each(|i| r[i] = v[i] + y[i]);
        r[7] -= y[2];
        Ok(())
    });
    let missing = found.unwrap_err();
    assert_eq!((missing.row, missing.column, missing.is_rate_matrix), (7, 2, false));
}

#[test]
fn entries_of_the_derivative_are_found_and_failures_are_ignored() {
    let coupled = |_: &[f64], v: &[f64], r: &mut [f64]| {
        r.copy_from_slice(&[v[0] + 0.1 * v[1], v[1]]);
        Ok(())
    };
    let missing = check_diagonal(&[1.0, 1.0], coupled).unwrap_err();
    assert_eq!((missing.row, missing.column, missing.is_rate_matrix), (0, 1, true));
    let printed = missing.to_string();
    assert!(printed.starts_with("equation 0 depends on the derivative of y[1]"), "{printed}");
    let fails = |_: &[f64], _: &[f64], _: &mut [f64]| Err(StepError::Fatal("no".into()));
    assert_eq!(check_diagonal(&[1.0, 1.0], fails), Ok(()));
}

/// The tolerance of the large variable is 1000 times the tolerance of the variable with the value 0.
#[test]
fn entries_of_variables_that_are_zero_are_found() {
    let (y, y_dot, weights) = ([1.0, 0.0], [0.0; 2], [1e3, 1e6]);
    let at = Linearization { t: 0.0, y: &y, y_dot: &y_dot, step: 1.0, weights: &weights };
    let mut sum = Diagonal(2, |y: &[f64], _: &[f64], r: &mut [f64]| {
        r.copy_from_slice(&[y[0] + y[1] - 1.0, y[1]]);
        Ok(())
    });
    let missing = check_pattern(&mut sum, &at).unwrap_err();
    assert_eq!((missing.row, missing.column, missing.is_rate_matrix), (0, 1, false));
}
