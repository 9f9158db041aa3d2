//! Processing of scenes: text → validated objects → system → run → result folder.
//!
//! [`scene_file`] reads the text of a scene and reports errors with their location. A [`Scene`] combines the scene file
//! with its mesh into a model. [`run`] computes the scene and writes a result folder; [`sweep`] does this for a grid of
//! values. [`sensitivity`] differentiates the outputs with respect to parameters, and [`mod@fit`] estimates parameters
//! from measurements. [`modes`] computes eigenfrequencies. [`csv`], [`vtu`], [`json`] and [`atomic_file`] write files.
//! This crate does not print; it reports progress to a [`watch::ProgressSink`].
//!
//! # Examples
//! ```
//! use myovib_scene::{Scene, run};
//!
//! let folder = tempfile::tempdir()?;
//! let scene = Scene::built_in("table2-31", &["time.end=0.02".to_owned()])?;
//! let result = run::compute(&scene, &run::RunOptions::into_folder(folder.path()))?;
//! assert_eq!(result.document["outcome"], "finished");
//! assert!(folder.path().join("origin.csv").exists());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "not published as a library")]

pub mod atomic_file;
pub mod csv;
pub mod energy;
mod error;
mod expression;
pub mod fit;
mod inputs;
pub mod json;
pub mod mesh_file;
pub mod modes;
pub mod parallel;
pub mod periodic;
pub mod probe;
pub mod response;
pub mod result_folder;
pub mod run;
mod scene;
pub mod scene_file;
pub mod sensitivity;
mod spacing;
mod state;
pub mod statistics;
pub mod sweep;
mod system;
mod text;
pub mod versions;
pub mod vtu;
pub mod watch;

pub use error::{Error, InputError};
pub use inputs::Input;
pub use scene::{Body, DrivenChain, DrivenPlace, Scene, builtin};
pub use text::{escape, plain};
