//! Color scale of a field: bands and color bar.

use super::axis::{Axis, steps};
use super::color::Color;
use super::figure::{LABEL_SIZE, TICK_SIZE};
use super::place::Rect;
use super::svg::{Anchor, Stroke, Svg, Type};
use super::text;

const WIDTH: f64 = 7.0;
const GAP: f64 = 5.0;
const N_BANDS: usize = 12;
const N_TICKS: usize = 5;

/// Color bands between levels.
pub(super) struct Bar<'a> {
    axis: &'a Axis,
    /// Levels that separate the bands.
    pub(super) levels: Vec<f64>,
}

impl<'a> Bar<'a> {
    /// Creates bands for the limits of the axis or, without limits, for the range of the values.
    pub(super) fn new(axis: &'a Axis, values: &[f64]) -> Self {
        Self { levels: steps(axis.limits, values, N_BANDS), axis }
    }

    pub(super) fn color(&self, k: usize) -> Color {
        Color::of_fraction((k as f64 + 0.5) / (self.levels.len() - 1) as f64)
    }

    /// Returns the color of a value. Values beyond the limits have the color of the limit.
    pub(super) fn color_of(&self, value: f64) -> Color {
        let above = self.levels.partition_point(|level| *level <= value);
        self.color(above.clamp(1, self.levels.len() - 1) - 1)
    }

    /// Returns about `n` values with their labels, and the power of ten that the labels omit.
    fn labels(&self, n: usize) -> (Vec<(f64, String)>, i32) {
        let (first, last) = (self.levels[0], self.levels[self.levels.len() - 1]);
        let division = Axis::default().between(first, last).divide([].into_iter(), n);
        (division.ticks, division.exponent)
    }

    /// Returns the width of the color bar to the right of a plot.
    pub(super) fn margin(&self) -> f64 {
        let (ticks, exponent) = self.labels(N_TICKS);
        let widths = ticks.iter().map(|(_, label)| text::width(label, TICK_SIZE));
        let label = if self.axis.label(exponent).is_empty() { 0.0 } else { 1.7 * LABEL_SIZE };
        GAP + WIDTH + 3.0 + widths.fold(0.0, f64::max) + label
    }

    pub(super) fn draw(&self, svg: &mut Svg, area: Rect) {
        let x = area.right() + GAP;
        let (low, high) = (self.levels[0], self.levels[self.levels.len() - 1]);
        let at = |value: f64| area.bottom() - area.height * (value - low) / (high - low);
        for (k, level) in self.levels.windows(2).enumerate() {
            let (bottom, top) = (at(level[0]), at(level[1]));
            let cell = Rect { x, y: top, width: WIDTH, height: bottom - top };
            svg.rect(cell, Some(self.color(k)), None);
        }
        let outline = Stroke::solid(Color::BLACK, 0.4);
        svg.rect(Rect { x, width: WIDTH, ..area }, None, Some(outline));
        // On a short color bar, labels are at least one line apart.
        let fitting = (area.height / (2.0 * TICK_SIZE)) as usize;
        let (ticks, exponent) = self.labels(fitting.clamp(2, N_TICKS));
        let mut widest: f64 = 0.0;
        for (value, label) in &ticks {
            let y = at(*value);
            svg.line(&[[x + WIDTH, y], [x + WIDTH + 1.5, y]], outline);
            svg.text([x + WIDTH + 3.0, y + 0.36 * TICK_SIZE], label, Type::of(TICK_SIZE));
            widest = widest.max(text::width(label, TICK_SIZE));
        }
        let style = Type { upward: true, ..Type::of(LABEL_SIZE).anchored(Anchor::Middle) };
        let right = x + WIDTH + 3.0 + widest + 1.25 * LABEL_SIZE;
        svg.text([right, area.y + area.height / 2.0], &self.axis.label(exponent), style);
    }
}
