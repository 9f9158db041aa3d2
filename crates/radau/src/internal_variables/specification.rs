//! Specification of internal variables: problem, slots and terms.

use std::ops::Range;

use myovib_dae::checks::{expect, expect_positive};
use myovib_dae::{IntegratorError, Problem, StepError};

/// A problem with internal variables (states) q in addition to its unknowns y, with one or more states for each slot:
///
/// ```text
/// F(t, y, ẏ, x) = 0,    x = Σ_k (g_k s(y) − q_k),    τ_k q̇_k + q_k = g_k s(y),
/// ```
///
/// The response x, the driving quantity s and each q_k have one component per slot. The residual and the Jacobian use
/// the current value of [`response`](InternalVariableProblem::response). The elimination of the states from the Newton
/// matrix ∂F/∂y + c ∂F/∂ẏ adds the term Σ_k g_k cτ_k/(1 + cτ_k) ∂F/∂x ∂s/∂y.
pub trait InternalVariableProblem: Problem {
    /// Writes s(y) to `out`.
    ///
    /// # Errors
    /// Returns the same errors as a residual.
    fn driving_quantity(&mut self, t: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError>;

    /// Writes ∂s/∂y · `change` to `out`, with the derivative from the last evaluation of the Jacobian.
    fn driving_change(&mut self, change: &[f64], out: &mut [f64]);

    /// Returns the response x, which the residual and the Jacobian use.
    fn response(&mut self) -> &mut [f64];
}

/// A relaxation term: τ q̇ + q = g s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelaxationTerm {
    /// Weight g.
    pub weight: f64,
    /// Relaxation time τ (s).
    pub time: f64,
}

/// Slots with the same terms.
#[derive(Debug, Clone, PartialEq)]
pub struct InternalVariableGroup {
    /// Range of the slots.
    pub slots: Range<usize>,
    /// Terms of each slot.
    pub terms: Vec<RelaxationTerm>,
}

/// Specification of internal variables. The states are integrated by the same method as the unknowns. The root mean
/// square of their errors is a separate norm in the error test, but is not part of Newton's convergence test.
#[derive(Debug, Clone, PartialEq)]
pub struct InternalVariables {
    /// Groups of consecutive slots.
    pub parts: Vec<InternalVariableGroup>,
    /// Initial states, group by group. Within a group, all slots of the first term precede all slots of the second
    /// term, and so on.
    pub start: Vec<f64>,
    /// Absolute tolerance of the states. The relative tolerance of the unknowns also applies to the states.
    pub absolute: f64,
}

impl InternalVariables {
    /// Checks that the slots are consecutive and that the terms decay.
    pub(super) fn validate(&self) -> Result<(), IntegratorError> {
        let mut end = 0;
        for InternalVariableGroup { slots, terms } in &self.parts {
            let (start, expected) = (slots.start as f64, "the end of the previous group, or 0");
            expect(
                "first slot of a group of internal variables",
                start,
                slots.start == end,
                expected,
            )?;
            let is_range = slots.end >= slots.start;
            expect(
                "end of a group of internal variables",
                slots.end as f64,
                is_range,
                "at least its first slot",
            )?;
            end = slots.end;
            for term in terms {
                expect_positive("time of a relaxation term", term.time)?;
                let is_finite = term.weight.is_finite();
                expect("weight of a relaxation term", term.weight, is_finite, "finite")?;
            }
        }
        let is_tolerance = self.absolute.is_finite() && self.absolute >= 0.0;
        let option = "absolute tolerance of the internal variables";
        expect(option, self.absolute, is_tolerance, "finite and at least 0")
    }
}
