//! Embedded fonts. With these fonts, figures look the same on every machine.

use std::fmt::Write;
use std::sync::LazyLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::place::Point;

/// Noto Sans, reduced to Latin and Greek, and further mathematical symbols from Noto Sans Math. The license is next to
/// the files.
const FILES: [&[u8]; 3] = [
    include_bytes!("../../fonts/NotoSans-Regular.ttf"),
    include_bytes!("../../fonts/NotoSans-Italic.ttf"),
    include_bytes!("../../fonts/NotoSansMath-Regular.ttf"),
];

/// Font name, followed by fallbacks.
pub(super) const FAMILY: &str = "Noto Sans, Helvetica, Arial, sans-serif";

/// Advance width of a character that the embedded fonts lack. Such a character is drawn in a font of the reader's
/// system.
const UNKNOWN: f64 = 0.5;

static FACES: LazyLock<[Face<'static>; 3]> = LazyLock::new(|| {
    FILES.map(|file| Face::parse(file, 0).expect("the embedded fonts are valid, as tested"))
});

/// Returns the glyph of a character in the upright, the italic or the symbol font.
fn glyph(c: char, italic: bool) -> Option<(&'static Face<'static>, GlyphId)> {
    let [upright, slanted, signs] = &*FACES;
    let face = if italic { slanted } else { upright };
    [face, signs].into_iter().find_map(|face| Some((face, face.glyph_index(c)?)))
}

/// Returns the advance width of a character at font size 1.
fn advance(c: char, italic: bool) -> f64 {
    glyph(c, italic)
        .and_then(|(face, id)| {
            let advance = face.glyph_hor_advance(id)?;
            Some(f64::from(advance) / f64::from(face.units_per_em()))
        })
        .unwrap_or(UNKNOWN)
}

/// Returns the width of a text at font size 1.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(|c| advance(c, false)).sum()
}

/// Appends the outlines of the text to an SVG path. `pen` is the position on the baseline; it is moved to the end of the
/// text.
pub(super) fn outline(text: &str, italic: bool, size: f64, pen: &mut Point, path: &mut String) {
    for c in text.chars() {
        if let Some((face, id)) = glyph(c, italic) {
            let scale = size / f64::from(face.units_per_em());
            let (at, path) = (*pen, &mut *path);
            face.outline_glyph(id, &mut Outline { at, scale, path });
        }
        pen[0] += size * advance(c, italic);
    }
}

/// Converts a glyph outline to an SVG path. The y axis of a font points upward.
struct Outline<'a> {
    at: Point,
    scale: f64,
    path: &'a mut String,
}

impl Outline<'_> {
    fn command(&mut self, name: char, points: &[[f32; 2]]) {
        self.path.push(name);
        for [x, y] in points {
            let x = self.at[0] + self.scale * f64::from(*x);
            let y = self.at[1] - self.scale * f64::from(*y);
            write!(self.path, "{x:.3} {y:.3} ").expect("writing to a String cannot fail");
        }
    }
}

impl OutlineBuilder for Outline<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('M', &[[x, y]]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('L', &[[x, y]]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('Q', &[[x1, y1], [x, y]]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('C', &[[x1, y1], [x2, y2], [x, y]]);
    }

    fn close(&mut self) {
        self.command('Z', &[]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fonts_contain_all_label_characters() {
        let characters = "0123456789 ABCXYZabcxyz αβγδεζηθκλμνξπρστφχψωΔΨΩ ẏẋ−–×·±∞≤≥≈≠→∂∇√′°²³⁻¹⁰₀₁₂ |[](){}=+/%…µé";
        for italic in [false, true] {
            let has = |c: &char| glyph(*c, italic).is_some();
            let missing: String = characters.chars().filter(|c| !has(c)).collect();
            assert_eq!(missing, "");
        }
    }

    #[test]
    fn widths_add_up() {
        assert!((width("mm") - 2.0 * width("m")).abs() < 1e-12);
        assert!(width("m") > width("i") && width("∞") > 0.5);
    }

    #[test]
    fn outlines_are_placed_one_after_the_other() {
        let (mut pen, mut path) = ([5.0, 20.0], String::new());
        outline("l l", false, 10.0, &mut pen, &mut path);
        assert!((pen[0] - 5.0 - 10.0 * width("l l")).abs() < 1e-12 && pen[1] == 20.0);
        // The letter l is a single closed outline on the baseline.
        assert_eq!(path.matches('Z').count(), 2);
        assert!(path.contains(" 20.000"), "{path}");
    }
}
