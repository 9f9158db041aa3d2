//! Equations of the continuation from the equilibrium of a similar body to the equilibrium of this body.

use myovib_fem::Inverted;

use super::{Newton, PROBING_GRADIENT, square};
use crate::error::ModelError;
use crate::operators::largest_gradient;

impl Newton<'_> {
    /// Moves the supports to their positions in the nodal `displacement` of a similar body. Returns the free
    /// components, followed by zero pressures.
    pub(in crate::statics) fn take_over(&mut self, displacement: &[f64]) -> Vec<f64> {
        let free = self.muscle.solid.dofs().free_to_full();
        let mut x: Vec<f64> = free.iter().map(|&i| displacement[i]).collect();
        self.place(&x, 1.0);
        let supports = (0..displacement.len()).filter(|i| free.binary_search(i).is_err());
        let distances = supports.map(|i| (i, displacement[i] - self.displacement[i]));
        self.distances = distances.filter(|(_, distance)| *distance != 0.0).collect();
        self.distant = 1.0;
        x.resize(self.layout.n_unknowns(), 0.0);
        x
    }

    /// Returns the residual at `x` under the whole load, and updates the reference force of the convergence test.
    pub(in crate::statics) fn imbalance(&mut self, x: &[f64]) -> Result<Vec<f64>, Inverted> {
        let change = self.load_derivative(x, 1.0)?;
        self.force_square = self.force_square.max(square(&change[..self.n_free()]));
        let mut r = vec![0.0; x.len()];
        self.residual(x, 1.0, &mut r)?;
        Ok(r)
    }

    /// Returns dx/ds for R(x, s) = (1 − s) `imbalance`, and the size of its displacement gradient. R is the residual
    /// under the whole load with supports at the fraction 1 − s of their distances.
    pub(in crate::statics) fn rate(
        &mut self,
        x: &[f64],
        imbalance: &[f64],
    ) -> Result<(Vec<f64>, f64), ModelError> {
        let mut rate: Vec<f64> = imbalance.iter().map(|r| -r).collect();
        if !self.distances.is_empty() {
            let step = PROBING_GRADIENT / self.rate_gradient(&vec![0.0; x.len()]);
            let (distant, mut r) = (self.distant, vec![0.0; x.len()]);
            for sign in [-1.0, 1.0] {
                self.distant = distant + sign * step;
                let evaluated = self.residual(x, 1.0, &mut r);
                self.distant = distant;
                evaluated?;
                rate.iter_mut().zip(&r).for_each(|(rate, r)| *rate += sign * r / (2.0 * step));
            }
        }
        self.tangent(x, 1.0)?;
        self.factorize()?;
        self.solve_linear(&mut rate)?;
        let gradient = self.rate_gradient(&rate);
        Ok((rate, gradient))
    }

    /// Returns the size of the displacement gradient of dx/ds, including the motion of the supports.
    fn rate_gradient(&mut self, rate: &[f64]) -> f64 {
        let n_free = self.n_free();
        self.deform(&rate[..n_free], 0.0);
        for &(component, distance) in &self.distances {
            self.displacement[component] = -distance;
        }
        largest_gradient(self.muscle.solid.space(), &self.displacement)
    }
}
