//! The lowest eigenfrequencies and modes, computed by the shift-and-invert method.
//!
//! With the shift σ, the map w ↦ u defined by (K − σM) u − Bᵀp = M w, B u + C p = 0 is symmetric in the inner
//! product of M, preserves the constraint, and has the eigenvalues θ = 1/(ω² − σ). The lowest modes have the
//! negative values of θ and the largest positive values, which are at the ends of the spectrum of the map. The
//! method builds a block Krylov space with full orthogonalization in the inner product of M and solves the
//! projected dense problem (Rayleigh–Ritz). A block method finds multiple eigenvalues, with certainty up to the
//! multiplicity [`BLOCK`]. The images of all blocks except the last block are in the space, so the images of the
//! last block determine the residual of a pair.
//!
//! Reference: R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228.

use nalgebra::{DMatrix, DVector};

use crate::eigen::symmetric_eigen;
use crate::error::StructureError;
use crate::vibration::{Shifted, Vibration};

/// Number of vectors per block.
const BLOCK: usize = 4;
/// Tolerance of convergence: the residual of θ relative to θ. The error of ω² is of second order in the residual.
const CONVERGED: f64 = 1e-10;
/// Length, after orthogonalization, below which a new direction consists of rounding errors. The space is then
/// exhausted.
const EXHAUSTED: f64 = 1e-12;
/// Minimum ratio of the lengths of a vector after and before its orthogonalization against some vectors. If the
/// ratio is larger, the vector is still orthogonal to the other vectors, up to ten times the rounding error.
const ACCURATE: f64 = 0.1;
/// Fraction of the largest |θ| below which negative values of θ consist of rounding errors.
const NEGATIVE: f64 = 1e-10;
/// Maximum number of basis vectors per requested mode, plus a constant. About three vectors per mode suffice. If a
/// larger space does not lead to convergence, the factors are inaccurate.
const VECTORS_PER_MODE: usize = 10;
const FURTHER_VECTORS: usize = 200;
/// Convergence is tested once the basis has this many vectors per requested mode. Earlier tests would be inefficient,
/// because the projected problem costs more than the vectors.
const FEWEST_VECTORS_PER_MODE: usize = 2;

/// A harmonic vibration mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// ω² in 1/s²; negative for an unstable equilibrium.
    pub omega_squared: f64,
    /// Displacements u, normalized such that uᵀ M u = 1.
    pub shape: Vec<f64>,
    /// Corresponding multipliers p.
    pub multipliers: Vec<f64>,
    /// The residual ‖K u − Bᵀp − ω² M u‖ / ‖(ω² − σ) M u‖, where σ is the shift.
    pub residual: f64,
}

impl Mode {
    /// Returns the angular frequency ω in rad/s, or `None` if the motion is not an oscillation.
    pub fn angular_frequency(&self) -> Option<f64> {
        (self.omega_squared >= 0.0).then(|| self.omega_squared.sqrt())
    }

    /// Returns the frequency ω/(2π) in Hz, or `None` if the motion is not an oscillation.
    pub fn frequency(&self) -> Option<f64> {
        self.angular_frequency().map(|omega| omega / std::f64::consts::TAU)
    }
}

/// Computes the `count` lowest modes in ascending order of ω², or all modes if the system has fewer. Modes
/// converge fast if their ω² is near `shift`.
///
/// # Errors
/// Returns [`StructureError::Factorize`] if K − σM with the constraint is singular. In this case, the shift is an
/// eigenvalue (0 for an unsupported body), or the constraint has dependent rows. Returns
/// [`StructureError::NotConverged`] if the matrix is nearly singular.
pub fn modes(vibration: &Vibration, count: usize, shift: f64) -> Result<Vec<Mode>, StructureError> {
    KrylovSpace::new(vibration, shift)?.modes(count)
}

/// Computes all modes with ω² below `limit` and the next mode, in ascending order of ω². Returns `None` if there
/// are more than `most` such modes, or if their number is unknown because the factorization exchanged rows.
///
/// # Errors
/// Returns the errors of [`modes`] with the shift `limit`.
pub fn modes_below(
    vibration: &Vibration,
    limit: f64,
    most: usize,
) -> Result<Option<Vec<Mode>>, StructureError> {
    let space = KrylovSpace::new(vibration, limit)?;
    let n_below = space.shifted.n_below().filter(|n_below| *n_below < most);
    n_below.map(|n_below| space.modes(n_below + 1)).transpose()
}

/// An eigenpair of the projected problem: the value θ, the coefficients in the basis, and the residual ‖T v − θ v‖
/// / |θ| in the norm of M.
struct RitzPair {
    theta: f64,
    weights: DVector<f64>,
    residual: f64,
}

/// A basis V, orthonormal in the inner product of M, with the products M V and the projection H of the map T. Also
/// contains the images of the last block without their components in this basis.
struct KrylovSpace<'a> {
    vibration: &'a Vibration,
    shifted: Shifted,
    shift: f64,
    n_starts: usize,
    basis: Vec<DVector<f64>>,
    mass_basis: Vec<DVector<f64>>,
    projected: DMatrix<f64>,
    /// The components T v − V H for the vectors of the last block.
    beyond: Vec<Image>,
}

/// The component w of a vector orthogonal to the space.
struct Image {
    w: DVector<f64>,
    /// The product M w.
    mass_times: DVector<f64>,
    /// Norm of the original vector.
    length: f64,
}

impl Image {
    fn norm(&self) -> f64 {
        self.w.dot(&self.mass_times).max(0.0).sqrt()
    }
}

impl<'a> KrylovSpace<'a> {
    fn new(vibration: &'a Vibration, shift: f64) -> Result<Self, StructureError> {
        Ok(Self {
            vibration,
            shifted: vibration.shifted(shift)?,
            shift,
            n_starts: 0,
            basis: Vec::new(),
            mass_basis: Vec::new(),
            projected: DMatrix::zeros(0, 0),
            beyond: Vec::new(),
        })
    }

    /// Computes the `count` lowest modes.
    fn modes(mut self, count: usize) -> Result<Vec<Mode>, StructureError> {
        let n_below = self.shifted.n_below();
        let most = VECTORS_PER_MODE * count + FURTHER_VECTORS;
        let mut next_check = FEWEST_VECTORS_PER_MODE * count;
        loop {
            let grew = self.grow()?;
            let finite = self.is_finite();
            let vectors = self.basis.len();
            if grew && finite && vectors < next_check {
                continue;
            }
            next_check = (vectors + vectors / 8).min(most);
            let pairs =
                if finite { self.ritz_pairs(count, n_below.filter(|_| grew)) } else { Vec::new() };
            let converged = pairs.iter().filter(|p| p.residual < CONVERGED).count();
            if finite && (!grew || converged == count) {
                let modes = pairs.iter().map(|pair| self.mode(pair));
                let mut modes = modes.collect::<Result<Vec<_>, _>>()?;
                modes.sort_by(|left, right| left.omega_squared.total_cmp(&right.omega_squared));
                return Ok(modes);
            }
            if vectors >= most || !finite {
                return Err(StructureError::NotConverged { converged, count, vectors });
            }
        }
    }

    /// Adds a block of vectors: the components of the last images outside the space. Initially and in an invariant
    /// subspace, adds new start vectors instead. Returns false if the vectors already span the whole space.
    fn grow(&mut self) -> Result<bool, StructureError> {
        let last = std::mem::take(&mut self.beyond);
        if self.add_block(last)? {
            return Ok(true);
        }
        let starts = (0..BLOCK).map(|_| self.start()).collect::<Result<_, _>>()?;
        self.add_block(starts)
    }

    /// Adds the images to the basis and computes the images of the new vectors.
    fn add_block(&mut self, block: Vec<Image>) -> Result<bool, StructureError> {
        let before = self.basis.len();
        for image in block {
            self.add(image, before);
        }
        let n = self.basis.len();
        self.projected.resize_mut(n, n, 0.0);
        for j in before..n {
            let solution = self.shifted.solve(&self.mass_basis[j])?.0.into_owned();
            let (image, weights) = self.outside(solution);
            // The coefficients are symmetric except for rounding.
            self.projected.set_column(j, &weights);
            self.projected.set_row(j, &weights.transpose());
            self.beyond.push(image);
        }
        Ok(n > before)
    }

    /// Returns the image of a start vector without symmetry, which consists of the fractional parts of multiples
    /// of an irrational number.
    fn start(&mut self) -> Result<Image, StructureError> {
        self.n_starts += 1;
        let irrational = (self.n_starts as f64).sqrt() + std::f64::consts::PI;
        let n = self.vibration.n_displacements();
        let w = DVector::from_fn(n, |i, _| ((i * i + i + 1) as f64 * irrational).fract() - 0.5);
        let force = self.vibration.mass_times(&w);
        let solution = self.shifted.solve(&force)?.0.into_owned();
        Ok(self.outside(solution).0)
    }

    /// Returns false if a solution has overflowed, because the eigenvalues are then undefined.
    fn is_finite(&self) -> bool {
        self.projected.iter().all(|value| value.is_finite())
    }

    /// Returns the component of a vector orthogonal to the basis, and the coefficients of the vector in the basis.
    fn outside(&self, mut w: DVector<f64>) -> (Image, DVector<f64>) {
        let mut weights = DVector::zeros(self.basis.len());
        // Two passes are sufficient.
        for _pass in 0..2 {
            for ((v, mass_v), weight) in
                self.basis.iter().zip(&self.mass_basis).zip(weights.iter_mut())
            {
                let part = mass_v.dot(&w);
                w.axpy(-part, v, 1.0);
                *weight += part;
            }
        }
        let mut image = Image { mass_times: self.vibration.mass_times(&w), w, length: 0.0 };
        image.length = image.norm().hypot(weights.norm());
        (image, weights)
    }

    /// Adds the component of an image orthogonal to the space, unless it consists of rounding errors. The image is
    /// already orthogonal to the basis vectors before index `first`.
    fn add(&mut self, mut image: Image, first: usize) {
        let before = image.norm();
        for (v, mass_v) in self.basis[first..].iter().zip(&self.mass_basis[first..]) {
            let part = mass_v.dot(&image.w);
            image.w.axpy(-part, v, 1.0);
            image.mass_times.axpy(-part, mass_v, 1.0);
        }
        if image.norm() < ACCURATE * before {
            let length = image.length;
            image = Image { length, ..self.outside(image.w).0 };
        }
        let remaining = image.norm();
        if remaining <= EXHAUSTED * image.length {
            return;
        }
        self.mass_basis.push(image.mass_times / remaining);
        self.basis.push(image.w / remaining);
    }

    /// Returns the `count` pairs of the projected problem with the lowest ω². The result is empty if fewer than
    /// `n_below` pairs have a negative θ.
    fn ritz_pairs(&self, count: usize, n_below: Option<usize>) -> Vec<RitzPair> {
        let m = self.basis.len();
        if m == 0 {
            // nalgebra does not accept an empty matrix here.
            return Vec::new();
        }
        let (theta, vectors) = symmetric_eigen(&self.projected);
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&i, &j| theta[i].total_cmp(&theta[j]));
        // The space has at most as many negative values of θ as the map.
        let rounding = NEGATIVE * theta.amax();
        let is_negative = |i: &&usize| theta[**i] < -rounding;
        let n_negative = order.iter().take(n_below.unwrap_or(m)).take_while(is_negative).count();
        if n_below.is_some_and(|n_below| n_negative < n_below) {
            return Vec::new();
        }
        let mut positive = order.split_off(n_negative);
        order.reverse();
        positive.reverse();
        order.append(&mut positive);
        order.truncate(count);
        let n_last = self.beyond.len();
        let product = |i: usize, j: usize| self.beyond[i].w.dot(&self.beyond[j].mass_times);
        let gram = DMatrix::from_fn(n_last, n_last, product);
        let pair = |&i: &usize| {
            let theta = theta[i];
            let weights = vectors.column(i).into_owned();
            let last = weights.rows(m - n_last, n_last);
            let residual = last.dot(&(&gram * last)).max(0.0).sqrt();
            RitzPair { theta, weights, residual: residual / theta.abs() }
        };
        order.iter().map(pair).collect()
    }

    /// Returns the mode of a pair. Here, ω² = σ + 1/θ, and p follows from T w = θ w.
    fn mode(&mut self, pair: &RitzPair) -> Result<Mode, StructureError> {
        let omega_squared = self.shift + pair.theta.recip();
        let mut u = DVector::zeros(self.vibration.n_displacements());
        for (v, weight) in self.basis.iter().zip(pair.weights.iter()) {
            u.axpy(*weight, v, 1.0);
        }
        let inertia = self.vibration.mass_times(&u);
        let p = self.shifted.solve(&inertia)?.1 / pair.theta;
        let residual = self.vibration.imbalance(omega_squared, &u, &p).norm() * pair.theta.abs()
            / inertia.norm();
        Ok(Mode {
            omega_squared,
            shape: u.as_slice().to_vec(),
            multipliers: p.as_slice().to_vec(),
            residual,
        })
    }
}
