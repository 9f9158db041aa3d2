//! The command line `myovib`.
#![forbid(unsafe_code)]
fn main() {}
