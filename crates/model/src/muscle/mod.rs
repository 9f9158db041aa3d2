//! The muscle: elastic body, damping, loads. What is true of it whatever the formulation.

pub(crate) mod load;
pub(crate) mod parameters;

use myovib_fem::Solid;

use crate::error::ModelError;
use crate::signal::Signal;
use crate::signal::schedule::Schedule;
use load::{Load, Prescribed, PressureLoad};
use parameters::Parameters;

/// An elastic body with its physical constants and what acts on it.
#[derive(Debug, Clone)]
pub struct Muscle {
    /// Operators of the finite element space with material law and density.
    pub solid: Solid,
    /// Damping and compressibility.
    pub parameters: Parameters,
    /// Forces of fixed direction on the body.
    pub loads: Vec<Load>,
    /// Pressures on its deformed boundary.
    pub pressures: Vec<PressureLoad>,
    /// Displacement components that follow a function of time; constrained ones not listed are 0.
    pub prescribed: Vec<Prescribed>,
}

impl Muscle {
    /// A body on which nothing acts.
    pub fn unloaded(solid: Solid, parameters: Parameters) -> Self {
        Self {
            solid,
            parameters,
            loads: Vec::new(),
            pressures: Vec::new(),
            prescribed: Vec::new(),
        }
    }

    /// Whether what is prescribed can be: constrained components, each once, that move without
    /// jumps of their velocity.
    ///
    /// # Errors
    /// [`ModelError::Prescribed`].
    pub fn check(&self) -> Result<(), ModelError> {
        let dofs = self.solid.dofs();
        for (k, prescribed) in self.prescribed.iter().enumerate() {
            let component = prescribed.component;
            let again = |other: &Prescribed| other.component == component;
            let objection = match () {
                () if component >= dofs.n_full() => "there is no such component",
                () if dofs.free_to_full().binary_search(&component).is_ok() => {
                    "it is free: constrain it in the solid's DofMap"
                }
                () if self.prescribed[..k].iter().any(again) => "it is prescribed twice",
                () if prescribed.signal.smoothness() < 1 => {
                    "its velocity would jump: take a signal without kinks"
                }
                () => continue,
            };
            return Err(ModelError::Prescribed {
                component,
                objection,
            });
        }
        Ok(())
    }

    /// Number of coefficients q and λ with the constrained nodes counted, as the paper counts.
    pub fn n_unknowns_paper(&self) -> usize {
        self.solid.space().n_components() + self.solid.space().n_pressures()
    }

    /// The highest frequency of the loads and prescribed motions, Hz, if one of them has any.
    pub fn drive(&self) -> Option<f64> {
        let frequencies = self.signals().filter_map(Signal::frequency);
        frequencies.reduce(f64::max)
    }

    /// What drives it: loads, and prescribed motions with their velocity and acceleration.
    pub fn schedule(&self) -> Schedule {
        let mut schedule = Schedule::default();
        for load in &self.loads {
            schedule.add(load.signal().clone(), 0);
        }
        for pressure in &self.pressures {
            schedule.add(pressure.signal().clone(), 0);
        }
        for prescribed in &self.prescribed {
            schedule.add(prescribed.signal.clone(), 2);
        }
        schedule
    }

    fn signals(&self) -> impl Iterator<Item = &Signal> {
        let loads = self.loads.iter().map(Load::signal);
        let pressures = self.pressures.iter().map(PressureLoad::signal);
        let motions = self.prescribed.iter().map(|p| &p.signal);
        loads.chain(pressures).chain(motions)
    }
}
