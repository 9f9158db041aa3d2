//! Start and end of a distributed session, and the distribution of work by rank 0.

use std::sync::Arc;
use std::thread;

use myovib_fem::Solid;
use myovib_sparse::engine::{self, Engine};

use crate::call::{self, Command};
use crate::factors::Mumps;
use crate::ffi::World;
use crate::follower::Follower;
use crate::leader::Leader;
use crate::passes::fingerprint;

/// Role of this process.
#[derive(Debug)]
pub enum Role {
    /// Rank 0.
    Leads(Session),
    /// Any other rank.
    Follows(Follower),
}

/// Initializes MPI. All processes that were started together must call this function exactly once.
pub fn begin() -> Role {
    let world = World::begin();
    if world.rank() > 0 {
        return Role::Follows(Follower::new(world));
    }
    Role::Leads(Session(Arc::new(Leader::new(world))))
}

/// Session of rank 0. When it is dropped, the other ranks end; if this process panics, they are aborted.
#[derive(Debug)]
pub struct Session(Arc<Leader>);

impl Session {
    /// Returns a handle with which runs can distribute their work during the session.
    pub fn sharing(&self) -> Sharing {
        Sharing(self.0.clone())
    }
}

/// Handle with which a run distributes its work.
#[derive(Debug, Clone)]
pub struct Sharing(Arc<Leader>);

impl Sharing {
    /// Distributes the elements: the other ranks load the body and keep their shares. Returns the share of this
    /// process. Passes over this share return the sums over all ranks. Matrices analyzed afterward are
    /// factorized by MUMPS.
    ///
    /// # Errors
    /// Returns an error if a rank cannot load the body or loads a different body. A rank that cannot load the body
    /// prints the reason to standard error.
    ///
    /// # Panics
    /// Panics if the session has ended.
    pub fn share(&self, solid: Solid) -> Result<Solid, String> {
        let leader = &self.0;
        leader.send(Command::Body, [0.0; 4]);
        let bodies = leader.with_world(|world| world.gather(fingerprint(&solid)));
        if let Some(rank) = bodies.iter().position(|body| *body != bodies[0]) {
            return Err(format!(
                "rank {rank} does not load the same body as rank 0: all machines must access the same files \
                 and run the same program"
            ));
        }
        let engine: Arc<dyn Engine> = Arc::new(Mumps::new(leader.clone()));
        engine::install(engine);
        Ok(solid.with_assembler(leader.clone(), leader.size()))
    }

    /// Describes in one line how the elements are distributed.
    pub fn description(&self) -> String {
        let n = self.0.size();
        format!("{n} processes share the elements; MUMPS factorizes")
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
