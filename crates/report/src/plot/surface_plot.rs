//! Plots of the shaded surface of a 3D body, drawn from back to front.

use super::arrow;
use super::axis::Axis;
use super::bar::Bar;
use super::color::Color;
use super::figure::{Margins, Panel, TICK_SIZE};
use super::legend::{self, Entry, Key};
use super::place::{Point, Rect};
use super::svg::{self, Stroke, Svg, Type};
use crate::vector::{self, Place, dot, length};

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Paint {
    /// Color that belongs to a value of the field.
    Value(f64),
    /// Fixed color.
    Plain(Color),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Corners, counterclockwise as seen from outside.
    pub corners: [Place; 3],
    /// Color before shading.
    pub paint: Paint,
}

/// Closed surface in parallel projection, seen from the front (−y), slightly from the right and from above (z).
#[derive(Debug, Clone, Default)]
pub struct SurfacePlot {
    /// Title above the plot; may be empty.
    pub title: String,
    pub faces: Vec<Face>,
    /// Label, unit and limits of the field, if there is one.
    pub field: Option<Axis>,
    /// Names and colors of the legend entries.
    pub groups: Vec<(String, Color)>,
    pub edges: bool,
    /// Outlines of obstacles, which are drawn over the body.
    pub obstacles: Vec<Vec<Place>>,
    /// Additional points that the picture must contain, so that all frames of a movie have the same limits.
    pub around: Vec<Place>,
}

/// Direction of view: angles (rad) to the right and upward.
const AZIMUTH: f64 = 0.5;
const ELEVATION: f64 = 0.42;
/// Direction toward the light in the axes of the page (right, up, toward the viewer).
const LIGHT: Place = [-0.35, 0.6, 0.72];
/// Brightness of surfaces in the shadow.
const SHADOW: f64 = 0.5;
/// Distance in points by which triangles are enlarged to hide the seams between them.
const SEAM: f64 = 0.2;
const ARROW: f64 = 13.0;
const OBSTACLE: f64 = 0.7;
const BELOW: f64 = 2.0 * ARROW;

/// Transforms a point to the axes of the page: right, up, and toward the viewer.
fn seen([x, y, z]: Place) -> Place {
    let ((s, c), (se, ce)) = (AZIMUTH.sin_cos(), ELEVATION.sin_cos());
    [c * x + s * y, se * (c * y - s * x) + ce * z, ce * (s * x - c * y) + se * z]
}

/// Returns the unit normal of a triangle, or zero if the triangle has no area.
fn normal(corners: &[Place; 3]) -> Place {
    let normal = vector::normal(*corners);
    let length = length(normal);
    normal.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

/// Returns whether a triangle faces the viewer. The corners of the triangle must be counterclockwise as seen from
/// outside.
pub(crate) fn faces_the_eye(corners: &[Place; 3]) -> bool {
    normal(&corners.map(seen))[2] > 0.0
}

impl SurfacePlot {
    /// Returns the minimum and the maximum of the body along each axis of the page.
    fn limits(&self) -> [[f64; 2]; 2] {
        let mut limits = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        let corners = self.faces.iter().flat_map(|face| face.corners);
        for place in corners.chain(self.around.iter().copied()) {
            for (limit, x) in limits.iter_mut().zip(seen(place)) {
                *limit = [limit[0].min(x), limit[1].max(x)];
            }
        }
        limits
    }

    fn bar(&self) -> Option<Bar<'_>> {
        let value = |face: &Face| match face.paint {
            Paint::Value(value) => Some(value),
            Paint::Plain(_) => None,
        };
        let values: Vec<f64> = self.faces.iter().filter_map(value).collect();
        self.field.as_ref().map(|axis| Bar::new(axis, &values))
    }

    fn entries<'a>(&'a self) -> Vec<Entry<'a>> {
        let entry = |(name, color): &'a (String, Color)| Entry { name, key: Key::Square(*color) };
        self.groups.iter().map(entry).collect()
    }

    /// Returns the visible triangles from back to front, in the axes of the page.
    fn visible(&self) -> Vec<([Place; 3], Paint)> {
        let seen_faces = self.faces.iter().filter(|f| faces_the_eye(&f.corners));
        let mut visible: Vec<_> =
            seen_faces.map(|face| (face.corners.map(seen), face.paint)).collect();
        let depth = |corners: &[Place; 3]| corners.iter().map(|corner| corner[2]).sum::<f64>();
        visible.sort_by(|a, b| depth(&a.0).total_cmp(&depth(&b.0)));
        visible
    }
}

impl Panel for SurfacePlot {
    fn margins(&self, width: f64, _: f64) -> Margins {
        Margins {
            left: 2.0,
            right: self.bar().map_or(2.0, |bar| bar.margin()),
            top: legend::height(&self.title, &self.entries(), width).max(2.0),
            bottom: BELOW,
        }
    }

    fn aspect(&self) -> Option<f64> {
        let [x, y] = self.limits().map(|[low, high]| high - low);
        // The color bar needs a minimum height.
        Some((y / x).max(0.4))
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let [x, y] = self.limits();
        let scale = (area.width / (x[1] - x[0])).min(area.height / (y[1] - y[0]));
        let middle = [x, y].map(|[low, high]| 0.5 * (low + high));
        let place = |corner: Place| -> Point {
            [
                area.x + 0.5 * area.width + scale * (corner[0] - middle[0]),
                area.y + 0.5 * area.height - scale * (corner[1] - middle[1]),
            ]
        };
        let bar = self.bar();
        for (corners, paint) in self.visible() {
            let color = match (paint, &bar) {
                (Paint::Plain(color), _) => color,
                (Paint::Value(value), Some(bar)) => bar.color_of(value),
                (Paint::Value(_), None) => Color::GRAY,
            };
            let light = dot(normal(&corners), LIGHT).max(0.0);
            let shaded = color.darker(SHADOW + (1.0 - SHADOW) * light);
            let placed = corners.map(place);
            svg.fill(&format!("{}Z", svg::path(&grown(placed))), shaded);
            if self.edges {
                let outline = Stroke::solid(Color::GRAY, 0.2);
                svg.path(&format!("{}Z", svg::path(&placed)), outline);
            }
        }
        svg.clipped(area, |svg| {
            for outline in &self.obstacles {
                let placed: Vec<Point> = outline.iter().map(|&at| place(seen(at))).collect();
                svg.path(&svg::path(&placed), Stroke::solid(Color::BLACK, OBSTACLE));
            }
        });
        if let Some(bar) = &bar {
            bar.draw(svg, area);
        }
        draw_axes(svg, [area.x + ARROW, area.bottom() + BELOW - 0.6 * ARROW]);
        legend::draw(svg, area, &self.title, &self.entries());
    }
}

/// Enlarges a triangle away from its center.
fn grown(corners: [Point; 3]) -> [Point; 3] {
    let center = [0, 1].map(|i| corners.iter().map(|corner| corner[i]).sum::<f64>() / 3.0);
    corners.map(|corner| {
        let out = [corner[0] - center[0], corner[1] - center[1]];
        let length = out[0].hypot(out[1]).max(SEAM);
        [0, 1].map(|i| corner[i] + SEAM * out[i] / length)
    })
}

/// Draws the directions of the coordinate axes at a point of the page.
fn draw_axes(svg: &mut Svg, [x, y]: Point) {
    for (axis, name) in ["*x*", "*y*", "*z*"].into_iter().enumerate() {
        let mut along = [0.0; 3];
        along[axis] = 1.0;
        let [right, up, _] = seen(along);
        let to = [x + ARROW * right, y - ARROW * up];
        arrow::draw(svg, [x, y], to, Stroke::solid(Color::BLACK, 0.7));
        let label =
            [x + 1.3 * ARROW * right - 0.25 * TICK_SIZE, y - 1.3 * ARROW * up + 0.3 * TICK_SIZE];
        svg.text(label, name, Type::of(TICK_SIZE));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the six sides of a unit cube, each divided into two triangles. The value of a triangle is the index of
    /// its side.
    fn cube() -> Vec<Face> {
        let corner = |i: usize| [i & 1, (i >> 1) & 1, (i >> 2) & 1].map(|b| b as f64);
        let sides =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = sides.into_iter().enumerate().flat_map(|(k, [a, b, c, d])| {
            [[a, b, c], [a, c, d]].map(|triangle| Face {
                corners: triangle.map(corner),
                paint: Paint::Value(k as f64),
            })
        });
        faces.collect()
    }

    /// Checks that the sides x = 1, y = 0 and z = 1 are visible, because the view is from the front, the right and
    /// above.
    #[test]
    fn three_sides_of_a_cube_are_visible() {
        let plot = SurfacePlot { faces: cube(), ..SurfacePlot::default() };
        let mut seen: Vec<f64> = plot
            .visible()
            .iter()
            .map(|(_, paint)| match paint {
                Paint::Value(value) => *value,
                Paint::Plain(_) => f64::NAN,
            })
            .collect();
        seen.sort_by(f64::total_cmp);
        assert_eq!(seen, [1.0, 1.0, 2.0, 2.0, 5.0, 5.0]);
    }

    /// Checks that the transformation preserves the length √(x² + y² + z²) of any vector.
    #[test]
    fn the_view_is_a_rotation() {
        for place in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, -0.7, 2.0]] {
            let turned = seen(place);
            assert!((dot(turned, turned) - dot(place, place)).abs() < 1e-15 * 8.0);
        }
    }

    /// Checks that a near triangle, which covers a far one, is drawn later.
    #[test]
    fn near_triangles_are_drawn_last() {
        let small = |y: f64, color| Face {
            corners: [[0.0, y, 0.0], [1.0, y, 0.0], [0.0, y, 1.0]],
            paint: Paint::Plain(color),
        };
        let plot = SurfacePlot {
            faces: vec![small(0.0, Color::BLUE), small(5.0, Color::GREEN)],
            ..SurfacePlot::default()
        };
        let drawn: Vec<Paint> = plot.visible().into_iter().map(|(_, paint)| paint).collect();
        assert_eq!(drawn, [Color::GREEN, Color::BLUE].map(Paint::Plain));
    }
}
