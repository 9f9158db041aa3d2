//! The muscle in one of its formulations as a [`Problem`].
//!
//! [`MuscleDae`] is composed here; [`evaluation`] has its residual and Jacobian, [`observation`]
//! what is read off it at a state, [`factors`] a stiffness that varies in space and time,
//! [`remembering`] internal stresses that an integrator keeps by itself.

mod evaluation;
mod factors;
mod observation;
mod remembering;

pub(crate) use remembering::{Remembering, RememberingSolver};

use std::sync::OnceLock;

#[cfg(doc)]
use myovib_dae::Problem;
use myovib_sparse::resources;
use nalgebra_sparse::pattern::SparsityPattern;

use crate::assembly::{Assembly, Entry};
use crate::counters::WorkCounters;
use crate::equation::{Added, Context, Equation, Needs, PressureRateSource};
use crate::error::ModelError;
use crate::field::{Field, Layout};
use crate::formulation::Formulation;
use crate::matrices::Matrices;
use crate::matrix::{Matrix, Term};
use crate::muscle::Muscle;
use crate::state::Workspace;

/// F(t, y, ẏ) = 0 for a [`Muscle`] in a [`Formulation`].
#[derive(Debug, Clone)]
pub struct MuscleDae {
    muscle: Muscle,
    formulation: Formulation,
    /// Each block of unknowns with the equation in its rows.
    rows: Vec<(Field, Equation)>,
    layout: Layout,
    context: Context,
    needs: Needs,
    /// Whether a law looks at fibres, for the counters.
    has_fibres: bool,
    /// The whole Jacobian, laid out once it is asked for: reductions do without. Coefficients: those of ∂F/∂y and
    /// ∂F/∂ẏ.
    assembly: OnceLock<Assembly<[f64; 2]>>,
    matrices: Matrices,
    /// Whether the matrices are those of a state, any state: all that a linear law asks for.
    has_matrices: bool,
    work: Workspace,
    counters: WorkCounters,
    /// Factors of the law's energy, one at each vertex of each element; none: one everywhere.
    factors: Option<Vec<f64>>,
    /// The tensions of elements that follow a coherence; none: they are those of oscillators at rest.
    coherent_tensions: Option<Vec<f64>>,
    /// H at the slots, for vectors that end before the internal stresses; see [`remembering`].
    overstress: Option<Vec<f64>>,
}

impl MuscleDae {
    /// Composes the DAE for a run.
    ///
    /// # Errors
    /// [`ModelError::NotAllowed`] when the formulation does not go with κ and β; those of
    /// [`Muscle::check`].
    pub fn new(muscle: Muscle, formulation: Formulation) -> Result<Self, ModelError> {
        formulation.check(&muscle.parameters)?;
        muscle.check()?;
        Ok(Self::for_analysis(muscle, formulation))
    }

    /// Composes the DAE whether or not it can be run: `rate` with β = 0 is of interest for its
    /// index alone.
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
        let needs = rows.iter().fold(Needs::default(), |needs, (_, equation)| {
            needs.or(equation.needs(&context))
        });
        let blocks = blocks(&rows, &context);
        let in_space = solid.space().dimension() == 3;
        let symmetric_parts = [
            (
                context.added.stress[1] && (in_space || context.beta == 0.0),
                Matrix::AddedSymmetricStiffness,
            ),
            (
                context.pressed && in_space,
                Matrix::PressureSymmetricStiffness,
            ),
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
            counters: WorkCounters::default(),
            factors: None,
            coherent_tensions: None,
            overstress: None,
            has_fibres: muscle.solid.laws().iter().any(|law| law.has_fibres()),
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

    /// Where each term stands in the whole Jacobian.
    fn assembly(&self) -> &Assembly<[f64; 2]> {
        self.assembly.get_or_init(|| {
            // What eliminated oscillators do is in reductions alone.
            let context = Context {
                coherence: false,
                ..self.context
            };
            let (layout, n) = (&self.layout, self.layout.n_unknowns());
            let range = |field| layout.range(field).expect("terms act on fields there are");
            let blocks = blocks(&self.rows, &context);
            let entries = blocks.iter().flat_map(|(rows, terms)| {
                terms.iter().map(|term| Entry {
                    rows: range(*rows),
                    columns: range(term.column),
                    matrix: term.matrix,
                    coefficient: [term.of_value, term.of_rate],
                })
            });
            Assembly::new((n, n), entries, |matrix| self.pattern_of(matrix))
        })
    }

    /// The DAE of another body in a formulation, in the state of this: with the factors of its law, and
    /// the tensions that follow a coherence.
    pub(crate) fn twin(&self, muscle: &Muscle, formulation: Formulation) -> Self {
        Self {
            factors: self.factors.clone(),
            coherent_tensions: self.coherent_tensions.clone(),
            ..Self::for_analysis(muscle.clone(), formulation)
        }
    }

    /// The body.
    pub fn muscle(&self) -> &Muscle {
        &self.muscle
    }

    /// The formulation.
    pub fn formulation(&self) -> Formulation {
        self.formulation
    }

    /// Each block of unknowns with the equation in its rows: those of the formulation, the models of
    /// activation, the internal stresses.
    pub fn rows(&self) -> &[(Field, Equation)] {
        &self.rows
    }

    /// The differentiation index of the system.
    pub fn index(&self) -> u8 {
        self.formulation.index(&self.muscle.parameters)
    }

    /// Where each block of unknowns lies.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The work done so far.
    pub fn counters(&self) -> &WorkCounters {
        &self.counters
    }

    /// Where a linear solver counts its work.
    pub(crate) fn counters_mut(&mut self) -> &mut WorkCounters {
        &mut self.counters
    }

    /// The body's terms of the Jacobian for each block of rows, named by the unknowns in the same
    /// place: models of activation are left out, which depend on nothing and are solved before.
    pub(crate) fn blocks(&self) -> Vec<(Field, Vec<Term>)> {
        let mut blocks = blocks(self.formulation.rows(), &self.context);
        for (_, terms) in &mut blocks {
            terms.retain(|term| term.column != Field::Tension);
        }
        blocks
    }

    /// All terms of the Jacobian, by their rows.
    pub(crate) fn terms(&self) -> Vec<(Field, Term)> {
        let blocks = blocks(&self.rows, &self.context).into_iter();
        let terms =
            blocks.flat_map(|(rows, terms)| terms.into_iter().map(move |term| (rows, term)));
        terms.collect()
    }

    /// What the coefficients of the equations depend on.
    pub(crate) fn context(&self) -> &Context {
        &self.context
    }

    /// Whether the stiffness of added stresses is not symmetric.
    pub(crate) fn has_viscous_stress(&self) -> bool {
        self.context.added.stress[1]
    }

    /// Whether damping is more than α times the mass matrix in the momentum balance without β.
    pub(crate) fn is_damped_beside_mass(&self) -> bool {
        self.context.added.is_damped() || self.context.graded || self.context.coherence
    }

    /// From now on [`blocks`](Self::blocks) have what eliminated oscillators do to stiffness and
    /// damping, and so have reductions laid out later; its values are to be filled before each set-up.
    pub(crate) fn coherence_matrices(&mut self) -> &mut [Vec<f64>; 2] {
        self.context.coherence = true;
        self.matrices.coherence_mut(&self.muscle.solid)
    }

    /// The pattern of a matrix of this formulation, and whether it is the transposed one.
    pub(crate) fn pattern_of(&self, matrix: Matrix) -> (&SparsityPattern, bool) {
        self.matrices.pattern(&self.muscle.solid, matrix)
    }

    /// The displacement of all nodes at which stress that relaxes was linearised last.
    pub(crate) fn relaxing_at(&self) -> &[f64] {
        self.matrices.relaxing_at()
    }

    /// The values of a matrix as of the last [`update_matrices`](Self::update_matrices).
    ///
    /// # Panics
    /// If the formulation has no such matrix.
    pub fn matrix_values(&self, matrix: Matrix) -> &[f64] {
        self.matrices.values(&self.muscle.solid, matrix)
    }
}

/// What the coefficients of the equations depend on.
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
        pressed: !muscle.pressures.is_empty(),
        added: Added::of(muscle),
        graded: muscle.solid.is_graded(),
        coherence: false,
    }
}

/// The Jacobian's terms for each block of rows.
fn blocks(rows: &[(Field, Equation)], context: &Context) -> Vec<(Field, Vec<Term>)> {
    rows.iter()
        .map(|(field, equation)| (*field, equation.terms(context)))
        .collect()
}
