//! Work against precision: every formulation, several ways to integrate, several tolerances.

use myovib_fem::Mesh;
use myovib_model::{
    Formulation, Limits, MuscleDae, Outcome, Probe, Settings, Statistics, paper, run as run_model,
    start_at_rest,
};
use serde::Serialize;

use super::cases::{Case, Way, selected};
use super::reference::{Errors, Reference, Trajectory};
use super::rival::{self, RivalPoint};
use super::{BenchArgs, fastest, give, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_cli::progress::Progress;
use myovib_report::plot::{Axis, Figure, LinePlot, Panel, Series};
use myovib_report::table::{Align, Cell, Table, Tone, coloured_stdout};
use myovib_scene::atomic_file;

/// One point of the diagram; a failed run is one, too.
#[derive(Debug, Serialize)]
struct PointJson {
    case: &'static str,
    formulation: &'static str,
    way: &'static str,
    rtol: f64,
    outcome: &'static str,
    reason: Option<&'static str>,
    t_reached: f64,
    errors: Option<Errors>,
    /// The order p of error in u_y ∝ steps⁻ᵖ, from the tolerance before to this one.
    observed_order: Option<f64>,
    cpu_seconds: f64,
    steps: u64,
    error_test_failures: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    repeats: u32,
    claimed: Vec<(&'static str, Errors)>,
    points: &'a [PointJson],
    rival: &'a [RivalPoint],
    best: Vec<Best<'a>>,
}

/// The cheapest way to an accuracy in u_y.
#[derive(Serialize)]
struct Best<'a> {
    case: &'a str,
    accuracy: f64,
    formulation: &'a str,
    way: &'a str,
    rtol: f64,
    cpu_seconds: f64,
}

/// Accuracies for which the cheapest way is named.
const ACCURACIES: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];

pub(super) fn run(args: &BenchArgs, mesh: &Mesh) -> anyhow::Result<Exit> {
    let cases = selected(&args.cases)?;
    let rival = rival::read(args.rival.as_deref())?;
    let progress = Progress::new(args.common.quiet);
    let (mut points, mut claimed) = (Vec::new(), Vec::new());
    let mut end = args.t_end.unwrap_or(f64::INFINITY);
    for case in &cases {
        let reference = Reference::load(case, args.references.as_deref())?;
        end = end.min(reference.t_end());
        claimed.push((case.name, reference.claimed));
        let runs = Runs {
            case,
            reference: &reference.trajectory,
            args,
            mesh,
        };
        for &formulation in case.formulations {
            for way in Way::ALL {
                points.extend(runs.curve(formulation, way, end, &progress)?);
            }
        }
    }
    drop(progress);
    if let Some(path) = &args.svg {
        let svg = diagram(&points, &rival, &cases).render();
        atomic_file::save(path, svg)?;
    }
    let best = best(&points);
    let text = text(&points, &rival, &best);
    let document = Document {
        machine: Machine::found(),
        t_end: end,
        repeats: args.repeats,
        claimed,
        points: &points,
        rival: &rival,
        best,
    };
    give(args, &text, &document)
}

/// p of error ∝ steps⁻ᵖ through two points (error, steps).
fn observed_order(((error, steps), (next_error, next_steps)): ((f64, f64), (f64, f64))) -> f64 {
    (error / next_error).ln() / (next_steps / steps).ln()
}

/// What the runs of a case share.
pub(super) struct Runs<'a> {
    pub(super) case: &'a Case,
    pub(super) reference: &'a Trajectory,
    pub(super) args: &'a BenchArgs,
    pub(super) mesh: &'a Mesh,
}

impl Runs<'_> {
    /// The points of a way to solve a formulation, tolerance by tolerance.
    fn curve(
        &self,
        formulation: Formulation,
        way: Way,
        t_end: f64,
        progress: &Progress,
    ) -> anyhow::Result<Vec<PointJson>> {
        let (case, mut before) = (self.case.name, None);
        let mut points = Vec::new();
        for &rtol in self.args.tolerances.iter().take_while(|_| goes_on()) {
            progress.show(|| format!("{case}: {formulation}, {} at {rtol:e}", way.name()));
            let settings = way.settings(formulation, rtol, t_end);
            let (statistics, errors) = self.measure(formulation, &settings)?;
            let now = errors.map(|errors| (errors.u_y, statistics.counts.steps as f64));
            let observed_order = before.zip(now).map(observed_order);
            before = now;
            points.push(PointJson {
                case,
                formulation: formulation.name(),
                way: way.name(),
                rtol,
                outcome: statistics.outcome.name(),
                reason: statistics.outcome.reason().map(|reason| reason.name()),
                t_reached: statistics.t_reached,
                errors,
                observed_order,
                cpu_seconds: statistics.cpu_seconds,
                steps: statistics.counts.steps,
                error_test_failures: statistics.counts.error_test_failures,
                residual_evaluations: statistics.counts.residual_evaluations,
                linear_setups: statistics.counts.linear_setups,
            });
        }
        Ok(points)
    }

    /// The fastest of the repeats, with the errors of its solution if it got to the end.
    pub(super) fn measure(
        &self,
        formulation: Formulation,
        settings: &Settings,
    ) -> anyhow::Result<(Statistics, Option<Errors>)> {
        let once = || self.once(formulation, settings);
        fastest(self.args.repeats, once, |(statistics, _)| {
            statistics.cpu_seconds
        })
    }

    fn once(
        &self,
        formulation: Formulation,
        settings: &Settings,
    ) -> anyhow::Result<(Statistics, Option<Errors>)> {
        let muscle = paper::muscle(self.mesh, self.case.kappa, self.case.beta)?;
        let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
        let dae = MuscleDae::new(muscle, formulation)?;
        let mut trajectory = Trajectory::default();
        let mut recorder = trajectory.recorder(&dae, &origin, settings.t_end);
        let mut limits = Limits::new(self.args.cap, None);
        let mut integrator = start_at_rest(dae, settings)?;
        let statistics = run_model(integrator.as_mut(), &mut [&mut recorder, &mut limits])?;
        drop(recorder);
        let solid = &integrator.problem().muscle().solid;
        let errors = (statistics.outcome == Outcome::Finished)
            .then(|| trajectory.errors(self.reference, solid));
        Ok((statistics, errors))
    }
}

fn best(points: &[PointJson]) -> Vec<Best<'_>> {
    let mut cases: Vec<&str> = points.iter().map(|point| point.case).collect();
    cases.dedup();
    let mut best = Vec::new();
    for case in cases {
        for accuracy in ACCURACIES {
            let reaches = |point: &&PointJson| {
                point.case == case && point.errors.is_some_and(|e| e.u_y <= accuracy)
            };
            let cheapest = points
                .iter()
                .filter(reaches)
                .min_by(|a, b| a.cpu_seconds.total_cmp(&b.cpu_seconds));
            best.extend(cheapest.map(|point| Best {
                case,
                accuracy,
                formulation: point.formulation,
                way: point.way,
                rtol: point.rtol,
                cpu_seconds: point.cpu_seconds,
            }));
        }
    }
    best
}

fn text(points: &[PointJson], rival: &[RivalPoint], best: &[Best<'_>]) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("case", Left),
        ("formulation", Left),
        ("way", Left),
        ("rtol", Right),
        ("error u_y", Right),
        ("p", Right),
        ("u, L2", Right),
        ("p, L2", Right),
        ("order", Right),
        ("CPU s", Right),
        ("steps", Right),
        ("residuals", Right),
        ("set-ups", Right),
        ("outcome", Left),
    ]);
    let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.1e}"));
    for point in points {
        let errors = point.errors;
        let outcome = match point.reason {
            None => Cell::new(point.outcome, Tone::Plain),
            Some(reason) => Cell::new(
                format!("{}: {reason} at t = {:.3}", point.outcome, point.t_reached),
                Tone::Bad,
            ),
        };
        let mut cells: Vec<Cell> = [
            point.case.to_owned(),
            point.formulation.to_owned(),
            point.way.to_owned(),
            format!("{:.0e}", point.rtol),
            number(errors.map(|e| e.u_y)),
            number(errors.and_then(|e| e.p)),
            number(errors.map(|e| e.displacement_l2)),
            number(errors.and_then(|e| e.pressure_l2)),
            point
                .observed_order
                .map_or(String::new(), |order| format!("{order:.1}")),
            format!("{:.2}", point.cpu_seconds),
            point.steps.to_string(),
            point.residual_evaluations.to_string(),
            point.linear_setups.to_string(),
        ]
        .map(Cell::from)
        .into();
        cells.push(outcome);
        table.row(cells);
    }
    let mut text = table.render(coloured_stdout());
    text.push_str(&rival::text(rival));
    text.push('\n');
    for b in best {
        text.push_str(&format!(
            "{}: u_y to {:.0e} cheapest by {} with {} at rtol {:.0e}, {:.2} s\n",
            b.case, b.accuracy, b.formulation, b.way, b.rtol, b.cpu_seconds
        ));
    }
    text
}

/// One panel for each formulation of each case, one curve for each way: CPU time over the error of
/// u_y.
fn diagram(points: &[PointJson], rival: &[RivalPoint], cases: &[&Case]) -> Figure {
    let formulations = |case: &&Case| case.formulations.iter().map(|f| f.name());
    let panels = cases
        .iter()
        .flat_map(|case| formulations(case).map(|name| panel(points, rival, case.name, name)))
        .collect();
    Figure {
        width_mm: 170.0,
        n_columns: 2,
        ..Figure::column("Work and precision", panels)
    }
}

fn panel(
    points: &[PointJson],
    rival: &[RivalPoint],
    case: &str,
    formulation: &str,
) -> Box<dyn Panel> {
    let series = Way::ALL.iter().map(|way| {
        let of_curve = points.iter().filter(|point| {
            point.case == case && point.formulation == formulation && point.way == way.name()
        });
        let (x, y): (Vec<_>, Vec<_>) = of_curve
            .filter_map(|point| Some((point.errors?.u_y, point.cpu_seconds)))
            .unzip();
        Series::curve(way.name(), &x, &y).marked()
    });
    Box::new(LinePlot {
        title: format!("{case}: {formulation}"),
        x: Axis::new("relative error of *u*_{*y*}(0, 0)", "").logarithmic(),
        y: Axis::new("CPU time", "s").logarithmic(),
        series: series
            .chain(rival::curves(rival, case, formulation))
            .collect(),
    })
}
