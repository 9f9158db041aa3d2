//! Role of all ranks except rank 0: they execute the commands of rank 0.

use std::collections::BTreeMap;

use myovib_fem::Solid;
use num_complex::Complex64;

use crate::call::{Call, Command};
use crate::ffi::{Matrix, MumpsScalar, World};
use crate::passes::{ending, fingerprint};

/// Process that executes the commands of rank 0.
#[derive(Debug)]
pub struct Follower {
    world: World,
}

/// Part of a matrix that this rank stores.
trait Part {
    fn do_part(&mut self, command: Command);
}

impl<T: MumpsScalar> Part for Matrix<T> {
    fn do_part(&mut self, command: Command) {
        match command {
            Command::Analyze => self.analyze(0, std::iter::empty()),
            Command::Factor => self.factor(),
            _ => self.solve(&mut []),
        }
    }
}

impl Follower {
    pub(crate) fn new(world: World) -> Self {
        Self { world }
    }

    /// Executes the commands of rank 0 until rank 0 ends the session. `load` loads the body when rank 0 requests it. If
    /// the body cannot be loaded, `load` prints the reason to standard error.
    pub fn serve(self, load: impl Fn() -> Option<Solid>) {
        let world = &self.world;
        let mut share: Option<Solid> = None;
        let mut results = Vec::new();
        let mut parts: BTreeMap<u64, Box<dyn Part>> = BTreeMap::new();
        loop {
            let call = Call::receive(world);
            let [number, symmetric, ..] = call.words;
            let (number, is_symmetric) = (number as u64, symmetric != 0.0);
            match call.command {
                Command::End => break,
                Command::Body => {
                    let whole = load();
                    world.gather(whole.as_ref().map_or([-1.0; 6], fingerprint));
                    share = whole.map(|whole| whole.share(world.rank(), world.size()));
                }
                Command::Pass => {
                    let solid = share.as_ref().expect("rank 0 sends the body first");
                    let own = solid.compute(&call.pass(), &mut results);
                    world.gather(ending(own));
                    results.iter_mut().for_each(|result| world.sum(result));
                }
                Command::Real => {
                    parts.insert(number, Box::new(Matrix::<f64>::new(is_symmetric)));
                }
                Command::Complex => {
                    parts.insert(number, Box::new(Matrix::<Complex64>::new(is_symmetric)));
                }
                Command::Forget => drop(parts.remove(&number)),
                Command::Analyze | Command::Factor | Command::Solve => parts
                    .get_mut(&number)
                    .expect("rank 0 creates a matrix before it uses it")
                    .do_part(call.command),
            }
        }
        // At this point, rank 0 has not destroyed these matrices either.
        std::mem::forget(parts);
    }
}
