//! The coupled model as differential-algebraic equations.
#![forbid(unsafe_code)]
