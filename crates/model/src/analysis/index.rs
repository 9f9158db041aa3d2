//! The index of a muscle's DAE, computed from its matrices at a state.
//!
//! [`IndexReport`] reads blocks of unknowns out of what `myovib-structure` finds, which sees a
//! linearisation only. The rule of [`Formulation::index`](crate::Formulation::index) is not used.
//!
#![doc = include_str!("../../notes/0002-computing-the-index.md")]

use myovib_dae::Problem;
use myovib_structure::{Index, Pencil, PencilStructure, VariableIndex};

use crate::error::ModelError;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;
use crate::start::Start;

/// Largest number of unknowns for the dense method: 2 s of work, and rounding far from its gaps.
pub const LARGEST_SYSTEM: usize = 400;

/// The index of a DAE at a state, and that of each block of unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct IndexReport {
    /// The index, or why there is none.
    pub index: Index,
    /// The narrowest gap among the rank decisions, in decades.
    pub gap: f64,
    /// The rank decisions in words, in the order they were made.
    pub decisions: Vec<String>,
    /// The perturbation index of each block; empty without an index.
    pub blocks: Vec<(Field, VariableIndex)>,
    /// Number of unknowns of the system looked at.
    pub unknowns: usize,
}

impl IndexReport {
    /// Linearises at (t, y, ẏ) and finds the index.
    ///
    /// # Errors
    /// [`ModelError::TooLarge`] for more than [`LARGEST_SYSTEM`] unknowns,
    /// [`ModelError::Structure`] where the Jacobian cannot be evaluated.
    pub fn at(dae: &mut MuscleDae, t: f64, y: &[f64], y_dot: &[f64]) -> Result<Self, ModelError> {
        let unknowns = dae.n_unknowns();
        if unknowns > LARGEST_SYSTEM {
            return Err(ModelError::TooLarge {
                unknowns,
                largest: LARGEST_SYSTEM,
            });
        }
        let structure = PencilStructure::of(&Pencil::linearise(dae, t, y, y_dot)?);
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
            decisions: structure
                .decisions
                .iter()
                .map(ToString::to_string)
                .collect(),
            blocks,
            unknowns,
        })
    }

    /// The same at consistent values for the displacement `q` and velocity `v`.
    ///
    /// # Errors
    /// Those of [`Start::new`] and [`at`](Self::at).
    pub fn of_motion(
        dae: &mut MuscleDae,
        t: f64,
        q: &[f64],
        v: &[f64],
    ) -> Result<Self, ModelError> {
        let start = Start::new(dae, t, q, v)?;
        Self::at(dae, t, &start.y, &start.y_dot)
    }

    /// The index if it rests on decisive gaps only.
    pub fn decided(&self) -> Option<usize> {
        match self.index {
            Index::Decided(index) => Some(index),
            Index::Undecided(_) | Index::Singular { .. } => None,
        }
    }
}
