//! The memory of this process as Linux counts it: the same account for all solvers.

use std::fs;

use anyhow::{Context, Result};

/// What was in use when counting began.
pub struct Count(usize);

impl Count {
    /// Forgets the peak so far.
    pub fn begin() -> Result<Self> {
        give_back();
        fs::write("/proc/self/clear_refs", "5").context("/proc/self/clear_refs")?;
        Ok(Self(status("VmRSS:")?))
    }

    /// The most that was in use since then beside what was, B.
    pub fn peak(&self) -> Result<usize> {
        Ok(status("VmHWM:")?.saturating_sub(self.0))
    }
}

/// Gives what was freed back to the system, or the next to allocate would get it unseen.
fn give_back() {
    #[cfg(feature = "mumps")]
    crate::ffi::trim();
}

fn status(name: &str) -> Result<usize> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let number = line.and_then(|line| line.trim().strip_suffix(" kB"));
    Ok(1024 * number.context("/proc/self/status")?.parse::<usize>()?)
}
