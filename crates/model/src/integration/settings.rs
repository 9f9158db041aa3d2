//! Settings of a time integration. [`Settings::paper`] returns the paper's values.

use myovib_dae::Tolerances;
use myovib_radau::RadauOptions;
use myovib_sparse::{Ordering, Precision, SparseOptions};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sundials_wrap::{IdaOptions, VectorArithmetic};

use crate::error::ModelError;
use crate::field::{Field, Layout};
use crate::formulation::Formulation;

/// Absolute tolerances for each block of unknowns, in the units of the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsoluteTolerances {
    /// Tolerance for q, m.
    pub displacement: f64,
    /// Tolerance for v, m/s.
    pub velocity: f64,
    /// Tolerance for λ, tensions and internal stresses, Pa.
    pub pressure: f64,
    /// Tolerance for μ in (29), Pa/s. The multiplier of (33) has the same numerical value.
    pub multiplier: f64,
}

impl AbsoluteTolerances {
    /// Returns the tolerance of a block.
    pub fn of(&self, field: Field) -> f64 {
        match field {
            Field::Displacement => self.displacement,
            Field::Velocity => self.velocity,
            Field::Pressure | Field::Tension | Field::InternalStress => self.pressure,
            Field::PressureRate | Field::GglMultiplier => self.multiplier,
        }
    }

    fn scaled(self, factor: f64) -> Self {
        Self {
            displacement: factor * self.displacement,
            velocity: factor * self.velocity,
            pressure: factor * self.pressure,
            multiplier: factor * self.multiplier,
        }
    }
}

/// Integration method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum IntegratorKind {
    /// BDF of variable order (IDAS).
    #[default]
    Bdf,
    /// Radau IIA, order 5.
    Radau5,
    /// Radau IIA, order 9.
    Radau9,
    /// Radau IIA, order 13.
    Radau13,
}

impl IntegratorKind {
    /// All integrators.
    pub const ALL: [Self; 4] = [Self::Bdf, Self::Radau5, Self::Radau9, Self::Radau13];

    /// Returns the name used in options, scenes and output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bdf => "bdf",
            Self::Radau5 => "radau5",
            Self::Radau9 => "radau9",
            Self::Radau13 => "radau13",
        }
    }

    /// Returns the number of stages of a Radau IIA method.
    pub fn stages(self) -> Option<usize> {
        match self {
            Self::Bdf => None,
            Self::Radau5 => Some(3),
            Self::Radau9 => Some(5),
            Self::Radau13 => Some(7),
        }
    }

    /// Returns the order of a Radau IIA method, 2s − 1 for s stages.
    pub fn order(self) -> Option<u8> {
        self.stages().map(|stages| 2 * stages as u8 - 1)
    }
}

/// Solution method for the linear systems of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinearSolverKind {
    /// Eliminates the velocities; splits the system of (33) into two.
    Condensed,
    /// Factorizes the matrix of the full first-order system.
    Full,
}

impl LinearSolverKind {
    /// Returns the name used in options and output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Condensed => "condensed",
            Self::Full => "full",
        }
    }
}

/// Weights of multipliers in the error test.
// `StepScaled` is implemented by `StepWeights`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MultiplierWeights {
    /// The tolerances.
    #[default]
    Plain,
    /// The tolerances divided by min(Ωh, 1)^(i−1), with index i, angular frequency Ω of the load and step h.
    StepScaled,
}

impl MultiplierWeights {
    /// Returns the name used in options, scenes and output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::StepScaled => "step-scaled",
        }
    }
}

/// Step size options of BDF and Radau IIA. Each field is a scene key.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StepOptions {
    // The estimate from ẏ is at most 0.08 of the shortest time scale of the loads, independently of the end time.
    /// First step, s [default: estimated].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub initial_step: Option<f64>,
    /// Largest step, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_step: Option<f64>,
}

impl StepOptions {
    pub(crate) fn in_ida(self, options: IdaOptions) -> IdaOptions {
        let Self { initial_step, max_step } = self;
        IdaOptions { initial_step, max_step, ..options }
    }

    pub(crate) fn in_radau(self, options: RadauOptions) -> RadauOptions {
        let Self { initial_step, max_step } = self;
        RadauOptions { initial_step, max_step, ..options }
    }
}

/// Settings of a time integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The integrator.
    pub integrator: IntegratorKind,
    /// End time, s.
    pub t_end: f64,
    /// Relative tolerance.
    pub relative_tolerance: f64,
    /// Absolute tolerances.
    pub absolute_tolerances: AbsoluteTolerances,
    /// Blocks excluded from the error test.
    pub suppressed: Vec<Field>,
    /// Error weights of multipliers included in the error test (IDAS).
    pub multiplier_weights: MultiplierWeights,
    /// Maximum BDF order, 1 to 5 (IDAS).
    pub max_order: u8,
    /// δ: the Newton matrix is set up again if c_j changes by more than a factor of (1 + δ)/(1 − δ) (IDAS).
    pub delta_cj: f64,
    /// Solution method for Newton's linear systems.
    pub linear_solver: LinearSolverKind,
    /// Fill-reducing ordering of KLU.
    pub ordering: Ordering,
    /// Precision of the factors of condensed matrices.
    pub precision: Precision,
    /// Whether KLU first permutes to block triangular form.
    pub btf: bool,
    /// Implementation of IDAS' vector operations.
    pub vectors: VectorArithmetic,
    /// Options of adaptive steps.
    pub steps: StepOptions,
    /// Constant step without an error test, s (Radau IIA). By default, steps are adaptive.
    pub fixed_step: Option<f64>,
    /// Time between two projections onto the constraint, s (IDAS). By default, there are no projections.
    pub projection_interval: Option<f64>,
}

impl Settings {
    /// Returns the tolerances and end time of the paper's Table 2: relative tolerance 1e-3, and absolute tolerances
    /// 1e-5 (q, v), 1e-1 (λ) and 5 (μ). The maximum order is 2, and multipliers are excluded from the error test.
    pub fn paper(formulation: Formulation) -> Self {
        let multipliers = [Field::Pressure, Field::PressureRate, Field::GglMultiplier];
        Self {
            integrator: IntegratorKind::Bdf,
            t_end: 10.0,
            relative_tolerance: 1e-3,
            absolute_tolerances: AbsoluteTolerances {
                displacement: 1e-5,
                velocity: 1e-5,
                pressure: 1e-1,
                multiplier: 5.0,
            },
            suppressed: multipliers.into_iter().filter(|field| formulation.has(*field)).collect(),
            multiplier_weights: MultiplierWeights::Plain,
            max_order: 2,
            delta_cj: 0.25,
            linear_solver: LinearSolverKind::Condensed,
            ordering: default_ordering(formulation, LinearSolverKind::Condensed),
            precision: Precision::Auto,
            btf: false,
            vectors: VectorArithmetic::Simd,
            steps: StepOptions::default(),
            fixed_step: None,
            projection_interval: None,
        }
    }

    /// Changes the integrator. With Radau IIA, no block is excluded from the error test.
    pub fn with_integrator(self, integrator: IntegratorKind) -> Self {
        let suppressed = match integrator {
            IntegratorKind::Bdf => self.suppressed,
            _ => Vec::new(),
        };
        Self { integrator, suppressed, ..self }
    }

    /// Changes the relative tolerance and scales the absolute tolerances in proportion.
    pub fn with_relative_tolerance(self, rtol: f64) -> Self {
        let factor = rtol / self.relative_tolerance;
        Self {
            relative_tolerance: rtol,
            absolute_tolerances: self.absolute_tolerances.scaled(factor),
            ..self
        }
    }

    pub(crate) fn tolerances(&self, layout: &Layout) -> Tolerances {
        let absolute = layout.fill(|field| self.absolute_tolerances.of(field));
        Tolerances::vector(self.relative_tolerance, absolute)
    }

    /// Returns which unknowns are excluded from the error test.
    pub(crate) fn excluded(&self, layout: &Layout) -> Vec<bool> {
        layout.fill(|field| self.suppressed.contains(&field))
    }

    /// Returns the options of factorizations.
    pub(crate) fn sparse_options(&self) -> SparseOptions {
        SparseOptions {
            precision: self.precision,
            ordering: self.ordering,
            btf: self.btf,
            ..SparseOptions::default()
        }
    }

    /// If the integrator is Radau IIA, rejects settings that only BDF supports.
    ///
    /// # Errors
    /// Returns [`ModelError::OnlyBdf`] if such a setting is used.
    pub(crate) fn expect_no_bdf_settings(&self) -> Result<(), ModelError> {
        let weighted = self.multiplier_weights != MultiplierWeights::Plain;
        for (setting, given) in [
            ("multiplier_weights", weighted),
            ("projection_interval", self.projection_interval.is_some()),
        ] {
            if given {
                return Err(ModelError::OnlyBdf { setting });
            }
        }
        Ok(())
    }
}

/// Returns the ordering with the least fill: AMD, except for the full matrix of (33), where it
/// produces twenty times the fill of COLAMD.
pub fn default_ordering(formulation: Formulation, linear_solver: LinearSolverKind) -> Ordering {
    match (formulation, linear_solver) {
        (Formulation::Stabilized, LinearSolverKind::Full) => Ordering::Colamd,
        _ => Ordering::Amd,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_tolerances_keep_their_proportion_to_the_relative_one() {
        let paper = Settings::paper(Formulation::Rate);
        let tight = paper.clone().with_relative_tolerance(1e-5);
        assert_eq!(tight.relative_tolerance, 1e-5);
        for (field, _) in Formulation::Rate.rows() {
            let [before, after] =
                [&paper, &tight].map(|settings| settings.absolute_tolerances.of(*field));
            // 1e-5/1e-3 and the product are each rounded once.
            assert!((after - 0.01 * before).abs() <= 4.0 * f64::EPSILON * after, "{field}");
        }
    }
}
