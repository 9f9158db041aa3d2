//! Sections of the scene reference with their examples.

use super::super::section::Section;
use super::super::surface_load::SurfaceLoads;

/// Returns the sections in the order of a scene file. Each key of the root belongs to one of them.
pub(super) fn sections() -> impl Iterator<Item = &'static Section> {
    let loads = SurfaceLoads::SECTIONS.iter();
    UP_TO_TRACTIONS.iter().chain(loads).chain(FROM_CONTACTS)
}

const UP_TO_TRACTIONS: &[Section] = &[
    Section {
        title: "Title and analysis",
        keys: &["title", "analysis"],
        example: "title = \"A block under its weight\"\nanalysis = \"static\"",
    },
    Section { title: "`[time]`", keys: &["time"], example: "[time]\nend = 2.0" },
    Section {
        title: "`[mesh]`",
        keys: &["mesh"],
        example: "[mesh]\ntype = \"rectangle\"\nwidth = 0.1\n\
                  height = 0.02\ncells = [20, 4]",
    },
    Section {
        title: "`[[region]]`",
        keys: &["region"],
        example: "[[region]]\nname = \"inclusion\"\ncenter = [0.02, 0.0]\n\
                  radii = [0.01, 0.005]",
    },
    Section {
        title: "`[[group]]`",
        keys: &["group"],
        example: "[[group]]\nname = \"skin\"\ntype = \"direction\"\ndirection = [0.0, 1.0]\nangle = 45                      # degrees",
    },
    Section {
        title: "`[solid]`",
        keys: &["solid"],
        example: "[solid]\nbulk_modulus = 1e5                     # Pa, or inf\n\
                  rayleigh_stiffness = 1e-4",
    },
    Section {
        title: "`[[material]]`",
        keys: &["material"],
        example: "[[material]]\ngroup = \"muscle\"\nlaw = \"mooney-rivlin\"\n\
                  density = 1.1e3\nc10 = 1e4\n\
                  c01 = 2e2\nfiber = [1.0, 0.0]\n\
                  prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]\n\
                  active = { type = \"given\", tension = { type = \"step\", value = 2e4, rise = 0.4 } }",
    },
    Section {
        title: "`[[fixed]]`",
        keys: &["fixed"],
        example: "[[fixed]]\ngroup = \"fixed\"\ncomponents = [\"x\"]              # free to slide along y",
    },
    Section {
        title: "`[[prescribed_displacement]]`",
        keys: &["prescribed_displacement"],
        example: "[[prescribed_displacement]]\ngroup = \"fixed\"\n\
                  y = { type = \"step\", value = 0.002, rise = 0.1 }",
    },
    Section {
        title: "`[[elastic_foundation]]`",
        keys: &["elastic_foundation"],
        example: "[[elastic_foundation]]\ngroup = \"load\"\nalong = \"normal\"\nstiffness = 1e6                 # Pa/m\n\
                  damping = 1e3",
    },
    Section {
        title: "`[[spring]]`",
        keys: &["spring"],
        example: "[[spring]]\nat = [0.1, 0.02]                # m\nstiffness = 200.0               # N/m\n\
                  direction = [0.0, 1.0]",
    },
    Section {
        title: "`[[traction]]`",
        keys: &["traction"],
        example: "[[traction]]\ngroup = \"load\"\n\
                  y = { type = \"sine\", amplitude = 50.0, frequency = 8.0 }\n\
                  spatial_factor = \"1 - (x/0.02)^2\"",
    },
];

const FROM_CONTACTS: &[Section] = &[
    Section {
        title: "`[[contact]]`",
        keys: &["contact"],
        example: "[[contact]]                    # an indenter that moves down by 2 mm\ngroup = \"top\"\ntype = \"sphere\"\n\
                  center = [0.0, 0.03]\nradius = 0.01\ny = { type = \"ramp\", value = -0.002, end = 0.1 }",
    },
    Section {
        title: "`[[body_force]]`",
        keys: &["body_force"],
        example: "[[body_force]]\ny = { type = \"step\", value = -9.81, rise = 0.1 }",
    },
    Section {
        title: "`[[point_force]]`",
        keys: &["point_force"],
        example: "[[point_force]]\nat = [0.1, 0.02]                # m\ny = { type = \"step\", value = -5.0, rise = 0.1 }",
    },
    Section {
        title: "`[initial_state]`",
        keys: &["initial_state"],
        example: "[initial_state]\ntype = \"equilibrium\"",
    },
    Section {
        title: "`[integrator]`",
        keys: &["integrator"],
        example: "[integrator]\nmethod = \"radau9\"\nrtol = 1e-5\nmax_cpu = 600.0",
    },
    Section {
        title: "`[[probe]]`",
        keys: &["probe"],
        example: "[[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.0, 0.0]\n\
                  quantities = [\"u\", \"von-mises\"]\ninterval = 0.01",
    },
    Section {
        title: "`[fields]`",
        keys: &["fields"],
        example: "[fields]\ninterval = 0.1\nquantities = [\"u\", \"p\", \"stress\"]",
    },
    Section {
        title: "`[[stop]]`",
        keys: &["stop"],
        example: "[[stop]]\ntype = \"displacement\"\nat = [0.0, 0.0]\n\
                  above = 0.005",
    },
    Section {
        title: "`[checkpoint]`",
        keys: &["checkpoint"],
        example: "[checkpoint]\ninterval = 0.5",
    },
    Section {
        title: "`[static]`",
        keys: &["static"],
        example: "[static]\nmethod = \"arc-length\"\nsteps = 40",
    },
    Section {
        title: "`[modes]`",
        keys: &["modes"],
        example: "[modes]\ncount = 6\npreload_time = 0.0",
    },
    Section {
        title: "`[response]`",
        keys: &["response"],
        example: "[response]\nfrequencies = \"1..60:120\"\npreload_time = 0.0",
    },
    Section {
        title: "`[periodic]`",
        keys: &["periodic"],
        example: "[periodic]\nfrequency = 8.0\nsettling_periods = 5",
    },
    Section {
        title: "`[[parameter]]`",
        keys: &["parameter"],
        example: "[[parameter]]\nkey = \"material[0].c10\"\nlow = 1e3",
    },
    Section {
        title: "`[[output]]`",
        keys: &["output"],
        example: "[[output]]\nname = \"tip\"                    # column of the data\n\
                  probe = \"origin\"\ncolumn = \"u_y\"\nnoise = 2e-5",
    },
    Section {
        title: "`[rod]`",
        keys: &["rod"],
        example: "[rod]\nelements = 20\nload = { type = \"sine\", amplitude = 1.0, frequency = 8.0 }",
    },
    Section {
        title: "`[[chain]]`",
        keys: &["chain"],
        example: "[[chain]]\nname = \"belly\"\noscillators = 5\nfrequency_spread = 0.08\n\
                  at = [0.0, 0.0]",
    },
    Section {
        title: "`[[feedback]]`",
        keys: &["feedback"],
        example: "[[feedback]]\nchain = \"belly\"\nat_zero_coherence = 1.5",
    },
];
