//! Large bodies: our factorisations of 3D Newton matrices next to MUMPS, in one run.
//!
//! `large [--threads N] [--rival] CASE…`, a case being a name of [`CASES`] and optionally `:complex`,
//! `:general` or both.

#[cfg(feature = "mumps")]
mod ffi;
mod solid;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use cpu_time::ProcessTime;
use myovib_sparse::klu::KluOptions;
use myovib_sparse::{Elimination, Kind, LinearWork, Number, SparseSystem, Structure};
use num_complex::Complex64;
use solid::Solid;

#[cfg(feature = "mumps")]
use ffi::Rival;
#[cfg(not(feature = "mumps"))]
use myovib_sparse::Number as Rival;

/// Cubes; b: compact, s: a shell of two layers; thousands of unknowns.
const CASES: [(&str, [usize; 3]); 7] = [
    ("b10", [5, 5, 13]),
    ("b30", [8, 8, 17]),
    ("s30", [2, 21, 21]),
    ("b100", [12, 12, 25]),
    ("s100", [39, 2, 39]),
    ("b200", [15, 15, 32]),
    ("b1", [2, 2, 6]),
];

/// 1.5/ms.
const C: f64 = 1.5e3;

fn main() -> Result<()> {
    let (mut threads, mut rival, mut repeats) = (1, false, 3);
    println!(
        "| case | n | solver | threads | factor: CPU s | wall s | solve: CPU s | MB | backward error |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut number = || {
            arguments
                .next()
                .context("a number")?
                .parse()
                .context("a number")
        };
        match argument.as_str() {
            "--threads" => threads = number()?,
            "--repeats" => repeats = number()?,
            "--rival" => rival = true,
            case => {
                let mut parts = case.split(':');
                let name = parts.next().unwrap_or_default();
                let kinds: Vec<_> = parts.collect();
                let known = CASES.iter().find(|(known, _)| *known == name);
                let (_, cubes) = known.with_context(|| format!("no case {name}"))?;
                let solid = Solid::block(*cubes);
                let kind = match kinds.contains(&"general") {
                    true => Kind::General,
                    false => Kind::Symmetric,
                };
                let run = Run {
                    case,
                    solid: &solid,
                    kind,
                    threads,
                    repeats,
                    rival,
                };
                match kinds.contains(&"complex") {
                    true => run.all(Complex64::new(C, 0.7 * C))?,
                    false => run.all(C)?,
                }
            }
        }
    }
    Ok(())
}

struct Run<'a> {
    case: &'a str,
    solid: &'a Solid,
    kind: Kind,
    threads: usize,
    repeats: usize,
    #[cfg_attr(not(feature = "mumps"), expect(dead_code))]
    rival: bool,
}

impl Run<'_> {
    fn all<T: Rival>(&self, c: T) -> Result<()> {
        let values = self.solid.values(c);
        self.ours(&values)?;
        #[cfg(feature = "mumps")]
        if self.rival {
            self.mumps(&values);
        }
        Ok(())
    }

    fn ours<T: Number>(&self, values: &[T]) -> Result<()> {
        let pattern = &self.solid.pattern;
        let structure = Structure {
            kind: self.kind,
            ..Structure::default()
        };
        let start = Instant::now();
        let elimination = Elimination::new(pattern, structure, KluOptions::default())?;
        let elimination = Arc::new(elimination.in_threads(self.threads)?);
        let analysis = start.elapsed().as_secs_f64();
        let ours = "no engine is installed";
        let prediction = elimination.prediction::<T>().expect(ours);
        let mut system = SparseSystem::<T>::new(elimination.clone());
        system.values_mut().copy_from_slice(values);
        let mut work = LinearWork::default();
        let mut factor = [f64::INFINITY; 2];
        for _ in 0..self.repeats {
            least(&mut factor, || system.renew(&mut work))?;
        }
        let mut solve = [f64::INFINITY; 2];
        let mut x = self.rhs::<T>();
        system.solve(&mut x, &mut work)?;
        for _ in 0..5 {
            let mut x = self.rhs::<T>();
            least(&mut solve, || system.solve(&mut x, &mut work))?;
        }
        self.line(
            "ours",
            factor,
            solve,
            prediction.bytes,
            backward_error(self.solid, values, &self.rhs(), &x),
        );
        let fronts = elimination.analysis().expect(ours).supernodes();
        println!(
            "  analysis {analysis:.2} s, {:.1}e6 entries, {:.2}e9 flops, {} supernodes, peak {} MB",
            prediction.entries as f64 / 1e6,
            prediction.flops / 1e9,
            fronts.count(),
            peak_megabytes(),
        );
        Ok(())
    }

    #[cfg(feature = "mumps")]
    fn mumps<T: Rival>(&self, values: &[T]) {
        let mut system = ffi::Mumps::new(&self.solid.pattern, values, self.kind);
        let (mut factor, mut solve) = ([f64::INFINITY; 2], [f64::INFINITY; 2]);
        for _ in 0..self.repeats {
            least(&mut factor, || {
                system.factor();
                Ok::<(), anyhow::Error>(())
            })
            .expect("asserted inside");
        }
        let mut x = Vec::new();
        for _ in 0..5 {
            x = self.rhs::<T>();
            least(&mut solve, || {
                system.solve(&mut x);
                Ok::<(), anyhow::Error>(())
            })
            .expect("asserted inside");
        }
        let bytes = system.n_bytes();
        self.line(
            "MUMPS",
            factor,
            solve,
            bytes,
            backward_error(self.solid, values, &self.rhs(), &x),
        );
        println!("  delayed pivots: {}", system.delayed());
    }

    /// Of size 1 in the units of each equation.
    fn rhs<T: Number>(&self) -> Vec<T> {
        let n = self.solid.pattern.major_dim();
        (0..n).map(|i| T::one() * (i as f64).sin()).collect()
    }

    fn line(&self, solver: &str, factor: [f64; 2], solve: [f64; 2], bytes: usize, error: f64) {
        println!(
            "| {} | {} | {solver} | {} | {:.3} | {:.3} | {:.4} | {:.0} | {error:.1e} |",
            self.case,
            self.solid.pattern.major_dim(),
            self.threads,
            factor[0],
            factor[1],
            solve[0],
            bytes as f64 / 1e6,
        );
    }
}

/// Keeps the least CPU time and wall time.
fn least<E>(times: &mut [f64; 2], work: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
    let (wall, cpu) = (Instant::now(), ProcessTime::now());
    work()?;
    times[0] = times[0].min(cpu.elapsed().as_secs_f64());
    times[1] = times[1].min(wall.elapsed().as_secs_f64());
    Ok(())
}

/// max_i |b - A x|_i / (|A||x| + |b|)_i.
fn backward_error<T: Number>(solid: &Solid, values: &[T], b: &[T], x: &[T]) -> f64 {
    let mut residual = b.to_vec();
    let mut scale: Vec<f64> = b.iter().map(|b| b.abs()).collect();
    for ((column, row), &a) in solid.pattern.entries().zip(values) {
        residual[row] -= a * x[column];
        scale[row] += a.abs() * x[column].abs();
    }
    let ratios = residual.iter().zip(&scale).map(|(r, s)| r.abs() / s);
    ratios.fold(0.0, |max, ratio| {
        if ratio.is_nan() {
            f64::INFINITY
        } else {
            f64::max(max, ratio)
        }
    })
}

/// The peak of the process so far; of Linux only.
fn peak_megabytes() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<usize>().ok());
    kilobytes.unwrap_or(0) / 1000
}
