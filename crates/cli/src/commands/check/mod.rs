//! `myovib check`: inspects a scene before it is run.

mod cost;
mod document;
mod quasi_static;
mod response;
mod statics;
mod writes;

use std::path::PathBuf;

use clap::Args;
use myovib_fem::ElementScale;
use myovib_model::advice::Finding;
use myovib_model::check::{self, Computed, FactorizationCost, Held, Report, Size};
use myovib_model::{Field, IntegratorKind, MuscleDae};
use serde::Serialize;
use serde_json::json;

use self::cost::Cost;
use self::document::Document;
use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::output;
use myovib_report::table::{Align, Table, Tone, colored_stdout, counted, exponent, kappa, paint};
use myovib_scene::run::{initial, rehearse, try_out, try_period};
use myovib_scene::scene_file::active::Tension;
use myovib_scene::scene_file::material::PronyTerm;
use myovib_scene::scene_file::solid::{Direction, ElasticFoundation, Spring};
use myovib_scene::scene_file::start::InitialState;
use myovib_scene::scene_file::{Analysis, SceneFile};
use myovib_scene::sensitivity::SceneParameter;
use myovib_scene::watch::Watcher;
use myovib_scene::{Body, Scene, plain};

/// Options of `myovib check`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib check scene.toml\n  \
    myovib check table2-4\n  \
    myovib check scene.toml --set solid.bulk_modulus=inf --json\n\n\
    Prints each block of unknowns with its index, and whether the integrator tests its error; the size of the body; \
    the index of the system; how well the pressures are controlled (inf–sup); whether the initial state satisfies the \
    equations; eigenfrequencies; the first steps of the run, computed for one second of CPU time; then warnings with \
    suggested changes. For an equilibrium: the displacement according to linear elasticity, and the time per \
    iteration. To exclude the pressure p from the error test, use `--set \
    'integrator.error_test.exclude=[\"p\"]'`.\n\n\
    Writes no files. Warnings do not change the exit code.")]
pub struct CheckArgs {
    /// Scene: a TOML file or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Change a value of the scene, for example solid.bulk_modulus=inf; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Inspects the scene and prints the findings.
pub fn run(args: &CheckArgs) -> anyhow::Result<Exit> {
    let scene = Scene::load(&args.scene, &args.set)?;
    for note in scene.notes() {
        output::note(&note);
    }
    let (text, document) = examine(&args.scene.display().to_string(), &scene)?;
    args.common.print_or_write("check", &text, &document)?;
    Ok(Exit::Done)
}

/// Inspects the scene called `name`. Returns the text and the body of the JSON document.
pub fn examine(name: &str, scene: &Scene) -> anyhow::Result<(String, impl Serialize + use<>)> {
    SceneParameter::all(scene)?;
    rehearse(scene)?;
    let unusual = scene.unusual();
    let mut document = Document {
        scene: name.to_owned(),
        size: scene.body.as_ref().map(|body| {
            document::size(&Size::of(&body.muscle), &body.volumes(scene.file().material.len()))
        }),
        ..Document::default()
    };
    let text = match (scene.file().analysis, &scene.body) {
        (Analysis::Static, Some(body)) => {
            let mut report = check::check_static(&body.muscle, body.formulation, scene.t_end)?;
            report.findings.extend(unusual);
            document.equilibrium = Some(statics::document(&report));
            statics::text(scene, body, &report)
        }
        (Analysis::Dynamic, Some(body)) => {
            let start = {
                let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
                initial(body, &mut dae, Watcher::NOBODY)?
            };
            let mut report =
                check::check(&body.muscle, body.formulation, &body.settings, Some(start))?;
            report.findings.extend(unusual);
            let cost = match report.step_time {
                Some(seconds) => Cost::Predicted(seconds),
                None => Cost::Tried(try_out(scene)?),
            };
            document.body = Some(document::document(scene, body, &report, &cost));
            text(scene, body, &report, &cost)
        }
        (Analysis::Dynamic, None) => {
            "The scene is valid. Rods and chains are ordinary differential equations: index 0, nothing to exclude \
             from the error test.\n"
                .to_owned()
        }
        (Analysis::Response, Some(body)) => {
            let (text, response) = response::examine(scene, body)?;
            document.response = Some(response);
            text + &warnings(&unusual)
        }
        (Analysis::QuasiStatic, Some(body)) => {
            let mut report =
                check::check_quasi_static(&body.muscle, body.formulation, &body.settings)?;
            report.findings.extend(unusual);
            let cost = Cost::Tried(try_out(scene)?);
            document.quasi_static = Some(quasi_static::document(body, &report, &cost));
            quasi_static::text(scene, body, &report, &cost)
        }
        (analysis, body) => {
            document.modes =
                body.is_some().then(|| json!({ "warnings": document::warnings(&unusual) }));
            let size = body.as_ref().map(|body| size_of(scene, body));
            let size = size.unwrap_or_default();
            let method = match analysis {
                Analysis::Periodic => {
                    let trial = try_period(scene)?;
                    let line = cost::of_period(&trial);
                    document.periodic = Some(trial);
                    line
                }
                _ => "Nothing is integrated in time: index and error test do not apply.".to_owned(),
            };
            format!("The scene is valid. {method}\n{size}\n{}", warnings(&unusual))
        }
    };
    Ok((text, document))
}

fn text(scene: &Scene, body: &Body, report: &Report, cost: &Cost) -> String {
    let parameters = &body.muscle.parameters;
    let to_exclude = report.advice.to_exclude();
    let mut rows = Vec::new();
    for (field, number) in &report.unknowns {
        let tested = match body.settings.suppressed.contains(field) {
            true => "excluded",
            false if to_exclude.contains(field) => "included; exclude it",
            false => "in",
        };
        let index = body.formulation.variable_index(*field, parameters);
        rows.push((in_words(*field).to_owned(), *number, index, tested));
    }
    for chain in &scene.chains {
        let tested = match scene.file().integrator.oscillators.in_error_test {
            true => "in",
            false => "excluded",
        };
        let name = format!("chain {}", chain.name);
        rows.push((plain(&name), chain.n_unknowns(), 0, tested));
    }
    let total: usize = rows.iter().map(|row| row.1).sum();
    let mut text = format!(
        "`{}`, κ {} {}, β {} {}: {total} unknowns\n\n{}\n",
        body.formulation,
        bound(body, |ratios| ratios.kappa),
        kappa(parameters.kappa()),
        bound(body, |ratios| ratios.beta),
        exponent(parameters.beta),
        table(rows)
    );
    for line in [size_of(scene, body)]
        .into_iter()
        .chain(added(scene.file()))
        .chain(lines(body, report))
        .chain(preload(scene.file()))
        .chain([cost.line(scene)])
        .chain(writes::lines(scene))
    {
        text.push_str(&line);
        text.push('\n');
    }
    text.push('\n');
    text.push_str(&warnings(&report.findings));
    text
}

/// Formats the blocks of unknowns: name, number of unknowns, index, and role in the error test.
fn table(rows: impl IntoIterator<Item = (String, usize, u8, &'static str)>) -> String {
    let mut table = Table::new(&[
        ("unknowns", Align::Left),
        ("number", Align::Right),
        ("index", Align::Right),
        ("error test", Align::Left),
    ]);
    for (name, number, index, tested) in rows {
        table.row([name, number.to_string(), index.to_string(), tested.to_owned()].map(Into::into));
    }
    table.render(colored_stdout())
}

/// Describes the effect of a preload on the modes; the listed modes are the modes at rest.
fn preload(file: &SceneFile) -> Option<String> {
    let is_loaded = matches!(file.initial_state, Some(InitialState::Equilibrium));
    is_loaded.then(|| {
        "preload         changes the modes: `myovib modes --set modes.preload_time=0` includes it"
            .to_owned()
    })
}

/// Returns `=` if all elements have the parameter of the body, otherwise `≤`, because the parameter of the body is the
/// maximum over its elements.
fn bound(body: &Body, of: impl Fn(ElementScale) -> f64) -> &'static str {
    let solid = &body.muscle.solid;
    let mut ratios =
        (0..solid.space().n_elements()).map(|element| of(solid.element_scale(element)));
    match ratios.any(|ratio| ratio != 1.0) {
        true => "≤",
        false => "=",
    }
}

/// Describes a block of unknowns, including its letter in messages and statistics.
fn in_words(field: Field) -> &'static str {
    match field {
        Field::Displacement => "displacement u",
        Field::Velocity => "velocity v",
        Field::Pressure => "pressure p",
        Field::PressureRate => "pressure rate p_rate",
        Field::GglMultiplier => "multiplier p_rate",
        Field::Tension => "tension",
        Field::InternalStress => "internal stress",
    }
}

/// Lists the active features other than material laws and loads.
fn added(file: &SceneFile) -> Vec<String> {
    let mut lines = Vec::new();
    for material in &file.material {
        let place = material.group.as_deref().unwrap_or("everywhere");
        let own = [
            ("κ", material.bulk_modulus.map(|own| own.0), "Pa"),
            ("α", material.rayleigh_mass, "1/s"),
            ("β", material.rayleigh_stiffness, "s"),
            ("η", material.viscosity, "Pa·s"),
        ];
        for (name, value, unit) in own {
            lines.extend(
                value.map(|value| format!("material        {place}: {name} = {value:e} {unit}")),
            );
        }
        let terms = material.prony.iter().flatten();
        lines.extend(terms.map(|term| {
            let PronyTerm { relative_modulus: g, relaxation_time: tau } = term;
            format!("material        {place}: stress relaxes, g = {g:e}, τ = {tau:e} s")
        }));
        lines.extend(material.active.as_ref().map(|active| match active.tension {
            Tension::Given { .. } => format!("contraction     {place}: by a prescribed tension"),
            Tension::Coherence {
                ref chain,
                at_zero_coherence: zero,
                at_full_coherence: full,
                ..
            } => format!(
                "contraction     {place}: by the coherence of `{chain}`, {zero:e} to {full:e} Pa"
            ),
            Tension::Bestel { contractility, .. } => {
                format!("contraction     {place}: by Bestel's equation, σ0 = {contractility:e} Pa")
            }
        }));
    }
    let foundations = file.elastic_foundation.iter().map(|foundation| {
        let along = match foundation.along {
            Direction::All => "in all directions",
            Direction::Normal => "along the normal",
        };
        let ElasticFoundation { group, stiffness, damping, .. } = foundation;
        format!("foundation      {group}: k = {stiffness:e} Pa/m, c = {damping:e} Pa·s/m, {along}")
    });
    lines.extend(foundations);
    lines.extend(file.spring.iter().map(|spring| {
        let Spring { at, stiffness, damping, .. } = spring;
        format!("spring          at {at:?}: k = {stiffness:e} N/m, c = {damping:e} N·s/m")
    }));
    lines.iter().map(|line| plain(line)).collect()
}

fn lines(body: &Body, report: &Report) -> Vec<String> {
    let place = match report.computed_on {
        Computed::Here => "computed from the scene's matrices",
        Computed::OnCoarseMesh => {
            "by the rule for this formulation; computed on a coarse mesh with the same parameters"
        }
    };
    let mut lines = vec![
        format!(
            "index           {}, {place}: {}, narrowest gap {:.1} decades",
            report.advice.index(),
            report.computed.index,
            report.computed.gap
        ),
        held(report.held),
    ];
    let contacts = body.muscle.contacts.iter();
    lines.extend(contacts.map(|contact| {
        let (group, stiffness) = (plain(contact.group()), contact.stiffness());
        format!("contact         {group}: rigid obstacle, k = {stiffness:.3e} Pa/m")
    }));
    let residuals = report.residuals.iter();
    if residuals.clone().all(|block| block.relative <= check::INCONSISTENT) {
        lines.push("start           all equations hold at t = 0".to_owned());
    } else {
        lines.extend(
            residuals.map(|block| format!("start           not satisfied at t = 0: {block}")),
        );
    }
    let slow: Vec<String> = report.slow_modes.iter().map(|f| format!("{f:.2}")).collect();
    let drive = match report.drive {
        Some(f) => format!("the load at {f} Hz"),
        None => "no oscillating load".to_owned(),
    };
    lines.push(match slow.is_empty() {
        true if report.too_large_for_modes => {
            format!(
                "modes           not computed for a body of this size; use `myovib modes`; {drive}"
            )
        }
        true => format!(
            "modes           not computed because the pressures are not determined; {drive}"
        ),
        false => format!(
            "modes           at rest, the lowest at {} Hz, the highest at {:.0} Hz; {drive}",
            slow.join(", "),
            report.fastest_mode
        ),
    });
    if body.muscle.solid.laws().iter().any(|law| law.is_one_sided_at_rest()) {
        lines.push(
            "fibers          only resist tension; the modes at rest treat all of them as stretched, so real motions \
             are slower"
                .to_owned(),
        );
    }
    let sweeps = report.sweeps.iter();
    lines.extend(sweeps.filter_map(|&range| passed(range, &report.slow_modes)));
    if body.settings.integrator == IntegratorKind::Bdf {
        lines.push(format!(
            "BDF order       at most {}: at higher orders, modes too fast for the steps to resolve would grow",
            report.advice.max_order()
        ));
    }
    lines.extend(report.factors.map(memory));
    lines
}

/// Formats the extents, volume, mass and mesh of the body, and the sizes of the groups that the scene selects.
fn size_of(scene: &Scene, body: &Body) -> String {
    let space = body.muscle.solid.space();
    let areas = scene.file().group.iter().filter_map(|group| {
        let facets = space.mesh().facets(&group.name).ok()?;
        let area: f64 = space.quadrature(&group.name).ok()?.iter().map(|(_, weight)| weight).sum();
        let unit = if space.dimension() == 2 { "m" } else { "m²" };
        let name = plain(&group.name);
        Some(format!(
            "\ngroup           {name}: {area:.2e} {unit} in {}",
            counted(facets.len(), "facet")
        ))
    });
    let Size { extents, volume, mass, elements, nodes } = Size::of(&body.muscle);
    let (unit, depth) = match extents.len() {
        2 => ("m²", " per meter of depth"),
        _ => ("m³", ""),
    };
    let materials = &scene.file().material;
    let parts = materials.iter().zip(body.volumes(materials.len())).filter(|_| materials.len() > 1);
    let parts = parts.enumerate().map(|(i, (material, volume))| {
        let name = material.group.as_deref().map_or_else(|| "others".to_owned(), plain);
        let mass = material.density * volume;
        format!(
            "\nmaterial {:<6} {name}: {volume:.3e} {unit}, {mass:.3e} kg{depth}",
            format!("[{i}]")
        )
    });
    let sides: Vec<String> = extents.iter().map(|side| check::readable(*side)).collect();
    format!(
        "body            {} m, {volume:.3e} {unit}, {mass:.3e} kg{depth}{}\n\
         mesh            {elements} {}, {nodes} nodes{}",
        sides.join(" by "),
        parts.collect::<String>(),
        space.mesh().shape().plural,
        areas.collect::<String>()
    )
}

/// Lists the modes whose frequencies a sweep passes. Returns `None` if the modes are unknown.
fn passed([low, high]: [f64; 2], slow_modes: &[f64]) -> Option<String> {
    let above = *slow_modes.last()?;
    let within = slow_modes.iter().filter(|mode| (low..=high).contains(*mode));
    let within: Vec<String> = within.map(|f| format!("{f:.2}")).collect();
    let passes = match (within.join(", "), high > above) {
        (within, false) if within.is_empty() => "passes no mode".to_owned(),
        (within, true) if within.is_empty() => format!("may pass modes above {above:.2} Hz"),
        (within, false) => format!("passes the modes at {within} Hz"),
        (within, true) => format!("passes the modes at {within} Hz, and perhaps higher ones"),
    };
    Some(format!("sweep           from {low} to {high} Hz {passes}"))
}

/// Describes how well the displacements constrain the pressures.
fn held(held: Option<Held>) -> String {
    match held {
        Some(Held {
            inf_sup,
            nullity: 0,
        }) => {
            format!("inf–sup         {inf_sup:.3}, all pressures controlled by displacements")
        }
        Some(Held { inf_sup, nullity }) => {
            format!(
                "inf–sup         {inf_sup:.3}, {} not controlled by displacements",
                counted(nullity, "pressure")
            )
        }
        None => {
            "inf–sup         not computed: too many pressures; use `myovib infsup` with a coarser mesh"
                .to_owned()
        }
    }
}

/// Formats the predicted memory for the factors and for the whole run.
fn memory(factors: FactorizationCost) -> String {
    let FactorizationCost { matrices, needs, in_use } = factors;
    let peak = in_use
        .map_or(String::new(), |in_use| format!("{} at the peak: ", size(in_use + needs.bytes)));
    format!(
        "memory          {peak}{} for the factors of {matrices} {} with {:.1e} entries; a matrix setup costs {:.1e} operations",
        size(needs.bytes),
        if matrices == 1 { "matrix" } else { "matrices" },
        needs.entries as f64,
        needs.flops,
    )
}

/// Formats a memory size.
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
    let warning = paint("warning", Tone::Bad, colored_stdout());
    findings.iter().map(|finding| format!("{warning}: {finding}\n")).collect()
}
