//! Outlines of rigid obstacles.

use std::f64::consts::TAU;

use myovib_fem::material::unit_vector;
use myovib_fem::{Space, bounds};
use myovib_scene::Scene;
use myovib_scene::scene_file::contact::Obstacle;

use crate::vector::{Place, cross, dot, length, minus, plus};

/// Number of sides of a circle.
const SIDES: usize = 256;

/// Returns the outlines of the obstacles before they move. In 2D, the third coordinates are zero. Planes and cylinders
/// are cut off next to the body.
pub(super) fn outlines(scene: &Scene, space: &Space) -> Vec<Vec<Place>> {
    let mesh = space.mesh();
    let in_space = mesh.dimension() == 3;
    let [low, high] = bounds(mesh.coordinates(), mesh.dimension()).map(|corner| place(&corner));
    let center = [0, 1, 2].map(|i| 0.5 * (low[i] + high[i]));
    let size = length(minus(high, low));
    let contacts = scene.file().contact.iter();
    let outlines = contacts.flat_map(|contact| match &contact.obstacle {
        Obstacle::Plane { point, normal } => {
            let normal = unit(normal);
            let off = dot(minus(center, place(point)), normal);
            let foot = plus(center, -off, normal);
            let [a, b] = across(normal, in_space);
            let corner = |s: f64, t: f64| plus(plus(foot, s * size, a), t * size, b);
            match in_space {
                true => vec![
                    [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)]
                        .map(|(s, t)| corner(s, t))
                        .to_vec(),
                ],
                false => vec![vec![corner(-1.0, 0.0), corner(1.0, 0.0)]],
            }
        }
        Obstacle::Sphere { center, radius } => {
            let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
            let axes = &axes[..if in_space { 3 } else { 1 }];
            let circles = axes.iter().map(|&axis| circle(place(center), axis, *radius));
            circles.collect()
        }
        Obstacle::Cylinder { point, axis, radius } => {
            let (point, axis) = (place(point), unit(axis));
            let foot = plus(point, dot(minus(center, point), axis), axis);
            let ends = [-0.5, 0.5].map(|s| circle(plus(foot, s * size, axis), axis, *radius));
            let sides = (0..SIDES).step_by(SIDES / 8);
            let sides = sides.map(|i| vec![ends[0][i], ends[1][i]]);
            sides.chain(ends.clone()).collect()
        }
    });
    outlines.collect()
}

fn circle(center: Place, axis: Place, radius: f64) -> Vec<Place> {
    let [a, b] = across(axis, true);
    let point = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / SIDES as f64).sin_cos();
        plus(plus(center, radius * cos, a), radius * sin, b)
    };
    (0..=SIDES).map(point).collect()
}

/// Returns two unit vectors normal to `axis` and to each other. In 2D, the first vector is in the plane.
fn across(axis: Place, in_space: bool) -> [Place; 2] {
    let other = match in_space {
        true if axis[0].abs() < 0.6 => [1.0, 0.0, 0.0],
        true => [0.0, 1.0, 0.0],
        false => [0.0, 0.0, 1.0],
    };
    let a = unit(&cross(axis, other));
    [a, cross(axis, a)]
}

fn place(coordinates: &[f64]) -> Place {
    [0, 1, 2].map(|i| coordinates.get(i).copied().unwrap_or_default())
}

fn unit(vector: &[f64]) -> Place {
    unit_vector(place(vector))
}
