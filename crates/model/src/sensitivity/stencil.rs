//! Fourth-order finite differences with respect to a parameter.

/// Points at which a function is evaluated to compute its derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stencil {
    /// Points on both sides of the value of the parameter.
    Central,
    /// Points at and above the value of the parameter, for values at the lower end of the parameter's range.
    Ahead,
}

impl Stencil {
    /// Returns the distances of the points from the value of the parameter, in units of the step, with their weights.
    /// The weights must be divided by the step.
    pub fn points(self) -> &'static [(f64, f64)] {
        match self {
            Self::Central => {
                &[(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)]
            }
            Self::Ahead => {
                &[(0.0, -25.0 / 12.0), (1.0, 4.0), (2.0, -3.0), (3.0, 4.0 / 3.0), (4.0, -0.25)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A formula of order 4 is exact for the powers from x to x⁴.
    #[test]
    fn powers_up_to_four_are_differentiated_exactly() {
        for stencil in [Stencil::Central, Stencil::Ahead] {
            for power in 0..=4 {
                let terms = stencil.points().iter();
                let sum: f64 = terms.map(|(at, weight)| weight * at.powi(power)).sum();
                let exact = if power == 1 { 1.0 } else { 0.0 };
                // Weights up to 4 multiply powers up to 256, with a few rounding errors each.
                assert!((sum - exact).abs() < 1e-12, "{stencil:?} {power}: {sum}");
            }
        }
    }
}
