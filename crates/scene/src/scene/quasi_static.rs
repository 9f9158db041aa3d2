//! Requirements of quasi-static analyses.

use myovib_model::{Formulation, IntegratorKind, Muscle, Parameters};

use super::builder::Builder;
use crate::InputError;
use crate::sensitivity::first_jump;

impl Builder<'_> {
    /// Rejects parts of a scene that need inertia, and integration methods that do not support a body without inertia.
    pub(super) fn quasi_static(&self) -> Result<(), InputError> {
        let parts = [
            ("rod", self.file.rod.is_some()),
            ("chain", !self.file.chain.is_empty()),
            ("feedback", !self.file.feedback.is_empty()),
        ];
        if let Some((part, _)) = parts.into_iter().find(|(_, given)| *given) {
            let error = InputError::new(
                "a quasi-static analysis needs a body on a mesh, without rods or chains",
            )
            .next(format!("remove `{part}`, or use analysis = \"dynamic\""));
            return Err(self.wrong(part, error));
        }
        if self.file.integrator.method == IntegratorKind::Bdf {
            let error = InputError::new("BDF does not support quasi-static analyses")
                .allowed("radau5, radau9, radau13");
            return Err(self.wrong("integrator.method", error));
        }
        Ok(())
    }

    /// Rejects formulations and damping that are not available without inertia.
    pub(super) fn without_inertia(
        &self,
        formulation: Formulation,
        parameters: &[Parameters],
    ) -> Result<(), InputError> {
        if parameters.iter().any(|own| own.alpha > 0.0 || own.beta > 0.0) {
            let error = InputError::new(
                "a quasi-static analysis does not support Rayleigh damping",
            )
            .next("set rayleigh_mass and rayleigh_stiffness to 0; use `viscosity` or `prony`");
            return Err(self.wrong("solid", error));
        }
        match formulation {
            Formulation::Position | Formulation::Displacement => Ok(()),
            _ => {
                let error =
                    InputError::new("a quasi-static analysis does not support this formulation")
                        .found(formulation.name())
                        .allowed("position, displacement");
                Err(self.wrong("solid.formulation", error))
            }
        }
    }

    /// Rejects loads that jump, because a body without inertia would follow a jump instantly.
    pub(super) fn expect_no_jump(&self, muscle: &Muscle) -> Result<(), InputError> {
        match muscle.first_jump(self.t_end) {
            None => Ok(()),
            Some(t) => {
                let error = InputError::new("a load or tension jumps in a quasi-static analysis")
                    .found(format!("a jump at t = {t} s"))
                    .next("give the step a short `rise`, or the rows of the table different times");
                let tree = serde_json::to_value(self.file).unwrap_or_default();
                let step = first_jump(&tree, "", self.t_end);
                Err(self.wrong(step.as_deref().unwrap_or("analysis"), error))
            }
        }
    }
}
