//! Detects the major version of SUNDIALS in the bindings: `cfg(sundials = "6")` or `"7"`.

use std::env;
use std::fs;
use std::path::PathBuf;

/// Default search path of the compiler for headers.
const FOLDERS: [&str; 2] = ["/usr/local/include", "/usr/include"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=SUNDIALS_INCLUDE_DIR");
    println!("cargo::rustc-check-cfg=cfg(sundials, values(\"6\", \"7\"))");
    match major() {
        Ok(major) => println!("cargo::rustc-cfg=sundials=\"{major}\""),
        Err(reason) => println!(
            "cargo::error={reason}; install SUNDIALS 6.4 to 7.x with IDAS (Debian: \
             libsundials-dev), set SUNDIALS_INCLUDE_DIR to the folder of its headers, or build with \
             `--features vendored`, which compiles SUNDIALS from source"
        ),
    }
}

fn major() -> Result<u32, String> {
    if cfg!(feature = "vendored") {
        return Ok(7); // the sources included in sundials-sys
    }
    let named = env::var_os("SUNDIALS_INCLUDE_DIR").map(PathBuf::from);
    let mut folders = named.into_iter().chain(FOLDERS.map(PathBuf::from));
    let (path, text) = folders
        .find_map(|folder| {
            let path = folder.join("sundials/sundials_config.h");
            fs::read_to_string(&path).ok().map(|text| (path, text))
        })
        .ok_or("sundials/sundials_config.h was not found")?;
    match [number(&text, "MAJOR"), number(&text, "MINOR")] {
        [Some(6), Some(4..)] => Ok(6),
        [Some(7), Some(_)] => Ok(7),
        [Some(major), Some(minor)] => Err(format!(
            "{} is from SUNDIALS {major}.{minor}, which is not supported",
            path.display()
        )),
        _ => Err(format!("{} does not state a version", path.display())),
    }
}

/// Returns the number in `#define SUNDIALS_VERSION_{part}`.
fn number(text: &str, part: &str) -> Option<u32> {
    let name = format!("SUNDIALS_VERSION_{part}");
    let mut lines = text.lines().map(|line| line.split_whitespace());
    lines.find_map(|mut words| {
        let is_it = words.next() == Some("#define") && words.next() == Some(&name);
        words.next().filter(|_| is_it)?.parse().ok()
    })
}
