//! Newton's method for an equilibrium at a given distance from another equilibrium, with an unknown load.

use std::ops::ControlFlow;

use super::{
    BALANCED, CORRECTION, MAX_ITERATIONS, Newton, RELATIVE_INCREMENT, SMALL_GRADIENT, is_singular,
};
use crate::error::ModelError;

/// Metric for vectors of displacement components and a load factor. The square of the length is the sum of the squares
/// of the components plus a multiple of the square of the load factor.
#[derive(Debug, Clone, Copy)]
pub(in crate::statics) struct Metric {
    n_free: usize,
    /// Weight of the load factor, m².
    weight: f64,
}

/// Unknowns and load factor, or changes of both.
#[derive(Debug, Clone)]
pub(in crate::statics) struct Point {
    pub(in crate::statics) x: Vec<f64>,
    pub(in crate::statics) load: f64,
}

impl Metric {
    /// Creates a metric in which displacements and load factor contribute equally to the length of the initial
    /// `direction`, the derivative with respect to the load factor. Prescribed components count as displacements.
    pub(in crate::statics) fn new(newton: &Newton<'_>, direction: &[f64]) -> Self {
        let n_free = newton.n_free();
        let supports = newton.prescribed.iter().map(|(_, value)| value * value);
        let own = super::square(&direction[..n_free]) + supports.sum::<f64>();
        Self { n_free, weight: if own > 0.0 { own } else { 1.0 } }
    }

    pub(in crate::statics) fn dot(&self, a: &Point, b: &Point) -> f64 {
        let products = a.x[..self.n_free].iter().zip(&b.x).map(|(a, b)| a * b);
        products.sum::<f64>() + self.weight * a.load * b.load
    }

    pub(in crate::statics) fn length(&self, a: &Point) -> f64 {
        self.dot(a, a).sqrt()
    }
}

impl Point {
    /// Returns `self + factor · other`.
    pub(in crate::statics) fn plus(&self, factor: f64, other: &Self) -> Self {
        let x = self.x.iter().zip(&other.x);
        Self { x: x.map(|(a, b)| a + factor * b).collect(), load: self.load + factor * other.load }
    }
}

impl Newton<'_> {
    /// Computes an equilibrium on the sphere around `start` through `predicted`, by Newton's iteration from
    /// `predicted`. Returns `None` in the same cases as [`solve`](Self::solve).
    pub(in crate::statics) fn solve_on_sphere(
        &mut self,
        metric: Metric,
        start: &Point,
        predicted: &Point,
        mut watch: impl FnMut([usize; 2]) -> ControlFlow<()>,
    ) -> Result<Option<Point>, ModelError> {
        let n_free = self.n_free();
        self.inverted = None;
        let radius = metric.length(&predicted.plus(-1.0, start));
        let mut at = predicted.clone();
        let mut r = vec![0.0; at.x.len()];
        let mut last = f64::INFINITY;
        for iteration in 1..=MAX_ITERATIONS {
            if self.residual(&at.x, at.load, &mut r).is_err() || self.obstacle_passes(at.load) {
                return Ok(None);
            }
            let Ok(mut by_load) = self.load_derivative(&at.x, at.load) else {
                return Ok(None);
            };
            if watch([iteration, self.iterations + 1]).is_break()
                || self.tangent(&at.x, at.load).is_err()
            {
                return Ok(None);
            }
            self.iterations += 1;
            let mut correction = r.clone();
            let solved = self
                .factorize()
                .and_then(|()| self.solve_linear(&mut correction))
                .and_then(|()| self.solve_linear(&mut by_load));
            match solved {
                Ok(()) => {}
                Err(error) if is_singular(&error) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
            // The equation |covered|² = radius² is solved by block elimination.
            let covered = at.plus(-1.0, start);
            let [correction, by_load] =
                [(correction, 0.0), (by_load, 1.0)].map(|(x, load)| Point { x, load });
            let excess = metric.dot(&covered, &covered) - radius * radius;
            let load =
                (metric.dot(&covered, &correction) - 0.5 * excess) / metric.dot(&covered, &by_load);
            if !load.is_finite() {
                return Ok(None);
            }
            let origin = Point { x: vec![0.0; at.x.len()], load: 0.0 };
            let increment = origin.plus(load, &by_load).plus(-1.0, &correction);
            let is_balanced = self.size(&r) <= BALANCED * BALANCED
                && excess.abs() <= RELATIVE_INCREMENT * radius * radius;
            at = at.plus(1.0, &increment);
            let moved = metric.length(&increment);
            if moved > last && self.gradient(&increment.x[..n_free], load) > SMALL_GRADIENT {
                return Ok(None);
            }
            let away = at.plus(-1.0, predicted);
            if metric.length(&away) > CORRECTION * radius
                && self.gradient(&away.x[..n_free], away.load) > SMALL_GRADIENT
            {
                return Ok(None);
            }
            let is_solved = self.ratio(&increment.x, &at.x) <= RELATIVE_INCREMENT
                && moved <= RELATIVE_INCREMENT * metric.length(&at);
            if is_balanced || is_solved {
                let is_valid = self.residual(&at.x, at.load, &mut r).is_ok();
                return Ok(is_valid.then_some(at));
            }
            last = moved;
        }
        Ok(None)
    }
}
