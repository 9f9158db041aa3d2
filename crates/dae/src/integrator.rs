//! What every integrator promises, in the same words.

use std::error::Error;

use crate::outcome::Outcome;
use crate::problem::Problem;
use crate::statistics::Statistics;

/// Which values are sought by [`Integrator::correct_initial_values`]; the others are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ConsistencyMode {
    /// The algebraic components of y and the derivatives of the differential ones, for
    /// semi-explicit systems of index 1.
    AlgebraicAndDerivatives,
    /// All of y, ẏ being given, for instance zero for a steady state.
    States,
    /// All of y and ẏ, by the constraints that the problem states, for systems of index 2 and 3: see
    /// [`project_onto_constraints`](crate::project_onto_constraints).
    Constraints,
}

/// An integration of a [`Problem`], which the integrator owns.
///
/// # Times
/// [`t`](Integrator::t), [`y`](Integrator::y) and [`y_dot`](Integrator::y_dot) belong together
/// after every call, whatever it answered: they are the last values that were reached. A step may
/// end beyond `t`, where a root or an output time lies within it; dense output covers the whole
/// step.
///
/// A *stop time* is never stepped over. It holds once: when it is reached the call answers
/// [`Outcome::StopTime`], and the next call goes on beyond it.
///
/// # Directions
/// The `t_out` of the first step gives the direction: [`step`](Integrator::step) refuses a `t_out` equal to
/// the initial time there. [`integrate_to`](Integrator::integrate_to) the time reached takes no step and
/// answers [`Outcome::Reached`]. IDAS integrates forward or backward; Radau IIA integrates forward only, and
/// refuses a time behind `t`.
///
/// # Starts
/// Values to start from, given to a builder or to [`reinit`](Integrator::reinit), are refused by the next
/// step with an [`InconsistentStart`](crate::InconsistentStart) where y contradicts the equations by more
/// than the tolerances allow, unless [`correct_initial_values`](Integrator::correct_initial_values) corrects
/// them before: see [`check_start`](crate::check_start). Values to go on from at the time reached are
/// taken as they are: behind an event they have the error of dense output.
///
/// # Limits
/// *max_steps* is the number of steps that one call of [`integrate_to`](Integrator::integrate_to)
/// may take, at least 1; the next call has as many again. A single [`step`](Integrator::step) is not limited.
///
/// # Failures
/// After a recoverable error of a function, or a value that is not finite, the step is tried with a
/// smaller size; when that does not help the call answers [`Outcome::Stopped`]. A fatal error of a
/// function is handed back as an error with its source. A panic passes through.
///
/// # Allocation
/// A step that is accepted at once allocates nothing when the first are over, except where a linear
/// solver chooses its pivots anew.
pub trait Integrator<P: Problem> {
    /// Misuse, and fatal errors of the problem. An integration that cannot go on is not an error
    /// but [`Outcome::Stopped`].
    type Error: Error + Send + Sync + 'static;

    /// Takes one step of the size the error allows, towards `t_out`.
    ///
    /// `t_out` gives the direction, and on the first step the scale for the estimate of its size;
    /// the step may go beyond it.
    ///
    /// # Errors
    /// A `t_out` behind `t`, or one that is not finite; a fatal error of the problem.
    fn step(&mut self, t_out: f64) -> Result<Outcome, Self::Error>;

    /// Integrates up to `t_out`, unless a root or the stop time comes first.
    ///
    /// # Errors
    /// As for [`step`](Integrator::step).
    fn integrate_to(&mut self, t_out: f64) -> Result<Outcome, Self::Error>;

    /// Sets the time not to step over, until it is reached.
    ///
    /// # Errors
    /// A time behind `t`, or one that is not finite.
    fn set_stop_time(&mut self, t: f64) -> Result<(), Self::Error>;

    /// Starts afresh at (t0, y0, ẏ0), keeping problem, settings and functions; statistics begin at
    /// zero, and a stop time that is not ahead is forgotten. Quadratures start again from `q0`
    /// (empty without quadratures). Sensitivities of the new values must be given to the integrator again.
    ///
    /// # Errors
    /// Values of the wrong length, or not finite.
    fn reinit(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
    ) -> Result<(), Self::Error>;

    /// Corrects the initial values so that F(t0, y0, ẏ0) = 0; to be called before the first step.
    /// `t_first` is the first output time, for the scale: not the initial time.
    ///
    /// Which components are algebraic is taken from the problem's kinds, whatever is left out of
    /// the error test.
    ///
    /// # Errors
    /// When none were found; a call after the first step; a fatal error of the problem.
    fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), Self::Error>;

    /// The time that [`y`](Integrator::y) and [`y_dot`](Integrator::y_dot) belong to.
    fn t(&self) -> f64;

    /// The solution at [`t`](Integrator::t).
    fn y(&self) -> &[f64];

    /// Its derivative at [`t`](Integrator::t).
    fn y_dot(&self) -> &[f64];

    /// The ends of the last step accepted, which dense output covers; both are the initial time
    /// before the first step.
    fn last_step_interval(&self) -> [f64; 2];

    /// Writes the solution (`derivative` 0) or one of its derivatives at `t`, a time within the last
    /// step, to `out`. This never changes the steps. There is a first derivative at least.
    ///
    /// Before the first step there is the solution and its derivative at the initial time.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// A time outside of the last step by more than rounding, too high a derivative.
    fn dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// Number of quadratures.
    fn n_quadratures(&self) -> usize;

    /// As [`dense_output`](Integrator::dense_output), for the quadratures.
    ///
    /// # Errors
    /// As there, and where there are no quadratures.
    fn quadrature_dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// All counters since the start or the last re-initialisation.
    fn statistics(&self) -> Statistics;

    /// The problem.
    fn problem(&self) -> &P;

    /// The problem, to change its parameters. Its size and pattern must stay as they are; after a
    /// change that makes y or ẏ jump, [`reinit`](Integrator::reinit) is due.
    fn problem_mut(&mut self) -> &mut P;
}

/// Whether `t` lies in a step `[from, to]`, which may go backwards in time, to within the rounding
/// that IDAS allows too.
pub fn covers([from, to]: [f64; 2], t: f64) -> bool {
    let rounding = 100.0 * f64::EPSILON * (to.abs() + (to - from).abs());
    t >= from.min(to) - rounding && t <= from.max(to) + rounding
}
