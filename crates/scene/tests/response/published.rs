//! Plane waves in a stretched body, and a published benchmark of forced vibration.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::{column, damping, number, reference, response};

/// Returns the wave number K in the reference of a wave of 60 Hz along a strip with the stretch λ along x and 1/λ along y.
/// Its end is shaken across; no point moves along x, so that the motion depends on x only.
fn wave_number(stretch: f64, name: &str, cells: usize) -> Complex64 {
    let [solid, material] = damping(name);
    let (along, across) = (stretch - 1.0, 1.0 / stretch - 1.0);
    let moved = |group: &str, component: &str| {
        format!("[[prescribed_displacement]]\ngroup = \"{group}\"\n{component}\n")
    };
    let x = format!("x = {along:?}\nspatial_factor = \"x\"");
    let y = format!("y = {across:?}\nspatial_factor = \"y\"");
    let supports: String =
        ["left", "right", "top", "bottom"].map(|group| moved(group, &x)).concat()
            + &["left", "right"].map(|group| moved(group, &y)).concat()
            + &moved("left", "response = { y = 1e-6 }");
    let step = 0.01;
    let probes = [1.0, 2.0, 3.0].map(|i| {
        format!(
            "[[probe]]\nname = \"p{i}\"\ntype = \"point\"\nat = [{:?}, 0.0]\nquantities = [\"u\"]\n",
            i * step
        )
    });
    let found = response(&format!(
        "analysis = \"response\"\n[response]\nfrequencies = [60.0]\npreload_time = 0.0\n[mesh]\ntype = \"rectangle\"\n\
         width = 0.1\nheight = 0.005\ncells = [{cells}, 1]\n[solid]\nbulk_modulus = inf\n{solid}\n[[material]]\n\
         law = \"mooney-rivlin\"\nc10 = 1e4\nc01 = 2e2\ndensity = 1100.0\n{material}\n{supports}{}",
        probes.concat()
    ));
    let [a, b, c] = ["p1", "p2", "p3"].map(|probe| column(&found, probe, "u_y")[0]);
    // u'' = -K² u, so that u(x - d) + u(x + d) = 2 cos(K d) u(x).
    let k = ((a + c) / (2.0 * b)).acos() / step;
    if k.re < 0.0 { -k } else { k }
}

/// Checks speed and attenuation of waves along and across the stretch against the closed form.
#[test]
fn waves_in_a_stretched_body_have_the_closed_form() {
    let case = reference("s13_03_plane_wave.json");
    for row in case["rows"].as_array().unwrap() {
        let stretch = number(&row["stretch"]);
        let stretch = if row["propagation"] == "along_stretch" { stretch } else { 1.0 / stretch };
        for name in ["plain", "eta5", "prony", "beta1e-4"] {
            let [coarse, fine] = [20, 80].map(|cells| {
                let k = wave_number(stretch, name, cells);
                let speed = TAU * 60.0 * stretch / k.re;
                let attenuation = k.im.abs() / stretch;
                let exact = match name {
                    "plain" => [number(&row["elastic_speed_m_s"]), 0.0],
                    _ => ["speed_m_s", "attenuation_1_m"].map(|key| number(&row[name][key])),
                };
                let difference = Complex64::new(1.0 / speed - 1.0 / exact[0], 0.0) * TAU * 60.0;
                let difference = difference + Complex64::i() * (attenuation - exact[1]);
                difference.norm() / (TAU * 60.0 / exact[0])
            });
            let place = format!("{stretch} {name}: {coarse:e} {fine:e}");
            // Wave numbers of quadratic elements have errors of at most about (K h)⁴/1440, with K h = 0.44 on the coarse mesh;
            // two halvings of h reduce this bound at least as an error of order 3. Errors of both signs add up.
            let bound = 0.44_f64.powi(4) / 1440.0;
            assert!(coarse < bound && fine < bound / 64.0, "{place}");
        }
    }
}

/// NAFEMS R0016, test 21H: thick square plate of 10 m × 10 m × 1 m under a harmonic pressure, on hard simple supports of the
/// whole sides; a quarter with two planes of symmetry. The series of Mindlin's plate has its peak at 45.894 Hz with 60.02 mm
/// (published with modal damping: 45.90 Hz, 58.33 mm). Supports of a solid and the plate theory differ by about 1 % in
/// frequency and 5 % in amplitude.
#[test]
fn a_thick_plate_has_the_published_resonance() {
    let fixed = |group: &str, components: &str| {
        format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [{components}]\n")
    };
    let supports = fixed("left", "\"y\", \"z\"")
        + &fixed("front", "\"x\", \"z\"")
        + &fixed("right", "\"x\"")
        + &fixed("back", "\"y\"");
    let found = response(&format!(
        "analysis = \"response\"\n[response]\nfrequencies = \"40..52:13\"\n[mesh]\ntype = \"box\"\nsize = [5.0, 5.0, 1.0]\n\
         cells = [4, 4, 1]\n[solid]\nbulk_modulus = 1.6666666666666666e11\nrayleigh_mass = 5.772\n\
         rayleigh_stiffness = 6.926e-5\n[[material]]\nlaw = \"small-strain\"\ndensity = 8000.0\nshear_modulus = \
         7.692307692307692e10\n{supports}[[traction]]\ngroup = \"top\"\nresponse = {{ z = 1e6 }}\n[[probe]]\n\
         name = \"center\"\ntype = \"point\"\nat = [5.0, 5.0, 0.5]\nquantities = [\"u\"]\n"
    ));
    let peak = found.peaks.iter().find(|peak| peak.column == "u_z").unwrap();
    assert!((peak.frequency / 45.89353 - 1.0).abs() < 0.01, "{peak:?}");
    assert!((peak.amplitude / 60.02151e-3 - 1.0).abs() < 0.05, "{peak:?}");
    assert!((peak.damping_ratio.unwrap() / 0.02 - 1.0).abs() < 0.02, "{peak:?}");
}
