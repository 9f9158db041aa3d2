//! Parameters of scenes, and the dependence of the equations on parameters.

use myovib_model::Formulation;
use myovib_model::formula::{Formula, Role};
use serde::Deserialize;
use serde_json::Value;

use crate::InputError;
use crate::scene::{Body, Scene};
use crate::scene_file::identification::Parameter;
use crate::scene_file::material::law_constant;
use crate::scene_file::surface_load::SurfaceLoads;

/// Dependence of the equations on a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Influence {
    /// The parameter is 1/κ.
    Compressibility,
    Alpha,
    Beta,
    /// The equations are affine in the parameter.
    Affine,
    /// The equations depend smoothly on the parameter.
    Smooth,
    /// The parameter shifts a time at which the load is only twice continuously differentiable.
    Break,
    /// The parameter changes only the initial state.
    Start,
}

/// Keys on which the equations depend affinely, in addition to moduli of laws and to factors in functions of time.
const AFFINE: [&str; 5] = ["density", "stress_scale", "stiffness", "damping", "of"];
/// Keys on which the equations depend smoothly, in addition to constants in functions of time.
const SMOOTH: [&str; 1] = ["phase"];
/// Keys of activation models that shift a break, which is a time at which the tension is not smooth.
const BREAKS: [&str; 4] = ["start", "end", "systole", "diastole"];
/// Keys of a chain on which the equations of the chain depend affinely or smoothly, respectively.
const CHAIN_AFFINE: [&str; 4] = ["gain", "coupling", "van_der_pol", "duffing"];
const CHAIN_SMOOTH: [&str; 2] = ["frequency", "frequency_spread"];
/// Tables of loads other than surface loads. They do not contribute to element integrals.
const LOADS: [&str; 3] = ["traction", "body_force", "point_force"];
/// Other tables whose numbers can be parameters.
const TABLES: [&str; 7] = [
    "solid",
    "material",
    "elastic_foundation",
    "spring",
    "chain",
    "prescribed_displacement",
    "initial_state",
];

fn affects_loads(table: &str) -> bool {
    LOADS.contains(&table) || SurfaceLoads::KEYS.contains(&table)
}

/// A number in a scene that is fitted, or with respect to which sensitivities are computed.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneParameter {
    pub key: String,
    pub value: f64,
    /// Typical size.
    pub scale: f64,
    /// The `[[parameter]]` entry.
    pub wanted: Parameter,
    pub(super) influence: Influence,
}

impl SceneParameter {
    /// Returns the parameters of a scene.
    ///
    /// # Errors
    /// Fails if a key does not refer to a number, if a number cannot be differentiated, or if a key is used twice.
    pub fn all(scene: &Scene) -> Result<Vec<Self>, InputError> {
        let values = serde_json::to_value(&scene.file).map_err(InputError::new)?;
        let mut parameters: Vec<Self> = Vec::new();
        for (i, wanted) in scene.file.parameter.iter().enumerate() {
            let wrong = |error| scene.wrong(&format!("parameter[{i}].key"), error);
            let one = known(scene, &values, wanted).map_err(wrong)?;
            if one.table() == "prescribed_displacement" && !scene.chains.is_empty() {
                let error = InputError::new(format!(
                    "`{}` cannot be a parameter: it may drive a chain",
                    one.key
                ));
                return Err(wrong(error.next("keep it fixed, or remove [[chain]]")));
            }
            if parameters.iter().any(|other| other.key == one.key) {
                let error = InputError::new(format!("duplicate parameter `{}`", one.key));
                return Err(wrong(error));
            }
            parameters.push(one);
        }
        Ok(parameters)
    }

    /// Returns the override that sets the parameter to a value.
    pub fn assignment(&self, value: f64) -> String {
        match self.influence {
            Influence::Compressibility if value == 0.0 => format!("{}=inf", self.key),
            Influence::Compressibility => format!("{}={:e}", self.key, 1.0 / value),
            _ => format!("{}={value:e}", self.key),
        }
    }

    /// Returns whether the equations depend affinely on the parameter. In formulations without pressure, the volumetric
    /// energy is proportional to κ, whereas the parameter is 1/κ.
    pub(super) fn is_affine(&self, formulation: Formulation) -> bool {
        match self.influence {
            Influence::Compressibility => formulation != Formulation::Displacement,
            Influence::Alpha | Influence::Beta | Influence::Affine => true,
            Influence::Smooth | Influence::Break | Influence::Start => false,
        }
    }

    /// Returns the step of a difference quotient: `relative` times the size of the parameter.
    pub(super) fn step(&self, relative: f64, value: f64) -> f64 {
        let size = match self.influence {
            // The shift of a break must be small compared with the rise time, not with the time of the break.
            Influence::Break => self.scale,
            _ => value.abs().max(self.scale),
        };
        relative * size
    }

    /// Returns whether the element integrals are independent of the parameter.
    pub(super) fn is_outside_elements(&self, formulation: Formulation) -> bool {
        match self.influence {
            Influence::Compressibility => formulation != Formulation::Displacement,
            Influence::Alpha | Influence::Beta => true,
            // The density affects only inertia and body forces.
            Influence::Affine => self.key.ends_with(".density"),
            Influence::Smooth | Influence::Break | Influence::Start => false,
        }
    }

    fn table(&self) -> &str {
        self.key.split(['.', '[']).next().unwrap_or("")
    }

    /// Returns whether the parameter affects only the stress of the law, and affects it affinely. This is not the case
    /// with Prony terms, which also depend on the constants of the law.
    pub(super) fn affects_stress(&self, body: &Body) -> bool {
        self.table() == "material"
            && self.influence == Influence::Affine
            && !self.key.ends_with(".density")
            && self.key.matches('.').count() == 1
            && body.muscle.solid.n_internal() == 0
    }

    /// Returns whether only loads depend on the parameter.
    pub(super) fn affects_loads(&self) -> bool {
        affects_loads(self.table())
    }

    /// Returns the zero-based index of the chain to which the parameter belongs, if any.
    pub(super) fn chain(&self) -> Option<usize> {
        let (number, _) = self.key.strip_prefix("chain[")?.split_once(']')?;
        number.trim().parse().ok()
    }

    /// Returns whether only a chain depends on the parameter.
    pub(super) fn affects_chains(&self) -> bool {
        self.chain().is_some()
    }

    /// Returns the name of the parameter in tables: `1/KEY` for κ, otherwise the key.
    pub fn label(&self) -> String {
        match self.influence {
            Influence::Compressibility => format!("1/{}", self.key),
            _ => self.key.clone(),
        }
    }
}

/// Returns the parameter that a `[[parameter]]` entry defines. `values` is the scene file as a JSON tree.
///
/// # Errors
/// Fails if the key does not refer to a number, or if the number cannot be differentiated.
fn known(scene: &Scene, values: &Value, wanted: &Parameter) -> Result<SceneParameter, InputError> {
    let parts: Vec<&str> =
        wanted.key.trim().split(['.', '[', ']']).filter(|p| !p.is_empty()).collect();
    let key = &key_of(&parts);
    let (table, last) = (parts.first().copied().unwrap_or(""), last_name(&parts));
    if !TABLES.contains(&table) && !affects_loads(table) {
        let error = InputError::new(format!("`{key}` cannot be a parameter")).allowed(format!(
            "numbers of {}",
            [&TABLES[..], &LOADS, SurfaceLoads::KEYS].concat().join(", ")
        ));
        return Err(error);
    }
    let pointer: String = parts.iter().map(|part| format!("/{part}")).collect();
    let found = values.pointer(&pointer);
    let place = match parts.contains(&"active") {
        true => "active",
        false => table,
    };
    let (parent, _) = pointer.rsplit_once('/').unwrap_or_default();
    let role = role(last, values.pointer(parent));
    let influence = influence(place, last, role, found, values.pointer(parent));
    let value = match (influence, found) {
        (Some(Influence::Compressibility), _) => {
            scene.file.solid.as_ref().map_or(0.0, |solid| 1.0 / solid.bulk_modulus.0)
        }
        (_, Some(Value::Number(number))) => number.as_f64().unwrap_or(f64::NAN),
        (_, found) => {
            let error = InputError::new(format!("the scene has no numeric key `{key}`"));
            return Err(match found {
                Some(Value::Object(members)) => {
                    let names: Vec<&str> = members.keys().map(String::as_str).collect();
                    error.found(format!("a table with {}", names.join(", ")))
                }
                Some(Value::Array(_)) => {
                    error.found("a list").next(format!("choose an entry, as in `{key}[0]`"))
                }
                _ => match values.pointer(parent) {
                    Some(Value::Object(members)) if !parent.is_empty() => {
                        let numbers = members.iter().filter(|(_, value)| value.is_number());
                        let names: Vec<&str> = numbers.map(|(name, _)| name.as_str()).collect();
                        error.allowed(names.join(", "))
                    }
                    _ if table == "initial_state" => {
                        error.next("set [initial_state] type = \"velocity\" with a `value`")
                    }
                    _ => error.next(
                        "write the key in the form used by --set: material[0].c10, traction[0].y.amplitude",
                    ),
                },
            });
        }
    };
    let influence = influence.ok_or_else(|| {
        let moves_break = role == Some(Role::Break) || BREAKS.contains(&last);
        refused(key, place, moves_break)
    })?;
    let size = match influence {
        Influence::Break => rise(values.pointer(parent)),
        _ => Some(value.abs()).filter(|size| *size > 0.0),
    };
    let scale = wanted.scale.or(size).ok_or_else(|| {
        InputError::new(format!("`{key}` is 0: its typical size is unknown"))
            .next("add `scale`, a typical size, to the [[parameter]]")
    })?;
    Ok(SceneParameter { key: key.clone(), value, scale, wanted: wanted.clone(), influence })
}

/// Returns the canonical spelling of a key. For example, `material.0.c10` becomes `material[0].c10`.
fn key_of(parts: &[&str]) -> String {
    parts.iter().fold(String::new(), |key, part| match part.parse::<usize>() {
        Ok(number) => format!("{key}[{number}]"),
        Err(_) if key.is_empty() => (*part).to_owned(),
        Err(_) => format!("{key}.{part}"),
    })
}

/// Returns the last name in a key. For an entry of a list, this is the name of the list.
fn last_name<'k>(parts: &[&'k str]) -> &'k str {
    let named = |part: &&&str| part.parse::<usize>().is_err();
    parts.iter().rev().find(named).copied().unwrap_or("")
}

/// Returns the error for a key with respect to which derivatives are not available. The error describes the allowed
/// keys.
fn refused(key: &str, table: &str, moves_break: bool) -> InputError {
    let error = InputError::new(format!("`{key}` cannot be differentiated"));
    match (table, moves_break) {
        ("active", true) => error.found("a value that shifts a discontinuity of the tension").next(
            "keep it fixed; a constant `tension`, `contractility`, `value` and `amplitude` can be parameters",
        ),
        ("prescribed_displacement", true) => error
            .found("a value that shifts a discontinuity of the support's acceleration")
            .next("keep it fixed; `amplitude`, `value`, `frequency` and `phase` can be parameters"),
        (_, true) => error
            .found("a value that shifts a discontinuity of the load")
            .next(
                "write the load as a step with a `rise` above 0, whose `start` and `rise` can be parameters",
            )
            .next("or keep it fixed; `amplitude`, `value`, `frequency` and `phase` can be parameters"),
        ("chain", _) => {
            let all = [&CHAIN_AFFINE[..], &CHAIN_SMOOTH, &["initial"]].concat();
            error.allowed(all.join(", "))
        }
        (_, false) => error.allowed(
            "constants of materials, elastic foundations, springs and chains, damping, bulk_modulus, sizes of loads, times of \
             smooth loads, the initial velocity",
        ),
    }
}

/// Returns the rise time of a step function if it is positive.
fn rise(function: Option<&Value>) -> Option<f64> {
    let step = function.filter(|it| it["type"] == "step")?;
    step["rise"].as_f64().filter(|rise| *rise > 0.0)
}

/// Returns the path of the first step function that jumps before `t_end`.
pub(crate) fn first_jump(tree: &Value, path: &str, t_end: f64) -> Option<String> {
    match tree {
        Value::Object(members) => {
            let start = tree["start"].as_f64().unwrap_or(0.0);
            if tree["type"] == "step" && rise(Some(tree)).is_none() && start < t_end {
                return Some(path.to_owned());
            }
            let mut members = members.iter();
            members.find_map(|(key, value)| {
                let dot = if path.is_empty() { "" } else { "." };
                first_jump(value, &format!("{path}{dot}{key}"), t_end)
            })
        }
        Value::Array(list) => {
            let mut list = list.iter().enumerate();
            list.find_map(|(i, value)| first_jump(value, &format!("{path}[{i}]"), t_end))
        }
        _ => None,
    }
}

/// Returns the role of the key `last` in the function of time `parent`, or `None` if `parent` is not such a function.
fn role(last: &str, parent: Option<&Value>) -> Option<Role> {
    Formula::deserialize(parent?).ok()?.role(last)
}

/// Returns whether the key `last` is a modulus of the law of a material.
fn is_modulus(last: &str, material: Option<&Value>) -> bool {
    let law = material.and_then(|material| material["law"].as_str());
    let constant = law.and_then(|law| law_constant(law, last));
    constant.is_some_and(|constant| constant.is_modulus())
}

/// Returns how the equations depend on the key `last` of a table. `found` is the value of the key, and `parent`
/// contains the key.
fn influence(
    table: &str,
    last: &str,
    role: Option<Role>,
    found: Option<&Value>,
    parent: Option<&Value>,
) -> Option<Influence> {
    // The key is a constant load.
    let is_constant =
        ["x", "y", "z", "value"].contains(&last) && found.is_some_and(Value::is_number);
    let is_affine = AFFINE.contains(&last)
        || is_constant
        || role == Some(Role::Factor)
        || table == "material" && is_modulus(last, parent);
    match (table, last) {
        ("solid", "bulk_modulus") => Some(Influence::Compressibility),
        ("solid", "rayleigh_mass") => Some(Influence::Alpha),
        ("solid", "rayleigh_stiffness") => Some(Influence::Beta),
        ("solid", _) => None,
        ("initial_state", "value") | ("chain", "initial") => Some(Influence::Start),
        ("chain", last) if CHAIN_AFFINE.contains(&last) => Some(Influence::Affine),
        ("chain", last) if CHAIN_SMOOTH.contains(&last) => Some(Influence::Smooth),
        ("chain", _) => None,
        ("initial_state", _) => None,
        // The size of a tension is a smooth parameter, but its times shift breaks.
        ("active", "contractility") => Some(Influence::Smooth),
        ("active", _) if role == Some(Role::Factor) => Some(Influence::Smooth),
        ("active", "tension") if found.is_some_and(Value::is_number) => Some(Influence::Smooth),
        ("active", _) => None,
        // The slope of a smooth step is continuous at its breaks.
        (table, _)
            if role == Some(Role::Break) && affects_loads(table) && rise(parent).is_some() =>
        {
            Some(Influence::Break)
        }
        // The equations are not affine in prescribed displacements, because these act through the law.
        ("prescribed_displacement", "angle") if found.is_some_and(Value::is_number) => {
            Some(Influence::Smooth)
        }
        ("prescribed_displacement", _) if is_affine => Some(Influence::Smooth),
        _ if is_affine => Some(Influence::Affine),
        (_, last) if role == Some(Role::Smooth) || SMOOTH.contains(&last) => {
            Some(Influence::Smooth)
        }
        ("material", last) if !["law", "group"].contains(&last) => Some(Influence::Smooth),
        _ => None,
    }
}
