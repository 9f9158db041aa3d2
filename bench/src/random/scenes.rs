//! Random scenes: a beam under loads with pulses, ramps and tables.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use myovib_scene::scene_file::integrator::Method;
use rand::prelude::*;
use rand_chacha::ChaCha8Rng;

/// End time of all scenes, s.
const T_END: f64 = 1.0;

/// A scene that was drawn.
pub(super) struct Drawn {
    pub(super) number: u64,
    pub(super) method: Method,
    pub(super) formulation: &'static str,
    pub(super) rtol: f64,
    text: String,
    /// The tables that loads are read from.
    tables: Vec<String>,
}

impl Drawn {
    /// Scene `number` of a seed.
    pub(super) fn new(seed: u64, number: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number);
        let rng = &mut rng;
        let is_incompressible = rng.random_bool(0.4);
        let beta = if rng.random_bool(0.5) {
            decade(rng, -5.0, -3.0)
        } else {
            0.0
        };
        let formulations: &[&str] = match (is_incompressible, beta > 0.0) {
            (false, false) => &["position", "velocity", "displacement"],
            (true, false) => &["velocity", "stabilized", "position"],
            (_, true) => &["implicit-rate", "rate"],
        };
        let formulation = formulations.choose(rng).expect("there are some");
        let method = *[Method::Bdf, Method::Radau, Method::Radau9, Method::Radau13]
            .choose(rng)
            .expect("there are some");
        let rtol = 10_f64.powi(-rng.random_range(3..=7));
        let kappa = match is_incompressible {
            true => "inf".to_owned(),
            false => format!("{:e}", decade(rng, 4.5, 6.5)),
        };
        let alpha = rng.random_range(0.0..5.0);
        let mut tables = Vec::new();
        let (x, y) = (load(rng, &mut tables), load(rng, &mut tables));
        let text = format!(
            "title = \"Random scene {number} of seed {seed}\"\n\
             [time]\nend = {T_END}\n\
             [mesh]\ntype = \"beam\"\nlength = 0.1\nheight = 0.02\ncells = [6, 2]\n\
             [solid]\nkappa = {kappa}\nalpha = {alpha}\nbeta = {beta:e}\n\
             formulation = \"{formulation}\"\n\
             [[material]]\n{law}\ndensity = 1.1e3\n\
             [[fixed]]\ngroup = \"fixed\"\n\
             [[traction]]\ngroup = \"load\"\nx = {x}\ny = {y}\n\
             [integrator]\nmethod = \"{method}\"\nrtol = {rtol:e}\nmax_cpu = 60.0\n\
             [[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.1, 0.01]\nevery = 0.005\n\
             quantities = [{quantities}]\n",
            law = law(rng),
            method = name(method),
            quantities = match *formulation {
                "displacement" => "\"u\"",
                _ => "\"u\", \"p\"",
            },
        );
        Self {
            number,
            method,
            formulation,
            rtol,
            text,
            tables,
        }
    }

    /// The scene as its file has it.
    #[cfg(test)]
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Writes the scene and its tables.
    pub(super) fn write(&self, folder: &Path) -> anyhow::Result<()> {
        fs::create_dir_all(folder)?;
        fs::write(folder.join("scene.toml"), &self.text)?;
        for (i, table) in self.tables.iter().enumerate() {
            fs::write(folder.join(table_name(i)), table)?;
        }
        Ok(())
    }

    /// What makes of the scene the run that is believed: another method, a hundred times tighter.
    pub(super) fn trusted(&self) -> [String; 3] {
        let method = match self.method {
            Method::Radau13 => Method::Radau9,
            _ => Method::Radau13,
        };
        let rtol = (self.rtol * 1e-2).min(1e-7);
        [
            format!("integrator.method={}", name(method)),
            format!("integrator.rtol={rtol:e}"),
            "integrator.max_cpu=600".to_owned(),
        ]
    }
}

fn name(method: Method) -> &'static str {
    match method {
        Method::Bdf => "bdf",
        Method::Radau => "radau",
        Method::Radau9 => "radau9",
        Method::Radau13 => "radau13",
    }
}

fn table_name(number: usize) -> String {
    format!("load-{number}.csv")
}

/// A number between two powers of ten.
fn decade(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    10_f64.powf(rng.random_range(low..high))
}

fn law(rng: &mut ChaCha8Rng) -> String {
    let modulus = rng.random_range(1.5e4..3e4);
    match rng.random_range(0..4) {
        0 => format!(
            "law = \"mooney-rivlin\"\nc10 = {:e}\nc01 = 2e2",
            0.5 * modulus
        ),
        1 => format!("law = \"neo-hooke\"\nshear_modulus = {modulus:e}"),
        2 => format!("law = \"deviatoric-st-venant-kirchhoff\"\nshear_modulus = {modulus:e}"),
        _ => format!("law = \"small-strain\"\nshear_modulus = {modulus:e}"),
    }
}

/// A sum of one to three parts, in Pa.
fn load(rng: &mut ChaCha8Rng, tables: &mut Vec<String>) -> String {
    let n = rng.random_range(1..=3);
    let parts: Vec<String> = (0..n).map(|_| part(rng, tables)).collect();
    format!("{{ type = \"sum\", of = [{}] }}", parts.join(", "))
}

fn part(rng: &mut ChaCha8Rng, tables: &mut Vec<String>) -> String {
    let value = rng.random_range(-20.0..20.0);
    let start = rng.random_range(0.05..0.8);
    match rng.random_range(0..5) {
        // A pulse: up, and down again.
        0 => {
            let (rise, length) = (decade(rng, -3.0, -1.5), decade(rng, -2.0, -0.8));
            let step = |value: f64, start: f64| {
                format!("{{ type = \"step\", value = {value}, start = {start}, rise = {rise} }}")
            };
            format!(
                "{}, {}",
                step(value, start),
                step(-value, start + rise + length)
            )
        }
        1 => {
            let end = start + decade(rng, -3.0, -1.0);
            format!("{{ type = \"ramp\", value = {value}, start = {start}, end = {end} }}")
        }
        2 => {
            let frequency = rng.random_range(1.0..12.0);
            format!("{{ type = \"ramped-sine\", amplitude = {value}, frequency = {frequency} }}")
        }
        3 => format!("{{ type = \"step\", value = {value}, start = {start}, rise = 0.05 }}"),
        _ => {
            let file = table_name(tables.len());
            tables.push(table(rng, value, start));
            format!("{{ type = \"table\", file = \"{file}\", column = \"value\" }}")
        }
    }
}

/// A bell of some milliseconds in a table at 1 kHz, else zero.
fn table(rng: &mut ChaCha8Rng, value: f64, at: f64) -> String {
    let width = rng.random_range(2e-3..2e-2);
    let mut text = "t,value\n".to_owned();
    for i in 0..=1000 {
        let t = f64::from(i) * 1e-3;
        let s = (t - at) / width;
        let bell = if s.abs() < 1.0 {
            (1.0 - s * s).powi(3)
        } else {
            0.0
        };
        writeln!(text, "{t},{}", value * bell).expect("a String takes all that is written");
    }
    text
}
