//! Rank 0, which integrates and sends commands to the other ranks.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::call::{self, Command, Words};
use crate::ffi::World;

/// Rank 0's connection to the other ranks.
#[derive(Debug)]
pub(crate) struct Leader {
    size: usize,
    /// `None` once the other ranks have ended.
    world: Mutex<Option<World>>,
}

impl Leader {
    pub(crate) fn new(world: World) -> Self {
        Self { size: world.size(), world: Mutex::new(Some(world)) }
    }

    /// Returns the number of processes, including this one.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Releases the connection; no further commands can be sent.
    pub(crate) fn release(&self) -> Option<World> {
        self.lock().take()
    }

    fn lock(&self) -> MutexGuard<'_, Option<World>> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a command to the other ranks; this process must then do its own part.
    pub(crate) fn send(&self, command: Command, words: Words) {
        self.with_world(|world| call::send(world, command, words, [None; 6]));
    }

    /// Returns whether the other ranks are still running.
    pub(crate) fn has_world(&self) -> bool {
        self.lock().is_some()
    }

    /// # Panics
    /// Panics after the end of the session.
    pub(crate) fn with_world<R>(&self, work: impl FnOnce(&World) -> R) -> R {
        let world = self.lock();
        work(world.as_ref().expect("runs end before their session"))
    }
}
