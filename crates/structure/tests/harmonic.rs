//! Harmonic response of an index-3 system, three masses with a lever, compared with the closed form.

use std::f64::consts::TAU;

use myovib_dae::{Problem, StepError};
use myovib_structure::{Index, Pencil, PencilStructure, harmonic_response};
use num_complex::Complex64;

const MASSES: [f64; 3] = [2.0, 1.0, 0.5];
const STIFFNESSES: [f64; 3] = [800.0, 300.0, 400.0];
const DAMPINGS: [f64; 3] = [2.0, 1.0, 0.4];
const LEVER: f64 = 2.0;

/// The system m ẍ + c ẋ + k x + Gᵀ λ = 0 with x_1 − r x_2 = 0 and a spring between the second and the third mass.
/// The unknowns are y = (x, v, λ).
struct Masses;

/// Returns the forces of grounded springs on the first two masses and of a spring between the last two masses.
fn coupled(k: [f64; 3], x: &[f64]) -> [f64; 3] {
    let between = k[2] * (x[1] - x[2]);
    [k[0] * x[0], k[1] * x[1] + between, -between]
}

impl Problem for Masses {
    fn n_unknowns(&self) -> usize {
        7
    }

    fn residual(
        &mut self,
        _: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let (x, v, multiplier) = (&y[..3], &y[3..6], y[6]);
        let elastic = coupled(STIFFNESSES, x);
        let viscous = coupled(DAMPINGS, v);
        let reaction = [multiplier, -LEVER * multiplier, 0.0];
        for i in 0..3 {
            residual[i] = y_dot[i] - v[i];
            residual[3 + i] = MASSES[i] * y_dot[3 + i] + viscous[i] + elastic[i] + reaction[i];
        }
        residual[6] = x[0] - LEVER * x[1];
        Ok(())
    }

    /// Returns the Jacobian. The system is linear, so the columns are residuals of unit vectors.
    fn jacobian(
        &mut self,
        t: f64,
        _: &[f64],
        _: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        for (j, column) in values.chunks_mut(7).enumerate() {
            let unit = |size: f64| -> Vec<f64> {
                (0..7).map(|i| if i == j { size } else { 0.0 }).collect()
            };
            self.residual(t, &unit(a), &unit(b), column)?;
        }
        Ok(())
    }
}

/// Returns x₁, x₂, x₃ and λ in closed form for a force on the first mass and a prescribed motion of the
/// constraint.
fn closed_form(s: Complex64, force: f64, motion: f64) -> [Complex64; 4] {
    let of = |i: usize| STIFFNESSES[i] + s * DAMPINGS[i];
    let (d, m3) = (of(2), MASSES[2] * s * s);
    let z1 = MASSES[0] * s * s + of(0);
    let z2 = MASSES[1] * s * s + of(1) + d - d * d / (m3 + d);
    // z₁ x₁ + λ = F and z₂ x₂ = r λ with x₁ = r x₂ + a.
    let x2 = LEVER * (force - z1 * motion) / (LEVER * LEVER * z1 + z2);
    [LEVER * x2 + motion, x2, d * x2 / (m3 + d), z2 * x2 / LEVER]
}

/// Pairs of a force on the first mass and a motion of the constraint.
const DRIVES: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 0.01]];

fn iomega(frequency: f64) -> Complex64 {
    Complex64::new(0.0, TAU * frequency)
}

fn pencil() -> Pencil {
    let rest = [0.0; 7];
    Pencil::linearize(&mut Masses, 0.0, &rest, &rest).expect("a linear system")
}

#[test]
fn index_3_system_has_the_closed_form() {
    assert_eq!(PencilStructure::of(&pencil()).index, Index::Decided(3));
    for [force, motion] in DRIVES {
        for frequency in [0.0, 0.5, 2.0, 3.0, 4.0, 5.0, 10.0] {
            let s = iomega(frequency);
            let mut found = [Complex64::ZERO; 7];
            (found[3], found[6]) = (force.into(), motion.into());
            let solved = harmonic_response(&mut Masses, (0.0, &[0.0; 7]), s, &mut found);
            solved.expect("a regular matrix");
            let [x1, x2, x3, lambda] = closed_form(s, force, motion);
            let expected = [x1, x2, x3, s * x1, s * x2, s * x3, lambda];
            for (unknown, (found, expected)) in found.into_iter().zip(expected).enumerate() {
                // The error is a few rounding errors times the condition number near a resonance, which is
                // about 100.
                let error = (found - expected).norm();
                assert!(error <= 1e-12 * expected.norm(), "{frequency} Hz, {unknown}: {error:e}");
            }
        }
    }
}

/// Compares the closed form with an independent computation in 40 digits: the amplitudes of x₁, x₃ and λ, the
/// first peak of x₃, and the half-power frequencies of this peak.
#[test]
fn the_closed_form_has_published_digits() {
    let published = [
        (0, 0.5, [0.00117429659621, 0.00059448235738, 0.0837130389367]),
        (0, 3.0, [0.0228182749397, 0.0205167648368, 2.14197591976]),
        (1, 3.0, [0.0214197591976, 0.0199039309529, 2.07799529549]),
        (1, 10.0, [0.000998396903488, 0.00114596650597, 7.08541932904]),
    ];
    for (drive, frequency, expected) in published {
        let [force, motion] = DRIVES[drive];
        let [x1, _, x3, lambda] = closed_form(iomega(frequency), force, motion);
        for (found, expected) in [x1, x3, lambda].into_iter().zip(expected) {
            // The tolerance is half a unit of the twelfth digit, for values that begin with the digit 1.
            assert!((found.norm() / expected - 1.0).abs() < 5e-12, "{frequency} Hz: {found}");
        }
    }
    // The half-power frequencies have 12 digits. Near these frequencies, the relative change of the amplitude is
    // 20 times the relative change of the frequency.
    let amplitude = |frequency: f64| closed_form(iomega(frequency), 1.0, 0.0)[2].norm();
    for (frequency, part) in
        [(2.993780705613, 1.0), (2.925530891412, 0.5_f64.sqrt()), (3.064778283868, 0.5_f64.sqrt())]
    {
        let error = amplitude(frequency) / (part * 0.0205984152348) - 1.0;
        assert!(error.abs() < 1e-11, "{frequency} Hz: {error:e}");
    }
}

/// Checks the eigenvalues s of E ẏ + A y = 0. For each s, the matrix −A⁻¹ E has the eigenvalue 1/s.
#[test]
fn index_3_system_has_the_published_modes() {
    let inverse = pencil().a().clone().try_inverse().expect("a held system");
    let values = (-inverse * pencil().e()).complex_eigenvalues();
    for (re, im) in [(-0.4361509494365, 18.801945534741), (-0.4860712727857, 29.653763382083)] {
        let published = Complex64::new(re, im);
        // The reference values have 13 decimals. The eigenvalues of simple modes have rounding errors times the
        // condition number, which is about 100.
        let error = |value: &Complex64| (value.inv() - published).norm() / published.norm();
        assert!(values.iter().any(|value| error(value) < 1e-12), "{values} {published}");
    }
}
