//! The processes of a distributed run.

use std::ffi::{c_int, c_longlong};
use std::thread;

unsafe extern "C" {
    fn ranks_begin(rank: *mut c_int, size: *mut c_int);
    fn ranks_broadcast(numbers: *mut f64, n: c_longlong);
    fn ranks_sum(numbers: *mut f64, n: c_longlong, rank: c_int);
    fn ranks_gather(own: *const f64, n: c_int, all: *mut f64);
    fn ranks_abort(code: c_int);
    fn ranks_end();
}

/// Initialized MPI environment; a process has only one. After an MPI error, MPI prints its message and terminates all
/// processes.
#[derive(Debug)]
pub(crate) struct World {
    rank: c_int,
    size: usize,
}

impl World {
    /// Initializes MPI; must be called only once.
    pub(crate) fn begin() -> Self {
        let (mut rank, mut size) = (0, 0);
        // SAFETY: both pointers are to ints; MPI is not initialized yet, since this function is called once.
        unsafe { ranks_begin(&raw mut rank, &raw mut size) };
        let size = usize::try_from(size).expect("MPI has at least one rank");
        Self { rank, size }
    }

    /// Returns the rank of this process; rank 0 is the leader.
    pub(crate) fn rank(&self) -> usize {
        self.rank.unsigned_abs() as usize
    }

    /// Returns the number of processes.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Broadcasts numbers from rank 0 to all other ranks, which must [receive](Self::receive) the same number of
    /// values.
    pub(crate) fn send(&self, numbers: &[f64]) {
        assert_eq!(self.rank, 0, "rank 0 sends");
        // SAFETY: the length is the length of the slice; MPI only reads the numbers of rank 0.
        unsafe { ranks_broadcast(numbers.as_ptr().cast_mut(), numbers.len() as c_longlong) };
    }

    /// Receives numbers from rank 0.
    pub(crate) fn receive(&self, numbers: &mut [f64]) {
        assert_ne!(self.rank, 0, "rank 0 sends");
        // SAFETY: the length is the length of the slice.
        unsafe { ranks_broadcast(numbers.as_mut_ptr(), numbers.len() as c_longlong) };
    }

    /// Sums the numbers over all ranks and stores the sums at rank 0. All ranks must call this method.
    pub(crate) fn sum(&self, numbers: &mut [f64]) {
        // SAFETY: the length is the length of the slice.
        unsafe { ranks_sum(numbers.as_mut_ptr(), numbers.len() as c_longlong, self.rank) };
    }

    /// Gathers the numbers of all ranks at rank 0. Returns an empty vector on other ranks.
    pub(crate) fn gather<const K: usize>(&self, own: [f64; K]) -> Vec<[f64; K]> {
        let n = if self.rank == 0 { self.size } else { 0 };
        let mut all = vec![[0.0; K]; n];
        // SAFETY: `own` has K numbers; `all` is written only at rank 0, where it has K numbers for each rank.
        unsafe { ranks_gather(own.as_ptr(), K as c_int, all.as_mut_ptr().cast()) };
        all
    }

    /// Terminates all processes.
    pub(crate) fn abort(&self, code: u8) {
        // SAFETY: MPI is initialized, and it ends only when `self` is dropped.
        unsafe { ranks_abort(c_int::from(code)) };
    }
}

impl Drop for World {
    /// After a panic, terminates all other processes, because they would wait forever.
    fn drop(&mut self) {
        if thread::panicking() {
            self.abort(101);
        } else {
            // SAFETY: MPI is initialized, and only this function finalizes it.
            unsafe { ranks_end() };
        }
    }
}
