//! What can be wrong with a model before any time step is taken.

/// Errors of building or running a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A parameter outside its range.
    #[error("{name} = {value} is out of range: {allowed}")]
    OutOfRange {
        /// The parameter's name.
        name: &'static str,
        /// What was found.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// A formulation that does not go with the given κ and β.
    #[error(
        "formulation `{formulation}` does not go with kappa = {kappa}, beta = {beta}: {allowed}"
    )]
    NotAllowed {
        /// Name of the formulation asked for.
        formulation: &'static str,
        /// Bulk modulus, `inf` for the incompressible case.
        kappa: f64,
        /// Stiffness-proportional damping, s.
        beta: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// A prescribed displacement that cannot be.
    #[error("component {component} of the nodal displacement cannot be prescribed: {objection}")]
    Prescribed {
        /// Its index in a nodal array.
        component: usize,
        /// Why not, and what can be done.
        objection: &'static str,
    },
    /// A strain at a rod's end that cannot be.
    #[error("the strain at the rod's end cannot be given: {objection}")]
    RodStrain {
        /// Why not, and what can be done.
        objection: &'static str,
    },
    /// A load that jumps where that is not followed.
    #[error(
        "the load jumps at t = {t} s, and sensitivities across a jump are not computed: give the step a rise"
    )]
    Jump {
        /// When, s.
        t: f64,
    },
    /// Elements whose equations have different indices.
    #[error(
        "elements {} and {} differ in kind, {what}: the equations would have an index for each; \
         choose one sort for the whole body",
        .elements[0], .elements[1]
    )]
    MixedParameters {
        /// What differs.
        what: &'static str,
        /// An element of each sort.
        elements: [usize; 2],
    },
    /// A tension that cannot be given.
    #[error("the tension of added stress {number} cannot be given: {objection}")]
    Activation {
        /// The number of the stress in the solid.
        number: usize,
        /// Why not, and what can be done.
        objection: &'static str,
    },
    /// A point that lies in no element.
    #[error("the point {} lies outside the mesh", place(point))]
    OutsideMesh {
        /// Coordinates, m.
        point: Vec<f64>,
    },
    /// A point of the plane for a body in space, or the other way round.
    #[error("a point of the body has {needed} coordinates, not {found}")]
    Coordinates {
        /// How many were given.
        found: usize,
        /// How many the body has.
        needed: usize,
    },
    /// The mesh, its groups, or an element.
    #[error(transparent)]
    Fem(#[from] myovib_fem::FemError),
    /// The integrator's settings or a fatal error within a callback.
    #[error(transparent)]
    Integrator(#[from] sundials_wrap::Error),
    /// The settings of Radau IIA, or a fatal error of the problem under it.
    #[error(transparent)]
    Radau(#[from] myovib_radau::RadauError),
    /// A setting that Radau IIA does not have.
    #[error("Radau IIA has no `{setting}`: it is a setting of BDF (IDAS)")]
    OnlyBdf {
        /// The setting's name.
        setting: &'static str,
    },
    /// A setting that a body whose stiffness follows its oscillators does not have.
    #[error("a body with feedback has no `{setting}`: leave it out")]
    NotWithFeedback {
        /// The setting's name.
        setting: &'static str,
    },
    /// Newton's method found no static equilibrium.
    #[error(
        "no static equilibrium: Newton's method failed beyond {:.1} % of the load even in small load steps{}; {remedy}",
        100.0 * .reached,
        .inverted.map_or(String::new(), |at| format!(", meeting {at}"))
    )]
    NoEquilibrium {
        /// The part of the load for which there is one.
        reached: f64,
        /// An element that the last trials turned inside out.
        inverted: Option<myovib_fem::Inverted>,
        /// What may help.
        remedy: String,
    },
    /// The caller ended the search for an equilibrium.
    #[error("interrupted before the equilibrium was found")]
    Interrupted,
    /// Pressures whose work depends on the way.
    #[error(
        "there are no modes about an equilibrium under pressures that follow the body where the edge of their surface moves: \
         their work depends on the way, and the tangent is not symmetric; hold the edge, or take tractions of fixed direction"
    )]
    NoEnergy,
    /// Supports that leave motions without strain.
    #[error(
        "the supports do not hold the body: {0}; hold more components, or more nodes of each part"
    )]
    NotHeld(crate::analysis::free_parts::FreeParts),
    /// A factorisation or solve with KLU.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
    /// An element with det F ≤ 0 where none is expected.
    #[error(transparent)]
    Inverted(#[from] myovib_fem::Inverted),
    /// Another number of sources than directions of the forcing.
    #[error("the forcing has {needed} directions, but {given} sources are given")]
    Sources {
        /// Directions of the network's forcing.
        needed: usize,
        /// Sources given.
        given: usize,
    },
    /// The description of the oscillators, or a window without samples.
    #[error(transparent)]
    Oscillators(#[from] myovib_oscillators::Error),
    /// An evaluation beside the integration.
    #[error(transparent)]
    Evaluation(#[from] myovib_dae::StepError),
    /// A displacement from which none with ∫ψ (J - 1) = 0 is found.
    #[error(
        "no incompressible displacement is found near the one given: a projected volume defect of {defect:.1e} is left"
    )]
    NotIncompressible {
        /// The largest projected defect left, as in the constraint drift.
        defect: f64,
    },
    /// A system too large for the dense method that finds the index.
    #[error(
        "{unknowns} unknowns are too many to compute the index from the matrices ({largest} at most): take the same scene on a coarser mesh"
    )]
    TooLarge {
        /// Number of unknowns.
        unknowns: usize,
        /// The most that are sound.
        largest: usize,
    },
    /// A question about the structure that has no answer.
    #[error(transparent)]
    Structure(#[from] myovib_structure::StructureError),
    /// A measurement of a part that the system does not have.
    #[error("the system has no {part}")]
    NoSuchPart {
        /// The part.
        part: &'static str,
    },
    /// A recorder could not write.
    #[error("cannot write what was recorded")]
    Output(#[from] std::io::Error),
}

/// A point by its coordinates.
fn place(point: &[f64]) -> String {
    let coordinates: Vec<String> = point.iter().map(f64::to_string).collect();
    format!("({})", coordinates.join(", "))
}
