//! Estimates a parameter of a differential-algebraic equation of index 3 from the final state. The parameter is the
//! gravity of a pendulum in Cartesian coordinates. Radau IIA integrates the pendulum with forward sensitivities.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_conformance::samples::{MechanicalForm, ParametricSample, Pendulum};
use myovib_dae::{Differenced, Outcome, Parameter as Varied, Tolerances};
use myovib_fit::{Failed, Model, Options, Parameter, fit};
use myovib_radau::{ForwardSensitivities, RadauOptions, RadauSolver};
use nalgebra::DMatrix;

/// Length of the pendulum; it is released at rest at (0.4, −0.3), and its position is measured at t = 2.
const LENGTH: f64 = 0.5;
const START: [f64; 2] = [0.4, -0.3];
const MEASURED: [f64; 2] = [-0.231625, -0.443109];

struct Gravity;

impl Gravity {
    /// Returns the position at t = 2 and its derivative with respect to g.
    fn run(g: f64) -> Result<[[f64; 2]; 2], Failed> {
        let [x, y] = START;
        // At rest, the acceleration is tangential to the circle, so λ = −g y/ℓ².
        let of_g = -y / (LENGTH * LENGTH);
        let lambda = of_g * g;
        let start = [x, y, 0.0, 0.0, lambda];
        let slope = [0.0, 0.0, -lambda * x, -lambda * y - g, 0.0];
        let pendulum = Pendulum::new(MechanicalForm::Index3).with(LENGTH, g);
        let failed = |error: myovib_radau::RadauError| Failed(error.to_string());
        let mut solver = RadauSolver::builder(pendulum)
            .options(RadauOptions {
                stages: 5,
                tolerances: Tolerances::scalar(1e-10, 1e-10),
                ..RadauOptions::default()
            })
            .build(0.0, &start, &slope)
            .map_err(failed)?;
        let set = |pendulum: &mut Pendulum, _: usize, g: f64| pendulum.set(1, g);
        let parameters = Differenced::new(vec![Varied::new("g", g)], move |_, _| g, set);
        let of_start = vec![vec![0.0, 0.0, 0.0, 0.0, of_g]];
        let mut sensitivities =
            ForwardSensitivities::new(&solver, parameters, of_start).map_err(failed)?;
        match sensitivities.integrate_to(&mut solver, 2.0).map_err(failed)? {
            Outcome::Reached { .. } => {
                let (y, s) = (solver.y(), sensitivities.of(0));
                Ok([[y[0], y[1]], [s[0], s[1]]])
            }
            other => Err(Failed(format!("{other:?}"))),
        }
    }
}

impl Model for Gravity {
    fn n_residuals(&self) -> usize {
        2
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        let [position, _] = Self::run(p[0])?;
        for (k, out) in out.iter_mut().enumerate() {
            *out = position[k] - MEASURED[k];
        }
        Ok(())
    }

    fn jacobian(&mut self, p: &[f64], _: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        let [_, slope] = Self::run(p[0])?;
        out.column_mut(0).copy_from_slice(&slope);
        Ok(())
    }
}

/// Checks the reference value g = 9.8265 for this final position. The position is given to six decimals (error 5e-7),
/// and dx/dg is about 0.1, so the position determines g to about 1e-5. The source gives g to four decimals.
#[test]
fn gravity_is_found_from_the_end_of_a_swing() {
    let start = [Parameter::new("g", 9.5).within(8.0, 12.0)];
    let fitted = fit(&mut Gravity, &start, &Options::default()).unwrap();
    assert!(fitted.is_converged(), "{:?}", fitted.ended);
    let g = fitted.values[0];
    println!("g = {g:.7}, residuals {:?}", fitted.residuals);
    assert!((g - 9.8265).abs() < 1e-4, "{g}");
    // The residual that remains is the distance of the measured point from the circle, 4e-6. It does not depend on g.
    let left = fitted.residuals[0].hypot(fitted.residuals[1]);
    let off = (MEASURED[0].hypot(MEASURED[1]) - LENGTH).abs();
    assert!((left - off).abs() < 1e-8, "{left:e} {off:e}");
    // Quadratic convergence shows that the derivatives are consistent with the run.
    assert!(fitted.history.len() <= 8, "{}", fitted.history.len());
}
