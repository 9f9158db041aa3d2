//! `myovib table2`: runs the scenes of the paper's Table 2 and compares their counts with the paper's.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use myovib_model::{Formulation, IntegratorKind, Settings};
use myovib_report::table2::{self, ROWS, Row, RowRun, Verdict};
use myovib_scene::result_folder::{FolderRequest, remove_temporary_files};
use myovib_scene::run::{Existing, RunOptions, compute};
use myovib_scene::{InputError, Scene, atomic_file, parallel};
use serde_json::json;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::output;
use crate::overrides::{self, change};
use crate::progress::Progress;
use crate::values;

/// Options of `myovib table2`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib table2\n  \
    myovib table2 --rows 1,2m,3m,31 --json=t2.json\n  \
    myovib table2 --rows 4 --max-order 2\n  \
    myovib table2 --integrator radau9 --rtol 1e-6\n  \
    myovib table2 --rows 1 --probe origin --every 0.01 --csv origin.csv\n\n\
    The exit code is 1 if a run ends differently from the paper's.")]
pub struct Table2Args {
    /// Keys of the rows to run: 1, 2, 2m, 3, 3m, 4, 4-order2, 4-suppressed, 31. Radau IIA has the
    /// rows 1, 2, 3, 4 and 31, because the others differ only in settings of BDF [default: all].
    #[arg(long, value_name = "KEYS", value_delimiter = ',')]
    pub rows: Vec<String>,

    /// Mesh (Gmsh) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Integrator: `bdf`, or Radau IIA of order 5, 9 or 13: `radau5`, `radau9`, `radau13`.
    #[arg(long, value_name = "NAME", default_value = "bdf", value_parser = table2_integrator)]
    pub integrator: IntegratorKind,

    /// End time in s [default: 10].
    #[arg(long, value_name = "T", value_parser = values::positive)]
    pub t_end: Option<f64>,

    /// Maximum BDF order of all rows, 1 to 5, or `auto`: determined by the damping of the fast
    /// modes [default: the row's].
    #[arg(long, value_name = "N", value_parser = max_order)]
    pub max_order: Option<String>,

    /// Blocks excluded from the error test: `none`, `default` (the row's with BDF, none with Radau
    /// IIA), or a list of q, v, lambda, mu.
    #[arg(long, value_name = "BLOCKS", default_value = "default")]
    pub suppress: Suppress,

    /// Relative tolerance; with Radau IIA, absolute tolerances are scaled in proportion [default:
    /// 1e-3].
    #[arg(long, value_name = "X", value_parser = values::relative_tolerance)]
    pub rtol: Option<f64>,

    /// Absolute tolerance of the velocity in m/s [default: 1e-5; scaled with Radau IIA].
    #[arg(long, value_name = "X", value_parser = values::positive)]
    pub atol_velocity: Option<f64>,

    /// Write the table as CSV, or the values of the probe with --probe.
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub csv: Option<PathBuf>,

    /// Record u and p at this point (`origin`) in the CSV file; requires a single row.
    #[arg(long, value_name = "POINT", requires = "csv")]
    pub probe: Option<ProbePoint>,

    /// Sampling interval of the probe in s.
    #[arg(
        long,
        value_name = "T",
        default_value_t = 0.01,
        value_parser = values::positive,
        requires = "probe"
    )]
    pub every: f64,

    /// Change a value in the scenes of all rows, for example `integrator.projection_interval=0.1`; may be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Keep the run folders, `table2-KEY` for each row, in this folder.
    #[arg(long, value_name = "DIR", value_parser = values::output_folder)]
    pub out: Option<PathBuf>,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Parses the name of an integrator. `ida`, the solver used for the paper's table, is another name of `bdf`.
fn table2_integrator(name: &str) -> Result<IntegratorKind, String> {
    match name {
        "ida" => Ok(IntegratorKind::Bdf),
        _ => values::integrator(name),
    }
}

fn max_order(text: &str) -> Result<String, String> {
    match text.parse() {
        _ if text == "auto" => Ok("\"auto\"".to_owned()),
        Ok(1..=5) => Ok(text.to_owned()),
        _ => Err(format!("`{text}` is not an order: must be 1 to 5, or auto")),
    }
}

/// Named point at which values are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ProbePoint {
    /// Center of the muscle, (0, 0), where the scenes of the rows have their probe.
    Origin,
}

/// Blocks to be excluded from the error test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Suppress {
    /// With BDF, the blocks that the row excludes; with Radau IIA, none.
    Default,
    /// These blocks, given by their names in scenes.
    Blocks(Vec<&'static str>),
}

impl FromStr for Suppress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let block = |word: &str| match word {
            "q" => Ok("u"),
            "v" => Ok("v"),
            "lambda" => Ok("p"),
            "mu" => Ok("p_rate"),
            word => Err(format!(
                "`{word}` is not a block: must be none, default, or a list of q, v, lambda, mu"
            )),
        };
        match text {
            "default" => Ok(Self::Default),
            "none" => Ok(Self::Blocks(Vec::new())),
            list => list.split(',').map(block).collect::<Result<_, _>>().map(Self::Blocks),
        }
    }
}

/// Returns overrides that scale the paper's absolute tolerances in proportion to `rtol`.
fn in_proportion(rtol: f64) -> String {
    let paper = Settings::paper(Formulation::Rate).with_relative_tolerance(rtol);
    let atol = paper.absolute_tolerances;
    change(
        "integrator.atol",
        format!(
            "{{ u = {:e}, v = {:e}, p = {:e}, p_rate = {:e} }}",
            atol.displacement, atol.velocity, atol.pressure, atol.multiplier
        ),
    )
}

impl Table2Args {
    fn is_bdf(&self) -> bool {
        self.integrator == IntegratorKind::Bdf
    }

    /// Returns the overrides that apply the options to the scenes of all rows.
    fn overrides(&self) -> Vec<String> {
        let mut set = match self.integrator {
            IntegratorKind::Bdf => Vec::new(),
            kind => overrides::integrator(kind),
        };
        set.extend(self.mesh.as_deref().map(overrides::mesh));
        set.extend(self.t_end.map(overrides::end));
        if let Some(rtol) = self.rtol {
            set.push(change("integrator.rtol", format!("{rtol:e}")));
            // With BDF, the rows keep the paper's absolute tolerances.
            if !self.is_bdf() {
                set.push(in_proportion(rtol));
            }
        }
        let velocity = self.atol_velocity;
        set.extend(velocity.map(|v| change("integrator.atol.v", format!("{v:e}"))));
        if let Some(order) = &self.max_order {
            set.push(change("integrator.max_order", order));
        }
        if let Suppress::Blocks(blocks) = &self.suppress {
            set.push(change("integrator.error_test.exclude", json!(blocks)));
        }
        set.extend(self.set.iter().cloned());
        set
    }

    fn selected_rows(&self) -> Result<Vec<Row>, InputError> {
        let offered = || {
            let rows = ROWS.iter().copied();
            rows.filter(|row| self.is_bdf() || row.is_distinct())
        };
        if self.rows.is_empty() {
            return Ok(offered().collect());
        }
        let select = |key: &String| {
            offered().find(|row| row.key == key).ok_or_else(|| {
                let keys: Vec<_> = offered().map(|row| row.key).collect();
                let known = ROWS.iter().any(|row| row.key == key);
                InputError::new(match known {
                    true => "this row differs from another row only in BDF settings",
                    false => "unknown row",
                })
                .at("--rows")
                .found(key)
                .allowed(keys.join(", "))
            })
        };
        self.rows.iter().map(select).collect()
    }

    /// Rejects options that have no effect.
    fn check(&self, rows: &[Row]) -> Result<(), InputError> {
        if self.max_order.is_some() && !self.is_bdf() {
            return Err(InputError::new("Radau IIA has no `--max-order`")
                .at("--max-order")
                .next("remove `--max-order`, or use --integrator bdf"));
        }
        if self.probe.is_some() && rows.len() != 1 {
            return Err(InputError::new("the CSV file of a probe can contain only one run")
                .at("--probe")
                .found(format!("{} rows", rows.len()))
                .allowed("one row")
                .next("choose it, for example: --rows 1"));
        }
        Ok(())
    }
}

/// Runs the rows and prints the table.
pub fn run(args: &Table2Args) -> anyhow::Result<Exit> {
    let rows = args.selected_rows()?;
    args.check(&rows)?;
    let set = args.overrides();
    // Only the requested probe is recorded.
    let probe = match args.probe {
        Some(_) => format!("probe[0].interval={:e}", args.every),
        None => "probe=[]".to_owned(),
    };
    let set_of_runs = [&set[..], &[probe]].concat();
    let load = |row: &Row| Scene::built_in(&row.scene(), &set_of_runs);
    let scenes = rows.iter().map(load).collect::<Result<Vec<Scene>, _>>();
    let scenes = match &args.mesh {
        Some(mesh) => {
            scenes.with_context(|| format!("cannot run Table 2 on {}", mesh.display()))?
        }
        None => scenes?,
    };
    let shared = std::env::temp_dir();
    // Folders that are less than a minute old may belong to other programs that have not opened them yet.
    remove_temporary_files(&shared, Duration::from_secs(60));
    let temporary = atomic_file::temporary_folder(&shared);
    let temporary = temporary.context("cannot create a folder for the runs")?;
    let folder = args.out.as_deref().unwrap_or(temporary.path());
    let folders = rows.iter().map(|row| row.scene()).collect();
    let _open = FolderRequest::to_add(folder, "table2", folders).open()?;
    let runs = compute_all(args, &rows, &scenes, folder)?;

    let is_modified = !set.is_empty();
    if let Some(path) = &args.csv {
        let text = match args.probe {
            Some(_) => {
                let origin = folder.join(rows[0].scene()).join("origin.csv");
                fs::read_to_string(&origin)
                    .with_context(|| format!("cannot read `{}`", origin.display()))?
            }
            None => table2::csv(&runs),
        };
        output::save(path, text)?;
    }
    let mesh = args.mesh.as_ref();
    let mesh = mesh.map_or("muscle.msh (built in)".to_owned(), |m| m.display().to_string());
    args.common.print_or_write(
        "table2",
        &table2::text(&runs, is_modified),
        &table2::document(&runs, &mesh, is_modified),
    )?;
    Ok(match table2::verdict(&runs, is_modified) {
        Verdict::Done => Exit::Done,
        Verdict::Differs => Exit::Differs,
        Verdict::Stopped => Exit::Stopped,
        Verdict::Interrupted => Exit::Interrupted,
    })
}

/// Runs the scenes on all available threads. Returns the results in the order of the table.
fn compute_all(
    args: &Table2Args,
    rows: &[Row],
    scenes: &[Scene],
    folder: &Path,
) -> anyhow::Result<Vec<RowRun>> {
    let progress = Progress::new(args.common.quiet);
    let jobs: Vec<(&Row, &Scene)> = rows.iter().zip(scenes).collect();
    let runs = parallel::map(&jobs, args.common.n_threads(), |(row, scene)| {
        let options = RunOptions {
            existing: Existing::Overwrite,
            interrupt: Some(interrupt::flag()),
            progress: &progress,
            ..RunOptions::into_folder(folder.join(row.scene()))
        };
        let result =
            compute(scene, &options).with_context(|| format!("row {} of Table 2", row.key))?;
        Ok(RowRun { row: **row, document: result.document })
    });
    runs.into_iter().collect()
}
