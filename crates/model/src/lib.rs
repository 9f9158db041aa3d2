//! The coupled model as differential-algebraic equations.
//!
//! Data flows one way: a [`Muscle`] (body, damping, loads) is put into a [`Formulation`], which
//! makes it a [`MuscleDae`], an `impl DaeProblem` for the integrators.
//!
//! Cast of types:
//! - [`Muscle`], [`Parameters`], [`Load`], [`Signal`]: the physics, whatever the formulation;
//! - [`Formulation`]: which unknowns ([`Field`]) are paired with which [`Equation`];
//! - [`MuscleDae`]: residual and Jacobian on the integrator's vectors;
//! - [`Probe`], [`Displacement`]: values at a point;
//! - [`Snapshot`], [`Measurement`], [`Energies`]: what else is read off a state;
//! - [`RodDae`], [`coupling`]: the rod, and oscillators driven by a body as one system.
//! - [`Start`]: consistent initial values; [`index`], [`table1`], [`inf_sup`], [`spectrum`]: what the
//!   matrices say of a model; [`check`], [`advice`]: what that means for a run.
#![doc = include_str!("../notes/0001-formulations.md")]
#![forbid(unsafe_code)]

mod assembly;
mod blocks;
mod counters;
mod displacement;
mod energy;
mod error;
mod field;
mod first_step;
mod integrator;
mod jet;
mod launch;
mod load;
mod matrices;
mod matrix;
mod measure;
mod muscle;
mod muscle_dae;
mod number;
mod operators;
mod parameters;
mod probe;
mod projected;
mod recorder;
mod rod_dae;
mod run;
mod settings;
mod signal;
mod spline;
mod state;
mod statistics;

pub mod advice;
pub mod check;
pub mod counterexample;
pub mod coupling;
pub mod equation;
pub mod formulation;
pub mod ida;
pub mod index;
pub mod inf_sup;
pub mod linear;
pub mod paper;
pub mod radau;
pub mod spectrum;
pub mod start;
pub mod statics;
pub mod step_weights;
pub mod table1;

pub use assembly::{Assembly, Entry};
pub use counters::WorkCounters;
pub use displacement::Displacement;
pub use energy::Energies;
pub use equation::Equation;
pub use error::ModelError;
pub use field::{Field, Layout};
pub use formulation::Formulation;
pub use ida::IdaIntegrator;
pub use integrator::{Advance, Integrator};
pub use jet::Jet;
pub use launch::{start_at_rest, start_from};
pub use load::{Load, Prescribed, PressureLoad};
pub use matrix::{Matrix, Term};
pub use measure::{Measurement, Quantity, Snapshot};
pub use muscle::Muscle;
pub use muscle_dae::MuscleDae;
pub use parameters::Parameters;
pub use probe::{Probe, ProbeValue};
pub use projected::Projected;
pub use radau::RadauIntegrator;
pub use recorder::{SampleTimes, Sampler};
pub use rod_dae::RodDae;
pub use run::{Limits, Observer, Step, run};
pub use settings::{
    AbsoluteTolerances, IntegratorKind, LinearSolver, MultiplierWeights, Settings, default_ordering,
};
pub use signal::Signal;
pub use spline::Spline;
pub use start::Start;
pub use state::State;
pub use statistics::{Counts, Outcome, Statistics, StopReason};
