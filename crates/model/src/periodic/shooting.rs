//! Shooting: computation of periodic states by Newton's method, and of their Floquet multipliers.

use num_complex::Complex64;

use super::krylov::{Product, eigenvalues, gmres, norm};
use crate::error::ModelError;

/// Factor by which the linear solve of a Newton iteration reduces the residual.
const REDUCTION: f64 = 1e-3;
/// Maximum number of times that a correction is halved.
const HALVINGS: usize = 8;

/// A function that computes the state after one period.
pub(super) type Map<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, ModelError> + 'a;

/// Options of shooting.
#[derive(Debug, Clone, PartialEq)]
pub struct Shooting {
    /// Magnitude of each component of the state, to which differences and residuals are relative.
    pub scales: Vec<f64>,
    /// Maximum relative difference between the states at the start and end of the period.
    pub tolerance: f64,
    /// Relative error of the map, which determines the increment of the finite differences.
    pub map_error: f64,
    /// Whether multipliers use one-sided differences, at half the cost of central differences.
    pub is_one_sided: bool,
    /// Maximum number of Newton iterations.
    pub max_iterations: usize,
    /// Maximum number of matrix-vector products for a linear solve or for computing the multipliers.
    pub max_products: usize,
}

impl Shooting {
    /// Returns the default options for these scales.
    pub fn new(scales: Vec<f64>) -> Self {
        Self {
            scales,
            tolerance: 1e-6,
            map_error: 1e-8,
            is_one_sided: false,
            max_iterations: 20,
            max_products: 60,
        }
    }

    /// Returns the increment h that balances the truncation error h² of central differences with their error ε/h due to
    /// the error ε of the map.
    pub(super) fn increment(&self) -> f64 {
        self.map_error.cbrt()
    }

    pub(super) fn scaled(&self, state: &[f64]) -> Vec<f64> {
        state.iter().zip(&self.scales).map(|(x, s)| x / s).collect()
    }

    pub(super) fn unscaled(&self, state: &[f64]) -> Vec<f64> {
        state.iter().zip(&self.scales).map(|(x, s)| x * s).collect()
    }

    /// Returns the product of the derivative of `function` at `x` with `v`, computed by a central difference.
    pub(super) fn product(
        &self,
        function: &mut Product<'_>,
        x: &[f64],
        v: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let h = self.increment() / largest(v);
        let moved = |h: f64| -> Vec<f64> { x.iter().zip(v).map(|(x, v)| x + h * v).collect() };
        let (ahead, behind) = (function(&moved(h))?, function(&moved(-h))?);
        let both = ahead.iter().zip(&behind);
        Ok(both.map(|(a, b)| (a - b) / (2.0 * h)).collect())
    }

    /// Returns the product of the derivative of `function` at `x` with `v`, computed by a one-sided difference.
    fn one_sided_product(
        &self,
        function: &mut Product<'_>,
        (x, value): (&[f64], &[f64]),
        v: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let h = self.map_error.sqrt() / largest(v);
        let moved: Vec<f64> = x.iter().zip(v).map(|(x, v)| x + h * v).collect();
        let ahead = function(&moved)?;
        Ok(ahead.iter().zip(value).map(|(a, b)| (a - b) / h).collect())
    }

    /// Returns max |y(T) − y(0)| relative to the scales.
    pub fn residual(&self, state: &[f64], end: &[f64]) -> f64 {
        let moved: Vec<f64> = end.iter().zip(state).map(|(end, y)| end - y).collect();
        largest(&self.scaled(&moved))
    }

    /// Solves `residual`(x) = 0 by Newton's method, starting from `x`. Returns x, the norm of its residual, and the
    /// number of iterations.
    pub(super) fn solve(
        &self,
        residual: &mut Product<'_>,
        mut x: Vec<f64>,
    ) -> Result<(Vec<f64>, f64, usize), ModelError> {
        let mut left = residual(&x)?;
        for iteration in 0..self.max_iterations {
            if largest(&left) <= self.tolerance {
                return Ok((x, largest(&left), iteration));
            }
            if !largest(&left).is_finite() {
                return Err(self.failure(&left));
            }
            let right: Vec<f64> = left.iter().map(|r| -r).collect();
            // One-sided differences are accurate enough for the required reduction of the residual.
            let mut product = |v: &[f64]| self.one_sided_product(residual, (&x, &left), v);
            let correction = gmres(&mut product, &right, REDUCTION, self.max_products)?;
            let mut length = 1.0;
            let (moved, reduced) = loop {
                let both = x.iter().zip(&correction);
                let moved: Vec<f64> = both.map(|(x, d)| x + length * d).collect();
                match residual(&moved) {
                    Ok(next) if norm(&next) < (1.0 - 1e-4 * length) * norm(&left) => {
                        break (moved, next);
                    }
                    Err(ModelError::Interrupted) => return Err(ModelError::Interrupted),
                    _ if length <= 0.5_f64.powi(HALVINGS as i32) => {
                        return Err(self.failure(&left));
                    }
                    _ => length *= 0.5,
                }
            };
            (x, left) = (moved, reduced);
        }
        match largest(&left) <= self.tolerance {
            true => Ok((x, largest(&left), self.max_iterations)),
            false => Err(self.failure(&left)),
        }
    }

    fn failure(&self, left: &[f64]) -> ModelError {
        let (tolerance, map_error) = (self.tolerance, self.map_error);
        ModelError::NoPeriodicState { residual: largest(left), tolerance, map_error }
    }
}

/// A periodic state.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicState {
    /// State at the start of the period.
    pub state: Vec<f64>,
    /// Maximum relative difference between the states at the start and end of the period.
    pub residual: f64,
    /// Number of Newton iterations.
    pub iterations: usize,
}

/// Finds a periodic state near `guess`.
///
/// # Errors
/// [`ModelError::NoPeriodicState`] if Newton's method fails; errors of the map at the guess.
pub fn shoot(
    map: &mut Map<'_>,
    guess: &[f64],
    shooting: &Shooting,
) -> Result<PeriodicState, ModelError> {
    let mut residual = |x: &[f64]| {
        let end = shooting.scaled(&map(&shooting.unscaled(x))?);
        Ok(end.iter().zip(x).map(|(end, x)| end - x).collect())
    };
    let (x, left, iterations) = shooting.solve(&mut residual, shooting.scaled(guess))?;
    Ok(PeriodicState { state: shooting.unscaled(&x), residual: left, iterations })
}

/// Leading Floquet multipliers. By default, none are known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Multipliers {
    /// Floquet multipliers in descending order of magnitude.
    pub values: Vec<Complex64>,
    /// Residual norm of each multiplier, which estimates the error of the multiplier.
    pub residuals: Vec<f64>,
    /// Error of the finite differences.
    pub resolution: f64,
}

impl Multipliers {
    /// Combines the multipliers of two parts of a system, of which only the first acts on the other. Returns the
    /// `count` leading multipliers. If the last one is complex, its conjugate is included.
    pub fn with(&self, other: &Self, count: usize) -> Self {
        let all = [self, other].into_iter();
        let pairs =
            all.flat_map(|own| own.values.iter().copied().zip(own.residuals.iter().copied()));
        let mut pairs: Vec<(Complex64, f64)> = pairs.collect();
        pairs.sort_by(|(a, _), (b, _)| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        let is_cut = pairs.get(count.wrapping_sub(1)).is_some_and(|(last, _)| last.im > 0.0);
        pairs.truncate(count + usize::from(is_cut));
        let (values, residuals) = pairs.into_iter().unzip();
        Self { values, residuals, resolution: self.resolution.max(other.resolution) }
    }

    /// Returns the largest magnitude, or `None` without multipliers.
    pub fn spectral_radius(&self) -> Option<f64> {
        self.values.first().map(|value| value.norm())
    }

    /// Returns the error estimate of the largest magnitude.
    pub fn error(&self) -> f64 {
        self.residuals.first().map_or(self.resolution, |left| left.max(self.resolution))
    }

    /// Returns whether all multipliers are inside the unit circle. Returns `None` without multipliers, or if the largest
    /// multiplier is on the circle within its [`error`](Self::error), for example without damping.
    pub fn is_stable(&self) -> Option<bool> {
        let distance = self.spectral_radius()? - 1.0;
        (distance.abs() > self.error()).then_some(distance < 0.0)
    }
}

/// Returns the `count` multipliers of largest magnitude of a periodic state. If the last of them is complex, its
/// conjugate is included.
///
/// # Errors
/// Errors of the map near the state.
pub fn multipliers(
    map: &mut Map<'_>,
    state: &[f64],
    shooting: &Shooting,
    count: usize,
) -> Result<Multipliers, ModelError> {
    let x = shooting.scaled(state);
    let mut image = |x: &[f64]| Ok(shooting.scaled(&map(&shooting.unscaled(x))?));
    let at_x = if shooting.is_one_sided { image(&x)? } else { Vec::new() };
    let mut product = |v: &[f64]| match shooting.is_one_sided {
        true => shooting.one_sided_product(&mut image, (&x, &at_x), v),
        false => shooting.product(&mut image, &x, v),
    };
    // One product removes the components that decay within a period. The equidistributed start values have components
    // in all directions.
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let all: Vec<f64> = (1..=x.len()).map(|i| (golden * i as f64).fract() - 0.5).collect();
    let start = product(&all)?;
    // The resolution of multipliers is the increment for one-sided differences and its square for central differences.
    let resolution = match shooting.is_one_sided {
        true => shooting.map_error.sqrt(),
        false => shooting.increment().powi(2),
    };
    if norm(&start) <= shooting.map_error {
        return Ok(Multipliers {
            values: vec![Complex64::ZERO],
            residuals: vec![norm(&start)],
            resolution,
        });
    }
    let most = shooting.max_products.min(x.len());
    let found = eigenvalues(&mut product, &start, count.min(x.len()), resolution, most)?;
    let (values, residuals) = found.into_iter().unzip();
    Ok(Multipliers { values, residuals, resolution })
}

/// Returns max |x_i|. NaN is considered the largest value.
pub(super) fn largest(x: &[f64]) -> f64 {
    x.iter().map(|x| x.abs()).max_by(f64::total_cmp).unwrap_or(0.0)
}
