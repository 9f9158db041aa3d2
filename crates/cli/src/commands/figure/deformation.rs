//! Figure 5: two snapshots of the deformed muscle.
//!
//! The paper does not state the times of its snapshots. We choose the two times in the last period of the load at which
//! the displacement of the origin is largest and smallest.

use anyhow::Context;

use super::deformed::Drawing;
use super::mesh;
use super::muscle_run::MuscleRun;
use super::product::Product;
use myovib_report::plot::{Figure, Panel};

/// Time and displacement of every node.
type Snapshot = (f64, Vec<[f64; 2]>);

fn drawing<'a>(
    run: &'a MuscleRun,
    snapshots: impl IntoIterator<Item = &'a Snapshot>,
) -> anyhow::Result<Drawing<'a>> {
    let groups = vec![mesh::fixed(&run.space)?];
    let displacements = snapshots.into_iter().map(|(_, u)| &u[..]);
    Ok(Drawing::of(&run.space, groups, displacements))
}

/// Draws the last period of the run, one picture per sample.
pub(in crate::commands) fn frames(run: &MuscleRun) -> anyhow::Result<Vec<Figure>> {
    let drawing = drawing(run, run.last_period.iter())?;
    let frame = |(t, u): &Snapshot| Figure::of("", drawing.panel(*t, u, drawing.size(u)));
    Ok(run.last_period.iter().map(frame).collect())
}

pub(super) fn draw(run: &MuscleRun) -> anyhow::Result<Product> {
    let (highest, lowest) = extremes(run).context("the run ended before its first step")?;
    let snapshots = [highest, lowest];
    let drawing = drawing(run, snapshots)?;
    let panel =
        |(t, u): &Snapshot| Box::new(drawing.panel(*t, u, drawing.size(u))) as Box<dyn Panel>;
    let panels = snapshots.into_iter().map(panel).collect();

    let points = run.space.node_points();
    let rows = (0..points.len())
        .map(|i| [points[i], snapshots[0].1[i], snapshots[1].1[i]].concat())
        .collect();
    let findings = vec![
        ("t_highest", snapshots[0].0.into()),
        ("t_lowest", snapshots[1].0.into()),
        ("largest_displacement", drawing.largest.into()),
        ("scale", drawing.scale.into()),
    ];
    Ok(Product {
        number: 5,
        figure: Figure::column("Two snapshots of the deformed muscle", panels),
        columns: ["x", "y", "u_x_highest", "u_y_highest", "u_x_lowest", "u_y_lowest"]
            .map(String::from)
            .into(),
        rows,
        findings,
        run: run.document()?,
        exit: run.exit(),
    })
}

/// Returns the two snapshots of the last period in which the origin is highest and lowest.
fn extremes(run: &MuscleRun) -> Option<(&Snapshot, &Snapshot)> {
    let height_at = |time: f64| {
        let row = run.origin.iter().rev().find(|row| row[0] <= time);
        row.map_or(f64::NAN, |row| row[2])
    };
    let by_height = |a: &&Snapshot, b: &&Snapshot| height_at(a.0).total_cmp(&height_at(b.0));
    Some((run.last_period.iter().max_by(by_height)?, run.last_period.iter().min_by(by_height)?))
}
