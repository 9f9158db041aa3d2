//! Unusual loads and displacements.

use myovib_model::Signal;
use myovib_model::check::readable;
use myovib_model::support::extent;

use super::Unusual;
use super::materials::Part;
use crate::scene::Body;
use crate::scene_file::{Analysis, SceneFile};
use crate::spacing;

/// Maximum ratio of load to shear modulus. A tension of this size stretches a neo-Hookean bar to 2.6 times its length.
/// A pressure of this size in a cavity of a neo-Hookean body makes the cavity grow without bound (Gent and Lindley
/// 1959).
const MOST_LOAD: f64 = 2.5;
/// Number of intervals between the times at which loads are sampled.
const TIMES: u32 = 997;

/// Returns the first load that is far above the shear modulus of the stiffest material. Laws with fibers are skipped:
/// they stiffen without bound, so their modulus at rest does not limit loads.
pub(super) fn strong_load(
    file: &SceneFile,
    body: &Body,
    t_end: f64,
    parts: &[Part],
) -> Option<Unusual> {
    let shear = parts.iter().map(|part| part.shear).fold(0.0, f64::max);
    if parts.iter().any(|part| part.law.has_fibers()) {
        return None;
    }
    let times = times(file, t_end);
    let most = |signal: &Signal| {
        let values = times.iter().map(|t| signal.at(*t).value.abs());
        values.fold(0.0, f64::max)
    };
    loads(file, body).find_map(|(path, signal)| {
        let load = most(signal);
        (load > MOST_LOAD * shear).then(|| {
            let problem = format!(
                "{path} reaches {} Pa, {:.1} times the shear modulus at rest, {} Pa",
                readable(load),
                load / shear,
                readable(shear)
            );
            (problem, "check the unit (Pa): loads far above the modulus invert elements")
        })
    })
}

/// Checks that supports move less than the length of the body.
pub(super) fn large_displacement(file: &SceneFile, body: &Body, t_end: f64) -> Option<Unusual> {
    // A rotation moves a support by up to twice its distance from the axis.
    if file.prescribed_displacement.iter().any(|own| own.rotation.is_some()) {
        return None;
    }
    let length = extent(&body.muscle);
    let times = times(file, t_end);
    let distances = body.muscle.prescribed.iter().flat_map(|moved| {
        let at = |t: &f64| moved.signal.at(*t).value.abs();
        times.iter().map(at)
    });
    let most = distances.fold(0.0, f64::max);
    (most > length).then(|| {
        let problem = format!(
            "a [[prescribed_displacement]] reaches {} m, and the body is {} m long",
            readable(most),
            readable(length)
        );
        (problem, "give it in m: 1 mm is 1e-3")
    })
}

/// Returns the times at which loads are sampled.
fn times(file: &SceneFile, t_end: f64) -> Vec<f64> {
    match file.analysis {
        Analysis::Static => vec![t_end],
        Analysis::Modes => file.modes.iter().filter_map(|modes| modes.preload_time).collect(),
        Analysis::Response => {
            let response = file.response.iter();
            response.filter_map(|own| own.preload_time).collect()
        }
        Analysis::Dynamic | Analysis::QuasiStatic => spacing::times(0.0, t_end, TIMES).collect(),
        Analysis::Periodic => Vec::new(),
    }
}

/// Returns the tractions and surface loads given in Pa, each with its key. Loads with a distribution are
/// excluded, because the distribution may contain the unit of the load.
fn loads<'a>(file: &SceneFile, body: &'a Body) -> impl Iterator<Item = (&'a str, &'a Signal)> {
    let tractions = file.traction.iter().enumerate();
    let distributed = tractions.filter(|(_, traction)| traction.spatial_factor.is_some());
    let mut excluded: Vec<String> = distributed.map(|(i, _)| format!("traction[{i}].")).collect();
    excluded.extend(["body_force", "point_force", "contact"].map(str::to_owned));
    let mut loads = body.keyed_loads().collect::<Vec<_>>();
    loads.retain(|(key, _)| !excluded.iter().any(|other| key.starts_with(other)));
    loads.into_iter()
}
