//! Coefficients of matrices in a reduced Newton matrix.

use myovib_sparse::Scalar;

/// p_0 + p_1 c + p_2 c²: the coefficient of a matrix in a reduced Newton matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quadratic(pub(super) [f64; 3]);

impl Quadratic {
    pub(super) fn at<T: Scalar>(&self, c: T) -> T {
        let [p0, p1, p2] = self.0;
        T::one() * p0 + c * p1 + c * c * p2
    }
}
