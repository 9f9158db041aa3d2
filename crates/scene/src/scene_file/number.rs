//! Numbers that may be infinite. TOML supports infinity; JSON, the intermediate format of scenes,
//! does not.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Returns the default value of factors.
pub(super) fn one() -> f64 {
    1.0
}

/// Number or `inf`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number(pub(crate) f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_infinite() {
            serializer.serialize_str("inf")
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Number(f64),
            Word(Infinite),
        }
        #[derive(Deserialize)]
        enum Infinite {
            #[serde(rename = "inf")]
            Inf,
        }
        Ok(Self(match Written::deserialize(deserializer)? {
            Written::Number(number) => number,
            Written::Word(Infinite::Inf) => f64::INFINITY,
        }))
    }
}
