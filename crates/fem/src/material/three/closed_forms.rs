//! Closed-form stresses of incompressible bodies in homogeneous states. The pressure follows from a stress-free
//! side.

use super::{Axes, Tensor3};
use crate::material::{ActiveStress, Law};

/// Returns P for stretches along x, y and z. The pressure is chosen such that the side normal to z is stress-free.
fn free_side(law: Law, stretches: [f64; 3], extra: Tensor3) -> [f64; 3] {
    let mut h = [[0.0; 3]; 3];
    for (i, stretch) in stretches.into_iter().enumerate() {
        h[i][i] = stretch - 1.0;
    }
    let mut stress = law.stress3(h, 0.0, Axes::cartesian(0.0));
    (0..3).for_each(|i| stress[i][i] += extra[i][i]);
    // The stress is P − p cof F, where cof F = 1/stretch for J = 1.
    let p = stress[2][2] * stretches[2];
    [0, 1, 2].map(|i| stress[i][i] - p / stretches[i])
}

const NONE: Tensor3 = [[0.0; 3]; 3];

/// Returns the uniaxial nominal stress along x with free sides.
fn uniaxial(law: Law, stretch: f64) -> f64 {
    let across = stretch.powf(-0.5);
    let [along, side, _] = free_side(law, [stretch, across, across], NONE);
    assert!(side.abs() < 1e-12 * along.abs().max(1.0), "{side}");
    along
}

#[test]
fn mooney_rivlin_under_uniaxial_and_equibiaxial_stretch() {
    let (c10, c01) = (2.5, 2.5);
    let law = Law::MooneyRivlin { c10, c01 };
    assert!((uniaxial(law, 2.0) - 13.125).abs() < 1e-13 * 13.125 * 4.0);
    for l in [0.6_f64, 0.9, 1.3, 2.5] {
        let exact = 2.0 * (l - l.powi(-2)) * (c10 + c01 / l);
        assert!((uniaxial(law, l) - exact).abs() < 1e-13 * 100.0, "{l}");
        let exact = 2.0 * (l - l.powi(-5)) * (c10 + c01 * l * l);
        let [along, across, _] = free_side(law, [l, l, l.powi(-2)], NONE);
        // The error is the rounding of stresses that grow like l⁻⁵.
        assert!((along - exact).abs() < 1e-12 * exact.abs().max(1.0), "{l}");
        assert_eq!(along, across);
    }
}

/// Derivatives W1 and W2 of an energy with respect to Ī1 and Ī2 as functions of Ī1 − 3.
type Slopes = fn(f64) -> [f64; 2];

fn laws_of_invariants() -> [(Law, Slopes); 3] {
    [
        (Law::Yeoh { c10: 1e4, c20: -1e3, c30: 4e2 }, |y| [1e4 - 2e3 * y + 1.2e3 * y * y, 0.0]),
        (Law::Gent { shear_modulus: 1e4, limit: 40.0 }, |y| [5e3 / (1.0 - y / 40.0), 0.0]),
        (Law::VerondaWestmann { c1: 5e3, c2: 0.7 }, |y| [3.5e3 * (0.7 * y).exp(), -1.75e3]),
    ]
}

/// Checks the uniaxial, equibiaxial and shear stresses of incompressible isotropic bodies, which are 2 (λ − λ⁻²)
/// (W1 + W2/λ), 2 (λ − λ⁻⁵) (W1 + W2 λ²) and 2 γ (W1 + W2).
#[test]
fn laws_of_invariants_under_stretch_and_shear() {
    for (law, slopes) in laws_of_invariants() {
        for l in [0.7_f64, 0.95, 1.3, 1.8] {
            let [w1, w2] = slopes(l * l + 2.0 / l - 3.0);
            let exact = 2.0 * (l - l.powi(-2)) * (w1 + w2 / l);
            // The error is the rounding of terms that partly cancel.
            assert!((uniaxial(law, l) - exact).abs() < 1e-12 * 1e5, "{law:?} {l}");
            let [w1, w2] = slopes(2.0 * l * l + l.powi(-4) - 3.0);
            let exact = 2.0 * (l - l.powi(-5)) * (w1 + w2 * l * l);
            let [along, across, _] = free_side(law, [l, l, l.powi(-2)], NONE);
            let scale = exact.abs().max(1e5);
            assert!((along - exact).abs() < 1e-12 * scale, "{law:?} {l}");
            assert!((along - across).abs() < 1e-12 * scale);
        }
        check_simple_shear(law, |_, _, gamma| {
            let [w1, w2] = slopes(gamma * gamma);
            2.0 * gamma * (w1 + w2)
        });
    }
}

/// Checks the nominal stresses, which are Σ μ (λ^(α−1) − λ^(−α/2−1)) in uniaxial stretch and Σ μ (λ^(α−1) −
/// λ^(−2α−1)) in equibiaxial stretch. In simple shear, the stress is Σ μ (λ^α − λ^−α)/(λ + 1/λ) with the stretch λ
/// − 1/λ = γ.
#[test]
fn ogden_under_stretch_and_shear() {
    let terms = [(0.63e6, 1.3), (1.2e3, 5.0), (-1e4, -2.0)];
    let names = ["mu_1", "alpha_1", "mu_2", "alpha_2", "mu_3", "alpha_3"];
    let values = terms.iter().flat_map(|(mu, alpha)| [*mu, *alpha]);
    let law = Law::named("ogden", &names.into_iter().zip(values).collect::<Vec<_>>()).unwrap();
    let sum = |term: &dyn Fn(f64) -> f64| -> f64 {
        terms.iter().map(|(mu, alpha)| mu * term(*alpha)).sum()
    };
    for l in [0.3_f64, 0.95, 1.3, 2.5, 7.0] {
        let exact = sum(&|a| l.powf(a - 1.0) - l.powf(-0.5 * a - 1.0));
        // The error is the rounding of terms that partly cancel.
        assert!((uniaxial(law, l) - exact).abs() < 1e-12 * exact.abs().max(1e6), "{l}");
        let exact = sum(&|a| l.powf(a - 1.0) - l.powf(-2.0 * a - 1.0));
        let [along, across, _] = free_side(law, [l, l, l.powi(-2)], NONE);
        let scale = exact.abs().max(1e6);
        assert!((along - exact).abs() < 1e-12 * scale, "{l} {along} {exact}");
        assert!((along - across).abs() < 1e-12 * scale);
    }
    check_simple_shear(law, |_, _, gamma| {
        let l = 0.5 * (gamma + (gamma * gamma + 4.0).sqrt());
        sum(&|a| l.powf(a) - l.powf(-a)) / (l + 1.0 / l)
    });
}

/// Beyond its limit, Gent's law must not return a stress that a solver could accept.
#[test]
fn a_locked_body_has_no_stress() {
    let law = Law::Gent { shear_modulus: 1e4, limit: 2.0 };
    let stretched = |stretch: f64| {
        let h = [[stretch - 1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        law.stress3(h, 0.0, Axes::cartesian(0.0))[0][0]
    };
    assert!(stretched(1.5).is_finite());
    assert!(stretched(4.0).is_nan());
}

#[test]
fn mooney_rivlin_in_simple_shear_for_any_pressure() {
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    for p in [0.0, -4e3] {
        let h = [[0.0, 0.3, 0.0], [0.0; 3], [0.0; 3]];
        let stress = law.stress3(h, p, Axes::cartesian(0.0));
        assert!((stress[0][1] - 6120.0).abs() < 1e-9);
    }
}

#[test]
fn transverse_law_along_its_fibers() {
    let (c10, c01, c3, c4, c5, stretch_max) = (1e4, 2e2, 500.0, 8.0, 1.2e4, 1.1);
    let law = Law::TransverseMooneyRivlin { c10, c01, c3, c4, c5, stretch_max };
    let crimped = |l: f64| c3 * ((c4 * (l - 1.0)).exp() - 1.0);
    for l in [0.8, 1.0, 1.05, 1.1, 1.3] {
        // The fibers add λ F2' to the Cauchy stress.
        let tension = if l < 1.0 {
            0.0
        } else if l < stretch_max {
            crimped(l)
        } else {
            c5 * (l - stretch_max) + crimped(stretch_max)
        };
        let exact = 2.0 * (l - l.powi(-2)) * (c10 + c01 / l) + tension / l;
        assert!((uniaxial(law, l) - exact).abs() < 1e-13 * 1e5, "{l}");
    }
}

/// Returns isochoric stretches along fiber, sheet and normal: pure shear, equibiaxial and general stretches.
fn stretches() -> [[f64; 3]; 5] {
    [[1.15, 1.0], [1.0, 1.15], [1.1, 1.1], [0.9, 1.2], [1.2, 0.85]]
        .map(|[f, s]| [f, s, 1.0 / (f * s)])
}

/// Returns P_i for the isochoric stretches λ_i, given the second Piola–Kirchhoff stresses S_i without pressure.
/// The pressure is chosen such that the side normal to z is stress-free.
fn expected_stress(stretches: [f64; 3], second: [f64; 3]) -> [f64; 3] {
    let p = stretches[2].powi(2) * second[2];
    [0, 1, 2].map(|i| stretches[i] * second[i] - p / stretches[i])
}

/// Checks the stresses of a law under the stretches of [`stretches`]. The function `second` returns the stresses
/// S_i without pressure.
fn check_stretches(law: Law, second: impl Fn([f64; 3]) -> [f64; 3]) {
    for stretches in stretches() {
        let found = free_side(law, stretches, NONE);
        let expected = expected_stress(stretches, second(stretches));
        let scale = expected.iter().fold(0.0, |m: f64, p| m.max(p.abs()));
        for (found, expected) in found.iter().zip(expected) {
            // The error is the rounding of strains near 0.1 times exponents of about ten.
            let error = (found - expected).abs();
            assert!(error < 1e-12 * scale, "{stretches:?}: {found} {expected}");
        }
    }
}

/// Checks P_ij in simple shear F = I + γ e_i⊗e_j in all planes spanned by two of the fiber (0), sheet (1)
/// and normal (2) directions. For any
/// pressure, P_ij equals dW/dγ = `slope(i, j, γ)`, because (cof F)_ij = 0.
fn check_simple_shear(law: Law, slope: impl Fn(usize, usize, f64) -> f64) {
    for (i, j) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
        for gamma in [0.1, -0.4] {
            let mut h = NONE;
            h[i][j] = gamma;
            let found = law.stress3(h, -3e3, Axes::cartesian(0.0))[i][j];
            let expected = slope(i, j, gamma);
            // The error is rounding, with exponents of about ten.
            let error = (found - expected).abs();
            assert!(error < 1e-12 * expected.abs(), "{i} {j}: {found} {expected}");
        }
    }
}

/// Constants of the Holzapfel–Ogden law with a step switch: a, b, a_f, b_f, a_s, b_s, a_fs, b_fs.
const HEART: [f64; 8] = [59.0, 8.023, 18_472.0, 16.026, 2481.0, 11.12, 216.0, 11.436];

/// Returns the law with the dispersions κ_f and κ_s.
fn holzapfel_ogden([dispersion_f, dispersion_s]: [f64; 2]) -> Law {
    let [a, b, a_f, b_f, a_s, b_s, a_fs, b_fs] = HEART;
    Law::HolzapfelOgden {
        a,
        b,
        a_f,
        b_f,
        a_s,
        b_s,
        a_fs,
        b_fs,
        k: f64::INFINITY,
        dispersion_f,
        dispersion_s,
    }
}

/// Dispersions of aligned, dispersed and isotropic fibers.
const DISPERSIONS: [[f64; 2]; 3] = [[0.0, 0.0], [0.226, 0.1], [1.0 / 3.0, 0.0]];

#[test]
fn holzapfel_ogden_under_stretches_of_fiber_and_sheet() {
    let [a, b, a_f, b_f, a_s, b_s, ..] = HEART;
    for dispersions in DISPERSIONS {
        check_stretches(holzapfel_ogden(dispersions), |stretches| {
            let squares = stretches.map(|l| l * l);
            let sum: f64 = squares.iter().sum();
            let matrix = a * (b * (sum - 3.0)).exp();
            let mut second = [matrix; 3];
            for (axis, [a, b]) in [[a_f, b_f], [a_s, b_s]].into_iter().enumerate() {
                let dispersion = dispersions[axis];
                let aligned = 1.0 - 3.0 * dispersion;
                // S = 2 ∂W/∂I (κ I + (1 − 3 κ) f⊗f), which is zero in compression.
                let y = (dispersion * sum + aligned * squares[axis] - 1.0).max(0.0);
                let slope = 2.0 * a * y * (b * y * y).exp();
                second[axis] += slope * aligned;
                second.iter_mut().for_each(|s| *s += slope * dispersion);
            }
            second
        });
    }
}

#[test]
fn holzapfel_ogden_in_simple_shear_of_all_planes() {
    let [a, b, a_f, b_f, a_s, b_s, a_fs, b_fs] = HEART;
    // I1 = 3 + γ², I4 of direction j is 1 + γ², and I8 = γ in the fiber–sheet plane.
    for dispersions in DISPERSIONS {
        check_simple_shear(holzapfel_ogden(dispersions), |i, j, gamma| {
            let square = gamma * gamma;
            let family = |axis: usize, a: f64, b: f64| {
                let dispersion = dispersions[axis];
                let aligned = if axis == j { 1.0 - 3.0 * dispersion } else { 0.0 };
                let weight = dispersion + aligned;
                let y = weight * square;
                2.0 * a * weight * y * (b * y * y).exp()
            };
            let stretched = family(0, a_f, b_f) + family(1, a_s, b_s);
            let shear = if i + j == 1 { a_fs * (b_fs * square).exp() } else { 0.0 };
            gamma * (a * (b * square).exp() + stretched + shear)
        });
    }
}

/// The energy of isotropic fibers depends on I1 only, so the axes do not matter.
#[test]
fn fibers_in_all_directions_are_isotropic() {
    let law = holzapfel_ogden([1.0 / 3.0, 1.0 / 3.0]);
    let Law::HolzapfelOgden {
        a, b, a_f, b_f, a_s, b_s, b_fs, k, dispersion_f, dispersion_s, ..
    } = law
    else {
        unreachable!("the law above")
    };
    // The same law without fiber–sheet shear.
    let law = Law::HolzapfelOgden {
        a,
        b,
        a_f,
        b_f,
        a_s,
        b_s,
        a_fs: 0.0,
        b_fs,
        k,
        dispersion_f,
        dispersion_s,
    };
    let h = [[0.1, 0.25, -0.1], [-0.15, -0.05, 0.2], [0.05, -0.3, 0.12]];
    let turned = Axes {
        fiber: [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0],
        sheet: [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0],
    };
    let (one, other) = (law.stress3(h, 0.0, Axes::cartesian(0.0)), law.stress3(h, 0.0, turned));
    let scale = one.iter().flatten().fold(0.0, |m: f64, p| m.max(p.abs()));
    for (one, other) in one.iter().flatten().zip(other.iter().flatten()) {
        // The error is rounding, with exponents of about ten.
        assert!((one - other).abs() < 1e-12 * scale, "{one} {other}");
    }
}

const GUCCIONE: [f64; 4] = [2e3, 8.0, 2.0, 4.0];

fn guccione_laws() -> [Law; 2] {
    let [c, b_f, b_t, b_fs] = GUCCIONE;
    [Law::Guccione { c, b_f, b_t, b_fs }, Law::IsochoricGuccione { c, b_f, b_t, b_fs }]
}

#[test]
fn guccione_under_stretches_of_fiber_and_sheet() {
    let [c, b_f, b_t, _] = GUCCIONE;
    // For J = 1, the isochoric law differs only by the pressure.
    for law in guccione_laws() {
        check_stretches(law, |stretches| {
            let strains = stretches.map(|l| 0.5 * (l * l - 1.0));
            let weights = [b_f, b_t, b_t];
            let q: f64 = (0..3).map(|i| weights[i] * strains[i] * strains[i]).sum();
            // S = C e^Q b E.
            [0, 1, 2].map(|i| c * q.exp() * weights[i] * strains[i])
        });
    }
}

#[test]
fn guccione_in_simple_shear_of_all_planes() {
    let [c, b_f, b_t, b_fs] = GUCCIONE;
    for law in guccione_laws() {
        // E_ij = γ/2 and E_jj = γ²/2, so Q = b_jj γ⁴/4 + b_ij γ²/2 and dW/dγ = C/2 e^Q dQ/dγ. Here, b_ij = b_fs in
        // planes that contain the fiber, and b_ij = b_t in the transverse plane.
        check_simple_shear(law, |i, j, gamma| {
            let (axial, shear) = ([b_f, b_t, b_t][j], if i * j == 0 { b_fs } else { b_t });
            let square = gamma * gamma;
            let q = 0.25 * axial * square * square + 0.5 * shear * square;
            0.5 * c * q.exp() * (axial * square + shear) * gamma
        });
    }
}

/// Weights b_1 to b_9 of Fung's law.
const FUNG: [f64; 9] = [8.0, 3.0, 2.0, 1.5, -0.5, 1.0, 4.0, 3.0, 5.0];

fn fung() -> Law {
    let names = ["b_1", "b_2", "b_3", "b_4", "b_5", "b_6", "b_7", "b_8", "b_9"];
    let constants = [("c", 2e3)].into_iter().chain(names.into_iter().zip(FUNG));
    Law::named("fung", &constants.collect::<Vec<_>>()).unwrap()
}

#[test]
fn fung_under_stretches_of_fiber_and_sheet() {
    let [b1, b2, b3, b4, b5, b6, ..] = FUNG;
    check_stretches(fung(), |stretches| {
        let [f, s, n] = stretches.map(|l| 0.5 * (l * l - 1.0));
        let half_slopes =
            [b1 * f + b4 * s + b6 * n, b4 * f + b2 * s + b5 * n, b6 * f + b5 * s + b3 * n];
        let q: f64 = half_slopes.iter().zip([f, s, n]).map(|(a, e)| a * e).sum();
        half_slopes.map(|half| 2e3 * q.exp() * half)
    });
}

#[test]
fn fung_in_simple_shear_of_all_planes() {
    let [b1, b2, b3, _, _, _, fs, sn, nf] = FUNG;
    // E_ij = γ/2 and E_jj = γ²/2, so Q = b_jj γ⁴/4 + b_ij γ²/4 and dW/dγ = c/2 e^Q dQ/dγ.
    check_simple_shear(fung(), |i, j, gamma| {
        let (axial, shear) = ([b1, b2, b3][j], [fs, nf, sn][i + j - 1]);
        let square = gamma * gamma;
        let q = 0.25 * axial * square * square + 0.25 * shear * square;
        0.5 * 2e3 * q.exp() * (axial * square + 0.5 * shear) * gamma
    });
}

#[test]
fn isometric_and_isotonic_contraction() {
    let (c10, tension) = (1e4, 3e4);
    let law = Law::MooneyRivlin { c10, c01: 0.0 };
    let active = |stretch: f64| {
        let across = stretch.powf(-0.5);
        let mut h = NONE;
        for (i, stretch) in [stretch, across, across].into_iter().enumerate() {
            h[i][i] = stretch - 1.0;
        }
        let along = [1.0, 0.0, 0.0];
        let stress = ActiveStress::PLAIN.at(along, &h, &NONE, tension).stress();
        free_side(law, [stretch, across, across], stress)[0]
    };
    // At fixed length, the muscle pulls with the tension T.
    assert!((active(1.0) - tension).abs() < 1e-12 * tension);
    // Without load, the muscle satisfies 2 c10 (λ − λ⁻²) + λ T = 0.
    let short = (2.0 * c10 / (2.0 * c10 + tension)).cbrt();
    assert!(active(short).abs() < 1e-12 * tension);
}
