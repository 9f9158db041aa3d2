//! Description of laws: name, and constants with their units and ranges.

use super::Law;
use crate::error::FemError;

/// Range of allowed values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    /// Positive and finite.
    Positive,
    /// Zero or positive, and finite.
    NotNegative,
    /// Positive or infinite.
    PositiveOrInfinite,
    /// Any finite number.
    Finite,
    /// At least one, and finite.
    AtLeastOne,
    /// Between zero and one third.
    UpToAThird,
}

impl Range {
    /// Returns whether a value is allowed. NaN is never allowed.
    pub fn contains(self, value: f64) -> bool {
        match self {
            Range::Positive => value > 0.0 && value.is_finite(),
            Range::NotNegative => value >= 0.0 && value.is_finite(),
            Range::PositiveOrInfinite => value > 0.0,
            Range::Finite => value.is_finite(),
            Range::AtLeastOne => value >= 1.0 && value.is_finite(),
            Range::UpToAThird => (0.0..=1.0 / 3.0).contains(&value),
        }
    }

    /// Returns a description of the range, which continues the words "must be".
    pub fn in_words(self) -> &'static str {
        match self {
            Range::Positive => "positive and finite",
            Range::NotNegative => "zero or positive, and finite",
            Range::PositiveOrInfinite => "positive, or infinite",
            Range::Finite => "finite",
            Range::AtLeastOne => "at least 1 and finite",
            Range::UpToAThird => "between 0 and 1/3",
        }
    }

    /// Checks the value of the named parameter.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a value is out of range.
    pub(crate) fn check(self, name: &'static str, value: f64) -> Result<(), FemError> {
        if self.contains(value) {
            return Ok(());
        }
        Err(FemError::Parameter { name, value, condition: self.in_words() })
    }
}

/// Constant of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in code and scenes.
    pub name: &'static str,
    /// Unit; empty for a dimensionless constant.
    pub unit: &'static str,
    /// Meaning, in one sentence.
    pub about: &'static str,
    /// Allowed values.
    pub range: Range,
    /// Default value, if the constant is optional.
    pub default: Option<f64>,
}

impl Parameter {
    /// Creates a required constant.
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        range: Range,
        about: &'static str,
    ) -> Self {
        Self { name, unit, about, range, default: None }
    }

    /// Returns whether the energy is affine in the constant. This is the case for constants in Pa, which are
    /// factors of terms.
    pub fn is_modulus(&self) -> bool {
        self.unit == "Pa"
    }

    /// Makes the constant optional with a default value.
    pub const fn or(self, default: f64) -> Self {
        Self { default: Some(default), ..self }
    }
}

/// Description of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Description {
    /// Name in scenes.
    pub name: &'static str,
    /// Energy without the pressure term.
    pub energy: &'static str,
    /// Summary, in one sentence.
    pub about: &'static str,
    /// Constants of the law, in the order in which they are listed.
    pub parameters: &'static [Parameter],
    /// Whether the energy includes the volumetric part, so that neither pressure nor κ is added. Such a law is
    /// compatible only with the formulation `displacement`.
    pub complete: bool,
}

/// Law with a description. The constants of the law are its fields.
pub trait Described {
    /// Description of the law.
    const DESCRIPTION: Description;
}

impl Law {
    /// Returns the law with the given name and constants. Other constants have their default values.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownLaw`] or [`FemError::UnknownConstant`] if a name is unknown,
    /// [`FemError::MissingConstant`] if a required constant is missing, or [`FemError::Parameter`] if a value is
    /// out of range.
    ///
    /// # Examples
    /// ```
    /// use myovib_fem::Law;
    /// let law = Law::named("mooney-rivlin", &[("c10", 1e4), ("c01", 2e2)])?;
    /// assert_eq!(law, Law::MooneyRivlin { c10: 1e4, c01: 2e2 });
    /// assert!(Law::named("mooney-rivlin", &[("c10", -1.0)]).is_err());
    /// # Ok::<(), myovib_fem::FemError>(())
    /// ```
    pub fn named(name: &str, constants: &[(&str, f64)]) -> Result<Self, FemError> {
        let Some(description) = Law::CATALOG.iter().find(|law| law.name == name) else {
            return Err(FemError::UnknownLaw {
                name: name.to_owned(),
                known: Law::CATALOG.iter().map(|law| law.name).collect(),
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
        let law = Law::from_values(description.name, &values);
        law.check_combination()?;
        Ok(law)
    }

    /// Checks the ranges of all constants, and the combinations of constants that depend on each other.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a value is out of range or a combination is invalid.
    pub fn check(self) -> Result<(), FemError> {
        let parameters = self.description().parameters.iter();
        parameters
            .zip(self.values())
            .try_for_each(|(parameter, value)| parameter.range.check(parameter.name, value))?;
        self.check_combination()
    }

    /// Checks that the shear modulus is positive, or that the energy is convex, although some coefficients may be
    /// negative.
    fn check_combination(self) -> Result<(), FemError> {
        match self {
            Law::Ogden { .. } => return check_ogden_terms(&self.values()),
            Law::Fung { .. } => return check_fung_weights(&self.values()),
            _ => {}
        }
        let (Law::MooneyRivlin { c10, c01 } | Law::TransverseMooneyRivlin { c10, c01, .. }) = self
        else {
            return Ok(());
        };
        if c01 >= 0.0 || c10 + c01 > 0.0 {
            return Ok(());
        }
        Err(FemError::Parameter {
            name: "c01",
            value: c01,
            condition: "above -c10: the initial shear modulus is 2 (c10 + c01)",
        })
    }
}

/// Checks the terms of Ogden's law. The values alternate between coefficients and exponents.
fn check_ogden_terms(values: &[f64]) -> Result<(), FemError> {
    let parameters = super::Ogden::DESCRIPTION.parameters;
    let mut modulus = 0.0;
    for (parameter, term) in parameters.chunks(2).zip(values.chunks(2)) {
        if term[0] != 0.0 && term[1] == 0.0 {
            return Err(FemError::Parameter {
                name: parameter[1].name,
                value: term[1],
                condition: "different from 0",
            });
        }
        modulus += 0.5 * term[0] * term[1];
    }
    if modulus > 0.0 {
        return Ok(());
    }
    Err(FemError::Parameter {
        name: parameters[0].name,
        value: values[0],
        condition: "such that the initial shear modulus, the sum of mu_i alpha_i/2, is positive",
    })
}

/// Checks that the quadratic form with the weights b_1 to b_6 of Fung's law has no negative values.
fn check_fung_weights(values: &[f64]) -> Result<(), FemError> {
    let [ff, ss, nn, fs, sn, nf] = [1, 2, 3, 4, 5, 6].map(|i| values[i]);
    let minors = [
        vec![ff * ss, -fs * fs],
        vec![ss * nn, -sn * sn],
        vec![nn * ff, -nf * nf],
        vec![ff * ss * nn, 2.0 * fs * sn * nf, -ff * sn * sn, -ss * nf * nf, -nn * fs * fs],
    ];
    // Rounding decides the sign of a zero determinant.
    let is_negative = |terms: &Vec<f64>| {
        let scale: f64 = terms.iter().map(|term| term.abs()).sum();
        let sum: f64 = terms.iter().sum();
        sum < -16.0 * f64::EPSILON * scale || sum.is_nan()
    };
    // If the determinant is negative, the error reports the coupling with the largest contribution to the
    // determinant.
    let parts = [fs * fs * nn, sn * sn * ff, nf * nf * ss];
    let largest = (0..3).max_by(|&a, &b| parts[a].total_cmp(&parts[b])).unwrap_or(0);
    let coupling = |i: usize| if i < 3 { i } else { largest };
    match minors.iter().position(is_negative).map(coupling) {
        None => Ok(()),
        Some(i) => Err(FemError::Parameter {
            name: ["b_4", "b_5", "b_6"][i],
            value: [fs, sn, nf][i],
            condition: "small enough that the matrix (b_1, b_4, b_6; b_4, b_2, b_5; b_6, b_5, b_3) has no negative eigenvalue",
        }),
    }
}
