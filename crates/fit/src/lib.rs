//! Weighted nonlinear least squares with bounds, and the uncertainty of its results.
//!
//! # Types and functions
//! - [`Model`] is the trait to implement: residuals as a function of parameters, optionally with derivatives.
//! - [`Parameter`]: name, start, scale and bounds.
//! - [`fit`] takes both with [`Options`] and returns a [`Fit`]: values, cost, history, and [the reason it ended](Ended).
//!   [`refine`] continues a fit of a rougher model.
//! - [`Uncertainty`]: standard errors, intervals and correlations from the final Jacobian.
//! - [`Identifiability`]: combinations of parameters that the data do not determine.
//! - [`profile`](fn@profile): intervals by profile likelihood, for nonlinear models.
//! - [`best_fit`]: the best of the fits from [`several_starts`].
//!
//! # Examples
//! A decay y = a exp(−k t) measured at four times:
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
//! - J. J. Moré, The Levenberg–Marquardt algorithm: implementation and theory, Lecture Notes in
//!   Mathematics 630 (1978) 105–116 (the trust region; here scaled by the parameters' sizes).
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
