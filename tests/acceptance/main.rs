//! Acceptance tests of the program: its contract with scripts and users, and the paper's results.

mod browser;
mod chains;
mod contract;
mod doctor;
mod equilibria;
mod errors;
mod fields;
mod figures;
mod files;
mod fitting;
mod guide;
mod harness;
mod large;
mod limits;
mod radau;
mod resumption;
mod robustness;
mod scene_results;
mod scenes;
mod spelling;
mod stability;
mod structure;
mod sweeps;
mod table2;
mod trials;
mod writes;
