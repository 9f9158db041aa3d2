//! The damped rod as a [`Problem`]: an ODE in implicit form.

use myovib_dae::{Problem, StepError, VariableKind};
use myovib_fem::FemError;
use myovib_fem::rod::{EndLoad, Rod};
use myovib_structure::harmonic_response;
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::error::ModelError;
use crate::reading::displacement::Displacement;
use crate::signal::Signal;
use crate::signal::schedule::Schedule;
use crate::start::saddle::Saddle;

/// F(t, y, ẏ) = 0 for a [`Rod`] under a signal at its free end. Paper: eqs. (35), (36).
///
/// # Shapes
/// y = (q, v) at the free nodes, from the fixed end to the loaded end.
#[derive(Debug, Clone)]
pub struct RodDae {
    rod: Rod,
    load: EndLoad,
    signal: Signal,
}

impl RodDae {
    /// Builds the system from the rod, the type of its end load, and the signal τ(t).
    ///
    /// # Errors
    /// Returns [`ModelError::RodStrain`] if a strain is prescribed whose value or slope jumps.
    pub fn new(rod: Rod, load: EndLoad, signal: Signal) -> Result<Self, ModelError> {
        match (load, signal.unfit_for_motion()) {
            (EndLoad::Strain, Some(objection)) => Err(ModelError::RodStrain { objection }),
            _ => Ok(Self { rod, load, signal }),
        }
    }

    /// Returns the rod.
    pub fn rod(&self) -> &Rod {
        &self.rod
    }

    /// Returns the signal at the free end.
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// Returns the excitation: the signal and, for a prescribed strain, its derivative.
    pub fn schedule(&self) -> Schedule {
        let derivatives = match self.load {
            EndLoad::Strain => 1,
            EndLoad::Traction => 0,
        };
        let mut schedule = Schedule::default();
        schedule.add(self.signal.clone(), derivatives);
        schedule
    }

    /// Returns ẏ at time `t` for the displacements and velocities `y`: (v, M⁻¹ (f e − (α M + β A) v
    /// − A q)).
    pub fn rates(&mut self, t: f64, y: &[f64]) -> Result<Vec<f64>, ModelError> {
        let n = self.rod.n_free();
        let mut y_dot = vec![0.0; 2 * n];
        y_dot[..n].copy_from_slice(&y[n..]);
        let mut residual = vec![0.0; 2 * n];
        self.residual(t, y, &y_dot, &mut residual)?;
        let (missing, _) = Saddle::alone(self.rod.mass(), &mut None)?.solve(&residual[n..], &[])?;
        for (rate, missing) in y_dot[n..].iter_mut().zip(missing) {
            *rate = -missing;
        }
        Ok(y_dot)
    }

    /// Returns the amplitudes of the states (q, v) for the end load Re(τ̂ e^{st}) with s = iω.
    pub fn harmonic_response(
        &self,
        s: Complex64,
        tau: Complex64,
    ) -> Result<Vec<Complex64>, ModelError> {
        let rest = vec![0.0; self.rod.n_states()];
        let mut amplitudes = vec![Complex64::ZERO; rest.len()];
        let by_tau = self.rod.end_force(self.load, 1.0, 0.0);
        let by_rate = self.rod.end_force(self.load, 0.0, 1.0);
        if let Some(last) = amplitudes.last_mut() {
            *last = tau * (by_tau + s * by_rate);
        }
        harmonic_response(&mut self.clone(), (0.0, &rest), s, &mut amplitudes)?;
        Ok(amplitudes)
    }

    /// Returns an interpolation of the displacement at the point `x` of the rod.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if the point is outside the rod.
    pub fn displacement_at(&self, x: f64) -> Result<Displacement, FemError> {
        let point = self.rod.displacement_at(x)?;
        Ok(Displacement::of_unknowns(point.entries))
    }
}

impl Problem for RodDae {
    fn n_unknowns(&self) -> usize {
        self.rod.n_states()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let tau = self.signal.at(t);
        let force = self.rod.end_force(self.load, tau.value, tau.d1);
        self.rod.residual(y, y_dot, force, residual);
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.rod.jacobian_pattern().clone()
    }

    fn jacobian(
        &mut self,
        _t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.rod.jacobian(a, b, values);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential; self.n_unknowns()])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0; self.n_unknowns()])
    }

    fn component_name(&self, i: usize) -> String {
        let n = self.rod.n_free();
        format!("rod {} at node {}", ["q", "v"][i / n], i % n + 1)
    }
}
