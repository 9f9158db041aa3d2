//! Tests of Ogden's law: closed forms near coinciding stretches, and the accuracy of powers.

use super::{logarithm, traces};
use crate::material::Law;

/// Returns Ogden's three terms for Treloar's rubber, in Pa.
fn rubber() -> Law {
    law(&[(0.63e6, 1.3), (1.2e3, 5.0), (-1e4, -2.0)])
}

fn law(terms: &[(f64, f64)]) -> Law {
    let names = ["mu_1", "alpha_1", "mu_2", "alpha_2", "mu_3", "alpha_3"];
    let values = terms.iter().flat_map(|(mu, alpha)| [*mu, *alpha]);
    let constants: Vec<_> = names.into_iter().zip(values).collect();
    Law::named("ogden", &constants).unwrap()
}

mod plane {
    use super::rubber;
    use crate::material::tests::*;

    law_tests! {
        ogden: rubber();
    }

    /// In plane strain, the in-plane stretches coincide with each other or with the out-of-plane stretch 1.
    #[test]
    fn coinciding_stretches_are_regular() {
        for gap in [0.0, 1e-9, 1e-7, 1e-5, 1e-3] {
            for h in [
                [[0.3 + gap, 0.0], [0.0, 0.3]],
                [[0.4, 0.0], [0.0, gap]],
                [[gap, 0.0], [0.0, -gap]],
                [[0.1, 0.5], [-0.5, 0.1 + gap]],
            ] {
                let law = rubber();
                let tangent = law.tangent(h, PRESSURE);
                let scale = tangent.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()));
                check_tangent(tangent, |h| law.stress(h, PRESSURE), h, scale);
            }
        }
    }
}

mod space {
    use super::{law, rubber};
    use crate::error::FemError;
    use crate::material::three::tests::*;

    /// Returns gradients with two or three stretches that coincide, or nearly coincide, along oblique axes.
    fn nearly_equal() -> Vec<Tensor3> {
        let turn = [
            [2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0],
            [2.0 / 3.0, 1.0 / 3.0, -2.0 / 3.0],
            [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0],
        ];
        let back = [0, 1, 2].map(|i| [0, 1, 2].map(|j| turn[j][i]));
        let mut out = Vec::new();
        for gap in [0.0, 1e-9, 1e-7, 1e-5, 1e-3] {
            for [a, b, c] in [
                [1.4, 1.4 * (1.0 + gap), 0.6],
                [0.8, 1.5, 0.8 * (1.0 + gap)],
                [1.1, 1.1 * (1.0 + gap), 1.1 * (1.0 - gap)],
            ] {
                let stretch = [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]];
                let mut h = product(product(turn, stretch), back);
                (0..3).for_each(|i| h[i][i] -= 1.0);
                out.push(h);
            }
        }
        out
    }

    law_tests! {
        ogden: rubber(), STATES;
        nearly_equal_stretches: rubber(), nearly_equal();
        steep: law(&[(50.0, -25.0), (200.0, 14.0)]), STATES;
    }

    /// Terms with the exponents 2 and −2 are the terms of the Mooney–Rivlin law.
    #[test]
    fn even_exponents_are_mooney_rivlin() {
        let (c10, c01) = (1e4, 2e3);
        for (ogden, c01) in
            [(law(&[(2.0 * c10, 2.0)]), 0.0), (law(&[(2.0 * c10, 2.0), (-2.0 * c01, -2.0)]), c01)]
        {
            let mooney = Law::MooneyRivlin { c10, c01 };
            for h in STATES.into_iter().chain(nearly_equal()) {
                let (a, b) = (ogden.energy3(h, axes()), mooney.energy3(h, axes()));
                // Four square roots and squarings each double the relative rounding error.
                assert!((a - b).abs() <= 64.0 * f64::EPSILON * b.abs(), "{a} {b}");
                let (a, b) = (ogden.tangent3(h, 0.0, axes()), mooney.tangent3(h, 0.0, axes()));
                let scale = b.iter().flatten().fold(0.0, |m: f64, b| m.max(b.abs()));
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    assert!((a - b).abs() < 1e-13 * scale, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn constants_without_stiffness_are_rejected() {
        for (constants, wrong) in [
            (vec![("mu_1", 1e4), ("alpha_1", 0.0)], "alpha_1"),
            (vec![("mu_1", -1e4), ("alpha_1", 2.0)], "mu_1"),
            (vec![("mu_1", 1e4), ("alpha_1", 2.0), ("mu_2", 1e3)], "alpha_2"),
        ] {
            let error = Law::named("ogden", &constants).unwrap_err();
            assert!(matches!(error, FemError::Parameter { name, .. } if name == wrong), "{error}");
        }
    }
}

/// Checks powers of stretches computed from the invariants, over the documented range of stretches.
#[test]
fn powers_are_accurate() {
    for i in -12_i32..=12 {
        for j in -12..=12 {
            let logs = [f64::from(i) / 4.0, f64::from(j) / 4.0, -f64::from(i + j) / 4.0];
            if logs[2].abs() > 3.0 {
                continue;
            }
            let exact = |alpha: f64| logs.iter().map(|l| (alpha * l).exp_m1()).sum::<f64>();
            let [q, r] = logarithm([exact(2.0), exact(-2.0)]);
            for alpha in [1.3, 5.0, -2.0, -25.0, 0.1] {
                let found = traces(q, r, alpha)[0].value;
                // Four square roots each double the relative rounding error, and the exponent multiplies it.
                let largest = logs.iter().fold(1.0, |m: f64, l| m.max((alpha * l).abs()));
                let bound = 64.0 * f64::EPSILON * largest * (3.0 + exact(alpha));
                let error = (found - exact(alpha)).abs();
                assert!(error < bound, "{logs:?} {alpha}: {error:e} {bound:e}");
            }
        }
    }
}

#[test]
fn small_strains_have_full_relative_accuracy() {
    let law = rubber();
    let modulus: f64 = 0.5 * (0.63e6 * 1.3 + 1.2e3 * 5.0 + 1e4 * 2.0);
    let small = Law::SmallStrain { shear_modulus: modulus };
    let h = [[3e-12, 1e-12], [-2e-12, 1e-12]];
    let (a, b) = (law.stress(h, 0.0), small.stress(h, 0.0));
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        // The laws differ by terms of the order of the strain.
        assert!((a / b - 1.0).abs() < 1e-10, "{a} {b}");
    }
    assert!((law.energy(h) / small.energy(h) - 1.0).abs() < 1e-10);
}
