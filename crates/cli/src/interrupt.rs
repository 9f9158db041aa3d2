//! Ctrl-C, and SIGTERM and SIGHUP, which clusters send before they kill: the first ends runs in
//! good order, so that their output is kept; the second ends the program. What has no output before its
//! end is ended by the first.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit::Exit;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static AT_ONCE: AtomicBool = AtomicBool::new(false);
static INSTALLED: Once = Once::new();

/// Whether there was a signal that the flag was set by.
pub fn has_come() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Lets the first signal end the program: for what has no steps to end after, nor output to keep.
pub fn at_once() {
    AT_ONCE.store(true, Ordering::Relaxed);
}

/// The flag that the first signal sets, for `Limits` of a run. From the first call on, a signal no
/// longer ends the program at once.
pub fn flag() -> &'static AtomicBool {
    INSTALLED.call_once(|| {
        let handler = || {
            let before = INTERRUPTED.swap(true, Ordering::Relaxed);
            if before || AT_ONCE.load(Ordering::Relaxed) {
                std::process::exit(Exit::Interrupted as i32);
            }
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            eprintln!("warning: signals will lose the output of runs: {error}");
        }
    });
    &INTERRUPTED
}
