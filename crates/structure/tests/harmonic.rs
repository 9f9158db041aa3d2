//! Harmonic response of an index-3 system: three masses with a lever, closed form.

use std::f64::consts::TAU;

use myovib_dae::{Problem, StepError};
use myovib_structure::{Index, Pencil, PencilStructure, harmonic_response};
use num_complex::Complex64;

const MASSES: [f64; 3] = [2.0, 1.0, 0.5];
const STIFFNESSES: [f64; 3] = [800.0, 300.0, 400.0];
const DAMPINGS: [f64; 3] = [2.0, 1.0, 0.4];
const LEVER: f64 = 2.0;

/// m ẍ + c ẋ + k x + Gᵀ λ = 0 with a spring between the second and the third mass, and
/// x_1 − r x_2 = 0; y = (x, v, λ).
struct Masses;

/// Force of grounded springs on the first two masses and of a spring between the last two.
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

    /// The system is linear, so its columns are residuals of unit vectors.
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

#[test]
fn index_3_system_has_the_closed_form() {
    let rest = [0.0; 7];
    let pencil = Pencil::linearize(&mut Masses, 0.0, &rest, &rest).expect("a linear system");
    assert_eq!(PencilStructure::of(&pencil).index, Index::Decided(3));
    // A force of 1 on the first mass (row 3), and a motion of the constraint by 0.01 (row 6): x_1,
    // x_3 and λ.
    let cases = [
        (
            3,
            1.0,
            0.5,
            [
                (0.001174256140321308, -9.74744978381779e-6),
                (0.0005944616826715761, -4.957930126341524e-6),
                (0.08371272985073218, 0.0002274839527504473),
            ],
        ),
        (
            3,
            1.0,
            3.0,
            [
                (-0.002236859631125397, -0.02270837136857597),
                (-0.002318291430834591, -0.02038536642327797),
                (0.3438640573840803, 2.114194492209272),
            ],
        ),
        (
            6,
            0.01,
            3.0,
            [
                (0.003438640573840803, 0.02114194492209272),
                (-0.005612816543172439, 0.01909614510390006),
                (0.4896576813022569, -2.019480082406935),
            ],
        ),
        (
            6,
            0.01,
            10.0,
            [
                (0.0009983082292021699, -1.330625426221416e-5),
                (0.001142283540337008, 9.180166820687248e-5),
                (7.082007137474754, -0.2198680810481099),
            ],
        ),
    ];
    for (row, size, frequency, expected) in cases {
        let s = Complex64::new(0.0, TAU * frequency);
        let mut amplitudes = [Complex64::ZERO; 7];
        amplitudes[row] = size.into();
        let solved = harmonic_response(&mut Masses, (0.0, &rest), s, &mut amplitudes);
        solved.expect("a regular matrix");
        for (unknown, (re, im)) in [0, 2, 6].into_iter().zip(expected) {
            let expected = Complex64::new(re, im);
            // A few rounding errors times the condition near a resonance, about 100.
            let error = (amplitudes[unknown] - expected).norm() / expected.norm();
            assert!(error < 1e-12, "{frequency} Hz, unknown {unknown}: {error:e}");
        }
    }
}
