//! Rows of several right-hand sides in vector registers.

use num_complex::Complex;

use crate::Number;

/// Entries of one row of several right-hand sides. All of them are multiplied by the same matrix entry. The row
/// contains one number or [several](Number::Columns).
pub trait Row<T>: Copy + Send + Sync + std::fmt::Debug {
    /// Returns a row of zeros.
    fn zeros() -> Self;

    /// Loads the row from the beginning of `row`.
    ///
    /// # Panics
    /// Panics if `row` has fewer entries than `Self`.
    fn load(row: &[T]) -> Self;

    /// Stores the row at the beginning of `row`.
    fn store(self, row: &mut [T]);

    /// Returns `self` + `other`.
    fn plus(self, other: Self) -> Self;

    /// Returns a · `self`.
    fn times(self, a: T) -> Self;

    /// Returns `self` − a x, using fused multiply-adds.
    fn minus_product(self, a: T, x: Self) -> Self;
}

impl<T: Number> Row<T> for T {
    #[inline(always)]
    fn zeros() -> Self {
        Self::zero()
    }

    #[inline(always)]
    fn load(row: &[T]) -> Self {
        row[0]
    }

    #[inline(always)]
    fn store(self, row: &mut [T]) {
        row[0] = self;
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn times(self, a: T) -> Self {
        self * a
    }

    #[inline(always)]
    fn minus_product(self, a: T, x: Self) -> Self {
        self.plus_product(a, -x)
    }
}

/// A row of `C` real numbers.
#[derive(Debug, Clone, Copy)]
pub struct Reals<F, const C: usize>([F; C]);

/// A row of `C` complex numbers: all real parts, then all imaginary parts.
#[derive(Debug, Clone, Copy)]
pub struct Complexes<F, const C: usize>([[F; C]; 2]);

impl<F: Number, const C: usize> Row<F> for Reals<F, C> {
    #[inline(always)]
    fn zeros() -> Self {
        Self([F::zero(); C])
    }

    #[inline(always)]
    fn load(row: &[F]) -> Self {
        let mut values = [F::zero(); C];
        values.copy_from_slice(&row[..C]);
        Self(values)
    }

    #[inline(always)]
    fn store(self, row: &mut [F]) {
        row[..C].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn plus(mut self, other: Self) -> Self {
        for c in 0..C {
            self.0[c] += other.0[c];
        }
        self
    }

    #[inline(always)]
    fn times(mut self, a: F) -> Self {
        for c in 0..C {
            self.0[c] *= a;
        }
        self
    }

    #[inline(always)]
    fn minus_product(mut self, a: F, x: Self) -> Self {
        for c in 0..C {
            self.0[c] = self.0[c].plus_product(a, -x.0[c]);
        }
        self
    }
}

impl<F: Number, const C: usize> Row<Complex<F>> for Complexes<F, C>
where
    Complex<F>: Number,
{
    #[inline(always)]
    fn zeros() -> Self {
        Self([[F::zero(); C]; 2])
    }

    #[inline(always)]
    fn load(row: &[Complex<F>]) -> Self {
        let mut values = Self::zeros();
        let [re, im] = &mut values.0;
        for ((re, im), x) in re.iter_mut().zip(im).zip(&row[..C]) {
            (*re, *im) = (x.re, x.im);
        }
        values
    }

    #[inline(always)]
    fn store(self, row: &mut [Complex<F>]) {
        let [re, im] = self.0;
        for ((re, im), x) in re.iter().zip(&im).zip(&mut row[..C]) {
            (x.re, x.im) = (*re, *im);
        }
    }

    #[inline(always)]
    fn plus(mut self, other: Self) -> Self {
        let parts = self.0.as_flattened_mut();
        for (own, &other) in parts.iter_mut().zip(other.0.as_flattened()) {
            *own += other;
        }
        self
    }

    #[inline(always)]
    fn times(self, a: Complex<F>) -> Self {
        Self::zeros().minus_product(-a, self)
    }

    #[inline(always)]
    fn minus_product(mut self, a: Complex<F>, x: Self) -> Self {
        // The real or imaginary parts of two columns do not fill a vector register.
        if C < 4 {
            let ([re, im], [x_re, x_im]) = (&mut self.0, x.0);
            for c in 0..C {
                re[c] = re[c].plus_product(a.re, -x_re[c]).plus_product(a.im, x_im[c]);
                im[c] = im[c].plus_product(a.re, -x_im[c]).plus_product(a.im, -x_re[c]);
            }
            return self;
        }
        // −i x.
        let mut turned = [x.0[1]; 2];
        for (turned, &re) in turned[1].iter_mut().zip(&x.0[0]) {
            *turned = -re;
        }
        let parts = self.0.as_flattened_mut();
        let (x, turned) = (x.0.as_flattened(), turned.as_flattened());
        for k in 0..2 * C {
            parts[k] = parts[k].plus_product(a.re, -x[k]).plus_product(a.im, turned[k]);
        }
        self
    }
}
