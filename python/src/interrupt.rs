//! Ctrl-C while Rust computes without Python.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;

/// How often Python is asked for signals.
const EVERY: Duration = Duration::from_millis(50);

/// Flags that no run uses: as many as ever ran at a time.
static FREE: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

/// A flag for one run, given back when dropped.
struct Flag(&'static AtomicBool);

impl Flag {
    fn take() -> Self {
        let free = FREE.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Self(free.unwrap_or_else(|| Box::leak(Box::default())))
    }
}

impl Drop for Flag {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
        let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
        free.push(self.0);
    }
}

/// Computes in a thread of its own, without Python's lock. A signal whose handler raises, as that
/// of Ctrl-C does, sets the flag that `compute` is given, by which it must end in good order; the
/// exception is the result then.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    compute: impl FnOnce(&'static AtomicBool) -> T + Send,
) -> PyResult<T> {
    let flag = Flag::take();
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, ended) = channel::<()>();
            let worker = scope.spawn(|| {
                let _at_the_end = done;
                compute(flag.0)
            });
            let mut raised = None;
            while ended.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none()
                    && let Err(exception) = Python::attach(|py| py.check_signals())
                {
                    flag.0.store(true, Ordering::Relaxed);
                    raised = Some(exception);
                }
            }
            let result = worker.join();
            match (raised, result) {
                (Some(exception), _) => Err(exception),
                (None, Ok(result)) => Ok(result),
                (None, Err(panic)) => std::panic::resume_unwind(panic),
            }
        })
    })
}
