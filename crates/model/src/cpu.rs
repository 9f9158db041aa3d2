//! CPU time of a computation.

use std::time::Duration;

use cpu_time::{ProcessTime, ThreadTime};
use myovib_sparse::resources;

/// A CPU clock. It measures the calling thread, or the whole process if its threads [factorize
/// together](resources::use_threads).
#[derive(Debug, Clone, Copy)]
pub enum CpuClock {
    /// Time of the calling thread.
    Thread(ThreadTime),
    /// Time of the process.
    Process(ProcessTime),
}

impl CpuClock {
    /// Starts the clock.
    pub fn start() -> Self {
        match resources::uses_threads() {
            true => Self::Process(ProcessTime::now()),
            false => Self::Thread(ThreadTime::now()),
        }
    }

    /// Returns the CPU time since the start.
    pub fn elapsed(&self) -> Duration {
        match self {
            Self::Thread(start) => start.elapsed(),
            Self::Process(start) => start.elapsed(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_factorize_together_are_counted() {
        // No other test in this binary requests threads.
        assert!(matches!(CpuClock::start(), CpuClock::Thread(_)));
        resources::use_threads(2).unwrap();
        assert!(matches!(CpuClock::start(), CpuClock::Process(_)));
    }
}
