//! Contraction: the stress that a material produces along its fibres.

use myovib_fem::material::{self, Bestel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::feedback::radius;
use super::function::Function;

/// Active stress along the fibres, beside that of the law: `S = T g(λ) h(λ̇) f0⊗f0`, λ the fibre's
/// stretch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Active {
    /// Where the tension T is from, one for all of the material.
    #[serde(flatten)]
    pub tension: Tension,
    /// What T is.
    #[serde(default)]
    pub stress: Stress,
    /// g(λ) [default: 1].
    pub force_length: Option<ForceLength>,
    /// h(λ̇) [default: 1].
    pub force_velocity: Option<ForceVelocity>,
}

/// Where tensions are from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Tension {
    /// A function of time.
    Given {
        /// T, Pa; never negative, and 0 where a motion starts at rest.
        tension: Function,
    },
    /// By a chain: `T = unsynchronised + (coherent - unsynchronised) S`, with S = |χ|², made smooth
    /// at rest. A chain at a point sets the tension of the whole material, chains in elements that
    /// of their elements.
    Coherence {
        /// Name of the chain.
        chain: String,
        /// T without coherence, or at rest, Pa; other than 0 only for motions from equilibrium.
        #[serde(default)]
        #[schemars(range(min = 0))]
        unsynchronised: f64,
        /// T at full coherence, Pa.
        #[schemars(range(min = 0))]
        coherent: f64,
        /// Amplitude of an oscillator below which it counts as at rest.
        #[serde(default = "radius")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// Bestel's equation `Ṫ = -|a| T + σ0 max(a, 0)` from T = 0, with `a = a_max f + a_min (1 - f)`,
    /// `f = ¼ (1 + tanh((t - t_sys)/γ)) (1 - tanh((t - t_dias)/γ))`.
    Bestel {
        /// Contractility σ0, Pa.
        #[schemars(range(min = 0))]
        contractility: f64,
        /// a_max, 1/s.
        #[serde(default = "rise")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        rise: f64,
        /// a_min, 1/s; negative.
        #[serde(default = "decay")]
        #[schemars(extend("exclusiveMaximum" = 0))]
        decay: f64,
        /// Start of the contraction t_sys, s.
        #[serde(default = "systole")]
        systole: f64,
        /// Its end t_dias, s.
        #[serde(default = "diastole")]
        diastole: f64,
        /// Duration of the switches γ, s.
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

/// The stress that a tension is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stress {
    /// Second Piola–Kirchhoff: the force per undeformed area along the fibre is λ T.
    #[default]
    SecondPiolaKirchhoff,
    /// Nominal: that force is T; S is divided by λ.
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

/// Factors g of the fibre's stretch λ.
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

fn one() -> f64 {
    1.0
}

impl From<&ForceLength> for material::ForceLength {
    fn from(curve: &ForceLength) -> Self {
        match *curve {
            ForceLength::Parabola { optimal } => Self::Parabola { optimal },
            ForceLength::Gaussian { optimal, width } => Self::Gaussian { optimal, width },
        }
    }
}

/// Hill's factor h: `(1 + s)/(1 - s/a)` for s = λ̇/v_max in [-1, 0], towards the plateau beyond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceVelocity {
    /// Rate of shortening without force, 1/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub v_max: f64,
    /// Curvature a.
    #[serde(default = "curvature")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub a: f64,
    /// Factor of fast lengthening.
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
        Self {
            v_max: hill.v_max,
            a: hill.a,
            plateau: hill.plateau,
        }
    }
}
