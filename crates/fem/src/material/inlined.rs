//! Macro for laws defined outside this crate, which compiles them for the vector instructions of the processor.

/// Adds `#[inline(always)]` to all functions of an `impl` block.
///
/// Every function of a law needs this attribute, because element loops are compiled for several instruction sets.
/// If a function is not inlined into these loops, it is compiled without vector instructions and can be nine times
/// as slow.
///
/// # Examples
/// ```
/// use myovib_fem::material::Real;
/// use myovib_fem::material::three::{Invariants, Isotropic};
///
/// struct NeoHookean(f64);
///
/// myovib_fem::inlined! {
///     impl Isotropic for NeoHookean {
///         fn energy<R: Real>(&self, at: Invariants<R>) -> R {
///             at.isochoric_first().0 * (0.5 * self.0)
///         }
///     }
/// }
/// ```
#[macro_export]
macro_rules! inlined {
    (impl $trait:ident for $type:ty { $($body:tt)* }) => {
        $crate::inlined!(@ [impl $trait for $type] [] $($body)*);
    };
    (@ [$($head:tt)*] [$($done:tt)*]) => {
        $($head)* { $($done)* }
    };
    (@ [$($head:tt)*] [$($done:tt)*] fn $($rest:tt)*) => {
        $crate::inlined!(@name [$($head)*] [$($done)* #[inline(always)] fn] $($rest)*);
    };
    (@ [$($head:tt)*] [$($done:tt)*] $next:tt $($rest:tt)*) => {
        $crate::inlined!(@ [$($head)*] [$($done)* $next] $($rest)*);
    };
    (@name [$($head:tt)*] [$($done:tt)*] $name:ident $($rest:tt)*) => {
        $crate::inlined!(@ [$($head)*] [$($done)* $name] $($rest)*);
    };
}
