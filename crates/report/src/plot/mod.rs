//! Figures for print, drawn as SVG in points at the width of a journal column. Images and animations are rendered
//! from the same SVG.
//!
//! A [`Figure`] arranges [`Panel`]s on a grid. A panel is a [`LinePlot`] (linear or logarithmic), a [`ComplexPlane`], a
//! [`MeshPlot`], a [`SurfacePlot`] or a [`HeatMap`]. [`raster`] converts a figure to pixels, and [`movie`] converts a
//! sequence of figures to an animated GIF. Panels contain plain numbers and no physics. Labels may use `_{…}`, `^{…}`
//! and `*…*` (italic); see [`text`].

mod arrow;
pub mod axis;
pub mod bands;
mod bar;
pub mod color;
pub mod complex_plane;
mod decimate;
pub mod figure;
mod font;
mod frame;
pub mod heat_map;
mod legend;
pub mod line_plot;
pub mod mesh_plot;
pub mod movie;
pub mod place;
pub mod raster;
pub mod surface_plot;
pub mod svg;
pub mod text;

pub use axis::{Axis, Scale};
pub use color::Color;
pub use complex_plane::ComplexPlane;
pub use figure::{Figure, Panel};
pub use heat_map::HeatMap;
pub use line_plot::{LinePlot, Series};
pub use mesh_plot::{EdgeGroup, Field, MeshPlot, Region};
pub use surface_plot::SurfacePlot;
pub use svg::is_own_svg;
