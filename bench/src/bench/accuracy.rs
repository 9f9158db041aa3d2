//! What an accuracy of u_y at the origin costs over the whole run of Table 2, way by way.

use myovib_fem::Mesh;
use myovib_model::{Formulation, paper};
use serde::Serialize;

use super::cases::{Way, selected};
use super::reference::compute;
use super::work::Runs;
use super::{BenchArgs, give, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_cli::progress::Progress;
use myovib_report::table::{Align, Cell, Table, coloured_stdout};

/// Accuracies of u_y, relative to its maximum.
const TARGETS: [f64; 3] = [1e-3, 1e-4, 1e-6];
/// The ways compared: BDF beyond order 2 is unstable without damping.
const WAYS: [Way; 4] = [Way::Bdf2, Way::Radau, Way::Radau9, Way::Radau13];
/// The largest steps of the two references, s.
const STEPS: [f64; 2] = [1e-2, 5e-3];
/// Relative tolerances tried, from the loosest.
const TOLERANCES: i32 = 15;

/// The loosest tolerance, by half decades, with which a way reaches a target.
#[derive(Debug, Serialize)]
struct Reached {
    case: &'static str,
    formulation: &'static str,
    way: &'static str,
    target: f64,
    rtol: f64,
    error: f64,
    cpu_seconds: f64,
    steps: u64,
    newton_iterations: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    repeats: u32,
    claimed: &'a [(&'static str, f64)],
    reached: &'a [Reached],
}

pub(super) fn run(args: &BenchArgs, mesh: &Mesh) -> anyhow::Result<Exit> {
    let t_end = args.t_end.unwrap_or(10.0);
    let progress = Progress::new(args.common.quiet);
    let (mut reached, mut claimed) = (Vec::new(), Vec::new());
    for case in selected(&args.cases)?.into_iter().take_while(|_| goes_on()) {
        progress.show(|| format!("{}: reference", case.name));
        let coarse = compute(case, mesh, STEPS[0], t_end)?;
        let reference = compute(case, mesh, STEPS[1], t_end)?;
        let solid = paper::muscle(mesh, case.kappa, case.beta)?.solid;
        claimed.push((case.name, coarse.errors(&reference, &solid).u_y));
        let runs = Runs {
            case,
            reference: &reference,
            args,
            mesh,
        };
        for &formulation in case.formulations {
            for way in WAYS {
                progress.show(|| format!("{}: {formulation}, {}", case.name, way.name()));
                reached.extend(descend(&runs, formulation, way)?);
            }
        }
    }
    drop(progress);
    let document = Document {
        machine: Machine::found(),
        t_end,
        repeats: args.repeats,
        claimed: &claimed,
        reached: &reached,
    };
    give(args, &text(&reached, &claimed), &document)
}

/// Tightens the tolerance until the last target is reached, or a run stops or takes too long.
fn descend(runs: &Runs<'_>, formulation: Formulation, way: Way) -> anyhow::Result<Vec<Reached>> {
    let t_end = runs.reference.times.last().copied().unwrap_or(0.0);
    let mut reached: Vec<Reached> = Vec::new();
    for k in (0..TOLERANCES).take_while(|_| goes_on()) {
        let rtol = 10f64.powf(-2.0 - 0.5 * f64::from(k));
        let settings = way.settings(formulation, rtol, t_end);
        let (statistics, errors) = runs.measure(formulation, &settings)?;
        let Some(errors) = errors else {
            // A loose tolerance may stop where a tighter one does not, but not for lack of time.
            match statistics.cpu_seconds > runs.args.cap {
                true => break,
                false => continue,
            }
        };
        // The targets fall, so those reached before come first.
        let left = TARGETS[reached.len()..].iter().copied();
        for target in left.take_while(|target| errors.u_y <= *target) {
            reached.push(Reached {
                case: runs.case.name,
                formulation: formulation.name(),
                way: way.name(),
                target,
                rtol,
                error: errors.u_y,
                cpu_seconds: statistics.cpu_seconds,
                steps: statistics.counts.steps,
                newton_iterations: statistics.counts.newton_iterations,
                residual_evaluations: statistics.counts.residual_evaluations,
                linear_setups: statistics.counts.linear_setups,
            });
        }
        if reached.len() == TARGETS.len() {
            break;
        }
    }
    Ok(reached)
}

fn text(reached: &[Reached], claimed: &[(&'static str, f64)]) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("case", Left),
        ("formulation", Left),
        ("way", Left),
        ("target", Right),
        ("rtol", Right),
        ("error u_y", Right),
        ("CPU s", Right),
        ("steps", Right),
        ("Newton it.", Right),
        ("residuals", Right),
        ("set-ups", Right),
    ]);
    for r in reached {
        table.row(
            [
                r.case.to_owned(),
                r.formulation.to_owned(),
                r.way.to_owned(),
                format!("{:.0e}", r.target),
                format!("{:.1e}", r.rtol),
                format!("{:.1e}", r.error),
                format!("{:.2}", r.cpu_seconds),
                r.steps.to_string(),
                r.newton_iterations.to_string(),
                r.residual_evaluations.to_string(),
                r.linear_setups.to_string(),
            ]
            .map(Cell::from),
        );
    }
    let mut text = table.render(coloured_stdout());
    text.push_str("\nErrors of the references, by two step sizes:");
    for (case, error) in claimed {
        text.push_str(&format!(" {case} {error:.0e}"));
    }
    text.push_str(".\nA way without a line did not get there within the time or the tolerances.\n");
    text
}
