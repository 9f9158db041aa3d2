//! Output files of a scene's run.

use myovib_model::SampleTimes;
use myovib_report::table::counted;
use myovib_scene::scene_file::Analysis;
use myovib_scene::{DrivenChain, Scene};

/// Describes the tables and fields that a run writes, one per line.
pub(super) fn lines(scene: &Scene) -> Vec<String> {
    let file = scene.file();
    let mut lines = Vec::new();
    let probes = file.probe.iter();
    let rows = |every: f64, unit: &str| match (file.analysis, &file.time, &file.loading_path) {
        (Analysis::Dynamic | Analysis::QuasiStatic, Some(time), _) => {
            counted(times(every, time.end), unit)
        }
        (Analysis::Static, _, Some(_)) => format!("a {unit} for each state of the path"),
        _ => counted(1, unit),
    };
    lines.extend(probes.map(|probe| {
        let rows = rows(probe.interval, "row");
        format!("writes          {}.csv: {rows}", probe.name)
    }));
    lines.extend(file.fields.as_ref().map(|fields| {
        let names: Vec<&str> = fields.quantities.iter().map(|q| q.label()).collect();
        let files = rows(fields.interval, "file");
        format!("writes          fields.pvd: {} in {files}", names.join(", "))
    }));
    if scene.chains.iter().any(DrivenChain::is_at_many_points) {
        lines.extend(file.fields.as_ref().map(|fields| {
            let files = rows(fields.interval, "file");
            format!("writes          places.pvd: oscillators in {files}")
        }));
    }
    lines
}

/// Returns the number of output times from 0 to `end`.
fn times(every: f64, end: f64) -> usize {
    let mut times = SampleTimes::new(every, end);
    std::iter::from_fn(|| times.due(end)).count()
}
