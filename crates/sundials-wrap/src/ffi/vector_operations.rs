//! The vector operations that IDAS calls most often. They replace the scalar operations of SUNDIALS.
//!
//! In SUNDIALS, the result may be one of the arguments; in Rust, a `&mut` slice must not overlap another slice.
//! Therefore, each operation first checks which vectors are identical and has a kernel for each case. Two vectors are
//! either identical or do not overlap, because every serial vector owns its entries.

use std::mem::MaybeUninit;
use std::os::raw::c_int;
use std::slice;

use sundials_sys::{N_VGetArrayPointer_Serial, N_VGetLength_Serial, N_Vector};

use super::vector_view::{view, view_mut};
use crate::vector_kernels as kernels;

/// Adds the operations of this module to the table of `vector`; clones inherit the table.
///
/// # Safety
/// `vector` is a valid serial vector to which nothing else refers.
pub(super) unsafe fn install(vector: N_Vector) {
    // SAFETY: guaranteed by the caller.
    let vector = unsafe { &mut *vector };
    // SAFETY: every serial vector owns a table of operations.
    let operations = unsafe { &mut *vector.ops };
    operations.nvlinearsum = Some(linear_sum);
    operations.nvconst = Some(constant);
    operations.nvscale = Some(scale);
    operations.nvabs = Some(absolute);
    operations.nvinv = Some(invert);
    operations.nvlinearcombination = Some(linear_combination);
    operations.nvwrmsnorm = Some(weighted_rms);
    operations.nvwrmsnormmask = Some(weighted_rms_masked);
}

/// Returns the entries of a vector that will be overwritten. They may be uninitialized.
///
/// # Safety
/// `vector` is a valid serial vector; nothing else reads or writes its entries during `'a`.
unsafe fn unwritten<'a>(vector: N_Vector) -> &'a mut [MaybeUninit<f64>] {
    // SAFETY: guaranteed by the caller.
    let length = unsafe { N_VGetLength_Serial(vector) } as usize;
    // SAFETY: as above.
    let data = unsafe { N_VGetArrayPointer_Serial(vector) }.cast::<MaybeUninit<f64>>();
    // SAFETY: a serial vector owns that many doubles; the caller guarantees exclusive access.
    unsafe { slice::from_raw_parts_mut(data, length) }
}

/// Computes z ← a x + b y.
///
/// # Safety
/// The conditions of the SUNDIALS operation apply: the serial vectors are valid and have equal lengths, `x` and `y` are
/// initialized, and no vector is used elsewhere during the call.
unsafe extern "C" fn linear_sum(a: f64, x: N_Vector, b: f64, y: N_Vector, z: N_Vector) {
    if x == y {
        // SAFETY: guaranteed by the caller.
        unsafe { scale(a + b, x, z) };
    } else if z == y {
        // SAFETY: x is initialized and is not the same vector as y.
        let x = unsafe { view(x) };
        // SAFETY: as above; y is borrowed only here.
        kernels::add_scaled(a, x, b, unsafe { view_mut(y) });
    } else if z == x {
        // SAFETY: y is initialized and is not the same vector as x.
        let y = unsafe { view(y) };
        // SAFETY: as above; x is borrowed only here.
        kernels::add_scaled(b, y, a, unsafe { view_mut(x) });
    } else {
        // SAFETY: x is initialized and is not the same vector as z.
        let x = unsafe { view(x) };
        // SAFETY: as above, for y.
        let y = unsafe { view(y) };
        // SAFETY: z is borrowed only here.
        kernels::linear_sum(a, x, b, y, unsafe { unwritten(z) });
    }
}

/// Computes z ← c.
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn constant(c: f64, z: N_Vector) {
    // SAFETY: z is borrowed only here.
    unsafe { unwritten(z) }.fill(MaybeUninit::new(c));
}

/// Computes z ← c x.
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn scale(c: f64, x: N_Vector, z: N_Vector) {
    if z == x {
        // SAFETY: x is initialized and borrowed only here.
        kernels::scale_in_place(c, unsafe { view_mut(x) });
    } else {
        // SAFETY: x is initialized and is not the same vector as z.
        let x = unsafe { view(x) };
        // SAFETY: z is borrowed only here.
        kernels::scale(c, x, unsafe { unwritten(z) });
    }
}

/// Computes z ← |x|.
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn absolute(x: N_Vector, z: N_Vector) {
    // SAFETY: guaranteed by the caller.
    unsafe { scale(1.0, x, z) };
    // SAFETY: z is already initialized and borrowed only here.
    kernels::absolute_in_place(unsafe { view_mut(z) });
}

/// Computes z_i ← 1/x_i.
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn invert(x: N_Vector, z: N_Vector) {
    // SAFETY: guaranteed by the caller.
    unsafe { scale(1.0, x, z) };
    // SAFETY: z is already initialized and borrowed only here.
    kernels::invert_in_place(unsafe { view_mut(z) });
}

/// Computes z ← Σ c_k x_k; z may be the first of the x.
///
/// # Safety
/// The conditions of [`linear_sum`] apply; `coefficients` and `vectors` point to `n` ≥ 1 entries each.
unsafe extern "C" fn linear_combination(
    n: c_int,
    coefficients: *mut f64,
    vectors: *mut N_Vector,
    z: N_Vector,
) -> c_int {
    // SAFETY: guaranteed by the caller.
    let c = unsafe { slice::from_raw_parts(coefficients, n as usize) };
    // SAFETY: guaranteed by the caller.
    let x = unsafe { slice::from_raw_parts(vectors, n as usize) };
    if n == 1 {
        // SAFETY: guaranteed by the caller.
        unsafe { scale(c[0], x[0], z) };
        return 0;
    }
    // SAFETY: guaranteed by the caller.
    unsafe { linear_sum(c[0], x[0], c[1], x[1], z) };
    for (&c, &x) in c.iter().zip(x).skip(2) {
        // SAFETY: guaranteed by the caller; z has been written already.
        unsafe { linear_sum(c, x, 1.0, z, z) };
    }
    0
}

/// Returns √(Σ (x w)² / n).
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn weighted_rms(x: N_Vector, w: N_Vector) -> f64 {
    // SAFETY: the vector is initialized and only read.
    let x = unsafe { view(x) };
    // SAFETY: as above.
    kernels::weighted_rms(x, unsafe { view(w) })
}

/// Returns √(Σ (x w)² / n), summed over the entries with a positive `id`.
///
/// # Safety
/// The conditions of [`linear_sum`] apply.
unsafe extern "C" fn weighted_rms_masked(x: N_Vector, w: N_Vector, id: N_Vector) -> f64 {
    // SAFETY: the vector is initialized and only read.
    let x = unsafe { view(x) };
    // SAFETY: as above.
    let w = unsafe { view(w) };
    // SAFETY: as above.
    kernels::weighted_rms_masked(x, w, unsafe { view(id) })
}

#[cfg(test)]
mod tests {
    use super::super::context::Context;
    use super::super::vector::NVector;
    use super::*;
    use crate::options::VectorArithmetic;

    /// Larger than the number of partial sums in a norm, and not a multiple of it.
    const N: usize = 75;

    fn wave(context: &Context, phase: f64) -> NVector {
        let values: Vec<f64> = (0..N).map(|i| (phase + i as f64).sin()).collect();
        NVector::from_slice(&values, context).unwrap()
    }

    #[test]
    fn a_constant_fills_the_vector() {
        let context = Context::new(VectorArithmetic::Simd).unwrap();
        let z = wave(&context, 0.0);
        // SAFETY: the vector is owned by the test.
        unsafe { constant(-0.7, z.raw()) };
        assert_eq!(z.as_slice(), [-0.7; N]);
    }

    /// Checks that a linear sum equals plain arithmetic for all cases of identical arguments.
    #[test]
    fn the_result_may_be_an_argument() {
        let context = Context::new(VectorArithmetic::Simd).unwrap();
        let (a, b) = (0.3, -1.7);
        for which in [[0, 1, 2], [0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]] {
            let vectors = [0.0, 1.0, 2.0].map(|phase| wave(&context, phase));
            let [x, y, z] = which.map(|k| &vectors[k]);
            let same = which[0] == which[1];
            let expected: Vec<f64> = x
                .as_slice()
                .iter()
                .zip(y.as_slice())
                .map(|(x, y)| if same { (a + b) * x } else { a * x + b * y })
                .collect();
            // SAFETY: the vectors are owned by the test and have equal lengths.
            unsafe { linear_sum(a, x.raw(), b, y.raw(), z.raw()) };
            assert_eq!(z.as_slice(), expected, "{which:?}");
        }
    }

    #[test]
    fn combinations_of_one_to_four_vectors() {
        let context = Context::new(VectorArithmetic::Simd).unwrap();
        let mut c = [0.3, -1.7, 2.5, 0.1];
        for n in 1..=4 {
            let vectors = [0.0, 1.0, 2.0, 3.0].map(|phase| wave(&context, phase));
            let expected: Vec<f64> =
                (0..N).map(|i| (0..n).map(|k| c[k] * vectors[k].as_slice()[i]).sum()).collect();
            let mut raw = vectors.each_ref().map(NVector::raw);
            let z = raw[0];
            // SAFETY: the n vectors are owned by the test, and the result is the first of them.
            unsafe { linear_combination(n as c_int, c.as_mut_ptr(), raw.as_mut_ptr(), z) };
            for (found, expected) in vectors[0].as_slice().iter().zip(&expected) {
                // Rounding errors of at most four terms below 3.
                assert!((found - expected).abs() < 12.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn norms_are_those_of_sundials() {
        use sundials_sys::{N_VWrmsNorm_Serial, N_VWrmsNormMask_Serial};
        let context = Context::new(VectorArithmetic::Simd).unwrap();
        let [x, w] = [0.0, 1.0].map(|phase| wave(&context, phase));
        let mut id = NVector::zeros(N, &context).unwrap();
        for (i, id) in id.as_mut_slice().iter_mut().enumerate() {
            *id = f64::from(i % 3 != 0);
        }
        let (x, w, id) = (x.raw(), w.raw(), id.raw());
        // SAFETY: the vectors are owned by the test and have equal lengths.
        let ours = [unsafe { weighted_rms(x, w) }, unsafe { weighted_rms_masked(x, w, id) }];
        // SAFETY: as above.
        let theirs =
            [unsafe { N_VWrmsNorm_Serial(x, w) }, unsafe { N_VWrmsNormMask_Serial(x, w, id) }];
        for (ours, theirs) in ours.into_iter().zip(theirs) {
            // Adding N positive terms in a different order causes a relative error of N ε in the sum, and half of this
            // error in the root.
            assert!((ours - theirs).abs() <= N as f64 * f64::EPSILON * theirs);
        }
    }
}
