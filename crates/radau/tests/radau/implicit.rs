//! Fully implicit equations, and solutions that begin like a square root. Successful runs must be accurate.

use myovib_dae::{Outcome, Problem, StepError, Tolerances};
use myovib_radau::RadauOptions;

use crate::common::radau;

/// Function that writes F(t, y, ẏ) to the last argument.
type Residual = fn(f64, &[f64], &[f64], &mut [f64]);

/// An equation, and its exact solution as a function that returns y and ẏ at t.
struct Case {
    name: &'static str,
    span: [f64; 2],
    exact: fn(f64) -> [Vec<f64>; 2],
    residual: Residual,
}

struct Implicit {
    n: usize,
    residual: Residual,
}

impl Problem for Implicit {
    fn n_unknowns(&self) -> usize {
        self.n
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        (self.residual)(t, y, v, r);
        Ok(())
    }
}

/// Largest error of a run that counts as successful, in units of the tolerance. A factor of 100 allows the loss of two
/// digits.
const PROMISED: f64 = 100.0;

const CASES: [Case; 20] = [
    Case {
        name: "two coupled quadratic equations",
        span: [0.5, 1.0],
        exact: |t| {
            let e = (-t).exp();
            let y = vec![t.powi(4) * e, (4.0 - t) * t.powi(3) * e];
            let slope = (12.0 * t * t - 8.0 * t.powi(3) + t.powi(4)) * e;
            [y.clone(), vec![y[1], slope]]
        },
        residual: |t, y, v, r| {
            let e = (-t).exp();
            let square = v[0].sin().powi(2) + y[1].cos().powi(2);
            r[0] = square * v[1] * v[1] - ((t - 6.0) * (t - 2.0)).powi(2) * y[0] * e;
            r[1] = (4.0 - t) * (y[0] + y[1]).powi(3) - 64.0 * t * t * e * y[0] * y[1];
        },
    },
    Case {
        name: "square root that saturates",
        span: [0.0, 1.0],
        exact: |t| {
            let y = (1e-16 - (1.0 - 1e-16) * (-t).exp_m1()).sqrt();
            [vec![y], vec![(1.0 - y * y) / (2.0 * y)]]
        },
        residual: |_, y, v, r| r[0] = 2.0 * y[0] * v[0] + y[0] * y[0] - 1.0,
    },
    Case {
        name: "square root",
        span: [0.0, 1.0],
        exact: |t| {
            let y = (t + 1e-12).sqrt();
            [vec![y], vec![0.5 / y]]
        },
        residual: |_, y, v, r| r[0] = y[0] * v[0] - 0.5,
    },
    Case {
        name: "cube root",
        span: [0.0, 1.0],
        exact: |t| {
            let y = (t + 1e-15).cbrt();
            [vec![y], vec![1.0 / (3.0 * y * y)]]
        },
        residual: |_, y, v, r| r[0] = y[0] * y[0] * v[0] - 1.0 / 3.0,
    },
    Case {
        name: "two thirds",
        span: [1e-6, 1.0],
        exact: |t| [vec![t.powf(2.0 / 3.0)], vec![2.0 / 3.0 * t.powf(-1.0 / 3.0)]],
        residual: |_, y, v, r| r[0] = y[0] * v[0] * v[0] - 4.0 / 9.0,
    },
    Case {
        name: "parabola",
        span: [1e-3, 2.0],
        exact: |t| [vec![t * t], vec![2.0 * t]],
        residual: |_, y, v, r| r[0] = v[0] * v[0] - 4.0 * y[0],
    },
    Case {
        name: "parabola with an algebraic variable",
        span: [1e-2, 2.0],
        exact: |t| [vec![t * t, 4.0 * t * t], vec![2.0 * t, 8.0 * t]],
        residual: |_, y, v, r| {
            r[0] = v[0] * v[0] - y[1];
            r[1] = y[1] - 4.0 * y[0];
        },
    },
    Case {
        name: "catenary",
        span: [0.1, 3.0],
        exact: |t| [vec![t.cosh()], vec![t.sinh()]],
        residual: |_, y, v, r| r[0] = y[0] * y[0] - v[0] * v[0] - 1.0,
    },
    Case {
        name: "straight line beside its envelope",
        span: [0.0, 5.0],
        exact: |t| [vec![t + 1.0], vec![1.0]],
        residual: |t, y, v, r| r[0] = v[0] * v[0] + t * v[0] - y[0],
    },
    Case {
        name: "circle at unit speed",
        span: [0.0, 6.0],
        exact: |t| [vec![t.cos(), t.sin()], vec![-t.sin(), t.cos()]],
        residual: |_, y, v, r| {
            r[0] = v[0] * v[0] + v[1] * v[1] - 1.0;
            r[1] = y[0] * v[0] + y[1] * v[1];
        },
    },
    Case {
        name: "cubic in the slope",
        span: [0.0, 2.0],
        exact: |t| [vec![t.exp()], vec![t.exp()]],
        residual: |_, y, v, r| r[0] = v[0].powi(3) + v[0] - y[0].powi(3) - y[0],
    },
    Case {
        name: "exponential in the slope",
        span: [0.0, 2.0],
        exact: |t| [vec![t.exp()], vec![t.exp()]],
        residual: |_, y, v, r| r[0] = v[0].exp() + v[0] - y[0].exp() - y[0],
    },
    Case {
        name: "sine of the slope",
        span: [0.0, 10.0],
        exact: |t| [vec![t.sin()], vec![t.cos()]],
        residual: |t, y, v, r| r[0] = v[0].sin() - t.cos().sin() + y[0] - t.sin(),
    },
    Case {
        name: "quadratic drag",
        span: [0.0, 1.5],
        exact: |t| [vec![t.sin()], vec![t.cos()]],
        residual: |t, y, v, r| {
            r[0] = v[0] * v[0].abs() + y[0] - t.cos() * t.cos().abs() - t.sin();
        },
    },
    Case {
        name: "bounded momentum",
        span: [0.0, 10.0],
        exact: |t| [vec![t.sin()], vec![t.cos()]],
        residual: |t, y, v, r| {
            r[0] = v[0] / v[0].hypot(1.0) - t.cos() / t.cos().hypot(1.0) + y[0] - t.sin();
        },
    },
    Case {
        name: "stiff and cubic in the slope",
        span: [0.5, 2.5],
        exact: |t| [vec![t.cos()], vec![-t.sin()]],
        residual: |t, y, v, r| r[0] = v[0].powi(3) + t.sin().powi(3) + 1e3 * (y[0] - t.cos()),
    },
    Case {
        name: "stiff arc tangent",
        span: [0.0, 10.0],
        exact: |t| [vec![t.sin()], vec![t.cos()]],
        residual: |t, y, v, r| r[0] = v[0].atan() - (t.cos() - 100.0 * (y[0] - t.sin())).atan(),
    },
    Case {
        name: "product of slope and exponential",
        span: [0.2, 3.0],
        exact: |t| [vec![(-t).exp()], vec![-(-t).exp()]],
        residual: |_, y, v, r| r[0] = v[0] * v[0].exp() + y[0] * (-y[0]).exp(),
    },
    Case {
        name: "outflow",
        span: [0.0, 0.99],
        exact: |t| [vec![(1.0 - t).powi(2), 1.0 - t], vec![2.0 * t - 2.0, -1.0]],
        residual: |_, y, v, r| {
            r[0] = v[0] + 2.0 * y[1];
            r[1] = y[1] * y[1] - y[0];
        },
    },
    Case {
        name: "slope under a square root",
        span: [0.0, 3.0],
        exact: |t| [vec![t.exp()], vec![t.exp()]],
        residual: |_, y, v, r| r[0] = v[0].abs().sqrt() - y[0].abs().sqrt(),
    },
];

/// Returns the error at the end, relative to 1 + |y|, or `None` if the integration has stopped.
fn error(case: &Case, stages: usize, tolerance: f64) -> Option<f64> {
    let [start, end] = case.span;
    let [y, v] = (case.exact)(start);
    let problem = Implicit { n: y.len(), residual: case.residual };
    let options = RadauOptions {
        stages,
        tolerances: Tolerances::scalar(tolerance, tolerance),
        max_steps: Some(20_000),
        ..RadauOptions::default()
    };
    let builder = radau(problem).options(options);
    let mut solver = builder.build(start, &y, &v).unwrap();
    match solver.integrate_to(end).unwrap() {
        Outcome::Stopped(_) => None,
        _ => {
            let [exact, _] = (case.exact)(end);
            let errors = solver.y().iter().zip(&exact);
            let errors = errors.map(|(y, exact)| (y - exact).abs() / (1.0 + exact.abs()));
            Some(errors.fold(0.0, f64::max))
        }
    }
}

/// Checks that successful runs are accurate. If the initial value of a square root is below the tolerance, both of its
/// branches satisfy the equations, so a run may stop. At small tolerances, every run must succeed.
#[test]
fn successful_runs_are_accurate() {
    let mut wrong = Vec::new();
    for case in &CASES {
        for stages in [3, 5, 7] {
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10] {
                let error = error(case, stages, tolerance);
                let kept = error.map_or(tolerance >= 1e-6, |error| error < PROMISED * tolerance);
                if !kept {
                    let name = case.name;
                    wrong.push(format!("{name}, {stages} stages, {tolerance:e}: {error:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
