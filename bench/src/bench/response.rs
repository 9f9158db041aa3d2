//! Benchmarks of harmonic responses: their cost relative to time integration and to separate factorizations, and the
//! number of adaptive frequencies. Also measures the cost of periodic states.

use std::f64::consts::TAU;
use std::sync::Arc;

use anyhow::Context;
use cpu_time::ThreadTime;
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_model::linear::{Condensation, Condensed, LinearWork};
use myovib_model::{MuscleDae, run as run_model, start_at_rest};
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;
use myovib_scene::{Body, Scene};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use serde::Serialize;

use super::{BenchArgs, fastest, fastest_document, give, goes_on};

/// Comparison of a harmonic response with the time integration that it replaces or with separate factorizations.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    /// Number of unknowns in each linear system.
    unknowns: usize,
    frequencies: usize,
    cpu_seconds: f64,
    compared_with: &'static str,
    compared_cpu_seconds: f64,
    /// CPU time of the response divided by the CPU time of the other computation.
    ratio: f64,
}

/// Interpolation error between the frequencies of an adaptive or equidistant grid.
#[derive(Serialize)]
struct Interpolation {
    grid: String,
    frequencies: usize,
    /// Largest interpolation error between the computed frequencies, relative to the amplitude or to the median
    /// amplitude, whichever is larger.
    error: f64,
}

/// Comparison of a periodic state with the motion from rest that it replaces.
#[derive(Serialize)]
struct PeriodicState {
    scene: &'static str,
    unknowns: u64,
    /// Number of integrations over one period.
    integrations: u64,
    cpu_seconds: f64,
    /// End time of the motion, s.
    t_end: f64,
    motion_cpu_seconds: f64,
    /// CPU time of the periodic state divided by the CPU time of the motion.
    ratio: f64,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    responses: &'a [Row],
    periodic_states: &'a [PeriodicState],
    interpolation: &'a [Interpolation],
}

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    let mut rows = Vec::new();
    if goes_on() {
        rows.push(beside_motion(args.repeats)?);
    }
    if goes_on() {
        rows.push(beside_factorizations()?);
    }
    let mut periodic_states = Vec::new();
    if goes_on() {
        periodic_states.push(periodic_state("figure7", args.repeats)?);
    }
    let interpolation = match goes_on() {
        true => interpolation()?,
        false => Vec::new(),
    };
    let document = Document {
        machine: Machine::found(),
        responses: &rows,
        periodic_states: &periodic_states,
        interpolation: &interpolation,
    };
    give(args, &document)
}

/// Returns a built-in scene that computes the response to its load.
fn scene(name: &str, frequencies: &str, load: &str, set: &[&str]) -> anyhow::Result<Scene> {
    let mut set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
    set.push("analysis=\"response\"".to_owned());
    set.push(format!("response.frequencies=\"{frequencies}\""));
    set.push(format!("traction[0].response={{ {load} }}"));
    Ok(Scene::built_in(name, &set)?)
}

/// Returns the response and its CPU time (s).
fn timed(scene: &Scene) -> anyhow::Result<(Response, f64)> {
    let started = ThreadTime::now();
    let found = Response::of_scene(scene, Watcher::NOBODY)?;
    Ok((found, started.elapsed().as_secs_f64()))
}

/// Compares the cost of a response of the scene `init` at 120 frequencies with the cost of 3 s of motion.
fn beside_motion(repeats: u32) -> anyhow::Result<Row> {
    let of_response = scene("init", "1..60:120", "y = 100.0", &[])?;
    let (found, cpu_seconds) = fastest(repeats, || timed(&of_response), |(_, cpu)| *cpu)?;
    let motion = Scene::built_in("init", &["time.end=3.0".to_owned()])?;
    let body = motion.body.context("the scene has a body")?;
    let once = || -> anyhow::Result<_> {
        let dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let mut integrator = start_at_rest(dae, &body.settings)?;
        Ok(run_model(integrator.as_mut(), &mut [])?.cpu_seconds)
    };
    let compared = fastest(repeats, once, |cpu| *cpu)?;
    Ok(Row {
        scene: "init",
        unknowns: found.unknowns,
        frequencies: found.frequencies.len(),
        cpu_seconds,
        compared_with: "3 s of motion by radau9",
        compared_cpu_seconds: compared,
        ratio: cpu_seconds / compared,
    })
}

/// Compares the cost of the frequency response of a 3D spindle at 100 frequencies with the cost of 100 complex
/// factorizations of the same matrices.
fn beside_factorizations() -> anyhow::Result<Row> {
    // For a response about rest, principal stresses have no amplitude.
    let set = ["mesh.cells=[20, 6, 6]", "probe[1].quantities=[\"strain\"]"];
    let scene = scene("muscle3d", "1..60:100", "z = 500.0", &set)?;
    let (found, cpu_seconds) = timed(&scene)?;
    let Body { muscle, formulation, .. } = scene.body.context("the scene has a body")?;
    let mut dae = MuscleDae::new(muscle, formulation)?;
    let rest = vec![0.0; dae.layout().n_unknowns()];
    dae.update_matrices(0.0, &rest, &rest)?;
    let plan = Arc::new(Condensation::new(&dae));
    let elimination = Arc::new(plan.elimination(SparseOptions::default())?);
    let mut matrix = Condensed::<Complex64>::new(plan, elimination);
    // All factorizations are measured, because on a busy machine the fastest one would take less time than the
    // factorizations of the response do on average.
    let started = ThreadTime::now();
    for frequency in &found.frequencies {
        let s = Complex64::new(0.0, TAU * frequency);
        let mut work = LinearWork::default();
        matrix.set_up(s, |values| dae.matrix_values(values), &mut work)?;
    }
    let compared = started.elapsed().as_secs_f64();
    Ok(Row {
        scene: "muscle3d, 20 × 6 × 6",
        unknowns: found.unknowns,
        frequencies: found.frequencies.len(),
        cpu_seconds,
        compared_with: "100 complex factorizations",
        compared_cpu_seconds: compared,
        ratio: cpu_seconds / compared,
    })
}

/// Compares the cost of the periodic state of a built-in scene with the cost of the motion from rest.
fn periodic_state(name: &'static str, repeats: u32) -> anyhow::Result<PeriodicState> {
    let computed = |set: &[String]| -> anyhow::Result<_> {
        let scene = Scene::built_in(name, set)?;
        let (document, seconds) = fastest_document(&scene, repeats)?;
        Ok((document, seconds, scene.t_end))
    };
    let (found, cpu_seconds, _) = computed(&["analysis=periodic".to_owned()])?;
    let (_, motion_cpu_seconds, t_end) = computed(&[])?;
    let count = |key: &str| found[key].as_u64().context("a periodic state has counts");
    Ok(PeriodicState {
        scene: name,
        unknowns: count("unknowns")?,
        integrations: count("integrations")?,
        cpu_seconds,
        t_end,
        motion_cpu_seconds,
        ratio: cpu_seconds / motion_cpu_seconds,
    })
}

/// Returns the interpolation errors at the frequencies of the plotted curves. Results at adaptive frequencies are
/// interpolated by the rational function, and results at equidistant frequencies by cubic polynomials.
fn interpolation() -> anyhow::Result<Vec<Interpolation>> {
    let computed = |frequencies: &str| -> anyhow::Result<Response> {
        let scene = scene("init", frequencies, "y = 100.0", &[])?;
        Ok(timed(&scene)?.0)
    };
    let adaptive = computed("1..60:adaptive")?;
    let drawn = adaptive.drawn.as_ref().context("an adaptive response has curves")?;
    let list: Vec<String> = drawn.0.iter().map(f64::to_string).collect();
    let exact = Line::of(&computed(&list.join(","))?);
    let mut rows = Vec::new();
    let mut add = |grid: &str, frequencies, line: &Line| {
        rows.push(Interpolation {
            grid: grid.to_owned(),
            frequencies,
            error: exact.distance(line),
        });
    };
    let n = adaptive.frequencies.len();
    let curves = drawn.1.iter().map(|curves| &curves.amplitudes);
    let line = Line::new(&drawn.0, curves.collect());
    add("adaptive", n, &line);
    for times in [3, 10, 30] {
        let found = computed(&format!("1..60:{}", times * n))?;
        add("equidistant", times * n, &Line::of(&found));
    }
    Ok(rows)
}

/// Values as functions of frequency.
struct Line {
    frequencies: Vec<f64>,
    rows: Vec<Vec<Complex64>>,
}

impl Line {
    fn of(found: &Response) -> Self {
        let curves = found.probes.iter().map(|curves| &curves.amplitudes);
        Self::new(&found.frequencies, curves.collect())
    }

    fn new(frequencies: &[f64], curves: Vec<&Vec<Vec<Complex64>>>) -> Self {
        let row = |k: usize| curves.iter().flat_map(|rows| rows[k].clone()).collect();
        Self { frequencies: frequencies.to_vec(), rows: (0..frequencies.len()).map(row).collect() }
    }

    /// Returns value `j` at the frequency `f`, interpolated by a cubic polynomial through four neighboring frequencies.
    fn at(&self, f: f64, j: usize) -> Complex64 {
        let n = self.frequencies.len();
        let next = self.frequencies.partition_point(|other| *other < f);
        let first = next.saturating_sub(2).min(n.saturating_sub(4));
        let near = first..(first + 4).min(n);
        let term = |k: usize| {
            let others = near.clone().filter(|other| *other != k);
            let factors = others.map(|other| {
                (f - self.frequencies[other]) / (self.frequencies[k] - self.frequencies[other])
            });
            self.rows[k][j] * factors.product::<f64>()
        };
        near.clone().map(term).sum()
    }

    /// Returns the largest error of `other` when it is interpolated at the frequencies of this response.
    fn distance(&self, other: &Self) -> f64 {
        let mut largest = 0.0_f64;
        for j in 0..self.rows[0].len() {
            let mut sizes: Vec<f64> = self.rows.iter().map(|row| row[j].norm()).collect();
            sizes.sort_by(f64::total_cmp);
            let median = sizes[sizes.len() / 2];
            for (f, row) in self.frequencies.iter().zip(&self.rows) {
                let error = (other.at(*f, j) - row[j]).norm() / row[j].norm().max(median);
                largest = largest.max(error);
            }
        }
        largest
    }
}
