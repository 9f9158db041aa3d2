//! Scenes from text to results: one file per subject, in one test program, so that it is compiled
//! once.
#![allow(clippy::unwrap_used)] // a test may panic

mod bar;
mod chain_places;
mod chains;
mod contact;
mod equilibria;
mod friction;
mod indentation;
mod interfaces;
mod lattice;
mod load_paths;
mod mesh_files;
mod meshes;
mod mode_shapes;
mod moments;
mod moved_supports;
mod muscle3d;
mod obstacles;
mod organs;
mod paths;
mod precision;
mod quasi_static;
mod random;
mod separate_chains;
mod sweep;
mod symmetry_planes;
mod units;
mod ventricle;
mod volume_functions;
mod wall_times;
