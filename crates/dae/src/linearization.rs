//! State at which an integrator linearizes F.

/// State (t, y, ẏ) at which F is linearized, with the relevant scales.
#[derive(Debug, Clone, Copy)]
pub struct Linearization<'a> {
    /// Time.
    pub t: f64,
    /// State.
    pub y: &'a [f64],
    /// Time derivative of the state.
    pub y_dot: &'a [f64],
    /// Step size h, positive or negative: y changes by about h ẏ.
    pub step: f64,
    /// Error weights w: the tolerance of y_i is 1/w_i.
    pub weights: &'a [f64],
}
