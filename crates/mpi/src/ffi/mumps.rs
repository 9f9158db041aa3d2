//! MUMPS matrix distributed over all ranks.

use std::ffi::{c_int, c_longlong};
use std::ptr;
use std::thread;

use myovib_sparse::Scalar;
use num_complex::Complex64;

/// Functions of `shim.c` for one scalar type.
#[derive(Debug)]
pub(crate) struct Functions<T> {
    size: unsafe extern "C" fn() -> c_longlong,
    begin: unsafe extern "C" fn(*mut u64, c_int) -> c_int,
    analyze: unsafe extern "C" fn(*mut u64, c_int, c_longlong, *mut c_int, *mut c_int) -> c_int,
    factor: unsafe extern "C" fn(*mut u64, *mut T) -> c_int,
    solve: unsafe extern "C" fn(*mut u64, *mut T, c_int) -> c_int,
    info: unsafe extern "C" fn(*const u64, c_int) -> c_int,
    end: unsafe extern "C" fn(*mut u64),
}

pub(crate) trait MumpsScalar: Scalar {
    const MUMPS: Functions<Self>;
    const IS_COMPLEX: bool;
}

macro_rules! functions {
    ($number:ty, $complex:literal, $size:ident, $begin:ident, $analyze:ident, $factor:ident, $solve:ident, $info:ident, $end:ident) => {
        unsafe extern "C" {
            fn $size() -> c_longlong;
            fn $begin(run: *mut u64, symmetric: c_int) -> c_int;
            fn $analyze(
                run: *mut u64,
                n: c_int,
                nnz: c_longlong,
                rows: *mut c_int,
                columns: *mut c_int,
            ) -> c_int;
            fn $factor(run: *mut u64, values: *mut $number) -> c_int;
            fn $solve(run: *mut u64, rhs: *mut $number, n: c_int) -> c_int;
            fn $info(run: *const u64, number: c_int) -> c_int;
            fn $end(run: *mut u64);
        }
        impl MumpsScalar for $number {
            const IS_COMPLEX: bool = $complex;
            const MUMPS: Functions<Self> = Functions {
                size: $size,
                begin: $begin,
                analyze: $analyze,
                factor: $factor,
                solve: $solve,
                info: $info,
                end: $end,
            };
        }
    };
}

functions!(
    f64,
    false,
    dmumps_run_size,
    dmumps_run_begin,
    dmumps_run_analyze,
    dmumps_run_factor,
    dmumps_run_solve,
    dmumps_run_info,
    dmumps_run_end
);
functions!(
    Complex64,
    true,
    zmumps_run_size,
    zmumps_run_begin,
    zmumps_run_analyze,
    zmumps_run_factor,
    zmumps_run_solve,
    zmumps_run_info,
    zmumps_run_end
);

/// Entries of a matrix at rank 0 (all entries or the lower triangle), with one-based indices; empty on other ranks.
#[derive(Debug)]
struct Entries<T> {
    n: c_int,
    rows: Vec<c_int>,
    columns: Vec<c_int>,
    values: Vec<T>,
}

/// Matrix and its factors. All ranks call the same methods in the same order. Array arguments are empty except at rank
/// 0.
#[derive(Debug)]
pub(crate) struct Matrix<T: MumpsScalar> {
    /// Structure of MUMPS, which must not move in memory.
    run: Vec<u64>,
    /// MUMPS keeps pointers to these arrays.
    entries: Entries<T>,
    status: c_int,
}

impl<T: MumpsScalar> Matrix<T> {
    /// Creates a matrix. MPI must be initialized.
    pub(crate) fn new(is_symmetric: bool) -> Self {
        // SAFETY: the function has no arguments and returns a size.
        let size = unsafe { (T::MUMPS.size)() };
        let mut run = vec![0u64; (size.unsigned_abs() as usize).div_ceil(8)];
        // SAFETY: `run` has the size of the structure that the function initializes.
        let status = unsafe { (T::MUMPS.begin)(run.as_mut_ptr(), c_int::from(is_symmetric)) };
        Self {
            run,
            entries: Entries { n: 0, rows: Vec::new(), columns: Vec::new(), values: Vec::new() },
            status,
        }
    }

    /// Returns the status of the last call, which is negative for an error, and the detail of the error.
    pub(crate) fn status(&self) -> [i32; 2] {
        [self.status, self.info(2)]
    }

    /// Returns INFOG(`number`).
    pub(crate) fn info(&self, number: c_int) -> i32 {
        assert!((1..=80).contains(&number), "INFOG has 80 numbers");
        // SAFETY: the structure is initialized, and the index is within the array.
        unsafe { (T::MUMPS.info)(self.run.as_ptr(), number) }
    }

    /// Analyzes the pattern of the matrix. `places` contains the zero-based row and column of each entry.
    pub(crate) fn analyze(&mut self, n: usize, places: impl Iterator<Item = (usize, usize)>) {
        let narrow =
            |k: usize| c_int::try_from(k).expect("the number of unknowns fits into an int");
        let (rows, columns) =
            places.map(|(row, column)| (narrow(row + 1), narrow(column + 1))).unzip();
        self.entries.n = narrow(n);
        self.entries.rows = rows;
        self.entries.columns = columns;
        self.entries.values = vec![T::zero(); self.entries.rows.len()];
        let (n, nnz) = (self.entries.n, self.entries.rows.len() as c_longlong);
        let [rows, columns] = [&mut self.entries.rows, &mut self.entries.columns]
            .map(|indices| if indices.is_empty() { ptr::null_mut() } else { indices.as_mut_ptr() });
        // SAFETY: the structure is initialized. At rank 0, both arrays have nnz indices from 1 to n and stay unchanged
        // until the structure is destroyed; on other ranks MUMPS does not read them.
        self.status = unsafe { (T::MUMPS.analyze)(self.run.as_mut_ptr(), n, nnz, rows, columns) };
    }

    /// Returns the values in the order of the analyzed entries. They must be set before [`factor`](Self::factor) is
    /// called.
    pub(crate) fn values_mut(&mut self) -> &mut [T] {
        &mut self.entries.values
    }

    /// Factorizes the matrix.
    pub(crate) fn factor(&mut self) {
        let values = self.entries.values.as_mut_ptr();
        // SAFETY: the structure is initialized, and MUMPS rejects it without analysis. At rank 0, there are as many
        // values as entries, and they stay valid until the structure is destroyed; on other ranks MUMPS does not read
        // them.
        self.status = unsafe { (T::MUMPS.factor)(self.run.as_mut_ptr(), values) };
    }

    /// Solves in place. At rank 0, `x` is the right-hand side; on other ranks, it is empty.
    pub(crate) fn solve(&mut self, x: &mut [T]) {
        assert_eq!(x.len(), self.entries.n as usize, "length of the right-hand side");
        // SAFETY: the structure is initialized, and MUMPS rejects it without factors. At rank 0, the length of the
        // vector is the order of the matrix; on other ranks MUMPS does not read it.
        self.status =
            unsafe { (T::MUMPS.solve)(self.run.as_mut_ptr(), x.as_mut_ptr(), self.entries.n) };
    }
}

impl<T: MumpsScalar> Drop for Matrix<T> {
    fn drop(&mut self) {
        if thread::panicking() {
            return; // The other ranks are executing a different call, and all processes are about to end.
        }
        // SAFETY: the structure is initialized and destroyed once; its owners ensure that MPI has not ended.
        unsafe { (T::MUMPS.end)(self.run.as_mut_ptr()) };
    }
}
