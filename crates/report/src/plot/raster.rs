//! Figures as pixels, with the embedded font only: the same on every machine.

use std::sync::{Arc, LazyLock};

use anyhow::Context;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

use super::font;

static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    for file in font::FILES {
        fonts.load_font_data(file.to_vec());
    }
    Arc::new(fonts)
});

/// An SVG document as pixels, `width` of them in a row.
///
/// # Errors
/// When the document is not valid or too large.
pub fn pixels(svg: &str, width: u32) -> anyhow::Result<Pixmap> {
    let options = Options {
        fontdb: Arc::clone(&FONTS),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options).context("the figure is not valid SVG")?;
    let scale = width as f32 / tree.size().width();
    let height = (tree.size().height() * scale).round() as u32;
    let mut pixmap = Pixmap::new(width, height).context("the figure has no pixels")?;
    // The page need not fill the last row.
    pixmap.fill(Color::WHITE);
    resvg::render(
        &tree,
        Transform::from_scale(scale, scale),
        &mut pixmap.as_mut(),
    );
    Ok(pixmap)
}

/// An SVG document as a PNG file, `width` pixels in a row.
///
/// # Errors
/// When the document is not valid or too large.
pub fn png(svg: &str, width: u32) -> anyhow::Result<Vec<u8>> {
    pixels(svg, width)?
        .encode_png()
        .context("the figure cannot be encoded as PNG")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::svg::{Svg, Type};

    #[test]
    fn text_leaves_ink_without_system_fonts() {
        let ink = |label: &str| {
            let mut page = Svg::new(60.0, 20.0);
            page.text([2.0, 15.0], label, Type::of(12.0));
            let pixmap = pixels(&page.finish(""), 120).unwrap();
            pixmap
                .pixels()
                .iter()
                .filter(|pixel| pixel.red() < 128)
                .count()
        };
        assert_eq!(ink(""), 0);
        assert!(ink("Ψ") > 20);
        assert!(ink("ΨΨ") > ink("Ψ") && ink("*Ψ*") > 20);
    }
}
