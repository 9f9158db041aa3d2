//! Interface of all integrators.

use std::error::Error;

use crate::outcome::Outcome;
use crate::problem::Problem;
use crate::statistics::Statistics;

/// Values that [`Integrator::correct_initial_values`] corrects. Other values remain unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ConsistencyMode {
    /// The algebraic components of y and the derivatives of the differential components, for semi-explicit systems of
    /// index 1. Rejected if [`Problem::indices`] states a higher index.
    AlgebraicAndDerivatives,
    /// All components of y, for a given ẏ, for instance zero for a steady state.
    States,
    /// All components of y and ẏ, for systems of index 2 and 3, computed from the constraints that the problem states:
    /// see [`project_onto_constraints`](crate::project_onto_constraints).
    Constraints,
}

/// An integration of a [`Problem`], which the integrator owns.
///
/// # Times
/// After every call, even after an error, [`t`](Integrator::t), [`y`](Integrator::y) and [`y_dot`](Integrator::y_dot)
/// refer to the last time reached. A step may end beyond `t` if it contains a root or an output time; dense output
/// covers the whole step.
///
/// The integrator never steps over a *stop time*. A stop time applies once: when it is reached, the call returns
/// [`Outcome::StopTime`], and the next call continues beyond it.
///
/// # Directions
/// The `t_out` of the first step determines the direction of integration. The first [`step`](Integrator::step) rejects
/// a `t_out` equal to the initial time. If `t_out` was already reached, [`integrate_to`](Integrator::integrate_to)
/// takes no step and returns [`Outcome::Reached`]. IDAS integrates forward or backward; Radau IIA integrates only
/// forward, and rejects a time before `t`.
///
/// # Starts
/// Initial values are passed to a builder or to [`reinit`](Integrator::reinit). If y violates the equations by more
/// than the tolerances allow, the next step rejects the initial values with an
/// [`InconsistentStart`](crate::InconsistentStart), unless
/// [`correct_initial_values`](Integrator::correct_initial_values) has corrected them: see
/// [`check_start`](crate::check_start). Values for a restart at the current time are not checked, because after an
/// event they contain the error of dense output.
///
/// # Limits
/// *max_steps* is the number of steps that one call of [`integrate_to`](Integrator::integrate_to) may take; it must be
/// at least 1. The count restarts with the next call. The limit does not apply to [`step`](Integrator::step).
///
/// # Failures
/// If a function returns a recoverable error or a non-finite value, the step is repeated with a smaller size. If this
/// does not help, the call returns [`Outcome::Stopped`]. A fatal error of a function is returned as an error that
/// contains its source. Panics are propagated.
///
/// # Allocation
/// After the first few steps, a step that is accepted at the first attempt does not allocate memory unless a linear
/// solver selects new pivots.
pub trait Integrator<P: Problem> {
    /// Error for invalid calls and for fatal errors of the problem. If the integration cannot continue for another
    /// reason, the call returns [`Outcome::Stopped`] instead.
    type Error: Error + Send + Sync + 'static;

    /// Takes one step toward `t_out`; the error test determines the step size.
    ///
    /// `t_out` determines the direction of integration. At the first step, it also provides the time scale for the
    /// estimate of the step size. The step may end beyond `t_out`.
    ///
    /// # Errors
    /// Fails if `t_out` is not finite or is before `t`, or if the problem returns a fatal error.
    fn step(&mut self, t_out: f64) -> Result<Outcome, Self::Error>;

    /// Integrates up to `t_out`, unless a root or the stop time comes first.
    ///
    /// # Errors
    /// Returns the same errors as [`step`](Integrator::step).
    fn integrate_to(&mut self, t_out: f64) -> Result<Outcome, Self::Error>;

    /// Sets a stop time. No step passes this time, and the stop time is removed when it is reached.
    ///
    /// # Errors
    /// Fails if `t` is not finite or is before the current time.
    fn set_stop_time(&mut self, t: f64) -> Result<(), Self::Error>;

    /// Restarts at (t0, y0, ẏ0) with the same problem, settings and functions. Statistics restart at zero, and a stop
    /// time that has already passed is discarded. Quadratures restart from `q0` (empty without quadratures).
    /// Sensitivities of the new values must be passed to the integrator again.
    ///
    /// # Errors
    /// Fails if an array has the wrong length or contains non-finite values.
    fn reinit(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
    ) -> Result<(), Self::Error>;

    /// Corrects the initial values so that F(t0, y0, ẏ0) = 0. Must be called before the first step. `t_first` is the
    /// first output time, which determines the time scale; it must differ from the initial time.
    ///
    /// [`Problem::kinds`] determines which components are algebraic, independently of exclusions from the error test.
    ///
    /// # Errors
    /// Fails if consistent values are not found, if a step was already taken, or if the problem returns a fatal error.
    fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), Self::Error>;

    /// Returns the time of [`y`](Integrator::y) and [`y_dot`](Integrator::y_dot).
    fn t(&self) -> f64;

    /// Returns the solution at [`t`](Integrator::t).
    fn y(&self) -> &[f64];

    /// Returns the derivative ẏ at [`t`](Integrator::t).
    fn y_dot(&self) -> &[f64];

    /// Returns the start and end of the last accepted step, for which dense output is available. Before the first step,
    /// both are the initial time.
    fn last_step_interval(&self) -> [f64; 2];

    /// Writes the solution (`derivative` = 0) or one of its time derivatives at the time `t` within the last step to
    /// `out`. This does not affect the steps. At least the first derivative is available.
    ///
    /// Before the first step, the solution and its derivative are available at the initial time.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Fails if `t` is outside the last step by more than rounding, or if the order of the derivative is too high.
    fn dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// Returns the number of quadratures.
    fn n_quadratures(&self) -> usize;

    /// Writes the quadratures or one of their time derivatives, as [`dense_output`](Integrator::dense_output) does for
    /// the solution.
    ///
    /// # Errors
    /// Returns the errors of [`dense_output`](Integrator::dense_output), and fails if no quadratures were set up.
    fn quadrature_dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// Returns all counters since the start or since the last restart.
    fn statistics(&self) -> Statistics;

    /// Returns the problem.
    fn problem(&self) -> &P;

    /// Returns the problem for modification, for example of its parameters. Its size and pattern must not change. After
    /// a modification that causes a jump of y or ẏ, call [`reinit`](Integrator::reinit).
    fn problem_mut(&mut self) -> &mut P;
}

/// Implements [`Integrator`] for a solver by its inherent methods of the same names. Only the method for `reinit` may
/// have a different name, which is the last argument. Generic parameters of the implementation are given in brackets:
/// `integrator_by_own_methods!([P: Problem] Solver<P>, P, SolverError, reinit);`
#[macro_export]
macro_rules! integrator_by_own_methods {
    ([$($generics:tt)*] $solver:ty, $problem:ty, $error:ty, $reinit:ident) => {
        impl<$($generics)*> $crate::Integrator<$problem> for $solver {
            type Error = $error;

            fn reinit(
                &mut self,
                t0: f64,
                y0: &[f64],
                y_dot0: &[f64],
                q0: &[f64],
            ) -> Result<(), $error> {
                Self::$reinit(self, t0, y0, y_dot0, q0)
            }

            $crate::forward! { Self;
                mut step(t_out: f64) -> Result<$crate::Outcome, $error>;
                mut integrate_to(t_out: f64) -> Result<$crate::Outcome, $error>;
                mut set_stop_time(t: f64) -> Result<(), $error>;
                mut correct_initial_values(
                    mode: $crate::ConsistencyMode, t_first: f64
                ) -> Result<(), $error>;
                mut dense_output(
                    t: f64, derivative: usize, out: &mut [f64]
                ) -> Result<(), $error>;
                mut quadrature_dense_output(
                    t: f64, derivative: usize, out: &mut [f64]
                ) -> Result<(), $error>;
                mut problem_mut() -> &mut $problem;
                ref problem() -> &$problem;
                ref t() -> f64;
                ref y() -> &[f64];
                ref y_dot() -> &[f64];
                ref last_step_interval() -> [f64; 2];
                ref n_quadratures() -> usize;
                ref statistics() -> $crate::Statistics;
            }
        }
    };
}

/// Implements methods of a trait by methods of the same names of the `owner`: `Self` for the inherent methods of the
/// type, or the type to which it dereferences. Methods with `&mut self` are listed first. Default methods that are not
/// listed keep their default implementations.
#[doc(hidden)]
#[macro_export]
macro_rules! forward {
    ($owner:ty;
        $(mut $change:ident($($argument:ident: $type:ty),*) $(-> $changed:ty)?;)*
        $(ref $read:ident($($key:ident: $key_type:ty),*) -> $value:ty;)*
    ) => {
        $(fn $change(&mut self, $($argument: $type),*) $(-> $changed)? {
            <$owner>::$change(self, $($argument),*)
        })*
        $(fn $read(&self, $($key: $key_type),*) -> $value {
            <$owner>::$read(self, $($key),*)
        })*
    };
}

/// Returns whether `t` is in a step `[from, to]`, which may go backward in time. The tolerance for rounding is the same
/// as in IDAS.
pub fn covers([from, to]: [f64; 2], t: f64) -> bool {
    let rounding = 100.0 * f64::EPSILON * (to.abs() + (to - from).abs());
    t >= from.min(to) - rounding && t <= from.max(to) + rounding
}
