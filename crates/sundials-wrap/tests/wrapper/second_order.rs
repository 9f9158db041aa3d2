//! Second derivatives from adjoints along forward sensitivities, compared with SUNDIALS' example.

use crate::published_sensitivity::Kinetics;
use myovib_dae::{Differenced, Parameter, StepError, Tolerances};
use sundials_wrap::adjoint::{BackwardOptions, BackwardProblem, Checkpoints, ForwardState};
use sundials_wrap::{IdaOptions, IdaSolver, SensitivityMethod, SensitivityOptions};

/// Adjoint λ of G = ∫ |y|²/2 dt for Robertson's kinetics, with its derivative μ = ∂λ/∂p_k for k = 0 or 1. The
/// quadratures are ∂G/∂p1, ∂G/∂p2 and their derivatives with respect to p_k.
struct SecondOrder {
    k: usize,
}

/// Returns ∂F/∂yᵀ λ.
fn transposed(p: [f64; 3], y: &[f64], l: &[f64]) -> [f64; 3] {
    let difference = l[1] - l[0];
    [
        -p[0] * difference + l[2],
        p[1] * y[2] * difference + 2.0 * p[2] * y[1] * l[1] + l[2],
        p[1] * y[1] * difference + l[2],
    ]
}

impl BackwardProblem<Kinetics> for SecondOrder {
    fn n_unknowns(&self) -> usize {
        6
    }

    fn residual(
        &mut self,
        forward: &mut Kinetics,
        at: &ForwardState,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let (p, y, [s, _]) = (forward.p, &at.y, &at.s[self.k]);
        let (l, m) = values.split_at(3);
        let (of_l, of_m) = (transposed(p, y, l), transposed(p, y, m));
        // Derivative of ∂F/∂yᵀ with respect to p_k along y + S dp_k, multiplied by λ.
        let [dp1, dp2] = [0, 1].map(|k| f64::from(u8::from(k == self.k)));
        let difference = l[1] - l[0];
        let moved = [
            -dp1 * difference,
            (dp2 * y[2] + p[1] * s[2]) * difference + 2.0 * p[2] * s[1] * l[1],
            (dp2 * y[1] + p[1] * s[1]) * difference,
        ];
        for i in 0..3 {
            let dot = |rate: f64| if i < 2 { rate } else { 0.0 };
            residual[i] = dot(rates[i]) - of_l[i] + y[i];
            residual[3 + i] = dot(rates[3 + i]) - of_m[i] - moved[i] + s[i];
        }
        Ok(())
    }

    fn n_quadratures(&self) -> usize {
        4
    }

    fn quadrature(
        &mut self,
        _: &mut Kinetics,
        at: &ForwardState,
        values: &[f64],
        _: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let (y, [s, _]) = (&at.y, &at.s[self.k]);
        let (of_l, of_m) = (values[1] - values[0], values[4] - values[3]);
        out[0] = -y[0] * of_l;
        out[1] = y[1] * y[2] * of_l;
        out[2] = -y[0] * of_m - s[0] * of_l;
        out[3] = y[1] * y[2] * of_m + (s[1] * y[2] + y[1] * s[2]) * of_l;
        Ok(())
    }
}

/// Gradient and Hessian of G at t = 80 with respect to p1 and p2 are compared with the output of idasHessian_ASA_FSA.
/// The gradient is computed both from sensitivities of a quadrature and from adjoints.
#[test]
fn reproduces_the_published_hessian_of_robertson() {
    let p = [0.04, 1e4, 3e7];
    // The example does not specify typical sizes of the parameters, so the default of 1 applies.
    let parameter = |name: &str, value| Parameter { scale: 1.0, ..Parameter::new(name, value) };
    let list = vec![parameter("p1", p[0]), parameter("p2", p[1])];
    let set = |problem: &mut Kinetics, j: usize, value| problem.p[j] = value;
    let zero = || [vec![0.0; 3], vec![0.0; 3]];
    let sensitivities =
        SensitivityOptions { method: SensitivityMethod::Simultaneous, in_error_test: true };
    let mut solver = IdaSolver::builder(Kinetics { p })
        .options(IdaOptions {
            tolerances: Tolerances::scalar(1e-8, 1e-10),
            max_steps: Some(1500),
            ..IdaOptions::default()
        })
        .quadrature(vec![0.0], Some((1e-8, 1e-10)), |_, _, y, _, out| {
            out[0] = 0.5 * y.iter().map(|y| y * y).sum::<f64>();
            Ok(())
        })
        .sensitivities(
            Differenced::new(list, |problem: &Kinetics, j| problem.p[j], set),
            sensitivities,
            vec![zero(), zero()],
        )
        .quadrature_sensitivities(|_, _, (_, y, _), [s, _], out| {
            out[0] = y.iter().zip(s).map(|(y, s)| y * s).sum();
            Ok(())
        })
        .checkpoints(Checkpoints::default())
        .build(0.0, &[1.0, 0.0, 0.0], &[-p[0], p[0], 0.0])
        .unwrap();
    solver.integrate_to(80.0).unwrap();
    let mut g = [0.0];
    solver.quadrature(&mut g).unwrap();
    let gradient = [0, 1].map(|j| {
        let mut out = [0.0];
        solver.quadrature_sensitivity(j, &mut out).unwrap();
        out[0]
    });
    let end = solver.forward_state().unwrap();
    let backward = [0, 1].map(|k| {
        let (y, s) = (&end.y, &end.s[k][0]);
        let values = [0.0, 0.0, y[2], 0.0, 0.0, s[2]];
        let rates = [y[2] - y[0], y[2] - y[1], 0.0, s[2] - s[0], s[2] - s[1], 0.0];
        let options = BackwardOptions {
            tolerances: Tolerances::scalar(1e-8, 1e-8),
            max_steps: 5000,
            ..BackwardOptions::default()
        };
        let problem = SecondOrder { k };
        solver.add_backward(problem, &options, &end, [&values, &rates]).unwrap()
    });
    solver.integrate_back_to(0.0).unwrap();
    let columns = backward.map(|b| solver.backward(b).unwrap().quadratures.clone());
    println!("G = {g:?}, dG/dp = {gradient:?}, backward {columns:?}");
    // The example prints five digits.
    let close =
        |ours: f64, theirs: f64| assert!((ours / theirs - 1.0).abs() < 1e-4, "{ours} {theirs}");
    close(g[0], 25.042);
    for (j, theirs) in [-137.53, 4.1552e-4].into_iter().enumerate() {
        close(gradient[j], theirs);
        columns.iter().for_each(|column| close(column[j], theirs));
    }
    let hessian = [[4424.3, -2.7779e-3], [-2.7779e-3, -2.4173e-8]];
    for (column, theirs) in columns.iter().zip(hessian) {
        close(column[2], theirs[0]);
        close(column[3], theirs[1]);
    }
}
