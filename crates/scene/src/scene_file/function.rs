//! Functions of time in the form in which a scene defines them.

use std::path::PathBuf;

use myovib_model::formula::Formula;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// A number, or a table with a `type`. Values have the unit of the key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Function {
    /// Constant value.
    Constant(f64),
    /// A value that varies in time.
    Shape(Shape),
}

/// Types of functions of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Shape {
    /// Function given by a formula.
    Formula(Formula),
    /// Function read from a file or composed of other functions.
    Composed(Composed),
}

impl JsonSchema for Shape {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Shape".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let kinds = [Formula::json_schema(generator), Composed::json_schema(generator)];
        let alternatives = kinds.iter().filter_map(|kind| kind.get("oneOf")?.as_array());
        json_schema!({
            "description": "Types of functions of time.",
            "oneOf": alternatives.flatten().collect::<Vec<_>>(),
        })
    }
}

/// Functions of time read from a file or composed of other functions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Composed {
    /// Interpolated measured values; the times must cover the run.
    Table {
        /// CSV file with a header; its path is relative to the scene.
        file: PathBuf,
        /// Column of increasing times, s.
        #[serde(default = "time_column")]
        time: String,
        /// Column of values.
        column: String,
        /// Interpolation between the rows.
        #[serde(default)]
        interpolation: Interpolation,
        /// Whether the values are accelerations, m/s², which vary linearly between the rows; the function is then the
        /// displacement from rest at t = 0.
        #[serde(default)]
        acceleration: bool,
    },
    /// Sum of functions.
    Sum {
        /// Terms.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
    /// Product of functions.
    Product {
        /// Factors.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
}

/// Interpolation between the rows of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Piecewise linear; steps end at each kink. For displacements, allowed only in static and quasi-static analyses.
    #[default]
    Linear,
    /// Monotone cubic interpolation without overshoot.
    Pchip,
    /// Natural cubic spline, which may overshoot.
    Spline,
}

fn time_column() -> String {
    "t".to_owned()
}
