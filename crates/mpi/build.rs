//! Compiles the C interface to MPI and MUMPS if the feature `mpi` is enabled.

fn main() {
    #[cfg(feature = "mpi")]
    mpi::build();
}

#[cfg(feature = "mpi")]
mod mpi {
    use std::env;
    use std::process::Command;

    /// Compiler wrapper of MPI, which adds the headers and libraries of MPI.
    const COMPILER: &str = "MPICC";
    const VARIABLES: [&str; 3] = [COMPILER, "MUMPS_INCLUDE_DIR", "MUMPS_LIBRARY_DIR"];

    pub(super) fn build() {
        println!("cargo::rerun-if-changed=src/ffi/shim.c");
        for variable in VARIABLES {
            println!("cargo::rerun-if-env-changed={variable}");
        }
        let [mpicc, include, library] = VARIABLES.map(env::var);
        let mpicc = mpicc.unwrap_or_else(|_| "mpicc".to_owned());
        let Ok(shown) = Command::new(&mpicc).arg("-show").output() else {
            println!(
                "cargo::error=`{mpicc}` was not found: install an MPI (Debian: libopenmpi-dev, and libmumps-dev for \
                 MUMPS), or set {COMPILER} to its compiler wrapper"
            );
            return;
        };
        let mut shim = cc::Build::new();
        shim.compiler(&mpicc).file("src/ffi/shim.c").includes(include);
        if let Err(error) = shim.try_compile("myovib_mpi_shim") {
            println!(
                "cargo::error=the bindings to MPI and MUMPS do not compile ({error}): install MUMPS (Debian: \
                 libmumps-dev), or set MUMPS_INCLUDE_DIR to the folder of dmumps_c.h"
            );
            return;
        }
        if let Ok(folder) = library {
            println!("cargo::rustc-link-search=native={folder}");
        }
        for library in ["dmumps", "zmumps"] {
            println!("cargo::rustc-link-lib=dylib={library}");
        }
        for word in String::from_utf8_lossy(&shown.stdout).split_whitespace() {
            if let Some(folder) = word.strip_prefix("-L") {
                println!("cargo::rustc-link-search=native={folder}");
            } else if let Some(library) = word.strip_prefix("-l") {
                println!("cargo::rustc-link-lib=dylib={library}");
            }
        }
    }
}
