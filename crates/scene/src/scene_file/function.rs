//! Functions of time as a scene writes them.

use std::path::PathBuf;

use myovib_model::formula::Formula;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// A function of time: a number (constant), or a table with a `type`. Its unit is that of what it
/// drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Function {
    /// The same value at all times.
    Constant(f64),
    /// A value that changes.
    Shape(Shape),
}

/// The kinds of functions of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Shape {
    /// Given by a formula.
    Formula(Formula),
    /// Made of a file or of other functions.
    Composed(Composed),
}

impl JsonSchema for Shape {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Shape".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let kinds = [
            Formula::json_schema(generator),
            Composed::json_schema(generator),
        ];
        let alternatives = kinds
            .iter()
            .filter_map(|kind| kind.get("oneOf")?.as_array());
        json_schema!({
            "description": "The kinds of functions of time.",
            "oneOf": alternatives.flatten().collect::<Vec<_>>(),
        })
    }
}

/// Functions of time made of a file or of other functions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Composed {
    /// Values at times from a CSV file, joined by a natural cubic spline; they must cover the run.
    Table {
        /// The file, relative to the scene: a header, then rows of numbers.
        file: PathBuf,
        /// Name of the column of times, s, ascending.
        #[serde(default = "time_column")]
        time: String,
        /// Name of the column of values.
        column: String,
    },
    /// The sum of its terms.
    Sum {
        /// The terms.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
    /// The product of its factors.
    Product {
        /// The factors.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
}

fn time_column() -> String {
    "t".to_owned()
}
