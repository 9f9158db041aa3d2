//! Differences of order 4 in a parameter.

/// Where a function is evaluated for its derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stencil {
    /// On both sides.
    Central,
    /// From the point on, for parameters at the lower end of their range.
    Ahead,
}

impl Stencil {
    /// Distances from the point in steps, with their weights over the step.
    pub fn points(self) -> &'static [(f64, f64)] {
        match self {
            Self::Central => &[
                (-2.0, 1.0 / 12.0),
                (-1.0, -2.0 / 3.0),
                (1.0, 2.0 / 3.0),
                (2.0, -1.0 / 12.0),
            ],
            Self::Ahead => &[
                (0.0, -25.0 / 12.0),
                (1.0, 4.0),
                (2.0, -3.0),
                (3.0, 4.0 / 3.0),
                (4.0, -0.25),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of order 4: exact for x to x⁴.
    #[test]
    fn powers_up_to_four_are_differentiated_exactly() {
        for stencil in [Stencil::Central, Stencil::Ahead] {
            for power in 0..=4 {
                let terms = stencil.points().iter();
                let sum: f64 = terms.map(|(at, weight)| weight * at.powi(power)).sum();
                let exact = if power == 1 { 1.0 } else { 0.0 };
                // Weights to 4 times powers to 256, with some roundings each.
                assert!((sum - exact).abs() < 1e-12, "{stencil:?} {power}: {sum}");
            }
        }
    }
}
