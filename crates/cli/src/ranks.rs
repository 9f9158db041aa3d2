//! Runs on several processes that `mpirun` or `srun` starts together, if the feature `mpi` is enabled. Rank 0 runs the
//! program, and each of the other ranks assembles its share of the elements.

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

    /// Environment variables in which the launchers of Open MPI and PMI store the number of processes.
    const SIZES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

    /// Runs the program's `command`.
    pub fn main(command: impl FnOnce() -> ExitCode, _: impl Fn() -> Option<Scene>) -> ExitCode {
        let several = |name: &&str| env::var(name).is_ok_and(|size| size != "1");
        if SIZES.iter().any(several) {
            output::line(
                "error: several processes were started, but this program was built for one: build it with \
                 `--features mpi`, or start a single process",
            );
            return Exit::Usage.into();
        }
        command()
    }

    /// Does nothing, because there is a single process.
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

    /// Environment variables that the launchers of Open MPI, PMIx and PMI set for each process.
    const LAUNCHERS: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_SIZE"];

    static SHARING: OnceLock<Sharing> = OnceLock::new();

    /// Runs `command` on rank 0. The other ranks read the same `scene` and follow rank 0. If they cannot read the
    /// scene, they report the error on standard error.
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
                interrupt::flag(); // Rank 0 ends the run and keeps its output.
                follower.serve(|| Some(scene()?.body?.muscle.solid));
                ExitCode::SUCCESS
            }
        }
    }

    /// Distributes the elements of the scene's body among the processes, if the scene has a body and there are several
    /// processes. Afterward, MUMPS factorizes the matrices.
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
