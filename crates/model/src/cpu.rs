//! The CPU time of a computation.

use std::time::Duration;

use cpu_time::{ProcessTime, ThreadTime};
use myovib_sparse::resources;

/// A clock of CPU time that starts now: of the calling thread, as others may compute something else, or
/// of the whole process where its threads [factorise together](resources::use_threads).
#[derive(Debug, Clone, Copy)]
pub enum CpuClock {
    /// Of the calling thread.
    Thread(ThreadTime),
    /// Of the process.
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

    /// CPU time since the start.
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
    fn threads_that_factorise_together_are_counted() {
        // No other test of this program asks for threads.
        assert!(matches!(CpuClock::start(), CpuClock::Thread(_)));
        resources::use_threads(2).unwrap();
        assert!(matches!(CpuClock::start(), CpuClock::Process(_)));
    }
}
