//! `myovib doctor`: the libraries that this program uses, and missing build requirements.

use clap::Args;
use serde::Serialize;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::machine::Machine;
use crate::requirements;
use myovib_report::table::{Align, Cell, Table, Tone, colored_stdout, paint};
use myovib_scene::versions;
use sundials_wrap::Versions;

/// Options of `myovib doctor`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  myovib doctor\n  myovib doctor --json=doctor.json\n\n\
                        The exit code is 1 if something is missing.")]
pub struct DoctorArgs {
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Findings of `doctor`; the body of its JSON document.
#[derive(Debug, Serialize)]
struct Findings {
    sundials_headers: String,
    /// Either `system` or `vendored`.
    way: &'static str,
    suite_sparse: Option<String>,
    index_bits: usize,
    optimized: bool,
    threads: usize,
    machine: Machine,
    build: Vec<BuildTool>,
    /// Instructions to install missing requirements; empty if nothing is missing.
    remedies: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BuildTool {
    purpose: &'static str,
    package: &'static str,
    found: Option<String>,
}

/// Prints the findings.
pub fn run(args: &DoctorArgs) -> anyhow::Result<Exit> {
    let findings = examine(args);
    args.common.print_or_write("doctor", &text(&findings), &findings)?;
    Ok(if findings.remedies.is_empty() { Exit::Done } else { Exit::Differs })
}

fn examine(args: &DoctorArgs) -> Findings {
    let build: Vec<BuildTool> = requirements::of_variant(requirements::BUILD_VARIANT)
        .iter()
        .map(|requirement| BuildTool {
            purpose: requirement.purpose,
            package: requirement.package,
            found: requirement.locate().map(|path| path.display().to_string()),
        })
        .collect();
    let linked = Versions::linked();
    let remedies = remedies(&linked, &build);
    Findings {
        sundials_headers: linked.sundials_headers,
        way: requirements::BUILD_VARIANT,
        suite_sparse: linked.sparse.map(|sparse| sparse.suite_sparse),
        index_bits: linked.index_bits,
        optimized: !cfg!(debug_assertions),
        threads: args.common.n_threads().get(),
        machine: Machine::found(),
        build,
        remedies,
    }
}

fn remedies(linked: &Versions, build: &[BuildTool]) -> Vec<String> {
    const REMEDY: &str =
        "apt-get install --no-install-recommends libsundials-dev, then build again";
    let mut remedies = Vec::new();
    let mut packages: Vec<&str> =
        build.iter().filter(|tool| tool.found.is_none()).map(|tool| tool.package).collect();
    packages.dedup();
    if !packages.is_empty() {
        let packages = packages.join(" ");
        remedies.push(format!("apt-get install --no-install-recommends {packages}"));
    }
    let Versions { sundials, sundials_headers, index_bits, .. } = linked;
    if !is_supported(sundials) {
        remedies
            .push(format!("SUNDIALS {sundials} is linked, but 6.4 to 7.x is required: {REMEDY}"));
    }
    if sundials != sundials_headers {
        remedies.push(format!(
            "SUNDIALS {sundials} is linked, but the program was built with the headers of \
             {sundials_headers}: {REMEDY}"
        ));
    }
    if *index_bits != 64 {
        remedies.push(format!(
            "SUNDIALS is linked with {index_bits}-bit indices, but 64-bit indices are required: {REMEDY}"
        ));
    }
    remedies
}

/// Checks that the version is between 6.4 and 7.x, the range that the wrapper supports.
fn is_supported(sundials: &str) -> bool {
    let mut numbers = sundials.split('.').map(|word| word.parse::<u32>().ok());
    matches!(
        (numbers.next().flatten(), numbers.next().flatten()),
        (Some(6), Some(4..)) | (Some(7), Some(_))
    )
}

fn text(findings: &Findings) -> String {
    let colored = colored_stdout();
    let versions = versions::Versions::found();
    let machine = &findings.machine;
    let unknown = || "unknown".to_owned();

    let mut facts = Table::new(&[("this program", Align::Left), ("", Align::Left)]);
    let build_kind =
        if findings.optimized { "release" } else { "debug: slow, build with --release" };
    for (name, value) in [
        ("myovib", format!("{} (git {}), {build_kind}", versions.myovib, versions.git)),
        ("SUNDIALS", versions.sundials.clone()),
        (
            "KLU",
            match &findings.suite_sparse {
                Some(collection) => format!("{} (SuiteSparse {collection})", versions.klu_text()),
                None => versions.klu_text().to_owned(),
            },
        ),
        ("index width", format!("{} bits", findings.index_bits)),
        ("processor", machine.processor.clone().unwrap_or_else(unknown)),
        ("target", machine.target.clone()),
        ("vector instructions", machine.simd.to_owned()),
        ("cores, threads", format!("{}, {}", machine.cores, findings.threads)),
    ] {
        facts.row([name.into(), value.into()]);
    }

    let mut build =
        Table::new(&[("to build it", Align::Left), ("package", Align::Left), ("", Align::Left)]);
    for tool in &findings.build {
        let state = match &tool.found {
            Some(path) => Cell::new(path.clone(), Tone::Good),
            None => Cell::new("missing", Tone::Bad),
        };
        build.row([tool.purpose.into(), tool.package.into(), state]);
    }

    let verdict = if findings.remedies.is_empty() {
        paint("Nothing is missing.", Tone::Good, colored)
    } else {
        let lines: Vec<String> = findings.remedies.iter().map(|line| format!("  {line}")).collect();
        format!("{}\n{}", paint("To fix it:", Tone::Bad, colored), lines.join("\n"))
    };
    format!("{}\n{}\n{verdict}\n", facts.render(colored), build.render(colored))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(package: &'static str, found: bool) -> BuildTool {
        BuildTool { purpose: "x", package, found: found.then(|| "/there".to_owned()) }
    }

    fn linked(sundials: &str, sundials_headers: &str, index_bits: usize) -> Versions {
        Versions {
            sundials: sundials.to_owned(),
            sundials_headers: sundials_headers.to_owned(),
            sparse: None,
            index_bits,
        }
    }

    #[test]
    fn a_healthy_machine_needs_nothing() {
        assert!(remedies(&linked("6.4.1", "6.4.1", 64), &[tool("gcc", true)]).is_empty());
    }

    #[test]
    fn missing_packages_make_one_apt_line() {
        let build = [tool("gcc", true), tool("libclang-dev", false), tool("libclang-dev", false)];
        let line = "apt-get install --no-install-recommends libclang-dev";
        assert_eq!(remedies(&linked("6.4.1", "6.4.1", 64), &build), [line]);
    }

    #[test]
    fn unsupported_versions_are_named() {
        for (version, supported) in [
            ("6.4.0", true),
            ("6.7.0", true),
            ("6.3.9", false),
            ("7.1.1", true),
            ("8.0.0", false),
            ("", false),
        ] {
            assert_eq!(is_supported(version), supported, "{version}");
        }
        for (linked, words) in [
            (linked("5.7.0", "5.7.0", 64), "5.7.0"),
            (linked("6.4.1", "6.5.0", 64), "6.5.0"),
            (linked("6.4.1", "6.4.1", 32), "32-bit"),
        ] {
            let remedies = remedies(&linked, &[]);
            assert!(remedies.len() == 1 && remedies[0].contains(words), "{remedies:?}");
        }
    }
}
