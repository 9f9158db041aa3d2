//! Tests of every law in plane strain by identities and central differences.

use super::tensor::{Strain, Symmetric, UPPER, Volumetric};
use super::three::Tangent3;
pub(crate) use super::{Law, Tensor};
use super::{along_x, embed, in_plane as in_plane_of, with_potential};

/// Derivative of a tensor with respect to a tensor. Rows and columns are in the order 00, 01, 10, 11.
pub(crate) type Tangent = [[f64; 4]; 4];

/// Tangents and rates in plane strain.
impl Law {
    /// Returns Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ for `v` = ∇v.
    pub(crate) fn stress_rate(self, h: Tensor, v: Tensor, p: f64, p_rate: f64) -> Tensor {
        let volumetric = Volumetric { p, p_rate, kappa: 0.0 };
        with_potential!(
            self,
            w => Strain::new(&w, h).stress_rate(&w, v, volumetric),
            else => in_plane_of(self.stress_rate3(embed(h), embed(v), [p, p_rate], along_x()))
        )
    }

    /// Returns ∂P/∂F at fixed p.
    pub(crate) fn tangent(self, h: Tensor, p: f64) -> Tangent {
        let volumetric = Volumetric::pressure(p);
        with_potential!(
            self,
            w => full(Strain::new(&w, h).tangent(&w, volumetric)),
            else => in_plane_tangent(&self.tangent3(embed(h), p, along_x()))
        )
    }

    /// Returns ∂Ṗ/∂F at fixed ∇v, p and ṗ, which is the rate of the tangent along `v` = ∇v.
    pub(crate) fn tangent_rate(self, h: Tensor, v: Tensor, p_rate: f64) -> Tangent {
        let volumetric = Volumetric { p: 0.0, p_rate, kappa: 0.0 };
        with_potential!(
            self,
            w => full(Strain::new(&w, h).tangent_rate(&w, v, volumetric)),
            // In 2D, the cofactor is linear in F, so the result does not depend on p.
            else => in_plane_tangent(&self.tangent_rate3(embed(h), embed(v), [0.0, p_rate], along_x()))
        )
    }

    /// Returns ∂(J − 1)/∂F = cof F, or I for small strains.
    pub(crate) fn volume_gradient(self, h: Tensor) -> Tensor {
        in_plane_of(self.volume_gradient3(embed(h)))
    }
}

fn full(packed: Symmetric<f64>) -> Tangent {
    UPPER.map(|row| row.map(|index| packed.0[index]))
}

fn in_plane_tangent(a: &Tangent3) -> Tangent {
    const INDICES: [usize; 4] = [0, 1, 3, 4];
    INDICES.map(|row| INDICES.map(|column| a[row][column]))
}

/// Step of central differences. The step ε^(1/3) balances truncation and rounding at a relative error of about
/// 1e-10.
pub(crate) const STEP: f64 = 6e-6;
pub(crate) const DIFFERENCE: f64 = 1e-8;

pub(crate) const PRESSURE: f64 = -2300.0;
pub(crate) const PRESSURE_RATE: f64 = 700.0;
pub(crate) const STATES: [Tensor; 4] = [
    [[0.0, 0.0], [0.0, 0.0]],
    [[0.1, 0.25], [-0.15, -0.05]],
    [[0.7, -0.4], [0.6, 0.3]],
    [[-0.3, 0.2], [0.1, 0.4]],
];
pub(crate) const VELOCITY: Tensor = [[0.3, -0.8], [0.5, 0.9]];

pub(crate) fn shifted(h: Tensor, r: usize, step: f64) -> Tensor {
    let mut h = h;
    h[r / 2][r % 2] += step;
    h
}

pub(crate) fn in_plane(t: Tensor) -> [f64; 4] {
    [t[0][0], t[0][1], t[1][0], t[1][1]]
}

pub(crate) fn close(found: f64, expected: f64, scale: f64) {
    assert!((found - expected).abs() < DIFFERENCE * scale, "{found} {expected}");
}

/// Compares the columns of a tangent with central differences of the stress.
pub(crate) fn check_tangent(
    tangent: Tangent,
    stress: impl Fn(Tensor) -> Tensor,
    h: Tensor,
    scale: f64,
) {
    for c in 0..4 {
        let plus = in_plane(stress(shifted(h, c, STEP)));
        let minus = in_plane(stress(shifted(h, c, -STEP)));
        for (r, row) in tangent.iter().enumerate() {
            close(row[c], (plus[r] - minus[r]) / (2.0 * STEP), scale);
        }
    }
}

macro_rules! law_tests {
    ($($name:ident: $law:expr;)*) => {$(
        mod $name {
            use super::*;

            /// Returns the largest entry of the tangent, which is the scale of the difference errors.
            fn scale(h: Tensor) -> f64 {
                let entries = $law.tangent(h, PRESSURE);
                entries.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()))
            }

            #[test]
            fn undeformed_state_has_no_stress_and_energy() {
                let rest = [[0.0; 2]; 2];
                assert_eq!($law.stress(rest, 0.0), rest);
                assert_eq!($law.energy(rest), 0.0);
                assert_eq!($law.volume_change(rest), 0.0);
                assert_eq!($law.stress_33(rest, 0.0), 0.0);
            }

            #[test]
            fn scaled_law_has_scaled_energy() {
                for h in STATES {
                    let (scaled, once) = ($law.scaled(3.0).energy(h), $law.energy(h));
                    // The error is a few roundings in each term of the energy.
                    assert!((scaled - 3.0 * once).abs() <= 16.0 * f64::EPSILON * scaled);
                }
            }

            #[test]
            fn is_linear_matches_a_constant_tangent() {
                let tangents = STATES.map(|h| $law.tangent(h, PRESSURE));
                assert_eq!($law.is_linear(), tangents.iter().all(|a| *a == tangents[0]));
            }

            #[test]
            fn stress_is_the_derivative_of_energy() {
                for h in STATES {
                    let full = |h| $law.energy(h) - PRESSURE * $law.volume_change(h);
                    let stress = in_plane($law.stress(h, PRESSURE));
                    for r in 0..4 {
                        let (plus, minus) = (full(shifted(h, r, STEP)), full(shifted(h, r, -STEP)));
                        close(stress[r], (plus - minus) / (2.0 * STEP), scale(h));
                    }
                }
            }

            #[test]
            fn volume_gradient_is_the_derivative_of_volume_change() {
                for h in STATES {
                    let gradient = in_plane($law.volume_gradient(h));
                    for r in 0..4 {
                        let difference = $law.volume_change(shifted(h, r, STEP))
                            - $law.volume_change(shifted(h, r, -STEP));
                        close(gradient[r], difference / (2.0 * STEP), 1.0);
                    }
                }
            }

            #[test]
            fn tangent_is_the_derivative_of_stress() {
                for h in STATES {
                    let tangent = $law.tangent(h, PRESSURE);
                    check_tangent(tangent, |h| $law.stress(h, PRESSURE), h, scale(h));
                }
            }

            #[test]
            fn stress_rate_is_the_derivative_along_the_motion() {
                for h in STATES {
                    let at = |s: f64| {
                        let h = [0, 1].map(|i| [0, 1].map(|j| h[i][j] + s * VELOCITY[i][j]));
                        in_plane($law.stress(h, PRESSURE + s * PRESSURE_RATE))
                    };
                    let rate = in_plane($law.stress_rate(h, VELOCITY, PRESSURE, PRESSURE_RATE));
                    for r in 0..4 {
                        close(rate[r], (at(STEP)[r] - at(-STEP)[r]) / (2.0 * STEP), scale(h));
                    }
                }
            }

            #[test]
            fn tangent_rate_is_the_derivative_of_the_stress_rate() {
                for h in STATES {
                    let rate = |h| $law.stress_rate(h, VELOCITY, PRESSURE, PRESSURE_RATE);
                    let tangent = $law.tangent_rate(h, VELOCITY, PRESSURE_RATE);
                    // Here, the third derivatives of W are about ten times the second derivatives.
                    check_tangent(tangent, rate, h, 10.0 * scale(h));
                }
            }
        }
    )*};
}

pub(crate) use law_tests;

#[test]
fn rotations_have_no_stress_up_to_rounding() {
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    for angle in [1e-9_f64, 0.3, 2.0, 3.1] {
        let (s, c) = angle.sin_cos();
        let h = [[c - 1.0, -s], [s, c - 1.0]];
        // The error is one rounding of sin and cos, times the modulus.
        let bound = 4.0 * f64::EPSILON * 2.0e4;
        assert!(in_plane(law.stress(h, 0.0)).iter().all(|s| s.abs() < bound), "{angle}");
        assert!(law.energy(h) < 1e-20);
    }
}

#[test]
fn small_strain_law_is_the_linearization_of_finite_laws() {
    let (c10, c01) = (1e4, 2e2);
    let shear_modulus = 2.0 * (c10 + c01);
    let small = Law::SmallStrain { shear_modulus };
    let rest = [[0.0; 2]; 2];
    for finite in
        [Law::MooneyRivlin { c10, c01 }, Law::DeviatoricStVenantKirchhoff { shear_modulus }]
    {
        let (a, b) = (finite.tangent(rest, 0.0), small.tangent(rest, 0.0));
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < 1e-10, "{a} {b}"); // rounding of 4e4
        }
    }
}

#[test]
fn deviatoric_st_venant_kirchhoff_matches_its_formula() {
    let shear_modulus = 2.04e4;
    let law = Law::DeviatoricStVenantKirchhoff { shear_modulus };
    for h in STATES {
        let f = [[1.0 + h[0][0], h[0][1]], [h[1][0], 1.0 + h[1][1]]];
        let c = |i: usize, j: usize| f[0][i] * f[0][j] + f[1][i] * f[1][j];
        let (exx, eyy, exy) = (0.5 * (c(0, 0) - 1.0), 0.5 * (c(1, 1) - 1.0), 0.5 * c(0, 1));
        let trace = exx + eyy;
        let squares = exx * exx + eyy * eyy + 2.0 * exy * exy;
        let energy = shear_modulus * (squares - trace * trace / 3.0);
        // The error is the rounding of terms of order ζ.
        assert!((law.energy(h) - energy).abs() < 1e-11 * shear_modulus);
        let p33 = -2.0 / 3.0 * shear_modulus * trace;
        assert!((law.stress_33(h, 0.0) - p33).abs() < 1e-11 * shear_modulus);
        // The pressure acts on the deformed area, so it contributes −p J.
        let with_pressure = p33 - PRESSURE * (f[0][0] * f[1][1] - f[0][1] * f[1][0]);
        assert!((law.stress_33(h, PRESSURE) - with_pressure).abs() < 1e-11 * shear_modulus);
    }
}

#[test]
fn tiny_strains_have_full_relative_accuracy() {
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let small = Law::SmallStrain { shear_modulus: 2.04e4 };
    let h = [[3e-12, 1e-12], [-2e-12, 1e-12]];
    for (a, b) in in_plane(law.stress(h, 0.0)).iter().zip(in_plane(small.stress(h, 0.0))) {
        // The relative difference of the laws is of the order of the strain.
        assert!((a / b - 1.0).abs() < 1e-10, "{a} {b}");
    }
    assert!((law.energy(h) / small.energy(h) - 1.0).abs() < 1e-10);
}
