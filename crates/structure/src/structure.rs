//! The index of a pencil and of each of its variables, with the evidence.

use std::fmt;
use std::ops::Range;

use crate::deflation::{End, deflate};
use crate::pencil::Pencil;
use crate::perturbation::resolvent_polynomial;
use crate::rank::{RankDecision, Verdict};
use crate::scaling::scale;

/// The answer to "what is the index of this pencil?".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Index {
    /// It is this, by decisive gaps only.
    Decided(usize),
    /// A decision on the way was not clear; this is the answer if each went to the widest gap.
    Undecided(Option<usize>),
    /// There is none: the pencil is singular, with so many dependent constraints.
    Singular {
        /// Number of constraints that are combinations of the others.
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
                write!(
                    f,
                    "no index (singular pencil, {nullity} dependent constraints)"
                )
            }
        }
    }
}

/// The perturbation index of one variable, or the largest of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct VariableIndex {
    /// 0 for a variable that depends on integrals of a perturbation δ only, k + 1 for one that
    /// contains its k-th derivative.
    pub index: u8,
    /// Whether all the gaps this rests on are decisive.
    pub verdict: Verdict,
}

/// The structure of a matrix pencil at infinity: its index, those of its variables, the evidence.
///
/// # What the method decides
/// The pencil is scaled to be free of units, then deflated by orthogonal transformations, which is
/// backward stable: the answer is exact for a pencil that differs from the scaled one by about the
/// largest magnitude dropped. It cannot see a term whose effect on a rank is below 1e-12 of its
/// surroundings after scaling, and calls undecided what lies amid 1e-12 and 1e-9. It is a dense
/// method of cost O(n³) with two or three singular value decompositions: meant for a few hundred
/// unknowns, a coarse mesh of a scene rather than the mesh of its run.
#[derive(Debug, Clone, PartialEq)]
pub struct PencilStructure {
    /// The index (Kronecker's, of nilpotency).
    pub index: Index,
    /// The rank decisions in the order they were made.
    pub decisions: Vec<RankDecision>,
    /// The perturbation index of each variable; empty for a singular pencil.
    pub variables: Vec<VariableIndex>,
    /// Which variables contain the j-th derivative of a perturbation, j = 0, 1, …: the decisions
    /// that the indices of the variables rest on.
    pub variable_decisions: Vec<RankDecision>,
}

impl PencilStructure {
    /// Finds the structure of a pencil.
    ///
    /// # Examples
    /// A point on a line with prescribed place, q̇ = v, v̇ = λ, q = f: the multiplier needs the
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
        let clear = deflation
            .decisions
            .iter()
            .all(|d| d.verdict == Verdict::Decisive);
        let (index, variable_decisions, variables) = match &deflation.end {
            End::Regular { e, a } => {
                let resolvent = resolvent_polynomial(&deflation.steps, e, a);
                let (decisions, variables) = variable_indices(pencil.size(), &resolvent, clear);
                let index = deflation.steps.len();
                let index = if clear {
                    Index::Decided(index)
                } else {
                    Index::Undecided(Some(index))
                };
                (index, decisions, variables)
            }
            End::Singular { nullity } if clear => (
                Index::Singular { nullity: *nullity },
                Vec::new(),
                Vec::new(),
            ),
            End::Singular { .. } => (Index::Undecided(None), Vec::new(), Vec::new()),
        };
        Self {
            index,
            decisions: deflation.decisions,
            variables,
            variable_decisions,
        }
    }

    /// The narrowest gap, in decades, among the decisions that the index rests on.
    pub fn gap(&self) -> f64 {
        self.decisions
            .iter()
            .map(RankDecision::gap)
            .fold(f64::INFINITY, f64::min)
    }

    /// The index of a block of variables: the largest of theirs.
    ///
    /// # Panics
    /// When the pencil is singular, or the range is empty or beyond the variables.
    pub fn block(&self, range: Range<usize>) -> VariableIndex {
        let block = &self.variables[range];
        let index = block
            .iter()
            .map(|v| v.index)
            .max()
            .expect("a block has variables");
        let clear = block.iter().all(|v| v.verdict == Verdict::Decisive);
        VariableIndex {
            index,
            verdict: verdict(clear),
        }
    }
}

fn verdict(clear: bool) -> Verdict {
    if clear {
        Verdict::Decisive
    } else {
        Verdict::Undecided
    }
}

/// The degrees of the rows of the resolvent's polynomial part, plus one.
fn variable_indices(
    n: usize,
    resolvent: &[nalgebra::DMatrix<f64>],
    clear: bool,
) -> (Vec<RankDecision>, Vec<VariableIndex>) {
    let mut decisions = Vec::new();
    let mut variables = vec![
        VariableIndex {
            index: 0,
            verdict: Verdict::Decisive
        };
        n
    ];
    let mut all_clear = clear;
    for (degree, coefficient) in resolvent.iter().enumerate() {
        let norms: Vec<f64> = coefficient.row_iter().map(|row| row.norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let subject = format!("variables with derivative {degree} of a perturbation");
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
