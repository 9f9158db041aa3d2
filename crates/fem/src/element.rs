//! Shape functions of the linear and the quadratic triangle.
//!
//! Nodes: the corners, then (quadratic) the midpoints of edges 01, 12, 20. Gradients are with
//! respect to the reference coordinates (ξ, η) = (λ1, λ2), λ0 = 1 − ξ − η.

/// Derivatives of λ0, λ1, λ2 by (ξ, η).
const DLAMBDA: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];

/// The edges' corners, in the order of the midside nodes.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Barycentric coordinates of the nodes of the quadratic triangle; the first three serve the
/// linear.
pub const NODES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

/// Reference gradients of the linear shape functions, whose values are the λ themselves.
pub fn p1_gradients() -> [[f64; 2]; 3] {
    DLAMBDA
}

/// Values of the quadratic shape functions: λi (2 λi − 1) at corners, 4 λi λj at midsides.
pub fn p2_values(lambda: [f64; 3]) -> [f64; 6] {
    let mut values = [0.0; 6];
    for i in 0..3 {
        values[i] = lambda[i] * (2.0 * lambda[i] - 1.0);
        let [a, b] = EDGES[i];
        values[3 + i] = 4.0 * lambda[a] * lambda[b];
    }
    values
}

/// Reference gradients of the quadratic shape functions.
pub fn p2_gradients(lambda: [f64; 3]) -> [[f64; 2]; 6] {
    let mut gradients = [[0.0; 2]; 6];
    for m in 0..2 {
        for i in 0..3 {
            gradients[i][m] = (4.0 * lambda[i] - 1.0) * DLAMBDA[i][m];
            let [a, b] = EDGES[i];
            gradients[3 + i][m] = 4.0 * (lambda[a] * DLAMBDA[b][m] + lambda[b] * DLAMBDA[a][m]);
        }
    }
    gradients
}

/// The inverse of the map's derivative ∂x/∂(ξ, η), and its determinant (twice the area).
pub fn inverse_map([a, b, c]: [[f64; 2]; 3]) -> ([[f64; 2]; 2], f64) {
    let (xi, eta) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let det = xi[0] * eta[1] - eta[0] * xi[1];
    (
        [[eta[1] / det, -eta[0] / det], [-xi[1] / det, xi[0] / det]],
        det,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: [[f64; 3]; 3] = [[0.2, 0.3, 0.5], [0.9, 0.05, 0.05], [0.0, 0.4, 0.6]];

    #[test]
    fn quadratic_functions_are_nodal() {
        for (a, node) in NODES.into_iter().enumerate() {
            for (b, value) in p2_values(node).into_iter().enumerate() {
                assert_eq!(value, if a == b { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn functions_sum_to_one_and_gradients_to_zero() {
        for lambda in SAMPLES {
            assert!((p2_values(lambda).iter().sum::<f64>() - 1.0).abs() < 4.0 * f64::EPSILON);
            for m in 0..2 {
                let sum: f64 = p2_gradients(lambda).iter().map(|g| g[m]).sum();
                assert!(sum.abs() < 8.0 * f64::EPSILON);
                assert_eq!(p1_gradients().iter().map(|g| g[m]).sum::<f64>(), 0.0);
            }
        }
    }

    #[test]
    fn gradients_are_derivatives_of_the_values() {
        let h = 1e-3;
        for lambda in SAMPLES {
            for m in 0..2 {
                let at = |s: f64| p2_values([0, 1, 2].map(|i| lambda[i] + s * h * DLAMBDA[i][m]));
                let (plus, minus, gradients) = (at(1.0), at(-1.0), p2_gradients(lambda));
                for a in 0..6 {
                    // Central differences are exact for quadratics: only rounding / h remains.
                    let slope = (plus[a] - minus[a]) / (2.0 * h);
                    assert!((slope - gradients[a][m]).abs() < 1e-12);
                }
            }
        }
    }
}
