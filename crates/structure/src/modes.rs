//! The lowest eigenfrequencies and modes, by shift and invert.
//!
//! With the shift σ the map w ↦ u of (K - σM) u - Bᵀp = M w, B u + C p = 0 is symmetric in the inner
//! product of M, keeps to the constraint, and has the eigenvalues θ = 1/(ω² - σ): the wanted ones
//! are the largest. A block Krylov space of it is built with full orthogonalisation in the inner
//! product of M, and the projected dense problem solved (Rayleigh and Ritz); blocks find multiple
//! eigenvalues, up to the multiplicity [`BLOCK`] for certain.
//!
//! Reference: R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228.

use nalgebra::{DMatrix, DVector};

use crate::error::StructureError;
use crate::vibration::{Shifted, Vibration};

/// Vectors added at a time.
const BLOCK: usize = 4;
/// A pair has converged when the residual of its θ is below this fraction of it; the error of ω² is
/// of second order in that.
const CONVERGED: f64 = 1e-10;
/// A new direction shorter than this after orthogonalisation is rounding: the space is exhausted.
const EXHAUSTED: f64 = 1e-12;

/// One harmonic motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// ω², in 1/s²; negative where the equilibrium is unstable.
    pub omega_squared: f64,
    /// The displacements u, with uᵀ M u = 1.
    pub shape: Vec<f64>,
    /// The multipliers p that go with them.
    pub multipliers: Vec<f64>,
    /// ‖K u - Bᵀp - ω² M u‖ / ‖(ω² - σ) M u‖, σ the shift it was found with.
    pub residual: f64,
}

impl Mode {
    /// The angular frequency ω in rad/s, if the motion is an oscillation.
    pub fn angular_frequency(&self) -> Option<f64> {
        (self.omega_squared >= 0.0).then(|| self.omega_squared.sqrt())
    }

    /// The frequency ω/(2π) in Hz, if the motion is an oscillation.
    pub fn frequency(&self) -> Option<f64> {
        self.angular_frequency()
            .map(|omega| omega / std::f64::consts::TAU)
    }

    /// The fraction of critical damping, (α/ω + β ω)/2, under Rayleigh damping D = α M + β A, where
    /// A is all that restores: the stiffness together with the constraint. Paper: eq. (36).
    pub fn damping_ratio(&self, alpha: f64, beta: f64) -> Option<f64> {
        self.angular_frequency()
            .map(|omega| (alpha / omega + beta * omega) / 2.0)
    }
}

/// The `count` modes with ω² nearest to `shift`, by ascending ω²; fewer if there are no more.
///
/// With `shift` at or below the lowest ω² (0 for a stable equilibrium of a supported body) these are
/// the lowest modes.
///
/// # Errors
/// [`StructureError::Factorise`] when K - σM with the constraint is singular: the shift is an
/// eigenvalue (0 for a body that is not supported), or the constraint has dependent rows.
pub fn modes(vibration: &Vibration, count: usize, shift: f64) -> Result<Vec<Mode>, StructureError> {
    let mut space = KrylovSpace::new(vibration, shift)?;
    loop {
        let grew = space.grow()?;
        let pairs = space.ritz_pairs(count);
        if !grew || (pairs.len() == count && pairs.iter().all(|p| p.residual < CONVERGED)) {
            let mut modes = pairs
                .iter()
                .map(|pair| space.mode(pair))
                .collect::<Result<Vec<_>, _>>()?;
            modes.sort_by(|left, right| left.omega_squared.total_cmp(&right.omega_squared));
            return Ok(modes);
        }
    }
}

/// An eigenpair of the projected problem: θ, the vector, and ‖T v - θ v‖ / |θ| in the norm of M.
struct RitzPair {
    theta: f64,
    vector: DVector<f64>,
    residual: f64,
}

/// A basis V, orthonormal in the inner product of M, with M V and the images T V.
struct KrylovSpace<'a> {
    vibration: &'a Vibration,
    shifted: Shifted,
    shift: f64,
    n_starts: usize,
    basis: Vec<DVector<f64>>,
    mass_basis: Vec<DVector<f64>>,
    images: Vec<DVector<f64>>,
}

impl<'a> KrylovSpace<'a> {
    fn new(vibration: &'a Vibration, shift: f64) -> Result<Self, StructureError> {
        let shifted = vibration.shifted(shift)?;
        let (basis, mass_basis, images) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self {
            vibration,
            shifted,
            shift,
            n_starts: 0,
            basis,
            mass_basis,
            images,
        })
    }

    /// Adds a block: the images of the last one or, at first and when these add nothing (an invariant
    /// subspace was met), of new start vectors. False when the whole space is spanned.
    fn grow(&mut self) -> Result<bool, StructureError> {
        let last = self.images[self.images.len().saturating_sub(BLOCK)..].to_vec();
        if self.add_block(last)? {
            return Ok(true);
        }
        let starts = (0..BLOCK).map(|_| self.start()).collect::<Result<_, _>>()?;
        self.add_block(starts)
    }

    fn add_block(&mut self, block: Vec<DVector<f64>>) -> Result<bool, StructureError> {
        let before = self.basis.len();
        for w in block {
            self.add(w)?;
        }
        Ok(self.basis.len() > before)
    }

    /// The image of a vector without symmetry: fractional parts of multiples of an irrational number.
    fn start(&mut self) -> Result<DVector<f64>, StructureError> {
        self.n_starts += 1;
        let irrational = (self.n_starts as f64).sqrt() + std::f64::consts::PI;
        let n = self.vibration.n_displacements();
        let w = DVector::from_fn(n, |i, _| {
            ((i * i + i + 1) as f64 * irrational).fract() - 0.5
        });
        self.image(&w)
    }

    /// T w.
    fn image(&mut self, w: &DVector<f64>) -> Result<DVector<f64>, StructureError> {
        let force = self.vibration.mass_times(w);
        Ok(self.shifted.solve(&force)?.0.into_owned())
    }

    /// Adds the part of a vector that is orthogonal to the space, unless it is rounding.
    fn add(&mut self, mut w: DVector<f64>) -> Result<(), StructureError> {
        let norm = |w: &DVector<f64>| w.dot(&self.vibration.mass_times(w)).max(0.0).sqrt();
        let length = norm(&w);
        for _pass in 0..2 {
            for (v, mass_v) in self.basis.iter().zip(&self.mass_basis) {
                w.axpy(-mass_v.dot(&w), v, 1.0);
            }
        }
        let remaining = norm(&w);
        if remaining <= EXHAUSTED * length {
            return Ok(());
        }
        w /= remaining;
        let image = self.image(&w)?;
        self.mass_basis.push(self.vibration.mass_times(&w));
        self.basis.push(w);
        self.images.push(image);
        Ok(())
    }

    /// The pairs of the projected problem with the largest |θ|.
    fn ritz_pairs(&self, count: usize) -> Vec<RitzPair> {
        let m = self.basis.len();
        if m == 0 {
            // The eigenvalues of an empty matrix are no question for nalgebra.
            return Vec::new();
        }
        let projected = DMatrix::from_fn(m, m, |i, j| self.mass_basis[i].dot(&self.images[j]));
        let eigen = ((&projected + projected.transpose()) / 2.0).symmetric_eigen();
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&i, &j| {
            eigen.eigenvalues[j]
                .abs()
                .total_cmp(&eigen.eigenvalues[i].abs())
        });
        order.truncate(count);
        let pair = |&i: &usize| {
            let theta = eigen.eigenvalues[i];
            let weights = eigen.eigenvectors.column(i);
            let combine = |vectors: &[DVector<f64>]| -> DVector<f64> {
                vectors
                    .iter()
                    .zip(weights.iter())
                    .map(|(v, &weight)| v * weight)
                    .sum()
            };
            let vector = combine(&self.basis);
            let defect = combine(&self.images) - &vector * theta;
            let defect = defect
                .dot(&self.vibration.mass_times(&defect))
                .max(0.0)
                .sqrt();
            RitzPair {
                theta,
                vector,
                residual: defect / theta.abs(),
            }
        };
        order.iter().map(pair).collect()
    }

    /// The mode of a pair: ω² = σ + 1/θ, and p from T w = θ w.
    fn mode(&mut self, pair: &RitzPair) -> Result<Mode, StructureError> {
        let omega_squared = self.shift + pair.theta.recip();
        let u = &pair.vector;
        let inertia = self.vibration.mass_times(u);
        let p = self.shifted.solve(&inertia)?.1 / pair.theta;
        let residual = self.vibration.imbalance(omega_squared, u, &p).norm() * pair.theta.abs()
            / inertia.norm();
        Ok(Mode {
            omega_squared,
            shape: u.as_slice().to_vec(),
            multipliers: p.as_slice().to_vec(),
            residual,
        })
    }
}
