//! How accurate the solution is to be, and which components are asked.

use crate::problem::VariableKind;

/// How accurate the solution is to be: component i is allowed the local error
/// `relative · |y_i| + absolute_i`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Tolerances {
    /// One absolute tolerance for all components.
    Scalar {
        /// Relative tolerance, ≥ 0.
        relative: f64,
        /// Absolute tolerance, ≥ 0.
        absolute: f64,
    },
    /// An absolute tolerance for each component.
    Vector {
        /// Relative tolerance, ≥ 0.
        relative: f64,
        /// Absolute tolerances, ≥ 0, one per component.
        absolute: Vec<f64>,
    },
}

impl Tolerances {
    /// The same tolerances for all components.
    pub fn scalar(relative: f64, absolute: f64) -> Self {
        Self::Scalar { relative, absolute }
    }

    /// An absolute tolerance for each component.
    pub fn vector(relative: f64, absolute: impl Into<Vec<f64>>) -> Self {
        Self::Vector {
            relative,
            absolute: absolute.into(),
        }
    }

    /// The relative tolerance.
    pub fn relative(&self) -> f64 {
        match self {
            Self::Scalar { relative, .. } | Self::Vector { relative, .. } => *relative,
        }
    }

    /// Writes the error weights 1/(relative · |y_i| + absolute_i); one is infinite where the
    /// tolerance is zero.
    pub fn write_weights(&self, y: &[f64], weights: &mut [f64]) {
        let relative = self.relative();
        for (i, (weight, y)) in weights.iter_mut().zip(y).enumerate() {
            *weight = 1.0 / (relative * y.abs() + self.absolute(i));
        }
    }

    /// The absolute tolerance of component `i`.
    ///
    /// # Panics
    /// If there is no such component.
    pub fn absolute(&self, i: usize) -> f64 {
        match self {
            Self::Scalar { absolute, .. } => *absolute,
            Self::Vector { absolute, .. } => absolute[i],
        }
    }
}

/// Which components are left out of the local error test (`IDASetSuppressAlg`).
///
/// IDAS uses one vector for this and for [consistent initial
/// values](crate::Problem::kinds); here they are apart: what is algebraic is
/// said by [`Problem::kinds`](crate::Problem::kinds).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Suppressed {
    /// All components are tested.
    #[default]
    Nothing,
    /// The algebraic components are left out.
    Algebraic,
    /// The components marked `true` are left out.
    Components(Vec<bool>),
}

impl Suppressed {
    /// Whether component `i`, which enters F as `kind` says, is left out.
    ///
    /// # Panics
    /// If components are marked and there is no such one.
    pub fn leaves_out(&self, i: usize, kind: VariableKind) -> bool {
        match self {
            Self::Nothing => false,
            Self::Algebraic => kind == VariableKind::Algebraic,
            Self::Components(left_out) => left_out[i],
        }
    }
}
