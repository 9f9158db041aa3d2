//! A custom DAE in fifty lines: charging a capacitor through a resistor.
//!
//! ```text
//! C u̇ = i          the capacitor
//! 0 = u + R i − U   the loop, U = 1: algebraic
//! ```
//!
//! Exact solution: u = 1 − exp(−t/RC).
use myovib_dae::{Problem, StepError, Tolerances, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;

use sundials_wrap::IdaSolver;

struct Charging {
    r: f64,
    c: f64,
}

impl Problem for Charging {
    fn n_unknowns(&self) -> usize {
        2 // u, i
    }
    fn residual(
        &mut self,
        _t: f64,
        y: &[f64],
        dot: &[f64],
        res: &mut [f64],
    ) -> Result<(), StepError> {
        res[0] = self.c * dot[0] - y[1];
        res[1] = y[0] + self.r * y[1] - 1.0;
        Ok(())
    }
    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1])
            .expect("two full columns")
    }
    #[rustfmt::skip]
    fn jacobian(&mut self, _t: f64, _y: &[f64], _dot: &[f64], a: f64, b: f64, values: &mut [f64]) -> Result<(), StepError> {
        values.copy_from_slice(&[b * self.c, a, -a, a * self.r]); // column by column
        Ok(())
    }
    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential, VariableKind::Algebraic])
    }
    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0, 1])
    }
}

fn main() -> Result<(), sundials_wrap::Error> {
    let mut solver = IdaSolver::builder(Charging { r: 2.0, c: 0.5 })
        .tolerances(Tolerances::scalar(1e-8, 1e-10))
        .build(0.0, &[0.0, 0.5], &[1.0, -0.5])?;
    for t in [0.5, 1.0, 2.0] {
        println!(
            "{:?}: u = {:.8}, exact {:.8}",
            solver.integrate_to(t)?,
            solver.y()[0],
            1.0 - (-t).exp()
        );
    }
    println!("{:#?}", solver.statistics());
    Ok(())
}
