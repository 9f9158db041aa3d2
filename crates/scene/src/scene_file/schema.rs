//! JSON Schema of a scene, derived from its types.

use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value};

use super::SceneFile;

/// Returns the JSON Schema (2020-12) of a scene file.
///
/// Objects are closed: an unknown key is an error, in editors as in `myovib`.
pub fn schema() -> Schema {
    let mut schema = SchemaGenerator::default().into_root_schema_for::<SceneFile>();
    let root = schema.ensure_object();
    close(root);
    if let Some(Value::Object(definitions)) = root.get_mut("$defs") {
        definitions.values_mut().filter_map(Value::as_object_mut).for_each(close);
    }
    schema
}

/// Forbids keys unknown to both the object and its chosen alternative.
fn close(schema: &mut Map<String, Value>) {
    let alternatives = schema.get("oneOf").and_then(Value::as_array);
    let is_object = schema.contains_key("properties")
        || alternatives.is_some_and(|all| all.iter().all(|one| one.get("properties").is_some()));
    if is_object {
        schema.insert("unevaluatedProperties".to_owned(), Value::Bool(false));
    }
}
