//! Filled contours of a piecewise linear function on triangles.

use super::place::Point;

/// Polygon with a value at each corner.
type Valued = Vec<(Point, f64)>;

/// Returns the part of the triangle with `low <= value <= high`, possibly empty.
///
/// # Examples
/// ```
/// use myovib_report::plot::bands::band;
/// let triangle = [([0.0, 0.0], 0.0), ([1.0, 0.0], 1.0), ([0.0, 1.0], 0.0)];
/// let half = band(&triangle, 0.5, 1.0);
/// assert_eq!(half, [[0.5, 0.0], [1.0, 0.0], [0.5, 0.5]]);
/// ```
pub fn band(triangle: &[(Point, f64); 3], low: f64, high: f64) -> Vec<Point> {
    let above = cut(triangle.to_vec(), |value| value - low);
    let between = cut(above, |value| high - value);
    between.into_iter().map(|(point, _)| point).collect()
}

/// Clips a convex polygon to the part in which the `excess` of the value is non-negative.
fn cut(polygon: Valued, excess: impl Fn(f64) -> f64) -> Valued {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &(point, value)) in polygon.iter().enumerate() {
        let (next, next_value) = polygon[(i + 1) % polygon.len()];
        let (here, there) = (excess(value), excess(next_value));
        if here >= 0.0 {
            kept.push((point, value));
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let s = here / (here - there);
            let mix = |a: f64, b: f64| a + s * (b - a);
            let crossing = [mix(point[0], next[0]), mix(point[1], next[1])];
            kept.push((crossing, mix(value, next_value)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[Point]) -> f64 {
        let n = polygon.len();
        let cross = |i: usize| {
            let ([a, b], [c, d]) = (polygon[i], polygon[(i + 1) % n]);
            a * d - b * c
        };
        (0..n).map(cross).sum::<f64>() / 2.0
    }

    #[test]
    fn bands_cover_the_triangle_once() {
        let triangle = [([0.1, 0.0], -1.0), ([2.0, 0.3], 2.5), ([0.4, 1.7], 0.7)];
        let whole = area(&triangle.map(|(point, _)| point));
        let levels = [-2.0, -0.5, 0.0, 0.7, 1.1, 2.0, 3.0];
        let sum: f64 = levels.windows(2).map(|l| area(&band(&triangle, l[0], l[1]))).sum();
        assert!((sum - whole).abs() < 1e-14 * 10.0, "{sum} {whole}");
        assert!(band(&triangle, 3.0, 4.0).is_empty());
    }
}
