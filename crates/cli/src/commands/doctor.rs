//! `myovib doctor`: what this program runs with, and what its build lacks.

use clap::Args;
use serde::Serialize;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::machine::Machine;
use crate::report::{Align, Cell, Table, Tone, coloured_stdout, paint};
use crate::requirements;
use crate::versions::{INDEX_BITS, Versions};

/// Options of `myovib doctor`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myovib doctor\n  myovib doctor --json doctor.json\n\n\
                        Exit code 1 when something is missing."
)]
pub struct DoctorArgs {
    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// What the doctor found; the body of its JSON document.
#[derive(Debug, Serialize)]
struct Findings {
    index_bits: usize,
    optimised: bool,
    threads: usize,
    machine: Machine,
    build: Vec<BuildTool>,
    /// What to do about what is missing; empty when nothing is.
    remedies: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BuildTool {
    purpose: &'static str,
    package: &'static str,
    found: Option<String>,
}

/// Prints the findings.
///
/// # Errors
/// When the output cannot be written.
pub fn run(args: &DoctorArgs) -> anyhow::Result<Exit> {
    let findings = examine(args);
    args.common.give("doctor", &text(&findings), &findings)?;
    Ok(if findings.remedies.is_empty() {
        Exit::Done
    } else {
        Exit::Differs
    })
}

fn examine(args: &DoctorArgs) -> Findings {
    let build: Vec<BuildTool> = requirements::all()
        .iter()
        .map(|requirement| BuildTool {
            purpose: requirement.purpose,
            package: requirement.package,
            found: requirement.locate().map(|path| path.display().to_string()),
        })
        .collect();
    let remedies = remedies(&Versions::found().sundials, INDEX_BITS, &build);
    Findings {
        index_bits: INDEX_BITS,
        optimised: !cfg!(debug_assertions),
        threads: args.common.n_threads().get(),
        machine: Machine::found(),
        build,
        remedies,
    }
}

fn remedies(sundials: &str, index_bits: usize, build: &[BuildTool]) -> Vec<String> {
    let mut remedies = Vec::new();
    let mut packages: Vec<&str> = build
        .iter()
        .filter(|tool| tool.found.is_none())
        .map(|tool| tool.package)
        .collect();
    packages.dedup();
    if !packages.is_empty() {
        let packages = packages.join(" ");
        remedies.push(format!(
            "apt-get install --no-install-recommends {packages}"
        ));
    }
    if !is_supported(sundials) {
        remedies.push(format!(
            "SUNDIALS {sundials} is linked, 6.4 or a later 6.x is needed: \
             apt-get install --no-install-recommends libsundials-dev, then build again"
        ));
    }
    if index_bits != 64 {
        remedies.push(format!(
            "SUNDIALS is linked with {index_bits}-bit indices, 64 are needed to share KLU's: \
             apt-get install --no-install-recommends libsundials-dev, then build again"
        ));
    }
    remedies
}

/// Whether the version is 6.4 or a later 6.x: what the wrapper is written for.
fn is_supported(sundials: &str) -> bool {
    let mut numbers = sundials.split('.').map(|word| word.parse::<u32>().ok());
    matches!((numbers.next().flatten(), numbers.next().flatten()), (Some(6), Some(minor)) if minor >= 4)
}

fn text(findings: &Findings) -> String {
    let coloured = coloured_stdout();
    let versions = Versions::found();
    let machine = &findings.machine;
    let unknown = || "unknown".to_owned();

    let mut facts = Table::new(&[("this program", Align::Left), ("", Align::Left)]);
    let build_kind = if findings.optimised {
        "release"
    } else {
        "debug: slow, build with --release"
    };
    for (name, value) in [
        (
            "myovib",
            format!("{} (git {}), {build_kind}", versions.myovib, versions.git),
        ),
        ("SUNDIALS", versions.sundials),
        ("KLU", versions.klu),
        ("index width", format!("{} bits", findings.index_bits)),
        (
            "processor",
            machine.processor.clone().unwrap_or_else(unknown),
        ),
        ("target", machine.target.clone()),
        ("vector instructions", machine.simd.to_owned()),
        (
            "cores, threads",
            format!("{}, {}", machine.cores, findings.threads),
        ),
    ] {
        facts.row([name.into(), value.into()]);
    }

    let mut build = Table::new(&[
        ("to build it", Align::Left),
        ("package", Align::Left),
        ("", Align::Left),
    ]);
    for tool in &findings.build {
        let state = match &tool.found {
            Some(path) => Cell::new(path.clone(), Tone::Good),
            None => Cell::new("missing", Tone::Bad),
        };
        build.row([tool.purpose.into(), tool.package.into(), state]);
    }

    let verdict = if findings.remedies.is_empty() {
        paint("Nothing is missing.", Tone::Good, coloured)
    } else {
        let lines: Vec<String> = findings
            .remedies
            .iter()
            .map(|line| format!("  {line}"))
            .collect();
        format!(
            "{}\n{}",
            paint("To mend it:", Tone::Bad, coloured),
            lines.join("\n")
        )
    };
    format!(
        "{}\n{}\n{verdict}\n",
        facts.render(coloured),
        build.render(coloured)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(package: &'static str, found: bool) -> BuildTool {
        BuildTool {
            purpose: "x",
            package,
            found: found.then(|| "/there".to_owned()),
        }
    }

    #[test]
    fn a_healthy_machine_needs_nothing() {
        assert!(remedies("6.4.1", 64, &[tool("gcc", true)]).is_empty());
    }

    #[test]
    fn missing_packages_make_one_apt_line() {
        let build = [
            tool("gcc", true),
            tool("libclang-dev", false),
            tool("libclang-dev", false),
        ];
        let line = "apt-get install --no-install-recommends libclang-dev";
        assert_eq!(remedies("6.4.1", 64, &build), [line]);
    }

    #[test]
    fn versions_the_wrapper_was_not_written_for_are_named() {
        for (version, supported) in [
            ("6.4.0", true),
            ("6.7.0", true),
            ("6.3.9", false),
            ("7.1.1", false),
            ("", false),
        ] {
            assert_eq!(is_supported(version), supported, "{version}");
        }
        assert!(remedies("5.7.0", 64, &[])[0].contains("5.7.0"));
        assert!(remedies("6.4.1", 32, &[])[0].contains("32-bit"));
    }
}
