//! Measures the cost of sensitivities: runs of the paper's equations with zero, two and eight
//! parameters by Radau IIA. For comparison, three rows are also run by IDAS with the staggered
//! method, with sensitivities excluded from the error test.
//! `cargo run --release -p myovib-scene --example sensitivity_cost [T_END [ROW…]]`
use myovib_dae::Outcome;
use myovib_model::linear::CondensedSolver;
use myovib_model::{MuscleDae, ida};
use myovib_scene::sensitivity::{Cost, Parameterized, Precision, follow, outputs};
use myovib_scene::watch::Watcher;
use sundials_wrap::{
    IdaOptions, IdaSolver, SensitivityMethod, SensitivityOptions, SensitivityStatistics,
};

/// Eight parameters of all kinds. Runs with two parameters use the first two.
const KEYS: [(&str, f64); 8] = [
    ("material[0].c10", 1e4),
    ("traction[0].y.amplitude", 100.0),
    ("material[0].c01", 2e2),
    ("solid.bulk_modulus", 1e-5),
    ("material[0].density", 1.1e3),
    ("solid.rayleigh_mass", 1.0),
    ("solid.rayleigh_stiffness", 1e-4),
    ("traction[0].y.frequency", 8.0),
];

/// Absolute tolerances of Table 2.
const ATOL: &str = "{ displacement = 1e-5, velocity = 1e-5, pressure = 0.1, multiplier = 5.0 }";

/// Returns the scene of a row with the first `count` parameters (at least one).
fn parameterized(row: &str, t_end: &str, count: usize, more: Option<String>) -> Parameterized {
    let list: Vec<String> = KEYS[..count.max(1)]
        .iter()
        .map(|(key, scale)| format!("{{ key = \"{key}\", scale = {scale:e} }}"))
        .collect();
    let own = [
        format!("parameter=[{}]", list.join(", ")),
        format!("time.end={t_end}"),
    ];
    let set: Vec<String> = own.into_iter().chain(more).collect();
    Parameterized::load(row.as_ref(), &set).expect("the scene is built in")
}

fn run(row: &str, method: &str, t_end: &str, count: usize) -> (f64, Cost) {
    // Common to all rows, without the BDF settings that one row has.
    let integrator = format!("integrator={{ method = \"{method}\", rtol = 1e-3, atol = {ATOL} }}");
    let scene = parameterized(row, t_end, count, Some(integrator));
    let outputs = outputs(&scene.scene).expect("it has a probe");
    let values = scene.values();
    let watcher = Watcher {
        interrupt: None,
        progress: &(),
    };
    let dependences = match count {
        0 => Default::default(),
        _ => scene.dependences(&values).expect("it has these numbers"),
    };
    let times = [scene.scene.t_end];
    let started = cpu_time::ThreadTime::now();
    let (_, cost) = follow(
        &scene.scene,
        &outputs,
        &times,
        (dependences, Precision::default()),
        watcher,
    )
    .expect("it runs");
    (started.elapsed().as_secs_f64(), cost)
}

/// Runs a row with its BDF settings.
fn by_idas(row: &str, t_end: &str, count: usize) -> (f64, u64, SensitivityStatistics) {
    let scene = parameterized(row, t_end, count, None);
    let body = scene.scene.body.as_ref().expect("it has a body");
    let dae = MuscleDae::new(body.muscle.clone(), body.formulation).expect("it is one");
    let options = ida::options(&dae, &body.settings);
    let solver = CondensedSolver::new(&dae, options.sparse).expect("it can be analyzed");
    let rest = vec![0.0; dae.layout().n_unknowns()];
    let t_end = scene.scene.t_end;
    let mut builder = IdaSolver::builder(dae)
        .options(IdaOptions {
            stop_time: Some(t_end),
            initial_step: Some(1e-6),
            ..options
        })
        .linear_solver(solver);
    if count > 0 {
        let dependences = scene.dependences(&scene.values()).expect("it has these");
        let options = SensitivityOptions {
            method: SensitivityMethod::Staggered,
            in_error_test: false,
        };
        let starts = vec![[rest.clone(), rest.clone()]; count];
        builder = builder.sensitivities(dependences, options, starts);
    }
    let mut solver = builder.build(0.0, &rest, &rest).expect("it starts");
    let started = cpu_time::ThreadTime::now();
    while solver.t() < t_end {
        if let Outcome::Stopped(stop) = solver.step(t_end).expect("it runs") {
            panic!("{stop}");
        }
    }
    let seconds = started.elapsed().as_secs_f64();
    (
        seconds,
        solver.statistics().steps,
        solver.sensitivity_statistics(),
    )
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let t_end = arguments.next().unwrap_or_else(|| "10".to_owned());
    let mut rows: Vec<String> = arguments.collect();
    if rows.is_empty() {
        rows = ["1", "2", "3", "4", "31"].map(str::to_owned).to_vec();
    }
    println!("row         method   steps  fact.   plain s   2: ratio solves   8: ratio solves");
    for row in rows.iter().map(|row| format!("table2-{row}")) {
        let row = &row;
        for method in ["radau9", "radau13"] {
            let (plain, of) = run(row, method, &t_end, 0);
            let (two, of_two) = run(row, method, &t_end, 2);
            let (eight, of_eight) = run(row, method, &t_end, 8);
            assert_eq!(
                of_two.factorizations, of_eight.factorizations,
                "no further factorizations for a parameter"
            );
            println!(
                "{row:11} {method:8} {:5} {:6} {plain:9.3} {:10.2} {:6} {:10.2} {:6}",
                of.steps,
                of.factorizations,
                two / plain,
                of_two.sensitivity_solves,
                eight / plain,
                of_eight.sensitivity_solves,
            );
        }
    }
    println!("row         IDAS      steps          plain s   2: ratio iters.   8: ratio iters.");
    for row in ["1", "2m", "31"].map(|row| format!("table2-{row}")) {
        let (plain, steps, _) = by_idas(&row, &t_end, 0);
        let [(two, _, of_two), (eight, _, of_eight)] =
            [2, 8].map(|count| by_idas(&row, &t_end, count));
        println!(
            "{row:11} bdf      {steps:6}        {plain:9.3} {:10.2} {:6} {:10.2} {:6}",
            two / plain,
            of_two.newton_iterations,
            eight / plain,
            of_eight.newton_iterations,
        );
    }
}
