//! Build requirements, read from the list that `scripts/setup` also uses.

use std::env;
use std::path::{Path, PathBuf};

const LIST: &str = include_str!("../requirements.txt");

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Requirement {
    /// Debian package that provides the requirement.
    pub package: &'static str,
    /// Purpose of the package.
    pub purpose: &'static str,
    /// Paths at which the package may be installed.
    patterns: Vec<&'static str>,
}

/// Name of the build variant of this program in the list of requirements.
pub const BUILD_VARIANT: &str = match cfg!(feature = "vendored") {
    true => "vendored",
    false => "system",
};

/// Returns all requirements for the build `variant`.
///
/// # Panics
/// Panics if a line of the embedded list does not have four fields. A test ensures that this cannot happen.
pub fn of_variant(variant: &str) -> Vec<Requirement> {
    let lines = LIST.lines().filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| parse(line, variant)).collect()
}

fn parse(line: &'static str, variant: &str) -> Option<Requirement> {
    let fields: Vec<&str> = line.split('|').map(str::trim).collect();
    let [of, package, purpose, patterns] = fields[..] else {
        panic!("requirements.txt: `{line}` does not have four fields")
    };
    let requirement =
        Requirement { package, purpose, patterns: patterns.split_whitespace().collect() };
    (of == variant || of == "both").then_some(requirement)
}

impl Requirement {
    /// Returns the first path at which the package is installed on this machine.
    pub fn locate(&self) -> Option<PathBuf> {
        self.patterns.iter().find_map(|pattern| locate(pattern))
    }
}

fn locate(pattern: &str) -> Option<PathBuf> {
    if let Some(command) = pattern.strip_prefix("$PATH/") {
        let folders = env::var_os("PATH")?;
        return env::split_paths(&folders).map(|folder| folder.join(command)).find(|p| p.is_file());
    }
    let pattern = match pattern.strip_prefix('$').and_then(|rest| rest.split_once('/')) {
        Some((variable, rest)) => Path::new(&env::var_os(variable)?).join(rest),
        None => PathBuf::from(pattern),
    };
    glob::glob(pattern.to_str()?).ok()?.find_map(Result::ok)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_well_formed() {
        for (variant, own, of_the_other) in [
            ("system", ["libsundials-dev", "libsuitesparse-dev"], "cmake"),
            ("vendored", ["cmake", "make"], "libsundials-dev"),
        ] {
            let all = of_variant(variant);
            let packages: Vec<_> = all.iter().map(|r| r.package).collect();
            for needed in own.into_iter().chain(["gcc", "libclang-dev"]) {
                assert!(packages.contains(&needed), "{needed} in {packages:?}");
            }
            assert!(!packages.contains(&of_the_other), "{packages:?}");
            assert!(all.iter().all(|r| !r.purpose.is_empty() && !r.patterns.is_empty()));
        }
    }

    #[test]
    fn places_are_found_by_command_variable_and_pattern() {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Carg?.toml");
        assert!(locate(manifest).is_some_and(|path| path.ends_with("Cargo.toml")));
        // Cargo sets this variable for tests.
        assert!(locate("$CARGO_MANIFEST_DIR/Cargo.toml").is_some());
        assert!(locate("$PATH/sh").is_some());
        assert!(locate("$PATH/no-such-command").is_none());
        assert!(locate("$NO_SUCH_VARIABLE/Cargo.toml").is_none());
    }
}
