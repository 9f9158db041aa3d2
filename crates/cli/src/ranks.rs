//! A run by the processes that `mpirun` or `srun` started together, in a program with the feature
//! `mpi`: rank 0 is the program, the others lend it a hand.

#[cfg(not(feature = "mpi"))]
pub use alone::{main, share};
#[cfg(feature = "mpi")]
pub use together::{main, share};

#[cfg(not(feature = "mpi"))]
mod alone {
    use std::env;
    use std::process::ExitCode;

    use myovib_scene::Scene;

    use crate::exit::Exit;
    use crate::output;

    /// Where launchers say how many processes they have started: Open MPI, and those that speak PMI.
    const SIZES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

    /// The program, which is `command`.
    pub fn main(command: impl FnOnce() -> ExitCode, _: impl Fn() -> Option<Scene>) -> ExitCode {
        let several = |name: &&str| env::var(name).is_ok_and(|size| size != "1");
        if SIZES.iter().any(several) {
            output::line(
                "error: several processes were started, but this program was built for one: build it \
                 with `--features mpi`, or start one",
            );
            return Exit::Usage.into();
        }
        command()
    }

    /// Nothing: the process is alone.
    ///
    /// # Errors
    /// None.
    pub fn share(_: &mut Scene) -> anyhow::Result<()> {
        Ok(())
    }
}

#[cfg(feature = "mpi")]
mod together {
    use std::env;
    use std::process::ExitCode;
    use std::sync::OnceLock;

    use myovib_mpi::{Role, Sharing};
    use myovib_scene::Scene;

    use crate::interrupt;
    use crate::output;

    /// What launchers tell each process they start: Open MPI, and those that speak PMIx or PMI.
    const LAUNCHERS: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_SIZE"];

    static SHARING: OnceLock<Sharing> = OnceLock::new();

    /// The program, which is `command`, at rank 0; a follower of it elsewhere, which reads the same
    /// `scene`, or says on standard error why it cannot.
    pub fn main(command: impl FnOnce() -> ExitCode, scene: impl Fn() -> Option<Scene>) -> ExitCode {
        if LAUNCHERS.iter().all(|name| env::var_os(name).is_none()) {
            return command();
        }
        match myovib_mpi::begin() {
            Role::Leads(session) => {
                SHARING.get_or_init(|| session.sharing());
                command()
            }
            Role::Follows(follower) => {
                interrupt::flag(); // Rank 0 ends the run, with its output kept.
                follower.serve(|| Some(scene()?.body?.muscle.solid));
                ExitCode::SUCCESS
            }
        }
    }

    /// Shares out the elements of the scene's body among the processes, if there is one and several
    /// were started; MUMPS factorises from then on.
    ///
    /// # Errors
    /// A process that cannot read the scene, or reads another.
    pub fn share(scene: &mut Scene) -> anyhow::Result<()> {
        let (Some(sharing), Some(body)) = (SHARING.get(), &mut scene.body) else {
            return Ok(());
        };
        let solid = sharing.share(body.muscle.solid.clone());
        body.muscle.solid = solid.map_err(anyhow::Error::msg)?;
        output::note(&sharing.description().to_string());
        Ok(())
    }
}
