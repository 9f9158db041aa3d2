//! Figure 5: two snapshots of the deformed muscle.
//!
//! The paper names no times. Ours are those of the last period of the load at which the origin is
//! highest and lowest.

use anyhow::Context;

use super::mesh;
use super::muscle_run::MuscleRun;
use super::product::Product;
use crate::plot::{Axis, Field, Figure, MeshPlot, Panel};

/// How far the largest displacement reaches in the drawing, in parts of the body's height.
const REACH: f64 = 0.3;

/// Air above and below what moves, in parts of the body's height.
const AIR: f64 = 0.08;

/// A time with the displacement of every node.
type Snapshot = (f64, Vec<[f64; 2]>);

/// What all pictures of one run share.
struct Drawing<'a> {
    run: &'a MuscleRun,
    /// The largest displacement, m.
    largest: f64,
    /// What displacements are multiplied with.
    scale: f64,
}

impl<'a> Drawing<'a> {
    fn of<'s>(run: &'a MuscleRun, snapshots: impl IntoIterator<Item = &'s Snapshot>) -> Self {
        let all = snapshots.into_iter().flat_map(|(_, u)| u.iter().map(size));
        let largest = all.fold(0.0, f64::max);
        Self {
            run,
            largest,
            scale: if largest > 0.0 {
                round_down(REACH * height(run) / largest)
            } else {
                // A run interrupted at rest.
                1.0
            },
        }
    }

    fn panel(&self, (t, displacement): &Snapshot) -> anyhow::Result<MeshPlot> {
        let Self {
            run,
            largest,
            scale,
        } = *self;
        let reach = scale * largest + AIR * height(run);
        let bottom = extent(run, 1, f64::min) - reach;
        let top = extent(run, 1, f64::max) + reach;
        let outline = mesh::outline(&run.space);
        Ok(MeshPlot {
            title: format!("*t* = {t:.4} s"),
            y: outline.y.clone().between(bottom, top),
            groups: vec![mesh::fixed(&run.space)?],
            displacement: displacement.clone(),
            scale,
            field: Some(Field {
                axis: Axis::new("|*u*|", "m").between(0.0, largest),
                values: displacement.iter().map(size).collect(),
            }),
            ..outline
        })
    }
}

fn size(u: &[f64; 2]) -> f64 {
    u[0].hypot(u[1])
}

/// The last period of the run, picture by picture.
pub(in crate::commands) fn frames(run: &MuscleRun) -> impl Iterator<Item = anyhow::Result<Figure>> {
    let drawing = Drawing::of(run, &run.last_period);
    run.last_period
        .iter()
        .map(move |snapshot| Ok(Figure::of("", drawing.panel(snapshot)?)))
}

pub(super) fn draw(run: &MuscleRun) -> anyhow::Result<Product> {
    let (highest, lowest) = extremes(run).context("the run ended before its first step")?;
    let snapshots = [highest, lowest];
    let drawing = Drawing::of(run, snapshots);
    let Drawing { largest, scale, .. } = drawing;
    let panels = snapshots
        .iter()
        .map(|snapshot| Ok(Box::new(drawing.panel(snapshot)?) as Box<dyn Panel>))
        .collect::<anyhow::Result<_>>()?;

    let points = run.space.node_points();
    let rows = (0..points.len())
        .map(|i| [points[i], snapshots[0].1[i], snapshots[1].1[i]].concat())
        .collect();
    let findings = vec![
        ("t_highest", snapshots[0].0.into()),
        ("t_lowest", snapshots[1].0.into()),
        ("largest_displacement", largest.into()),
        ("scale", scale.into()),
    ];
    Ok(Product {
        number: 5,
        figure: Figure::column("Two snapshots of the deformed muscle", panels),
        columns: [
            "x",
            "y",
            "u_x_highest",
            "u_y_highest",
            "u_x_lowest",
            "u_y_lowest",
        ]
        .map(String::from)
        .into(),
        rows,
        findings,
        run: run.document()?,
        exit: run.exit(),
    })
}

/// The snapshots of the last period with the origin at its highest and lowest.
fn extremes(run: &MuscleRun) -> Option<(&Snapshot, &Snapshot)> {
    let height_at = |time: f64| {
        let row = run.origin.iter().rev().find(|row| row[0] <= time);
        row.map_or(f64::NAN, |row| row[2])
    };
    let by_height = |a: &&Snapshot, b: &&Snapshot| height_at(a.0).total_cmp(&height_at(b.0));
    Some((
        run.last_period.iter().max_by(by_height)?,
        run.last_period.iter().min_by(by_height)?,
    ))
}

fn extent(run: &MuscleRun, c: usize, pick: fn(f64, f64) -> f64) -> f64 {
    run.space
        .node_points()
        .iter()
        .map(|point| point[c])
        .reduce(pick)
        .unwrap_or(0.0)
}

fn height(run: &MuscleRun) -> f64 {
    extent(run, 1, f64::max) - extent(run, 1, f64::min)
}

/// The next lower number of the form 1, 2 or 5 times a power of ten.
fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0]
        .map(|m| m * power)
        .into_iter()
        .find(|n| *n <= value)
        .unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round() {
        assert_eq!(
            [1.0, 1.99, 27.0, 0.6, 999.0].map(round_down),
            [1.0, 1.0, 20.0, 0.5, 500.0]
        );
    }
}
