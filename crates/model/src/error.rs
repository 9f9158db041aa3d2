//! Errors that occur while a model is built, analyzed or run.

/// An error while building, analyzing or running a model.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum ModelError {
    /// A parameter outside its range.
    #[error("{name} = {value} is out of range: {allowed}")]
    OutOfRange { name: &'static str, value: f64, allowed: &'static str },
    /// A formulation incompatible with κ and β.
    #[error("formulation `{formulation}` is incompatible with κ = {kappa}, β = {beta}: {allowed}")]
    NotAllowed {
        /// Name of the requested formulation.
        formulation: &'static str,
        /// Bulk modulus, Pa; `inf` if incompressible.
        kappa: f64,
        /// Stiffness-proportional damping, s.
        beta: f64,
        allowed: &'static str,
    },
    /// An invalid prescribed displacement.
    #[error("component {component} of the nodal displacement cannot be prescribed: {objection}")]
    Prescribed {
        /// Index of the component in a nodal array.
        component: usize,
        objection: &'static str,
    },
    /// An invalid strain at a rod's end.
    #[error("the strain at the rod's end cannot be prescribed: {objection}")]
    RodStrain { objection: &'static str },
    /// A jump in a load; sensitivities across jumps are not supported.
    #[error(
        "the load jumps at t = {t} s, and sensitivities across a jump are not supported: set `rise` of the step"
    )]
    Jump {
        /// Time of the jump, s.
        t: f64,
    },
    /// Elements whose equations would have different indices.
    #[error(
        "elements {} and {} are of different kinds ({what}), so their equations would have different indices: use one \
         kind for the whole body",
        .elements[0], .elements[1]
    )]
    MixedParameters {
        what: &'static str,
        /// One element of each kind.
        elements: [usize; 2],
    },
    /// An invalid active tension.
    #[error("the tension of active stress {number} cannot be prescribed: {objection}")]
    Activation {
        /// Index of the active stress in the solid.
        number: usize,
        objection: &'static str,
    },
    /// A point outside all elements.
    #[error("the point {} is outside the mesh{}", coordinates(point), how_far(nearest.as_ref()))]
    OutsideMesh {
        /// Coordinates, m.
        point: Vec<f64>,
        /// A nearby point of the mesh and its distance from `point`, m.
        nearest: Option<(Vec<f64>, f64)>,
    },
    /// A point with the wrong number of coordinates for the body.
    #[error("a point of the body has {needed} coordinates, not {found}")]
    Coordinates {
        found: usize,
        /// Number of coordinates of the body.
        needed: usize,
    },
    /// An error of the mesh, its groups or an element.
    #[error(transparent)]
    Fem(#[from] myovib_fem::FemError),
    /// Invalid integrator settings or a fatal error in a callback.
    #[error(transparent)]
    Integrator(#[from] sundials_wrap::Error),
    /// Invalid settings of Radau IIA or a fatal error of the problem.
    #[error(transparent)]
    Radau(#[from] myovib_radau::RadauError),
    /// A setting that Radau IIA does not support.
    #[error("Radau IIA has no `{setting}`: it is a setting of BDF (IDAS)")]
    OnlyBdf { setting: &'static str },
    /// A setting not available for a body with feedback.
    #[error("`{setting}` is not available for a body with feedback: remove it")]
    NotWithFeedback { setting: &'static str },
    /// Newton's method found no static equilibrium.
    #[error(
        "no static equilibrium was found: Newton's method failed beyond {:.1} % of the load, even with small load \
         steps{}; {remedy}",
        100.0 * .reached,
        .inverted.map_or(String::new(), |at| format!("; {at}"))
    )]
    NoEquilibrium {
        /// Fraction of the load up to which an equilibrium was found.
        reached: f64,
        /// An element that was inverted in the last iterations.
        inverted: Option<myovib_fem::Inverted>,
        remedy: String,
    },
    /// Augmented Lagrange multipliers did not remove the penetration of a contact.
    #[error(
        "at {:.1} % of the load, augmented Lagrange multipliers do not remove the penetration of a contact: use a larger \
         `stiffness` of [[contact]]",
        100.0 * .reached
    )]
    Penetration {
        /// Fraction of the load at which the penetration remains.
        reached: f64,
    },
    /// Newton's method found no periodic state.
    #[error(
        "no periodic state was found: the states at the ends of the period differ by {residual:.1e} of their size, \
         and Newton's method does not reduce this to {tolerance:.1e}; start closer to a periodic state: use more \
         `periodic.settling_periods`, or [initial_state] with type = \"equilibrium\" if some loads are constant; or \
         use a smaller `rtol` of [integrator], such as {map_error:.0e}, or a larger `periodic.tolerance`"
    )]
    NoPeriodicState {
        /// Remaining relative difference between the states at the start and the end of the period.
        residual: f64,
        tolerance: f64,
        /// Relative error of the integration over a period.
        map_error: f64,
    },
    /// A curve of periodic states did not reach the end of its range within the maximum number of points.
    #[error(
        "the limit of max_points = {max_points} points is reached before the end of the range: increase \
         `max_points` or `max_step`"
    )]
    CurveTooLong { max_points: usize },
    /// The integration over a period stopped before its end.
    #[error("the integration over a period stopped at t = {t} s: {message}")]
    PeriodStopped {
        /// Time reached, s.
        t: f64,
        message: String,
    },
    /// The search for an equilibrium or a periodic state was interrupted.
    #[error("interrupted before a result was found")]
    Interrupted,
    /// Pressure loads whose work is path-dependent.
    #[error(
        "modes about an equilibrium under follower pressure require the edge of the loaded surface to be fixed: \
         otherwise the load is not conservative and the tangent is not symmetric; fix the edge, or use tractions of \
         fixed direction"
    )]
    NoEnergy,
    /// Supports that do not prevent motions without strain.
    #[error(
        "the supports do not fix the body: {0}; fix more components or more nodes of each part"
    )]
    NotHeld(crate::analysis::free_parts::FreeParts),
    /// A factorization or solve failed.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
    /// An unexpectedly inverted element (det F ≤ 0).
    #[error(transparent)]
    Inverted(#[from] myovib_fem::Inverted),
    /// The number of sources differs from the number of forcing directions.
    #[error("the forcing has {needed} directions, but there are {given} sources")]
    Sources {
        /// Number of forcing directions of the network.
        needed: usize,
        given: usize,
    },
    /// Invalid oscillators, or a window without samples.
    #[error(transparent)]
    Oscillators(#[from] myovib_oscillators::Error),
    /// An evaluation outside the time integration failed.
    #[error(transparent)]
    Evaluation(#[from] myovib_dae::StepError),
    /// No displacement with ∫ψ g(J) = 0 was found near the given displacement.
    #[error(
        "no incompressible displacement was found near the given displacement: a projected volume residual of {volume_residual:.1e} remains"
    )]
    NotIncompressible {
        /// Maximum projected volume residual after the last iteration, in the norm of
        /// [`constraint_drift`](crate::MuscleDae::constraint_drift).
        volume_residual: f64,
    },
    /// The system is too large for the dense computation of the index.
    #[error(
        "{unknowns} unknowns are too many to compute the index from the matrices ({largest} at most): use a coarser mesh"
    )]
    TooLarge { unknowns: usize, largest: usize },
    /// The structural analysis failed.
    #[error(transparent)]
    Structure(#[from] myovib_structure::StructureError),
    /// A measurement of a part missing in the system.
    #[error("the system has no {part}")]
    NoSuchPart { part: &'static str },
    /// A recorder failed to write.
    #[error("cannot write the recorded output")]
    Output(#[from] std::io::Error),
}

impl ModelError {
    /// Returns whether the error means that a search found no result although its input is valid.
    pub fn is_search_without_result(&self) -> bool {
        matches!(
            self,
            Self::NoEquilibrium { .. }
                | Self::Penetration { .. }
                | Self::NoPeriodicState { .. }
                | Self::PeriodStopped { .. }
                | Self::Interrupted
        )
    }
}

fn how_far(nearest: Option<&(Vec<f64>, f64)>) -> String {
    nearest.map_or(String::new(), |(point, distance)| {
        // The search finds the boundary only up to rounding errors.
        let found = point.iter().map(|&x| if x.abs() > 1e-9 * distance { x } else { 0.0 });
        let point = coordinates(&found.collect::<Vec<_>>());
        format!(": {distance:.3e} m from its point {point}")
    })
}

/// Formats the coordinates of a point.
fn coordinates(point: &[f64]) -> String {
    let coordinates: Vec<String> = point.iter().map(f64::to_string).collect();
    format!("({})", coordinates.join(", "))
}
