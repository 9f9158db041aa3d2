//! Plane waves in a stretched body, and published benchmarks of forced vibration.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::{column, damping, number, reference, response};

/// Returns the wave number K in the reference configuration of a wave of 60 Hz along a strip with the stretch λ along x
/// and 1/λ along y. The end of the strip is shaken transversely. No point moves along x, so the motion depends only on x.
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

/// Checks the tests 5H, 13H and 21H of NAFEMS R0016: a deep beam, a thin plate and a thick plate of steel, simply supported over their
/// whole end faces, under a harmonic load on one side. A quarter is computed, with two planes of symmetry.
///
/// The references are the peaks of series solutions for Timoshenko's beam and for Kirchhoff's and Mindlin's plates with the same damping.
/// The published peaks, for modal damping, are 42.65 Hz and 13.45 mm, 2.377 Hz and 45.42 mm, 45.90 Hz and 58.33 mm. Supports of a solid
/// and the theories of beams and plates differ by about 1 % in frequency and 5 % in amplitude. The thin plate has a discretization error
/// of 1 % in frequency: its elements are 17 times as long as they are thick.
#[test]
fn beams_and_plates_have_their_published_resonances() {
    let hard = "[[fixed]]\ngroup = \"front\"\ncomponents = [\"x\", \"z\"]\n";
    for (name, size, cells, [mass, stiffness], supports, load, range, [frequency, amplitude]) in [
        (
            "5H",
            [5.0, 1.0, 2.0],
            "[5, 1, 2]",
            [5.36, 7.46e-5],
            "",
            5e5,
            "40..46:13",
            [42.59190, 13.51594e-3],
        ),
        (
            "13H",
            [5.0, 5.0, 0.05],
            "[12, 12, 1]",
            [0.299, 1.339e-3],
            hard,
            1e2,
            "2.2..2.6:9",
            [2.375818, 45.42102e-3],
        ),
        (
            "21H",
            [5.0, 5.0, 1.0],
            "[4, 4, 1]",
            [5.772, 6.926e-5],
            hard,
            1e6,
            "40..52:13",
            [45.89353, 60.02151e-3],
        ),
    ] {
        let found = response(&format!(
            "analysis = \"response\"\n[response]\nfrequencies = \"{range}\"\n[mesh]\ntype = \"box\"\nsize = {size:?}\n\
             cells = {cells}\n[solid]\nbulk_modulus = 1.6666666666666666e11\nrayleigh_mass = {mass:?}\n\
             rayleigh_stiffness = {stiffness:e}\n[[material]]\nlaw = \"small-strain\"\ndensity = 8000.0\nshear_modulus = \
             7.692307692307692e10\n[[fixed]]\ngroup = \"left\"\ncomponents = [\"y\", \"z\"]\n[[fixed]]\ngroup = \"right\"\n\
             components = [\"x\"]\n[[fixed]]\ngroup = \"back\"\ncomponents = [\"y\"]\n{supports}[[traction]]\n\
             group = \"top\"\nresponse = {{ z = {load:?} }}\n[[probe]]\nname = \"center\"\ntype = \"point\"\n\
             at = [5.0, {y:?}, {z:?}]\nquantities = [\"u\"]\n",
            y = size[1],
            z = 0.5 * size[2],
        ));
        let peak = found.peaks.iter().find(|peak| peak.column == "u_z").unwrap();
        assert!((peak.frequency / frequency - 1.0).abs() < 0.01, "{name}: {peak:?}");
        assert!((peak.amplitude / amplitude - 1.0).abs() < 0.05, "{name}: {peak:?}");
        assert!((peak.damping_ratio.unwrap() / 0.02 - 1.0).abs() < 0.02, "{name}: {peak:?}");
    }
}
