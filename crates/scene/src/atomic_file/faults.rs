//! Simulated disk failure, for tests of killed runs and of full disks.
//!
//! From the chosen operation on, all operations of this thread that change files fail, and temporary files remain. The
//! disk then has the same content as if the process had been killed at this operation.

use std::cell::Cell;
use std::io::{self, Write};

thread_local! {
    static CHANGES: Cell<u64> = const { Cell::new(0) };
    static LAST: Cell<u64> = const { Cell::new(u64::MAX) };
    static TORN: Cell<bool> = const { Cell::new(false) };
}

/// Runs `compute` on a simulated disk that fails after `last` operations. If `torn` is true, half of the bytes of the
/// failing write reach the disk. Also returns the number of attempted operations.
pub(crate) fn with_disk_that_stops_after<T>(
    last: u64,
    torn: bool,
    compute: impl FnOnce() -> T,
) -> (T, u64) {
    CHANGES.set(0);
    LAST.set(last);
    TORN.set(torn);
    let result = compute();
    LAST.set(u64::MAX);
    (result, CHANGES.get())
}

pub(super) fn allow() -> io::Result<()> {
    CHANGES.set(CHANGES.get() + 1);
    match CHANGES.get() > LAST.get() {
        true => Err(io::ErrorKind::StorageFull.into()),
        false => Ok(()),
    }
}

/// Writes half of the bytes of the first failing write.
pub(super) fn tear(file: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    if TORN.get() && CHANGES.get() == LAST.get() {
        file.write_all(&bytes[..bytes.len() / 2])?;
        file.flush()?;
    }
    Ok(())
}

pub(crate) fn has_stopped() -> bool {
    CHANGES.get() > LAST.get()
}
