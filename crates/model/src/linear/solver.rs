//! Linear solver of the integrators that uses condensed matrices, for one real and several complex values of c at a
//! time.

use std::time::Instant;

use myovib_dae::{LinearSolver, Linearization, StepError};
use myovib_sparse::SparseOptions;
use myovib_sparse::{SparseError, resources};
use num_complex::Complex64;

use super::relaxation::{Parts, Relaxation};
use super::{Reduced, Reduction, SparseSystem};
use crate::driven::DrivenObstacles;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// Solves the Newton systems of a [`MuscleDae`], or of a problem that contains one, by a [`Reduction`].
///
/// Complex matrices are allocated at the first complex matrix setup.
#[derive(Debug)]
pub struct CondensedSolver {
    reduction: Reduction,
    real: Reduced<f64>,
    complex: Vec<Reduced<Complex64>>,
    relaxation: Option<Relaxation>,
    /// Obstacles driven by a force, for the real and the complex matrices.
    driven: (DrivenObstacles<f64>, Vec<DrivenObstacles<Complex64>>),
    /// Whether the matrices are known to fit into memory.
    is_allocated: bool,
    /// The real value and the complex values of c.
    shifts: (f64, Vec<Complex64>),
}

impl CondensedSolver {
    /// Sets up the reduction.
    pub fn new(dae: &MuscleDae, options: SparseOptions) -> Result<Self, SparseError> {
        let reduction = dae.reduction(options)?;
        Ok(Self {
            real: reduction.matrix(),
            complex: Vec::new(),
            relaxation: Relaxation::new(dae),
            driven: Default::default(),
            is_allocated: false,
            shifts: (0.0, Vec::new()),
            reduction,
        })
    }
}

impl CondensedSolver {
    /// Creates the solver for right-hand sides without the rows of internal stresses. The integrator eliminates these
    /// stresses.
    pub(crate) fn without_recovery(
        dae: &MuscleDae,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        Ok(Self { relaxation: None, ..Self::new(dae, options)? })
    }

    /// Allocates one real matrix and `n_complex` complex matrices after checking the available memory.
    fn allocate(&mut self, n_complex: usize) -> Result<(), SparseError> {
        if !self.is_allocated || self.complex.len() != n_complex {
            if let Some(needs) = self.reduction.needs(n_complex) {
                resources::expect_memory(needs.bytes, n_complex)?;
            }
            let new = || self.reduction.matrix();
            self.complex.resize_with(n_complex, new);
            self.driven.1.resize_with(n_complex, Default::default);
            self.is_allocated = true;
        }
        Ok(())
    }

    /// Sets up all matrices. Before each setup, calls `prepare` with the index of the matrix; the real matrix has
    /// index 0.
    pub(crate) fn set_up_each(
        &mut self,
        dae: &mut MuscleDae,
        real: f64,
        complex: &[Complex64],
        prepare: impl Fn(usize, &mut MuscleDae),
    ) -> Result<(), StepError> {
        let started = Instant::now();
        self.allocate(complex.len())?;
        self.shifts.0 = real;
        self.shifts.1.clear();
        self.shifts.1.extend(complex);
        let mut work = dae.counters().linear;
        prepare(0, dae);
        let mut result = self.real.set_up(real, |matrix| dae.matrix_values(matrix), &mut work);
        for (k, (matrix, &c)) in self.complex.iter_mut().zip(complex).enumerate() {
            prepare(1 + k, dae);
            let values = |matrix| dae.matrix_values(matrix);
            result = result.and_then(|()| matrix.set_up(c, values, &mut work));
        }
        let (slopes, layout) = (dae.driven_slopes(), dae.layout());
        let displacement = layout.range(Field::Displacement).unwrap_or_default();
        let place = (layout.n_unknowns(), layout.momentum(), displacement);
        let real = &mut self.real;
        result = result.and_then(|()| {
            let solve = |x: &mut [f64]| real.solve(x, &mut work);
            self.driven.0.factorize(slopes, place.clone(), solve)
        });
        for (matrix, driven) in self.complex.iter_mut().zip(&mut self.driven.1) {
            let solve = |x: &mut [Complex64]| matrix.solve(x, &mut work);
            result = result.and_then(|()| driven.factorize(slopes, place.clone(), solve));
        }
        let counters = dae.counters_mut();
        counters.linear = work;
        counters.times.factorizations += started.elapsed();
        Ok(result?)
    }

    /// Rejects a transposed solve if there are eliminated internal stresses or obstacles under a force, because the
    /// adjoint does not support them.
    fn expect_nothing_relaxes(&self) -> Result<(), StepError> {
        match self.relaxation {
            None if self.driven.0.is_empty() => Ok(()),
            None => Err(StepError::Fatal(
                "the adjoint does not support obstacles driven by a force: prescribe their displacements instead"
                    .into(),
            )),
            Some(_) => Err(StepError::Fatal(
                "the adjoint does not support Prony terms: remove them".into(),
            )),
        }
    }
}

impl<P: AsMut<MuscleDae>> LinearSolver<P> for CondensedSolver {
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        problem.as_mut().update_matrices(at.t, at.y, at.y_dot)
    }

    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.set_up_each(problem.as_mut(), real, complex, |_, _| ())
    }

    fn pivot_choices(&self) -> u64 {
        let complex = self.complex.iter().map(Reduced::pivot_choices);
        self.real.pivot_choices() + complex.sum::<u64>()
    }

    fn forget_pivots(&mut self) {
        let complex = self.complex.iter_mut().flat_map(Reduced::systems_mut);
        complex.for_each(SparseSystem::forget_pivots);
        let real = self.real.systems_mut().into_iter();
        real.for_each(SparseSystem::forget_pivots);
    }

    fn history(&self) -> Vec<bool> {
        let real = self.real.systems();
        let complex = self.complex.iter().flat_map(Reduced::systems);
        let of_real = real.into_iter().flat_map(SparseSystem::history);
        of_real.chain(complex.flat_map(SparseSystem::history)).collect()
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        let (flags, _) = history.as_chunks::<3>();
        self.allocate((flags.len() / self.real.systems().len()).saturating_sub(1))?;
        let mut flags = flags.iter();
        for (system, &flags) in self.real.systems_mut().into_iter().zip(&mut flags) {
            system.set_history(flags)?;
        }
        let complex = self.complex.iter_mut().flat_map(Reduced::systems_mut);
        for (system, &flags) in complex.zip(flags) {
            system.set_history(flags)?;
        }
        Ok(())
    }

    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        self.solve_real_columns(problem, rhs, 1)
    }

    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        self.solve_complex_columns(problem, k, rhs, 1)
    }

    fn solve_real_columns(
        &mut self,
        problem: &mut P,
        rhs: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let (c, relaxation) = (self.shifts.0, &mut self.relaxation);
        let matrix = (&mut self.real, &self.driven.0);
        solve_columns(matrix, relaxation, problem.as_mut(), c, (rhs, n_columns))
    }

    fn solve_complex_columns(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let (c, relaxation) = (self.shifts.1[k], &mut self.relaxation);
        let matrix = (&mut self.complex[k], &self.driven.1[k]);
        solve_columns(matrix, relaxation, problem.as_mut(), c, (rhs, n_columns))
    }

    fn solve_real_transposed(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        self.expect_nothing_relaxes()?;
        Ok(self.real.solve_transposed(rhs, &mut problem.as_mut().counters_mut().linear)?)
    }

    fn solve_complex_transposed(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        self.expect_nothing_relaxes()?;
        Ok(self.complex[k].solve_transposed(rhs, &mut problem.as_mut().counters_mut().linear)?)
    }
}

/// Solves with the matrix for the given value of c, including the elimination of internal stresses.
fn solve_columns<T: Parts>(
    (matrix, driven): (&mut Reduced<T>, &DrivenObstacles<T>),
    relaxation: &mut Option<Relaxation>,
    dae: &mut MuscleDae,
    c: T,
    (rhs, n_columns): (&mut [T], usize),
) -> Result<(), StepError> {
    let started = Instant::now();
    if let Some(relaxation) = relaxation {
        relaxation.condense(dae, c, rhs, n_columns);
    }
    matrix.solve_columns(rhs, n_columns, &mut dae.counters_mut().linear)?;
    driven.correct(rhs, n_columns);
    if let Some(relaxation) = relaxation {
        relaxation.recover(dae, c, rhs, n_columns);
    }
    dae.counters_mut().times.solves += started.elapsed();
    Ok(())
}
