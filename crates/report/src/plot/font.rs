//! The typeface of the figures, embedded so that they look the same on every machine.

use std::sync::LazyLock;

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

/// Noto Sans, subset to Latin and Greek, and the signs of mathematics it lacks from Noto Sans Math
/// (licence beside the files).
pub(super) const FILES: [&[u8]; 3] = [
    include_bytes!("../../fonts/NotoSans-Regular.ttf"),
    include_bytes!("../../fonts/NotoSans-Italic.ttf"),
    include_bytes!("../../fonts/NotoSansMath-Regular.ttf"),
];

/// Its name, and what to take where it is not installed.
pub(super) const FAMILY: &str = "Noto Sans, Helvetica, Arial, sans-serif";

/// The regular face, then the one to look in for what it lacks.
static FACES: LazyLock<[FontRef<'static>; 2]> = LazyLock::new(|| {
    [FILES[0], FILES[2]]
        .map(|file| FontRef::new(file).expect("an embedded font is well formed, as a test shows"))
});

/// Width of a text at font size 1.
pub(super) fn width(text: &str) -> f64 {
    // A character in neither is drawn by a font of the reader's, about this wide.
    const UNKNOWN: f64 = 0.5;
    text.chars()
        .map(|c| {
            FACES
                .iter()
                .find_map(|face| advance(face, c))
                .unwrap_or(UNKNOWN)
        })
        .sum()
}

fn advance(face: &FontRef, c: char) -> Option<f64> {
    let metrics = face.glyph_metrics(Size::new(1.0), LocationRef::default());
    metrics.advance_width(face.charmap().map(c)?).map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_our_labels_is_in_the_fonts() {
        let characters = "0123456789 ABCXYZabcxyz αβγδεζηθκλμνξπρστφχψωΔΨΩ ẏẋ−–×·±∞≤≥≈≠→∂∇√′°²³⁻¹⁰₀₁₂ |[](){}=+/%…µé";
        let fonts = FILES.map(|file| FontRef::new(file).unwrap());
        let [styles @ .., signs] = &fonts;
        for style in styles {
            let has = |c: char| [style, signs].iter().any(|f| f.charmap().map(c).is_some());
            let missing: String = characters.chars().filter(|&c| !has(c)).collect();
            assert_eq!(missing, "");
        }
    }

    #[test]
    fn widths_add_up() {
        assert!((width("mm") - 2.0 * width("m")).abs() < 1e-12);
        assert!(width("m") > width("i") && width("∞") > 0.5);
    }
}
