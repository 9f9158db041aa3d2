//! Limits of this process: threads and memory.
//!
//! The size of large factors follows from the pattern, long before they are computed. Checking it first gives an error
//! with both numbers; otherwise the system may kill the process in the middle of a run.

use std::fs;
use std::sync::{Arc, OnceLock};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::SparseError;

/// The thread pool for large factors.
static THREADS: OnceLock<Arc<ThreadPool>> = OnceLock::new();

/// Memory limit of this process in bytes.
static LIMIT: OnceLock<usize> = OnceLock::new();

/// Uses `threads` threads for large factors and for the assembly of large bodies. Results do not depend on the number.
///
/// Only the first call has an effect. By default, only the calling thread is used, which suits many concurrent runs.
///
/// # Errors
/// [`SparseError::Threads`] if the pool cannot be created.
pub fn use_threads(threads: usize) -> Result<(), SparseError> {
    if threads > 1 && THREADS.get().is_none() {
        let pool = pool_of(threads)?;
        THREADS.get_or_init(|| pool);
    }
    Ok(())
}

/// Returns whether more than one thread is in use.
pub fn uses_threads() -> bool {
    THREADS.get().is_some()
}

/// Returns the thread pool if there is more than one thread.
pub fn threads() -> Option<Arc<ThreadPool>> {
    THREADS.get().cloned()
}

pub(crate) fn pool_of(threads: usize) -> Result<Arc<ThreadPool>, SparseError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Arc::new).map_err(|error| SparseError::Threads {
        threads,
        reason: error.to_string(),
    })
}

/// Limits the memory of this process to `bytes`. Only the first call has an effect.
pub fn limit_memory(bytes: usize) {
    LIMIT.get_or_init(|| bytes);
}

/// Returns the memory in use in bytes, or `None` if the system does not report it.
pub fn in_use() -> Option<usize> {
    kibibytes("/proc/self/status", "VmRSS:")
}

/// Returns the peak memory of this process in bytes, or `None` if the system does not report it.
pub fn peak() -> Option<usize> {
    kibibytes("/proc/self/status", "VmHWM:")
}

/// Returns the memory available to this process in bytes: the minimum of the free memory of the machine, of its control
/// group (a container or a cluster job), of its address space (`ulimit -v`), of its data (`ulimit -d`) and of its limit.
/// `None` if no value is known.
pub fn available() -> Option<usize> {
    let own = LIMIT
        .get()
        .map(|limit| limit.saturating_sub(in_use().unwrap_or(0)));
    let machine = kibibytes("/proc/meminfo", "MemAvailable:");
    let address_space = below("Max address space", "VmSize:");
    let data = below("Max data size", "VmData:");
    let all = [own, machine, in_group(), address_space, data];
    all.into_iter().flatten().min()
}

/// Checks that the factors fit into memory. `n_complex` is the number of complex matrices.
///
/// # Errors
/// [`SparseError::Memory`] if `needed` bytes exceed [`available`].
pub fn expect_memory(needed: usize, n_complex: usize) -> Result<(), SparseError> {
    match available() {
        Some(available) if needed > available => Err(SparseError::Memory {
            needed,
            available,
            n_complex,
        }),
        _ => Ok(()),
    }
}

/// Reads the value of `name` in bytes from a file with lines such as `VmRSS:  17 kB`.
fn kibibytes(file: &str, name: &str) -> Option<usize> {
    let text = fs::read_to_string(file).ok()?;
    let value = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: usize = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * number)
}

/// Returns the memory left below a limit of the process; `used` is the memory that counts.
fn below(name: &str, used: &str) -> Option<usize> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let limit = limits.lines().find_map(|line| line.strip_prefix(name))?;
    let soft = limit.split_whitespace().next()?.parse::<usize>().ok()?; // "unlimited" means no limit
    Some(soft.saturating_sub(kibibytes("/proc/self/status", used)?))
}

/// Returns the memory left in the control group (version 2).
fn in_group() -> Option<usize> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let number = |name| {
        let text = fs::read_to_string(format!("/sys/fs/cgroup/{group}/{name}")).ok()?;
        text.trim().parse::<usize>().ok() // "max" means no limit
    };
    Some(number("memory.max")?.saturating_sub(number("memory.current")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_more_memory_than_is_available() {
        let available = available().expect("this system reports its free memory");
        assert!(in_use().unwrap() <= peak().unwrap());
        assert_eq!(expect_memory(0, 0), Ok(()));
        // The free memory cannot quadruple within a moment.
        let needed = available.saturating_mul(4);
        match expect_memory(needed, 0) {
            Err(SparseError::Memory { needed: n, .. }) => assert_eq!(n, needed),
            other => panic!("{other:?}"),
        }
    }

    /// Regression: the error of an equilibrium mentioned BDF and Radau IIA.
    #[test]
    fn mentions_integrators_only_for_complex_matrices() {
        let message = |n_complex| {
            let error = SparseError::Memory {
                needed: 3 << 20,
                available: 0,
                n_complex,
            };
            error.to_string()
        };
        assert!(message(0).contains("3.0 MiB") && message(0).contains("0 B"));
        assert!(message(0) != message(2) && message(2).starts_with(&message(0)));
    }
}
