//! The linear system of all stages with one frozen Jacobian, solved mode by mode.

use myovib_dae::{LinearSolver, StepError};
use num_complex::Complex64;

use crate::dense::add_scaled;
use crate::method::Method;
use crate::work::Counters;

/// Workspace for solves with I ⊗ J_y + h⁻¹ A⁻¹ ⊗ J_ẏ; see [`Method`].
#[derive(Debug)]
pub(crate) struct StageSystem {
    real: Vec<f64>,
    complex: Vec<Vec<Complex64>>,
}

impl StageSystem {
    pub(crate) fn new(method: &Method, n: usize) -> Self {
        Self {
            real: vec![0.0; n],
            complex: vec![vec![Complex64::ZERO; n]; method.complex_modes().len()],
        }
    }

    /// Solves in place, with the `matrices` as they are set up for the step.
    ///
    /// # Shapes
    /// `stages`: the stages' right-hand sides, one after the other.
    pub(crate) fn solve<P, M: LinearSolver<P>>(
        &mut self,
        problem: &mut P,
        matrices: &mut M,
        method: &Method,
        stages: &mut [f64],
        counters: &mut Counters,
    ) -> Result<(), StepError> {
        let n = self.real.len();
        let (real_mode, complex_modes) = (method.real_mode(), method.complex_modes());
        self.real.fill(0.0);
        for (b, l) in stages.chunks_exact(n).zip(&real_mode.left) {
            add_scaled(&mut self.real, *l, b);
        }
        matrices.solve_real(problem, &mut self.real)?;
        counters.work.real_solves += 1;
        for (k, (mode, w)) in complex_modes.iter().zip(&mut self.complex).enumerate() {
            w.fill(Complex64::ZERO);
            for (b, l) in stages.chunks_exact(n).zip(&mode.left) {
                w.iter_mut().zip(b).for_each(|(w, b)| *w += l * b);
            }
            matrices.solve_complex(problem, k, w)?;
            counters.work.complex_solves += 1;
        }
        for (i, stage) in stages.chunks_exact_mut(n).enumerate() {
            let right = real_mode.right[i];
            let all = stage.iter_mut().zip(&self.real);
            all.for_each(|(x, w)| *x = right * w);
            for (mode, w) in complex_modes.iter().zip(&self.complex) {
                // A conjugate pair of modes adds up to twice the real part.
                let r = mode.right[i];
                let all = stage.iter_mut().zip(w);
                all.for_each(|(x, w)| *x += 2.0 * (r.re * w.re - r.im * w.im));
            }
        }
        Ok(())
    }
}
