//! Role of rank 0, which integrates and sends commands to the other ranks.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::call::{self, Command, Words};
use crate::ffi::World;

/// Connection from rank 0 to the other ranks.
#[derive(Debug)]
pub(crate) struct Leader {
    size: usize,
    /// `None` after the session of the other ranks has ended.
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

    /// Releases the connection. No further commands can be sent afterward.
    pub(crate) fn release(&self) -> Option<World> {
        self.lock().take()
    }

    fn lock(&self) -> MutexGuard<'_, Option<World>> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a command to the other ranks. The caller must then do the part of rank 0.
    pub(crate) fn send(&self, command: Command, words: Words) {
        self.with_world(|world| call::send(world, command, words, [None; 6]));
    }

    /// Returns whether the other ranks are still running.
    pub(crate) fn has_world(&self) -> bool {
        self.lock().is_some()
    }

    /// # Panics
    /// Panics if the session has ended.
    pub(crate) fn with_world<R>(&self, work: impl FnOnce(&World) -> R) -> R {
        let world = self.lock();
        work(world.as_ref().expect("runs end before their session"))
    }
}
