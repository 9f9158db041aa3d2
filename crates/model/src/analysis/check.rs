//! Inspection of a scene before it is run: sizes, index, stability, modes, and cost of large
//! matrices.

use std::f64::consts::TAU;

use myovib_dae::Problem;
use myovib_sparse::{Prediction, resources};

use crate::advice::{Advice, Finding};
use crate::analysis::cost;
use crate::analysis::index::{IndexReport, LARGEST_SYSTEM};
use crate::analysis::inf_sup;
pub use crate::analysis::objections::{INCONSISTENT, readable, static_warnings, warnings};
use crate::analysis::objections::{
    endless, inconsistent, misfit, not_held, resonance, slow_modes, strange_units, too_far, unheld,
};
use crate::analysis::spectrum;
use crate::analysis::speed::Speed;
use crate::analysis::support::{extent, extents, free_parts};
use crate::analysis::table1::{Case, coarse_beam, coarse_block};
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::settings::{LinearSolverKind, Settings};
use crate::integration::typical::mass;
use crate::linear::Reduction;
use crate::muscle::Muscle;
use crate::muscle::load::Prescribed;
use crate::muscle_dae::MuscleDae;
use crate::signal::Signal;
use crate::start::{BlockResidual, residuals, residuals_with_overstress};
use crate::statics::Prospect;

/// Number of pressures above which the inf–sup constant would dominate the cost of the check.
const MAX_PRESSURES: usize = 2000;
/// Number of operations above which a matrix setup takes seconds; trial steps are then skipped.
const LARGE: f64 = 1e10;
/// Number of operations of one real factorization above which modes are not computed.
const TOO_LARGE_FOR_MODES: f64 = 2e10;

/// System from which the index was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Computed {
    /// The scene's own matrices.
    Here,
    /// The same formulation, law and parameters on a coarse beam (2D) or block (3D).
    OnCoarseMesh,
}

/// Predicted cost of the factors of the Newton matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorizationCost {
    /// Number of matrices stored at the same time: one for BDF and for an equilibrium; for Radau IIA
    /// with s stages, one real and (s − 1)/2 complex matrices.
    pub matrices: usize,
    /// Number of entries of the factors, operations per factorization, and total memory.
    pub needs: Prediction,
    /// Memory in use before the factorization, bytes, if the system reports it.
    pub in_use: Option<usize>,
}

/// Stability of the pressures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Smallest nonzero inf–sup constant.
    pub inf_sup: f64,
    /// Number of pressure modes that no displacement controls.
    pub nullity: usize,
}

/// Size of a body at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Lengths along the axes, m.
    pub extents: Vec<f64>,
    /// Volume, m³ (in 2D: area, m²).
    pub volume: f64,
    /// Mass, kg (in 2D: mass per meter of depth, kg/m).
    pub mass: f64,
    /// Number of elements.
    pub elements: usize,
    /// Number of nodes, including those between vertices.
    pub nodes: usize,
}

impl Size {
    /// Returns the size of the body of a `muscle`.
    pub fn of(muscle: &Muscle) -> Self {
        let solid = &muscle.solid;
        Self {
            extents: extents(muscle),
            volume: solid.volume(),
            mass: mass(muscle),
            elements: solid.space().n_elements(),
            nodes: solid.space().n_nodes(),
        }
    }
}

/// Findings of the inspection of a motion.
#[derive(Debug, Clone)]
pub struct Report {
    /// Blocks of unknowns with their sizes.
    pub unknowns: Vec<(Field, usize)>,
    /// Index of the system and of its blocks according to the formulation's rule, and advice on the settings.
    pub advice: Advice,
    /// Index computed numerically.
    pub computed: IndexReport,
    /// System from which the index was computed.
    pub computed_on: Computed,
    /// Stability of the pressures; `None` if there are too many to compute it in seconds.
    pub held: Option<Held>,
    /// Residual of the initial state.
    pub residuals: Vec<BlockResidual>,
    /// Lowest eigenfrequencies at rest, Hz; empty if not computed.
    pub slow_modes: Vec<f64>,
    /// Highest eigenfrequency, Hz; NaN if not computed.
    pub fastest_mode: f64,
    /// Whether the body is too large to compute modes.
    pub too_large_for_modes: bool,
    /// Highest frequency of the loads and prescribed motions, Hz, if any of them is periodic.
    pub drive: Option<f64>,
    /// Lowest and highest frequency of each frequency sweep, Hz.
    pub sweeps: Vec<[f64; 2]>,
    /// Predicted cost of the factors; `None` if the full matrix or an external solver is used.
    pub factors: Option<FactorizationCost>,
    /// Predicted CPU time of a step, s, if the matrices are too large for trial steps.
    pub step_time: Option<f64>,
    /// Likely problems with suggested changes.
    pub findings: Vec<Finding>,
}

/// Inspects a run of a muscle that starts at t = 0. `start` contains y and ẏ; if it is `None`, the muscle starts at
/// rest.
///
/// # Errors
/// Returns [`ModelError::NotAllowed`] if the formulation cannot be run, and the errors of the individual analyses.
pub fn check(
    muscle: &Muscle,
    formulation: Formulation,
    settings: &Settings,
    start: Option<[Vec<f64>; 2]>,
) -> Result<Report, ModelError> {
    let mut dae = MuscleDae::new(muscle.clone(), formulation)?;
    let sizes = Sizes::new(muscle, formulation, settings)?;
    let factors = sizes.factors(settings)?;
    let advice = Advice::new(muscle, formulation, settings);
    let [y, y_dot] = start.unwrap_or_else(|| [(); 2].map(|()| vec![0.0; dae.n_unknowns()]));
    let (residuals, (computed, computed_on)) = of_equations(&mut dae, [&y, &y_dot])?;
    let held = held(muscle)?;
    let nullity = held.map_or(0, |held| held.nullity);
    let too_large_for_modes = sizes.real.is_some_and(|real| real.flops > TOO_LARGE_FOR_MODES);
    let (slow_modes, fastest_mode) = match nullity == 0 && !too_large_for_modes {
        true => (slow_modes(muscle)?, spectrum::fastest(muscle)? / TAU),
        false => (Vec::new(), f64::NAN),
    };
    let drive = muscle.forcing_frequency();
    let mut findings = advice.findings();
    findings.extend(free_parts(muscle).map(not_held));
    findings.extend(unheld(held.map(|held| held.nullity), muscle));
    findings.extend(inconsistent(&residuals));
    findings.extend(resonance(&slow_modes, drive));
    findings.extend(match too_large_for_modes {
        true => strange_units(muscle, settings.t_end),
        false => misfit(muscle, &slow_modes, settings.t_end),
    });
    let blocks = dae.layout().blocks().iter();
    let unknowns = blocks.map(|(f, r)| (*f, r.len())).collect();
    findings.extend(endless(drive, settings.t_end));
    let large = sizes.all.filter(|all| all.flops > LARGE);
    let step_time = large.map(|needs| cost::step(&mut dae, settings, needs, [&y, &y_dot]));
    Ok(Report {
        unknowns,
        factors,
        step_time: step_time.transpose()?,
        held,
        advice,
        computed,
        computed_on,
        residuals,
        slow_modes,
        fastest_mode,
        too_large_for_modes,
        drive,
        sweeps: muscle.sweeps(settings.t_end),
        findings,
    })
}

/// Computes the residual of the initial state and the index.
fn of_equations(
    dae: &mut MuscleDae,
    [y, y_dot]: [&[f64]; 2],
) -> Result<(Vec<BlockResidual>, (IndexReport, Computed)), ModelError> {
    let (muscle, formulation) = (dae.muscle(), dae.formulation());
    if muscle.solid.n_internal() == 0 {
        let index = index(muscle, formulation)?;
        return Ok((residuals(dae, 0.0, y, y_dot)?, index));
    }
    // Prony terms do not change the index.
    let relaxed = muscle.relaxed();
    let index = index(&relaxed, formulation)?;
    let mut relaxed = MuscleDae::new(relaxed, formulation)?;
    Ok((residuals_with_overstress(dae, &mut relaxed, 0.0, [y, y_dot])?, index))
}

/// Findings of the inspection of a static analysis.
#[derive(Debug, Clone)]
pub struct StaticReport {
    /// Blocks of unknowns with their sizes.
    pub unknowns: Vec<(Field, usize)>,
    /// Stability of the pressures; `None` without pressures, or if there are too many to compute it
    /// in seconds.
    pub held: Option<Held>,
    /// Predicted cost of the factors of the iteration matrix, if known.
    pub factors: Option<FactorizationCost>,
    /// Largest displacement under the whole load by linear elasticity, m; `None` if the body is too large or has
    /// contacts, or if its stiffness matrix is singular.
    pub linear_displacement: Option<f64>,
    /// CPU time of one Newton iteration, s: measured, or predicted if the body is too large; `None` if the matrix is
    /// singular.
    pub iteration_time: Option<f64>,
    /// Likely problems with suggested changes.
    pub findings: Vec<Finding>,
}

/// Inspects the equilibrium of a muscle under its loads at time `t`.
pub fn check_static(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
) -> Result<StaticReport, ModelError> {
    let mut prospect = Prospect::new(muscle, formulation, t)?;
    let blocks = prospect.layout().blocks().iter();
    let unknowns = blocks.map(|(f, range)| (*f, range.len())).collect();
    let factors = prospect.needs().map(|needs| FactorizationCost {
        matrices: 1,
        needs,
        in_use: prospect.in_use(),
    });
    let held = match formulation.has(Field::Pressure) {
        true => held(muscle)?,
        false => None,
    };
    let free = free_parts(muscle);
    let is_free = free.is_some();
    let mut findings: Vec<Finding> = free.map(not_held).into_iter().collect();
    if formulation.has(Field::Pressure) {
        findings.extend(unheld(held.map(|held| held.nullity), muscle));
    }
    let large = factors.filter(|factors| factors.needs.flops > LARGE);
    let (linear_displacement, iteration_time) = match large {
        // A free body has no equilibrium.
        _ if is_free => (None, None),
        Some(factors) => {
            let factorizing = factors.needs.flops / Speed::measure(false)?.operations;
            (None, Some(prospect.evaluation()? + factorizing))
        }
        // If the matrix is singular for other reasons, the run reports it.
        None => match prospect.linear_response() {
            // The derivative at rest does not include contacts that begin later.
            Ok(response) => {
                let displacement = Some(response.displacement);
                (displacement.filter(|_| muscle.contacts.is_empty()), Some(response.seconds))
            }
            Err(_) => (None, None),
        },
    };
    findings.extend(linear_displacement.and_then(|u| too_far(u, extent(muscle))));
    Ok(StaticReport { unknowns, held, factors, linear_displacement, iteration_time, findings })
}

/// Findings of the inspection of a motion without inertia.
#[derive(Debug, Clone)]
pub struct QuasiStaticReport {
    /// Blocks of unknowns with their sizes and indices.
    pub unknowns: Vec<(Field, usize, u8)>,
    /// Stability of the pressures; `None` without pressures, or if there are too many to compute it
    /// in seconds.
    pub held: Option<Held>,
    /// Predicted cost of the factors; `None` if the full matrix or an external solver is used.
    pub factors: Option<FactorizationCost>,
    /// Likely problems with suggested changes.
    pub findings: Vec<Finding>,
}

/// Inspects the motion of a muscle without inertia.
///
/// # Errors
/// Returns [`ModelError::NotAllowed`] if the formulation cannot be run, and the errors of the individual analyses.
pub fn check_quasi_static(
    muscle: &Muscle,
    formulation: Formulation,
    settings: &Settings,
) -> Result<QuasiStaticReport, ModelError> {
    let dae = MuscleDae::new(muscle.clone(), formulation)?;
    let factors = Sizes::new(muscle, formulation, settings)?.factors(settings)?;
    let blocks = dae.layout().blocks().iter();
    let unknowns = blocks.map(|(field, range)| {
        let index = muscle.variable_index(formulation, *field);
        (*field, range.len(), index)
    });
    let mut findings: Vec<Finding> = free_parts(muscle).map(not_held).into_iter().collect();
    let held = match formulation.has(Field::Pressure) {
        true => held(muscle)?,
        false => None,
    };
    if formulation.has(Field::Pressure) {
        findings.extend(unheld(held.map(|held| held.nullity), muscle));
    }
    Ok(QuasiStaticReport { unknowns: unknowns.collect(), held, factors, findings })
}

/// Cost of condensed matrices, predicted from their pattern; unknown for an external solver.
struct Sizes {
    /// Number of complex matrices.
    n_complex: usize,
    /// The real matrix.
    real: Option<Prediction>,
    /// All matrices together.
    all: Option<Prediction>,
    /// Memory in use after the matrices are laid out, bytes, if the system reports it.
    in_use: Option<usize>,
}

impl Sizes {
    fn new(
        muscle: &Muscle,
        formulation: Formulation,
        settings: &Settings,
    ) -> Result<Self, ModelError> {
        // Allocated memory that was never written to is not counted as in use.
        let dae = &mut undeformed(muscle, formulation)?;
        let at_rest = vec![0.0; dae.n_unknowns()];
        dae.update_matrices(0.0, &at_rest, &at_rest)?;
        // Radau IIA with s stages has (s − 1)/2 conjugate pairs of eigenvalues and one real eigenvalue.
        let n_complex = settings.integrator.stages().unwrap_or(1) / 2;
        let reduction = Reduction::new(dae, settings.sparse_options())?;
        Ok(Self {
            n_complex,
            real: reduction.prediction::<f64>(),
            all: reduction.needs(n_complex),
            in_use: resources::in_use(),
        })
    }

    /// Returns the predicted cost if the run factorizes these matrices.
    fn factors(&self, settings: &Settings) -> Result<Option<FactorizationCost>, ModelError> {
        let condensed = settings.linear_solver == LinearSolverKind::Condensed;
        let Some(needs) = self.all.filter(|_| condensed) else {
            return Ok(None);
        };
        resources::expect_memory(needs.bytes, self.n_complex)?;
        Ok(Some(FactorizationCost { matrices: 1 + self.n_complex, needs, in_use: self.in_use }))
    }
}

/// Returns the system of a body whose supports stay in place, so that the body is undeformed at zero displacements.
fn undeformed(muscle: &Muscle, formulation: Formulation) -> Result<MuscleDae, ModelError> {
    let mut muscle = muscle.clone();
    for Prescribed { signal, .. } in &mut muscle.prescribed {
        *signal = Signal::constant(0.0);
    }
    MuscleDae::new(muscle, formulation)
}

/// Computes the inf–sup constant unless the mesh is too fine.
fn held(muscle: &Muscle) -> Result<Option<Held>, ModelError> {
    if muscle.solid.space().n_pressures() > MAX_PRESSURES {
        return Ok(None);
    }
    let found = inf_sup::constants(&muscle.solid)?;
    Ok(Some(Held { inf_sup: found.smallest().unwrap_or(0.0), nullity: found.nullity() }))
}

/// Computes the index of the scene itself if it is small enough; otherwise, computes the index on a coarse mesh. The
/// index does not depend on the mesh as long as B has full rank.
fn index(muscle: &Muscle, formulation: Formulation) -> Result<(IndexReport, Computed), ModelError> {
    let mut dae = undeformed(muscle, formulation)?;
    if dae.n_unknowns() <= LARGEST_SYSTEM {
        let rest = vec![0.0; dae.n_unknowns()];
        return Ok((IndexReport::at(&mut dae, 0.0, &rest, &rest)?, Computed::Here));
    }
    let case = Case {
        equation: None,
        law: muscle.solid.laws()[0],
        formulation,
        kappa: muscle.parameters.kappa(),
        beta: muscle.parameters.beta,
        printed: None,
    };
    let mesh = match muscle.solid.space().dimension() {
        2 => coarse_beam(3)?,
        _ => coarse_block()?,
    };
    Ok((case.at_random_state(&mesh, 1)?, Computed::OnCoarseMesh))
}
