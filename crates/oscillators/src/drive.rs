//! Where the tissue's displacement acts on the oscillators, and how strongly.

/// The oscillators that the forcing reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Reach {
    /// All of them: cells are tiny, so a cluster of them moves with the same point of the tissue.
    #[default]
    All,
    /// Only those on the boundary: the first and the last of a chain, the rim of an array.
    Boundary,
}

/// The one-way coupling from the tissue to the oscillators.
///
/// `c(u) = γ u(ξ, t)`. Paper: eq. (24) and the formula after it.
///
/// # Units
/// `gain` in 1/s² per unit of displacement (the oscillators' own position has no unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// γ.
    pub gain: f64,
    /// The oscillators on which c(u) acts.
    pub reach: Reach,
}

impl Default for Drive {
    /// γ = 1 on all oscillators (the paper gives no value).
    fn default() -> Self {
        Self {
            gain: 1.0,
            reach: Reach::All,
        }
    }
}

impl Drive {
    /// The forcing c(u) = γ u for the displacement u of the tissue; its derivative is `gain`.
    ///
    /// # Examples
    /// ```
    /// use myovib_oscillators::Drive;
    /// let drive = Drive { gain: 4000.0, ..Drive::default() };
    /// assert_eq!(drive.forcing(0.05), 200.0);
    /// ```
    pub fn forcing(&self, displacement: f64) -> f64 {
        self.gain * displacement
    }
}
