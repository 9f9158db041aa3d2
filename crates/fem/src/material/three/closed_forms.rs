//! Closed forms of incompressible bodies in homogeneous states, the pressure from free sides.

use super::{Axes, Tensor3};
use crate::material::{ActiveStress, Law};

/// P of a stretch along x, y and z; the pressure leaves the sides normal to z free.
fn free_side(law: Law, stretches: [f64; 3], extra: Tensor3) -> [f64; 3] {
    let mut h = [[0.0; 3]; 3];
    for (i, stretch) in stretches.into_iter().enumerate() {
        h[i][i] = stretch - 1.0;
    }
    let mut stress = law.stress3(h, 0.0, Axes::cartesian(0.0));
    (0..3).for_each(|i| stress[i][i] += extra[i][i]);
    // P − p cof F with cof F = 1/stretch for J = 1.
    let p = stress[2][2] * stretches[2];
    [0, 1, 2].map(|i| stress[i][i] - p / stretches[i])
}

const NONE: Tensor3 = [[0.0; 3]; 3];

/// Along x, the sides free.
fn uniaxial(law: Law, stretch: f64) -> f64 {
    let across = stretch.powf(-0.5);
    let [along, side, _] = free_side(law, [stretch, across, across], NONE);
    assert!(side.abs() < 1e-12 * along.abs().max(1.0), "{side}");
    along
}

#[test]
fn uniaxial_and_equibiaxial_mooney_rivlin() {
    let (c10, c01) = (2.5, 2.5);
    let law = Law::MooneyRivlin { c10, c01 };
    assert!((uniaxial(law, 2.0) - 13.125).abs() < 1e-13 * 13.125 * 4.0);
    for l in [0.6_f64, 0.9, 1.3, 2.5] {
        let exact = 2.0 * (l - l.powi(-2)) * (c10 + c01 / l);
        assert!((uniaxial(law, l) - exact).abs() < 1e-13 * 100.0, "{l}");
        let exact = 2.0 * (l - l.powi(-5)) * (c10 + c01 * l * l);
        let [along, across, _] = free_side(law, [l, l, l.powi(-2)], NONE);
        // Rounding of stresses that grow like l⁻⁵.
        assert!((along - exact).abs() < 1e-12 * exact.abs().max(1.0), "{l}");
        assert_eq!(along, across);
    }
}

#[test]
fn simple_shear_of_mooney_rivlin_for_any_pressure() {
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    for p in [0.0, -4e3] {
        let h = [[0.0, 0.3, 0.0], [0.0; 3], [0.0; 3]];
        let stress = law.stress3(h, p, Axes::cartesian(0.0));
        assert!((stress[0][1] - 6120.0).abs() < 1e-9);
    }
}

#[test]
fn transverse_law_along_its_fibres() {
    let (c10, c01, c3, c4, c5, stretch_max) = (1e4, 2e2, 500.0, 8.0, 1.2e4, 1.1);
    let law = Law::TransverseMooneyRivlin {
        c10,
        c01,
        c3,
        c4,
        c5,
        stretch_max,
    };
    let crimped = |l: f64| c3 * ((c4 * (l - 1.0)).exp() - 1.0);
    for l in [0.8, 1.0, 1.05, 1.1, 1.3] {
        // λ F2' adds to the Cauchy stress.
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

#[test]
fn holzapfel_ogden_along_its_fibres() {
    let (a, b, a_f, b_f) = (59.0, 8.023, 18_472.0, 16.026);
    let law = Law::HolzapfelOgden {
        a,
        b,
        a_f,
        b_f,
        a_s: 2481.0,
        b_s: 11.12,
        a_fs: 216.0,
        b_fs: 11.436,
        k: f64::INFINITY,
    };
    for l in [1.05_f64, 1.15] {
        // Sheets are shortened: a step leaves them out. S_ff = 2 ∂W/∂I4f.
        let (i1, i4) = (l * l + 2.0 / l, l * l);
        let matrix = a * (b * (i1 - 3.0)).exp() * (l - l.powi(-2));
        let fibre = 2.0 * a_f * (i4 - 1.0) * (b_f * (i4 - 1.0).powi(2)).exp() * l;
        let exact = matrix + fibre;
        assert!((uniaxial(law, l) - exact).abs() < 1e-12 * exact, "{l}");
    }
}

#[test]
fn guccione_along_its_fibres() {
    let (c, b_f, b_t) = (2e3, 8.0, 2.0);
    let law = Law::Guccione {
        c,
        b_f,
        b_t,
        b_fs: 4.0,
    };
    for l in [0.9_f64, 1.2] {
        let (e, side) = (0.5 * (l * l - 1.0), 0.5 * (1.0 / l - 1.0));
        let scale = c * (b_f * e * e + 2.0 * b_t * side * side).exp();
        // S = C e^Q b E; the free side sets p = S_ss / l.
        let exact = scale * (l * b_f * e - b_t * side / (l * l));
        assert!(
            (uniaxial(law, l) - exact).abs() < 1e-12 * exact.abs(),
            "{l}"
        );
    }
}

#[test]
fn contraction_isometric_and_isotonic() {
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
    // Held at its length, the muscle pulls with T.
    assert!((active(1.0) - tension).abs() < 1e-12 * tension);
    // Without load: 2 c10 (λ − λ⁻²) + λ T = 0.
    let short = (2.0 * c10 / (2.0 * c10 + tension)).cbrt();
    assert!(active(short).abs() < 1e-12 * tension);
}
