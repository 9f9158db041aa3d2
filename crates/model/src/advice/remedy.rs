//! What is wrong with a run, and what mends it.

use std::fmt;

use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::settings::{MultiplierWeights, Settings};

/// A change of formulation or settings.
#[derive(Debug, Clone, PartialEq)]
pub enum Remedy {
    /// Leave these blocks out of the error test.
    LeaveOut(Vec<Field>),
    /// Weigh the errors of multipliers by the step.
    WeighByStep,
    /// Bound the order of BDF.
    MaxOrder(u8),
    /// Take another formulation of the same physics, of this index.
    Reformulate(Formulation, u8),
    /// Loosen the relative tolerance to this, and the absolute ones by the same factor.
    Loosen(f64),
    /// Tighten the relative tolerance to this, and the absolute ones by the same factor.
    Tighten(f64),
    /// Change the scene, in words.
    Scene(&'static str),
}

impl Remedy {
    /// Makes the change, but for one of the scene. A new formulation comes with its own choice of
    /// what to leave out.
    pub fn apply(&self, formulation: &mut Formulation, settings: &mut Settings) {
        match self {
            Self::LeaveOut(fields) => {
                for field in fields {
                    if !settings.suppressed.contains(field) {
                        settings.suppressed.push(*field);
                    }
                }
            }
            Self::WeighByStep => settings.multiplier_weights = MultiplierWeights::StepScaled,
            Self::MaxOrder(order) => settings.max_order = settings.max_order.min(*order),
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
            Self::LeaveOut(fields) => {
                write!(f, "leave {} out of the error test", symbols(fields))
            }
            Self::WeighByStep => write!(
                f,
                "weigh the errors of multipliers by the step (multiplier weights `{}`)",
                MultiplierWeights::StepScaled.name()
            ),
            Self::MaxOrder(order) => write!(f, "take order {order} at most"),
            Self::Reformulate(other, index) => {
                write!(f, "take the formulation `{other}` (index {index})")
            }
            Self::Loosen(rtol) => {
                write!(f, "loosen the tolerances, to a relative one of {rtol:e}")
            }
            Self::Tighten(rtol) => {
                write!(f, "tighten the tolerances, to a relative one of {rtol:e}")
            }
            Self::Scene(change) => f.write_str(change),
        }
    }
}

/// Something that makes a run fail or crawl, and how to mend it.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The blocks at fault, if it is some.
    pub fields: Vec<Field>,
    /// What is wrong.
    pub problem: String,
    /// What to change, all of it.
    pub remedies: Vec<Remedy>,
}

impl Finding {
    /// All that is to be changed, in words.
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

/// The symbols of fields, as a list.
pub(super) fn symbols(fields: &[Field]) -> String {
    let symbols: Vec<_> = fields.iter().map(|field| field.symbol()).collect();
    symbols.join(", ")
}
