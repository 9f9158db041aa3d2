//! The parameters of a scene, and the scene at other values of them.

use std::path::{Path, PathBuf};

use myovib_dae as dae;
use myovib_model::sensitivity::{Dependence, Dependences};
use myovib_model::{Formulation, Muscle, Parameters};
use serde_json::Value;

use crate::scene::{Body, Scene};
use crate::scene_file::Analysis;
use crate::scene_file::identification::Parameter;
use crate::{Error, InputError};

/// A scene with the parameters it names, to be had at other values of them.
#[derive(Debug, Clone)]
pub struct Parametrised {
    path: PathBuf,
    set: Vec<String>,
    /// The scene as it is written.
    pub scene: Scene,
    /// The parameters.
    pub parameters: Vec<Known>,
}

/// A parameter of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Its key, which is its name.
    pub key: String,
    /// Its value in the scene.
    pub value: f64,
    /// Its typical size.
    pub scale: f64,
    /// What the scene says of it.
    pub wanted: Parameter,
    influence: Influence,
}

/// How the equations depend on a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Influence {
    /// 1/κ.
    Compressibility,
    /// α.
    Alpha,
    /// β.
    Beta,
    /// The equations are affine in it.
    Affine,
    /// They are not.
    Smooth,
}

/// Numbers that the equations are affine in: moduli, densities, the sizes of loads.
const AFFINE: [&str; 10] = [
    "c10",
    "c01",
    "shear_modulus",
    "lambda",
    "density",
    "stiffness",
    "damping",
    "amplitude",
    "value",
    "of",
];
/// Numbers that they depend on smoothly.
const SMOOTH: [&str; 4] = ["frequency", "phase", "steepness", "shift"];
/// Numbers that move a break of a load.
const BREAKS: [&str; 3] = ["start", "rise", "end"];
/// Tables of loads, which act outside of the elements.
const LOADS: [&str; 3] = ["traction", "pressure", "body_force"];
/// Tables whose numbers may be parameters.
const TABLES: [&str; 7] = [
    "solid",
    "material",
    "bed",
    "traction",
    "pressure",
    "body_force",
    "displacement",
];

/// The step of differences of order 4, relative: truncation (some 2π f t of it)⁴/30 and rounding ε
/// over it are about 1e-11 for a hundred periods.
const STEP: f64 = 1e-5;

impl Parametrised {
    /// Reads the scene at `path`, with overrides, and its parameters.
    ///
    /// # Errors
    /// What is wrong with the scene; a parameter that is no number of it, or none that can be
    /// differentiated.
    pub fn load(path: &Path, set: &[String]) -> Result<Self, InputError> {
        let scene = Scene::load(path, set)?;
        let values = serde_json::to_value(&scene.file).map_err(InputError::new)?;
        let known = scene.file.parameter.iter().enumerate().map(|(i, wanted)| {
            known(&scene, &values, wanted)
                .map_err(|e| scene.wrong(&format!("parameter[{i}].key"), e))
        });
        let parameters = known.collect::<Result<Vec<_>, _>>()?;
        for (i, one) in parameters.iter().enumerate() {
            if parameters[..i].iter().any(|other| other.key == one.key) {
                let error = InputError::new(format!("`{}` is a parameter twice", one.key));
                return Err(scene.wrong(&format!("parameter[{i}].key"), error));
            }
        }
        let it = Self {
            path: path.to_owned(),
            set: set.to_vec(),
            scene,
            parameters,
        };
        it.check()?;
        Ok(it)
    }

    /// What has no sensitivities is refused.
    fn check(&self) -> Result<(), InputError> {
        let (scene, file) = (&self.scene, &self.scene.file);
        let refuse = |path: &str, message: &str, next: &str| {
            Err(scene.wrong(path, InputError::new(message).next(next)))
        };
        if file.analysis != Analysis::Dynamic {
            return refuse(
                "analysis",
                "sensitivities are those of a motion",
                "analysis = \"dynamic\"",
            );
        }
        if !file.chain.is_empty() || scene.body.is_none() {
            let message = "sensitivities are those of a body without chains";
            return refuse("chain", message, "remove [[chain]], [[feedback]] and [rod]");
        }
        if !file.stop.is_empty() {
            let message = "a parameter would move the time at which the run stops";
            return refuse("stop", message, "remove [[stop]]");
        }
        if self.parameters.is_empty() {
            let message = "the scene names no parameter";
            return refuse(
                "",
                message,
                "add [[parameter]] with key = \"material[0].c10\", for one",
            );
        }
        Ok(())
    }

    /// The same scene with more overrides: another experiment with the same parameters.
    ///
    /// # Errors
    /// As for [`load`](Self::load).
    pub fn with(&self, set: &[String]) -> Result<Self, InputError> {
        Self::load(&self.path, &[&self.set[..], set].concat())
    }

    /// The scene at other values of its parameters.
    ///
    /// # Errors
    /// Values that the scene does not allow.
    ///
    /// # Panics
    /// Unless there is a value for each parameter.
    pub fn at(&self, values: &[f64]) -> Result<Scene, InputError> {
        assert_eq!(values.len(), self.parameters.len(), "a value for each");
        let set = self.parameters.iter().zip(values);
        let set = set.map(|(parameter, value)| parameter.assignment(*value));
        self.with_assignments(set)
    }

    fn with_assignments(&self, set: impl Iterator<Item = String>) -> Result<Scene, InputError> {
        let set: Vec<String> = self.set.iter().cloned().chain(set).collect();
        Scene::load(&self.path, &set)
    }

    /// The values in the scene.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// How the body of the scene at these values depends on its parameters.
    ///
    /// # Errors
    /// Values that the scene does not allow.
    ///
    /// # Panics
    /// Unless there is a value for each parameter.
    pub fn dependences(&self, values: &[f64]) -> Result<Dependences, Error> {
        let scene = self.at(values)?;
        let body = body(&scene)?;
        let one = |j: usize| self.dependence(j, values, body);
        let all = (0..values.len()).map(one);
        Ok(Dependences::new(all.collect::<Result<_, _>>()?))
    }

    /// The body of the scene with another value of parameter j.
    fn muscle_at(&self, values: &[f64], j: usize, value: f64) -> Result<Muscle, Error> {
        let mut values = values.to_vec();
        values[j] = value;
        Ok(body(&self.at(&values)?)?.muscle.clone())
    }

    fn dependence(&self, j: usize, values: &[f64], body: &Body) -> Result<Dependence, Error> {
        let known = &self.parameters[j];
        let formulation = body.formulation;
        let parameter = dae::Parameter {
            name: known.key.clone(),
            value: values[j],
            scale: known.scale,
        };
        let other = |value: f64| -> Result<Muscle, Error> {
            let mut muscle = body.muscle.clone();
            let Parameters { alpha, beta, .. } = muscle.parameters;
            let kappa = muscle.parameters.kappa();
            // What a formulation asks of κ and β it asks of the scene, not of its neighbours. Where
            // materials have their own, only the scene knows which of them move.
            muscle.parameters = match known.influence {
                _ if muscle.solid.is_graded() => return self.muscle_at(values, j, value),
                Influence::Compressibility => Parameters::new(alpha, beta, 1.0 / value)?,
                Influence::Alpha => Parameters::new(value, beta, kappa)?,
                Influence::Beta => Parameters::new(alpha, value, kappa)?,
                Influence::Affine | Influence::Smooth => {
                    return self.muscle_at(values, j, value);
                }
            };
            Ok(muscle)
        };
        let value = values[j];
        let dependence = if known.is_affine(formulation) {
            let next = value + known.scale;
            Dependence::affine(parameter, formulation, other(next)?, next - value)
        } else {
            let delta = STEP * value.abs().max(known.scale);
            let around = [-2.0, -1.0, 1.0, 2.0].map(|k| other(value + k * delta));
            let [a, b, c, d] = around;
            Dependence::smooth(parameter, formulation, [a?, b?, c?, d?], delta)
        };
        Ok(match known {
            _ if known.is_of_loads() => dependence.on_loads(),
            _ if known.is_of_stress(body) => dependence.on_forces(),
            _ if known.is_outside_elements(formulation) => dependence.outside_elements(),
            _ => dependence,
        })
    }
}

/// The body of a scene that was checked to have one.
pub(crate) fn body(scene: &Scene) -> Result<&Body, InputError> {
    let body = scene.body.as_ref();
    body.ok_or_else(|| InputError::new("the scene has no body"))
}

impl Known {
    /// The override that gives the scene this value.
    pub fn assignment(&self, value: f64) -> String {
        match self.influence {
            Influence::Compressibility if value == 0.0 => format!("{}=inf", self.key),
            Influence::Compressibility => format!("{}={:e}", self.key, 1.0 / value),
            _ => format!("{}={value:e}", self.key),
        }
    }

    /// Without a pressure, the energy of the volume is proportional to κ, not to 1/κ.
    fn is_affine(&self, formulation: Formulation) -> bool {
        match self.influence {
            Influence::Compressibility => formulation != Formulation::Displacement,
            Influence::Alpha | Influence::Beta | Influence::Affine => true,
            Influence::Smooth => false,
        }
    }

    /// Whether nothing within elements depends on it.
    fn is_outside_elements(&self, formulation: Formulation) -> bool {
        match self.influence {
            Influence::Compressibility => formulation != Formulation::Displacement,
            Influence::Alpha | Influence::Beta => true,
            // Inertia, and the loads that it makes.
            Influence::Affine => self.key.ends_with(".density"),
            Influence::Smooth => false,
        }
    }

    /// Whether nothing but the law's stress depends on it. Of a body with Prony terms more does: they
    /// relax a part of it.
    fn is_of_stress(&self, body: &Body) -> bool {
        let table = self.key.split(['.', '[']).next();
        let name = self.key.rsplit('.').next().unwrap_or("");
        let is_modulus = ["c10", "c01", "shear_modulus", "lambda"].contains(&name);
        table == Some("material")
            && is_modulus
            && self.key.matches('.').count() == 1
            && body.muscle.solid.n_internal() == 0
    }

    /// Whether nothing but loads depends on it.
    fn is_of_loads(&self) -> bool {
        let table = self.key.split(['.', '[']).next();
        table.is_some_and(|table| LOADS.contains(&table))
    }

    /// The number as it is called in tables, with κ's inverse told.
    pub fn label(&self) -> String {
        match self.influence {
            Influence::Compressibility => format!("1/{}", self.key),
            _ => self.key.clone(),
        }
    }
}

fn known(scene: &Scene, values: &Value, wanted: &Parameter) -> Result<Known, InputError> {
    let key = wanted.key.trim();
    let parts: Vec<&str> = key
        .split(['.', '[', ']'])
        .filter(|p| !p.is_empty())
        .collect();
    let (table, last) = (parts.first().copied().unwrap_or(""), last_name(&parts));
    if !TABLES.contains(&table) {
        let error = InputError::new(format!("`{key}` cannot be a parameter"))
            .allowed(format!("numbers of {}", TABLES.join(", ")));
        return Err(error);
    }
    let pointer: String = parts.iter().map(|part| format!("/{part}")).collect();
    let found = values.pointer(&pointer);
    let place = match parts.contains(&"active") {
        true => "active",
        false => table,
    };
    let influence = influence(place, last, found);
    let value = match (influence, found) {
        (Some(Influence::Compressibility), _) => scene
            .file
            .solid
            .as_ref()
            .map_or(0.0, |solid| 1.0 / solid.kappa.0),
        (_, Some(Value::Number(number))) => number.as_f64().unwrap_or(f64::NAN),
        (_, found) => {
            let error = InputError::new(format!("the scene has no number `{key}`"));
            return Err(match found {
                Some(Value::Object(members)) => {
                    let names: Vec<&str> = members.keys().map(String::as_str).collect();
                    error.found(format!("a table with {}", names.join(", ")))
                }
                _ => error.next("name it as --set does: material[0].c10, traction[0].y.amplitude"),
            });
        }
    };
    let influence = influence.ok_or_else(|| {
        let error = InputError::new(format!("`{key}` cannot be differentiated"));
        match BREAKS.contains(&last) {
            true => error.found("a number that moves a break of the load").next(
                "keep it fixed; `amplitude`, `value`, `frequency` and `phase` can be parameters",
            ),
            false => error.allowed("moduli, densities, damping, kappa, sizes and times of loads"),
        }
    })?;
    let size = if value == 0.0 {
        None
    } else {
        Some(value.abs())
    };
    let scale = wanted.scale.or(size).ok_or_else(|| {
        InputError::new(format!("`{key}` is 0 here: its size is not known"))
            .next("add `scale`, a typical size, to the [[parameter]]")
    })?;
    Ok(Known {
        key: key.to_owned(),
        value,
        scale,
        wanted: wanted.clone(),
        influence,
    })
}

/// The last name of a key: that of a list for an entry of it.
fn last_name<'k>(parts: &[&'k str]) -> &'k str {
    let named = |part: &&&str| part.parse::<usize>().is_err();
    parts.iter().rev().find(named).copied().unwrap_or("")
}

fn influence(table: &str, last: &str, found: Option<&Value>) -> Option<Influence> {
    // A load that is written as a number.
    let is_constant = ["x", "y"].contains(&last) && found.is_some_and(Value::is_number);
    match (table, last) {
        ("solid", "kappa") => Some(Influence::Compressibility),
        ("solid", "alpha") => Some(Influence::Alpha),
        ("solid", "beta") => Some(Influence::Beta),
        ("solid", _) => None,
        // Tensions: their sizes; times move breaks.
        ("active", "contractility" | "value" | "amplitude") => Some(Influence::Smooth),
        ("active", _) => None,
        // Where nodes are moved, the law makes forces of it that are not affine.
        ("displacement", last) if AFFINE.contains(&last) || is_constant => Some(Influence::Smooth),
        (_, last) if AFFINE.contains(&last) || is_constant => Some(Influence::Affine),
        (_, last) if SMOOTH.contains(&last) => Some(Influence::Smooth),
        ("material", last) if !["law", "group"].contains(&last) => Some(Influence::Smooth),
        _ => None,
    }
}
