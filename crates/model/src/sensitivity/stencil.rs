//! Fourth-order finite differences in a parameter.

/// Points at which a function is evaluated to compute its derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stencil {
    /// Points on both sides.
    Central,
    /// Points at and above the parameter, for parameters at the lower end of their range.
    Ahead,
}

impl Stencil {
    /// Returns the distances from the point in units of the step, with their weights, which must be divided by the
    /// step.
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

    /// Order 4: exact for x to x⁴.
    #[test]
    fn powers_up_to_four_are_differentiated_exactly() {
        for stencil in [Stencil::Central, Stencil::Ahead] {
            for power in 0..=4 {
                let terms = stencil.points().iter();
                let sum: f64 = terms.map(|(at, weight)| weight * at.powi(power)).sum();
                let exact = if power == 1 { 1.0 } else { 0.0 };
                // Weights up to 4 times powers up to 256, with a few rounding errors each.
                assert!((sum - exact).abs() < 1e-12, "{stencil:?} {power}: {sum}");
            }
        }
    }
}
