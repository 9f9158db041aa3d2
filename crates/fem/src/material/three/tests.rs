//! Tests of every law in 3D by identities and central differences.

pub(crate) use super::super::{Law, Parameter, Tensor};
pub(crate) use super::{Axes, Tangent3, Tensor3};

/// Step of central differences. The step ε^(1/3) balances truncation and rounding at a relative error of about
/// 1e-10. Here, the step is slightly smaller, because the derivatives of a steep switch grow by a factor of a
/// hundred.
pub(crate) const STEP: f64 = 1e-6;
pub(crate) const DIFFERENCE: f64 = 1e-8;

pub(crate) const PRESSURE: f64 = -2300.0;
pub(crate) const PRESSURE_RATE: f64 = 700.0;
pub(crate) const STATES: [Tensor3; 4] = [
    [[0.0; 3]; 3],
    [[0.1, 0.25, -0.1], [-0.15, -0.05, 0.2], [0.05, -0.3, 0.12]],
    [[0.5, -0.4, 0.3], [0.6, 0.3, -0.2], [0.1, 0.2, -0.3]],
    [[-0.3, 0.2, 0.1], [0.1, 0.4, 0.0], [-0.2, 0.1, 0.2]],
];
pub(crate) const VELOCITY: Tensor3 = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];

/// Returns orthonormal axes, oblique to all coordinate axes.
pub(crate) fn axes() -> Axes<f64> {
    Axes { fiber: [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0], sheet: [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0] }
}

pub(crate) fn along(h: Tensor3, step: f64, direction: Tensor3) -> Tensor3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| h[i][j] + step * direction[i][j]))
}

pub(crate) fn unit(r: usize) -> Tensor3 {
    let mut out = [[0.0; 3]; 3];
    out[r / 3][r % 3] = 1.0;
    out
}

pub(crate) fn in_plane(t: Tensor3) -> [f64; 9] {
    std::array::from_fn(|r| t[r / 3][r % 3])
}

pub(crate) fn product(a: Tensor3, b: Tensor3) -> Tensor3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub(crate) fn close(found: f64, expected: f64, scale: f64) {
    assert!((found - expected).abs() < DIFFERENCE * scale, "{found} {expected} {scale}");
}

pub(crate) fn check_tangent(
    tangent: Tangent3,
    stress: impl Fn(Tensor3) -> Tensor3,
    h: Tensor3,
    scale: f64,
) {
    for c in 0..9 {
        let plus = in_plane(stress(along(h, STEP, unit(c))));
        let minus = in_plane(stress(along(h, -STEP, unit(c))));
        for (r, row) in tangent.iter().enumerate() {
            close(row[c], (plus[r] - minus[r]) / (2.0 * STEP), scale);
        }
    }
}

macro_rules! law_tests {
    ($($name:ident: $law:expr, $states:expr;)*) => {$(
        mod $name {
            use super::*;

            /// Returns the largest entry of the tangent, which is the scale of the difference errors.
            fn scale(h: Tensor3) -> f64 {
                let entries = $law.tangent3(h, PRESSURE, axes());
                entries.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()))
            }

            #[test]
            fn undeformed_state_has_no_stress_and_energy() {
                let rest = [[0.0; 3]; 3];
                assert_eq!($law.stress3(rest, 0.0, axes()), rest);
                assert_eq!($law.energy3(rest, axes()), 0.0);
                assert_eq!($law.volume_change3(rest), 0.0);
            }

            #[test]
            fn stress_is_the_derivative_of_energy() {
                for h in $states.iter().copied() {
                    let full = |h| $law.energy3(h, axes()) - PRESSURE * $law.volume_change3(h);
                    let stress = in_plane($law.stress3(h, PRESSURE, axes()));
                    for r in 0..9 {
                        let plus = full(along(h, STEP, unit(r)));
                        let minus = full(along(h, -STEP, unit(r)));
                        close(stress[r], (plus - minus) / (2.0 * STEP), scale(h));
                    }
                }
            }

            #[test]
            fn volume_gradient_is_the_derivative_of_volume_change() {
                for h in $states.iter().copied() {
                    let gradient = in_plane($law.volume_gradient3(h));
                    for r in 0..9 {
                        let difference = $law.volume_change3(along(h, STEP, unit(r)))
                            - $law.volume_change3(along(h, -STEP, unit(r)));
                        close(gradient[r], difference / (2.0 * STEP), 1.0);
                    }
                }
            }

            #[test]
            fn tangent_is_the_derivative_of_stress() {
                for h in $states.iter().copied() {
                    let tangent = $law.tangent3(h, PRESSURE, axes());
                    check_tangent(tangent, |h| $law.stress3(h, PRESSURE, axes()), h, scale(h));
                }
            }

            #[test]
            fn rates_are_derivatives_along_the_motion() {
                for h in $states.iter().copied() {
                    let pressures = [PRESSURE, PRESSURE_RATE];
                    let at = |s: f64| {
                        let p = PRESSURE + s * PRESSURE_RATE;
                        in_plane($law.stress3(along(h, s, VELOCITY), p, axes()))
                    };
                    let (plus, minus) = (at(STEP), at(-STEP));
                    let rate = in_plane($law.stress_rate3(h, VELOCITY, pressures, axes()));
                    for r in 0..9 {
                        close(rate[r], (plus[r] - minus[r]) / (2.0 * STEP), scale(h));
                    }
                    let rate = |h| $law.stress_rate3(h, VELOCITY, pressures, axes());
                    let tangent = $law.tangent_rate3(h, VELOCITY, pressures, axes());
                    // Here, the third derivatives of W are up to a hundred (k) times the second derivatives.
                    check_tangent(tangent, rate, h, 100.0 * scale(h));
                }
            }

            #[test]
            fn tiny_strains_have_full_relative_accuracy() {
                let (size, rest) = (1e-11, [[0.0; 3]; 3]);
                // Fibers and sheets lengthen along this motion, so the tangent on the tension side of a kink
                // applies.
                let h = along(rest, size, VELOCITY);
                let tangent = $law.tangent3(rest, 0.0, axes());
                let found = in_plane($law.stress3(h, 0.0, axes()));
                for (row, found) in tangent.iter().zip(found) {
                    let linear: f64 = row.iter().zip(in_plane(h)).map(|(a, h)| a * h).sum();
                    // Higher-order terms are 1e-11 times exponents of about a hundred. If invariants were computed
                    // as differences of numbers near one, the error would be 1e-5.
                    assert!((found - linear).abs() < 1e-8 * size * scale(rest), "{found} {linear}");
                }
                let work: f64 = found.iter().zip(in_plane(h)).map(|(p, h)| 0.5 * p * h).sum();
                let energy = $law.energy3(h, axes());
                assert!((energy - work).abs() < 1e-8 * work, "{energy} {work}");
            }

            #[test]
            fn stress_rotates_with_the_body() {
                if $law.is_linear() {
                    return;
                }
                let rotation = rotation();
                for h in STATES {
                    let mut f = h;
                    (0..3).for_each(|i| f[i][i] += 1.0);
                    let mut rotated = product(rotation, f);
                    (0..3).for_each(|i| rotated[i][i] -= 1.0);
                    let found = $law.stress3(rotated, PRESSURE, axes());
                    let expected = product(rotation, $law.stress3(h, PRESSURE, axes()));
                    for (a, b) in in_plane(found).iter().zip(in_plane(expected)) {
                        // The error is the rounding of F times the tangent.
                        assert!((a - b).abs() < 1e-13 * scale(h), "{a} {b}");
                    }
                }
            }

            #[test]
            fn plane_strain_matches_the_2d_law() {
                for h in STATES {
                    let plane: Tensor = [[h[0][0], h[0][1]], [h[1][0], h[1][1]]];
                    let embed = [[h[0][0], h[0][1], 0.0], [h[1][0], h[1][1], 0.0], [0.0; 3]];
                    let bound = 64.0 * f64::EPSILON * scale(h);
                    let (w, w3) = ($law.energy(plane), $law.energy3(embed, along_coordinates()));
                    assert!((w - w3).abs() <= bound, "{w} {w3}");
                    let (p, p3) = (
                        $law.stress(plane, PRESSURE),
                        $law.stress3(embed, PRESSURE, along_coordinates()),
                    );
                    let (a, a3) = (
                        $law.tangent(plane, PRESSURE),
                        $law.tangent3(embed, PRESSURE, along_coordinates()),
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

pub(crate) use law_tests;

/// Returns the law with the constants of Aróstica et al. (2025).
pub(crate) fn holzapfel_ogden(k: f64) -> Law {
    Law::HolzapfelOgden {
        a: 59.0,
        b: 8.023,
        a_f: 18_472.0,
        b_f: 16.026,
        a_s: 2481.0,
        b_s: 11.12,
        a_fs: 216.0,
        b_fs: 11.436,
        k,
        dispersion_f: 0.0,
        dispersion_s: 0.0,
    }
}

pub(crate) const TRANSVERSE: Law = Law::TransverseMooneyRivlin {
    c10: 1e4,
    c01: 2e2,
    c3: 500.0,
    c4: 8.0,
    c5: 1.2e4,
    stretch_max: 1.1,
};

/// Gradients with moderate strains, for laws with exponents above ten.
pub(crate) const MODERATE: [Tensor3; 4] = [
    [[0.0; 3]; 3],
    [[0.1, 0.15, -0.1], [-0.05, -0.05, 0.1], [0.05, -0.1, 0.12]],
    [[-0.1, -0.1, 0.03], [0.06, -0.13, -0.12], [0.01, 0.02, 0.1]],
    [[-0.08, 0.02, 0.1], [0.1, 0.04, 0.0], [-0.02, 0.1, -0.1]],
];

pub(crate) fn along_coordinates() -> Axes<f64> {
    Axes::cartesian(0.0)
}

/// Returns a rotation about two axes by arbitrary angles.
pub(crate) fn rotation() -> Tensor3 {
    let (s, c) = 0.7_f64.sin_cos();
    let (t, k) = 1.9_f64.sin_cos();
    product(
        [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        [[k, 0.0, t], [0.0, 1.0, 0.0], [-t, 0.0, k]],
    )
}

#[test]
fn tangent_at_a_kink_is_that_of_the_tension_side() {
    // Fibers and sheets lengthen along this motion.
    let rest = [[0.0; 3]; 3];
    for law in [holzapfel_ogden(f64::INFINITY), TRANSVERSE] {
        let tangent = law.tangent3(rest, 0.0, axes());
        let stress = in_plane(law.stress3(along(rest, 1e-8, VELOCITY), 0.0, axes()));
        let other = in_plane(law.stress3(along(rest, -1e-8, VELOCITY), 0.0, axes()));
        let scale = tangent.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()));
        let mut jump = 0.0_f64;
        for ((row, stress), other) in tangent.iter().zip(stress).zip(other) {
            let linear: f64 = row.iter().zip(in_plane(VELOCITY)).map(|(a, v)| a * v).sum();
            // One-sided difference, which has a first-order error with constants of about ten.
            assert!((stress / 1e-8 - linear).abs() < 1e-6 * scale, "{stress} {linear}");
            jump = jump.max((stress + other).abs() / 1e-8);
        }
        assert!(jump > 1e-3 * scale, "no kink: {jump}");
    }
}

#[test]
fn smooth_switch_makes_the_energy_nonconvex_in_compression() {
    // Second Piola–Kirchhoff stress in compression of the fibers of Aróstica et al.
    let law = holzapfel_ogden(100.0);
    let without = Law::HolzapfelOgden {
        a: 59.0,
        b: 8.023,
        a_f: 0.0,
        b_f: 16.026,
        a_s: 2481.0,
        b_s: 11.12,
        a_fs: 216.0,
        b_fs: 11.436,
        k: 100.0,
        dispersion_f: 0.0,
        dispersion_s: 0.0,
    };
    let (mut least, mut most) = (0.0_f64, 0.0_f64);
    for step in 1..2000 {
        let stretch = 1.0 - 1e-4 * f64::from(step);
        let h = [[stretch - 1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let axes = along_coordinates();
        let along = law.stress3(h, 0.0, axes)[0][0] - without.stress3(h, 0.0, axes)[0][0];
        least = least.min(along / stretch);
        most = most.max(along / stretch);
    }
    assert!((26.0..27.5).contains(&most), "{least} {most}");
    assert!((-67.0..-66.0).contains(&least), "{least} {most}");
}

#[test]
fn energies_are_affine_in_moduli() {
    for law in Law::CATALOG {
        // The values are different and within the ranges of the constants. The moduli are far above the smallest
        // published moduli.
        let dimensionless = |i: usize, of: &Parameter| {
            let candidates = [1.3 - 0.1 * i as f64, 1.3, 0.2];
            let mut allowed = candidates.into_iter().filter(|x| of.range.contains(*x));
            allowed.next().unwrap()
        };
        let values = |modulus: (&str, f64)| -> Vec<(&str, f64)> {
            let value = |i: usize, of: &Parameter| match modulus {
                (name, value) if name == of.name => value,
                _ if of.is_modulus() => 1e3,
                _ => dimensionless(i, of),
            };
            let all = law.parameters.iter().enumerate();
            all.map(|(i, of)| (of.name, value(i, of))).collect()
        };
        for constant in law.parameters.iter().filter(|constant| constant.is_modulus()) {
            let [a, b, c] = [1e3, 2e3, 3e3].map(|value| {
                let law = Law::named(law.name, &values((constant.name, value))).unwrap();
                law.energy3(MODERATE[1], axes())
            });
            // The error is the rounding of sums of about ten terms.
            assert!((a - 2.0 * b + c).abs() < 1e-13 * b.abs(), "{} {}", law.name, constant.name);
        }
    }
}
