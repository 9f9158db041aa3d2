//! Handling of signals: Ctrl-C, and SIGTERM and SIGHUP, which clusters send before they kill a process.
//!
//! By default, the first signal ends the program with code 130. A command that has requested the [`flag`] finishes in
//! an orderly way instead and keeps its output; only the second signal ends it immediately. SIGXFSZ, which the system
//! sends when a file exceeds a size limit, does not end the program: the write fails as on a full disk.

use std::ffi::c_int;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

use crate::exit::Exit;
use crate::output;

/// Signals that request the end of the program.
const ENDING: &[c_int] = &[
    SIGINT,
    SIGTERM,
    #[cfg(unix)]
    signal_hook::consts::SIGHUP,
];

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(AtomicBool::new(true)));

/// Returns whether a signal has been received.
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Returns the flag that the first signal sets, to be passed to the `Limits` of a run. After this function has been
/// called, the first signal no longer ends the program.
pub fn flag() -> &'static AtomicBool {
    AT_ONCE.store(false, Ordering::Relaxed);
    &INTERRUPTED
}

/// Installs handlers that end the program with the exit code of an interruption.
pub fn install() {
    if let Err(error) = ENDING.iter().try_for_each(|&signal| end_by(signal)) {
        output::warn(&format!(
            "cannot handle signals, so a signal that ends the program loses the output of the run: {error}"
        ));
    }
}

/// Installs a handler that sets the flag when `signal` arrives, or ends the program if the flag is already set. The
/// actions run in the order in which they are registered.
fn end_by(signal: c_int) -> io::Result<()> {
    let code = Exit::Interrupted as i32;
    register_conditional_shutdown(signal, code, Arc::clone(&INTERRUPTED))?;
    register(signal, Arc::clone(&INTERRUPTED))?;
    register_conditional_shutdown(signal, code, Arc::clone(&AT_ONCE))?;
    Ok(())
}

/// Ignores the signal for a write beyond the file size limit of the system. The write then returns an error that names
/// the file, whereas the signal would end the program.
pub fn ignore_file_size_signal() {
    #[cfg(unix)]
    if let Err(error) = register(signal_hook::consts::SIGXFSZ, Arc::default()) {
        output::warn(&format!(
            "cannot handle SIGXFSZ, so exceeding the file size limit will end the program: {error}"
        ));
    }
}
