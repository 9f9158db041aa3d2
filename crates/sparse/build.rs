//! Generates bindings to the system's KLU and sets `cfg(klu)` if the feature `klu` is enabled and `vendored` is not.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(klu)");
    #[cfg(all(feature = "klu", not(feature = "vendored")))]
    klu::bind();
}

#[cfg(all(feature = "klu", not(feature = "vendored")))]
mod klu {
    use std::env;
    use std::fs;
    use std::path::{Path, PathBuf};

    /// Common locations of SuiteSparse's headers.
    const FOLDERS: [&str; 6] = [
        "/usr/include/suitesparse",
        "/usr/local/include/suitesparse",
        "/opt/homebrew/include/suitesparse",
        "/usr/include",
        "/usr/local/include",
        "/opt/homebrew/include",
    ];

    /// Generates the bindings and selects the libraries to link.
    pub(super) fn bind() {
        println!("cargo::rerun-if-changed=build.rs");
        for variable in ["SUITESPARSE_INCLUDE_DIR", "SUITESPARSE_LIBRARY_DIR"] {
            println!("cargo::rerun-if-env-changed={variable}");
        }
        let Some(folder) = folder() else {
            println!(
                "cargo::error=klu.h was not found: install SuiteSparse (Debian: libsuitesparse-dev), set \
                 SUITESPARSE_INCLUDE_DIR, or build without KLU (`--features vendored`)"
            );
            return;
        };
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
        let bindings = bindgen::builder()
            .header(folder.join("klu.h").to_string_lossy())
            .allowlist_item("klu_z?l_.*|KLU_.*|SuiteSparse_version")
            .layout_tests(false)
            .generate_comments(false)
            .generate()
            .unwrap_or_else(|error| panic!("cannot generate bindings to klu.h: {error}"))
            .to_string()
            .replace("\nextern \"C\" {", "\nunsafe extern \"C\" {"); // required by edition 2024
        fs::write(out.join("klu.rs"), bindings)
            .unwrap_or_else(|error| panic!("cannot write the bindings: {error}"));
        if let Ok(folder) = env::var("SUITESPARSE_LIBRARY_DIR") {
            println!("cargo::rustc-link-search=native={folder}");
        } else if folder.starts_with("/opt/homebrew") {
            println!("cargo::rustc-link-search=native=/opt/homebrew/lib");
        }
        for library in ["klu", "suitesparseconfig"] {
            println!("cargo::rustc-link-lib=dylib={library}");
        }
        println!("cargo::rustc-cfg=klu");
    }

    fn folder() -> Option<PathBuf> {
        let named = env::var_os("SUITESPARSE_INCLUDE_DIR").map(PathBuf::from);
        let all = named.into_iter().chain(FOLDERS.map(PathBuf::from));
        all.into_iter().find(|folder: &PathBuf| has_klu(folder))
    }

    fn has_klu(folder: &Path) -> bool {
        folder.join("klu.h").is_file()
    }
}
