//! Harmonic motions of three masses with a lever, of index 3: periodic states and multipliers have a closed form.

use std::f64::consts::TAU;

use myovib_dae::{Problem, StepError, Tolerances, VariableKind};
use myovib_model::periodic::{Interval, PeriodMap, Shooting, multipliers, shoot};
use myovib_model::start::Consistent;
use myovib_model::{Integrator, ModelError, RadauIntegrator};
use myovib_radau::{RadauOptions, SparseDirectSolver};
use num_complex::Complex64;

const MASS: [f64; 3] = [2.0, 1.0, 0.5];
const DAMPING: [f64; 3] = [2.0, 1.0, 0.4];
const STIFFNESS: [f64; 3] = [800.0, 300.0, 400.0];
/// Ratio of the lever.
const LEVER: f64 = 2.0;
/// Relative tolerance of the integrator.
const RTOL: f64 = 1e-13;
/// Error of the map, about a hundred times the tolerance.
const MAP_ERROR: f64 = 1e-11;
/// Tolerance of the difference of both ends of a period.
const TOLERANCE: f64 = 1e-9;

/// Unknowns (x₁, x₂, x₃, v₁, v₂, v₃, λ), with x₁ − r x₂ = a cos ωt and the force F cos ωt on the first mass.
#[derive(Clone, Copy)]
struct Masses {
    omega: f64,
    force: f64,
    motion: f64,
}

impl Masses {
    fn cosine(&self, t: f64) -> f64 {
        (self.omega * t).cos()
    }

    /// Returns the forces of springs and dampers against the motion.
    fn resistance(x: &[f64], v: &[f64]) -> [f64; 3] {
        let of = |i: usize, x: f64, v: f64| STIFFNESS[i] * x + DAMPING[i] * v;
        let between = of(2, x[1] - x[2], v[1] - v[2]);
        [of(0, x[0], v[0]), of(1, x[1], v[1]) + between, -between]
    }

    /// Returns the closed form of (x₁, x₂, x₃, λ).
    fn amplitudes(&self) -> [Complex64; 4] {
        let s = Complex64::new(0.0, self.omega);
        let of = |i: usize| STIFFNESS[i] + s * DAMPING[i];
        let (d, m3) = (of(2), MASS[2] * s * s);
        let z1 = MASS[0] * s * s + of(0);
        let z2 = MASS[1] * s * s + of(1) + d - d * d / (m3 + d);
        let (r, a) = (LEVER, self.motion);
        // r (z₁ x₁ + λ) = r F and z₂ x₂ = r λ with x₁ = r x₂ + a.
        let x2 = (r * self.force - r * z1 * a) / (r * r * z1 + z2);
        [r * x2 + a, x2, d * x2 / (m3 + d), z2 * x2 / r]
    }
}

impl Problem for Masses {
    fn n_unknowns(&self) -> usize {
        7
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let (x, v) = y[..6].split_at(3);
        let resistance = Self::resistance(x, v);
        let driving = [self.force * self.cosine(t) - y[6], LEVER * y[6], 0.0];
        for i in 0..3 {
            r[i] = yp[i] - v[i];
            r[3 + i] = MASS[i] * yp[3 + i] + resistance[i] - driving[i];
        }
        r[6] = x[0] - LEVER * x[1] - self.motion * self.cosine(t);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; 7];
        kinds[6] = VariableKind::Algebraic;
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1, 1, 1, 2, 2, 2, 3])
    }
}

impl Consistent for Masses {
    /// Moves the first mass onto the constraint.
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        let (sine, cosine) = (self.omega * t).sin_cos();
        let motion = [cosine, -self.omega * sine, -self.omega.powi(2) * cosine];
        let [a, a_dot, a_ddot] = motion.map(|part| self.motion * part);
        let x = [LEVER * y[1] + a, y[1], y[2]];
        let v = [LEVER * y[4] + a_dot, y[4], y[5]];
        let [r1, r2, r3] = Self::resistance(&x, &v);
        let push = self.force * cosine - r1 - MASS[0] * a_ddot;
        let second = (LEVER * push - r2) / (LEVER.powi(2) * MASS[0] + MASS[1]);
        let first = LEVER * second + a_ddot;
        let lambda = self.force * cosine - r1 - MASS[0] * first;
        let acceleration = [first, second, -r3 / MASS[2]];
        Ok([[&x[..], &v, &[lambda]].concat(), [&v[..], &acceleration, &[0.0]].concat()])
    }
}

fn start(
    dae: Masses,
    interval: Interval,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<Masses>>, ModelError> {
    let options = RadauOptions {
        stages: 7,
        // Displacements of 1e-4 m have the same number of digits as velocities.
        tolerances: Tolerances::scalar(RTOL, 1e-4 * RTOL),
        ..RadauOptions::default()
    };
    let matrices = SparseDirectSolver::new(&dae.jacobian_pattern(), options.sparse)?;
    let integrator = RadauIntegrator::new(dae, matrices, options, interval.times.into(), y, y_dot)?;
    Ok(Box::new(integrator))
}

fn assert_close(found: f64, expected: Complex64, bound: f64) {
    assert!((found - expected.re).abs() < bound, "{found} {expected}");
}

/// Checks the response to a force and to a prescribed motion at frequencies below, at and above the resonances of 2.99
/// and 4.72 Hz, and the multipliers e^(sT) of both modes.
#[test]
fn constrained_masses_respond_as_the_closed_form() {
    let modes = [
        Complex64::new(-0.4361509494365, 18.801945534741),
        Complex64::new(-0.4860712727857, 29.653763382083),
    ];
    for (force, motion) in [(1.0, 0.0), (0.0, 0.01)] {
        for frequency in [0.5, 2.0, 3.0, 4.0, 5.0, 10.0] {
            let dae = Masses { omega: TAU * frequency, force, motion };
            let period = 1.0 / frequency;
            let mut map = PeriodMap::new(dae, start, [0.0, period], &[0.0; 7]).unwrap();
            let s = Complex64::new(0.0, dae.omega);
            let [x1, x2, x3, lambda] = dae.amplitudes();
            let size = x1.norm().max(x2.norm()).max(x3.norm());
            let shooting = Shooting {
                tolerance: TOLERANCE,
                map_error: MAP_ERROR,
                ..Shooting::new([[size; 3], [dae.omega * size; 3]].concat())
            };
            let mut evaluate = |state: &[f64]| map.map(state);
            let found = shoot(&mut evaluate, &[0.0; 6], &shooting).unwrap();
            let leading = multipliers(&mut evaluate, &found.state, &shooting, 4).unwrap();
            let mut expected = modes.map(|s| (s * period).exp());
            // A difference d of both ends of a period moves the periodic state by d/|1 − e^(sT)|.
            let nearest =
                expected.map(|z| (1.0 - z).norm()).into_iter().fold(f64::INFINITY, f64::min);
            let error = (TOLERANCE + MAP_ERROR) / nearest;
            expected.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
            for (pair, expected) in leading.values.chunks(2).zip(expected) {
                let distance = |z: &Complex64| (z - expected).norm();
                // Each of the six rows of the matrix has the error of the differences.
                let bound = 6.0 * leading.resolution;
                assert!(pair.iter().any(|z| distance(z) < bound), "{pair:?} {expected}");
            }
            let [y, _] = map.consistent(&found.state).unwrap();
            for (i, x) in [x1, x2, x3].into_iter().enumerate() {
                assert_close(y[i], x, error * size);
                assert_close(y[3 + i], s * x, error * dae.omega * size);
            }
            // λ = (F − r₁ + 4 r₂)/9 with the resistances r of the first two masses.
            let of = |constants: [f64; 3]| constants.iter().sum::<f64>() + constants[2];
            let resistance = (of(STIFFNESS) + of(DAMPING) * dae.omega) * size;
            assert_close(y[6], lambda, error * resistance);
        }
    }
}

/// Compares the closed form with values of an independent computation with 40 digits.
#[test]
fn the_closed_form_has_published_digits() {
    for (force, motion, frequency, expected) in [
        (1.0, 0.0, 3.0, (0.0205167648368, -96.487992033, 2.14197591976, 80.761996182)),
        (0.0, 0.01, 5.0, (0.02954991203, 17.090506812, 4.97473375542, -157.130554707)),
    ] {
        let omega = TAU * frequency;
        let dae = Masses { omega, force, motion };
        let [_, _, x3, lambda] = dae.amplitudes();
        for (found, (amplitude, degrees)) in
            [(x3, (expected.0, expected.1)), (lambda, (expected.2, expected.3))]
        {
            // Half a unit of the eleventh decimal of amplitudes and of the ninth decimal of phases.
            assert!((found.norm() - amplitude).abs() < 0.5e-11);
            assert!((found.arg().to_degrees() - degrees).abs() < 0.5e-9);
        }
    }
}
