//! Where an integrator linearises F.

/// A state (t, y, ẏ) about which F is linearised, with the sizes that matter there.
#[derive(Debug, Clone, Copy)]
pub struct Linearization<'a> {
    /// The time.
    pub t: f64,
    /// y.
    pub y: &'a [f64],
    /// ẏ.
    pub y_dot: &'a [f64],
    /// The step h, > 0 or < 0: y moves by about h ẏ.
    pub step: f64,
    /// The error weights w: an error of 1/w_i in y_i is what the tolerance allows.
    pub weights: &'a [f64],
}
