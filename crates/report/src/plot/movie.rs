//! Animated GIFs.

use std::io::Write;

use anyhow::{Context, ensure};
use gif::{Encoder, Extension, Frame, Repeat};

use super::figure::Figure;
use super::raster;

/// Setting for the reduction of frames with more than 256 colors: 1 gives the best quality, and 30 is the fastest.
const SPEED: i32 = 10;

/// Comment by which the program recognizes its own files.
const COMMENT: &[u8] = b"Made by myovib";

/// Returns whether a file starts like a movie that this program wrote.
pub fn is_own_gif(start: &[u8]) -> bool {
    let mut parts = start.windows(COMMENT.len()).take(100);
    start.starts_with(b"GIF89a") && parts.any(|part| part == COMMENT)
}

/// Writes figures of equal size as an endless animation that is `width` pixels wide. Each figure is shown for
/// `hundredths` of a second.
///
/// Figures are taken from the iterator one at a time.
pub fn write<W: Write>(
    sink: W,
    figures: impl IntoIterator<Item = anyhow::Result<Figure>>,
    width: u16,
    hundredths: u16,
) -> anyhow::Result<()> {
    let mut figures = figures.into_iter();
    let first = figures.next().context("a movie requires at least one frame")??;
    let first = frame(&first, width, hundredths)?;
    let mut encoder = Encoder::new(sink, first.width, first.height, &[])?;
    encoder.write_raw_extension(Extension::Comment.into(), &[COMMENT])?;
    encoder.set_repeat(Repeat::Infinite)?;
    encoder.write_frame(&first)?;
    for figure in figures {
        let next = frame(&figure?, width, hundredths)?;
        ensure!(next.height == first.height, "the frames of a movie must have equal sizes");
        encoder.write_frame(&next)?;
    }
    Ok(())
}

fn frame(figure: &Figure, width: u16, hundredths: u16) -> anyhow::Result<Frame<'static>> {
    let pixmap = raster::pixels(&figure.outlined(), width.into())?;
    let height = u16::try_from(pixmap.height()).context("the figure is too tall for a movie")?;
    // Pages are opaque, so premultiplied colors are equal to plain colors.
    let mut rgba = pixmap.take();
    let mut frame = Frame::from_rgba_speed(width, height, &mut rgba, SPEED);
    frame.delay = hundredths;
    Ok(frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, LinePlot, Series};

    fn figure(x: f64) -> Figure {
        let axis = || Axis::new("x", "").between(0.0, 1.0);
        let series = vec![Series::curve("", &[x], &[x]).unjoined()];
        Figure::of("", LinePlot { x: axis(), y: axis(), series, ..LinePlot::default() })
    }

    #[test]
    fn every_figure_is_a_frame() {
        let mut file = Vec::new();
        write(&mut file, [0.2, 0.5, 0.8].map(|x| Ok(figure(x))), 200, 4).unwrap();
        let mut decoder = gif::DecodeOptions::new().read_info(&file[..]).unwrap();
        let mut delays = Vec::new();
        let mut pictures = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            delays.push(frame.delay);
            pictures.push(frame.buffer.to_vec());
        }
        assert_eq!(delays, [4, 4, 4]);
        assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    }

    #[test]
    fn a_movie_without_frames_is_an_error() {
        assert!(write(Vec::new(), [], 200, 4).is_err());
    }
}
