//! IDAS as an [`Integrator`](myovib_dae::Integrator).

use myovib_dae::{Problem, integrator_by_own_methods};

use super::IdaSolver;
use crate::error::Error;

integrator_by_own_methods!([P: Problem] IdaSolver<P>, P, Error, reinit);
