//! Rank 0: it integrates, and tells the others what to do.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use myovib_fem::Solid;
use myovib_sparse::engine::{self, Engine};

use crate::call::{self, Command, Words};
use crate::crew::fingerprint;
use crate::factors::Mumps;
use crate::ffi::World;
use crate::follower::Follower;

/// What this process is.
#[derive(Debug)]
pub enum Role {
    /// Rank 0.
    Leads(Session),
    /// Another.
    Follows(Follower),
}

/// Begins MPI; to be called once, by all processes that were started together.
pub fn begin() -> Role {
    let world = World::begin();
    if world.rank() > 0 {
        return Role::Follows(Follower::new(world));
    }
    Role::Leads(Session(Arc::new(Leader {
        size: world.size(),
        world: Mutex::new(Some(world)),
    })))
}

/// Rank 0's hold on the others: they end with it, in disorder if this process panics.
#[derive(Debug)]
pub struct Session(Arc<Leader>);

impl Session {
    /// What runs share out their work by, as long as the session lasts.
    pub fn sharing(&self) -> Sharing {
        Sharing(self.0.clone())
    }
}

/// Work that is shared out.
#[derive(Debug, Clone)]
pub struct Sharing(Arc<Leader>);

impl Sharing {
    /// Has the others read the body, of which they keep their shares; gives this process's share, whose
    /// passes are those of the whole. Matrices analysed from now on are factorised by MUMPS.
    ///
    /// # Errors
    /// A rank that cannot read the body, or reads another; it says why on standard error.
    ///
    /// # Panics
    /// After the end of the session.
    pub fn share(&self, solid: Solid) -> Result<Solid, String> {
        let leader = &self.0;
        leader.tell(Command::Body, [0.0; 4]);
        let bodies = leader.with_world(|world| world.gather(fingerprint(&solid)));
        if let Some(rank) = bodies.iter().position(|body| *body != bodies[0]) {
            return Err(format!(
                "rank {rank} does not read the body that rank 0 reads: all machines must see the same \
                 files, and run the same program"
            ));
        }
        let engine: Arc<dyn Engine> = Arc::new(Mumps::new(leader.clone()));
        engine::install(engine);
        Ok(solid.with_crew(leader.clone(), leader.size))
    }

    /// Who works, in one line.
    pub fn description(&self) -> String {
        let n = self.0.size;
        format!("{n} processes share the elements, MUMPS factorises")
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let world = self.0.lock().take();
        if let Some(world) = &world
            && !thread::panicking()
        {
            call::send(world, Command::End, [0.0; 4], [None; 6]);
        }
    }
}

/// Rank 0's side of all that is done together.
#[derive(Debug)]
pub(crate) struct Leader {
    /// Number of processes, this one included.
    size: usize,
    /// None once the others have ended.
    world: Mutex<Option<World>>,
}

impl Leader {
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
