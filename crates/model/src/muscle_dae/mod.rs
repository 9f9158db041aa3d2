//! A muscle in one of its formulations as a [`Problem`].
//!
//! This module defines [`MuscleDae`]. [`evaluation`] contains its residual and Jacobian, and [`observation`] the
//! quantities derived from a state. [`factors`] supports stiffness and tension that vary in space and time.
//! [`internal_variables`] supports internal stresses stored by the integrator.

mod evaluation;
mod factors;
mod internal_variables;
mod observation;
mod problem;

pub(crate) use internal_variables::InternalVariableDae;

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

#[cfg(doc)]
use myovib_dae::Problem;
use myovib_fem::DrivenSlope;
use myovib_sparse::{Elimination, SparseError, SparseOptions, resources};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::assembly::{Assembly, Entry};
use crate::counters::WorkCounters;
use crate::equation::{Added, Context, Equation, Needs, PressureRateSource};
use crate::error::ModelError;
use crate::field::{Field, Layout};
use crate::formulation::Formulation;
use crate::linear::Reduction;
use crate::matrices::Matrices;
use crate::matrix::{Matrix, Term};
use crate::muscle::Muscle;
use crate::operators::mass;
use crate::start::saddle::Saddle;
use crate::state::Workspace;

/// The equations F(t, y, ẏ) = 0 of a [`Muscle`] in a [`Formulation`].
#[derive(Debug, Clone)]
pub struct MuscleDae {
    muscle: Muscle,
    formulation: Formulation,
    /// Each block of unknowns and the equation in its rows.
    rows: Vec<(Field, Equation)>,
    layout: Layout,
    context: Context,
    needs: Needs,
    /// Whether a law uses fiber directions; required for the counters.
    has_fibers: bool,
    /// The structure of the full Jacobian, created at first use because condensed solvers do not need it. Each term has
    /// coefficients for ∂F/∂y and ∂F/∂ẏ.
    assembly: OnceLock<Assembly<[f64; 2]>>,
    matrices: Matrices,
    /// Derivatives of the contact forces of obstacles driven by a force, from the last update of the matrices.
    driven_slopes: Vec<DrivenSlope>,
    /// Whether the matrices have been evaluated. For a linear law, one evaluation at any state is sufficient.
    has_matrices: bool,
    work: Workspace,
    counters: WorkCounters,
    /// Factors of the law's energy, one per vertex of each element; `None` if all factors are one.
    factors: Option<Vec<f64>>,
    /// Tensions that depend on the coherence of oscillators, one per element; `None` if the oscillators are at rest.
    coherent_tensions: Option<Vec<f64>>,
    /// Overstress H at the quadrature points, used with vectors that do not contain the internal stresses; see
    /// [`internal_variables`].
    overstress: Option<Vec<f64>>,
    /// Reduction of the Newton matrices and its options, created at the first use by any clone.
    reduction: Shared<(SparseOptions, Reduction)>,
    /// Analysis of the mass matrix, created at the first use by any clone.
    mass_analysis: Shared<Arc<Elimination>>,
}

/// A result that depends only on the equations and the mesh, shared by all clones.
type Shared<T> = Arc<Mutex<Option<T>>>;

fn lock<T>(shared: &Shared<T>) -> MutexGuard<'_, Option<T>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl MuscleDae {
    /// Creates the DAE for a run.
    ///
    /// # Errors
    /// [`ModelError::NotAllowed`] if the formulation is incompatible with κ and β; errors of [`Muscle::check`].
    pub fn new(muscle: Muscle, formulation: Formulation) -> Result<Self, ModelError> {
        formulation.check(&muscle.parameters)?;
        muscle.check()?;
        Ok(Self::for_analysis(muscle, formulation))
    }

    /// Creates the DAE even if it cannot be integrated, for example to compute the index of `rate` with β = 0.
    pub fn for_analysis(mut muscle: Muscle, formulation: Formulation) -> Self {
        muscle.solid = muscle.solid.in_threads(resources::threads());
        let solid = &muscle.solid;
        let mut rows = formulation.rows().to_vec();
        let n_tensions = muscle.models().count();
        if n_tensions > 0 {
            rows.push((Field::Tension, Equation::Activation));
        }
        if solid.n_internal() > 0 {
            rows.push((Field::InternalStress, Equation::Relaxation));
        }
        let layout = Layout::new(rows.iter().map(|(field, _)| *field), |field| match field {
            Field::Displacement | Field::Velocity => solid.dofs().n_free(),
            Field::Tension => n_tensions,
            Field::InternalStress => solid.n_internal(),
            _ => solid.space().n_pressures(),
        });
        let context = context(&muscle, formulation);
        let needs = rows
            .iter()
            .fold(Needs::default(), |needs, (_, equation)| needs.or(equation.needs(&context)));
        let blocks = blocks(&rows, &context);
        let in_space = solid.space().dimension() == 3;
        let symmetric_parts = [
            (
                context.added.stress[1] && (in_space || context.beta == 0.0),
                Matrix::AddedSymmetricStiffness,
            ),
            (context.pressed && in_space, Matrix::PressureSymmetricStiffness),
        ];
        let symmetric_parts = symmetric_parts.iter().filter(|(used, _)| *used);
        let matrices = Matrices::new(
            &muscle,
            blocks
                .iter()
                .flat_map(|(_, terms)| terms)
                .map(|term| term.matrix)
                .chain(symmetric_parts.map(|(_, matrix)| *matrix)),
        );
        Self {
            work: Workspace::new(&muscle),
            has_matrices: false,
            driven_slopes: Vec::new(),
            counters: WorkCounters::default(),
            factors: None,
            coherent_tensions: None,
            overstress: None,
            reduction: Shared::default(),
            mass_analysis: Shared::default(),
            has_fibers: muscle.solid.laws().iter().any(|law| law.has_fibers()),
            muscle,
            formulation,
            rows,
            layout,
            context,
            needs,
            assembly: OnceLock::new(),
            matrices,
        }
    }

    /// Returns the positions of all terms in the full Jacobian.
    fn assembly(&self) -> &Assembly<[f64; 2]> {
        self.assembly.get_or_init(|| {
            // Only condensed matrices contain the effect of eliminated oscillators.
            let context = Context { coherence: false, ..self.context };
            let (layout, n) = (&self.layout, self.layout.n_unknowns());
            let range = |field| layout.range(field).expect("terms act on existing fields");
            let blocks = blocks(&self.rows, &context);
            let entries = blocks.iter().flat_map(|(rows, terms)| {
                terms.iter().map(|term| Entry {
                    rows: range(*rows),
                    columns: range(term.column),
                    matrix: term.matrix,
                    coefficient: [term.df_dy, term.df_dyp],
                })
            });
            Assembly::new((n, n), entries, |matrix| self.pattern_of(matrix))
        })
    }

    /// Creates the DAE of a body with the same mesh in another formulation. The energy factors and the
    /// coherence-dependent tensions are copied.
    pub(crate) fn with_body(&self, muscle: &Muscle, formulation: Formulation) -> Self {
        Self {
            factors: self.factors.clone(),
            coherent_tensions: self.coherent_tensions.clone(),
            mass_analysis: self.mass_analysis.clone(),
            ..Self::for_analysis(muscle.clone(), formulation)
        }
    }

    /// Returns the reduction of the Newton matrices, which is set up once for all clones with the same options.
    pub(crate) fn reduction(&self, options: SparseOptions) -> Result<Reduction, SparseError> {
        let mut shared = lock(&self.reduction);
        if let Some((_, known)) = shared.as_ref().filter(|(own, _)| *own == options) {
            return Ok(known.clone());
        }
        let reduction = Reduction::new(self, options)?;
        *shared = Some((options, reduction.clone()));
        Ok(reduction)
    }

    /// Solves M x = `right` for the mass matrix M, which is analyzed once for all clones.
    pub(crate) fn solve_mass(&self, right: &[f64]) -> Result<Vec<f64>, ModelError> {
        let mass = mass(&self.muscle.solid);
        let mut factors = Saddle::alone(&mass, &mut lock(&self.mass_analysis))?;
        let (x, _) = factors.solve(right, &[])?;
        Ok(x)
    }

    /// Returns the body.
    pub fn muscle(&self) -> &Muscle {
        &self.muscle
    }

    /// Returns the formulation.
    pub fn formulation(&self) -> Formulation {
        self.formulation
    }

    /// Returns each block of unknowns with the equation in its rows. The blocks of the formulation come first, followed
    /// by those of activation models and internal stresses.
    pub fn rows(&self) -> &[(Field, Equation)] {
        &self.rows
    }

    /// Returns the differentiation index of the system.
    pub fn index(&self) -> u8 {
        self.muscle.index(self.formulation)
    }

    /// Returns the layout of the blocks of unknowns.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the work counters.
    pub fn counters(&self) -> &WorkCounters {
        &self.counters
    }

    /// Sets the work counters, for example to the final counters of the resumed run.
    pub fn set_counters(&mut self, counters: WorkCounters) {
        self.counters = counters;
    }

    /// Returns the counters so that a linear solver can update them.
    pub(crate) fn counters_mut(&mut self) -> &mut WorkCounters {
        &mut self.counters
    }

    /// Returns the terms of the body's Jacobian for each block of rows. The blocks are labeled by the unknowns in the
    /// same position. Activation models are excluded, because they do not depend on other unknowns and are solved
    /// first.
    pub(crate) fn blocks(&self) -> Vec<(Field, Vec<Term>)> {
        let mut blocks = blocks(self.formulation.rows(), &self.context);
        for (_, terms) in &mut blocks {
            terms.retain(|term| term.column != Field::Tension);
        }
        blocks
    }

    /// Returns all terms of the Jacobian, each with its block of rows.
    pub(crate) fn terms(&self) -> Vec<(Field, Term)> {
        let blocks = blocks(&self.rows, &self.context).into_iter();
        let terms =
            blocks.flat_map(|(rows, terms)| terms.into_iter().map(move |term| (rows, term)));
        terms.collect()
    }

    /// Returns the properties on which the coefficients of the equations depend.
    pub(crate) fn context(&self) -> &Context {
        &self.context
    }

    /// Returns whether the stiffness of added stresses is unsymmetric.
    pub(crate) fn has_viscous_stress(&self) -> bool {
        self.context.added.stress[1]
    }

    /// Returns whether the body may have damping other than Rayleigh damping with uniform α and β. This is always the
    /// case if κ, α or β varies between elements.
    pub(crate) fn has_damping_besides_mass(&self) -> bool {
        let added = self.context.added;
        added.is_damped() || added.friction || self.context.graded || self.context.coherence
    }

    /// Includes the effect of eliminated oscillators on stiffness and damping in [`blocks`](Self::blocks) and in
    /// later condensed matrices. Returns the values of these terms, which must be filled before each
    /// matrix setup.
    pub(crate) fn coherence_matrices(&mut self) -> &mut [Vec<f64>; 2] {
        self.context.coherence = true;
        self.reduction = Shared::default();
        self.matrices.coherence_mut(&self.muscle.solid)
    }

    /// Returns the sparsity pattern of a matrix of this formulation, and whether the matrix has the transpose of this
    /// pattern.
    pub(crate) fn pattern_of(&self, matrix: Matrix) -> (&SparsityPattern, bool) {
        self.matrices.pattern(&self.muscle.solid, matrix)
    }

    /// Returns the nodal displacements at which the viscoelastic stress was last linearized.
    pub(crate) fn relaxing_at(&self) -> &[f64] {
        self.matrices.relaxing_at()
    }

    /// Returns the derivatives of the contact forces of obstacles driven by a force.
    pub(crate) fn driven_slopes(&self) -> &[DrivenSlope] {
        &self.driven_slopes
    }

    /// Returns the values of a matrix from the last [`update_matrices`](Self::update_matrices).
    ///
    /// # Panics
    /// Panics if the formulation has no such matrix.
    pub fn matrix_values(&self, matrix: Matrix) -> &[f64] {
        self.matrices.values(&self.muscle.solid, matrix)
    }
}

/// Collects the properties on which the coefficients of the equations depend.
fn context(muscle: &Muscle, formulation: Formulation) -> Context {
    Context {
        alpha: muscle.parameters.alpha,
        beta: muscle.parameters.beta,
        inv_kappa: muscle.parameters.inv_kappa,
        has_pressure: formulation.has(Field::Pressure),
        pressure_rate: if formulation.has(Field::PressureRate) {
            PressureRateSource::Unknown
        } else if formulation.has(Field::Pressure) {
            PressureRateSource::Derivative
        } else {
            PressureRateSource::None
        },
        pressed: muscle.has_boundary_forces(),
        added: Added::of(muscle),
        graded: muscle.solid.has_element_scales(),
        coherence: false,
    }
}

/// Returns the terms of the Jacobian for each block of rows.
fn blocks(rows: &[(Field, Equation)], context: &Context) -> Vec<(Field, Vec<Term>)> {
    rows.iter().map(|(field, equation)| (*field, equation.terms(context))).collect()
}
