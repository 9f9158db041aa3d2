//! Frame of a plot: ticks, grid, labels, and the mapping of values to positions on the page.

use super::axis::{Axis, Division};
use super::color::Color;
use super::figure::{LABEL_SIZE, Margins, TICK_SIZE};
use super::place::{Point, Rect};
use super::svg::{Anchor, Stroke, Svg, Type};
use super::text;

const TICK: f64 = 2.5;
const MINOR_TICK: f64 = 1.5;
const GAP: f64 = 2.5;
/// Minimum distances between ticks along the horizontal and the vertical axis.
const PER_X_TICK: f64 = 34.0;
const PER_Y_TICK: f64 = 15.0;

/// Two axes with ticks.
pub(super) struct Frame<'a> {
    axes: [&'a Axis; 2],
    x: Division,
    y: Division,
}

impl<'a> Frame<'a> {
    /// Computes ticks for the given data in an area of the given width and height.
    pub(super) fn new(
        (x, xs): (&'a Axis, impl Iterator<Item = f64>),
        (y, ys): (&'a Axis, impl Iterator<Item = f64>),
        (width, height): (f64, f64),
    ) -> Self {
        let fit = |length: f64, each: f64| ((length / each) as usize).clamp(3, 8);
        let x_division = x.divide(xs, fit(width, PER_X_TICK));
        let y_division = y.divide(ys, fit(height, PER_Y_TICK));
        Self { axes: [x, y], x: x_division, y: y_division }
    }

    /// Returns the space required for ticks and labels.
    pub(super) fn margins(&self) -> Margins {
        let widths = self.y.ticks.iter().map(|(_, label)| text::width(label, TICK_SIZE));
        let widest = widths.fold(0.0, f64::max);
        let overhang = self.x.ticks.last().map_or(0.0, |(_, l)| text::width(l, TICK_SIZE) / 2.0);
        Margins {
            left: TICK + GAP + widest + GAP + 1.3 * LABEL_SIZE,
            right: overhang.max(2.0) + 1.0,
            top: TICK_SIZE / 2.0,
            bottom: TICK + GAP + TICK_SIZE + GAP + 1.3 * LABEL_SIZE,
        }
    }

    /// Returns the position of a pair of values on the page.
    pub(super) fn place(&self, area: Rect, [x, y]: Point) -> Point {
        [area.x + area.width * self.x.fraction(x), area.bottom() - area.height * self.y.fraction(y)]
    }

    /// Draws the grid; called before the data is drawn.
    pub(super) fn draw_grid(&self, svg: &mut Svg, area: Rect) {
        let stroke = Stroke::solid(Color::PALE, 0.4);
        for (value, _) in &self.x.ticks {
            let x = area.x + area.width * self.x.fraction(*value);
            svg.line(&[[x, area.y], [x, area.bottom()]], stroke);
        }
        for (value, _) in &self.y.ticks {
            let y = area.bottom() - area.height * self.y.fraction(*value);
            svg.line(&[[area.x, y], [area.right(), y]], stroke);
        }
    }

    /// Draws the box, ticks and labels; called after the data is drawn.
    pub(super) fn draw(&self, svg: &mut Svg, area: Rect) {
        let stroke = Stroke::solid(Color::BLACK, 0.5);
        svg.rect(area, None, Some(stroke));
        self.draw_x(svg, area, stroke);
        self.draw_y(svg, area, stroke);
    }

    fn draw_x(&self, svg: &mut Svg, area: Rect, stroke: Stroke) {
        let at = |value: f64| area.x + area.width * self.x.fraction(value);
        let bottom = area.bottom();
        for &value in &self.x.minor {
            svg.line(&[[at(value), bottom], [at(value), bottom + MINOR_TICK]], stroke);
        }
        let style = Type::of(TICK_SIZE).anchored(Anchor::Middle);
        let base = bottom + TICK + GAP + 0.75 * TICK_SIZE;
        for (value, label) in &self.x.ticks {
            svg.line(&[[at(*value), bottom], [at(*value), bottom + TICK]], stroke);
            svg.text([at(*value), base], label, style);
        }
        let label = self.axes[0].label(self.x.exponent);
        let style = Type::of(LABEL_SIZE).anchored(Anchor::Middle);
        svg.text([area.x + area.width / 2.0, base + GAP + LABEL_SIZE], &label, style);
    }

    fn draw_y(&self, svg: &mut Svg, area: Rect, stroke: Stroke) {
        let at = |value: f64| area.bottom() - area.height * self.y.fraction(value);
        for &value in &self.y.minor {
            svg.line(&[[area.x - MINOR_TICK, at(value)], [area.x, at(value)]], stroke);
        }
        let style = Type::of(TICK_SIZE).anchored(Anchor::End);
        for (value, label) in &self.y.ticks {
            svg.line(&[[area.x - TICK, at(*value)], [area.x, at(*value)]], stroke);
            svg.text([area.x - TICK - GAP, at(*value) + 0.36 * TICK_SIZE], label, style);
        }
        let label = self.axes[1].label(self.y.exponent);
        let style = Type { upward: true, ..Type::of(LABEL_SIZE).anchored(Anchor::Middle) };
        // The position of the label depends on the widest tick label. Panels in a column share the largest margin, so
        // their labels may have different distances from the axis.
        let x = area.x - self.margins().left + LABEL_SIZE;
        svg.text([x, area.y + area.height / 2.0], &label, style);
    }
}
