//! Small published problems with their references, on dense patterns.
#![allow(dead_code, reason = "each test binary uses some of them")]

use nalgebra_sparse::pattern::SparsityPattern;
use sundials_wrap::{DaeProblem, StepError, VariableKind};

pub(crate) type Residual = fn(f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError>;
pub(crate) type Jacobian = fn(f64, &[f64], &[f64], f64, f64, &mut Matrix);

/// A dense n × n matrix stored by columns.
pub(crate) struct Matrix {
    n: usize,
    values: Vec<f64>,
}

impl Matrix {
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.values[column * self.n + row] += value;
    }
}

/// A problem made of functions, with its initial values.
pub(crate) struct Small {
    pub(crate) y0: Vec<f64>,
    pub(crate) y_dot0: Vec<f64>,
    pub(crate) indices: Vec<u8>,
    residual: Residual,
    jacobian: Jacobian,
    matrix: Matrix,
}

impl Small {
    pub(crate) fn new(
        y0: &[f64],
        y_dot0: &[f64],
        indices: &[u8],
        residual: Residual,
        jacobian: Jacobian,
    ) -> Self {
        let n = y0.len();
        Self {
            y0: y0.to_vec(),
            y_dot0: y_dot0.to_vec(),
            indices: indices.to_vec(),
            residual,
            jacobian,
            matrix: Matrix {
                n,
                values: vec![0.0; n * n],
            },
        }
    }
}

impl DaeProblem for Small {
    fn n_unknowns(&self) -> usize {
        self.y0.len()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        (self.residual)(t, y, y_dot, residual)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        let n = self.y0.len();
        let offsets = (0..=n).map(|j| j * n).collect();
        let rows = (0..n).flat_map(|_| 0..n).collect();
        SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
            .expect("the columns of a full matrix are sorted and complete")
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.matrix.values.fill(0.0);
        (self.jacobian)(t, y, y_dot, a, b, &mut self.matrix);
        values.copy_from_slice(&self.matrix.values);
        Ok(())
    }

    fn kinds(&self) -> Vec<VariableKind> {
        self.indices
            .iter()
            .map(|_| VariableKind::Differential)
            .collect()
    }

    fn indices(&self) -> Vec<u8> {
        self.indices.clone()
    }
}

/// S4 A: linear, time-varying, index 1.
pub(crate) fn linear_index_1() -> Small {
    Small::new(
        &[1.0, 0.0],
        &[-1.0, 1.0],
        &[1, 1],
        |t, y, v, r| {
            r[0] = v[0] - t * v[1] + y[0] - (1.0 + t) * y[1];
            r[1] = y[1] - t.sin();
            Ok(())
        },
        |t, _, _, a, b, m| {
            m.add(0, 0, a + b);
            m.add(0, 1, -a * (1.0 + t) - b * t);
            m.add(1, 1, a);
        },
    )
}

pub(crate) fn linear_index_1_exact(t: f64) -> [f64; 2] {
    [(-t).exp() + t * t.sin(), t.sin()]
}

/// S4 B: Jay's nonlinear problem of index 2; exact e^t, e^−2t, e^2t.
pub(crate) fn jay() -> Small {
    Small::new(
        &[1.0, 1.0, 1.0],
        &[1.0, -2.0, 2.0],
        &[1, 1, 2],
        |_, y, v, r| {
            r[0] = v[0] - y[0] * y[1] * y[2];
            r[1] = v[1] - (y[0] * y[1]).powi(2) + 3.0 * y[1] * y[1] * y[2];
            r[2] = y[0] * y[0] * y[1] - 1.0;
            Ok(())
        },
        |_, y, _, a, b, m| {
            m.add(0, 0, b - a * y[1] * y[2]);
            m.add(0, 1, -a * y[0] * y[2]);
            m.add(0, 2, -a * y[0] * y[1]);
            m.add(1, 0, -2.0 * a * y[0] * y[1] * y[1]);
            m.add(1, 1, b - a * (2.0 * y[0] * y[0] * y[1] - 6.0 * y[1] * y[2]));
            m.add(1, 2, 3.0 * a * y[1] * y[1]);
            m.add(2, 0, 2.0 * a * y[0] * y[1]);
            m.add(2, 1, a * y[0] * y[0]);
        },
    )
}

pub(crate) const GRAVITY: f64 = 9.81;

/// S4 C: the pendulum in Cartesian coordinates, index 3.
pub(crate) fn pendulum() -> Small {
    Small::new(
        &[1.0, 0.0, 0.0, 0.0, 0.0],
        &[0.0, 0.0, 0.0, -GRAVITY, 0.0],
        &[1, 1, 2, 2, 3],
        |_, y, d, r| {
            r[0] = d[0] - y[2];
            r[1] = d[1] - y[3];
            r[2] = d[2] + y[4] * y[0];
            r[3] = d[3] + y[4] * y[1] + GRAVITY;
            r[4] = y[0] * y[0] + y[1] * y[1] - 1.0;
            Ok(())
        },
        |_, y, _, a, b, m| {
            for i in 0..4 {
                m.add(i, i, b);
            }
            m.add(0, 2, -a);
            m.add(1, 3, -a);
            m.add(2, 0, a * y[4]);
            m.add(2, 4, a * y[0]);
            m.add(3, 1, a * y[4]);
            m.add(3, 4, a * y[1]);
            m.add(4, 0, 2.0 * a * y[0]);
            m.add(4, 1, 2.0 * a * y[1]);
        },
    )
}

/// S9 B: stiff van der Pol, μ = 1000.
pub(crate) fn van_der_pol() -> Small {
    const MU: f64 = 1000.0;
    Small::new(
        &[2.0, 0.0],
        &[0.0, -2.0],
        &[0, 0],
        |_, y, d, r| {
            r[0] = d[0] - y[1];
            r[1] = d[1] - MU * (1.0 - y[0] * y[0]) * y[1] + y[0];
            Ok(())
        },
        |_, y, _, a, b, m| {
            m.add(0, 0, b);
            m.add(0, 1, -a);
            m.add(1, 0, a * (2.0 * MU * y[0] * y[1] + 1.0));
            m.add(1, 1, b - a * MU * (1.0 - y[0] * y[0]));
        },
    )
}
