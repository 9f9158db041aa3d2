//! The wrapper against published runs, exact solutions and misuse.
#![allow(clippy::unwrap_used)] // helpers outside #[test] functions fail the test as well

mod common;
mod klu;
mod robertson;
