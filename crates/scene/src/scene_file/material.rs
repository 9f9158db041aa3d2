//! Materials of a scene: a law of the library by its name, and the directions of its fibers.
//!
//! The laws and their constants come from [`myovib_fem::Law::CATALOG`]. A law added there is
//! available in scenes, with its ranges and descriptions in the schema.

use std::collections::BTreeMap;

use myovib_fem::FemError;
use myovib_fem::material::{Description, Parameter, Range};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value, json};

use super::active::Active;
use super::number::{Number, one};
use super::solid::{BulkModulus, SpatialFactor};

/// Another name of `mooney-rivlin`, with c10 = ζ/2 and c01 = 0.
const NEO_HOOKE: &str = "neo-hooke";
const NEO_HOOKE_CONSTANTS: &[Parameter] =
    &[Parameter::new("shear_modulus", "Pa", Range::Positive, "Shear modulus ζ")];

/// Law and constants of a group of elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Material {
    /// Group of elements [default: all that no other material covers].
    pub group: Option<String>,
    /// Mass density ρ, kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: f64,
    /// Factor of the law's stress.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stress_scale: f64,
    /// Factor of the law's stress that varies in space, linear in each element [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
    /// Direction of the fibers.
    pub fiber: Option<Direction>,
    /// Direction of the sheets; its component along the fibers is removed.
    pub sheet: Option<Direction>,
    /// Active tension along the fibers.
    pub active: Option<Active>,
    /// Kelvin–Voigt viscosity η, Pa·s, in the second Piola–Kirchhoff stress `η Ė`. The usual small-strain shear
    /// viscosity is η/2.
    #[schemars(range(min = 0))]
    pub viscosity: Option<f64>,
    /// Prony series of stress relaxation.
    pub prony: Option<Vec<PronyTerm>>,
    /// Springpot (fractional damping) for a response.
    pub springpot: Option<Springpot>,
    /// Bulk modulus κ, Pa [default: `solid.bulk_modulus`]; `inf` in one material requires `inf` in all.
    pub bulk_modulus: Option<BulkModulus>,
    /// Mass-proportional damping α, 1/s [default: `solid.rayleigh_mass`].
    #[schemars(range(min = 0))]
    pub rayleigh_mass: Option<f64>,
    /// Stiffness-proportional damping β, s [default: `solid.rayleigh_stiffness`]; 0 in one material requires 0 in all.
    #[schemars(range(min = 0))]
    pub rayleigh_stiffness: Option<f64>,
    /// The material law.
    #[serde(flatten)]
    pub law: LawConstants,
}

impl Material {
    /// Returns whether the material has a viscous, relaxing or fractional stress.
    pub(crate) fn is_viscous(&self) -> bool {
        self.viscosity.is_some_and(|viscosity| viscosity > 0.0)
            || self.prony.as_ref().is_some_and(|terms| !terms.is_empty())
            || self.springpot.is_some()
    }

    /// Returns the law with its stress multiplied by `stress_scale`.
    ///
    /// # Errors
    /// Fails if a constant is no longer finite.
    pub(crate) fn stiffened(&self) -> Result<myovib_fem::Law, FemError> {
        let law = self.law.law.scaled(self.stress_scale);
        law.check().map(|()| law)
    }
}

/// Adds a stress H with `Ḣ + H/τ = g Ṡ`, where S is the stress of the law without pressure (the long-term stress).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PronyTerm {
    /// Weight g, relative to the long-term stress.
    #[schemars(range(min = 0))]
    pub relative_modulus: f64,
    /// Relaxation time τ, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub relaxation_time: f64,
}

/// Adds `μ^(1-a) η^a (iω)^a` to the complex shear modulus of an isotropic law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Springpot {
    /// Modulus μ, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub modulus: f64,
    /// Viscosity η, Pa·s; often assumed to be 1 Pa·s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub viscosity: f64,
    /// Exponent a: 0 for a spring, 1 for a damper.
    #[schemars(extend("exclusiveMinimum" = 0), extend("exclusiveMaximum" = 1))]
    pub exponent: f64,
}

impl From<&PronyTerm> for myovib_fem::material::PronyTerm {
    fn from(term: &PronyTerm) -> Self {
        Self { weight: term.relative_modulus, time: term.relaxation_time }
    }
}

/// One vector for all elements, or a nodal field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Direction {
    /// Vector of any length.
    Vector(#[schemars(length(min = 2, max = 3))] Vec<f64>),
    /// Name of a nodal field of the mesh file (`$NodeData` with three components).
    Field(String),
}

/// A law of the library with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawConstants {
    /// The law.
    pub law: myovib_fem::Law,
    /// Whether the scene uses the name `neo-hooke`.
    is_neo_hooke: bool,
}

impl From<myovib_fem::Law> for LawConstants {
    fn from(law: myovib_fem::Law) -> Self {
        Self { law, is_neo_hooke: false }
    }
}

impl Serialize for LawConstants {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if let (true, myovib_fem::Law::MooneyRivlin { c10, .. }) = (self.is_neo_hooke, self.law) {
            let shear_modulus = (NEO_HOOKE_CONSTANTS[0].name.to_owned(), Number(2.0 * c10));
            let written =
                Written { law: NEO_HOOKE.to_owned(), constants: BTreeMap::from([shear_modulus]) };
            return written.serialize(serializer);
        }
        let description = self.law.description();
        let constants = description.parameters.iter().zip(self.law.values());
        Written {
            law: description.name.to_owned(),
            constants: constants
                .map(|(parameter, value)| (parameter.name.to_owned(), Number(value)))
                .collect(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for LawConstants {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Written { law, constants } = Written::deserialize(deserializer)?;
        let given = constants.iter().map(|(name, value)| (&**name, value.0));
        let given: Vec<(&str, f64)> = given.collect();
        let (law, is_neo_hooke) = match (&*law, &*given) {
            (NEO_HOOKE, &[("shear_modulus", zeta)]) => {
                let constants = [("c10", 0.5 * zeta), ("c01", 0.0)];
                (myovib_fem::Law::named("mooney-rivlin", &constants), true)
            }
            (name, given) => (myovib_fem::Law::named(name, given), false),
        };
        let law = law.map_err(D::Error::custom)?;
        Ok(Self { law, is_neo_hooke })
    }
}

/// Returns a constant of a law.
pub(crate) fn law_constant(law: &str, name: &str) -> Option<&'static Parameter> {
    let mut laws = myovib_fem::Law::CATALOG.iter();
    let constants = match law {
        NEO_HOOKE => NEO_HOOKE_CONSTANTS,
        _ => laws.find(|known| known.name == law)?.parameters,
    };
    constants.iter().find(|constant| constant.name == name)
}

/// Law as a scene stores it: its name and its constants.
#[derive(Serialize, Deserialize)]
struct Written {
    law: String,
    #[serde(flatten)]
    constants: BTreeMap<String, Number>,
}

impl JsonSchema for LawConstants {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Law".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let laws = myovib_fem::Law::CATALOG.iter().map(alternative);
        let neo_hooke = alternative(&Description {
            name: NEO_HOOKE,
            energy: "ζ/2 (Ī1 - 3)",
            about: "`mooney-rivlin` with c10 = ζ/2, c01 = 0.",
            parameters: NEO_HOOKE_CONSTANTS,
            complete: false,
        });
        json_schema!({ "oneOf": laws.chain([neo_hooke]).collect::<Vec<_>>() })
    }
}

/// Returns the schema of a law's table. The name distinguishes the law from others.
fn alternative(law: &Description) -> Value {
    let name = json!({ "type": "string", "const": law.name });
    let constants = law.parameters.iter();
    let constants = constants.map(|parameter| (parameter.name.to_owned(), constant(parameter)));
    let required = law.parameters.iter().filter(|p| p.default.is_none());
    let required = required.map(|parameter| parameter.name);
    let properties: Map<String, Value> =
        [("law".to_owned(), name)].into_iter().chain(constants).collect();
    let required: Vec<&str> = ["law"].into_iter().chain(required).collect();
    json!({
        "type": "object",
        "description": format!("{} `W = {}`.", law.about, law.energy),
        "properties": properties,
        "required": required,
    })
}

fn constant(parameter: &Parameter) -> Value {
    let unit = match parameter.unit {
        "" => String::new(),
        unit => format!(", {unit}"),
    };
    let description = format!("{}{unit}.", parameter.about);
    let mut number = json!({ "type": "number", "description": &description });
    match parameter.range {
        Range::Positive | Range::PositiveOrInfinite => number["exclusiveMinimum"] = json!(0),
        Range::NotNegative => number["minimum"] = json!(0),
        Range::AtLeastOne => number["minimum"] = json!(1),
        Range::UpToAThird => {
            number["minimum"] = json!(0);
            number["maximum"] = json!(1.0 / 3.0);
        }
        Range::Finite => {}
    }
    let mut schema = match parameter.range {
        Range::PositiveOrInfinite => {
            json!({ "description": description, "anyOf": [number, { "const": "inf" }] })
        }
        _ => number,
    };
    if let Some(value) = parameter.default {
        schema["default"] = match value.is_infinite() {
            true => json!("inf"),
            false => json!(value),
        };
    }
    schema
}

#[cfg(test)]
mod tests {
    use myovib_fem::material::three::Axes;

    use super::*;

    /// Checks that constants other than stresses (exponents and stretches) are unchanged.
    #[test]
    fn a_stiffened_law_has_its_energy_multiplied() {
        let strain = [[0.11, 0.05, -0.03], [0.02, 0.07, 0.04], [0.01, -0.06, 0.09]];
        let axes = Axes { fiber: [1.0, 0.0, 0.0], sheet: [0.0, 1.0, 0.0] };
        for law in myovib_fem::Law::CATALOG {
            let constants: Map<String, Value> = law
                .parameters
                .iter()
                .map(|parameter| {
                    let value = match parameter.range.contains(1.25) {
                        true => 1.25,
                        false => 0.25,
                    };
                    (parameter.name.to_owned(), json!(value))
                })
                .collect();
            let energy = |scale: f64| {
                let mut table = json!({ "law": law.name, "density": 1e3, "stress_scale": scale });
                let table = table.as_object_mut().unwrap();
                table.extend(constants.clone());
                let material: Material = serde_json::from_value(json!(table)).unwrap();
                material.stiffened().unwrap().energy3(strain, axes)
            };
            let (plain, stiff) = (energy(1.0), energy(3.0));
            // The tolerance covers a few terms with one rounding error each.
            assert!(
                plain > 0.0 && (stiff - 3.0 * plain).abs() < 1e-14 * stiff,
                "{}: {plain:e} {stiff:e}",
                law.name
            );
        }
    }
}
