//! `myovib infsup`: inf–sup constants of pairs of displacement and pressure spaces on refined meshes.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::inf_sup::{Level, Pair, levels};
use serde_json::{Value, json};

use super::table1::report_json;
use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::output;
use crate::values;
use myovib_report::plot::{Axis, Figure, LinePlot, Series};
use myovib_report::table::{Align, Table, colored_stdout};
use myovib_scene::mesh_file;
use myovib_scene::{InputError, Scene, builtin};

/// Options of `myovib infsup`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib infsup\n  \
    myovib infsup --levels 4 --plot infsup.svg\n  \
    myovib infsup leg.msh --fixed hip,foot --json\n  \
    myovib infsup land1 --levels 1 --set 'mesh.cells=[20,2,2]'")]
pub struct InfsupArgs {
    /// Mesh (Gmsh), or a scene (TOML file or built-in) for its mesh [default: the built-in
    /// spindle].
    #[arg(value_name = "MESH")]
    pub mesh: Option<PathBuf>,

    /// Groups with fixed nodes [default: `fixed`, or the groups that a scene fixes or moves].
    #[arg(long, value_name = "GROUPS", value_delimiter = ',')]
    pub fixed: Option<Vec<String>>,

    /// Change a value of the scene, as with `run`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Number of meshes: the mesh itself and its uniform refinements.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=6))]
    pub levels: u8,

    /// Plot the constants over the mesh size as SVG.
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub plot: Option<PathBuf>,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Results for one pair of spaces on all meshes.
struct Family {
    pair: Pair,
    levels: Vec<Level>,
}

/// Computes the constants and prints them.
pub fn run(args: &InfsupArgs) -> anyhow::Result<Exit> {
    let subject = Subject::of(args)?;
    let families = Pair::ALL
        .into_iter()
        .map(|pair| measure(pair, &subject, args))
        .collect::<anyhow::Result<Vec<_>>>()
        .with_context(|| format!("the mesh `{}`", subject.name))?;
    if let Some(path) = &args.plot {
        let drawing = figure(&families).render();
        output::save(path, drawing)?;
    }
    let elements = subject.mesh.shape().plural;
    let pairs = families.iter().map(|family| family_json(family, elements));
    let document = json!({
        "mesh": subject.name,
        "fixed": subject.fixed,
        "pairs": pairs.collect::<Vec<_>>(),
    });
    let text = text(&families, elements);
    args.common.print_or_write("infsup", &text, &document)?;
    Ok(Exit::Done)
}

/// Mesh and supports to be examined.
struct Subject {
    mesh: Mesh,
    name: String,
    fixed: Vec<String>,
}

impl Subject {
    fn of(args: &InfsupArgs) -> anyhow::Result<Self> {
        let path = args.mesh.as_deref();
        let fixed = args.fixed.clone();
        if let Some(path) = path.filter(|path| is_scene(path)) {
            return of_scene(path, &args.set, fixed);
        }
        if let Some(set) = args.set.first() {
            let error = InputError::new("`--set` changes only scenes, not meshes")
                .at(format!("--set {set}"));
            return Err(error.next("name a scene instead of a mesh").into());
        }
        let (mesh, name) = mesh_file::load(path)?;
        let fixed = fixed.unwrap_or_else(|| vec!["fixed".to_owned()]);
        Ok(Self { mesh, name, fixed })
    }
}

/// Returns whether the path is a TOML file or the name of a built-in scene.
fn is_scene(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|end| end == "toml");
    is_toml || (!path.exists() && path.to_str().is_some_and(|name| builtin::find(name).is_ok()))
}

/// Returns the mesh of a scene and its fixed groups. If `fixed` is `None`, these are the groups in which the scene
/// fixes or moves all components.
fn of_scene(path: &Path, set: &[String], fixed: Option<Vec<String>>) -> anyhow::Result<Subject> {
    let scene = Scene::load(path, set)?;
    let Some(body) = &scene.body else {
        return Err(InputError::new("the scene has no body").into());
    };
    let mesh = body.muscle.solid.space().mesh().clone();
    let file = scene.file();
    let held = file.fixed.iter();
    let held = held.map(|fixed| (&fixed.group, fixed.components.is_none()));
    let moved = file.prescribed_displacement.iter().map(|moved| {
        let given = [&moved.x, &moved.y, &moved.z];
        let count = given.into_iter().flatten().count();
        (&moved.group, count == mesh.dimension() || moved.rotation.is_some())
    });
    let all: Vec<_> = held.chain(moved).collect();
    if let (None, Some((group, _))) = (&fixed, all.iter().find(|(_, whole)| !whole)) {
        let error = InputError::new(format!(
            "the scene fixes only some components of `{group}`; this command requires all to be fixed"
        ));
        return Err(error
            .next("name the fixed groups with --fixed; `myovib check` computes the constant of the scene itself")
            .into());
    }
    let groups = || all.iter().map(|(group, _)| (*group).clone()).collect();
    Ok(Subject { name: path.display().to_string(), fixed: fixed.unwrap_or_else(groups), mesh })
}

/// Computes the constants on each mesh in turn. Before each mesh, a line is printed to standard error, because a fine
/// mesh takes minutes.
fn measure(pair: Pair, subject: &Subject, args: &InfsupArgs) -> anyhow::Result<Family> {
    let fixed: Vec<&str> = subject.fixed.iter().map(String::as_str).collect();
    let on_level = |level: usize, mesh: &Mesh| {
        if !args.common.quiet {
            let (n, plural) = (mesh.n_elements(), mesh.shape().plural);
            output::line(&format!("{pair}, level {level} of {}: {n} {plural}", args.levels));
        }
    };
    let n_levels = usize::from(args.levels);
    let levels = levels(pair, &subject.mesh, &fixed, n_levels, on_level)?;
    Ok(Family { pair, levels })
}

/// Describes the system (28) with κ = ∞ in these spaces: its index if B has full rank, otherwise the fact that it
/// cannot be integrated.
fn incompressible(level: &Level) -> String {
    match (&level.index, level.nullity) {
        (Some(report), _) => report.index.to_string(),
        (None, 0) => "3 (B has full rank)".into(),
        (None, nullity) => format!("no index ({nullity} uncontrolled pressures)"),
    }
}

/// Formats the results; `elements` names the elements of the mesh.
fn text(families: &[Family], elements: &'static str) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("spaces", Left),
        (elements, Right),
        ("pressures", Right),
        ("displacements", Right),
        ("inf–sup", Right),
        ("σ_min(B)", Right),
        ("uncontrolled", Right),
        ("index of (28) at κ = ∞", Left),
    ]);
    for family in families {
        for level in &family.levels {
            table.row([
                family.pair.to_string().into(),
                level.elements.to_string().into(),
                level.pressures.to_string().into(),
                level.displacements.to_string().into(),
                format!("{:.4}", level.constant).into(),
                format!("{:.2e}", level.sigma_min).into(),
                level.nullity.to_string().into(),
                incompressible(level).into(),
            ]);
        }
    }
    let mut text = table.render(colored_stdout());
    text.push_str(
        "\ninf–sup: the smallest non-zero constant of (27), pressures in the L2 norm, displacements in the H1 \
         seminorm; bounded\naway from zero for stable spaces. σ_min(B), the smallest non-zero singular value, decays \
         for all spaces. uncontrolled:\npressures that no displacement controls; if there are any and κ = ∞, the \
         pencil is singular and there is no index.\n",
    );
    text
}

fn figure(families: &[Family]) -> Figure {
    let series = families
        .iter()
        .map(|family| {
            let sizes: Vec<f64> = family.levels.iter().map(|level| level.mesh_size).collect();
            let constants: Vec<f64> = family.levels.iter().map(|level| level.constant).collect();
            Series::curve(family.pair.to_string(), &sizes, &constants).marked()
        })
        .collect();
    let plot = LinePlot {
        x: Axis::new("mesh size *h*", "m").logarithmic(),
        y: Axis::new("inf–sup constant", "").logarithmic(),
        series,
        ..LinePlot::default()
    };
    Figure::of("Inf–sup constants over the mesh size", plot)
}

/// Returns the levels of a pair of spaces. `elements` is the key for the number of elements. `regular` states whether
/// (28) with κ = ∞ has an index. `computed` is the index computed from the matrices, which is available only on coarse
/// meshes.
fn family_json(family: &Family, elements: &str) -> Value {
    let level = |level: &Level| {
        json!({
            elements: level.elements,
            "mesh_size": level.mesh_size,
            "pressures": level.pressures,
            "displacements": level.displacements,
            "nullity": level.nullity,
            "inf_sup": level.constant,
            "sigma_min": level.sigma_min,
            "regular": level.nullity == 0,
            "computed": level.index.as_ref().map(report_json),
        })
    };
    json!({
        "spaces": family.pair.to_string(),
        "levels": family.levels.iter().map(level).collect::<Vec<_>>(),
    })
}
