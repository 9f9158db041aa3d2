//! Derivatives of the initial state with respect to parameters of a scene.

use myovib_model::sensitivity::Dependence;
use myovib_model::{InitialValues, MuscleDae, statics};

use super::influence::Influence;
use super::parameters::At;
use crate::run::start::initial;
use crate::scene::Start;
use crate::watch::Watcher;
use crate::{Error, InputError};

/// Relative step of the difference quotients of order 4 for consistent initial values. The truncation error is about
/// step⁴. The rounding error is about 1e-16/step. For pressures, which are themselves computed from differences in
/// time, it is about 1e-11/step.
const STEP: f64 = 1e-3;

impl At<'_> {
    /// Rejects parameters whose changes would load a body that is at rest at t = 0.
    fn expect_rest(&self) -> Result<(), Error> {
        for (j, (known, &value)) in self.scene.parameters.iter().zip(self.values).enumerate() {
            if known.affects_loads() {
                let near = self.neighbor(j, value + known.step(STEP, value))?;
                let mut dae = MuscleDae::for_analysis(near.muscle.clone(), near.formulation);
                initial(&near, &mut dae, Watcher::NOBODY).map_err(|cause| {
                    let message = format!(
                        "a change in `{}` would load the body at t = 0, but it starts at rest",
                        known.key
                    );
                    let place = format!("parameter[{j}].key");
                    self.scene.scene.wrong(&place, InputError::new(message).found(cause))
                })?;
            }
        }
        Ok(())
    }

    /// Returns ∂y_0/∂p for each parameter at these values, or `None` for a start at rest, where all these derivatives
    /// are zero. The vector of a parameter without effect on the body is empty.
    ///
    /// The displacements of an equilibrium are differentiated with its tangent matrix. The derivatives of the other
    /// unknowns are difference quotients between the consistent initial values of neighboring scenes.
    ///
    /// # Errors
    /// Fails if the initial state cannot be differentiated.
    pub(super) fn starts(
        &self,
        dependences: &[Dependence],
    ) -> Result<Option<Vec<Vec<f64>>>, Error> {
        let body = self.body;
        let muscle = &body.muscle;
        let equilibrium = match &body.start {
            Start::Rest => {
                self.expect_rest()?;
                return Ok(None);
            }
            Start::State(_) => None,
            Start::Equilibrium => {
                let it = statics::equilibrium(muscle, body.formulation, 0.0)?;
                let stencils: Vec<_> = dependences.iter().map(|one| one.stencil(muscle)).collect();
                let moves = it.derivatives(muscle, body.formulation, 0.0, &stencils)?;
                Some((it.displacement, moves))
            }
        };
        let one = |j: usize| {
            let (known, value) = (&self.scene.parameters[j], self.values[j]);
            if known.affects_chains() {
                return Ok(Vec::new());
            }
            let place = format!("parameter[{j}].key");
            if known.influence == Influence::Compressibility && value == 0.0 {
                let error = InputError::new(
                    "the initial state of an incompressible body has no derivative with respect to 1/bulk_modulus",
                );
                let error = error
                    .next("set a large bulk_modulus, such as 1e7, in the scene or as the `start` of the fit");
                return Err(self.scene.scene.wrong(&place, error).into());
            }
            let of = |value_near: f64| -> Result<Vec<f64>, Error> {
                let near = self.neighbor(j, value_near)?;
                let mut dae = MuscleDae::for_analysis(near.muscle.clone(), near.formulation);
                let Some((displacement, moves)) = &equilibrium else {
                    let start = near.initial_values(&mut dae, Watcher::NOBODY)?;
                    return Ok(start.map_or_else(Vec::new, |[y, _]| y));
                };
                let by = value_near - value;
                let both = displacement.iter().zip(&moves[j]);
                let moved: Vec<f64> = both.map(|(q, of_p)| q + by * of_p).collect();
                let rest = vec![0.0; moved.len()];
                Ok(InitialValues::new(&mut dae, 0.0, &moved, &rest)?.y)
            };
            let (stencil, delta, starts) = self.around(j, STEP, of).map_err(|cause| {
                let message =
                    format!("the initial state has no derivative with respect to `{}`", known.key);
                let error = InputError::new(message).found(cause);
                Error::from(self.scene.scene.wrong(&place, error.next("keep it fixed")))
            })?;
            let mut derivative = vec![0.0; starts[0].len()];
            for ((_, weight), start) in stencil.points().iter().zip(starts) {
                let sum = derivative.iter_mut().zip(start);
                sum.for_each(|(sum, y)| *sum += weight / delta * y);
            }
            Ok(derivative)
        };
        Ok(Some((0..self.values.len()).map(one).collect::<Result<_, Error>>()?))
    }
}
