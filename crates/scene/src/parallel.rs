//! Execution of independent jobs in several threads.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Applies `f` to every item on at most `n_threads` threads, including the calling thread. The results are in the same
/// order as the items. If the system cannot start all threads, the threads that did start compute all items.
pub fn map<T: Sync, R: Send>(
    items: &[T],
    n_threads: NonZeroUsize,
    f: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<Option<R>>> = Mutex::new(items.iter().map(|_| None).collect());
    let worker = || {
        while let Some((i, item)) = {
            let i = next.fetch_add(1, Ordering::Relaxed);
            items.get(i).map(|item| (i, item))
        } {
            let result = f(item);
            results.lock().expect("no thread panics while holding the lock")[i] = Some(result);
        }
    };
    thread::scope(|scope| {
        for _ in 1..n_threads.get().min(items.len()) {
            if thread::Builder::new().spawn_scoped(scope, worker).is_err() {
                break;
            }
        }
        worker();
    });
    let results = results.into_inner().expect("all threads have ended");
    results.into_iter().map(|result| result.expect("each item is taken by one thread")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_items() {
        let items: Vec<u32> = (0..100).collect();
        let three = NonZeroUsize::new(3).unwrap();
        let squares: Vec<u32> = items.iter().map(|i| i * i).collect();
        assert_eq!(map(&items, three, |i| i * i), squares);
        assert!(map(&[] as &[u32], three, |i| *i).is_empty());
    }
}
