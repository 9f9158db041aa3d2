//! Sections of the scene reference: one example each, which starts with the section's header.

use super::super::surface_load::SurfaceLoads;

/// Returns the examples in the order of a scene file. Each key of the root belongs to one example.
pub(super) fn sections() -> impl Iterator<Item = &'static str> {
    let loads = SurfaceLoads::SECTIONS.iter();
    UP_TO_TRACTIONS.iter().chain(loads).chain(FROM_CONTACTS).copied()
}

/// Returns the title of a section and its keys of the root.
pub(super) fn parts(example: &str) -> (String, Vec<&str>) {
    match example.find(|c: char| c != '[') {
        None | Some(0) => ("Title and analysis".to_owned(), vec!["title", "analysis"]),
        Some(depth) => {
            let name = example[depth..].split(']').next().unwrap_or_default();
            (format!("`{}{name}{}`", "[".repeat(depth), "]".repeat(depth)), vec![name])
        }
    }
}

const UP_TO_TRACTIONS: &[&str] = &[
    r#"title = "A block under its weight"
analysis = "static""#,
    r#"[time]
end = 2.0"#,
    r#"[mesh]
type = "rectangle"
width = 0.1
height = 0.02
cells = [20, 4]"#,
    r#"[[region]]
name = "inclusion"
center = [0.02, 0.0]
radii = [0.01, 0.005]"#,
    r#"[[group]]
name = "skin"
type = "direction"
direction = [0.0, 1.0]
angle = 45                      # degrees"#,
    r#"[solid]
bulk_modulus = 1e5                     # Pa, or inf
rayleigh_stiffness = 1e-4"#,
    r#"[[material]]
group = "muscle"
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2
fiber = [1.0, 0.0]
prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]
active = { type = "given", tension = { type = "step", value = 2e4, rise = 0.4 } }"#,
    r#"[[fixed]]
group = "fixed"
components = ["x"]              # free to slide along y"#,
    r#"[[prescribed_displacement]]
group = "fixed"
y = { type = "step", value = 0.002, rise = 0.1 }"#,
    r#"[[elastic_foundation]]
group = "load"
along = "normal"
stiffness = 1e6                 # Pa/m
damping = 1e3"#,
    r#"[[spring]]
at = [0.1, 0.02]                # m
stiffness = 200.0               # N/m
direction = [0.0, 1.0]"#,
    r#"[[traction]]
group = "load"
y = { type = "sine", amplitude = 50.0, frequency = 8.0 }
spatial_factor = "1 - (x/0.02)^2""#,
];

const FROM_CONTACTS: &[&str] = &[
    r#"[[contact]]                    # an indenter that moves down by 2 mm
group = "top"
type = "sphere"
center = [0.0, 0.03]
radius = 0.01
y = { type = "ramp", value = -0.002, end = 0.1 }"#,
    r#"[[body_force]]
y = { type = "step", value = -9.81, rise = 0.1 }"#,
    r#"[[point_force]]
at = [0.1, 0.02]                # m
y = { type = "step", value = -5.0, rise = 0.1 }"#,
    r#"[initial_state]
type = "equilibrium""#,
    r#"[integrator]
method = "radau9"
rtol = 1e-5
max_cpu = 600.0"#,
    r#"[[probe]]
name = "tip"
type = "point"
at = [0.0, 0.0]
quantities = ["u", "von-mises"]
interval = 0.01"#,
    r#"[fields]
interval = 0.1
quantities = ["u", "p", "stress"]"#,
    r#"[[stop]]
type = "displacement"
at = [0.0, 0.0]
above = 0.005"#,
    r#"[checkpoint]
interval = 0.5"#,
    r#"[static]
method = "arc-length"
steps = 40"#,
    r#"[modes]
count = 6
preload_time = 0.0"#,
    r#"[response]
frequencies = "1..60:120"
preload_time = 0.0"#,
    r#"[periodic]
frequency = 8.0
settling_periods = 5"#,
    r#"[[parameter]]
key = "material[0].c10"
low = 1e3"#,
    r#"[[output]]
name = "tip"                    # column of the data
probe = "origin"
column = "u_y"
noise = 2e-5"#,
    r#"[rod]
elements = 20
load = { type = "sine", amplitude = 1.0, frequency = 8.0 }"#,
    r#"[[chain]]
name = "belly"
oscillators = 5
frequency_spread = 0.08
at = [0.0, 0.0]"#,
    r#"[[feedback]]
chain = "belly"
at_zero_coherence = 1.5"#,
];
