//! Figures fit for print: SVG in points at column width, pixels and animations from the same SVG.
//!
//! Cast: a [`Figure`] lays [`Panel`]s out on a grid; panels are a [`LinePlot`] (linear or
//! logarithmic), a [`ComplexPlane`], a [`MeshPlot`], a [`SurfacePlot`] and a [`HeatMap`]; [`raster`] turns a figure
//! into pixels, [`movie`] a sequence of them into an animated GIF. Panels hold plain numbers and
//! know no physics. Labels may use `_{…}`, `^{…}` and `*…*` (italic), see [`text`].

mod arrow;
pub mod axis;
pub mod bands;
mod bar;
pub mod colour;
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
pub use colour::Colour;
pub use complex_plane::ComplexPlane;
pub use figure::{Figure, Panel};
pub use heat_map::HeatMap;
pub use line_plot::{LinePlot, Series};
pub use mesh_plot::{EdgeGroup, Field, MeshPlot, Region};
pub use surface_plot::SurfacePlot;
pub use svg::is_own_svg;
