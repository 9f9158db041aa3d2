//! Linear system of all stages with one frozen Jacobian, solved mode by mode.

use std::ops::Range;

use myovib_dae::{LinearSolver, StepError};
use num_complex::Complex64;

use crate::dense::{AT_A_TIME, add_scaled, write_combined};
use crate::method::Method;
use crate::work::Counters;

/// Workspace for solves with I ⊗ J_y + h⁻¹ A⁻¹ ⊗ J_ẏ; see [`Method`].
#[derive(Debug)]
pub(crate) struct StageSystem {
    real: Vec<f64>,
    complex: Vec<Vec<Complex64>>,
    /// Modes of several right-hand sides, and workspace for one mode as complex numbers.
    modes: Vec<f64>,
    pairs: Vec<Complex64>,
}

enum Mode<'a> {
    Real(&'a mut [f64]),
    Complex(usize, &'a mut [Complex64]),
}

impl StageSystem {
    pub(crate) fn new(method: &Method, n: usize) -> Self {
        Self {
            real: vec![0.0; n],
            complex: vec![vec![Complex64::ZERO; n]; method.complex_modes().len()],
            modes: Vec::new(),
            pairs: Vec::new(),
        }
    }

    /// Solves in place with `matrices`, which must have been set up for the step.
    ///
    /// # Shapes
    /// `stages`: the right-hand sides of the stages, one after the other.
    pub(crate) fn solve<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        method: &Method,
        stages: &mut [f64],
        counters: &mut Counters,
    ) -> Result<(), StepError> {
        let (real_mode, complex_modes) = (method.real_mode(), method.complex_modes());
        let [left, right] = [&real_mode.left, &real_mode.right];
        self.split(left, complex_modes.iter().map(|mode| &mode.left), stages);
        matrices.solve_real(problem, &mut self.real)?;
        for (k, w) in self.complex.iter_mut().enumerate() {
            matrices.solve_complex(problem, k, w)?;
        }
        self.join(right, complex_modes.iter().map(|mode| &mode.right), stages);
        self.count(counters);
        Ok(())
    }

    /// Solves in place for several right-hand sides stored row by row.
    ///
    /// # Shapes
    /// `stages`: the stages, one after the other, with `n` × `n_columns` values each.
    pub(crate) fn solve_columns<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        method: &Method,
        (stages, n_columns): (&mut [f64], usize),
        counters: &mut Counters,
    ) -> Result<(), StepError> {
        self.by_modes::<false>(method, stages, |mode| match mode {
            Mode::Real(w) => matrices.solve_real_columns(problem, w, n_columns),
            Mode::Complex(k, w) => matrices.solve_complex_columns(problem, k, w, n_columns),
        })?;
        (0..n_columns).for_each(|_| self.count(counters));
        Ok(())
    }

    /// Solves in place with the transpose. The right eigenvectors of A⁻ᵀ are the left eigenvectors of A⁻¹, and vice
    /// versa.
    ///
    /// # Shapes
    /// The same as for [`solve`](Self::solve).
    pub(crate) fn solve_transposed<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        method: &Method,
        stages: &mut [f64],
        counters: &mut Counters,
    ) -> Result<(), StepError> {
        self.by_modes::<true>(method, stages, |mode| match mode {
            Mode::Real(w) => matrices.solve_real_transposed(problem, w),
            Mode::Complex(k, w) => matrices.solve_complex_transposed(problem, k, w),
        })?;
        self.count(counters);
        Ok(())
    }

    /// Transforms the right-hand sides to modes, solves each mode in place, and transforms the solutions back. For the
    /// transpose, left and right eigenvectors are exchanged.
    fn by_modes<const TRANSPOSED: bool>(
        &mut self,
        method: &Method,
        stages: &mut [f64],
        mut solve: impl FnMut(Mode<'_>) -> Result<(), StepError>,
    ) -> Result<(), StepError> {
        let length = stages.len() / method.stages();
        let (real_mode, complex_modes) = (method.real_mode(), method.complex_modes());
        let [real_left, real_right] = match TRANSPOSED {
            false => [&real_mode.left, &real_mode.right],
            true => [&real_mode.right, &real_mode.left],
        };
        let pair = |k: usize| match TRANSPOSED {
            false => [&complex_modes[k].left, &complex_modes[k].right],
            true => [&complex_modes[k].right, &complex_modes[k].left],
        };
        // The real mode comes first, followed by the real and imaginary parts of each complex mode.
        let left = |k: usize, i: usize| match k {
            0 => real_left[i],
            _ if k % 2 == 1 => pair(k / 2)[0][i].re,
            _ => pair(k / 2 - 1)[0][i].im,
        };
        // The sum of a conjugate pair of modes is twice its real part.
        let right = |i: usize, k: usize| match k {
            0 => real_right[i],
            _ if k % 2 == 1 => 2.0 * pair(k / 2)[1][i].re,
            _ => -2.0 * pair(k / 2 - 1)[1][i].im,
        };
        self.modes.resize(stages.len(), 0.0);
        write_combined(&mut self.modes, length, left, stages);
        let (real, complex) = self.modes.split_at_mut(length);
        solve(Mode::Real(real))?;
        for (k, parts) in complex.chunks_exact_mut(2 * length).enumerate() {
            let (re, im) = parts.split_at_mut(length);
            self.pairs.clear();
            let pairs = re.iter().zip(&*im);
            self.pairs.extend(pairs.map(|(&re, &im)| Complex64 { re, im }));
            solve(Mode::Complex(k, &mut self.pairs))?;
            for ((re, im), w) in re.iter_mut().zip(im).zip(&self.pairs) {
                (*re, *im) = (w.re, w.im);
            }
        }
        write_combined(stages, length, right, &self.modes);
        Ok(())
    }

    /// Computes the right-hand sides of the modes, the products of the stages and the given vectors.
    fn split<'m>(
        &mut self,
        real: &[f64],
        complex: impl Iterator<Item = &'m Vec<Complex64>> + Clone,
        stages: &[f64],
    ) {
        let n = self.real.len();
        for own in parts(n) {
            let stages = || stages.chunks_exact(n).map(|stage| &stage[own.clone()]);
            let w = &mut self.real[own.clone()];
            w.fill(0.0);
            for (b, l) in stages().zip(real) {
                add_scaled(w, *l, b);
            }
            for (mode, w) in complex.clone().zip(&mut self.complex) {
                let w = &mut w[own.clone()];
                w.fill(Complex64::ZERO);
                for (b, l) in stages().zip(mode) {
                    w.iter_mut().zip(b).for_each(|(w, b)| *w += l * b);
                }
            }
        }
    }

    /// Computes the stages from the solutions of the modes and the given vectors.
    fn join<'m>(
        &self,
        real: &[f64],
        complex: impl Iterator<Item = &'m Vec<Complex64>> + Clone,
        stages: &mut [f64],
    ) {
        let n = self.real.len();
        for own in parts(n) {
            for (i, stage) in stages.chunks_exact_mut(n).enumerate() {
                let stage = &mut stage[own.clone()];
                let all = stage.iter_mut().zip(&self.real[own.clone()]);
                all.for_each(|(x, w)| *x = real[i] * w);
                for (mode, w) in complex.clone().zip(&self.complex) {
                    // The sum of a conjugate pair of modes is twice its real part.
                    let r = mode[i];
                    let all = stage.iter_mut().zip(&w[own.clone()]);
                    all.for_each(|(x, w)| *x += 2.0 * (r.re * w.re - r.im * w.im));
                }
            }
        }
    }

    fn count(&self, counters: &mut Counters) {
        counters.work.real_solves += 1;
        counters.work.complex_solves += self.complex.len() as u64;
    }
}

/// Splits 0..n into ranges for which the values of all vectors fit in the cache.
fn parts(n: usize) -> impl Iterator<Item = Range<usize>> {
    let starts = (0..n).step_by(AT_A_TIME);
    starts.map(move |start| start..n.min(start + AT_A_TIME))
}
