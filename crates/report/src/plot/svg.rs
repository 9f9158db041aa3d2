//! A page of SVG, in points (1/72 inch).

use std::fmt::Write;

use super::colour::Colour;
use super::place::{Point, Rect};
use super::{font, text};

/// The beginning of a page.
const START: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width=""#;

/// Whether a document begins as those of this program do.
pub fn is_own_svg(text: &str) -> bool {
    let family = format!(r#" font-family="{}" role="img">"#, font::FAMILY);
    let mut lines = text.lines();
    let head = lines
        .next()
        .is_some_and(|line| line.starts_with(START) && line.ends_with(&family));
    head && lines.next().is_some_and(|line| line.starts_with("<title>"))
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Its width.
    pub width: f64,
    /// Lengths of dashes and gaps; empty for a solid line.
    pub dashes: &'static [f64],
}

impl Stroke {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dashes: &[],
        }
    }

    fn attributes(&self) -> String {
        let mut text = format!(
            r#"fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round""#,
            self.colour, self.width
        );
        if !self.dashes.is_empty() {
            let lengths: Vec<String> = self.dashes.iter().map(f64::to_string).collect();
            text += &format!(r#" stroke-dasharray="{}""#, lengths.join(" "));
        }
        text
    }
}

/// Which part of a text stands at its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The beginning.
    Start,
    /// The middle.
    Middle,
    /// The end.
    End,
}

/// How a text is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Type {
    /// Font size.
    pub size: f64,
    /// Which part stands at the point.
    pub anchor: Anchor,
    /// Colour.
    pub colour: Colour,
    /// Whether it runs upwards instead of to the right.
    pub upwards: bool,
    /// Whether a white rim keeps it apart from what is below.
    pub haloed: bool,
}

impl Type {
    /// Black text to the right of its point.
    pub fn of(size: f64) -> Self {
        let colour = Colour::BLACK;
        Self {
            size,
            anchor: Anchor::Start,
            colour,
            upwards: false,
            haloed: false,
        }
    }

    /// The same, with a white rim.
    pub fn haloed(self) -> Self {
        Self {
            haloed: true,
            ..self
        }
    }

    /// The same, anchored elsewhere.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }
}

/// How labels are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lettering {
    /// As text, that a reader can search, in a font of theirs.
    Text,
    /// As the outlines of the embedded fonts: what is turned into pixels.
    Outlines,
}

/// A page being drawn.
#[derive(Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    lettering: Lettering,
    body: String,
}

impl Svg {
    /// An empty white page.
    pub fn new(width: f64, height: f64, lettering: Lettering) -> Self {
        let mut page = Self {
            width,
            height,
            lettering,
            body: String::new(),
        };
        page.rect(
            Rect {
                x: 0.0,
                y: 0.0,
                width,
                height,
            },
            Some(Colour::WHITE),
            None,
        );
        page
    }

    /// The finished document, with its real size and a title for those who cannot see it.
    pub fn finish(self, title: &str) -> String {
        let Self {
            width,
            height,
            body,
            ..
        } = self;
        format!(
            r#"{START}{width:.2}pt" height="{height:.2}pt" viewBox="0 0 {width:.2} {height:.2}" font-family="{}" role="img">
<title>{}</title>
{body}</svg>
"#,
            font::FAMILY,
            myovib_scene::escape(title),
        )
    }

    /// A line through the points.
    pub fn line(&mut self, points: &[Point], stroke: Stroke) {
        self.path(&path(points), stroke);
    }

    /// The outline of a path in SVG's notation.
    pub fn path(&mut self, path: &str, stroke: Stroke) {
        if !path.is_empty() {
            self.add(format_args!(
                r#"<path d="{path}" {}/>"#,
                stroke.attributes()
            ));
        }
    }

    /// The inside of a path in SVG's notation, with an edge of the same colour that closes the
    /// hairline gaps between neighbours.
    pub fn fill(&mut self, path: &str, colour: Colour) {
        if !path.is_empty() {
            self.add(format_args!(
                r#"<path d="{path}" fill="{colour}" stroke="{colour}" stroke-width="0.15"/>"#
            ));
        }
    }

    /// A rectangle, filled or outlined or both.
    pub fn rect(&mut self, rect: Rect, fill: Option<Colour>, stroke: Option<Stroke>) {
        let Rect {
            x,
            y,
            width,
            height,
        } = rect;
        let place = format!(r#"x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}""#);
        if let Some(colour) = fill {
            self.add(format_args!(r#"<rect {place} fill="{colour}"/>"#));
        }
        if let Some(stroke) = stroke {
            self.add(format_args!(r#"<rect {place} {}/>"#, stroke.attributes()));
        }
    }

    /// A disc with a thin white rim, so that discs on top of each other stay apart.
    pub fn disc(&mut self, [x, y]: Point, radius: f64, colour: Colour) {
        self.add(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius}" fill="{colour}" stroke="white" stroke-width="0.3"/>"#
        ));
    }

    /// A disc one can see through, so that a crowd of them looks darker.
    pub fn translucent_disc(&mut self, [x, y]: Point, radius: f64, colour: Colour) {
        self.add(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius}" fill="{colour}" fill-opacity="0.5" stroke="{colour}" stroke-width="0.3"/>"#
        ));
    }

    /// A label, see [`text`].
    pub fn text(&mut self, [x, y]: Point, label: &str, style: Type) {
        let mut attributes = String::new();
        if style.colour != Colour::BLACK {
            attributes += &format!(r#" fill="{}""#, style.colour);
        }
        if style.haloed {
            attributes += r#" paint-order="stroke" stroke="white" stroke-width="2""#;
        }
        if style.upwards {
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

    /// What `draw` draws, cut off outside the rectangle.
    ///
    /// An SVG inside clips without an id, so that several figures may stand in one document.
    pub fn clipped(&mut self, rect: Rect, draw: impl FnOnce(&mut Self)) {
        let Rect {
            x,
            y,
            width,
            height,
        } = rect;
        self.add(format_args!(
            r#"<svg x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" viewBox="{x:.2} {y:.2} {width:.2} {height:.2}" preserveAspectRatio="none" overflow="hidden">"#
        ));
        draw(self);
        self.add(format_args!("</svg>"));
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        writeln!(self.body, "{element}").expect("a String takes all that is written");
    }
}

/// The straight path through the points, in SVG's notation; empty for fewer than two.
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
