//! Plots of curves and points on two linear or logarithmic axes.

use super::axis::Axis;
use super::color::Color;
use super::decimate::decimate;
use super::figure::{Margins, Panel};
use super::frame::Frame;
use super::legend::{self, Entry, Key};
use super::place::{Point, Rect};
use super::svg::{Stroke, Svg};

/// Dash patterns of the series, which make curves distinguishable in grayscale.
const DASHES: [&[f64]; 4] = [&[], &[4.0, 1.5], &[1.2, 1.2], &[6.0, 1.5, 1.2, 1.5]];

const MARKER: f64 = 1.7;

#[derive(Debug, Clone)]
pub struct Series {
    /// Name in the legend; may be empty.
    pub name: String,
    /// Points; a non-finite coordinate interrupts the curve.
    pub points: Vec<Point>,
    /// Color; by default, the color that belongs to the index of the series in the plot.
    pub color: Option<Color>,
    /// Whether the points are connected.
    pub joined: bool,
    pub marked: bool,
}

impl Series {
    /// Creates a curve through the points.
    ///
    /// # Panics
    /// Panics if the lengths differ.
    pub fn curve(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        assert_eq!(x.len(), y.len(), "x and y have equal lengths");
        let points = x.iter().zip(y).map(|(&x, &y)| [x, y]).collect();
        Self { name: name.into(), points, color: None, joined: true, marked: false }
    }

    pub fn marked(self) -> Self {
        Self { marked: true, ..self }
    }

    /// Shows only the points, without a line.
    pub(crate) fn unjoined(self) -> Self {
        Self { joined: false, marked: true, ..self }
    }

    /// Sets the color; lines are solid.
    pub fn colored(self, color: Color) -> Self {
        Self { color: Some(color), ..self }
    }
}

#[derive(Debug, Clone, Default)]
pub struct LinePlot {
    /// Title above the plot; may be empty.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// Series in the order in which they are drawn.
    pub series: Vec<Series>,
}

impl LinePlot {
    fn frame(&self, width: f64, height: f64) -> Frame<'_> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        Frame::new(
            (&self.x, points().map(|point| point[0])),
            (&self.y, points().map(|point| point[1])),
            (width, height),
        )
    }

    fn entries(&self) -> Vec<Entry<'_>> {
        let key = |(i, series): (usize, &Series)| match (series.joined, series.marked) {
            (true, true) => Key::DiscOnLine(pen(i, series), MARKER),
            (true, false) => Key::Line(pen(i, series)),
            (false, _) => Key::Disc(pen(i, series).color, MARKER),
        };
        let series = self.series.iter().enumerate();
        series.map(|(i, s)| Entry { name: &s.name, key: key((i, s)) }).collect()
    }
}

impl Panel for LinePlot {
    fn margins(&self, width: f64, height: f64) -> Margins {
        let margins = self.frame(width, height).margins();
        let header = legend::height(&self.title, &self.entries(), width);
        Margins { top: margins.top.max(header), ..margins }
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let frame = self.frame(area.width, area.height);
        frame.draw_grid(svg, area);
        svg.clipped(area, |svg| {
            for (i, series) in self.series.iter().enumerate().filter(|(_, series)| series.joined) {
                draw_curve(svg, area, &frame, series, pen(i, series));
            }
        });
        for (i, series) in self.series.iter().enumerate().filter(|(_, series)| series.marked) {
            draw_markers(svg, area, &frame, series, pen(i, series).color);
        }
        frame.draw(svg, area);
        legend::draw(svg, area, &self.title, &self.entries());
    }
}

fn pen(i: usize, series: &Series) -> Stroke {
    let dashes = match (series.color, series.marked) {
        (Some(_), _) => 0,
        // Series with markers have solid lines until the colors repeat.
        (None, true) => i / Color::N_SERIES,
        (None, false) => i,
    };
    let color = series.color.unwrap_or_else(|| Color::of_series(i));
    Stroke { color, width: 0.9, dashes: DASHES[dashes % DASHES.len()] }
}

fn draw_curve(svg: &mut Svg, area: Rect, frame: &Frame, series: &Series, pen: Stroke) {
    let placed: Vec<Point> = series.points.iter().map(|&p| frame.place(area, p)).collect();
    for piece in placed.split(|point| !point.iter().all(|coordinate| coordinate.is_finite())) {
        svg.line(&decimate(piece.to_vec()), pen);
    }
}

/// Draws the markers of all points inside the area. Markers at the edge of the area are not clipped.
fn draw_markers(svg: &mut Svg, area: Rect, frame: &Frame, series: &Series, color: Color) {
    let placed = series.points.iter().map(|&p| frame.place(area, p));
    for point in placed.filter(|&point| area.contains(point)) {
        svg.disc(point, MARKER, color);
    }
}
