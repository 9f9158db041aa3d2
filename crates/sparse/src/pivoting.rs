//! LU factorization with pivoting for any sparse matrix: by KLU if the build includes it, otherwise by faer.

#[cfg(klu)]
pub use crate::klu::{Factors, Symbolic};
#[cfg(not(klu))]
pub use crate::{lu::Symbolic, partial::Factors};
