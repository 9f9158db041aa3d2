//! Memory of this process as reported by Linux, so that all solvers are measured in the same way.

use std::fs;

use anyhow::{Context, Result};

/// Memory in use at the start of the measurement.
pub struct Count(usize);

impl Count {
    /// Resets the peak.
    pub fn begin() -> Result<Self> {
        give_back();
        fs::write("/proc/self/clear_refs", "5").context("/proc/self/clear_refs")?;
        Ok(Self(status("VmRSS:")?))
    }

    /// Returns the peak memory (bytes) since [`begin`](Self::begin) minus the memory at the start.
    pub fn peak(&self) -> Result<usize> {
        Ok(status("VmHWM:")?.saturating_sub(self.0))
    }
}

/// Returns freed memory to the operating system. Otherwise, later allocations would reuse this memory without being
/// counted.
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
