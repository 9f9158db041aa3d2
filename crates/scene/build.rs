//! Captures the git revision of the source; "unknown" outside git.

use std::path::Path;
use std::process::Command;

fn main() {
    // Tracks the sources of every crate, so that the mark of local changes is never stale.
    for path in ["../../crates", "../../data", "../../Cargo.lock"] {
        println!("cargo:rerun-if-changed={path}");
    }
    for name in ["HEAD", "index"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    let revision = revision().unwrap_or_else(|| "unknown".into());
    println!("cargo:rustc-env=MYOVIB_GIT_REVISION={revision}");
}

fn revision() -> Option<String> {
    // A source archive unpacked inside another project's repository does not have a revision.
    let top = git(&["rev-parse", "--show-toplevel"])?;
    let here = Path::new("../..").canonicalize().ok()?;
    if Path::new(&top).canonicalize().ok()? != here {
        return None;
    }
    let head = git(&["rev-parse", "--short=12", "HEAD"])?;
    // Without this lock, git would rewrite the index and trigger another build.
    let changes = git(&[
        "--no-optional-locks",
        "status",
        "--porcelain",
        "--",
        "../../crates",
        "../../data",
        "../../Cargo.lock",
    ])?;
    Some(if changes.is_empty() { head } else { format!("{head}-modified") })
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    if !output.status.success() {
        return None;
    }
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
