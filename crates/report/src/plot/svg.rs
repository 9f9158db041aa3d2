//! SVG page in points (1/72 inch).

use std::fmt::Write;

use super::color::Color;
use super::place::{Point, Rect};
use super::{font, text};

/// Text with which every document starts.
const START: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width=""#;

/// Returns whether a document starts like the documents of this program.
pub fn is_own_svg(text: &str) -> bool {
    let family = format!(r#" font-family="{}" role="img">"#, font::FAMILY);
    let mut lines = text.lines();
    let head = lines.next().is_some_and(|line| line.starts_with(START) && line.ends_with(&family));
    head && lines.next().is_some_and(|line| line.starts_with("<title>"))
}

/// Style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub color: Color,
    pub width: f64,
    /// Lengths of dashes and gaps; empty for a solid line.
    pub dashes: &'static [f64],
}

impl Stroke {
    pub const fn solid(color: Color, width: f64) -> Self {
        Self { color, width, dashes: &[] }
    }

    fn attributes(&self) -> String {
        let mut text = format!(
            r#"fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round""#,
            self.color, self.width
        );
        if !self.dashes.is_empty() {
            let lengths: Vec<String> = self.dashes.iter().map(f64::to_string).collect();
            text += &format!(r#" stroke-dasharray="{}""#, lengths.join(" "));
        }
        text
    }
}

/// Alignment of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// Style of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Type {
    pub size: f64,
    pub anchor: Anchor,
    pub color: Color,
    /// Whether the text is vertical.
    pub upward: bool,
    /// Whether a white outline separates the text from the background.
    pub haloed: bool,
}

impl Type {
    /// Creates the style of black text that starts at its anchor point.
    pub fn of(size: f64) -> Self {
        let color = Color::BLACK;
        Self { size, anchor: Anchor::Start, color, upward: false, haloed: false }
    }

    /// Adds a white outline to the text.
    pub(crate) fn haloed(self) -> Self {
        Self { haloed: true, ..self }
    }

    /// Sets the alignment.
    pub(crate) fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }
}

/// Representation of labels in the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lettering {
    /// Searchable text in a font of the reader's system.
    Text,
    /// Outlines from the embedded fonts, which the conversion to pixels requires.
    Outlines,
}

#[derive(Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    lettering: Lettering,
    body: String,
}

impl Svg {
    /// Creates an empty white page.
    pub fn new(width: f64, height: f64, lettering: Lettering) -> Self {
        let mut page = Self { width, height, lettering, body: String::new() };
        page.rect(Rect { x: 0.0, y: 0.0, width, height }, Some(Color::WHITE), None);
        page
    }

    /// Returns the document with its physical size and a title for accessibility.
    pub fn finish(self, title: &str) -> String {
        let Self { width, height, body, .. } = self;
        format!(
            r#"{START}{width:.2}pt" height="{height:.2}pt" viewBox="0 0 {width:.2} {height:.2}" font-family="{}" role="img">
<title>{}</title>
{body}</svg>
"#,
            font::FAMILY,
            myovib_scene::escape(title),
        )
    }

    /// Draws a line through the points.
    pub fn line(&mut self, points: &[Point], stroke: Stroke) {
        self.path(&path(points), stroke);
    }

    /// Draws an SVG path as a line.
    pub fn path(&mut self, path: &str, stroke: Stroke) {
        if !path.is_empty() {
            self.add(format_args!(r#"<path d="{path}" {}/>"#, stroke.attributes()));
        }
    }

    /// Fills an SVG path. A thin edge of the same color closes the gaps between neighbors.
    pub fn fill(&mut self, path: &str, color: Color) {
        if !path.is_empty() {
            self.add(format_args!(
                r#"<path d="{path}" fill="{color}" stroke="{color}" stroke-width="0.15"/>"#
            ));
        }
    }

    /// Draws a filled or outlined rectangle.
    pub fn rect(&mut self, rect: Rect, fill: Option<Color>, stroke: Option<Stroke>) {
        let Rect { x, y, width, height } = rect;
        let place = format!(r#"x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}""#);
        if let Some(color) = fill {
            self.add(format_args!(r#"<rect {place} fill="{color}"/>"#));
        }
        if let Some(stroke) = stroke {
            self.add(format_args!(r#"<rect {place} {}/>"#, stroke.attributes()));
        }
    }

    /// Draws a disc. A thin white outline separates overlapping discs.
    pub fn disc(&mut self, [x, y]: Point, radius: f64, color: Color) {
        self.add(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius}" fill="{color}" stroke="white" stroke-width="0.3"/>"#
        ));
    }

    /// Draws a translucent disc. Overlapping discs look darker.
    pub(crate) fn translucent_disc(&mut self, [x, y]: Point, radius: f64, color: Color) {
        self.add(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius}" fill="{color}" fill-opacity="0.5" stroke="{color}" stroke-width="0.3"/>"#
        ));
    }

    /// Draws a label; see [`text`].
    pub fn text(&mut self, [x, y]: Point, label: &str, style: Type) {
        let mut attributes = String::new();
        if style.color != Color::BLACK {
            attributes += &format!(r#" fill="{}""#, style.color);
        }
        if style.haloed {
            attributes += r#" paint-order="stroke" stroke="white" stroke-width="2""#;
        }
        if style.upward {
            attributes += &format!(r#" transform="rotate(-90 {x:.2} {y:.2})""#);
        }
        let (anchor, share) = match style.anchor {
            Anchor::Start => ("start", 0.0),
            Anchor::Middle => ("middle", 0.5),
            Anchor::End => ("end", 1.0),
        };
        let size = style.size;
        match self.lettering {
            Lettering::Text => {
                let spans = text::spans(label, size);
                self.add(format_args!(
                    r#"<text x="{x:.2}" y="{y:.2}" font-size="{size}" text-anchor="{anchor}"{attributes}>{spans}</text>"#
                ));
            }
            Lettering::Outlines => {
                let start = x - share * text::width(label, size);
                let path = text::outline(label, size, [start, y]);
                self.add(format_args!(r#"<path d="{path}"{attributes}/>"#));
            }
        }
    }

    /// Clips everything that `draw` draws to a rectangle.
    ///
    /// A nested SVG element clips without an id, so several figures can share a document.
    pub fn clipped(&mut self, rect: Rect, draw: impl FnOnce(&mut Self)) {
        let Rect { x, y, width, height } = rect;
        self.add(format_args!(
            r#"<svg x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" viewBox="{x:.2} {y:.2} {width:.2} {height:.2}" preserveAspectRatio="none" overflow="hidden">"#
        ));
        draw(self);
        self.add(format_args!("</svg>"));
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        writeln!(self.body, "{element}").expect("writing to a String cannot fail");
    }
}

/// Returns the SVG path of a polyline through the points; empty for fewer than two points.
pub fn path(points: &[Point]) -> String {
    if points.len() < 2 {
        return String::new();
    }
    let words = points.iter().enumerate().map(|(i, [x, y])| {
        let command = match i {
            0 => "M",
            1 => "L",
            _ => " ",
        };
        format!("{command}{x:.2} {y:.2}")
    });
    words.collect()
}
