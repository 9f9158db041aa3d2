//! Small nonlinear DAEs of known index. Each is given as a `Problem` and linearized on its solution.
//!
//! A: Brenan, Campbell, Petzold, chapter 4 (index 1, linear with varying coefficients). B: Jay, BIT 33 (1993),
//! example 7 (index 2). C: the pendulum in Cartesian coordinates (index 3), and the pendulum with its constraint
//! differentiated once and twice.

use myovib_dae::{Problem, StepError};
use myovib_structure::{Index, Pencil, PencilStructure, StructureError};
use nalgebra::DMatrix;

/// A dense system, given by its residual. The residual is a polynomial of degree at most four in y and ẏ.
struct Dense<F> {
    n: usize,
    residual: F,
}

impl<F: Fn(f64, &[f64], &[f64]) -> Vec<f64>> Problem for Dense<F> {
    fn n_unknowns(&self) -> usize {
        self.n
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r.copy_from_slice(&(self.residual)(t, y, yp));
        Ok(())
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        // These extrapolated central differences with steps 1 and 1/2 are exact up to degree four.
        let slope = |j: usize, h: f64| {
            let moved = |sign: f64| {
                let (mut y, mut yp) = (y.to_vec(), yp.to_vec());
                y[j] += sign * a * h;
                yp[j] += sign * b * h;
                (self.residual)(t, &y, &yp)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * h)).collect::<Vec<_>>()
        };
        for j in 0..self.n {
            for (i, (coarse, fine)) in slope(j, 1.0).iter().zip(&slope(j, 0.5)).enumerate() {
                values[j * self.n + i] = (4.0 * fine - coarse) / 3.0;
            }
        }
        Ok(())
    }
}

/// Returns the index and the variable indices at a state. Asserts that a change of units gives the same result.
fn index_of(
    n: usize,
    residual: impl Fn(f64, &[f64], &[f64]) -> Vec<f64>,
    t: f64,
    y: &[f64],
    yp: &[f64],
) -> (Index, Vec<u8>) {
    let worst = residual(t, y, yp).iter().fold(0.0, |worst: f64, r| worst.max(r.abs()));
    assert!(worst < 1e-13, "the state is not on the solution: {worst:.1e}");
    let pencil = Pencil::linearize(&mut Dense { n, residual }, t, y, yp).expect("finite");
    let answer = |pencil: &Pencil| {
        let found = PencilStructure::of(pencil);
        (found.index, found.variables.iter().map(|v| v.index).collect::<Vec<_>>())
    };
    let plain = answer(&pencil);
    let units = |k: i32| {
        DMatrix::from_fn(n, n, |i, j| if i == j { 10f64.powi(k - 3 * i as i32) } else { 0.0 })
    };
    let other = Pencil::new(units(6) * pencil.e() * units(-1), units(6) * pencil.a() * units(-1));
    assert_eq!(plain, answer(&other.expect("finite")));
    plain
}

#[test]
fn a_linear_index_1() {
    let f = |t: f64, y: &[f64], yp: &[f64]| {
        vec![yp[0] - t * yp[1] + y[0] - (1.0 + t) * y[1], y[1] - t.sin()]
    };
    for t in [0.0f64, 1.0, 7.0] {
        let y = [(-t).exp() + t * t.sin(), t.sin()];
        let yp = [-(-t).exp() + t.sin() + t * t.cos(), t.cos()];
        // For t ≠ 0, the derivative of y2 occurs in the equations, so y1 contains the perturbation of y2 = sin t.
        let expected = if t == 0.0 { [0, 1] } else { [1, 1] };
        assert_eq!(index_of(2, f, t, &y, &yp), (Index::Decided(1), expected.to_vec()));
    }
}

#[test]
fn b_jay_index_2() {
    let f = |_: f64, y: &[f64], yp: &[f64]| {
        let (y1, y2, z) = (y[0], y[1], y[2]);
        vec![yp[0] - y1 * y2 * z, yp[1] - y1 * y1 * y2 * y2 + 3.0 * y2 * y2 * z, y1 * y1 * y2 - 1.0]
    };
    for t in [0.0f64, 0.4] {
        let (y1, y2, z) = (t.exp(), (-2.0 * t).exp(), (2.0 * t).exp());
        let found = index_of(3, f, t, &[y1, y2, z], &[y1, -2.0 * y2, 2.0 * z]);
        assert_eq!(found, (Index::Decided(2), vec![1, 1, 2]));
    }
}

const G: f64 = 9.81;

/// Returns the state (x, y, u, v, λ) of the pendulum at the angle θ with the angular velocity ω, and its
/// derivative. The multiplier is λ = ω² + g cos θ.
fn pendulum(theta: f64, omega: f64) -> ([f64; 5], [f64; 5]) {
    let (x, y) = (theta.sin(), -theta.cos());
    let (u, v) = (-omega * y, omega * x);
    let lambda = omega * omega - G * y;
    let lambda_dot = -3.0 * G * v;
    ([x, y, u, v, lambda], [u, v, -lambda * x, -lambda * y - G, lambda_dot])
}

fn pendulum_with(constraint: impl Fn(&[f64]) -> f64) -> impl Fn(f64, &[f64], &[f64]) -> Vec<f64> {
    move |_, y, yp| {
        vec![
            yp[0] - y[2],
            yp[1] - y[3],
            yp[2] + y[4] * y[0],
            yp[3] + y[4] * y[1] + G,
            constraint(y),
        ]
    }
}

#[test]
fn c_pendulum_index_3_2_1() {
    for (theta, omega) in [(0.3, 1.0), (1.2, -2.0), (2.5, 0.7)] {
        let (y, yp) = pendulum(theta, omega);
        let place = pendulum_with(|y| y[0] * y[0] + y[1] * y[1] - 1.0);
        assert_eq!(index_of(5, place, 0.0, &y, &yp), (Index::Decided(3), vec![1, 1, 2, 2, 3]));
        // With the constraint differentiated once, x and y contain the perturbation of the velocity constraint as
        // an integral.
        let velocity = pendulum_with(|y| y[0] * y[2] + y[1] * y[3]);
        assert_eq!(index_of(5, velocity, 0.0, &y, &yp), (Index::Decided(2), vec![0, 0, 1, 1, 2]));
        let force = pendulum_with(|y| y[2] * y[2] + y[3] * y[3] - y[4] - G * y[1]);
        assert_eq!(index_of(5, force, 0.0, &y, &yp), (Index::Decided(1), vec![0, 0, 0, 0, 1]));
    }
}

#[test]
fn a_state_outside_the_domain_is_an_error() {
    let mut broken = Dense { n: 1, residual: |_: f64, _: &[f64], _: &[f64]| vec![f64::NAN] };
    let error = Pencil::linearize(&mut broken, 0.0, &[0.0], &[0.0]).unwrap_err();
    assert!(matches!(error, StructureError::NotFinite { matrix: "E", row: 0, column: 0, .. }));
}
