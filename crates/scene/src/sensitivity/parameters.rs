//! Scenes as functions of their parameters.

use std::path::{Path, PathBuf};

use myovib_dae as dae;
use myovib_model::Parameters;
use myovib_model::sensitivity::{Dependence, Dependences, Stencil};

use super::influence::{Influence, SceneParameter};
use super::unsupported::unsupported_in_fit;
use crate::scene::{Body, Scene};
use crate::{Error, InputError};

/// A scene with parameters, which can be evaluated at other parameter values.
#[derive(Debug, Clone)]
pub struct Parameterized {
    path: PathBuf,
    set: Vec<String>,
    /// The scene with the parameter values in its file.
    pub scene: Scene,
    pub parameters: Vec<SceneParameter>,
}

/// Relative step of difference quotients of order 4. For a motion of a hundred periods, the truncation error (about (2π
/// f t step)⁴/30) and the rounding error (ε/step) are both about 1e-11.
pub(super) const STEP: f64 = 1e-5;

impl Parameterized {
    /// Reads the scene at `path` and its parameters. Applies the overrides `set`.
    ///
    /// # Errors
    /// Fails if the scene is invalid, or if a parameter does not refer to a number or cannot be differentiated.
    pub fn load(path: &Path, set: &[String]) -> Result<Self, InputError> {
        let scene = Scene::load(path, set)?;
        let parameters = SceneParameter::all(&scene)?;
        let it = Self { path: path.to_owned(), set: set.to_vec(), scene, parameters };
        if let Some((feature, path)) = unsupported_in_fit(&it.scene) {
            return Err(feature.at(&it.scene, &path));
        }
        if it.parameters.is_empty() {
            let error = InputError::new("the scene defines no parameters");
            let next = "add [[parameter]] with key = \"material[0].c10\", for example";
            return Err(it.scene.wrong("", error.next(next)));
        }
        Ok(it)
    }

    /// Returns the scene with additional overrides, for another experiment with the same parameters.
    pub fn with(&self, set: &[String]) -> Result<Self, InputError> {
        Self::load(&self.path, &[&self.set[..], set].concat())
    }

    /// Returns the scene with other values of its parameters.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of parameters.
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

    /// Returns the parameter values in the scene file.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// Returns the dependence of the body, its initial state and the chains on the parameters, at the given values.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of parameters.
    pub fn dependences(&self, values: &[f64]) -> Result<Dependences, Error> {
        let scene = self.at(values)?;
        let at = At { scene: self, values, body: body(&scene)? };
        let one = |j: usize| at.dependence(j);
        let mut all = (0..values.len()).map(one).collect::<Result<Vec<_>, _>>()?;
        if let Some(starts) = at.starts(&all)? {
            let both = all.into_iter().zip(starts);
            all = both.map(|(one, start)| one.starting(start)).collect();
        }
        let chains = match scene.chains.is_empty() {
            true => Vec::new(),
            false => at.of_chains()?,
        };
        Ok(Dependences::new(all).with_chains(chains))
    }
}

/// A scene at given values of its parameters, and its body at these values.
pub(super) struct At<'a> {
    pub(super) scene: &'a Parameterized,
    pub(super) values: &'a [f64],
    pub(super) body: &'a Body,
}

impl At<'_> {
    /// Returns the scene at another `value` of parameter `j`.
    pub(super) fn scene_with(&self, j: usize, value: f64) -> Result<Scene, InputError> {
        let mut values = self.values.to_vec();
        values[j] = value;
        self.scene.at(&values)
    }

    /// Returns the body at another `value` of parameter `j`.
    pub(super) fn neighbor(&self, j: usize, value: f64) -> Result<Body, Error> {
        let Parameters { alpha, beta, .. } = self.body.muscle.parameters;
        let kappa = self.body.muscle.parameters.kappa();
        // Neighbors need not satisfy the formulation's conditions on κ and β. If materials have their own constants,
        // only the scene determines which of these constants change.
        let is_common = !self.body.muscle.solid.has_element_scales();
        let parameters = match self.scene.parameters[j].influence {
            Influence::Compressibility if is_common => Parameters::new(alpha, beta, 1.0 / value)?,
            Influence::Alpha if is_common => Parameters::new(value, beta, kappa)?,
            Influence::Beta if is_common => Parameters::new(alpha, value, kappa)?,
            _ => return Ok(body(&self.scene_with(j, value)?)?.clone()),
        };
        let mut near = self.body.clone();
        near.muscle.parameters = parameters;
        Ok(near)
    }

    fn dependence(&self, j: usize) -> Result<Dependence, Error> {
        let known = &self.scene.parameters[j];
        let formulation = self.body.formulation;
        let value = self.values[j];
        let parameter = dae::Parameter { name: known.key.clone(), value, scale: known.scale };
        if known.influence == Influence::Start || known.affects_chains() {
            return Ok(Dependence::of_start(parameter));
        }
        let other = |value| Ok(self.neighbor(j, value)?.muscle);
        let dependence = if known.is_affine(formulation) {
            let neighbor = |next: f64| Ok::<_, Error>((other(next)?, next - value));
            // Other constants of the law may impose an upper bound on a modulus.
            let (muscle, difference) =
                neighbor(value + known.scale).or_else(|_| neighbor(value - 0.5 * known.scale))?;
            Dependence::affine(parameter, formulation, muscle, difference)
        } else {
            let (stencil, delta, muscles) = self.around(j, STEP, other)?;
            Dependence::smooth(parameter, formulation, muscles, (stencil, delta))
        };
        Ok(match known {
            _ if known.affects_loads() => dependence.on_loads(),
            _ if known.affects_stress(self.body) => dependence.on_forces(),
            _ if known.is_outside_elements(formulation) => dependence.outside_elements(),
            _ => dependence,
        })
    }

    /// Evaluates `of` at the points of a central stencil around the value of parameter `j`. If a point below the value is
    /// invalid, uses a forward stencil instead. Also returns the step between the points, which is `relative` times the
    /// size of the parameter.
    pub(super) fn around<T>(
        &self,
        j: usize,
        relative: f64,
        of: impl Fn(f64) -> Result<T, Error>,
    ) -> Result<(Stencil, f64, Vec<T>), Error> {
        let value = self.values[j];
        let step = self.scene.parameters[j].step(relative, value);
        let all = |stencil: Stencil| {
            let points = stencil.points().iter();
            let all = points.map(|(k, _)| of(value + k * step));
            Ok((stencil, step, all.collect::<Result<_, Error>>()?))
        };
        all(Stencil::Central).or_else(|_: Error| all(Stencil::Ahead))
    }
}

pub(crate) fn body(scene: &Scene) -> Result<&Body, InputError> {
    let body = scene.body.as_ref();
    body.ok_or_else(|| InputError::new("the scene has no body"))
}
