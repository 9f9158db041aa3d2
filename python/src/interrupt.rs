//! Handling of signals and Python exceptions while Rust code runs without the GIL.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use myovib_scene::watch::{ProgressSink, Watcher};
use pyo3::prelude::*;

/// Time between two checks for signals.
const EVERY: Duration = Duration::from_millis(50);

/// Minimum time between two progress lines.
const PROGRESS_EVERY: Duration = Duration::from_millis(200);

/// Currently unused flags. As flags are reused, their total number is the maximum number of simultaneous computations.
static FREE: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

/// Flag of one computation, which is returned to the list of unused flags when it is dropped.
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

/// Calls a Python function with progress lines, at most once every 200 ms except through
/// [`report_now`](ProgressSink::report_now). If the function raises an exception, the computation ends.
struct Progress {
    show: Option<Py<PyAny>>,
    interrupt: &'static AtomicBool,
    last: Mutex<Option<Instant>>,
    raised: Mutex<Option<PyErr>>,
}

impl ProgressSink for Progress {
    fn on_progress(&self, line: &dyn Fn() -> String) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_some_and(|last| last.elapsed() < PROGRESS_EVERY) {
            return;
        }
        *last = Some(Instant::now());
        self.report_now(line);
    }

    fn report_now(&self, line: &dyn Fn() -> String) {
        let Some(show) = &self.show else { return };
        let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        if raised.is_none()
            && let Err(exception) = Python::attach(|py| show.call1(py, (line(),)))
        {
            self.interrupt.store(true, Ordering::Relaxed);
            *raised = Some(exception);
        }
    }
}

/// Runs `compute` in a separate thread without the GIL, and calls `show` with its progress.
///
/// If `show` or a signal handler (for example for Ctrl-C) raises an exception, the interrupt flag of the watcher is
/// set. `compute` must then end in an orderly way.
///
/// # Errors
/// Returns the exception that the handler or `show` raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    show: Option<Py<PyAny>>,
    compute: impl FnOnce(&'static AtomicBool, Watcher<'_>) -> T + Send,
) -> PyResult<T> {
    let flag = Flag::take();
    let progress =
        Progress { show, interrupt: flag.0, last: Mutex::new(None), raised: Mutex::new(None) };
    let (signal, result) = py.detach(|| {
        std::thread::scope(|scope| {
            let (done, ended) = channel::<()>();
            let worker = scope.spawn(|| {
                let _at_the_end = done;
                let watcher = Watcher { interrupt: Some(flag.0), progress: &progress };
                compute(flag.0, watcher)
            });
            let signal = wait(&ended);
            if signal.is_some() {
                flag.0.store(true, Ordering::Relaxed);
            }
            (signal, worker.join())
        })
    });
    let raised = progress.raised.into_inner();
    match (signal.or(raised.unwrap_or_else(PoisonError::into_inner)), result) {
        (Some(exception), _) => Err(exception),
        (None, Ok(result)) => Ok(result),
        (None, Err(panic)) => std::panic::resume_unwind(panic),
    }
}

/// Runs `compute`, which cannot be interrupted, in a separate thread without the GIL.
///
/// # Errors
/// Returns the exception that a signal handler raised. The thread then continues in the background, and its result is
/// dropped.
pub(crate) fn abandonable<T: Send + 'static>(
    py: Python<'_>,
    compute: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    py.detach(|| {
        let (done, ended) = channel::<()>();
        let worker = std::thread::spawn(move || {
            let _at_the_end = done;
            compute()
        });
        match wait(&ended) {
            Some(exception) => Err(exception),
            None => worker.join().or_else(|panic| std::panic::resume_unwind(panic)),
        }
    })
}

/// Waits until the sender is dropped or a signal handler raises an exception. Returns this exception.
fn wait(ended: &Receiver<()>) -> Option<PyErr> {
    while ended.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
        if let Err(exception) = Python::attach(|py| py.check_signals()) {
            return Some(exception);
        }
    }
    None
}
