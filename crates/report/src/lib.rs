//! Output for people: figures, tables, movies, and the report of a run.
//!
//! [`plot`] draws figures; [`picture`] writes a figure together with its data; [`table`] formats text tables; [`page`]
//! is the HTML report of a run. The following modules show results: [`fit`] of fits, [`sweep`] of sweeps, [`modes`] of
//! modal analyses, [`response`] of harmonic responses, [`periodic`] of periodic states, [`stiffness_map`] of stiffness
//! sensitivities, and [`table2`] of the paper's table. [`spatial`] draws bodies in 3D, and [`film`] draws the stored
//! fields of a run. The crate reads the folders of runs and does not integrate.
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "not published as a library")]

pub mod film;
pub mod fit;
pub mod modes;
pub mod outline;
pub mod page;
pub mod periodic;
pub mod picture;
pub mod plot;
pub mod response;
pub mod spatial;
pub mod stiffness_map;
pub mod sweep;
pub mod table;
pub mod table2;
mod vector;
