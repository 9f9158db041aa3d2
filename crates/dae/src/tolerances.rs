//! Error tolerances and exclusions from the error test.

use crate::problem::VariableKind;

/// Error tolerances: the allowed local error of component i is `relative · |y_i| + absolute_i`.
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
    /// A separate absolute tolerance for each component.
    Vector {
        /// Relative tolerance, ≥ 0.
        relative: f64,
        /// Absolute tolerances, ≥ 0, one per component.
        absolute: Vec<f64>,
    },
}

impl Tolerances {
    /// Creates identical tolerances for all components.
    pub fn scalar(relative: f64, absolute: f64) -> Self {
        Self::Scalar { relative, absolute }
    }

    /// Creates tolerances with a separate absolute tolerance for each component.
    pub fn vector(relative: f64, absolute: impl Into<Vec<f64>>) -> Self {
        Self::Vector { relative, absolute: absolute.into() }
    }

    /// Returns the relative tolerance.
    pub fn relative(&self) -> f64 {
        match self {
            Self::Scalar { relative, .. } | Self::Vector { relative, .. } => *relative,
        }
    }

    /// Writes the error weights 1/(relative · |y_i| + absolute_i); a weight is infinite if its
    /// tolerance is zero.
    pub fn write_weights(&self, y: &[f64], weights: &mut [f64]) {
        let relative = self.relative();
        let pairs = weights.iter_mut().zip(y);
        match self {
            Self::Scalar { absolute, .. } => {
                pairs.for_each(|(weight, y)| *weight = 1.0 / (relative * y.abs() + absolute));
            }
            Self::Vector { absolute, .. } => {
                for ((weight, y), absolute) in pairs.zip(absolute) {
                    *weight = 1.0 / (relative * y.abs() + absolute);
                }
            }
        }
    }

    /// Returns weights for distances between states: 1/absolute_i, or the error weight if the absolute tolerance is
    /// zero. Error weights with a relative tolerance would give components near 0 a large weight, although their values
    /// are often rough guesses.
    pub fn distance(&self, weights: &[f64]) -> Vec<f64> {
        let pairs = weights.iter().enumerate();
        pairs
            .map(
                |(i, &weight)| if self.absolute(i) > 0.0 { 1.0 / self.absolute(i) } else { weight },
            )
            .collect()
    }

    /// Returns the absolute tolerance of component `i`.
    ///
    /// # Panics
    /// Panics if component `i` does not exist.
    pub fn absolute(&self, i: usize) -> f64 {
        match self {
            Self::Scalar { absolute, .. } => *absolute,
            Self::Vector { absolute, .. } => absolute[i],
        }
    }
}

/// Components excluded from the local error test (`IDASetSuppressAlg`).
///
/// IDAS uses one vector for both this purpose and [consistent initial values](crate::Problem::kinds). In this crate,
/// the two are separate: [`Problem::kinds`](crate::Problem::kinds) declares the algebraic variables.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Suppressed {
    /// All components are tested.
    #[default]
    Nothing,
    /// Algebraic components are excluded.
    Algebraic,
    /// Components marked `true` are excluded.
    Components(Vec<bool>),
    /// Components are excluded if their index, as stated by [`Problem::indices`](crate::Problem::indices), has this
    /// value or a higher one. Newton's method must still converge for them.
    FromIndex(u8),
    /// Components with this index or a higher one are excluded from both the error test and the convergence test of
    /// Newton's method. Their absolute tolerance is [`UNTESTED`], as in published runs of IDAS. User-defined error
    /// weights do not change. The errors of these components may exceed their size unless the strict Newton iteration
    /// of IDAS (`strict_newton`) is used; with [`FromIndex`](Self::FromIndex), they remain accurate.
    ExcludeFromIndex(u8),
}

/// Absolute tolerance of components excluded from all tests, as in published runs of IDAS.
pub const UNTESTED: f64 = 1e10;

/// Error: components are to be excluded by index, but the problem does not state indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "components cannot be excluded by index, because the problem does not define indices: implement \
     Problem::indices, or select them with Suppressed::Components"
)]
pub struct NoIndices;

impl Suppressed {
    /// Returns whether each component is excluded from the error test, given the `kinds` and `indices` of the
    /// components.
    ///
    /// # Errors
    /// Returns [`NoIndices`] if indices are required but not stated.
    ///
    /// # Panics
    /// Panics if there are fewer indices than kinds.
    pub fn excluded(
        &self,
        kinds: &[VariableKind],
        indices: Option<&[u8]>,
    ) -> Result<Vec<bool>, NoIndices> {
        let n = kinds.len();
        Ok(match self {
            Self::Nothing => vec![false; n],
            Self::Algebraic => {
                let algebraic = |kind: &VariableKind| *kind == VariableKind::Algebraic;
                kinds.iter().map(algebraic).collect()
            }
            Self::Components(excluded) => excluded.clone(),
            Self::FromIndex(least) => from_index(*least, indices)?,
            Self::ExcludeFromIndex(_) => {
                indices.ok_or(NoIndices)?;
                vec![false; n]
            }
        })
    }

    /// Returns the tolerances, with loose absolute tolerances for components excluded from all tests.
    ///
    /// # Errors
    /// Returns [`NoIndices`] if indices are required but not stated.
    pub fn loosened(
        &self,
        tolerances: Tolerances,
        indices: Option<&[u8]>,
    ) -> Result<Tolerances, NoIndices> {
        let Self::ExcludeFromIndex(least) = self else {
            return Ok(tolerances);
        };
        let untested = from_index(*least, indices)?;
        let absolute = untested.iter().enumerate().map(|(i, untested)| match untested {
            true => UNTESTED,
            false => tolerances.absolute(i),
        });
        let absolute: Vec<f64> = absolute.collect();
        Ok(Tolerances::vector(tolerances.relative(), absolute))
    }
}

/// Returns, for each component, whether its index is at least `least`.
fn from_index(least: u8, indices: Option<&[u8]>) -> Result<Vec<bool>, NoIndices> {
    let indices = indices.ok_or(NoIndices)?;
    Ok(indices.iter().map(|index| *index >= least).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variables of index 1 and 2 are algebraic. Exclusion by kind excludes both indices; exclusion by index can
    /// exclude only index 2.
    #[test]
    fn components_are_excluded_by_kind_or_by_index() {
        use VariableKind::{Algebraic, Differential};
        let (kinds, indices) = ([Differential, Algebraic, Algebraic], [1, 1, 2]);
        let excluded = |s: Suppressed| s.excluded(&kinds, Some(&indices)).unwrap();
        assert_eq!(excluded(Suppressed::Algebraic), [false, true, true]);
        assert_eq!(excluded(Suppressed::FromIndex(2)), [false, false, true]);
        let untested = Suppressed::ExcludeFromIndex(2);
        assert_eq!(excluded(untested.clone()), [false; 3]);
        let given = Tolerances::vector(1e-3, [1e-4, 1e-5, 1e-6]);
        let loosened = untested.loosened(given.clone(), Some(&indices)).unwrap();
        assert_eq!(loosened, Tolerances::vector(1e-3, [1e-4, 1e-5, UNTESTED]));
        let by_index = Suppressed::FromIndex(2).loosened(given.clone(), Some(&indices));
        assert_eq!(by_index, Ok(given.clone()));
        assert_eq!(untested.loosened(given, None), Err(NoIndices));
        assert_eq!(Suppressed::FromIndex(2).excluded(&kinds, None), Err(NoIndices));
        assert!(Suppressed::Algebraic.excluded(&kinds, None).is_ok());
    }
}
