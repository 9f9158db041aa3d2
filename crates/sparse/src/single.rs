//! Factors in single precision: half the memory and about half the time of double precision.

use std::sync::Arc;

use crate::product::Product;
use crate::supernodal::Supernodal;
use crate::{Factorization, Scalar, SparseError};

/// Number of equilibration passes. Each pass scales by the inverse square root of the largest entry of each row, so
/// that a ratio of 10¹² becomes less than 32.
const EQUILIBRATION_PASSES: usize = 3;

/// Supernodal factors of D A D in single precision. The diagonal matrix D makes the largest entry of each row and
/// column about 1 (Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices, 2001). Without
/// scaling, the entries of a nearly incompressible body would exceed the exponent range of single precision.
///
/// Solutions have about six correct digits if D A D is well conditioned. The caller checks and refines them.
#[derive(Debug)]
pub(crate) struct SingleFactors<T: Scalar> {
    product: Arc<Product>,
    factors: Supernodal<T::Single>,
    values: Vec<T::Single>,
    /// Diagonal of D, powers of 2.
    scale: Vec<f64>,
    largest: Vec<f64>,
    rhs: Vec<T::Single>,
}

impl<T: Scalar> SingleFactors<T> {
    /// Allocates factors for a matrix with `n` rows and `n_entries` entries.
    pub(crate) fn new(
        product: Arc<Product>,
        n: usize,
        n_entries: usize,
        factors: Supernodal<T::Single>,
    ) -> Self {
        Self {
            factors,
            values: vec![T::zero().to_single(); n_entries],
            scale: vec![1.0; n],
            largest: vec![0.0; n],
            rhs: Vec::new(),
            product,
        }
    }

    /// Computes D.
    fn equilibrate(&mut self, values: &[T]) {
        let Self { scale, largest, .. } = self;
        scale.fill(1.0);
        for _ in 0..EQUILIBRATION_PASSES {
            largest.fill(0.0);
            self.product.for_each_entry(|k, row, column| {
                let value = values[k];
                let size =
                    f64::max(value.re().abs(), value.im().abs()) * scale[row] * scale[column];
                largest[row] = largest[row].max(size);
                largest[column] = largest[column].max(size);
            });
            for (scale, &largest) in scale.iter_mut().zip(&*largest) {
                if largest > 0.0 && largest.is_finite() {
                    *scale *= (-0.5 * largest.log2()).round().exp2();
                }
            }
        }
    }

    /// Scales the right-hand side to a maximum of about 1, and solves.
    fn run(&mut self, x: &mut [T], solve: impl Fn(&mut Supernodal<T::Single>, &mut [T::Single])) {
        let entries = x.iter().zip(&self.scale);
        let largest = entries.fold(0.0, |max, (b, d)| f64::max(max, b.abs() * d));
        let size = match largest > 0.0 && largest.is_finite() {
            true => largest.log2().round().exp2(),
            false => 1.0,
        };
        self.rhs.clear();
        let scaled = x.iter().zip(&self.scale);
        self.rhs.extend(scaled.map(|(&b, d)| (b * (d / size)).to_single()));
        solve(&mut self.factors, &mut self.rhs);
        for ((x, &single), d) in x.iter_mut().zip(&self.rhs).zip(&self.scale) {
            *x = T::from_single(single) * (d * size);
        }
    }
}

impl<T: Scalar> Factorization<T> for SingleFactors<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.equilibrate(values);
        let Self { values: single, scale, .. } = self;
        self.product.for_each_entry(|k, row, column| {
            single[k] = (values[k] * (scale[row] * scale[column])).to_single();
        });
        self.factors.factor(single)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.run(x, Supernodal::solve);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.run(x, Supernodal::solve_transposed);
        Ok(())
    }

    fn n_entries(&self) -> Option<usize> {
        Some(self.factors.n_factors())
    }
}
