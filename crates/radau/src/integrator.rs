//! Radau IIA as an [`Integrator`](myovib_dae::Integrator).

use myovib_dae::{LinearSolver, Problem, integrator_by_own_methods};

use crate::error::RadauError;
use crate::solver::RadauSolver;

integrator_by_own_methods!(
    [P: Problem, M: LinearSolver<P>] RadauSolver<P, M>, P, RadauError, reinit_with
);
