//! Oscillators as points in the complex plane, with their mean.

use super::arrow;
use super::axis::Axis;
use super::color::Color;
use super::figure::{Margins, Panel, TICK_SIZE};
use super::frame::Frame;
use super::legend::{self, Entry, Key};
use super::place::{Point, Rect};
use super::svg::{Stroke, Svg, Type};

const POINT: f64 = 1.9;
const ARROW: Stroke = Stroke::solid(Color::VERMILION, 1.1);

/// Points in the square [−r, r]² with equal scales on both axes.
#[derive(Debug, Clone)]
pub struct ComplexPlane {
    /// Title in the upper left corner, outside the circle on which the points lie; may be empty.
    pub title: String,
    /// Labels of the real and the imaginary axis.
    pub labels: [String; 2],
    pub points: Vec<Point>,
    /// Name of the points in the legend; if empty, the points have no entry.
    pub points_name: String,
    /// End of the arrow that starts at 0.
    pub centroid: Point,
    /// Name of the arrow in the legend; if empty, the arrow has no entry.
    pub centroid_name: String,
    /// Half the side length of the square, r.
    pub radius: f64,
}

impl ComplexPlane {
    fn axes(&self) -> [Axis; 2] {
        self.labels.clone().map(|label| Axis::new(label, "").between(-self.radius, self.radius))
    }

    fn entries(&self) -> Vec<Entry<'_>> {
        vec![
            Entry { name: &self.points_name, key: Key::Disc(Color::BLUE, POINT) },
            Entry { name: &self.centroid_name, key: Key::Arrow(ARROW) },
        ]
    }
}

impl Panel for ComplexPlane {
    fn margins(&self, width: f64, height: f64) -> Margins {
        let [x, y] = self.axes();
        let margins =
            Frame::new((&x, [].into_iter()), (&y, [].into_iter()), (width, height)).margins();
        let header = legend::height("", &self.entries(), width);
        Margins { top: margins.top.max(header), ..margins }
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let [x, y] = self.axes();
        let frame =
            Frame::new((&x, [].into_iter()), (&y, [].into_iter()), (area.width, area.height));
        frame.draw_grid(svg, area);
        let origin = frame.place(area, [0.0, 0.0]);
        let stroke = Stroke::solid(Color::GRAY, 0.5);
        svg.line(&[[area.x, origin[1]], [area.right(), origin[1]]], stroke);
        svg.line(&[[origin[0], area.y], [origin[0], area.bottom()]], stroke);
        let corner = [area.x + 3.0, area.y + 3.0 + 0.72 * TICK_SIZE];
        svg.text(corner, &self.title, Type::of(TICK_SIZE).haloed());
        svg.clipped(area, |svg| {
            arrow::draw(svg, origin, frame.place(area, self.centroid), ARROW);
            for &point in &self.points {
                svg.translucent_disc(frame.place(area, point), POINT, Color::BLUE);
            }
        });
        frame.draw(svg, area);
        legend::draw(svg, area, "", &self.entries());
    }

    fn aspect(&self) -> Option<f64> {
        Some(1.0)
    }
}
