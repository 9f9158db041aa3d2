//! The beginning and the end of what the ranks do together, and what rank 0 shares out.

use std::sync::Arc;
use std::thread;

use myovib_fem::Solid;
use myovib_sparse::engine::{self, Engine};

use crate::call::{self, Command};
use crate::crew::fingerprint;
use crate::factors::Mumps;
use crate::ffi::World;
use crate::follower::Follower;
use crate::leader::Leader;

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
    Role::Leads(Session(Arc::new(Leader::new(world))))
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
    /// passes are those of the whole. Matrices analyzed from now on are factorized by MUMPS.
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
        Ok(solid.with_crew(leader.clone(), leader.size()))
    }

    /// Who works, in one line.
    pub fn description(&self) -> String {
        let n = self.0.size();
        format!("{n} processes share the elements, MUMPS factorizes")
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let world = self.0.release();
        if let Some(world) = &world
            && !thread::panicking()
        {
            call::send(world, Command::End, [0.0; 4], [None; 6]);
        }
    }
}
