//! Ctrl-C, and SIGTERM and SIGHUP, which clusters send before they kill: the first ends runs in
//! good order, so that their output is kept; the second ends the program. What has no output before its
//! end is ended by the first. SIGXFSZ, of a file that grows over a limit of the system, ends nothing: the
//! write fails as on a full disk.

use std::ffi::c_int;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Once};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

use crate::exit::Exit;
use crate::output;

/// The signals that ask for the end.
const ENDING: &[c_int] = &[
    SIGINT,
    SIGTERM,
    #[cfg(unix)]
    signal_hook::consts::SIGHUP,
];

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
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
        if let Err(error) = ENDING.iter().try_for_each(|&signal| end_by(signal)) {
            output::warn(&format!("signals will lose the output of runs: {error}"));
        }
    });
    &INTERRUPTED
}

/// Lets `signal` set the flag, and end the program if the flag was set before. The actions are taken in
/// the order in which they are registered.
fn end_by(signal: c_int) -> io::Result<()> {
    let code = Exit::Interrupted as i32;
    register_conditional_shutdown(signal, code, Arc::clone(&INTERRUPTED))?;
    register(signal, Arc::clone(&INTERRUPTED))?;
    register_conditional_shutdown(signal, code, Arc::clone(&AT_ONCE))?;
    Ok(())
}

/// Makes a write over the system's limit of a file's size an error, which names the file. It would end
/// the program.
pub fn outlive_large_files() {
    #[cfg(unix)]
    if let Err(error) = register(signal_hook::consts::SIGXFSZ, Arc::default()) {
        output::warn(&format!(
            "a limit of files' sizes will end the program: {error}"
        ));
    }
}
