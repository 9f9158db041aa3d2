//! Problems of a run and their remedies.

use std::fmt;

use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::settings::{IntegratorKind, MultiplierWeights, Settings};

/// A change of the formulation, the settings or the scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Remedy {
    /// Exclude these blocks from the error test.
    Exclude(Vec<Field>),
    /// Scale the error weights of multipliers by the step.
    WeighByStep,
    /// Limit the order of BDF.
    MaxOrder(u8),
    /// Use another integrator.
    Method(IntegratorKind),
    /// Use another formulation of the same physics with this index.
    Reformulate(Formulation, u8),
    /// Loosen the relative tolerance to this value, and the absolute tolerances by the same factor.
    Loosen(f64),
    /// Tighten the relative tolerance to this value, and the absolute tolerances by the same
    /// factor.
    Tighten(f64),
    /// Change the scene as described.
    Scene(&'static str),
}

impl Remedy {
    /// Applies the change unless it is a change of the scene. A new formulation also sets its default ordering and
    /// exclusions from the error test.
    pub fn apply(&self, formulation: &mut Formulation, settings: &mut Settings) {
        match self {
            Self::Exclude(fields) => {
                for field in fields {
                    if !settings.suppressed.contains(field) {
                        settings.suppressed.push(*field);
                    }
                }
            }
            Self::WeighByStep => settings.multiplier_weights = MultiplierWeights::StepScaled,
            Self::MaxOrder(order) => settings.max_order = settings.max_order.min(*order),
            Self::Method(other) => *settings = settings.clone().with_integrator(*other),
            Self::Reformulate(other, _) => {
                let defaults = Settings::paper(*other).with_integrator(settings.integrator);
                settings.suppressed = defaults.suppressed;
                settings.ordering = defaults.ordering;
                *formulation = *other;
            }
            Self::Loosen(rtol) | Self::Tighten(rtol) => {
                *settings = settings.clone().with_relative_tolerance(*rtol)
            }
            Self::Scene(_) => {}
        }
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exclude(fields) => {
                write!(f, "exclude {} from the error test", symbols(fields))
            }
            Self::WeighByStep => write!(
                f,
                "scale the error weights of multipliers by the step (multiplier weights `{}`)",
                MultiplierWeights::StepScaled.name()
            ),
            Self::MaxOrder(order) => write!(f, "use order {order} at most"),
            Self::Method(other) => write!(f, "use the method `{}`", other.name()),
            Self::Reformulate(other, index) => {
                write!(f, "use the formulation `{other}` (index {index})")
            }
            Self::Loosen(rtol) => {
                write!(f, "loosen the tolerances (relative tolerance {rtol:e})")
            }
            Self::Tighten(rtol) => {
                write!(f, "tighten the tolerances (relative tolerance {rtol:e})")
            }
            Self::Scene(change) => f.write_str(change),
        }
    }
}

/// A reason why a run fails or is slow, and its remedies.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Blocks of unknowns that cause the problem, if any.
    pub fields: Vec<Field>,
    /// Description of the problem.
    pub problem: String,
    /// Changes that together fix the problem.
    pub remedies: Vec<Remedy>,
}

impl Finding {
    /// Describes all remedies.
    pub(super) fn remedy(&self) -> String {
        let remedies: Vec<_> = self.remedies.iter().map(ToString::to_string).collect();
        remedies.join(" and ")
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}. Remedy: {}", self.problem, self.remedy())
    }
}

pub(super) fn symbols(fields: &[Field]) -> String {
    let symbols: Vec<_> = fields.iter().map(|field| field.name()).collect();
    symbols.join(", ")
}
