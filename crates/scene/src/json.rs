//! Common envelope of all JSON documents.

use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::scene_file::number::Number;
use crate::text::plain_json;
use crate::versions::Versions;

#[derive(Serialize)]
struct Envelope<'a, T> {
    schema: String,
    versions: Versions,
    #[serde(flatten)]
    body: &'a T,
}

/// Returns a JSON document of `command` that contains the fields of `body`. The value `body` must serialize as an
/// object.
///
/// # Errors
/// Returns an error if `body` cannot be serialized.
pub fn document(command: &str, body: &impl Serialize) -> serde_json::Result<String> {
    let envelope =
        Envelope { schema: format!("myovib/{command}/1"), versions: Versions::found(), body };
    let mut text = plain_json(&serde_json::to_string_pretty(&envelope)?);
    text.push('\n');
    Ok(text)
}

/// Adds the members of the object `more` to the object `document`.
pub fn extend(document: &mut Value, more: Value) {
    if let (Some(document), Value::Object(more)) = (document.as_object_mut(), more) {
        document.extend(more);
    }
}

/// Serializes a bulk modulus as a number, or as `"inf"` for an incompressible muscle, because JSON has no infinity. Use
/// it with `#[serde(serialize_with = "json::kappa")]`.
pub fn kappa<S: Serializer>(kappa: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    Number(*kappa).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Row {
        #[serde(serialize_with = "kappa")]
        kappa: f64,
    }

    #[test]
    fn the_document_starts_with_schema_and_versions() {
        let text = document("table2", &Row { kappa: 1e5 }).unwrap();
        let (schema, versions) = (text.find("\"schema\""), text.find("\"versions\""));
        assert!(schema < versions && versions < text.find("\"kappa\""), "{text}");
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["schema"], "myovib/table2/1");
        assert_eq!(value["kappa"], 1e5);
    }

    #[test]
    fn an_infinite_bulk_modulus_is_the_word_inf() {
        let text = serde_json::to_string(&Row { kappa: f64::INFINITY }).unwrap();
        assert_eq!(text, r#"{"kappa":"inf"}"#);
    }
}
