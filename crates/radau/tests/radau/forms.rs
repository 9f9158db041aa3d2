//! Forms of constrained mechanical systems.

use myovib_conformance::jacobian_error;
use myovib_conformance::samples::{
    CarAxis, Charges, Constrained, Differentiated, FourBar, MechanicalForm, Pendulum, Press,
    Sample, SliderCrank, SphericalPendulums,
};
use myovib_dae::{Problem, VariableKind};
use nalgebra::DMatrix;

use crate::common::{run, tolerance};

const FORMS: [MechanicalForm; 4] = [
    MechanicalForm::Index1,
    MechanicalForm::Index2,
    MechanicalForm::Index3,
    MechanicalForm::Stabilized,
];

fn samples(form: MechanicalForm) -> Vec<Box<dyn Sample>> {
    vec![
        Box::new(Pendulum::new(form)),
        Box::new(CarAxis::new(form)),
        Box::new(Differentiated::new(Constrained::new(SliderCrank, form))),
        Box::new(Differentiated::new(Constrained::new(FourBar, form))),
        Box::new(Differentiated::new(Constrained::new(Press, form))),
        Box::new(Differentiated::new(Constrained::new(SphericalPendulums, form))),
        Box::new(Differentiated::new(Constrained::new(Charges, form))),
    ]
}

/// Returns a point near the start at which no entry of the Jacobian is zero by coincidence.
fn near_start(sample: &dyn Sample) -> [Vec<f64>; 2] {
    let start = sample.start();
    let moved = |x: Vec<f64>, phase: f64| -> Vec<f64> {
        let moved = x.iter().enumerate();
        let moved = moved.map(|(i, x)| x + 0.03 * (1.0 + x.abs()) * (phase + 1.7 * i as f64).sin());
        moved.collect()
    };
    [moved(start.y, 0.4), moved(start.y_dot, 0.9)]
}

/// Returns the smallest singular value of the matrix of derivatives with respect to ẏ of differential variables and y
/// of algebraic variables, with rows and columns scaled to 1. It is zero if the index is above 1.
fn regularity(sample: &mut dyn Sample, [y, y_dot]: &[Vec<f64>; 2]) -> f64 {
    let n = sample.n_unknowns();
    let kinds = sample.kinds().unwrap();
    let pattern = sample.jacobian_pattern();
    let mut matrix = DMatrix::<f64>::zeros(n, n);
    for (kind, [a, b]) in
        [(VariableKind::Algebraic, [1.0, 0.0]), (VariableKind::Differential, [0.0, 1.0])]
    {
        let mut values = vec![0.0; pattern.nnz()];
        sample.jacobian(0.3, y, y_dot, a, b, &mut values).unwrap();
        for ((column, row), value) in pattern.entries().zip(&values) {
            if kinds[column] == kind {
                matrix[(row, column)] = *value;
            }
        }
    }
    let scale = |size: f64| if size > 0.0 { 1.0 / size } else { 1.0 };
    for mut row in matrix.row_iter_mut() {
        row *= scale(row.amax());
    }
    for mut column in matrix.column_iter_mut() {
        column *= scale(column.amax());
    }
    matrix.singular_values().min()
}

/// Regression test: instead of the index-1 form of the pendulum and of the car axis, the index-3 form was integrated.
#[test]
fn forms_have_the_index_that_they_state() {
    for form in FORMS {
        for (k, mut sample) in samples(form).into_iter().enumerate() {
            let at = near_start(&*sample);
            let smallest = regularity(&mut *sample, &at);
            // For a singular matrix, the computed value consists of rounding errors of about 1e-16.
            let is_regular = smallest > 1e-8;
            let is_of_index_1 = sample.indices().unwrap().iter().all(|&index| index <= 1);
            assert_eq!(is_regular, is_of_index_1, "{k}, {form:?}: {smallest:e}");
        }
    }
}

#[test]
fn jacobians_of_all_forms_are_derivatives() {
    for form in FORMS {
        for (k, mut sample) in samples(form).into_iter().enumerate() {
            let [y, y_dot] = near_start(&*sample);
            let direction: Vec<f64> = y.iter().map(|y| 0.1 * (1.0 + y.abs())).collect();
            let at = [&y[..], &y_dot[..], &direction[..]];
            let error = jacobian_error(&mut *sample, 0.3, at, [1.3, 0.7]);
            // The error of central differences is (1e-5)²/6 times a third derivative, plus rounding errors of
            // 1e-16/1e-5.
            assert!(error < 1e-7, "{k}, {form:?}: {error:e}");
        }
    }
}

#[test]
fn all_forms_of_the_pendulum_have_its_solution() {
    const TOLERANCE: f64 = 1e-6;
    const T_END: f64 = 2.0;
    for form in FORMS {
        let exact = Pendulum::new(form).exact(T_END).unwrap();
        let solver = run(Pendulum::new(form), T_END, tolerance(TOLERANCE));
        for (i, (y, exact)) in solver.y().iter().zip(&exact).enumerate() {
            // The manual states a bound of 100 times the tolerance, relative to 1 + |y|.
            let error = (y - exact).abs() / (1.0 + exact.abs());
            assert!(error < 100.0 * TOLERANCE, "{form:?}, y[{i}]: {error:e}");
        }
    }
}
