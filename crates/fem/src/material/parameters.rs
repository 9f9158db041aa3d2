//! What a law says about itself: name, constants with unit and range, where it holds.

use super::Law;
use crate::error::FemError;

/// Which values a constant may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    /// Above zero, finite.
    Positive,
    /// Zero or above, finite.
    NotNegative,
    /// Above zero; infinity is a value of its own.
    PositiveOrInfinite,
    /// Any finite number.
    Finite,
    /// One or above, finite.
    AtLeastOne,
}

impl Range {
    /// Whether a value is allowed; a value that is not a number never is.
    pub fn contains(self, value: f64) -> bool {
        match self {
            Range::Positive => value > 0.0 && value.is_finite(),
            Range::NotNegative => value >= 0.0 && value.is_finite(),
            Range::PositiveOrInfinite => value > 0.0,
            Range::Finite => value.is_finite(),
            Range::AtLeastOne => value >= 1.0 && value.is_finite(),
        }
    }

    /// The range in words, to follow "must be".
    pub fn in_words(self) -> &'static str {
        match self {
            Range::Positive => "positive and finite",
            Range::NotNegative => "zero or positive, and finite",
            Range::PositiveOrInfinite => "positive, or infinite",
            Range::Finite => "finite",
            Range::AtLeastOne => "at least 1 and finite",
        }
    }

    /// Checks a value that has this name.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub(crate) fn check(self, name: &'static str, value: f64) -> Result<(), FemError> {
        if self.contains(value) {
            return Ok(());
        }
        Err(FemError::Parameter {
            name,
            value,
            condition: self.in_words(),
        })
    }
}

/// A constant of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The name in code and in scenes.
    pub name: &'static str,
    /// The unit; empty for a pure number.
    pub unit: &'static str,
    /// One sentence.
    pub about: &'static str,
    /// Allowed values.
    pub range: Range,
    /// The value where none is given.
    pub default: Option<f64>,
}

impl Parameter {
    /// A constant that has to be given.
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        range: Range,
        about: &'static str,
    ) -> Self {
        Self {
            name,
            unit,
            about,
            range,
            default: None,
        }
    }

    /// With a value where none is given.
    pub const fn or(self, default: f64) -> Self {
        Self {
            default: Some(default),
            ..self
        }
    }
}

/// What a law says about itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Description {
    /// The name in scenes.
    pub name: &'static str,
    /// The energy, without the pressure's part.
    pub energy: &'static str,
    /// One sentence.
    pub about: &'static str,
    /// The constants, in their order.
    pub parameters: &'static [Parameter],
    /// Whether it depends on the axes of fibres.
    pub fibres: bool,
    /// Whether its energy holds the volume's part too, so that neither pressure nor κ is added:
    /// such a law goes with the formulation `displacement` only.
    pub complete: bool,
}

/// A law with a description; its constants are its fields.
pub trait Described {
    /// The description.
    const DESCRIPTION: Description;
}

impl Law {
    /// The law of a name with its constants; those not given have their default.
    ///
    /// # Errors
    /// [`FemError::UnknownLaw`], [`FemError::UnknownConstant`], [`FemError::MissingConstant`],
    /// [`FemError::Parameter`] for a value out of range.
    ///
    /// # Examples
    /// ```
    /// use myovib_fem::Law;
    /// let law = Law::named("mooney-rivlin", &[("c10", 1e4), ("c01", 2e2)])?;
    /// assert_eq!(law, Law::MooneyRivlin { c10: 1e4, c01: 2e2 });
    /// let wrong = Law::named("mooney-rivlin", &[("c10", -1.0)]).unwrap_err();
    /// assert_eq!(wrong.to_string(), "c10 = -1 must be zero or positive, and finite");
    /// # Ok::<(), myovib_fem::FemError>(())
    /// ```
    pub fn named(name: &str, constants: &[(&str, f64)]) -> Result<Self, FemError> {
        let Some(description) = Law::CATALOGUE.iter().find(|law| law.name == name) else {
            return Err(FemError::UnknownLaw {
                name: name.to_owned(),
                known: Law::CATALOGUE.iter().map(|law| law.name).collect(),
            });
        };
        let parameters = description.parameters;
        let known = |key: &str| parameters.iter().any(|parameter| parameter.name == key);
        if let Some((key, _)) = constants.iter().find(|(key, _)| !known(key)) {
            return Err(FemError::UnknownConstant {
                law: description.name,
                name: (*key).to_owned(),
                known: parameters.iter().map(|parameter| parameter.name).collect(),
            });
        }
        let mut values = Vec::with_capacity(parameters.len());
        for parameter in parameters {
            let given = constants.iter().find(|(key, _)| *key == parameter.name);
            let value = given.map(|(_, value)| *value).or(parameter.default);
            let value = value.ok_or(FemError::MissingConstant {
                law: description.name,
                name: parameter.name,
                unit: parameter.unit,
            })?;
            parameter.range.check(parameter.name, value)?;
            values.push(value);
        }
        Ok(Law::from_values(description.name, &values))
    }

    /// Checks that every constant is in its range.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub fn check(self) -> Result<(), FemError> {
        let parameters = self.description().parameters.iter();
        parameters
            .zip(self.values())
            .try_for_each(|(parameter, value)| parameter.range.check(parameter.name, value))
    }
}
