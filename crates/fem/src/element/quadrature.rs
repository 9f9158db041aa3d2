//! Quadrature rules of known degree on triangles, tetrahedra and edges.
//!
//! The rules are symmetric and have positive weights. Points are given in barycentric coordinates, and the sum of
//! the weights is 1, so ∫_T f ≈ |T| Σ w_q f(λ_q).
//!
//! References: Strang and Fix, *An Analysis of the Finite Element Method* (1973), table 4.1; Dunavant, Int. J.
//! Numer. Meth. Eng. 21 (1985) 1129–1148; Walkington, *Quadrature on simplices of arbitrary dimension* (2000);
//! Keast, Comput. Methods Appl. Mech. Eng. 55 (1986) 339–348.

use crate::element::{Barycentric, Shape};

/// Quadrature point and its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Barycentric coordinates.
    pub barycentric: Barycentric,
    /// Weight as a fraction of the element's measure.
    pub weight: f64,
}

/// Quadrature rule on elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Rule {
    /// Exact for polynomials up to degree 2: three points on the triangle, four points on the tetrahedron.
    Degree2,
    /// Exact up to degree 4, with six points on the triangle and fourteen points on the tetrahedron (where it is
    /// exact up to degree 5). The rule integrates all polynomial terms of the plane Taylor–Hood operators exactly.
    #[default]
    Degree4,
    /// Exact up to degree 6: twelve points on the triangle, twenty-four points on the tetrahedron.
    Degree6,
}

impl Rule {
    /// Returns the polynomial degree up to which the rule is exact for all shapes.
    pub fn degree(self) -> usize {
        match self {
            Rule::Degree2 => 2,
            Rule::Degree4 => 4,
            Rule::Degree6 => 6,
        }
    }

    /// Returns the points and weights on elements of the given shape.
    pub fn points(self, shape: &Shape) -> Vec<Point> {
        match shape.dimension {
            2 => self.on_triangle(),
            _ => self.on_tetrahedron(),
        }
    }

    fn on_triangle(self) -> Vec<Point> {
        match self {
            Rule::Degree2 => orbit3(1.0 / 6.0, 1.0 / 3.0).to_vec(),
            Rule::Degree4 => {
                // Closed form of the roots of the rule by Strang and Fix.
                let root = (38.0 - 44.0 * 0.4_f64.sqrt()).sqrt();
                let a = [1.0, -1.0].map(|sign| (8.0 - 10.0_f64.sqrt() + sign * root) / 18.0);
                let spread = (213_125.0 - 53_320.0 * 10.0_f64.sqrt()).sqrt();
                let w = [1.0, -1.0].map(|sign| (620.0 + sign * spread) / 3720.0);
                [orbit3(a[0], w[0]), orbit3(a[1], w[1])].concat()
            }
            Rule::Degree6 => [
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

    fn on_tetrahedron(self) -> Vec<Point> {
        match self {
            Rule::Degree2 => orbit4((5.0 - 5.0_f64.sqrt()) / 20.0, 0.25).to_vec(),
            Rule::Degree4 => [
                &orbit4(0.310_885_919_263_300_6, 0.112_687_925_718_015_85)[..],
                &orbit4(0.092_735_250_310_891_23, 0.073_493_043_116_361_95)[..],
                &pairs(0.045_503_704_125_649_65, 0.042_546_020_777_081_466)[..],
            ]
            .concat(),
            Rule::Degree6 => [
                &orbit4(0.214_602_871_259_152_03, 0.039_922_750_258_167_49)[..],
                &orbit4(0.040_673_958_534_611_35, 0.010_077_211_055_320_643)[..],
                &orbit4(0.322_337_890_142_275_5, 0.055_357_181_543_654_72)[..],
                &orbit12(0.063_661_001_875_017_53, 0.269_672_331_458_315_8, 27.0 / 560.0)[..],
            ]
            .concat(),
        }
    }
}

fn point<const V: usize>(barycentric: [f64; V], weight: f64) -> Point {
    Point { barycentric: barycentric.into(), weight }
}

/// Returns the three points with two coordinates equal to `a`.
fn orbit3(a: f64, weight: f64) -> [Point; 3] {
    let b = 1.0 - 2.0 * a;
    [[b, a, a], [a, b, a], [a, a, b]].map(|lambda| point(lambda, weight))
}

/// Returns the six points whose coordinates are permutations of `a`, `b` and `1 - a - b`.
fn orbit6(a: f64, b: f64, weight: f64) -> [Point; 6] {
    let c = 1.0 - a - b;
    [[a, b, c], [b, c, a], [c, a, b], [b, a, c], [a, c, b], [c, b, a]]
        .map(|lambda| point(lambda, weight))
}

/// Returns the four points with three coordinates equal to `a`.
fn orbit4(a: f64, weight: f64) -> [Point; 4] {
    std::array::from_fn(|i| {
        let mut lambda = [a; 4];
        lambda[i] = 1.0 - 3.0 * a;
        point(lambda, weight)
    })
}

/// All pairs of vertices of a tetrahedron.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Returns the six points with two coordinates equal to `a` and two equal to `1/2 - a`.
fn pairs(a: f64, weight: f64) -> [Point; 6] {
    PAIRS.map(|pair| {
        let mut lambda = [0.5 - a; 4];
        for i in pair {
            lambda[i] = a;
        }
        point(lambda, weight)
    })
}

/// Returns the twelve points with two coordinates equal to `a`, one equal to `b` and one equal to `1 - 2a - b`.
fn orbit12(a: f64, b: f64, weight: f64) -> Vec<Point> {
    let c = 1.0 - 2.0 * a - b;
    let both = PAIRS.iter().flat_map(|&[i, j]| [[i, j], [j, i]]);
    both.map(|[i, j]| {
        let mut lambda = [a; 4];
        (lambda[i], lambda[j]) = (b, c);
        point(lambda, weight)
    })
    .collect()
}

/// Returns the three-point Gauss–Legendre rule on [0, 1] as pairs of a coordinate and a weight. The rule is exact
/// up to degree 5.
///
/// It therefore integrates a quadratic shape function times a cubic traction exactly.
pub(crate) fn edge_degree5() -> [(f64, f64); 3] {
    let offset = 0.5 * 0.6_f64.sqrt();
    [(0.5 - offset, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + offset, 5.0 / 18.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{TETRAHEDRON, TRIANGLE};

    fn factorial(n: u32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    /// Returns ∫ Π λi^ni over a simplex of dimension D, divided by its measure: D! Π ni! / (Σ ni +
    /// D)!.
    fn exact(powers: &[u32]) -> f64 {
        let dimension = powers.len() as u32 - 1;
        factorial(dimension) * powers.iter().map(|&n| factorial(n)).product::<f64>()
            / factorial(powers.iter().sum::<u32>() + dimension)
    }

    fn error(points: &[Point], powers: &[u32]) -> f64 {
        let product = |q: &Point| -> f64 {
            let factors = q.barycentric.iter().zip(powers);
            q.weight * factors.map(|(l, &n)| l.powi(n as i32)).product::<f64>()
        };
        (points.iter().map(product).sum::<f64>() - exact(powers)).abs()
    }

    /// Returns the exponents of all monomials of the given degree in `count` variables.
    fn monomials(count: usize, degree: u32) -> Vec<Vec<u32>> {
        if count == 1 {
            return vec![vec![degree]];
        }
        let with_first = |first: u32| {
            let rest = monomials(count - 1, degree - first);
            rest.into_iter().map(move |mut powers| {
                powers.push(first);
                powers
            })
        };
        (0..=degree).flat_map(with_first).collect()
    }

    #[test]
    fn rules_are_exact_to_their_degree_and_no_further() {
        for shape in [&TRIANGLE, &TETRAHEDRON] {
            for rule in [Rule::Degree2, Rule::Degree4, Rule::Degree6] {
                let points = rule.points(shape);
                // The tetrahedral rule of degree 4 is exact up to degree 5, because no symmetric rule with
                // positive weights has fewer points.
                let better = shape.dimension == 3 && rule == Rule::Degree4;
                let degree = rule.degree() as u32 + u32::from(better);
                for degree in 0..=degree {
                    for powers in monomials(shape.n_vertices(), degree) {
                        // The error is the rounding of at most two dozen terms below 1.
                        let error = error(&points, &powers);
                        assert!(error < 4.0 * f64::EPSILON, "{rule:?} {powers:?} {error:e}");
                    }
                }
                let beyond = monomials(shape.n_vertices(), degree + 1);
                let worst = beyond.iter().map(|powers| error(&points, powers));
                assert!(worst.fold(0.0, f64::max) > 1e-7, "{rule:?} is better than stated");
                assert!(points.iter().all(|q| q.weight > 0.0));
            }
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
