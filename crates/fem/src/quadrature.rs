//! Quadrature rules with stated degree, on the triangle and on the edge.
//!
//! Triangle rules are symmetric with positive weights; points are barycentric and weights sum to 1,
//! so that ∫_T f ≈ |T| Σ w_q f(λ_q). Edge rules are Gauss–Legendre on [0, 1].
//!
//! References: Strang and Fix, *An Analysis of the Finite Element Method* (1973), table 4.1;
//! Dunavant, Int. J. Numer. Meth. Eng. 21 (1985) 1129–1148.

/// A point in barycentric coordinates and its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrianglePoint {
    /// Barycentric coordinates, which sum to 1.
    pub barycentric: [f64; 3],
    /// Fraction of the triangle's area.
    pub weight: f64,
}

/// A quadrature rule on triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TriangleRule {
    /// Three points, exact for polynomials of degree 2.
    Degree2,
    /// Six points, exact for degree 4: all terms of the Taylor–Hood operators that are polynomial.
    #[default]
    Degree4,
    /// Twelve points, exact for degree 6.
    Degree6,
}

impl TriangleRule {
    /// The rule integrates polynomials up to this degree exactly.
    pub fn degree(self) -> usize {
        match self {
            TriangleRule::Degree2 => 2,
            TriangleRule::Degree4 => 4,
            TriangleRule::Degree6 => 6,
        }
    }

    /// The points and weights.
    pub fn points(self) -> Vec<TrianglePoint> {
        match self {
            TriangleRule::Degree2 => orbit3(1.0 / 6.0, 1.0 / 3.0).to_vec(),
            TriangleRule::Degree4 => {
                // The roots of Strang and Fix' rule in closed form.
                let root = (38.0 - 44.0 * 0.4_f64.sqrt()).sqrt();
                let a = [1.0, -1.0].map(|sign| (8.0 - 10.0_f64.sqrt() + sign * root) / 18.0);
                let spread = (213_125.0 - 53_320.0 * 10.0_f64.sqrt()).sqrt();
                let w = [1.0, -1.0].map(|sign| (620.0 + sign * spread) / 3720.0);
                [orbit3(a[0], w[0]), orbit3(a[1], w[1])].concat()
            }
            TriangleRule::Degree6 => [
                &orbit3(0.249_286_745_170_910_4, 0.116_786_275_726_379_37)[..],
                &orbit3(0.063_089_014_491_502_23, 0.050_844_906_370_206_82)[..],
                &orbit6(
                    0.053_145_049_844_816_95,
                    0.310_352_451_033_784_4,
                    0.082_851_075_618_373_57,
                )[..],
            ]
            .concat(),
        }
    }
}

/// The three points with two equal coordinates `a`.
fn orbit3(a: f64, weight: f64) -> [TrianglePoint; 3] {
    let b = 1.0 - 2.0 * a;
    [[b, a, a], [a, b, a], [a, a, b]].map(|barycentric| TrianglePoint {
        barycentric,
        weight,
    })
}

/// The six points with coordinates `a`, `b`, `1 - a - b` in any order.
fn orbit6(a: f64, b: f64, weight: f64) -> [TrianglePoint; 6] {
    let c = 1.0 - a - b;
    [
        [a, b, c],
        [b, c, a],
        [c, a, b],
        [b, a, c],
        [a, c, b],
        [c, b, a],
    ]
    .map(|barycentric| TrianglePoint {
        barycentric,
        weight,
    })
}

/// Gauss–Legendre with three points on [0, 1], exact for degree 5: pairs of place and weight.
///
/// Enough for a quadratic shape function times a cubic traction.
pub fn edge_degree5() -> [(f64, f64); 3] {
    let offset = 0.5 * 0.6_f64.sqrt();
    [
        (0.5 - offset, 5.0 / 18.0),
        (0.5, 4.0 / 9.0),
        (0.5 + offset, 5.0 / 18.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ λ0^a λ1^b λ2^c over the triangle, divided by its area: 2 a! b! c! / (a + b + c + 2)!.
    fn exact(powers: [u32; 3]) -> f64 {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        2.0 * powers.map(factorial).iter().product::<f64>()
            / factorial(powers.iter().sum::<u32>() + 2)
    }

    fn error(rule: TriangleRule, powers: [u32; 3]) -> f64 {
        let sum: f64 = rule
            .points()
            .iter()
            .map(|q| {
                q.weight
                    * q.barycentric
                        .iter()
                        .zip(powers)
                        .map(|(l, n)| l.powi(n as i32))
                        .product::<f64>()
            })
            .sum();
        (sum - exact(powers)).abs()
    }

    #[test]
    fn triangle_rules_are_exact_to_their_degree_and_no_further() {
        for rule in [
            TriangleRule::Degree2,
            TriangleRule::Degree4,
            TriangleRule::Degree6,
        ] {
            let degree = rule.degree() as u32;
            for a in 0..=degree {
                for b in 0..=degree - a {
                    for c in 0..=degree - a - b {
                        // Rounding of at most twelve terms below 1.
                        assert!(
                            error(rule, [a, b, c]) < 4.0 * f64::EPSILON,
                            "{rule:?} {a} {b} {c}"
                        );
                    }
                }
            }
            assert!(
                error(rule, [degree + 1, 0, 0]) > 1e-6,
                "{rule:?} is better than stated"
            );
            assert!(rule.points().iter().all(|q| q.weight > 0.0));
        }
    }

    #[test]
    fn edge_rule_is_exact_to_degree_five_and_no_further() {
        let error = |n: i32| {
            let sum: f64 = edge_degree5().iter().map(|(s, w)| w * s.powi(n)).sum();
            (sum - 1.0 / f64::from(n + 1)).abs()
        };
        assert!((0..=5).all(|n| error(n) < 4.0 * f64::EPSILON));
        assert!(error(6) > 1e-5);
    }
}
