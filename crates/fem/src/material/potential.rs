//! What a law must give: its energy as a function of e and d, with derivatives.

/// ∂W/∂e and ∂W/∂d.
#[derive(Debug, Clone, Copy)]
pub(crate) struct First {
    pub(crate) e: f64,
    pub(crate) d: f64,
}

/// The second partial derivatives of W.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Second {
    pub(crate) ee: f64,
    pub(crate) ed: f64,
    pub(crate) dd: f64,
}

/// The third partial derivatives of W.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Third {
    pub(crate) eee: f64,
    pub(crate) eed: f64,
    pub(crate) edd: f64,
    pub(crate) ddd: f64,
}

/// An energy W(e, d); see the [module above](super) for e and d.
///
/// The functions are called in loops over lanes: they must not branch, and are inlined.
pub(crate) trait Potential {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool;

    fn energy(&self, e: f64, d: f64) -> f64;
    fn first(&self, e: f64, d: f64) -> First;
    fn second(&self, e: f64, d: f64) -> Second;
    fn third(&self, e: f64, d: f64) -> Third;
}
