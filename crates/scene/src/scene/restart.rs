//! Compares a scene with the run whose final state is its initial state.

use std::fmt::Write as _;
use std::path::Path;

use myovib_model::Signal;
use myovib_model::check::readable;
use serde_json::Value;

use super::builder::Builder;
use crate::inputs::Inputs;
use crate::scene_file::function::Function;
use crate::scene_file::surface_load::SurfaceLoads;
use crate::state::State;

/// Sections that determine the forces on a body in a given state, except for [`LOADS`] and the surface loads.
const SECTIONS: [&str; 9] = [
    "region",
    "group",
    "solid",
    "material",
    "fixed",
    "prescribed_displacement",
    "elastic_foundation",
    "spring",
    "contact",
];
/// Sections of loads. A missing load counts as zero.
const LOADS: [&str; 3] = ["traction", "body_force", "point_force"];
/// Keys that contain the size of a load.
const SIZES: [&str; 4] = ["x", "y", "z", "value"];

/// Keys of these sections that do not affect an equilibrium or that the notes of [`State`] cover.
const EXCLUDED: [&str; 9] = [
    "allow_inverted",
    "damping",
    "formulation",
    "prony",
    "rayleigh_mass",
    "rayleigh_stiffness",
    "response",
    "springpot",
    "viscosity",
];

/// Relative difference below which values of loads count as equal. They may differ by rounding, because the run
/// evaluated them at another time.
const EQUAL: f64 = 1e-9;

impl Builder<'_> {
    /// Adds a note on the values that differ between `file` and `scene`, the scene of the earlier run, which ended in
    /// `state`. Loads are compared by their values at the end of that run and at t = 0 of this scene.
    pub(super) fn note_differences(&self, scene: &Value, state: &State) {
        let Ok(own) = serde_json::to_value(self.file) else {
            return;
        };
        let mut found = Vec::new();
        let loads = LOADS.iter().chain(SurfaceLoads::KEYS).map(|section| (section, true));
        for (section, is_load) in SECTIONS.iter().map(|section| (section, false)).chain(loads) {
            let end = End { t: state.t, is_load };
            self.compare(section, [&scene[section], &own[section]], end, &mut found);
        }
        if found.is_empty() {
            return;
        }
        let mut note = "initial_state.folder: the scene of that run differs".to_owned();
        if state.load_reached.is_some() {
            note.push_str(", so the body does not start in its equilibrium");
        }
        for (i, difference) in found.iter().enumerate() {
            let separator = if i == 0 { ": " } else { "; " };
            let _ = write!(note, "{separator}{difference}");
        }
        self.notes.borrow_mut().push(note);
    }

    /// Adds the differences between the values of both scenes at `path`. The first value belongs to the earlier scene.
    /// Keys that only one scene has are skipped, because they belong to another type or version and that difference is
    /// reported as well.
    fn compare(&self, path: &str, values: [&Value; 2], end: End, found: &mut Vec<String>) {
        if let [Some(then), Some(now)] = values.map(|value| self.signal_of(value, path, end)) {
            let [then, now] = [then.at(end.t).value, now.at(0.0).value];
            if (then - now).abs() > EQUAL * then.abs().max(now.abs()) {
                let [then, now] = [then, now].map(readable);
                let [at, of] = match values.iter().any(|value| value.is_object()) {
                    true => [" at t = 0", "at the end of"],
                    false => ["", "in"],
                };
                found.push(format!("`{path}` is {now}{at} ({then} {of} that run)"));
            }
            return;
        }
        match values {
            [Value::Object(then), Value::Object(now)] => {
                let keys = now.iter().filter(|(key, _)| !EXCLUDED.contains(&key.as_str()));
                for (key, now) in keys {
                    if let Some(then) = then.get(key) {
                        self.compare(&format!("{path}.{key}"), [then, now], end, found);
                    }
                }
            }
            [Value::Array(_) | Value::Null, Value::Array(_)] | [Value::Array(_), Value::Null] => {
                let count = |value: &Value| value.as_array().map_or(0, Vec::len);
                for i in 0..count(values[0]).max(count(values[1])) {
                    let values = values.map(|value| value.get(i).unwrap_or(&Value::Null));
                    self.compare(&format!("{path}[{i}]"), values, end, found);
                }
            }
            [Value::Null, Value::Object(_)] | [Value::Object(_), Value::Null] if end.is_load => {
                for key in SIZES {
                    let values = values.map(|value| &value[key]);
                    self.compare(&format!("{path}.{key}"), values, end, found);
                }
            }
            [then, now] if then != now => {
                let [then, now] = [then, now].map(described);
                found.push(format!("`{path}` is {now} ({then} in that run)"));
            }
            _ => {}
        }
    }

    /// Returns the function of time that a value of a scene defines, if any.
    fn signal_of(&self, value: &Value, path: &str, end: End) -> Option<Signal> {
        if end.is_load && value.is_null() {
            return Some(Signal::constant(0.0));
        }
        let function: Function = serde_json::from_value(value.clone()).ok()?;
        // A separate builder is used, because notes on the function and its files belong to the place where the scene
        // uses it.
        let folder = self.inputs.resolve(Path::new(""));
        let inputs = Inputs::new(&folder);
        Builder::new(self.file, self.source, &inputs).signal(&function, path).ok()
    }
}

/// Context of a comparison.
#[derive(Debug, Clone, Copy)]
struct End {
    /// End of the earlier run (s).
    t: f64,
    /// Whether missing values are zero.
    is_load: bool,
}

/// Formats a value for a note. Lists and tables are only described as "given".
fn described(value: &Value) -> String {
    match value {
        Value::Null => "missing".to_owned(),
        Value::Object(_) | Value::Array(_) => "given".to_owned(),
        Value::String(text) => format!("\"{text}\""),
        other => other.to_string(),
    }
}
