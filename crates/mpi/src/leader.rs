//! Rank 0: it integrates, and tells the others what to do.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::call::{self, Command, Words};
use crate::ffi::World;

/// Rank 0's side of all that is done together.
#[derive(Debug)]
pub(crate) struct Leader {
    size: usize,
    /// None once the others have ended.
    world: Mutex<Option<World>>,
}

impl Leader {
    pub(crate) fn new(world: World) -> Self {
        Self {
            size: world.size(),
            world: Mutex::new(Some(world)),
        }
    }

    /// Number of processes, this one included.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// The others, whom nothing reaches from then on.
    pub(crate) fn release(&self) -> Option<World> {
        self.lock().take()
    }

    fn lock(&self) -> MutexGuard<'_, Option<World>> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells the others what to do; what this process has its part in follows.
    pub(crate) fn tell(&self, command: Command, words: Words) {
        self.with_world(|world| call::send(world, command, words, [None; 6]));
    }

    /// Whether the others are still there.
    pub(crate) fn has_world(&self) -> bool {
        self.lock().is_some()
    }

    /// # Panics
    /// Once the session has ended.
    pub(crate) fn with_world<R>(&self, work: impl FnOnce(&World) -> R) -> R {
        let world = self.lock();
        work(world.as_ref().expect("runs end before their session"))
    }
}
