//! Newton systems of a body with two-way coupled oscillators. The oscillators are eliminated.
//!
//! Let g be the value set by the coherence of a place, f = ∂F_b/∂g, and w the weights of the
//! unknowns that form the driving displacement. Then
//!
//! ```text
//! ⎛ J_b      f ∇gᵀ ⎞ ⎛ δy ⎞   ⎛ b_b ⎞     (J_b − Σ h f wᵀ) δy = b_b − Σ f ∇gᵀ J_o⁻¹ b_o,
//! ⎝ γ e wᵀ   J_o   ⎠ ⎝ δs ⎠ = ⎝ b_o ⎠     h = ∇gᵀ J_o⁻¹ γ e,
//! ```
//!
//! and δs = J_o⁻¹ b_o − (J_o⁻¹ γ e) wᵀ δy without another solve. Each place contributes a single scalar h. A place
//! that acts only on the elements that drive it changes existing entries of the stiffness. There is no fill-in, and
//! the factorized matrix is as large as that of the body alone. h depends on the coefficient c of ∂F/∂Ẏ. Written as
//! α + β c with real α and β, it acts as a stiffness and a damping.
//!
//! A place that also acts on other elements would cause fill-in. It is therefore treated as a low-rank correction
//! ([`NonlocalElimination`]).

use myovib_dae::{LinearSolver, Linearization, StepError};
use myovib_sparse::SparseOptions;
use myovib_sparse::{Scalar, SparseError};
use nalgebra::ComplexField;
use num_complex::Complex64;

use super::dae::CoupledDae;
use super::effect::Feedback;
use super::feedback::FeedbackDae;
use super::networks::NetworkMatrix;
use super::nonlocal::NonlocalElimination;
use super::reach::Place;
use super::solver::CoupledSolver;
use crate::field::Field;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;

/// For one place, the positions of the entries of f wᵀ in the stiffness.
#[derive(Debug)]
struct Local {
    /// w.
    weights: Vec<f64>,
    /// For each weight, the entries in its column: one per row of f.
    entries: Vec<u32>,
}

impl Local {
    /// Returns `None` if the stiffness has no entries for f wᵀ, or if the numbers of sources and places differ.
    fn new(one_way: &CoupledDae<MuscleDae>, feedback: &Feedback, place: &Place) -> Option<Self> {
        let body = one_way.body();
        let pattern = body.muscle().solid.displacement_pattern();
        let displacement = body.layout().range(Field::Displacement)?;
        let sources = one_way.oscillators(feedback.network).sources();
        if sources.len() != feedback.weights.len() {
            return None;
        }
        let (mut weights, mut entries) = (Vec::new(), Vec::new());
        for &(unknown, weight) in sources[place.number].unknowns() {
            if !displacement.contains(&unknown) {
                return None;
            }
            let column = unknown - displacement.start;
            weights.push(weight);
            for row in &place.rows {
                let within = pattern.lane(column).binary_search(row).ok()?;
                entries.push(u32::try_from(pattern.major_offsets()[column] + within).ok()?);
            }
        }
        Some(Self { weights, entries })
    }

    /// Subtracts h f wᵀ from `values`.
    fn subtract(&self, h: f64, force: &[f64], values: &mut [f64]) {
        let columns = self.entries.chunks(force.len().max(1)).zip(&self.weights);
        for (entries, weight) in columns {
            for (&entry, force) in entries.iter().zip(force) {
                values[entry as usize] -= h * weight * force;
            }
        }
    }
}

/// Solves the Newton systems of a [`FeedbackDae`] with the solver of its body.
#[derive(Debug)]
pub struct FeedbackSolver {
    one_way: CoupledSolver<CondensedSolver>,
    /// For each place, its positions in the stiffness; `None` if it also acts on elements that do not drive it.
    places: Vec<Option<Local>>,
    real: Matrix<f64>,
    complex: Vec<Matrix<Complex64>>,
}

/// Data of the matrix for one value of c.
#[derive(Debug)]
struct Matrix<T: ComplexField> {
    /// J_o⁻¹ γ e of each network.
    responses: Vec<Vec<T>>,
    nonlocal: NonlocalElimination<T>,
}

impl FeedbackSolver {
    /// Sets up the elimination.
    pub fn new(dae: &mut FeedbackDae, options: SparseOptions) -> Result<Self, SparseError> {
        let (one_way, places, feedbacks) = dae.parts();
        let local = |place: &Place| Local::new(one_way, &feedbacks[place.feedback], place);
        let places: Vec<Option<Local>> = places.iter().map(local).collect();
        if places.iter().any(Option::is_some) {
            one_way.body_mut().coherence_matrices();
        }
        let body = CondensedSolver::new(one_way.body(), options)?;
        Ok(Self {
            one_way: CoupledSolver::new(body, one_way, options)?,
            places,
            real: Matrix { responses: Vec::new(), nonlocal: NonlocalElimination::default() },
            complex: Vec::new(),
        })
    }

    /// Returns the indices of the nonlocal places.
    fn nonlocal(&self) -> Vec<usize> {
        let places = self.places.iter().enumerate();
        let nonlocal = places.filter(|(_, local)| local.is_none());
        nonlocal.map(|(number, _)| number).collect()
    }

    /// Solves with the real matrix without the nonlocal correction.
    fn solve_local(&mut self, dae: &mut FeedbackDae, x: &mut [f64]) -> Result<(), StepError> {
        solve_alone(&mut self.one_way.real, dae, x)?;
        feed_back(&self.places, dae, x);
        let (one_way, ..) = dae.parts();
        let own = one_way.body_range();
        self.one_way.body.solve_real(one_way.body_mut(), &mut x[own])?;
        respond(&self.real.responses, one_way, x);
        Ok(())
    }

    /// Solves with complex matrix `k` without the nonlocal correction.
    fn solve_local_complex(
        &mut self,
        dae: &mut FeedbackDae,
        k: usize,
        x: &mut [Complex64],
    ) -> Result<(), StepError> {
        solve_alone(&mut self.one_way.complex[k], dae, x)?;
        feed_back(&self.places, dae, x);
        let (one_way, ..) = dae.parts();
        let own = one_way.body_range();
        let body = &mut self.one_way.body;
        body.solve_complex(one_way.body_mut(), k, &mut x[own])?;
        respond(&self.complex[k].responses, one_way, x);
        Ok(())
    }
}

impl<T: Scalar + ComplexField> Matrix<T> {
    /// Computes the responses of the factorized `networks`. The nonlocal correction is empty.
    fn new(networks: &mut [NetworkMatrix<T>], dae: &FeedbackDae) -> Result<Self, StepError> {
        let one_way = dae.one_way();
        let response = |(k, network): (usize, &mut NetworkMatrix<T>)| {
            let forcing = one_way.oscillators(k).forcing().into_iter();
            let mut x: Vec<T> = forcing.map(|forcing| T::one() * forcing).collect();
            network.solve(&mut x)?;
            Ok(x)
        };
        let networks = networks.iter_mut().enumerate();
        Ok(Self {
            responses: networks.map(response).collect::<Result<_, StepError>>()?,
            nonlocal: NonlocalElimination::default(),
        })
    }

    /// Returns h of each place.
    fn gains(&self, dae: &FeedbackDae) -> Vec<T> {
        let places = dae.places().iter();
        let network = |place: &Place| dae.feedbacks()[place.feedback].network;
        places.map(|place| place.along(&self.responses[network(place)])).collect()
    }
}

/// Solves in place for the oscillators of a fixed body.
fn solve_alone<T: Scalar>(
    networks: &mut [NetworkMatrix<T>],
    dae: &FeedbackDae,
    x: &mut [T],
) -> Result<(), StepError> {
    let mut networks = networks.iter_mut().enumerate();
    networks.try_for_each(|(k, network)| network.solve(&mut x[dae.one_way().range(k)]))
}

/// For the local places, subtracts the effect of the oscillators' own response on the body.
fn feed_back<T: Scalar>(places: &[Option<Local>], dae: &FeedbackDae, x: &mut [T]) {
    let one_way = dae.one_way();
    let momentum = one_way.body().layout().momentum().start;
    let places = places.iter().zip(dae.places());
    for (_, place) in places.filter(|(local, _)| local.is_some()) {
        let change = place.along(&x[one_way.range(dae.feedbacks()[place.feedback].network)]);
        for (&row, &force) in place.rows.iter().zip(&place.force) {
            x[momentum + row] -= change * force;
        }
    }
}

/// Adds the oscillators' response to the motion of the body.
fn respond<T: Scalar>(responses: &[Vec<T>], one_way: &CoupledDae<MuscleDae>, x: &mut [T]) {
    let (body, oscillators) = x.split_at_mut(one_way.body_range().end);
    for (k, response) in responses.iter().enumerate() {
        let own = one_way.range(k);
        let states = &mut oscillators[own.start - body.len()..own.end - body.len()];
        one_way.oscillators(k).subtract_response(response, body, states);
    }
}

impl LinearSolver<FeedbackDae> for FeedbackSolver {
    fn evaluate(&mut self, dae: &mut FeedbackDae, at: &Linearization<'_>) -> Result<(), StepError> {
        dae.adapt(at.y);
        let (one_way, ..) = dae.parts();
        self.one_way.evaluate(one_way, at)?;
        dae.linearize(at.t, at.y)
    }

    fn set_up(
        &mut self,
        dae: &mut FeedbackDae,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        let solver = &mut self.one_way;
        solver.set_up_networks(dae.one_way(), real, complex)?;
        self.real = Matrix::new(&mut solver.real, dae)?;
        let networks = solver.complex.iter_mut();
        self.complex =
            networks.map(|networks| Matrix::new(networks, dae)).collect::<Result<_, _>>()?;
        // α and β of each place, computed from h for each matrix.
        let of_real = self.real.gains(dae).into_iter();
        let mut all: Vec<Vec<[f64; 2]>> = vec![of_real.map(|h| [h, 0.0]).collect()];
        for (matrix, c) in self.complex.iter().zip(complex) {
            let split = |h: Complex64| [h.re - h.im / c.im * c.re, h.im / c.im];
            all.push(matrix.gains(dae).into_iter().map(split).collect());
        }
        let (one_way, places, _) = dae.parts();
        let locals = &self.places;
        let prepare = |number: usize, body: &mut MuscleDae| {
            if locals.iter().all(Option::is_none) {
                return;
            }
            let matrices = body.coherence_matrices();
            matrices.iter_mut().for_each(|values| values.fill(0.0));
            for ((local, place), parts) in locals.iter().zip(places).zip(&all[number]) {
                let Some(local) = local else { continue };
                for (values, h) in matrices.iter_mut().zip(parts) {
                    local.subtract(*h, &place.force, values);
                }
            }
        };
        let body = one_way.body_mut();
        self.one_way.body.set_up_each(body, real, complex, prepare)?;
        let nonlocal = self.nonlocal();
        self.real.nonlocal =
            NonlocalElimination::new(&nonlocal, dae, |dae, x| self.solve_local(dae, x))?;
        for k in 0..complex.len() {
            let solve =
                |dae: &mut FeedbackDae, x: &mut [Complex64]| self.solve_local_complex(dae, k, x);
            self.complex[k].nonlocal = NonlocalElimination::new(&nonlocal, dae, solve)?;
        }
        Ok(())
    }

    fn solve_real(&mut self, dae: &mut FeedbackDae, rhs: &mut [f64]) -> Result<(), StepError> {
        self.solve_local(dae, rhs)?;
        self.real.nonlocal.correct(dae, rhs)
    }

    fn solve_complex(
        &mut self,
        dae: &mut FeedbackDae,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        self.solve_local_complex(dae, k, rhs)?;
        self.complex[k].nonlocal.correct(dae, rhs)
    }

    fn pivot_choices(&self) -> u64 {
        LinearSolver::<CoupledDae<MuscleDae>>::pivot_choices(&self.one_way)
    }

    fn forget_pivots(&mut self) {
        LinearSolver::<CoupledDae<MuscleDae>>::forget_pivots(&mut self.one_way);
    }

    fn history(&self) -> Vec<bool> {
        LinearSolver::<CoupledDae<MuscleDae>>::history(&self.one_way)
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        LinearSolver::<CoupledDae<MuscleDae>>::set_history(&mut self.one_way, history)
    }
}
