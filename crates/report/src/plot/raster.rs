//! Reproducible conversion of figures to pixels.

use anyhow::Context;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Renders an SVG document at a width of `width` pixels. Text is not rendered: see
/// [`Figure::outlined`](super::Figure::outlined).
pub fn pixels(svg: &str, width: u32) -> anyhow::Result<Pixmap> {
    let tree = Tree::from_str(svg, &Options::default()).context("the figure is not valid SVG")?;
    let scale = width as f32 / tree.size().width();
    let height = (tree.size().height() * scale).round() as u32;
    let mut pixmap = Pixmap::new(width, height).context("the figure has no pixels")?;
    // The page may cover the last row of pixels only partly.
    pixmap.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    Ok(pixmap)
}

/// Renders an SVG document as a PNG file with a width of `width` pixels.
pub fn png(svg: &str, width: u32) -> anyhow::Result<Vec<u8>> {
    pixels(svg, width)?.encode_png().context("the figure cannot be encoded as PNG")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Color;
    use crate::plot::place::Rect;
    use crate::plot::svg::{Lettering, Stroke, Svg, Type};

    #[test]
    fn labels_leave_ink_without_system_fonts() {
        let ink = |label: &str| {
            let mut page = Svg::new(60.0, 20.0, Lettering::Outlines);
            page.text([2.0, 15.0], label, Type::of(12.0));
            let pixmap = pixels(&page.finish(""), 120).unwrap();
            pixmap.pixels().iter().filter(|pixel| pixel.red() < 128).count()
        };
        assert_eq!(ink(""), 0);
        assert!(ink("Ψ") > 20);
        assert!(ink("ΨΨ") > ink("Ψ") && ink("*Ψ*") > 20);
    }

    /// Regression: a figure was clipped by the rectangle of another figure in the same document.
    #[test]
    fn figures_of_one_document_are_clipped_independently() {
        let figure = |x: f64| {
            let mut page = Svg::new(40.0, 40.0, Lettering::Outlines);
            let area = Rect { x, y: 5.0, width: 15.0, height: 20.0 };
            let stroke = Stroke::solid(Color::BLACK, 4.0);
            page.clipped(area, |page| page.line(&[[0.0, 15.0], [40.0, 15.0]], stroke));
            page.finish("")
        };
        let (left, right) = (figure(2.0), figure(22.0));
        // Each figure is 40 pt = 160/3 px wide.
        let both = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="80pt" height="40pt"><g>{left}</g><g transform="translate(53.3333333 0)">{right}</g></svg>"#
        );
        let together = pixels(&both, 160).unwrap();
        for (number, alone) in [left, right].iter().enumerate() {
            let alone = pixels(alone, 80).unwrap();
            let ink = alone.pixels().iter().filter(|p| p.red() < 128).count();
            assert!(ink > 100, "the line crosses the area: {ink} pixels");
            for y in 0..80 {
                for x in 0..80 {
                    let there = together.pixel(x + 80 * number as u32, y);
                    assert_eq!(there, alone.pixel(x, y), "figure {number}, pixel {x}, {y}");
                }
            }
        }
    }
}
