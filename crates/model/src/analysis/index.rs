//! Index of a muscle's DAE, computed from its matrices at a state.
//!
//! `myovib-structure` analyzes a linearization, and [`IndexReport`] assigns the result to the blocks of unknowns. The
//! rule of [`Formulation::index`](crate::Formulation::index) is not used.
#![doc = include_str!("../../notes/0002-computing-the-index.md")]

use myovib_dae::Problem;
use myovib_structure::{Index, Pencil, PencilStructure, VariableIndex};

use crate::error::ModelError;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;
use crate::start::InitialValues;

/// Maximum number of unknowns for the dense method. At this size, the method takes 2 s, and its rounding errors are
/// far below the rank gaps.
pub(crate) const LARGEST_SYSTEM: usize = 400;

/// Index of a DAE at a state and perturbation index of each block of unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct IndexReport {
    /// The index, or the reason why it could not be determined.
    pub index: Index,
    /// Smallest gap of the rank decisions, in decades.
    pub gap: f64,
    /// Rank decisions as text, in the order in which they were made.
    pub decisions: Vec<String>,
    /// Perturbation index of each block; empty if the pencil appears to be singular.
    pub blocks: Vec<(Field, VariableIndex)>,
    /// Number of unknowns of the analyzed system.
    pub unknowns: usize,
}

impl IndexReport {
    /// Linearizes at (t, y, ẏ) and computes the index.
    ///
    /// # Errors
    /// Returns [`ModelError::TooLarge`] if there are more than `LARGEST_SYSTEM` unknowns, and
    /// [`ModelError::Structure`] if the Jacobian cannot be evaluated.
    pub fn at(dae: &mut MuscleDae, t: f64, y: &[f64], y_dot: &[f64]) -> Result<Self, ModelError> {
        let unknowns = dae.n_unknowns();
        if unknowns > LARGEST_SYSTEM {
            return Err(ModelError::TooLarge { unknowns, largest: LARGEST_SYSTEM });
        }
        let structure = PencilStructure::of(&Pencil::linearize(dae, t, y, y_dot)?);
        let blocks = if structure.variables.is_empty() {
            Vec::new()
        } else {
            dae.layout()
                .blocks()
                .iter()
                .map(|(field, range)| (*field, structure.block(range.clone())))
                .collect()
        };
        Ok(Self {
            index: structure.index,
            gap: structure.gap(),
            decisions: structure.decisions.iter().map(ToString::to_string).collect(),
            blocks,
            unknowns,
        })
    }

    /// Computes the index at consistent values for the displacement `q` and the velocity `v`.
    ///
    /// # Errors
    /// Returns the errors of [`InitialValues::new`] and [`at`](Self::at).
    pub fn of_motion(
        dae: &mut MuscleDae,
        t: f64,
        q: &[f64],
        v: &[f64],
    ) -> Result<Self, ModelError> {
        let start = InitialValues::new(dae, t, q, v)?;
        Self::at(dae, t, &start.y, &start.y_dot)
    }

    /// Returns the index if the pencil is regular and all rank decisions have a clear gap.
    pub fn decided(&self) -> Option<usize> {
        match self.index {
            Index::Decided(index) => Some(index),
            Index::Undecided(_) | Index::Singular { .. } => None,
        }
    }
}
