//! `myovib table2`: the runs of the paper's Table 2, beside the paper's counts.

mod report;
pub mod rows;
pub(super) mod run_row;

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::Context;
use clap::Args;
use myovib_model::{Field, IntegratorKind, LinearSolver, MultiplierWeights, paper};

use crate::args::{self, CommonArgs};
use crate::exit::Exit;
use myovib_scene::InputError;
use myovib_scene::atomic_file;
use myovib_scene::mesh_file;
use myovib_scene::scene_file::integrator::MaxOrder;
use rows::{ROWS, Row};

/// The contract's settings that an option can change.
const T_END: f64 = 10.0;
const RTOL: f64 = 1e-3;
const ATOL_VELOCITY: f64 = 1e-5;

/// Options of `myovib table2`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib table2\n  \
    myovib table2 --rows 1,2m,3m,31 --json t2.json\n  \
    myovib table2 --rows 4 --max-order 2\n  \
    myovib table2 --integrator radau9 --rtol 1e-6\n  \
    myovib table2 --rows 1 --probe origin --every 0.01 --csv origin.csv\n\n\
    Exit code 1 when a run ends otherwise than the paper's."
)]
pub struct Table2Args {
    /// Rows to run, by key: 1, 2, 2m, 3, 3m, 4, 4-order2, 4-suppressed, 31; with Radau IIA 1, 2, 3,
    /// 4, 31, as the others differ from these in settings of BDF [default: all].
    #[arg(long, value_name = "KEYS", value_delimiter = ',')]
    pub rows: Vec<String>,

    /// Mesh (Gmsh 4.1 ASCII) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Integrator: `ida` (BDF), or Radau IIA of order 5, 9 or 13: `radau`, `radau9`, `radau13`.
    #[arg(long, value_name = "NAME", default_value = "ida", value_parser = args::integrator)]
    pub integrator: IntegratorKind,

    /// End time in s.
    #[arg(long, value_name = "T", default_value_t = T_END, value_parser = args::positive)]
    pub t_end: f64,

    /// Maximum BDF order of all rows, 1 to 5, or `auto`: what the damping of the fast modes allows
    /// [default: the row's].
    #[arg(long, value_name = "N", value_parser = max_order)]
    pub max_order: Option<MaxOrder>,

    /// What the error test leaves out: `none`, `default` (the row's with BDF, nothing with Radau
    /// IIA), or a list of q, v, lambda, mu.
    #[arg(long, value_name = "BLOCKS", default_value = "default")]
    pub suppress: Suppress,

    /// How the error test weighs multipliers that are in it: `plain` or `step-scaled` (IDAS).
    #[arg(long, value_name = "HOW", default_value = "plain", value_parser = multiplier_weights)]
    pub multiplier_weights: MultiplierWeights,

    /// Project onto the constraint and start again every T seconds (IDAS).
    #[arg(long, value_name = "T", value_parser = args::positive)]
    pub project_every: Option<f64>,

    /// Relative tolerance; Radau IIA takes the absolute ones in proportion.
    #[arg(long, value_name = "X", default_value_t = RTOL, value_parser = args::relative_tolerance)]
    pub rtol: f64,

    /// Absolute tolerance of the velocity in m/s [default: 1e-5, with Radau IIA in proportion].
    #[arg(long, value_name = "X", value_parser = args::positive)]
    pub atol_velocity: Option<f64>,

    /// How Newton's linear systems are solved: `condensed` or `full`.
    #[arg(long, value_name = "HOW", default_value = "condensed", value_parser = linear_solver)]
    pub linear_solver: LinearSolver,

    /// Write the table as CSV; with --probe, the probe's values instead.
    #[arg(long, value_name = "FILE", value_parser = args::output_file)]
    pub csv: Option<PathBuf>,

    /// Record u and p at this point (`origin`) into the CSV file; takes a single row.
    #[arg(long, value_name = "POINT", requires = "csv")]
    pub probe: Option<ProbePoint>,

    /// Time between two records of the probe in s.
    #[arg(
        long,
        value_name = "T",
        default_value_t = 0.01,
        value_parser = args::positive,
        requires = "probe"
    )]
    pub every: f64,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

fn linear_solver(name: &str) -> Result<LinearSolver, String> {
    let all = [LinearSolver::Condensed, LinearSolver::Full];
    args::by_name(&all, LinearSolver::name, name)
        .map_err(|names| format!("`{name}` is no linear solver: {names}"))
}

fn max_order(text: &str) -> Result<MaxOrder, String> {
    match text.parse() {
        _ if text == "auto" => Ok(MaxOrder::Auto),
        Ok(order) if (1..=5).contains(&order) => Ok(MaxOrder::Fixed(order)),
        _ => Err(format!("`{text}` is no order: 1 to 5, or auto")),
    }
}

fn multiplier_weights(name: &str) -> Result<MultiplierWeights, String> {
    let all = [MultiplierWeights::Plain, MultiplierWeights::StepScaled];
    args::by_name(&all, MultiplierWeights::name, name)
        .map_err(|names| format!("`{name}` is no way to weigh: {names}"))
}

/// A named point to record at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ProbePoint {
    /// The middle of the muscle, (0, 0).
    Origin,
}

/// What the error test leaves out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Suppress {
    /// As the row says with BDF; nothing with Radau IIA.
    Default,
    /// These blocks.
    Blocks(Vec<&'static str>),
}

impl FromStr for Suppress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const SYMBOLS: [&str; 4] = ["q", "v", "lambda", "mu"];
        match text {
            "default" => Ok(Self::Default),
            "none" => Ok(Self::Blocks(Vec::new())),
            list => list
                .split(',')
                .map(|word| {
                    SYMBOLS
                        .into_iter()
                        .find(|symbol| *symbol == word)
                        .ok_or_else(|| {
                            format!(
                                "`{word}` is no block: none, default, or a list of q, v, lambda, mu"
                            )
                        })
                })
                .collect::<Result<_, _>>()
                .map(Self::Blocks),
        }
    }
}

impl Suppress {
    /// The blocks that `integrator` leaves out of the error test of `row`.
    fn fields(&self, row: &Row, integrator: IntegratorKind) -> Vec<Field> {
        match self {
            Self::Default if integrator == IntegratorKind::Ida => row.suppressed.to_vec(),
            Self::Default => Vec::new(),
            Self::Blocks(symbols) => row
                .formulation
                .rows()
                .iter()
                .map(|(field, _)| *field)
                .filter(|field| symbols.contains(&field.symbol()))
                .collect(),
        }
    }
}

impl Table2Args {
    /// Whether a setting of the contract's table is overridden: the paper's outcomes then no longer
    /// are what is to be shown.
    fn is_modified(&self) -> bool {
        self.t_end != T_END
            || self.max_order.is_some()
            || self.integrator != IntegratorKind::Ida
            || self.suppress != Suppress::Default
            || self.multiplier_weights != MultiplierWeights::Plain
            || self.project_every.is_some()
            || self.rtol != RTOL
            || self.atol_velocity.is_some_and(|atol| atol != ATOL_VELOCITY)
            || self.mesh.is_some()
    }

    fn selected_rows(&self) -> Result<Vec<&'static Row>, InputError> {
        let bdf = self.integrator == IntegratorKind::Ida;
        let offered = || ROWS.iter().filter(|row| bdf || row.is_of_its_own());
        if self.rows.is_empty() {
            return Ok(offered().collect());
        }
        let select = |key: &String| {
            offered().find(|row| row.key == key).ok_or_else(|| {
                let keys: Vec<_> = offered().map(|row| row.key).collect();
                let known = ROWS.iter().any(|row| row.key == key);
                InputError::new(match known {
                    true => "this row differs from another one in settings of BDF alone",
                    false => "unknown row",
                })
                .at("--rows")
                .found(key)
                .allowed(keys.join(", "))
            })
        };
        self.rows.iter().map(select).collect()
    }

    /// Refuses options that Radau IIA does not have: they would do nothing.
    fn check_radau(&self) -> Result<(), InputError> {
        let weighted = self.multiplier_weights != MultiplierWeights::Plain;
        let given = [
            ("--max-order", self.max_order.is_some()),
            ("--multiplier-weights", weighted),
            ("--project-every", self.project_every.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) if self.integrator != IntegratorKind::Ida => {
                Err(InputError::new(format!("Radau IIA has no `{option}`"))
                    .at(option)
                    .next(format!("remove `{option}`, or take --integrator ida")))
            }
            _ => Ok(()),
        }
    }
}

/// Runs the rows and prints the table.
///
/// # Errors
/// Wrong options or mesh, or an output that cannot be written.
pub fn run(args: &Table2Args) -> anyhow::Result<Exit> {
    args.check_radau()?;
    let rows = args.selected_rows()?;
    if args.probe.is_some() && rows.len() != 1 {
        return Err(InputError::new("the CSV of a probe holds one run")
            .at("--probe")
            .found(format!("{} rows", rows.len()))
            .allowed("one row")
            .next("choose it, for example: --rows 1")
            .into());
    }
    let (mesh, mesh_name) = mesh_file::load(args.mesh.as_deref())?;
    // Before any run: the mesh may lack a group.
    paper::muscle(&mesh, f64::INFINITY, 0.0)
        .with_context(|| format!("the mesh `{mesh_name}` does not fit Table 2"))?;
    let results = run_row::run_all(&rows, &mesh, args)?;
    if let (Some(path), None) = (&args.csv, args.probe) {
        atomic_file::write(path, |file| report::write_csv(file, &results))
            .with_context(|| format!("cannot write `{}`", path.display()))?;
    }
    let text = report::text(&results, args);
    let document = report::document(&results, &mesh, &mesh_name, args);
    args.common.give("table2", &text, &document)?;
    Ok(report::exit(&results, args.is_modified()))
}
