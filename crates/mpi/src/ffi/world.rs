//! All processes of a run, as MPI sees them.

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

/// MPI, begun; there is one in a process. An error in MPI ends all processes with its message.
#[derive(Debug)]
pub(crate) struct World {
    rank: c_int,
    size: usize,
}

impl World {
    /// Begins MPI; to be called once.
    pub(crate) fn begin() -> Self {
        let (mut rank, mut size) = (0, 0);
        // SAFETY: both are places for an int; MPI has not been begun, for this is called once.
        unsafe { ranks_begin(&raw mut rank, &raw mut size) };
        let size = usize::try_from(size).expect("MPI has one rank at least");
        Self { rank, size }
    }

    /// The number of this process; 0 leads.
    pub(crate) fn rank(&self) -> usize {
        self.rank.unsigned_abs() as usize
    }

    /// Number of processes.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Sends numbers of rank 0 to all others, who [receive](Self::receive) as many.
    pub(crate) fn send(&self, numbers: &[f64]) {
        assert_eq!(self.rank, 0, "rank 0 sends");
        // SAFETY: the slice has as many numbers; MPI only reads those of rank 0.
        unsafe { ranks_broadcast(numbers.as_ptr().cast_mut(), numbers.len() as c_longlong) };
    }

    /// Receives what rank 0 sends.
    pub(crate) fn receive(&self, numbers: &mut [f64]) {
        assert_ne!(self.rank, 0, "rank 0 sends");
        // SAFETY: the slice has room for as many numbers.
        unsafe { ranks_broadcast(numbers.as_mut_ptr(), numbers.len() as c_longlong) };
    }

    /// At rank 0, replaces the numbers by their sums over all ranks, each of which calls this.
    pub(crate) fn sum(&self, numbers: &mut [f64]) {
        // SAFETY: the slice has as many numbers.
        unsafe { ranks_sum(numbers.as_mut_ptr(), numbers.len() as c_longlong, self.rank) };
    }

    /// What each rank has, at rank 0; nothing elsewhere.
    pub(crate) fn gather<const K: usize>(&self, own: [f64; K]) -> Vec<[f64; K]> {
        let n = if self.rank == 0 { self.size } else { 0 };
        let mut all = vec![[0.0; K]; n];
        // SAFETY: `own` has K numbers; `all`, which is read at rank 0 alone, has room there for K of
        // each rank.
        unsafe { ranks_gather(own.as_ptr(), K as c_int, all.as_mut_ptr().cast()) };
        all
    }

    /// Ends all processes.
    pub(crate) fn abort(&self, code: u8) {
        // SAFETY: MPI has begun, and not ended, for it ends when `self` is dropped.
        unsafe { ranks_abort(c_int::from(code)) };
    }
}

impl Drop for World {
    /// A process that ends in disorder takes all others with it: they would wait forever.
    fn drop(&mut self) {
        if thread::panicking() {
            self.abort(101);
        } else {
            // SAFETY: MPI has begun, and this is the only place that ends it.
            unsafe { ranks_end() };
        }
    }
}
