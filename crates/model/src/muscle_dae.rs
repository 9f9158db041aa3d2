//! The muscle in one of its formulations as a [`DaeProblem`].

use myovib_fem::{Fields, Inverted, Pressure, Tangents, Vectors};
use nalgebra_sparse::pattern::SparsityPattern;
use sundials_wrap::{DaeProblem, StepError, VariableKind};

use crate::assembly::{Assembly, Entry};
use crate::counters::WorkCounters;
use crate::displacement::Displacement;
use crate::equation::{Context, Needs, PressureRateSource};
use crate::error::ModelError;
use crate::field::{Field, Layout};
use crate::formulation::Formulation;
use crate::matrices::Matrices;
use crate::matrix::{Matrix, Term};
use crate::measure::Snapshot;
use crate::muscle::Muscle;
use crate::probe::Probe;
use crate::state::{Integrals, State, Workspace};

/// F(t, y, ẏ) = 0 for a [`Muscle`] in a [`Formulation`].
#[derive(Debug, Clone)]
pub struct MuscleDae {
    muscle: Muscle,
    formulation: Formulation,
    layout: Layout,
    context: Context,
    needs: Needs,
    /// Coefficients: those of ∂F/∂y and ∂F/∂ẏ.
    assembly: Assembly<[f64; 2]>,
    matrices: Matrices,
    work: Workspace,
    counters: WorkCounters,
    /// Factors of the law's energy, three per element; none: one everywhere.
    factors: Option<Vec<[f64; 3]>>,
}

impl MuscleDae {
    /// Composes the DAE for a run.
    ///
    /// # Errors
    /// [`ModelError::NotAllowed`] when the formulation does not go with κ and β.
    pub fn new(muscle: Muscle, formulation: Formulation) -> Result<Self, ModelError> {
        formulation.check(&muscle.parameters)?;
        Ok(Self::for_analysis(muscle, formulation))
    }

    /// Composes the DAE whether or not it can be run: `rate` with β = 0 is of interest for its
    /// index alone.
    pub fn for_analysis(muscle: Muscle, formulation: Formulation) -> Self {
        let solid = &muscle.solid;
        let layout = Layout::new(
            formulation.rows().iter().map(|(field, _)| *field),
            solid.dofs().n_free(),
            solid.space().n_vertices(),
        );
        let context = Context {
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
        };
        let needs = formulation
            .rows()
            .iter()
            .fold(Needs::default(), |needs, (_, equation)| {
                needs.or(equation.needs(&context))
            });
        let blocks = blocks(formulation, &context);
        let matrices = Matrices::new(
            solid,
            blocks
                .iter()
                .flat_map(|(_, terms)| terms)
                .map(|term| term.matrix),
        );
        let range = |field| layout.range(field).expect("terms act on fields there are");
        let entries = blocks.iter().flat_map(|(rows, terms)| {
            terms.iter().map(|term| Entry {
                rows: range(*rows),
                columns: range(term.column),
                matrix: term.matrix,
                coefficient: [term.of_value, term.of_rate],
            })
        });
        let n = layout.n_unknowns();
        let assembly = Assembly::new((n, n), entries, |matrix| matrices.pattern(solid, matrix));
        Self {
            work: Workspace::new(solid),
            counters: WorkCounters::default(),
            factors: None,
            muscle,
            formulation,
            layout,
            context,
            needs,
            assembly,
            matrices,
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

    /// The differentiation index of the system (MODEL §2).
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

    /// Multiplies the law's energy from now on: factors at the corners of each element.
    ///
    /// # Panics
    /// At the next evaluation, if there are not three for each element.
    pub fn set_factors(&mut self, factors: &[[f64; 3]]) {
        let own = self.factors.get_or_insert_default();
        own.clear();
        own.extend_from_slice(factors);
    }

    /// Adds ∫ w (P + β Ṗ) : ∇φ to the rows of the momentum balance: P without the
    /// pressure's part, w given by its values at the corners of each element. This is ∂F/∂g for
    /// factors 1 + g w.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] for an element with det F ≤ 0.
    pub fn add_factor_response(
        &mut self,
        t: f64,
        y: &[f64],
        weights: &[[f64; 3]],
        rows: &mut [f64],
    ) -> Result<(), StepError> {
        self.expand(t, y, None);
        let Self {
            work,
            muscle: Muscle { solid, .. },
            context,
            layout,
            counters,
            ..
        } = self;
        let no_pressure = vec![0.0; solid.space().n_vertices()];
        let fields = Fields {
            v: Some(&work.velocity),
            factors: Some(weights),
            ..Fields::new(&work.displacement, Pressure::Nodal(&no_pressure))
        };
        let damped = context.beta > 0.0;
        let mut vectors = Vectors {
            force: Some(&mut work.force),
            force_rate: damped.then_some(&mut work.force_rate),
            ..Vectors::default()
        };
        counters.passed(t, solid.evaluate(&fields, &mut vectors))?;
        let momentum = layout
            .range(Field::Velocity)
            .expect("the momentum balance stands in the rows of v");
        for (row, &i) in rows[momentum].iter_mut().zip(solid.dofs().free_to_full()) {
            *row += work.force[i];
            if damped {
                *row += context.beta * work.force_rate[i];
            }
        }
        Ok(())
    }

    /// Where a linear solver counts its work.
    pub(crate) fn counters_mut(&mut self) -> &mut WorkCounters {
        &mut self.counters
    }

    /// The Jacobian's terms for each block of rows, named by the unknowns in the same place.
    pub(crate) fn blocks(&self) -> Vec<(Field, Vec<Term>)> {
        blocks(self.formulation, &self.context)
    }

    /// The pattern of a matrix of this formulation, and whether it is the transposed one.
    pub(crate) fn pattern_of(&self, matrix: Matrix) -> (&SparsityPattern, bool) {
        self.matrices.pattern(&self.muscle.solid, matrix)
    }

    /// The values of a matrix as of the last [`update_matrices`](Self::update_matrices).
    ///
    /// # Panics
    /// If the formulation has no such matrix.
    pub fn matrix_values(&self, matrix: Matrix) -> &[f64] {
        self.matrices.values(&self.muscle.solid, matrix)
    }

    /// Displacement and velocity at all nodes at time `t`, prescribed components included.
    pub fn nodal_motion(&mut self, t: f64, y: &[f64]) -> (&[f64], &[f64]) {
        self.expand(t, y, None);
        (&self.work.displacement, &self.work.velocity)
    }

    /// The body at time `t`, for measurements.
    pub fn snapshot<'a>(&'a mut self, t: f64, y: &'a [f64]) -> Snapshot<'a> {
        self.expand(t, y, None);
        let pressure = match self.layout.range(Field::Pressure) {
            Some(range) => Pressure::Nodal(&y[range]),
            None => Pressure::Penalty {
                kappa: self.muscle.parameters.kappa(),
            },
        };
        Snapshot {
            solid: &self.muscle.solid,
            displacement: &self.work.displacement,
            velocity: &self.work.velocity,
            pressure,
            factors: self.factors.as_deref(),
        }
    }

    /// Inertia, stress and damping less the loads at all nodal components: zero where the body
    /// moves freely, the force of the support on the body (N/m) where it is held or moved.
    ///
    /// # Errors
    /// Those of the residual.
    pub fn unbalanced_force(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let mut rows = vec![0.0; self.n_unknowns()];
        self.residual(t, y, y_dot, &mut rows)?;
        let Workspace {
            inertia,
            force,
            force_rate,
            load,
            ..
        } = &self.work;
        let beta = self.context.beta;
        let balance = |i: usize| inertia[i] + force[i] - load[i];
        Ok(if self.needs.force_rate {
            (0..force.len())
                .map(|i| balance(i) + beta * force_rate[i])
                .collect()
        } else {
            (0..force.len()).map(balance).collect()
        })
    }

    /// Loads and ∫Ṗ:∇φ (zero without damping) at all nodal components, as the last residual left
    /// them.
    pub(crate) fn nodal_forces(&self) -> (&[f64], &[f64]) {
        (&self.work.load, &self.work.force_rate)
    }

    /// The pressure coefficients within `y`, if the formulation has a pressure.
    pub fn pressure<'y>(&self, y: &'y [f64]) -> Option<&'y [f64]> {
        self.layout.range(Field::Pressure).map(|range| &y[range])
    }

    /// The displacement at a probe in the direction `axis` (0: x, 1: y), prescribed components
    /// included.
    pub fn displacement_at(&self, probe: &Probe, axis: usize) -> Displacement {
        let start = self
            .layout
            .range(Field::Displacement)
            .expect("all formulations have q")
            .start;
        let free = self.muscle.solid.dofs().free_to_full();
        let mut displacement = Displacement::default();
        for &(node, weight) in probe.node_weights() {
            let component = 2 * node + axis;
            if let Ok(k) = free.binary_search(&component) {
                displacement.unknowns.push((start + k, weight));
            }
            let at_node = self.muscle.prescribed.iter();
            displacement.prescribed.extend(
                at_node
                    .filter(|prescribed| prescribed.component == component)
                    .map(|prescribed| (prescribed.signal.clone(), weight)),
            );
        }
        displacement
    }

    /// Constraint drift: the maximum over the P1 functions ψ_k of |∫ψ_k (p/κ + J - 1)| / ∫ψ_k
    /// (MODEL §2); 0 for a formulation without pressure.
    ///
    /// # Errors
    /// [`Inverted`] for an element with det F ≤ 0.
    pub fn constraint_drift(&mut self, t: f64, y: &[f64]) -> Result<f64, Inverted> {
        let Some(range) = self.layout.range(Field::Pressure) else {
            return Ok(0.0);
        };
        self.expand(t, y, None);
        let solid = &self.muscle.solid;
        let work = &mut self.work;
        let fields = Fields::new(&work.displacement, Pressure::Nodal(&y[range.clone()]));
        solid.evaluate(
            &fields,
            &mut Vectors {
                defect: Some(&mut work.defect),
                ..Vectors::default()
            },
        )?;
        solid.apply_pressure_mass(&y[range], &mut work.pressure_product);
        let inv_kappa = self.context.inv_kappa;
        Ok(work
            .defect
            .iter()
            .zip(&work.pressure_product)
            .zip(solid.pressure_weights())
            .map(|((defect, m_p), weight)| ((defect + inv_kappa * m_p) / weight).abs())
            .fold(0.0, f64::max))
    }

    /// Fills the nodal arrays from the unknowns; constrained components follow their signals.
    fn expand(&mut self, t: f64, y: &[f64], y_dot: Option<&[f64]>) {
        let dofs = self.muscle.solid.dofs();
        let range = |field| {
            self.layout
                .range(field)
                .expect("all formulations have q and v")
        };
        let work = &mut self.work;
        dofs.expand(&y[range(Field::Displacement)], &mut work.displacement);
        dofs.expand(&y[range(Field::Velocity)], &mut work.velocity);
        if let Some(y_dot) = y_dot {
            work.acceleration.fill(0.0);
            dofs.expand(&y_dot[range(Field::Velocity)], &mut work.acceleration);
        }
        for prescribed in &self.muscle.prescribed {
            let motion = prescribed.signal.at(t);
            work.displacement[prescribed.component] = motion.value;
            work.velocity[prescribed.component] = motion.d1;
            work.acceleration[prescribed.component] = motion.d2;
        }
    }

    /// The rate of the pressure, from wherever the formulation has it.
    fn pressure_rate<'s>(context: &Context, state: &State<'s>) -> Option<&'s [f64]> {
        match context.pressure_rate {
            PressureRateSource::None => None,
            PressureRateSource::Unknown => Some(state.value(Field::PressureRate)),
            PressureRateSource::Derivative => Some(state.rate(Field::Pressure)),
        }
    }

    fn fields<'s>(
        layout: &Layout,
        context: &Context,
        state: &State<'s>,
        [displacement, velocity]: [&'s [f64]; 2],
        factors: Option<&'s [[f64; 3]]>,
    ) -> Fields<'s> {
        let has = |field| layout.range(field).is_some();
        Fields {
            u: displacement,
            pressure: if has(Field::Pressure) {
                Pressure::Nodal(state.value(Field::Pressure))
            } else {
                Pressure::Penalty {
                    kappa: 1.0 / context.inv_kappa,
                }
            },
            v: Some(velocity),
            p_rate: Self::pressure_rate(context, state),
            mu: has(Field::GglMultiplier).then(|| state.value(Field::GglMultiplier)),
            factors,
        }
    }

    /// Evaluates the state-dependent matrices; for a linear law only the first time.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] for an element with det F ≤ 0.
    pub fn update_matrices(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<(), StepError> {
        let Muscle {
            solid, pressures, ..
        } = &self.muscle;
        self.matrices.update_pressures(pressures, t, 1.0);
        let constant = solid.is_linear() && self.factors.is_none();
        if constant && self.counters.tangent_passes > 0 {
            return Ok(());
        }
        self.expand(t, y, None);
        let state = State::new(&self.layout, y, y_dot);
        let work = &self.work;
        let fields = Self::fields(
            &self.layout,
            &self.context,
            &state,
            [&work.displacement, &work.velocity],
            self.factors.as_deref(),
        );
        let mut tangents: Tangents<'_> = self.matrices.wanted();
        self.counters.tangent_passes += 1;
        self.counters.rate_tangent_passes += u64::from(tangents.rate_stiffness.is_some());
        let pass = self.muscle.solid.tangents(&fields, &mut tangents);
        self.counters.passed(t, pass)
    }

    /// a ∂F/∂y + b ∂F/∂ẏ from the matrices of the last update.
    fn sum_matrices(&mut self, [a, b]: [f64; 2], values: &mut [f64]) {
        self.counters.matrix_sums += 1;
        let (matrices, solid) = (&self.matrices, &self.muscle.solid);
        self.assembly.combine(
            |[of_value, of_rate]| a * of_value + b * of_rate,
            |matrix| matrices.values(solid, matrix),
            values,
        );
    }
}

fn blocks(formulation: Formulation, context: &Context) -> Vec<(Field, Vec<Term>)> {
    formulation
        .rows()
        .iter()
        .map(|(field, equation)| (*field, equation.terms(context)))
        .collect()
}

impl DaeProblem for MuscleDae {
    fn n_unknowns(&self) -> usize {
        self.layout.n_unknowns()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.expand(t, y, Some(y_dot));
        let Self {
            work,
            needs,
            context,
            layout,
            muscle,
            counters,
            factors,
            ..
        } = self;
        let state = State::new(layout, y, y_dot);
        let motion = [&work.displacement[..], &work.velocity];
        let fields = Self::fields(layout, context, &state, motion, factors.as_deref());
        let mut vectors = Vectors {
            force: needs.force.then_some(&mut work.force),
            force_rate: needs.force_rate.then_some(&mut work.force_rate),
            defect: needs.defect.then_some(&mut work.defect),
            defect_rate: needs.defect_rate.then_some(&mut work.defect_rate),
            multiplier_force: needs.multiplier_force.then_some(&mut work.multiplier_force),
        };
        counters.residual_passes += 1;
        counters.force_rate_passes += u64::from(needs.force_rate);
        counters.passed(t, muscle.solid.evaluate(&fields, &mut vectors))?;
        work.load.fill(0.0);
        for load in &muscle.loads {
            load.add_at(t, &mut work.load);
        }
        for pressure in &muscle.pressures {
            pressure.add_at(t, 1.0, &work.displacement, &mut work.load);
        }
        let mut integrals = Integrals {
            solid: &muscle.solid,
            work,
        };
        for ((_, equation), (_, rows)) in self.formulation.rows().iter().zip(layout.blocks()) {
            equation.residual(context, &state, &mut integrals, &mut residual[rows.clone()]);
        }
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.assembly.pattern().clone()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([a, b], values);
        Ok(())
    }

    /// One pass over the elements for both parts.
    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        [of_value, of_rate]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([1.0, 0.0], of_value);
        self.sum_matrices([0.0, 1.0], of_rate);
        Ok(())
    }

    fn kinds(&self) -> Vec<VariableKind> {
        self.layout
            .fill(|field| self.formulation.kind(field, &self.muscle.parameters))
    }

    fn indices(&self) -> Vec<u8> {
        self.layout.fill(|field| {
            self.formulation
                .variable_index(field, &self.muscle.parameters)
        })
    }

    fn component_name(&self, i: usize) -> String {
        let (field, k) = self.layout.locate(i);
        let solid = &self.muscle.solid;
        let (node, axis) = if field.is_displacement_like() {
            let full = solid.dofs().free_to_full()[k];
            (full / 2, ["_x", "_y"][full % 2])
        } else {
            (k, "")
        };
        let [x, y] = solid.space().node_points()[node];
        format!("{field}{axis} at ({x:.5}, {y:.5})")
    }
}
