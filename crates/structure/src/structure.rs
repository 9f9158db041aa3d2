//! The index of a pencil and of its variables, with the rank decisions on which they are based.

use std::fmt;
use std::ops::Range;

use crate::deflation::{End, deflate};
use crate::pencil::Pencil;
use crate::perturbation::resolvent_polynomial;
use crate::rank::{RankDecision, Verdict};
use crate::scaling::scale;

/// Result of the index computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Index {
    /// The index. All rank decisions are decisive.
    Decided(usize),
    /// At least one decision is not decisive. The value results from the widest gaps. `None` indicates that the
    /// pencil is probably singular.
    Undecided(Option<usize>),
    /// The pencil is singular and has no index.
    Singular {
        /// Number of constraints that depend linearly on others.
        nullity: usize,
    },
}

impl fmt::Display for Index {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Decided(index) => write!(f, "{index}"),
            Self::Undecided(Some(index)) => write!(f, "undecided (perhaps {index})"),
            Self::Undecided(None) => write!(f, "undecided (perhaps a singular pencil)"),
            Self::Singular { nullity } => {
                write!(f, "no index (singular pencil, {nullity} dependent constraints)")
            }
        }
    }
}

/// The perturbation index of one variable, or the maximum over a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct VariableIndex {
    /// 0 for a variable that depends only on integrals of a perturbation δ; k + 1 for a variable that depends on
    /// derivatives of δ up to order k.
    pub index: u8,
    /// Certainty of the index: decisive if all underlying rank decisions are decisive.
    pub verdict: Verdict,
}

/// The structure of a matrix pencil at infinity: its index, the indices of its variables, and the rank decisions.
///
/// # Accuracy
/// The pencil is scaled to remove the influence of units, and then deflated by orthogonal transformations. This
/// method is backward stable: the result is exact for a pencil that differs from the scaled pencil by about the
/// largest dropped value. The method cannot detect a term whose effect on a rank, after scaling, is below 1e-12
/// relative to other terms. It reports a decision between 1e-12 and 1e-9 as undecided. The method operates on
/// dense matrices, and its cost is O(n³) for two or three singular value decompositions. It is suitable for a few
/// hundred unknowns, so use a coarse mesh instead of the mesh of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct PencilStructure {
    /// The index of nilpotency (Kronecker index) of the pencil.
    pub index: Index,
    /// Rank decisions in the order of the deflation steps.
    pub decisions: Vec<RankDecision>,
    /// Perturbation index of each variable; empty for a singular pencil.
    pub variables: Vec<VariableIndex>,
    /// Decisions about which variables contain the j-th derivative of a perturbation, j = 0, 1, …. The indices of
    /// the variables follow from these decisions.
    pub variable_decisions: Vec<RankDecision>,
}

impl PencilStructure {
    /// Computes the structure of a pencil.
    ///
    /// # Examples
    /// A point moves on a line with prescribed position: q̇ = v, v̇ = λ, q = f. The multiplier λ depends on the
    /// second derivative of f.
    /// ```
    /// use myovib_structure::{Index, Pencil, PencilStructure};
    /// use nalgebra::dmatrix;
    ///
    /// let e = dmatrix![1.0, 0.0, 0.0; 0.0, 1.0, 0.0; 0.0, 0.0, 0.0];
    /// let a = dmatrix![0.0, -1.0, 0.0; 0.0, 0.0, -1.0; 1.0, 0.0, 0.0];
    /// let structure = PencilStructure::of(&Pencil::new(e, a)?);
    /// assert_eq!(structure.index, Index::Decided(3));
    /// let indices: Vec<u8> = structure.variables.iter().map(|x| x.index).collect();
    /// assert_eq!(indices, [1, 2, 3]);
    /// # Ok::<(), myovib_structure::StructureError>(())
    /// ```
    pub fn of(pencil: &Pencil) -> Self {
        let (e, a) = scale(pencil);
        let deflation = deflate(e, a);
        let clear = deflation.decisions.iter().all(|d| d.verdict == Verdict::Decisive);
        let (index, variable_decisions, variables) = match &deflation.end {
            End::Regular { e, a } => {
                let resolvent = resolvent_polynomial(&deflation.steps, e, a);
                let (decisions, variables) = variable_indices(pencil.size(), &resolvent, clear);
                let index = deflation.steps.len();
                let index =
                    if clear { Index::Decided(index) } else { Index::Undecided(Some(index)) };
                (index, decisions, variables)
            }
            End::Singular { nullity } if clear => {
                (Index::Singular { nullity: *nullity }, Vec::new(), Vec::new())
            }
            End::Singular { .. } => (Index::Undecided(None), Vec::new(), Vec::new()),
        };
        Self { index, decisions: deflation.decisions, variables, variable_decisions }
    }

    /// Returns the width, in decades, of the narrowest gap among the decisions for the index.
    pub fn gap(&self) -> f64 {
        self.decisions.iter().map(RankDecision::gap).fold(f64::INFINITY, f64::min)
    }

    /// Returns the maximum index of a block of variables.
    ///
    /// # Panics
    /// Panics if the pencil is singular, or the range is empty or out of bounds.
    pub fn block(&self, range: Range<usize>) -> VariableIndex {
        let block = &self.variables[range];
        let index = block.iter().map(|v| v.index).max().expect("a block has variables");
        let clear = block.iter().all(|v| v.verdict == Verdict::Decisive);
        VariableIndex { index, verdict: verdict(clear) }
    }
}

fn verdict(clear: bool) -> Verdict {
    if clear { Verdict::Decisive } else { Verdict::Undecided }
}

/// Returns the degree of each row of the resolvent's polynomial part, plus one.
fn variable_indices(
    n: usize,
    resolvent: &[nalgebra::DMatrix<f64>],
    clear: bool,
) -> (Vec<RankDecision>, Vec<VariableIndex>) {
    let mut decisions = Vec::new();
    let mut variables = vec![VariableIndex { index: 0, verdict: Verdict::Decisive }; n];
    let mut all_clear = clear;
    for (degree, coefficient) in resolvent.iter().enumerate() {
        let norms: Vec<f64> = coefficient.row_iter().map(|row| row.norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let subject =
            format!("variables that depend on the derivative of order {degree} of a perturbation");
        let decision = RankDecision::new(subject, &norms, largest);
        for (variable, &norm) in variables.iter_mut().zip(&norms) {
            if decision.keeps(norm, largest) {
                variable.index = u8::try_from(degree + 1).unwrap_or(u8::MAX);
            }
        }
        all_clear &= decision.verdict == Verdict::Decisive;
        decisions.push(decision);
    }
    for variable in &mut variables {
        variable.verdict = verdict(all_clear);
    }
    (decisions, variables)
}
