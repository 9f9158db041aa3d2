//! Curves and points over two axes, linear or logarithmic.

use super::axis::Axis;
use super::colour::Colour;
use super::decimate::decimate;
use super::figure::{Margins, Panel};
use super::frame::Frame;
use super::legend::{self, Entry, Key};
use super::place::{Point, Rect};
use super::svg::{Stroke, Svg};

/// Dashes by series, so that curves stay apart in grey print.
const DASHES: [&[f64]; 4] = [&[], &[4.0, 1.5], &[1.2, 1.2], &[6.0, 1.5, 1.2, 1.5]];

/// Radius of a marked point.
const MARKER: f64 = 1.7;

/// One curve.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name in the legend; none if empty.
    pub name: String,
    /// Its points; a coordinate that is not finite interrupts the curve.
    pub points: Vec<Point>,
    /// Its colour; by its place in the plot if `None`.
    pub colour: Option<Colour>,
    /// Whether the points are joined.
    pub joined: bool,
    /// Whether the points are marked.
    pub marked: bool,
}

impl Series {
    /// A curve through the points.
    ///
    /// # Panics
    /// When the two have different lengths.
    pub fn curve(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        assert_eq!(x.len(), y.len(), "as many abscissas as ordinates");
        let points = x.iter().zip(y).map(|(&x, &y)| [x, y]).collect();
        Self {
            name: name.into(),
            points,
            colour: None,
            joined: true,
            marked: false,
        }
    }

    /// The same, with its points marked.
    pub fn marked(self) -> Self {
        Self {
            marked: true,
            ..self
        }
    }

    /// The same, with points only.
    pub fn unjoined(self) -> Self {
        Self {
            joined: false,
            marked: true,
            ..self
        }
    }

    /// The same, in this colour and solid.
    pub fn coloured(self, colour: Colour) -> Self {
        Self {
            colour: Some(colour),
            ..self
        }
    }
}

/// Curves over two axes.
#[derive(Debug, Clone, Default)]
pub struct LinePlot {
    /// Above the plot; none if empty.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, drawn in this order.
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
            (false, _) => Key::Disc(pen(i, series).colour, MARKER),
        };
        let series = self.series.iter().enumerate();
        series
            .map(|(i, s)| Entry {
                name: &s.name,
                key: key((i, s)),
            })
            .collect()
    }
}

impl Panel for LinePlot {
    fn margins(&self, width: f64, height: f64) -> Margins {
        let margins = self.frame(width, height).margins();
        let header = legend::height(&self.title, &self.entries(), width);
        Margins {
            top: margins.top.max(header),
            ..margins
        }
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let frame = self.frame(area.width, area.height);
        frame.draw_grid(svg, area);
        svg.clipped(area, |svg| {
            for (i, series) in self
                .series
                .iter()
                .enumerate()
                .filter(|(_, series)| series.joined)
            {
                draw_curve(svg, area, &frame, series, pen(i, series));
            }
        });
        for (i, series) in self
            .series
            .iter()
            .enumerate()
            .filter(|(_, series)| series.marked)
        {
            draw_markers(svg, area, &frame, series, pen(i, series).colour);
        }
        frame.draw(svg, area);
        legend::draw(svg, area, &self.title, &self.entries());
    }
}

fn pen(i: usize, series: &Series) -> Stroke {
    let dashes = match (series.colour, series.marked) {
        (Some(_), _) => 0,
        // Markers take the place of dashes, until colours come again.
        (None, true) => i / Colour::N_SERIES,
        (None, false) => i,
    };
    let colour = series.colour.unwrap_or_else(|| Colour::of_series(i));
    Stroke {
        colour,
        width: 0.9,
        dashes: DASHES[dashes % DASHES.len()],
    }
}

fn draw_curve(svg: &mut Svg, area: Rect, frame: &Frame, series: &Series, pen: Stroke) {
    let placed: Vec<Point> = series
        .points
        .iter()
        .map(|&p| frame.place(area, p))
        .collect();
    for piece in placed.split(|point| !point.iter().all(|coordinate| coordinate.is_finite())) {
        svg.line(&decimate(piece.to_vec()), pen);
    }
}

/// Markers within the area; those at its edge are not cut.
fn draw_markers(svg: &mut Svg, area: Rect, frame: &Frame, series: &Series, colour: Colour) {
    let placed = series.points.iter().map(|&p| frame.place(area, p));
    for point in placed.filter(|&point| area.contains(point)) {
        svg.disc(point, MARKER, colour);
    }
}
