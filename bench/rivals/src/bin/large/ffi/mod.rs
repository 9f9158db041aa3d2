//! C interface to MUMPS, which is used only for comparison.

use std::ffi::c_int;

use anyhow::{Result, ensure};

use myovib_sparse::{Kind, Scalar};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::solver::Solver;

unsafe extern "C" {
    fn give_back();
}

/// Returns freed memory to the operating system.
pub fn trim() {
    // SAFETY: the function has no arguments and may be called at any time.
    unsafe { give_back() };
}

/// Functions of `mumps.c` for one scalar type.
pub struct Functions<T> {
    size: unsafe extern "C" fn() -> usize,
    begin:
        unsafe extern "C" fn(*mut u64, c_int, c_int, i64, *mut c_int, *mut c_int, *mut T) -> c_int,
    factor: unsafe extern "C" fn(*mut u64) -> c_int,
    solve: unsafe extern "C" fn(*mut u64, *mut T) -> c_int,
    memory: unsafe extern "C" fn(*mut u64) -> c_int,
    entries: unsafe extern "C" fn(*mut u64) -> c_int,
    end: unsafe extern "C" fn(*mut u64),
}

macro_rules! functions {
    ($number:ty, $size:ident, $begin:ident, $factor:ident, $solve:ident, $memory:ident, $entries:ident, $end:ident) => {
        unsafe extern "C" {
            fn $size() -> usize;
            fn $begin(
                run: *mut u64,
                symmetric: c_int,
                n: c_int,
                nnz: i64,
                rows: *mut c_int,
                columns: *mut c_int,
                values: *mut $number,
            ) -> c_int;
            fn $factor(run: *mut u64) -> c_int;
            fn $solve(run: *mut u64, rhs: *mut $number) -> c_int;
            fn $memory(run: *mut u64) -> c_int;
            fn $entries(run: *mut u64) -> c_int;
            fn $end(run: *mut u64);
        }
        impl Rival for $number {
            const MUMPS: Functions<Self> = Functions {
                size: $size,
                begin: $begin,
                factor: $factor,
                solve: $solve,
                memory: $memory,
                entries: $entries,
                end: $end,
            };
        }
    };
}

functions!(
    f64,
    dmumps_run_size,
    dmumps_run_begin,
    dmumps_run_factor,
    dmumps_run_solve,
    dmumps_run_memory,
    dmumps_run_entries,
    dmumps_run_end
);
functions!(
    Complex64,
    zmumps_run_size,
    zmumps_run_begin,
    zmumps_run_factor,
    zmumps_run_solve,
    zmumps_run_memory,
    zmumps_run_entries,
    zmumps_run_end
);

/// Scalar type that MUMPS supports.
pub trait Rival: Scalar {
    const MUMPS: Functions<Self>;
}

/// Matrix that MUMPS factorizes.
pub struct Mumps<T: Rival> {
    run: Vec<u64>,
    n: usize,
    // MUMPS keeps pointers to these arrays.
    _rows: Vec<c_int>,
    _columns: Vec<c_int>,
    _values: Vec<T>,
}

impl<T: Rival> Mumps<T> {
    /// Creates the matrix and analyzes its pattern.
    pub fn new(pattern: &SparsityPattern, values: &[T], kind: Kind) -> Self {
        let lower = |&((c, r), _): &((usize, usize), &T)| kind == Kind::General || r >= c;
        let entries = pattern.entries().zip(values).filter(lower);
        let (mut rows, mut columns, mut own) = (Vec::new(), Vec::new(), Vec::new());
        for ((c, r), &value) in entries {
            rows.push(r as c_int + 1);
            columns.push(c as c_int + 1);
            own.push(value);
        }
        // SAFETY: the function has no arguments and returns a size.
        let size = unsafe { (T::MUMPS.size)() };
        let mut run = vec![0u64; size.div_ceil(8)];
        let symmetric = if kind == Kind::Symmetric { 2 } else { 0 };
        let n = pattern.major_dim();
        // SAFETY: `run` has the size of the structure; the arrays have nnz entries and live as long as the structure.
        let status = unsafe {
            (T::MUMPS.begin)(
                run.as_mut_ptr(),
                symmetric,
                n as c_int,
                own.len() as i64,
                rows.as_mut_ptr(),
                columns.as_mut_ptr(),
                own.as_mut_ptr(),
            )
        };
        assert_eq!(status, 0, "MUMPS analyzes");
        Self { run, n, _rows: rows, _columns: columns, _values: own }
    }
}

impl<T: Rival> Solver<T> for Mumps<T> {
    fn factor(&mut self) -> Result<()> {
        // SAFETY: the structure is initialized.
        let status = unsafe { (T::MUMPS.factor)(self.run.as_mut_ptr()) };
        ensure!(status == 0, "MUMPS cannot factorize: {status}");
        Ok(())
    }

    fn solve(&mut self, x: &mut [T]) -> Result<()> {
        assert_eq!(x.len(), self.n);
        // SAFETY: the structure has factors, and the vector has their order.
        let status = unsafe { (T::MUMPS.solve)(self.run.as_mut_ptr(), x.as_mut_ptr()) };
        ensure!(status == 0, "MUMPS cannot solve: {status}");
        Ok(())
    }

    fn n_bytes(&mut self) -> usize {
        // SAFETY: the structure has factors.
        unsafe { (T::MUMPS.memory)(self.run.as_mut_ptr()) as usize * 1_000_000 }
    }

    fn n_entries(&mut self) -> usize {
        // SAFETY: the structure has factors.
        match unsafe { (T::MUMPS.entries)(self.run.as_mut_ptr()) } {
            count @ 0.. => count as usize,
            millions => millions.unsigned_abs() as usize * 1_000_000,
        }
    }
}

impl<T: Rival> Drop for Mumps<T> {
    fn drop(&mut self) {
        // SAFETY: the structure is initialized and destroyed once.
        unsafe { (T::MUMPS.end)(self.run.as_mut_ptr()) };
    }
}
