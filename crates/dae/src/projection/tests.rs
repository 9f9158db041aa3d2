use super::*;

/// A pendulum of length 1 and mass m, of index 3.
struct Pendulum {
    m: f64,
    /// Factor of the constraint equation, which represents its unit.
    unit: f64,
}

const G: f64 = 9.81;

impl Problem for Pendulum {
    fn n_unknowns(&self) -> usize {
        5
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let m = self.m;
        r[0] = v[0] - y[2];
        r[1] = v[1] - y[3];
        r[2] = m * v[2] + y[4] * y[0];
        r[3] = m * v[3] + y[4] * y[1] + m * G;
        r[4] = self.unit * (y[0] * y[0] + y[1] * y[1] - 1.0);
        Ok(())
    }

    fn n_constraints(&self) -> usize {
        2
    }

    fn constraints(&mut self, _: f64, y: &[f64], c: &mut [f64]) -> Result<(), StepError> {
        c[0] = self.unit * (y[0] * y[0] + y[1] * y[1] - 1.0);
        c[1] = y[0] * y[2] + y[1] * y[3];
        Ok(())
    }
}

fn kinds() -> [VariableKind; 5] {
    let mut kinds = [VariableKind::Differential; 5];
    kinds[4] = VariableKind::Algebraic;
    kinds
}

/// Regression test: for masses below 1e-8, the constraints were rejected, and below 1e-9, the acceleration was wrong.
#[test]
fn the_unit_of_mass_does_not_matter() {
    for m in (-12..=12).map(|exponent| 10_f64.powi(exponent)) {
        for unit in [1e-12, 1.0, 1e12] {
            let (s, c) = 0.7_f64.sin_cos();
            let mut y = [s, -c, 0.5 * c, 0.5 * s, 0.0];
            let mut v = [0.0; 5];
            let weights = [1e6, 1e6, 1e6, 1e6, 1e6 / m];
            let mut problem = Pendulum { m, unit };
            let times = (0.0, 1.0);
            project_onto_constraints(
                &mut problem,
                &kinds(),
                times,
                &mut y,
                &mut v,
                &weights,
                &weights,
            )
            .unwrap();
            let acceleration = v[2] * c + v[3] * s;
            let multiplier = m * (y[2] * y[2] + y[3] * y[3] - G * y[1]);
            // Central differences have relative errors of 1e-10 to 1e-9.
            assert!((acceleration + G * s).abs() < 1e-7, "{m:e}: {acceleration}");
            assert!((y[4] - multiplier).abs() < 1e-7 * multiplier, "{m:e}: {y:?}");
        }
    }
}

/// Checks that a constraint that contradicts the equations is detected in any unit.
#[test]
fn contradictions_are_found_in_any_unit() {
    /// The equation ẋ = 0 multiplied by a factor, with the constraint x = t.
    struct Moved(f64);
    impl Problem for Moved {
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
            r[0] = self.0 * v[0];
            r[1] = v[1] - y[1];
            Ok(())
        }

        fn n_constraints(&self) -> usize {
            1
        }

        fn constraints(&mut self, t: f64, y: &[f64], c: &mut [f64]) -> Result<(), StepError> {
            c[0] = y[0] - t;
            Ok(())
        }
    }
    for unit in [1e-12, 1.0, 1e12] {
        let kinds = [VariableKind::Differential; 2];
        let found = project_onto_constraints(
            &mut Moved(unit),
            &kinds,
            (0.0, 1.0),
            &mut [0.0, 1.0],
            &mut [0.0; 2],
            &[1e6; 2],
            &[1e6; 2],
        );
        assert!(matches!(found, Err(Inconsistent::Contradicted { .. })), "{unit:e}: {found:?}");
    }
}
