//! The threads and the memory that this process may take for large bodies.
//!
//! Large factors are known from the pattern long before they are computed. Who asks here first stops
//! with the number, instead of being killed by the system in the middle of a run.

use std::fs;
use std::sync::{Arc, OnceLock};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::SparseError;

/// The threads that large factors are computed in.
static THREADS: OnceLock<Arc<ThreadPool>> = OnceLock::new();

/// What this process may take in all, B.
static LIMIT: OnceLock<usize> = OnceLock::new();

/// Computes large factors, and passes over the elements of large bodies, in this many threads from
/// now on; results do not depend on the number.
/// The first number stays. Without one it is the calling thread alone, which is right where many
/// runs go side by side.
///
/// # Errors
/// [`SparseError::Threads`].
pub fn use_threads(threads: usize) -> Result<(), SparseError> {
    if threads > 1 && THREADS.get().is_none() {
        let pool = pool_of(threads)?;
        THREADS.get_or_init(|| pool);
    }
    Ok(())
}

/// Whether large factors are computed in more threads than the calling one.
pub fn uses_threads() -> bool {
    THREADS.get().is_some()
}

/// The threads that large bodies are worked on in, if there is more than one.
pub fn threads() -> Option<Arc<ThreadPool>> {
    THREADS.get().cloned()
}

/// Threads of their own.
pub(crate) fn pool_of(threads: usize) -> Result<Arc<ThreadPool>, SparseError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Arc::new).map_err(|error| SparseError::Threads {
        threads,
        reason: error.to_string(),
    })
}

/// Lets this process take `bytes` of memory in all. The first limit stays.
pub fn limit_memory(bytes: usize) {
    LIMIT.get_or_init(|| bytes);
}

/// What this process has in use, B; unknown where the system does not say.
pub fn in_use() -> Option<usize> {
    kibibytes("/proc/self/status", "VmRSS:")
}

/// The most this process had in use so far, B; unknown where the system does not say.
pub fn peak() -> Option<usize> {
    kibibytes("/proc/self/status", "VmHWM:")
}

/// What this process may take beside what it has, B: what is free on the machine, in the process's
/// control group (a container, a job of a cluster), and below its own limit. Unknown where nothing
/// says so.
pub fn available() -> Option<usize> {
    let own = LIMIT
        .get()
        .map(|limit| limit.saturating_sub(in_use().unwrap_or(0)));
    let machine = kibibytes("/proc/meminfo", "MemAvailable:");
    [own, machine, in_group()].into_iter().flatten().min()
}

/// Refuses factors that will not fit; `n_complex`: how many of the matrices are complex.
///
/// # Errors
/// [`SparseError::Memory`] when `needed` bytes are more than are [`available`].
pub fn expect_room(needed: usize, n_complex: usize) -> Result<(), SparseError> {
    match available() {
        Some(available) if needed > available => Err(SparseError::Memory {
            needed,
            available,
            n_complex,
        }),
        _ => Ok(()),
    }
}

/// The value behind `name` in a file of lines such as `VmRSS:  17 kB`, B.
fn kibibytes(file: &str, name: &str) -> Option<usize> {
    let text = fs::read_to_string(file).ok()?;
    let value = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: usize = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * number)
}

/// What is left in the control group (version 2).
fn in_group() -> Option<usize> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let number = |name| {
        let text = fs::read_to_string(format!("/sys/fs/cgroup/{group}/{name}")).ok()?;
        text.trim().parse::<usize>().ok() // "max" is no limit
    };
    Some(number("memory.max")?.saturating_sub(number("memory.current")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_fit_is_refused_with_both_numbers() {
        let available = available().expect("this system says what is free");
        assert!(in_use().unwrap() <= peak().unwrap());
        assert_eq!(expect_room(0, 0), Ok(()));
        // Four times what is free now cannot be free in a moment.
        let needed = available.saturating_mul(4);
        match expect_room(needed, 0) {
            Err(SparseError::Memory { needed: n, .. }) => assert_eq!(n, needed),
            other => panic!("{other:?}"),
        }
    }

    /// Regression: an equilibrium was told of BDF and Radau IIA, and of 0.0 MiB "to be had".
    #[test]
    fn only_complex_matrices_are_told_that_bdf_has_none() {
        let said = |n_complex| {
            let error = SparseError::Memory {
                needed: 3 << 20,
                available: 0,
                n_complex,
            };
            error.to_string()
        };
        assert!(said(0).contains("need 3.0 MiB") && said(0).contains("nothing is left"));
        assert!(!said(0).contains("BDF") && said(2).contains("BDF"));
    }
}
