//! Reduction of long series of points to the resolution of a page.

use super::place::Point;

/// Number of columns per point (1/72 inch), finer than the resolution of any printer.
const COLUMNS_PER_POINT: f64 = 8.0;

/// Reduces a line to at most four points per column: the first, lowest, highest and last point. Lines with decreasing
/// abscissas are not changed.
pub(super) fn decimate(points: Vec<Point>) -> Vec<Point> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return points;
    };
    let n_columns = ((last[0] - first[0]) * COLUMNS_PER_POINT).max(1.0);
    let forward = points.windows(2).all(|pair| pair[0][0] <= pair[1][0]);
    if !forward || (points.len() as f64) < 4.0 * n_columns {
        return points;
    }
    let column = |point: &Point| (point[0] * COLUMNS_PER_POINT).floor();
    points.chunk_by(|a, b| column(a) == column(b)).flat_map(extremes).collect()
}

fn extremes(column: &[Point]) -> Vec<Point> {
    let by_height = |&a: &usize, &b: &usize| column[a][1].total_cmp(&column[b][1]);
    let mut kept: Vec<usize> = [
        Some(0),
        (0..column.len()).min_by(by_height),
        (0..column.len()).max_by(by_height),
        Some(column.len() - 1),
    ]
    .into_iter()
    .flatten()
    .collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|i| column[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_survive() {
        let n = 100_000;
        let mut points: Vec<Point> = (0..n)
            .map(|i| f64::from(i) / f64::from(n))
            .map(|s| [100.0 * s, (40.0 * s).sin()])
            .collect();
        points[34_567][1] = 7.0;
        let thin = decimate(points.clone());
        assert!(thin.len() <= 4 * 801, "{}", thin.len());
        assert!(thin.contains(&points[34_567]));
        assert_eq!((thin[0], thin[thin.len() - 1]), (points[0], points[points.len() - 1]));
    }

    #[test]
    fn short_and_turning_lines_are_not_changed() {
        let circle: Vec<Point> =
            (0..5000).map(|i| f64::from(i) * 1e-2).map(|s| [s.cos(), s.sin()]).collect();
        assert_eq!(decimate(circle.clone()), circle);
        assert_eq!(decimate(vec![]), Vec::<Point>::new());
    }
}
