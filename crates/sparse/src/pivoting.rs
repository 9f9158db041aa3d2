//! LU with exchange of pivots, for any sparse matrix: by KLU in builds that have it, else by faer.

#[cfg(klu)]
pub use crate::klu::{Factors, Symbolic};
#[cfg(not(klu))]
pub use crate::{lu::Symbolic, partial::Factors};
