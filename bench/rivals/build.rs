//! Compiles the calls to MUMPS if the feature `mumps` is enabled.

fn main() {
    #[cfg(feature = "mumps")]
    {
        println!("cargo:rerun-if-changed=src/bin/large/ffi/mumps.c");
        cc::Build::new()
            .file("src/bin/large/ffi/mumps.c")
            .include("/usr/include/mumps_seq")
            .compile("mumps_run");
        for library in ["dmumps_seq", "zmumps_seq", "openblas"] {
            println!("cargo:rustc-link-lib={library}");
        }
    }
}
