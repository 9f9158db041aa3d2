//! Identities and central differences for every law in three dimensions.

use super::super::{Law, Tensor};
use super::{Axes, Tangent3, Tensor3};

/// Step of central differences: ε^(1/3) balances truncation and rounding at about 1e-10 relative.
const STEP: f64 = 6e-6;
const DIFFERENCE: f64 = 1e-8;

const PRESSURE: f64 = -2300.0;
const PRESSURE_RATE: f64 = 700.0;
const STATES: [Tensor3; 4] = [
    [[0.0; 3]; 3],
    [[0.1, 0.25, -0.1], [-0.15, -0.05, 0.2], [0.05, -0.3, 0.12]],
    [[0.5, -0.4, 0.3], [0.6, 0.3, -0.2], [0.1, 0.2, -0.3]],
    [[-0.3, 0.2, 0.1], [0.1, 0.4, 0.0], [-0.2, 0.1, 0.2]],
];
const VELOCITY: Tensor3 = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];

/// Orthonormal, along no coordinate.
fn axes() -> Axes<f64> {
    Axes {
        fibre: [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0],
        sheet: [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0],
    }
}

fn along(h: Tensor3, step: f64, direction: Tensor3) -> Tensor3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| h[i][j] + step * direction[i][j]))
}

fn unit(r: usize) -> Tensor3 {
    let mut out = [[0.0; 3]; 3];
    out[r / 3][r % 3] = 1.0;
    out
}

fn flat(t: Tensor3) -> [f64; 9] {
    std::array::from_fn(|r| t[r / 3][r % 3])
}

fn product(a: Tensor3, b: Tensor3) -> Tensor3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn close(found: f64, expected: f64, scale: f64) {
    assert!(
        (found - expected).abs() < DIFFERENCE * scale,
        "{found} {expected} {scale}"
    );
}

fn check_tangent(tangent: Tangent3, stress: impl Fn(Tensor3) -> Tensor3, h: Tensor3, scale: f64) {
    for c in 0..9 {
        let plus = flat(stress(along(h, STEP, unit(c))));
        let minus = flat(stress(along(h, -STEP, unit(c))));
        for (r, row) in tangent.iter().enumerate() {
            close(row[c], (plus[r] - minus[r]) / (2.0 * STEP), scale);
        }
    }
}

macro_rules! law_tests {
    ($($name:ident: $law:expr;)*) => {$(
        mod $name {
            use super::*;

            /// The size of the tangent, by which differences are measured.
            fn scale(h: Tensor3) -> f64 {
                let entries = $law.tangent3(h, PRESSURE, axes());
                entries.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()))
            }

            #[test]
            fn rest_is_free_of_stress_and_energy() {
                let rest = [[0.0; 3]; 3];
                assert_eq!($law.stress3(rest, 0.0, axes()), rest);
                assert_eq!($law.energy3(rest, axes()), 0.0);
                assert_eq!($law.volume_change3(rest), 0.0);
            }

            #[test]
            fn stress_is_the_derivative_of_energy() {
                for h in STATES {
                    let full = |h| $law.energy3(h, axes()) - PRESSURE * $law.volume_change3(h);
                    let stress = flat($law.stress3(h, PRESSURE, axes()));
                    for r in 0..9 {
                        let plus = full(along(h, STEP, unit(r)));
                        let minus = full(along(h, -STEP, unit(r)));
                        close(stress[r], (plus - minus) / (2.0 * STEP), scale(h));
                    }
                }
            }

            #[test]
            fn volume_gradient_is_the_derivative_of_volume_change() {
                for h in STATES {
                    let gradient = flat($law.volume_gradient3(h));
                    for r in 0..9 {
                        let difference = $law.volume_change3(along(h, STEP, unit(r)))
                            - $law.volume_change3(along(h, -STEP, unit(r)));
                        close(gradient[r], difference / (2.0 * STEP), 1.0);
                    }
                }
            }

            #[test]
            fn tangent_is_the_derivative_of_stress() {
                for h in STATES {
                    let tangent = $law.tangent3(h, PRESSURE, axes());
                    check_tangent(tangent, |h| $law.stress3(h, PRESSURE, axes()), h, scale(h));
                }
            }

            #[test]
            fn rates_are_derivatives_along_the_motion() {
                for h in STATES {
                    let pressures = [PRESSURE, PRESSURE_RATE];
                    let at = |s: f64| {
                        let p = PRESSURE + s * PRESSURE_RATE;
                        flat($law.stress3(along(h, s, VELOCITY), p, axes()))
                    };
                    let (plus, minus) = (at(STEP), at(-STEP));
                    let rate = flat($law.stress_rate3(h, VELOCITY, pressures, axes()));
                    for r in 0..9 {
                        close(rate[r], (plus[r] - minus[r]) / (2.0 * STEP), scale(h));
                    }
                    let rate = |h| $law.stress_rate3(h, VELOCITY, pressures, axes());
                    let tangent = $law.tangent_rate3(h, VELOCITY, pressures, axes());
                    // Third derivatives of W are some ten times the second ones here.
                    check_tangent(tangent, rate, h, 10.0 * scale(h));
                }
            }

            #[test]
            fn plane_strain_is_that_of_two_dimensions() {
                for h in STATES {
                    let plane: Tensor = [[h[0][0], h[0][1]], [h[1][0], h[1][1]]];
                    let deep = [[h[0][0], h[0][1], 0.0], [h[1][0], h[1][1], 0.0], [0.0; 3]];
                    let bound = 64.0 * f64::EPSILON * scale(deep);
                    let (w, w3) = ($law.energy(plane), $law.energy3(deep, axes()));
                    assert!((w - w3).abs() <= bound, "{w} {w3}");
                    let (p, p3) = (
                        $law.stress(plane, PRESSURE),
                        $law.stress3(deep, PRESSURE, axes()),
                    );
                    let (a, a3) = (
                        $law.tangent(plane, PRESSURE),
                        $law.tangent3(deep, PRESSURE, axes()),
                    );
                    for i in 0..2 {
                        for j in 0..2 {
                            assert!((p[i][j] - p3[i][j]).abs() <= bound, "{p:?} {p3:?}");
                            for k in 0..2 {
                                for l in 0..2 {
                                    let (a, a3) = (a[2 * i + j][2 * k + l], a3[3 * i + j][3 * k + l]);
                                    assert!((a - a3).abs() <= bound, "{a} {a3}");
                                }
                            }
                        }
                    }
                    let p33 = $law.stress_33(plane, PRESSURE);
                    assert!((p33 - p3[2][2]).abs() <= bound, "{p33} {}", p3[2][2]);
                }
            }
        }
    )*};
}

law_tests! {
    mooney_rivlin: Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    mooney_rivlin_second_invariant_only: Law::MooneyRivlin { c10: 0.0, c01: 5e3 };
    small_strain: Law::SmallStrain { shear_modulus: 2.04e4 };
    st_venant_kirchhoff: Law::StVenantKirchhoff { shear_modulus: 2.04e4 };
}

#[test]
fn tiny_strains_keep_their_digits() {
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let small = Law::SmallStrain {
        shear_modulus: 2.04e4,
    };
    let h = along([[0.0; 3]; 3], 1e-11, VELOCITY);
    let (found, linear) = (law.stress3(h, 0.0, axes()), small.stress3(h, 0.0, axes()));
    for (a, b) in flat(found).iter().zip(flat(linear)) {
        // The laws differ by the strain itself, relatively.
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let (a, b) = (law.energy3(h, axes()), small.energy3(h, axes()));
    assert!((a / b - 1.0).abs() < 1e-9);
}

#[test]
fn rotations_turn_the_stress() {
    let (s, c) = 0.7_f64.sin_cos();
    let (t, k) = 1.9_f64.sin_cos();
    let rotation = product(
        [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        [[k, 0.0, t], [0.0, 1.0, 0.0], [-t, 0.0, k]],
    );
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    for h in STATES {
        let mut f = h;
        (0..3).for_each(|i| f[i][i] += 1.0);
        let mut turned = product(rotation, f);
        (0..3).for_each(|i| turned[i][i] -= 1.0);
        let found = law.stress3(turned, PRESSURE, axes());
        let expected = product(rotation, law.stress3(h, PRESSURE, axes()));
        for (a, b) in flat(found).iter().zip(flat(expected)) {
            // Rounding of a modulus of 1e4 in some ten terms.
            assert!((a - b).abs() < 1e-10 * 1e4, "{a} {b}");
        }
    }
}
