//! LU with exchange of pivots, for any sparse matrix: by KLU with the feature `klu`, else by faer.

#[cfg(feature = "klu")]
pub use crate::klu::{Factors, Symbolic};
#[cfg(not(feature = "klu"))]
pub use crate::partial::{Factors, Symbolic};
