//! `myovib check`: what can be said of a scene before it is run.

use std::path::PathBuf;

use clap::Args;
use myovib_model::advice::Finding;
use myovib_model::check::{self, Computed, Factors, Report};
use myovib_model::{IntegratorKind, MuscleDae};
use serde::Serialize;

use super::table1::{ReportJson, report_json};
use crate::args::CommonArgs;
use crate::exit::Exit;
use myovib_report::table::{Align, Table, Tone, coloured_stdout, exponent, kappa, paint};
use myovib_scene::json;
use myovib_scene::scene_file::active::Tension;
use myovib_scene::scene_file::material::PronyTerm;
use myovib_scene::scene_file::solid::{Bed, Direction};
use myovib_scene::scene_file::{Analysis, SceneFile};
use myovib_scene::{Body, Scene, plain};

/// Options of `myovib check`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib check scene.toml\n  \
    myovib check table2-4\n  \
    myovib check scene.toml --set solid.kappa=inf --json\n\n\
    The first steps are taken, to time them; nothing is written. Warnings do not change the exit \
    code.")]
pub struct CheckArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Change a value of the scene, as in solid.kappa=inf; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Looks at the scene and says what is found.
///
/// # Errors
/// A wrong scene, or an output that cannot be written.
pub fn run(args: &CheckArgs) -> anyhow::Result<Exit> {
    args.common.grant_resources()?;
    let scene = Scene::load(&args.scene, &args.set)?;
    for note in scene.notes() {
        eprintln!("note: {}", myovib_scene::plain(&note));
    }
    let (text, document) = examine(&args.scene.display().to_string(), &scene)?;
    args.common.give("check", &text, &document)?;
    Ok(Exit::Done)
}

/// What can be said of the scene called `name`: for people, and the body of the JSON document.
///
/// # Errors
/// What the model cannot do with the scene.
pub fn examine(name: &str, scene: &Scene) -> anyhow::Result<(String, impl Serialize + use<>)> {
    let (text, body) = match (scene.file.analysis, &scene.body) {
        (Analysis::Dynamic, Some(body)) => {
            let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
            let start = body.initial_values(&mut dae)?;
            let report = check::check(&body.muscle, body.formulation, &body.settings, start)?;
            let text = text(scene, body, &report);
            (text, Some(document(body, &report)))
        }
        (Analysis::Dynamic, None) => (
            "The scene is right. Rods and chains are ordinary differential equations: index 0, \
             nothing to leave out of the error test.\n"
                .to_owned(),
            None,
        ),
        (Analysis::Static | Analysis::Modes, _) => (
            "The scene is right. Nothing is integrated in time: there is no index, and no error \
             test.\n"
                .to_owned(),
            None,
        ),
    };
    let scene = name.to_owned();
    Ok((text, Document { scene, body }))
}

fn text(scene: &Scene, body: &Body, report: &Report) -> String {
    let parameters = &body.muscle.parameters;
    let advice = &report.advice;
    let mut table = Table::new(&[
        ("unknowns", Align::Left),
        ("number", Align::Right),
        ("index", Align::Right),
        ("error test", Align::Left),
    ]);
    let leave_out = advice.to_leave_out();
    for ((field, number), (_, index)) in report.unknowns.iter().zip(advice.blocks()) {
        let tested = if body.settings.suppressed.contains(field) {
            "left out"
        } else {
            "in"
        };
        let advised = if leave_out.contains(field) {
            ", better left out"
        } else {
            ""
        };
        let advised = if tested == "in" { advised } else { "" };
        table.row([
            field.symbol().into(),
            number.to_string().into(),
            index.to_string().into(),
            format!("{tested}{advised}").into(),
        ]);
    }
    // Where materials differ, these are the largest.
    let is = if body.muscle.solid.is_graded() {
        "≤"
    } else {
        "="
    };
    let total: usize = report.unknowns.iter().map(|(_, number)| number).sum();
    let mut text = format!(
        "`{}`, κ {is} {}, β {is} {}: {total} unknowns\n\n{}\n",
        body.formulation,
        kappa(parameters.kappa()),
        exponent(parameters.beta),
        table.render(coloured_stdout())
    );
    let has_chains = !scene.chains.is_empty();
    for line in added(&scene.file)
        .into_iter()
        .chain(lines(body, report, has_chains))
    {
        text.push_str(&line);
        text.push('\n');
    }
    text.push('\n');
    text.push_str(&warnings(&report.findings));
    text
}

/// What is on beside the laws and the loads.
fn added(file: &SceneFile) -> Vec<String> {
    let mut lines = Vec::new();
    for material in &file.material {
        let place = material.group.as_deref().unwrap_or("everywhere");
        let own = [
            ("κ", material.kappa.map(|own| own.0), "Pa"),
            ("α", material.alpha, "1/s"),
            ("β", material.beta, "s"),
            ("η", material.eta, "Pa·s"),
        ];
        for (name, value, unit) in own {
            lines.extend(
                value.map(|value| format!("material        {place}: {name} = {value:e} {unit}")),
            );
        }
        let terms = material.prony.iter().flatten();
        lines.extend(terms.map(|term| {
            let PronyTerm { g, tau } = term;
            format!("material        {place}: stress relaxes, g = {g:e}, τ = {tau:e} s")
        }));
        lines.extend(material.active.as_ref().map(|active| match active.tension {
            Tension::Given { .. } => format!("contraction     {place}: by a given tension"),
            Tension::Bestel { contractility, .. } => {
                format!("contraction     {place}: by Bestel's equation, σ0 = {contractility:e} Pa")
            }
        }));
    }
    let beds = file.bed.iter().map(|bed| {
        let along = match bed.along {
            Direction::All => "in all directions",
            Direction::Normal => "along the normal",
        };
        let Bed {
            group,
            stiffness,
            damping,
            ..
        } = bed;
        format!("bed             {group}: k = {stiffness:e} Pa/m, c = {damping:e} Pa·s/m, {along}")
    });
    lines.extend(beds);
    lines.iter().map(|line| plain(line)).collect()
}

fn lines(body: &Body, report: &Report, has_chains: bool) -> Vec<String> {
    let place = match report.computed_on {
        Computed::Here => "computed from the scene's matrices",
        Computed::OnCoarseBeam => {
            "by the rule of the formulation; computed on a coarse beam with the same parameters"
        }
    };
    let mut lines = vec![
        format!(
            "index           {}, {place}: {}, narrowest gap {:.1} decades",
            report.advice.index(),
            report.computed.index,
            report.computed.gap
        ),
        match report.held {
            Some(held) => format!(
                "inf–sup         {:.3}, {} pressures not held",
                held.inf_sup, held.nullity
            ),
            None => {
                "inf–sup         not computed for so many pressures; `myovib infsup` tells it of a \
                     mesh"
                    .to_owned()
            }
        },
    ];
    for block in &report.residuals {
        lines.push(format!("start           {block}"));
    }
    let slow: Vec<String> = report
        .slow_modes
        .iter()
        .map(|f| format!("{f:.2}"))
        .collect();
    let drive = report
        .drive
        .map_or("none".to_owned(), |f| format!("{f} Hz"));
    lines.push(format!(
        "modes           {} Hz, …, {:.0} Hz; load {drive}",
        slow.join(", "),
        report.fastest_mode
    ));
    if body.settings.integrator == IntegratorKind::Ida {
        lines.push(format!(
            "BDF order       {} at most: beyond it modes faster than the steps resolve would grow",
            report.advice.max_order()
        ));
    }
    if let Some(factors) = report.factors {
        let Factors {
            matrices, needs, ..
        } = factors;
        lines.push(format!(
            "memory          {} for the factors of {matrices} {} with {:.1e} entries; a set-up takes {:.1e} operations",
            size(needs.bytes),
            if matrices == 1 { "matrix" } else { "matrices" },
            needs.entries as f64,
            needs.flops,
        ));
    }
    let cost = report.cost;
    if (cost.steps * cost.seconds_per_step).is_finite() {
        let total = match cost.steps * cost.seconds_per_step {
            seconds if seconds < 0.1 => "less than 0.1 s".to_owned(),
            seconds => format!("{seconds:.1} s"),
        };
        let whose = match has_chains {
            true => ", of the muscle alone: a chain asks for steps of its own, often far smaller",
            false => "",
        };
        lines.push(format!(
            "cost            about {:.0} steps to t = {} s, {:.2e} s each: {total}{whose}",
            cost.steps.ceil(),
            body.settings.t_end,
            cost.seconds_per_step,
        ));
    }
    lines
}

/// A size of memory for people.
fn size(bytes: usize) -> String {
    let mebibytes = bytes as f64 / f64::from(1 << 20);
    if mebibytes < 1024.0 {
        format!("{mebibytes:.0} MiB")
    } else {
        format!("{:.1} GiB", mebibytes / 1024.0)
    }
}

fn warnings(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return "No objections.\n".into();
    }
    let warning = paint("warning", Tone::Bad, coloured_stdout());
    findings
        .iter()
        .map(|finding| format!("{warning}: {finding}\n"))
        .collect()
}

#[derive(Serialize)]
struct Document {
    scene: String,
    /// Null for a scene without a body, or without motion.
    body: Option<BodyJson>,
}

#[derive(Serialize)]
struct BodyJson {
    formulation: &'static str,
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    beta: f64,
    unknowns: usize,
    blocks: Vec<BlockJson>,
    /// By the rule of the formulation.
    index: u8,
    computed: ReportJson,
    computed_on: &'static str,
    /// Null for more pressures than can be looked at in seconds, as `nullity`.
    inf_sup: Option<f64>,
    nullity: Option<usize>,
    initial_residual: Vec<ResidualJson>,
    slow_modes: Vec<f64>,
    fastest_mode: f64,
    drive: Option<f64>,
    advised_max_order: u8,
    /// Null where the full matrix is factorised.
    factors: Option<FactorsJson>,
    expected_steps: f64,
    expected_seconds: f64,
    warnings: Vec<WarningJson>,
}

#[derive(Serialize)]
struct FactorsJson {
    matrices: usize,
    entries: usize,
    bytes: usize,
    /// In use before they are computed; null where the system does not tell.
    bytes_before: Option<usize>,
    operations: f64,
}

#[derive(Serialize)]
struct BlockJson {
    field: &'static str,
    unknowns: usize,
    index: u8,
    left_out: bool,
    better_left_out: bool,
}

#[derive(Serialize)]
struct ResidualJson {
    field: &'static str,
    largest: f64,
    relative: f64,
    worst: String,
}

#[derive(Serialize)]
struct WarningJson {
    problem: String,
    fields: Vec<&'static str>,
    remedies: Vec<String>,
}

fn document(body: &Body, report: &Report) -> BodyJson {
    let leave_out = report.advice.to_leave_out();
    let blocks = report.unknowns.iter().zip(report.advice.blocks());
    let blocks = blocks.map(|((field, unknowns), (_, index))| BlockJson {
        field: field.symbol(),
        unknowns: *unknowns,
        index,
        left_out: body.settings.suppressed.contains(field),
        better_left_out: leave_out.contains(field),
    });
    let residual = |block: &myovib_model::start::BlockResidual| ResidualJson {
        field: block.field.symbol(),
        largest: block.largest,
        relative: block.relative,
        worst: block.worst.clone(),
    };
    let warning = |finding: &Finding| WarningJson {
        problem: finding.problem.clone(),
        fields: finding.fields.iter().map(|field| field.symbol()).collect(),
        remedies: finding.remedies.iter().map(ToString::to_string).collect(),
    };
    BodyJson {
        formulation: body.formulation.name(),
        kappa: body.muscle.parameters.kappa(),
        beta: body.muscle.parameters.beta,
        unknowns: report.unknowns.iter().map(|(_, number)| number).sum(),
        blocks: blocks.collect(),
        index: report.advice.index(),
        computed: report_json(&report.computed),
        computed_on: match report.computed_on {
            Computed::Here => "scene",
            Computed::OnCoarseBeam => "coarse-beam",
        },
        inf_sup: report.held.map(|held| held.inf_sup),
        nullity: report.held.map(|held| held.nullity),
        initial_residual: report.residuals.iter().map(residual).collect(),
        slow_modes: report.slow_modes.clone(),
        fastest_mode: report.fastest_mode,
        drive: report.drive,
        advised_max_order: report.advice.max_order(),
        factors: report.factors.map(|factors| FactorsJson {
            matrices: factors.matrices,
            entries: factors.needs.entries,
            bytes: factors.needs.bytes,
            bytes_before: factors.in_use,
            operations: factors.needs.flops,
        }),
        expected_steps: report.cost.steps,
        expected_seconds: report.cost.steps * report.cost.seconds_per_step,
        warnings: report.findings.iter().map(warning).collect(),
    }
}
