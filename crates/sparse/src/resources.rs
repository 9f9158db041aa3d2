//! Limits of this process: threads and memory.
//!
//! The size of large factors is known from the pattern, long before the factors are computed. A check in advance
//! results in an error that states the required and the available memory. Without this check, the system may kill the
//! process in the middle of a run.

use std::fs;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::SparseError;

/// Thread pool for large factors.
static THREADS: OnceLock<Arc<ThreadPool>> = OnceLock::new();

/// Memory limit of this process in bytes.
static LIMIT: OnceLock<usize> = OnceLock::new();

/// Uses `threads` threads for large factors and for the assembly of large bodies. Results do not depend on the number
/// of threads.
///
/// Only the first call has an effect. By default, only the calling thread is used, which suits many concurrent runs.
///
/// # Errors
/// Returns [`SparseError::Threads`] if the pool cannot be created.
pub fn use_threads(threads: usize) -> Result<(), SparseError> {
    if threads > 1 && THREADS.get().is_none() {
        let pool = pool_of(threads)?;
        THREADS.get_or_init(|| pool);
    }
    Ok(())
}

/// Returns whether several threads are in use.
pub fn uses_threads() -> bool {
    THREADS.get().is_some()
}

/// Returns the thread pool, or `None` if only one thread is used.
pub fn threads() -> Option<Arc<ThreadPool>> {
    THREADS.get().cloned()
}

pub(crate) fn pool_of(threads: usize) -> Result<Arc<ThreadPool>, SparseError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Arc::new).map_err(|error| SparseError::Threads { threads, reason: error.to_string() })
}

/// Limits the memory of this process to `bytes`. Only the first call has an effect.
pub fn limit_memory(bytes: usize) {
    LIMIT.get_or_init(|| bytes);
}

/// Returns the memory used by this process in bytes, or `None` if the system does not report it.
pub fn in_use() -> Option<usize> {
    kibibytes("/proc/self/status", "VmRSS:")
}

/// Returns the peak memory of this process in bytes, or `None` if the system does not report it.
pub fn peak() -> Option<usize> {
    kibibytes("/proc/self/status", "VmHWM:")
}

/// Returns the memory available to this process in bytes. The result is the minimum of the free memory of the machine,
/// the free memory of the control groups of the process (a container or a cluster job), and the unused part of the
/// limits on the address space (`ulimit -v`), on data (`ulimit -d`) and by [`limit_memory`]. Returns `None` if none of
/// these values is known.
pub fn available() -> Option<usize> {
    let own = LIMIT.get().map(|limit| limit.saturating_sub(in_use().unwrap_or(0)));
    let machine = kibibytes("/proc/meminfo", "MemAvailable:");
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let group = groups.lines().find_map(|line| line.strip_prefix("0::"));
    let group = group.and_then(|group| in_group(Path::new("/sys/fs/cgroup"), group));
    let address_space = below("Max address space", "VmSize:");
    let data = below("Max data size", "VmData:");
    let all = [own, machine, group, address_space, data];
    all.into_iter().flatten().min()
}

/// Checks that factors of `needed` bytes fit into memory. `n_complex` is the number of complex matrices.
///
/// # Errors
/// Returns [`SparseError::Memory`] if `needed` exceeds the [`available`] memory.
pub fn expect_memory(needed: usize, n_complex: usize) -> Result<(), SparseError> {
    match available() {
        Some(available) if needed > available => {
            Err(SparseError::Memory { needed, available, n_complex })
        }
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

/// Returns the difference between a limit of the process and the amount `used` of the limited memory.
fn below(name: &str, used: &str) -> Option<usize> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let limit = limits.lines().find_map(|line| line.strip_prefix(name))?;
    let soft = limit.split_whitespace().next()?.parse::<usize>().ok()?; // "unlimited" means no limit
    Some(soft.saturating_sub(kibibytes("/proc/self/status", used)?))
}

/// Returns the free memory of a control group (version 2) below `root`: the minimum over the group and its ancestors.
fn in_group(root: &Path, group: &str) -> Option<usize> {
    let folder = root.join(group.trim_start_matches('/'));
    let groups = folder.ancestors().take_while(|one| one.starts_with(root));
    groups.filter_map(left_in).min()
}

/// Returns the free memory of one control group. File caches that the system can reclaim are counted as free.
fn left_in(group: &Path) -> Option<usize> {
    let text = |name| fs::read_to_string(group.join(name)).ok();
    let number = |text: &str| text.trim().parse::<usize>().ok(); // "max" means no limit
    let most = number(&text("memory.max")?)?;
    let used = number(&text("memory.current")?)?;
    let cache = text("memory.stat").and_then(|stat| {
        let mut lines = stat.lines();
        number(lines.find_map(|line| line.strip_prefix("inactive_file "))?)
    });
    Some(most.saturating_sub(used.saturating_sub(cache.unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_more_memory_than_is_available() {
        let available = available().expect("this system reports its free memory");
        assert!(in_use().unwrap() <= peak().unwrap());
        assert_eq!(expect_memory(0, 0), Ok(()));
        // The free memory cannot quadruple within a short time.
        let needed = available.saturating_mul(4);
        match expect_memory(needed, 0) {
            Err(SparseError::Memory { needed: n, .. }) => assert_eq!(n, needed),
            other => panic!("{other:?}"),
        }
    }

    /// Regression test: file caches were counted as used, and limits of parent groups were ignored.
    #[test]
    fn memory_of_control_groups_excludes_caches_and_includes_parents() {
        let root = tempfile::tempdir().unwrap();
        let write = |group: &str, [max, current, stat]: [&str; 3]| {
            let folder = root.path().join(group);
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join("memory.max"), format!("{max}\n")).unwrap();
            fs::write(folder.join("memory.current"), format!("{current}\n")).unwrap();
            fs::write(folder.join("memory.stat"), stat).unwrap();
        };
        let left = |group| in_group(root.path(), group);
        write("job/step", ["1000", "900", "anon 300\ninactive_file 600\n"]);
        assert_eq!(left("/job/step"), Some(700));
        write("job", ["800", "700", "inactive_file 50\n"]);
        assert_eq!(left("/job/step"), Some(150));
        write("job", ["max", "700", ""]);
        assert_eq!(left("/job/step"), Some(700));
        assert_eq!(left("/job"), None);
        write("", ["100", "200", ""]);
        assert_eq!([left("/job"), left("/")], [Some(0); 2]);
    }

    /// Regression test: the error message for an equilibrium mentioned BDF and Radau IIA.
    #[test]
    fn mentions_integrators_only_for_complex_matrices() {
        let message = |n_complex| {
            let error = SparseError::Memory { needed: 3 << 20, available: 0, n_complex };
            error.to_string()
        };
        assert!(message(0).contains("3.0 MiB") && message(0).contains("0 B"));
        assert!(message(0) != message(2) && message(2).starts_with(&message(0)));
    }
}
