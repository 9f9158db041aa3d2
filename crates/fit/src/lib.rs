//! Weighted nonlinear least squares with bounds, and the uncertainty of its results.
//!
//! # Types and functions
//! - [`Model`]: the trait that a model implements. It returns residuals as a function of the parameters and,
//!   optionally, derivatives.
//! - [`Parameter`]: a parameter with its name, start, scale and bounds.
//! - [`fit`]: fits a model with the given [`Options`]. It returns a [`Fit`] with values, cost, history, and [the reason
//!   why the fit ended](Ended). [`refine`] continues the fit of a less accurate model.
//! - [`Uncertainty`]: standard errors, intervals and correlations from the final Jacobian.
//! - [`Identifiability`]: combinations of parameters that the data do not determine.
//! - [`profile`](fn@profile): profile-likelihood intervals, which are suitable for nonlinear models.
//! - [`best_fit`]: the best fit among those started from [`several_starts`].
//!
//! # Examples
//! This example fits the decay y = a exp(−k t) to measurements at four times:
//! ```
//! use myovib_fit::{Failed, Model, Options, Parameter, fit};
//!
//! struct Decay;
//! const DATA: [(f64, f64); 4] = [(0.0, 2.0), (1.0, 1.2), (2.0, 0.75), (3.0, 0.44)];
//!
//! impl Model for Decay {
//!     fn n_residuals(&self) -> usize {
//!         DATA.len()
//!     }
//!     fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
//!         for (out, (t, y)) in out.iter_mut().zip(DATA) {
//!             *out = p[0] * (-p[1] * t).exp() - y;
//!         }
//!         Ok(())
//!     }
//! }
//!
//! let start = [Parameter::new("a", 1.0), Parameter::new("k", 1.0).within(0.0, 10.0)];
//! let fitted = fit(&mut Decay, &start, &Options::default())?;
//! let [low, high] = fitted.uncertainty()?.intervals(0.95)[1];
//! assert!(low < 0.5 && 0.5 < high);
//! # Ok::<(), myovib_fit::FitError>(())
//! ```
//!
//! # References
//! - J. J. Moré, The Levenberg–Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630 (1978)
//!   105–116 (trust region; here, it is scaled by the sizes of the parameters).
//! - D. M. Bates, D. G. Watts, A relative offset orthogonality convergence criterion for nonlinear
//!   least squares, Technometrics 23 (1981) 179–183.
//! - D. M. Bates, D. G. Watts, *Nonlinear Regression Analysis and Its Applications*, Wiley 1988
//!   (intervals, profiles).
#![forbid(unsafe_code)]

mod differences;
mod driver;
mod error;
mod identifiability;
mod loss;
mod model;
mod options;
mod parameter;
mod profile;
mod result;
mod starts;
mod trust_region;
mod uncertainty;

pub use driver::{fit, fit_observed, refine};
pub use error::FitError;
pub use identifiability::{Direction, Identifiability};
pub use loss::Loss;
pub use model::{Failed, Model};
pub use options::Options;
pub use parameter::Parameter;
pub use profile::{Profile, ProfilePoint, profile};
pub use result::{Ended, Fit, Iteration};
pub use starts::{best_fit, several_starts};
pub use uncertainty::Uncertainty;
