//! Title and legend. They are placed above a plot and therefore do not cover data.

use super::color::Color;
use super::figure::{LABEL_SIZE, TICK_SIZE};
use super::place::{Point, Rect};
use super::svg::{Stroke, Svg, Type};
use super::{arrow, text};

/// Widths of line symbols and of other symbols.
const LINE_KEY: f64 = 14.0;
const DOT_KEY: f64 = 6.0;
const KEY_GAP: f64 = 3.0;
const ENTRY_GAP: f64 = 9.0;
const ROW: f64 = 1.45 * TICK_SIZE;
const TITLE: f64 = 1.6 * LABEL_SIZE;
const GAP: f64 = 3.0;

/// Symbol of a legend entry.
#[derive(Clone, Copy)]
pub(super) enum Key {
    Line(Stroke),
    /// Marked point with this radius.
    Disc(Color, f64),
    /// Marked point on a line.
    DiscOnLine(Stroke, f64),
    Arrow(Stroke),
    Square(Color),
}

impl Key {
    fn width(self) -> f64 {
        match self {
            Self::Line(_) | Self::DiscOnLine(..) | Self::Arrow(_) => LINE_KEY,
            Self::Disc(..) | Self::Square(_) => DOT_KEY,
        }
    }

    /// Draws the symbol at this position.
    fn draw(self, svg: &mut Svg, [x, y]: Point) {
        let half = self.width() / 2.0;
        let ends = [[x - half, y], [x + half, y]];
        match self {
            Self::Line(stroke) => svg.line(&ends, stroke),
            Self::Disc(color, radius) => svg.disc([x, y], radius, color),
            Self::DiscOnLine(stroke, radius) => {
                svg.line(&ends, stroke);
                svg.disc([x, y], radius, stroke.color);
            }
            Self::Arrow(stroke) => arrow::draw(svg, ends[0], ends[1], stroke),
            Self::Square(color) => {
                let square =
                    Rect { x: x - half, y: y - half, width: 2.0 * half, height: 2.0 * half };
                svg.rect(square, Some(color), None);
            }
        }
    }
}

/// Name and symbol of an entry; entries without a name are not shown.
pub(super) struct Entry<'a> {
    pub(super) name: &'a str,
    pub(super) key: Key,
}

impl Entry<'_> {
    fn width(&self) -> f64 {
        self.key.width() + KEY_GAP + text::width(self.name, TICK_SIZE)
    }
}

/// Returns the height of the title and the legend above an area of this width.
pub(super) fn height(title: &str, entries: &[Entry], width: f64) -> f64 {
    let rows = rows(entries, width).len() as f64 * ROW;
    let title = if title.is_empty() { 0.0 } else { TITLE };
    if rows + title > 0.0 { rows + title + GAP } else { 0.0 }
}

/// Draws the title and the legend above the area.
pub(super) fn draw(svg: &mut Svg, area: Rect, title: &str, entries: &[Entry]) {
    let mut y = area.y - height(title, entries, area.width);
    if !title.is_empty() {
        let at = [area.x, y + 0.5 * TITLE + 0.36 * LABEL_SIZE];
        svg.text(at, title, Type::of(LABEL_SIZE));
        y += TITLE;
    }
    for row in rows(entries, area.width) {
        let middle = y + ROW / 2.0;
        let mut x = area.x;
        for entry in row {
            let key = entry.key.width();
            entry.key.draw(svg, [x + key / 2.0, middle]);
            let at = [x + key + KEY_GAP, middle + 0.36 * TICK_SIZE];
            svg.text(at, entry.name, Type::of(TICK_SIZE));
            x += entry.width() + ENTRY_GAP;
        }
        y += ROW;
    }
}

fn rows<'e, 'a>(entries: &'e [Entry<'a>], width: f64) -> Vec<Vec<&'e Entry<'a>>> {
    let mut rows: Vec<Vec<&Entry>> = Vec::new();
    let mut used = f64::INFINITY;
    for entry in entries.iter().filter(|entry| !entry.name.is_empty()) {
        if used + entry.width() > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push(entry);
        }
        used += entry.width() + ENTRY_GAP;
    }
    rows
}
