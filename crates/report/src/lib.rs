//! What people look at: figures, tables, films, and the report of a run.
//!
//! Cast: [`plot`] draws; [`picture`] writes a drawing with the numbers behind it; [`table`] lays
//! out text; [`page`] is the page of a run, [`fit`] shows fits, [`modes`] eigenmodes, [`stiffness_map`] where
//! stiffness matters, [`table2`] the paper's table;
//! [`spatial`] draws bodies in space. It knows folders of runs, not integration.
#![forbid(unsafe_code)]

pub mod fit;
pub mod modes;
pub mod outline;
pub mod page;
pub mod picture;
pub mod plot;
pub mod spatial;
pub mod stiffness_map;
pub mod table;
pub mod table2;
