//! Compares our factorization of 3D Newton matrices with MUMPS. The solvers alternate in one process, so that other
//! load on the machine affects them equally.
//!
//! Usage: `large [--json FILE] [--repeats N] [CASE…]`. A case is a name in [`CASES`], optionally followed by
//! `:complex`, `:general` or both. By default, all [`MATRICES`] of the bodies in [`RECORD`] are measured. Without the
//! feature `mumps`, only our solver runs.

mod contest;
#[cfg(feature = "mumps")]
mod ffi;
mod memory;
mod solid;
mod solver;

use anyhow::{Context, Result, bail};
use contest::Contest;
use myovib_sparse::Kind;
use num_complex::Complex64;
use serde_json::json;
use solid::Solid;

/// Bodies and their numbers of cubes in each direction. `b` is a compact block, and `s` is a shell of two layers. The
/// number in the name is the number of unknowns in thousands.
const CASES: [(&str, [usize; 3]); 7] = [
    ("b10", [5, 5, 13]),
    ("b30", [8, 8, 17]),
    ("s30", [2, 21, 21]),
    ("b100", [12, 12, 25]),
    ("s100", [39, 2, 39]),
    ("b200", [15, 15, 32]),
    ("b1", [2, 2, 6]),
];

/// Bodies and matrices of the default cases: real and complex LDLᵀ as for BDF and Radau IIA, and LU as for damping.
const RECORD: [&str; 5] = ["b10", "s30", "b30", "s100", "b100"];
const MATRICES: [&str; 4] = ["", ":complex", ":general", ":general:complex"];

/// Factor c (1/s) for steps of about one millisecond, 1.5 / 1 ms.
const C: f64 = 1.5e3;

fn main() -> Result<()> {
    let (mut file, mut repeats, mut cases) = (None, 3, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => file = Some(arguments.next().context("--json: a file")?),
            "--repeats" => {
                let number = arguments.next().context("--repeats: a number")?;
                repeats = number.parse().context("--repeats: a number")?;
            }
            _ => cases.push(argument),
        }
    }
    if cases.is_empty() {
        cases.extend(
            RECORD.iter().flat_map(|body| MATRICES.map(|matrix| format!("{body}{matrix}"))),
        );
    }
    println!("{}", contest::HEAD);
    let mut results = Vec::new();
    for case in &cases {
        let result = one(case, repeats).with_context(|| case.clone())?;
        println!("{result}");
        results.push(result);
    }
    if let Some(file) = file {
        let document = json!({ "repeats": repeats, "cases": results });
        std::fs::write(&file, format!("{document:#}\n")).context(file)?;
    }
    Ok(())
}

fn one(case: &str, repeats: usize) -> Result<contest::Outcome> {
    let mut parts = case.split(':');
    let name = parts.next().unwrap_or_default();
    let (mut kind, mut is_complex) = (Kind::Symmetric, false);
    for part in parts {
        match part {
            "general" => kind = Kind::General,
            "complex" => is_complex = true,
            _ => bail!("unknown kind of matrix: {part}"),
        }
    }
    let known = CASES.iter().find(|(known, _)| *known == name);
    let (name, cubes) = known.context("unknown case")?;
    let solid = &Solid::block(*cubes);
    let contest = Contest { name, solid, kind, repeats };
    match is_complex {
        true => contest.run(Complex64::new(C, 0.7 * C)),
        false => contest.run(C),
    }
}
