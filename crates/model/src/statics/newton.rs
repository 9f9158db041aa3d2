//! Equations of an equilibrium, and Newton's method at one load.

mod arc;
mod continued;
mod multipliers;
mod residual;

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;

use myovib_fem::{AddedMotion, DrivenSlope, Inverted};
use myovib_sparse::{
    Elimination, Kind, LinearWork, Prediction, SparseError, SparseSystem, Structure, resources,
};
use myovib_sparse::{Ordering, SparseOptions};

use crate::assembly::{Assembly, Entry};
use crate::driven::{self, DrivenObstacles};
use crate::equation::{Added, Context, Equation, PressureRateSource};
use crate::error::ModelError;
use crate::field::{Field, Layout};
use crate::formulation::Formulation;
use crate::matrices::Matrices;
use crate::muscle::Muscle;
use crate::muscle::load::Contact;
use crate::operators::largest_gradient;
use crate::signal::Signal;
pub(super) use arc::{Metric, Point};

/// Newton's iteration ends if the increment is below this fraction of the solution. Convergence is quadratic, so the
/// remaining error is about the square of this fraction, which is below rounding errors.
const RELATIVE_INCREMENT: f64 = 1e-9;
/// An equilibrium on the path, from which the next load step is predicted, is accepted if the estimated next increment
/// is below this fraction of the solution. The estimate assumes linear convergence with the ratio of the last two
/// increments.
const RELATIVE_INCREMENT_ON_PATH: f64 = 1e-4;
/// Newton's iteration also ends if forces and volumes are balanced to this fraction of the loads
/// and of the body's volume, because a displacement or pressure that is zero in equilibrium
/// provides no scale for increments. The value is a few hundred times the unit roundoff.
const BALANCED: f64 = 1e-13;
const MAX_ITERATIONS: usize = 16;
/// Maximum distance between the result of Newton's iteration and the predicted displacement, relative to the length of
/// the prediction. Beyond this distance, the prediction carries no information, and the iteration may end on another
/// branch.
const CORRECTION: f64 = 0.25;
/// Corrections with a displacement gradient up to this value are always accepted. At a kink of a law, for example if
/// fibers become slack, the correction is as long as the prediction for any step size.
const SMALL_GRADIENT: f64 = 1e-3;
/// Displacement gradient of the motion of supports, used to compute the derivative of the forces with respect to
/// the load. With this value, truncation and rounding errors are both below 1e-9 of the derivative.
const PROBING_GRADIENT: f64 = 1e-5;
/// Load factor at which the derivatives of contact forces are evaluated for the unloaded body, because obstacles often
/// only touch the unloaded body.
const FIRST_CONTACT: f64 = 1e-6;

/// The equations of an equilibrium, and the factors of their Jacobian matrix.
pub(super) struct Newton<'a> {
    pub(super) muscle: &'a Muscle,
    /// Contacts of the body, with the multipliers of the path.
    contacts: Cow<'a, [Contact]>,
    pub(super) layout: Layout,
    /// Coefficients of ∂F/∂y.
    assembly: Assembly<f64>,
    matrices: Matrices,
    /// Predicted memory and work of the factorization, if known.
    pub(super) needs: Option<Prediction>,
    /// Memory in use before the factorization, B, if the operating system reports it.
    pub(super) in_use: Option<usize>,
    pub(super) system: SparseSystem<f64>,
    pub(super) work: LinearWork,
    /// Time at which the loads are evaluated, s.
    t: f64,
    /// Loads with fixed directions.
    load: Vec<f64>,
    /// The tension of each element.
    tensions: Vec<f64>,
    /// Square of the reference force of the convergence test. The reference force is the norm of all loads on the
    /// undeformed body or the norm of the forces that move the supports, whichever is larger.
    force_square: f64,
    /// Prescribed components, each with the derivative (m) of its displacement with respect to the load factor.
    prescribed: Vec<(usize, f64)>,
    /// Prescribed components whose displacement is not proportional to the load factor. They are at the end of
    /// `prescribed`. Their derivatives are evaluated at the load factor of the last [`direction`](Self::direction).
    turned: Vec<(usize, Signal)>,
    displacement: Vec<f64>,
    /// Zero, because the body is at rest.
    velocity: Vec<f64>,
    /// The force of active stresses.
    added: Vec<f64>,
    force: Vec<f64>,
    slopes: Vec<DrivenSlope>,
    driven: DrivenObstacles<f64>,
    pub(super) iterations: usize,
    /// Vector that [`solve`](Self::solve) subtracts from the residual; empty if zero.
    pub(super) offset: Vec<f64>,
    /// Components of supports, each with its distance from the prescribed position at the start of a continuation from
    /// a similar body.
    pub(super) distances: Vec<(usize, f64)>,
    /// Fraction of `distances` that remains.
    pub(super) distant: f64,
    /// The element that was last inverted by a trial in the current load step.
    pub(super) inverted: Option<Inverted>,
}

impl<'a> Newton<'a> {
    pub(super) fn new(
        muscle: &'a Muscle,
        formulation: Formulation,
        t: f64,
    ) -> Result<Self, ModelError> {
        let solid = &muscle.solid;
        let (layout, entries) = equations(muscle, formulation.has(Field::Pressure));
        let matrices = Matrices::new(muscle, entries.iter().map(|entry| entry.matrix));
        let n = layout.n_unknowns();
        let assembly = Assembly::new((n, n), entries, |matrix| matrices.pattern(solid, matrix));
        let options =
            SparseOptions { ordering: Ordering::Amd, btf: false, ..SparseOptions::default() };
        let structure = Structure {
            kind: Kind::General,
            constraints: layout.range(Field::Pressure).unwrap_or(n..n),
        };
        let elimination = Elimination::new(assembly.pattern(), structure, options)?;
        elimination.expect_memory()?;
        let in_use = resources::in_use();
        let nodal = vec![0.0; solid.space().n_components()];
        let mut load = nodal.clone();
        for part in &muscle.loads {
            part.add_at(t, &mut load);
        }
        let tensions = muscle.tensions_at_rest(t);
        let (linear, turned): (Vec<_>, Vec<_>) = muscle
            .prescribed
            .iter()
            .map(|own| (own.component, own.signal.clone()))
            .partition(|(_, signal)| signal.is_linear_in_load());
        let linear = linear.into_iter().map(|(i, signal)| (i, signal.at(t).value));
        let rates = turned.iter().map(|(i, signal)| (*i, rate(signal, 0.0, t)));
        let prescribed = linear.chain(rates).collect();
        let whole = force_at_rest(muscle, t, &load, &tensions);
        Ok(Self {
            t,
            needs: elimination.prediction::<f64>(),
            in_use,
            force_square: square(&whole).max(f64::MIN_POSITIVE),
            system: SparseSystem::new(Arc::new(elimination)),
            work: LinearWork::default(),
            muscle,
            contacts: Cow::Borrowed(&muscle.contacts),
            layout,
            assembly,
            matrices,
            load,
            tensions,
            prescribed,
            turned,
            displacement: nodal.clone(),
            velocity: nodal.clone(),
            added: nodal.clone(),
            force: nodal,
            slopes: Vec::new(),
            driven: DrivenObstacles::default(),
            iterations: 0,
            offset: Vec::new(),
            distances: Vec::new(),
            distant: 0.0,
            inverted: None,
        })
    }

    /// Returns the number of free displacement components, which come first among the unknowns.
    pub(super) fn n_free(&self) -> usize {
        self.muscle.solid.dofs().n_free()
    }

    /// Returns the largest nodal |u| (m) for the unknowns `x` under the full load.
    pub(super) fn largest_displacement(&mut self, x: &[f64]) -> f64 {
        let solid = &self.muscle.solid;
        self.place(&x[..solid.dofs().n_free()], 1.0);
        let nodes = self.displacement.chunks(solid.space().dimension());
        let squares = nodes.map(|u| u.iter().map(|u| u * u).sum::<f64>());
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Computes the derivative of the equilibrium with respect to the load factor, at the equilibrium `x` under
    /// `factor` times the load, from the equations linearized at x.
    pub(super) fn direction(&mut self, x: &[f64], factor: f64) -> Result<Vec<f64>, ModelError> {
        let n_free = self.muscle.solid.dofs().n_free();
        let first = self.prescribed.len() - self.turned.len();
        for ((_, own), (_, signal)) in self.prescribed[first..].iter_mut().zip(&self.turned) {
            *own = rate(signal, factor, self.t);
        }
        let mut change = self.load_derivative(x, factor)?;
        self.force_square = self.force_square.max(square(&change[..n_free]));
        self.tangent(x, factor)?;
        // Only trials of the last step may have required pivoting.
        self.system.retry_fixed_pivots();
        self.factorize()?;
        self.solve_linear(&mut change)?;
        Ok(change)
    }

    /// Returns the negative derivative of the residual with respect to the load factor, with the unknowns fixed.
    ///
    /// Supports are moved by only a small part of their displacement, so that no element inverts even if the total
    /// displacement is large. The forces of moved obstacles are differentiated exactly, because a contact may change
    /// over a much smaller part.
    fn load_derivative(&mut self, x: &[f64], factor: f64) -> Result<Vec<f64>, Inverted> {
        let n_free = self.muscle.solid.dofs().n_free();
        let gradient = self.gradient(&vec![0.0; n_free], 1.0);
        let supports = self.displacement.clone();
        let step = (PROBING_GRADIENT / gradient).min(0.5);
        let (mut change, mut before) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        self.residual_under(x, factor + step, Some(factor), &mut change)?;
        self.residual_under(x, factor - step, Some(factor), &mut before)?;
        for (change, before) in change.iter_mut().zip(before) {
            *change = (before - *change) / (2.0 * step);
        }
        self.place(&x[..n_free], factor);
        let (at, dofs) = ((self.t, self.contact_factor(factor)), self.muscle.solid.dofs());
        let mut of_contacts = vec![0.0; supports.len()];
        let touching = if factor == 0.0 { FIRST_CONTACT } else { factor };
        for contact in self.contacts.iter() {
            let motion = [&self.displacement[..], &supports];
            contact.add_force_rate((self.t, touching), motion, &mut of_contacts);
        }
        for (change, &i) in change.iter_mut().zip(dofs.free_to_full()) {
            *change += of_contacts[i];
        }
        for (slope, force) in driven::slopes(dofs, &self.contacts, at, &self.displacement) {
            let moved = force / slope.by_obstacle;
            for (change, by_node) in change.iter_mut().zip(slope.by_nodes) {
                *change -= moved * by_node;
            }
        }
        Ok(change)
    }

    /// Returns the load factor at which the derivatives of contact forces for the load factor `factor` are evaluated.
    /// It is positive, so that obstacles driven by forces press on the body.
    fn contact_factor(&self, factor: f64) -> f64 {
        match factor == 0.0 && self.has_driven_obstacle() {
            true => FIRST_CONTACT,
            false => factor,
        }
    }

    /// Returns whether a force drives an obstacle.
    pub(super) fn has_driven_obstacle(&self) -> bool {
        self.contacts.iter().any(Contact::is_driven)
    }

    /// Returns the [size](largest_gradient) of the displacement gradient if the free components are `q` and the
    /// prescribed components are multiplied by `factor`.
    pub(super) fn gradient(&mut self, q: &[f64], factor: f64) -> f64 {
        self.deform(q, factor);
        largest_gradient(self.muscle.solid.space(), &self.displacement)
    }

    /// Returns the largest penetration of a contact, m.
    fn penetration(&mut self, x: &[f64], factor: f64) -> f64 {
        self.place(&x[..self.muscle.solid.dofs().n_free()], factor);
        let contacts = self.contacts.iter();
        let sums = contacts.map(|contact| contact.sums(self.t, factor, &self.displacement));
        sums.fold(0.0, |max, sums| max.max(sums.penetration))
    }

    /// Returns whether an obstacle moves past the body at the displacement of the last residual, so that no
    /// displacement of the obstacle balances its force.
    fn obstacle_passes(&self, factor: f64) -> bool {
        let contacts = self.contacts.iter();
        let mut distances =
            contacts.filter_map(|own| own.driven_distance(self.t, factor, &self.displacement));
        distances.any(f64::is_nan)
    }

    /// Solves the equations under `factor` times the load by Newton's iteration from the `predicted` equilibrium.
    ///
    /// Returns `None` if `watch` ends the iteration, if an element inverts, if an obstacle passes the body, if the
    /// matrix is singular, if the iteration does not converge, if an increment is longer than the previous one, or if
    /// the result is too far from `predicted`. The allowed distance is `CORRECTION` times the length of the prediction
    /// from `start`. A body in contact may also move by the largest penetration of the prediction in each component.
    /// Increments and corrections with gradients up to `SMALL_GRADIENT` are always accepted.
    ///
    /// Before each iteration, `watch` receives the number of the iteration, counted within this load step and in total.
    pub(super) fn solve(
        &mut self,
        start: &[f64],
        predicted: &[f64],
        factor: f64,
        is_on_path: bool,
        mut watch: impl FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<Option<Vec<f64>>, ModelError> {
        let n_free = self.muscle.solid.dofs().n_free();
        let length = |a: &[f64], b: &[f64]| {
            let squares = a[..n_free].iter().zip(b).map(|(a, b)| (a - b).powi(2));
            squares.sum::<f64>().sqrt()
        };
        self.inverted = None;
        let mut x = predicted.to_vec();
        let mut r = vec![0.0; x.len()];
        let pushed = (n_free as f64).sqrt() * self.penetration(predicted, factor);
        let longest = CORRECTION * length(predicted, start) + pushed;
        let (mut last, mut last_ratio) = (f64::INFINITY, 0.0);
        for iteration in 1..=MAX_ITERATIONS {
            if self.residual(&x, factor, &mut r).is_err()
                || self.obstacle_passes(factor)
                || watch([iteration, self.iterations + 1]).is_break()
                || self.tangent(&x, factor).is_err()
            {
                return Ok(None);
            }
            self.iterations += 1;
            r.iter_mut().zip(&self.offset).for_each(|(r, offset)| *r -= offset);
            let mut increment = r.clone();
            let solved = self.factorize().and_then(|()| self.solve_linear(&mut increment));
            match solved {
                Ok(()) => {}
                Err(error) if is_singular(&error) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
            let is_balanced = self.size(&r) <= BALANCED * BALANCED;
            x.iter_mut().zip(&increment).for_each(|(x, d)| *x -= d);
            let ratio = self.ratio(&increment, &x);
            let next_ratio = ratio * (ratio / last_ratio).min(1.0);
            last_ratio = ratio;
            let moved = square(&increment[..n_free]).sqrt();
            if moved > last && self.gradient(&increment[..n_free], 0.0) > SMALL_GRADIENT {
                return Ok(None);
            }
            if length(&x, predicted) > longest {
                let correction = x[..n_free].iter().zip(predicted).map(|(x, p)| x - p);
                let correction: Vec<f64> = correction.collect();
                if self.gradient(&correction, 0.0) > SMALL_GRADIENT {
                    return Ok(None);
                }
            }
            let is_solved = if is_on_path {
                next_ratio <= RELATIVE_INCREMENT_ON_PATH
            } else {
                ratio <= RELATIVE_INCREMENT
            };
            if is_balanced || is_solved {
                let is_valid = self.residual(&x, factor, &mut r).is_ok();
                r.iter_mut().zip(&self.offset).for_each(|(r, offset)| *r -= offset);
                return Ok((is_valid && self.has_balanced_volumes(&r)).then_some(x));
            }
            last = moved;
        }
        Ok(None)
    }

    /// Returns the number of independent directions in which the energy decreases. Returns `None` if the forces have no
    /// potential or pivots had to be exchanged. For κ = ∞, only displacements that conserve the volume are considered.
    /// For finite κ, the energy includes the energy of volume changes.
    pub(super) fn instabilities(&self) -> Option<usize> {
        self.negative_directions().filter(|_| self.is_symmetric())
    }

    /// Returns whether the tangent is symmetric except for the signs of rows.
    pub(super) fn is_symmetric(&self) -> bool {
        self.muscle.surface_loads.is_empty()
    }

    /// Returns the number of negative pivots in excess of one per pressure, if all pivots are on the diagonal.
    ///
    /// After a change of sign of its last rows, Newton's matrix (K, −Bᵀ; B, M_p/κ) has the inertia of (K, −Bᵀ; −B,
    /// −M_p/κ). According to Sylvester's law, it has one negative pivot for each pressure and one more for each
    /// direction in which the energy decreases. An undetermined pressure has a pivot of either sign, and hides at most
    /// one direction. For an unsymmetric tangent, only the parity of the number is meaningful, because it determines
    /// the sign of the determinant.
    ///
    /// Obstacles driven by a force are fixed in the factorized matrix. Releasing the obstacles adds one negative
    /// direction for each of their negative pivots.
    pub(super) fn negative_directions(&self) -> Option<usize> {
        let pivots = self.system.pivots()?;
        let (momentum, constraint) = pivots.split_at(self.muscle.solid.dofs().n_free());
        let negative = momentum.iter().filter(|pivot| **pivot < 0.0).count()
            + constraint.iter().filter(|pivot| **pivot > 0.0).count();
        Some(negative.saturating_sub(constraint.len()) + self.driven.negative_pivots())
    }

    /// Returns the ratio of increment to solution for the displacement or the pressure, whichever is larger.
    fn ratio(&self, increment: &[f64], x: &[f64]) -> f64 {
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let ratios = self.layout.blocks().iter().map(|(_, range)| {
            match largest(&increment[range.clone()]) {
                0.0 => 0.0,
                change => change / largest(&x[range.clone()]),
            }
        });
        ratios.fold(0.0, f64::max)
    }

    /// Returns whether the volume residuals have converged. If the matrix is singular, small increments do not
    /// show that they have.
    fn has_balanced_volumes(&self, r: &[f64]) -> bool {
        let constraint = &r[self.muscle.solid.dofs().n_free()..];
        square(constraint).sqrt() <= RELATIVE_INCREMENT_ON_PATH * self.muscle.solid.volume()
    }

    /// Returns the square of the relative residual. Forces are relative to the reference force, and volume residuals
    /// are relative to the body's volume.
    fn size(&self, r: &[f64]) -> f64 {
        let (momentum, constraint) = r.split_at(self.muscle.solid.dofs().n_free());
        let volume = self.muscle.solid.volume();
        square(momentum) / self.force_square + square(constraint) / (volume * volume)
    }
}

/// Returns the derivative of the value of `signal` at time `t` with respect to the load factor, evaluated at `factor`.
fn rate(signal: &Signal, factor: f64, t: f64) -> f64 {
    let at = |step: f64| signal.scaled(factor + step).at(t).value;
    (at(PROBING_GRADIENT) - at(-PROBING_GRADIENT)) / (2.0 * PROBING_GRADIENT)
}

/// Returns the unknowns of an equilibrium and the blocks of its matrix.
fn equations(muscle: &Muscle, has_pressure: bool) -> (Layout, Vec<Entry<f64>>) {
    let solid = &muscle.solid;
    let constraint = has_pressure.then_some((Field::Pressure, Equation::Constraint));
    let rows = [(Field::Displacement, Equation::Momentum)];
    let rows = || rows.into_iter().chain(constraint);
    let layout = Layout::new(rows().map(|(field, _)| field), |field| match field {
        Field::Displacement => solid.dofs().n_free(),
        _ => solid.space().n_pressures(),
    });
    let context = Context {
        alpha: 0.0,
        beta: 0.0,
        inv_kappa: muscle.parameters.inv_kappa,
        has_pressure,
        pressure_rate: PressureRateSource::None,
        pressed: muscle.has_boundary_forces(),
        // In equilibrium, all stresses are relaxed and nothing slips.
        added: Added { relaxing: 0, friction: false, ..Added::of(muscle) },
        graded: solid.has_element_scales(),
        coherence: false,
    };
    let mut entries = Vec::new();
    for (row, equation) in rows() {
        let rows = layout.range(row).expect("laid out for these rows");
        for term in equation.terms(&context) {
            entries.extend(layout.range(term.column).map(|columns| Entry {
                rows: rows.clone(),
                columns,
                matrix: term.matrix,
                coefficient: term.df_dy,
            }));
        }
    }
    (layout, entries)
}

/// Returns the force on the undeformed body due to the dead loads `load`, surface loads and active contraction.
fn force_at_rest(muscle: &Muscle, t: f64, load: &[f64], tensions: &[f64]) -> Vec<f64> {
    let rest = vec![0.0; load.len()];
    let mut whole = load.to_vec();
    for load in &muscle.surface_loads {
        load.add_at(t, 1.0, &rest, &mut whole);
    }
    if !tensions.is_empty() {
        let mut active = rest.clone();
        let (u, v) = (&rest, &rest);
        let motion = AddedMotion { u, v, tensions };
        muscle.solid.added_force(&motion, &mut active);
        for (whole, active) in whole.iter_mut().zip(active) {
            *whole -= active;
        }
    }
    whole
}

/// Returns whether, despite this error, the matrix of another state may be factorizable.
pub(super) fn is_singular(error: &SparseError) -> bool {
    matches!(
        error,
        SparseError::Singular { .. }
            | SparseError::ZeroPivot
            | SparseError::TooLargeToPivot { .. }
            | SparseError::Inaccurate { .. }
            | SparseError::NotFinite { .. }
    )
}

pub(super) fn square(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum()
}
