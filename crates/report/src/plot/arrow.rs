//! Arrows.

use super::place::Point;
use super::svg::{self, Stroke, Svg};

/// Length of the arrowhead in line widths. The head of a short arrow is at most half as long as the arrow.
const HEAD: f64 = 4.5;

/// Draws an arrow, or nothing if its ends coincide.
pub(super) fn draw(svg: &mut Svg, from: Point, to: Point, stroke: Stroke) {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    if length <= 0.0 {
        return;
    }
    let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    let head = (HEAD * stroke.width).min(length / 2.0);
    let neck = [to[0] - head * along[0], to[1] - head * along[1]];
    let side = |sign: f64| {
        let half = sign * 0.45 * head;
        [neck[0] - half * along[1], neck[1] + half * along[0]]
    };
    svg.line(&[from, neck], stroke);
    svg.fill(&format!("{}Z", svg::path(&[to, side(1.0), side(-1.0)])), stroke.color);
}
