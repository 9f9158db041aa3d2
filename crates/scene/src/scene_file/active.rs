//! Contraction: active stress along the fibers of a material.

use myovib_fem::material::{self, Bestel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::feedback::rest_amplitude;
use super::function::Function;
use super::number::one;
use super::solid::SpatialFactor;

/// Adds `S = T g(λ) h(λ̇) f0⊗f0` to the stress of the law, with tension T and fiber stretch λ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Active {
    /// Source of the tension T.
    #[serde(flatten)]
    pub tension: Tension,
    /// Stress measure of T.
    #[serde(default)]
    pub stress: Stress,
    /// Nonnegative factor of a `given` tension as a function of position, evaluated at the center of each element
    /// [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
    /// Force–length factor g(λ) [default: 1].
    pub force_length: Option<ForceLength>,
    /// Force–velocity factor h(λ̇) [default: 1].
    pub force_velocity: Option<ForceVelocity>,
}

/// Source of the tension.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Tension {
    /// Prescribed function of time.
    Given {
        /// Tension T ≥ 0, Pa; it must be 0 at t = 0 if the motion starts at rest.
        tension: Function,
    },
    /// Tension that grows linearly with S = |χ|² of a chain. Chains with `elements` act on the elements in which they
    /// are located.
    Coherence {
        /// Name of the chain.
        chain: String,
        /// Tension without coherence or at rest, Pa; a nonzero value requires a start in equilibrium.
        #[serde(default)]
        #[schemars(range(min = 0))]
        at_zero_coherence: f64,
        /// Tension at full coherence, Pa.
        #[schemars(range(min = 0))]
        at_full_coherence: f64,
        /// Amplitude below which an oscillator counts as being at rest; the transition is smooth.
        #[serde(default = "rest_amplitude")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        rest_amplitude: f64,
    },
    /// Heartbeat by Bestel's equation `Ṫ = -|a| T + σ0 max(a, 0)`, T(0) = 0, with
    /// `a = a_max f + a_min (1 - f)`,
    /// `f = ¼ (1 + tanh((t - t_sys)/γ)) (1 - tanh((t - t_dias)/γ))`.
    Bestel {
        /// Contractility σ0, Pa.
        #[schemars(range(min = 0))]
        contractility: f64,
        /// Rate of activation a_max, 1/s.
        #[serde(default = "rise")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        rise: f64,
        /// Rate of relaxation a_min, 1/s.
        #[serde(default = "decay")]
        #[schemars(extend("exclusiveMaximum" = 0))]
        decay: f64,
        /// Start of the contraction t_sys, s.
        #[serde(default = "systole")]
        systole: f64,
        /// End of the contraction t_dias, s.
        #[serde(default = "diastole")]
        diastole: f64,
        /// Duration γ of both transitions, s.
        #[serde(default = "width")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        width: f64,
    },
}

fn rise() -> f64 {
    Bestel::ventricle(0.0).rise
}

fn decay() -> f64 {
    Bestel::ventricle(0.0).decay
}

fn systole() -> f64 {
    Bestel::ventricle(0.0).systole
}

fn diastole() -> f64 {
    Bestel::ventricle(0.0).diastole
}

fn width() -> f64 {
    Bestel::ventricle(0.0).width
}

/// Stress measure of a tension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stress {
    /// The force per undeformed area is λ T.
    #[default]
    SecondPiolaKirchhoff,
    /// The force per undeformed area is T.
    Nominal,
}

impl From<Stress> for material::Tension {
    fn from(stress: Stress) -> Self {
        match stress {
            Stress::SecondPiolaKirchhoff => Self::SecondPiolaKirchhoff,
            Stress::Nominal => Self::Nominal,
        }
    }
}

/// Force–length factor g of the fiber stretch λ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum ForceLength {
    /// `max(0, 1 - 25/4 (λ/λ_opt - 1)²)`.
    Parabola {
        /// Optimal stretch λ_opt.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        optimal: f64,
    },
    /// `exp(-((λ/λ_opt - 1)/w)⁴)`.
    Gaussian {
        /// Optimal stretch λ_opt.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        optimal: f64,
        /// Width w.
        #[schemars(extend("exclusiveMinimum" = 0))]
        width: f64,
    },
}

impl From<&ForceLength> for material::ForceLength {
    fn from(curve: &ForceLength) -> Self {
        match *curve {
            ForceLength::Parabola { optimal } => Self::Parabola { optimal },
            ForceLength::Gaussian { optimal, width } => Self::Gaussian { optimal, width },
        }
    }
}

/// Hill's factor `(1 + s)/(1 - s/a)` with s = λ̇/v_max for shortening; for lengthening, the factor tends to the
/// plateau.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceVelocity {
    /// Shortening rate at zero force, 1/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub v_max: f64,
    /// Curvature a.
    #[serde(default = "curvature")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub curvature: f64,
    /// Factor for fast lengthening.
    #[serde(default = "plateau")]
    #[schemars(extend("exclusiveMinimum" = 1))]
    pub plateau: f64,
}

fn curvature() -> f64 {
    material::ForceVelocity::hill(1.0).a
}

fn plateau() -> f64 {
    material::ForceVelocity::hill(1.0).plateau
}

impl From<&ForceVelocity> for material::ForceVelocity {
    fn from(hill: &ForceVelocity) -> Self {
        Self { v_max: hill.v_max, a: hill.curvature, plateau: hill.plateau }
    }
}
