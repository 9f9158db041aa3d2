//! Progress of a computation, reported on standard error.

use std::io::{self, IsTerminal};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use myovib_scene::plain;
use myovib_scene::watch::ProgressSink;

use crate::output;

/// Time between updates of the line on a terminal; in a log, time between lines.
const ON_TERMINAL: Duration = Duration::from_millis(100);
const IN_LOG: Duration = Duration::from_secs(10);

/// Progress line. On a terminal, the line is updated in place; in a log, lines are printed at intervals; if quiet,
/// nothing is printed. Several runs may share it.
#[derive(Debug)]
pub struct Progress {
    quiet: bool,
    on_terminal: bool,
    last: Mutex<Instant>,
}

impl Progress {
    /// Creates a progress line; nothing is printed yet.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, on_terminal: io::stderr().is_terminal(), last: Mutex::new(Instant::now()) }
    }

    /// Shows the text returned by `line` if enough time has passed since the previous update.
    pub fn show(&self, line: impl FnOnce() -> String) {
        let interval = if self.on_terminal { ON_TERMINAL } else { IN_LOG };
        // The thread of another run may be writing. In this case, this run writes at a later call.
        let Ok(mut last) = self.last.try_lock() else {
            return;
        };
        if last.elapsed() < interval {
            return;
        }
        *last = Instant::now();
        self.write(line);
    }

    /// Writes the text returned by `line`, unless quiet.
    fn write(&self, line: impl FnOnce() -> String) {
        if self.quiet {
            return;
        }
        if self.on_terminal {
            // Returns to the start of the line and clears the previous text.
            output::print_error(&format!("\r{}\x1b[K", plain(&line())));
        } else {
            output::line(&line());
        }
    }
}

impl ProgressSink for Progress {
    fn on_progress(&self, line: &dyn Fn() -> String) {
        self.show(line);
    }

    fn report_now(&self, line: &dyn Fn() -> String) {
        self.write(line);
    }
}

impl Drop for Progress {
    /// Clears the line if it is shown on a terminal.
    fn drop(&mut self) {
        if self.on_terminal && !self.quiet {
            output::print_error("\r\x1b[K");
        }
    }
}
