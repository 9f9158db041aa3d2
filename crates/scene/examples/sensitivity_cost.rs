//! What sensitivities cost: runs of the paper's equations by Radau IIA with no, two and eight
//! parameters.
//! `cargo run --release -p myovib-scene --example sensitivity_cost [T_END [ROW…]]`
use myovib_scene::sensitivity::{Cost, Parametrised, follow, outputs};
use myovib_scene::watch::Watcher;

/// Eight parameters of all kinds, the first two of which are the two.
const KEYS: [(&str, f64); 8] = [
    ("material[0].c10", 1e4),
    ("traction[0].y.amplitude", 100.0),
    ("material[0].c01", 2e2),
    ("solid.kappa", 1e-5),
    ("material[0].density", 1.1e3),
    ("solid.alpha", 1.0),
    ("solid.beta", 1e-4),
    ("traction[0].y.frequency", 8.0),
];

/// The absolute tolerances of Table 2.
const ATOL: &str = "{ displacement = 1e-5, velocity = 1e-5, pressure = 0.1, multiplier = 5.0 }";

fn run(row: &str, method: &str, t_end: &str, count: usize) -> (f64, Cost) {
    let list: Vec<String> = KEYS[..count.max(1)]
        .iter()
        .map(|(key, scale)| format!("{{ key = \"{key}\", scale = {scale:e} }}"))
        .collect();
    let set = [
        format!("parameter=[{}]", list.join(", ")),
        // Of all rows, without the settings of BDF that one has.
        format!("integrator={{ method = \"{method}\", rtol = 1e-3, atol = {ATOL} }}"),
        format!("time.end={t_end}"),
    ];
    let scene = Parametrised::load(row.as_ref(), &set).expect("the scene is built in");
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
    let (_, cost) =
        follow(&scene.scene, &outputs, &times, (dependences, None), watcher).expect("it runs");
    (started.elapsed().as_secs_f64(), cost)
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
                "no further factorisations for a parameter"
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
}
