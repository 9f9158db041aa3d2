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
    /// Components of this index or a higher one, as [`Problem::indices`](crate::Problem::indices) states
    /// them, are left out. Newton's method is still asked to converge for them.
    FromIndex(u8),
    /// The same components are not asked for at all, in Newton's test neither: their absolute tolerance is
    /// [`UNTESTED`], as in published runs of IDAS. Without effect on error weights of one's own.
    UntestedFromIndex(u8),
}

/// The absolute tolerance of components that are not asked for, as published runs of IDAS have it.
pub const UNTESTED: f64 = 1e10;

/// Components are to be left out by their index, which the problem does not state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the problem states no indices to leave components out by: implement Problem::indices, or mark \
     them by Suppressed::Components"
)]
pub struct NoIndices;

impl Suppressed {
    /// Whether each component, which enters F as `kinds` say and has the index that `indices` state, is left
    /// out of the error test.
    ///
    /// # Errors
    /// [`NoIndices`] where they are needed and not stated.
    ///
    /// # Panics
    /// If there are fewer indices than kinds.
    pub fn left_out(
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
            Self::Components(left_out) => left_out.clone(),
            Self::FromIndex(least) => from_index(*least, indices)?,
            Self::UntestedFromIndex(_) => {
                indices.ok_or(NoIndices)?;
                vec![false; n]
            }
        })
    }

    /// The tolerances where some components are not asked for at all.
    ///
    /// # Errors
    /// [`NoIndices`] where they are needed and not stated.
    pub fn loosened(
        &self,
        tolerances: Tolerances,
        indices: Option<&[u8]>,
    ) -> Result<Tolerances, NoIndices> {
        let Self::UntestedFromIndex(least) = self else {
            return Ok(tolerances);
        };
        let untested = from_index(*least, indices)?;
        let absolute = untested
            .iter()
            .enumerate()
            .map(|(i, untested)| match untested {
                true => UNTESTED,
                false => tolerances.absolute(i),
            });
        let absolute: Vec<f64> = absolute.collect();
        Ok(Tolerances::vector(tolerances.relative(), absolute))
    }
}

/// Which components have the index `least` or a higher one.
fn from_index(least: u8, indices: Option<&[u8]>) -> Result<Vec<bool>, NoIndices> {
    let indices = indices.ok_or(NoIndices)?;
    Ok(indices.iter().map(|index| *index >= least).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Index 1 and 2 are both algebraic: the kind takes both, the index one.
    #[test]
    fn components_are_left_out_by_kind_or_by_index() {
        use VariableKind::{Algebraic, Differential};
        let (kinds, indices) = ([Differential, Algebraic, Algebraic], [1, 1, 2]);
        let left_out = |s: Suppressed| s.left_out(&kinds, Some(&indices)).unwrap();
        assert_eq!(left_out(Suppressed::Algebraic), [false, true, true]);
        assert_eq!(left_out(Suppressed::FromIndex(2)), [false, false, true]);
        let untested = Suppressed::UntestedFromIndex(2);
        assert_eq!(left_out(untested.clone()), [false; 3]);
        let given = Tolerances::vector(1e-3, [1e-4, 1e-5, 1e-6]);
        let loosened = untested.loosened(given.clone(), Some(&indices)).unwrap();
        assert_eq!(loosened, Tolerances::vector(1e-3, [1e-4, 1e-5, UNTESTED]));
        let by_index = Suppressed::FromIndex(2).loosened(given.clone(), Some(&indices));
        assert_eq!(by_index, Ok(given.clone()));
        assert_eq!(untested.loosened(given, None), Err(NoIndices));
        assert_eq!(
            Suppressed::FromIndex(2).left_out(&kinds, None),
            Err(NoIndices)
        );
        assert!(Suppressed::Algebraic.left_out(&kinds, None).is_ok());
    }
}
