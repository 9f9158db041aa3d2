//! Labels with subscripts, superscripts and italics.
//!
//! In a label, `_{…}` is a subscript, `^{…}` is a superscript, and `*…*` is italic. Example: `*u*_{y} (10^{−4} m)`.

use myovib_scene::escape;

use super::font;
use super::place::Point;

/// Size of subscripts and superscripts relative to the surrounding text.
const SCRIPT: f64 = 0.72;
/// Vertical shift of superscripts and subscripts, relative to the size of the surrounding text.
const RAISE: f64 = 0.38;
const LOWER: f64 = 0.2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Base,
    Lowered,
    Raised,
}

#[derive(Debug, PartialEq, Eq)]
struct Run<'a> {
    text: &'a str,
    level: Level,
    italic: bool,
}

pub fn width(label: &str, size: f64) -> f64 {
    let of_run = |run: &Run| {
        font::width(run.text) * size * if run.level == Level::Base { 1.0 } else { SCRIPT }
    };
    runs(label).iter().map(of_run).sum()
}

/// Returns the outlines of a label as an SVG path that starts at `at`.
pub(super) fn outline(label: &str, size: f64, at: Point) -> String {
    let (mut pen, mut path) = (at, String::new());
    for run in runs(label) {
        let (raise, size) = match run.level {
            Level::Base => (0.0, size),
            Level::Lowered => (-LOWER * size, SCRIPT * size),
            Level::Raised => (RAISE * size, SCRIPT * size),
        };
        pen[1] = at[1] - raise;
        font::outline(run.text, run.italic, size, &mut pen, &mut path);
    }
    path
}

/// Returns a label as the content of an SVG `text` element.
pub(super) fn spans(label: &str, size: f64) -> String {
    let mut spans = String::new();
    // SVG accumulates vertical shifts along a text, so each run first reverses the previous shift.
    let mut shifted = 0.0;
    for run in runs(label) {
        let shift = match run.level {
            Level::Base => 0.0,
            Level::Lowered => LOWER * size,
            Level::Raised => -RAISE * size,
        };
        let mut attributes = String::new();
        if shift != shifted {
            attributes += &format!(" dy=\"{:.2}\"", shift - shifted);
            shifted = shift;
        }
        if run.level != Level::Base {
            attributes += &format!(" font-size=\"{:.2}\"", SCRIPT * size);
        }
        if run.italic {
            attributes += " font-style=\"italic\"";
        }
        // Some viewers drop ordinary spaces at the ends of a span.
        let text = escape(run.text).replace(' ', "\u{a0}");
        if attributes.is_empty() {
            spans += &text;
        } else {
            spans += &format!("<tspan{attributes}>{text}</tspan>");
        }
    }
    spans
}

/// Returns a label as HTML with the elements `i`, `sub` and `sup`.
pub fn html(label: &str) -> String {
    let of_run = |run: &Run| {
        let mut text = escape(run.text);
        if run.italic {
            text = format!("<i>{text}</i>");
        }
        match run.level {
            Level::Base => text,
            Level::Lowered => format!("<sub>{text}</sub>"),
            Level::Raised => format!("<sup>{text}</sup>"),
        }
    };
    runs(label).iter().map(of_run).collect()
}

fn runs(label: &str) -> Vec<Run<'_>> {
    let mut runs = Vec::new();
    let (mut level, mut italic) = (Level::Base, false);
    let mut rest = label;
    let mut push = |text, level, italic| {
        if !str::is_empty(text) {
            runs.push(Run { text, level, italic });
        }
    };
    while let Some((text, mark, after)) = split_at_mark(rest, level) {
        push(text, level, italic);
        match mark {
            "_{" => level = Level::Lowered,
            "^{" => level = Level::Raised,
            "}" => level = Level::Base,
            _ => italic = !italic,
        }
        rest = after;
    }
    push(rest, level, italic);
    runs
}

/// Splits a text at the first markup character. A closing brace is markup only inside a subscript or a superscript.
fn split_at_mark(text: &str, level: Level) -> Option<(&str, &str, &str)> {
    let marks: &[&str] = if level == Level::Base { &["_{", "^{", "*"] } else { &["}", "*"] };
    let (at, mark) = marks.iter().filter_map(|mark| text.find(mark).map(|at| (at, *mark))).min()?;
    Some((&text[..at], mark, &text[at + mark.len()..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_become_runs() {
        let plain = |text| Run { text, level: Level::Base, italic: false };
        assert_eq!(
            runs("*u*_{y} (m)"),
            [
                Run { text: "u", level: Level::Base, italic: true },
                Run { text: "y", level: Level::Lowered, italic: false },
                plain(" (m)"),
            ]
        );
        assert_eq!(runs("{a}"), [plain("{a}")]);
        assert_eq!(runs(""), []);
    }

    #[test]
    fn control_characters_are_escaped() {
        assert!(!escape("a\u{1b}[31mb").contains('\u{1b}'));
    }

    #[test]
    fn shifts_are_reversed_and_characters_escaped() {
        assert_eq!(
            spans("a_{b}<", 10.0),
            "a<tspan dy=\"2.00\" font-size=\"7.20\">b</tspan><tspan dy=\"-2.00\">&lt;</tspan>"
        );
    }

    #[test]
    fn labels_become_html() {
        assert_eq!(html("*u*_{y} <b>"), "<i>u</i><sub>y</sub> &lt;b&gt;");
    }

    #[test]
    fn markup_has_no_width() {
        assert_eq!(width("*u*", 7.0), width("u", 7.0));
        assert!(width("u_{y}", 7.0) < width("uy", 7.0));
    }
}
