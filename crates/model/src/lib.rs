//! The coupled muscle model as differential-algebraic equations.
//!
//! Data flows in one direction: a [`Muscle`] (body, damping, loads) and a [`Formulation`] define a [`MuscleDae`],
//! which implements `Problem` for the integrators.
//!
//! Main types:
//! - [`Muscle`], [`Parameters`], [`Load`], [`RobinSupport`], [`Activation`], [`Signal`]: the physics,
//!   independent of the formulation (folders `muscle`, `signal`).
//! - [`Formulation`]: pairs each [`Field`] of unknowns with an [`Equation`].
//! - [`MuscleDae`]: residual and Jacobian on the integrator's vectors.
//! - [`Settings`], [`Integrator`], [`run`](fn@run), [`Statistics`]: time integration of a DAE
//!   (folder `integration`; linear systems in [`linear`]).
//! - [`Probe`], [`Displacement`], [`Snapshot`], [`Measurement`], [`Energies`], [`Powers`]: quantities derived
//!   from a state (folder `reading`).
//! - [`RodDae`], [`coupling`]: the rod, and oscillators coupled to a body in one system.
//! - [`InitialValues`]: consistent initial values; [`statics`]: equilibria.
//! - [`index`], [`table1`], [`inf_sup`], [`spectrum`], [`check`]: analysis of the matrices of a
//!   model (folder `analysis`).
//! - [`harmonic`]: harmonic response about an equilibrium.
//! - [`periodic`]: periodic states, also as a function of a parameter, and their Floquet multipliers.
//! - [`advice`]: likely causes and remedies for a run that stopped.
#![doc = include_str!("../notes/0001-formulations.md")]
#![forbid(unsafe_code)]

mod analysis;
mod assembly;
mod blocks;
mod coloring;
mod counters;
mod cpu;
mod driven;
mod error;
mod field;
mod integration;
mod matrices;
mod matrix;
mod muscle;
mod muscle_dae;
mod muscle_index;

mod operators;
mod reading;
mod rod_dae;
mod signal;
mod state;

pub mod advice;
pub mod coupling;
pub mod equation;
pub mod formulation;
pub mod harmonic;
pub mod linear;
pub mod paper;
pub mod periodic;
pub mod sensitivity;
pub mod start;
pub mod statics;

pub use analysis::free_parts::{FreePart, FreeParts};
pub use analysis::{
    check, counterexample, dependent_pressures, index, inf_sup, spectrum, support, table1,
};
pub use integration::{ida, radau, step_weights};

pub use assembly::{Assembly, Entry};
pub use counters::{EvaluationTimes, WorkCounters};
pub use cpu::CpuClock;
pub use equation::Equation;
pub use error::ModelError;
pub use field::{Field, Layout};
pub use formulation::Formulation;
pub use integration::events::first_positive;
pub use integration::ida::IdaIntegrator;
pub use integration::integrator::{Advance, Continuation, Integrator};
pub use integration::launch::{start_at_rest, start_from};
pub use integration::projected::Projected;
pub use integration::radau::RadauIntegrator;
pub use integration::recorder::{SampleTimes, Sampler};
pub use integration::run::{AcceptedStep, Limits, Observer, run};
pub use integration::settings::{
    AbsoluteTolerances, IntegratorKind, LinearSolverKind, MultiplierWeights, Settings, StepOptions,
    default_ordering,
};
pub use integration::statistics::{Counts, EndReason, Outcome, Statistics};
pub use integration::typical::{TypicalStart, TypicalValues, slowest_element};
pub use integration::verify::{ErrorEstimate, loosening};
pub use matrix::{Matrix, Term};
pub use muscle::Muscle;
pub use muscle::activation::Activation;
pub use muscle::load::{Contact, Load, ObstacleMotion, Prescribed, SurfaceLoad};
pub use muscle::parameters::Parameters;
pub use muscle::robin_support::RobinSupport;
pub use muscle_dae::MuscleDae;
pub use reading::displacement::Displacement;
pub use reading::energy::{Energies, Powers};
pub use reading::measure::Measurement;
pub use reading::probe::{Probe, ProbeValue};
pub use reading::quantity::{Components, Quantity};
pub use reading::snapshot::Snapshot;
pub use rod_dae::RodDae;
pub use signal::formula;
pub use signal::jet::Jet;
pub use signal::schedule::Schedule;
pub use signal::spline::{Overshoot, Spline};
pub use signal::table::{Pchip, Points, Polyline};
pub use signal::timing::{Break, TimeScales};
pub use signal::{Signal, TimeFunction};
pub use start::InitialValues;
pub use state::State;
