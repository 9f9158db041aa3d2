//! Contact with friction, against closed forms.

use std::f64::consts::PI;
use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

use crate::contact::{column, last, tables_in};

const FRICTION: f64 = 0.3;
/// Slip velocity, m/s.
const SLIP: f64 = 1e-4;

/// Returns a block of 20 mm by 10 mm (in 3D, with a depth of 10 mm) under a plate.
pub(crate) fn block(dimension: usize, head: &str, contact: &str, rtol: f64) -> String {
    let (mesh, point, normal) = match dimension {
        2 => (
            "type = \"rectangle\"\nwidth = 0.02\nheight = 0.01\ncells = [4, 2]",
            "[0.0, 0.01]",
            "[0.0, -1.0]",
        ),
        _ => (
            "type = \"box\"\nsize = [0.02, 0.01, 0.01]\ncells = [2, 1, 1]",
            "[0.0, 0.0, 0.01]",
            "[0.0, 0.0, -1.0]",
        ),
    };
    format!(
        "{head}[mesh]\n{mesh}\n[solid]\nbulk_modulus = 1e6\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
         shear_modulus = 1e4\n[[contact]]\ngroup = \"top\"\ntype = \"plane\"\npoint = {point}\nnormal = {normal}\n{contact}\n\
         [[probe]]\nname = \"plate\"\ntype = \"contact\"\ngroup = \"top\"\ninterval = 0.01\n\
         [integrator]\nmethod = \"radau9\"\nrtol = {rtol:e}\n"
    )
}

/// Checks a plate that presses the block and moves back and forth. It slips except when it reverses. While it slips
/// with the velocity V, the friction at all points is μ/√(1 + (v₀/V)²) times the pressure. Changes of this factor move
/// the block itself, but at less than (v₀/V)² times V.
#[test]
fn a_dragged_plate_slips_at_the_force_of_coulomb() {
    for (dimension, down) in [(2, "y"), (3, "z")] {
        let contact = format!(
            "{down} = {{ type = \"step\", value = -2e-4, rise = 0.2 }}\n\
             x = {{ type = \"sine\", amplitude = 0.01, frequency = 0.5 }}\nfriction = {FRICTION}\nslip_velocity = {SLIP}"
        );
        let head =
            "analysis = \"quasi-static\"\n[time]\nend = 1.0\n[[fixed]]\ngroup = \"bottom\"\n";
        let text = block(dimension, head, &contact, 1e-4);
        let [plate] = tables_in(&text, Path::new(""), ["plate"]);
        let [along, normal] = ["F_x", &format!("F_{down}")].map(|name| column(&plate, name));
        for row in [30, 40, 90, 100] {
            let velocity = 0.01 * PI * (0.01 * PI * row as f64).cos();
            let ratio = (SLIP / velocity).powi(2);
            let exact = FRICTION.copysign(velocity) / (1.0 + ratio).sqrt();
            let error = (along[row] / -normal[row] / exact - 1.0).abs();
            assert!(error < ratio * ratio + 1e-7, "{dimension} {row}: {error:e}");
        }
    }
}

/// Checks that the work of a plate that rubs back and forth is dissipated by friction: energy is balanced.
#[test]
fn friction_dissipates_the_work_of_the_plate() {
    let contact = format!(
        "y = -2e-4\nx = {{ type = \"sine\", amplitude = 5e-3, frequency = 10.0 }}\nfriction = {FRICTION}\nslip_velocity = 1e-3"
    );
    let head = "[time]\nend = 0.1\n[[fixed]]\ngroup = \"bottom\"\n[initial_state]\ntype = \"equilibrium\"\n";
    let rtol = 1e-3;
    let text = block(2, head, &contact, rtol)
        + "[[probe]]\nname = \"energy\"\ntype = \"energy\"\ninterval = 0.01\n";
    let [energy] = tables_in(&text, Path::new(""), ["energy"]);
    let imbalance = column(&energy, "imbalance");
    let imbalance = imbalance.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    let [work, dissipated] = ["work", "dissipated"].map(|name| last(&energy, name));
    assert!(dissipated > 0.9 * work && work > 0.0, "{work} {dissipated}");
    assert!(imbalance < rtol * work, "{imbalance:e} {work}");
}

/// Checks the momentum of a block of weight m g that slides on a floor. Friction decelerates it by μ times the force of
/// the floor, which is m (g + dv_y/dt). The block slides at more than a hundred times the slip velocity, so that
/// friction is at most a fraction of 1e-4 below its limit.
#[test]
fn a_sliding_block_decelerates_by_the_weight_times_friction() {
    let contact = format!("friction = {FRICTION}\nslip_velocity = 1e-3");
    let head = "[time]\nend = 0.1\n[initial_state]\ntype = \"velocity\"\nvalue = [1.0, 0.0]\n[[body_force]]\ny = -9.81\n";
    let text = block(2, head, &contact, 1e-4)
        .replace("group = \"top\"", "group = \"bottom\"")
        .replace("[0.0, 0.01]", "[0.0, 0.0]")
        .replace("[0.0, -1.0]", "[0.0, 1.0]")
        + "[[probe]]\nname = \"mean\"\ntype = \"average\"\ngroup = \"body\"\nquantities = [\"v\"]\ninterval = 0.1\n";
    let [mean] = tables_in(&text, Path::new(""), ["mean"]);
    let pushed = 9.81 * 0.1 + last(&mean, "v_y");
    let lost = 1.0 - last(&mean, "v_x");
    let error = (lost / (FRICTION * pushed) - 1.0).abs();
    assert!(error < 5e-3 && lost > 0.1, "{error:e} {lost}");
}

/// Compresses a layer of half-thickness 1 and half-length 20 by a plate with friction μ, in units of the shear modulus. In a thin
/// layer, the mean displacement along x is ε x. Inside, the layer sticks: the friction τ of a parabolic profile is 3 ε x, and the
/// slope of the pressure p is −τ. From x = c on, it slips: τ = μ p with p = 4 ε exp(μ (20 − x)). The mean of the profile leaves the
/// slip ε x − μ p/3. All of these grow in proportion to ε.
///
/// The theory of thin layers neglects terms of second order in the slope of the pressure, μ² = 0.02, and the end of the layer.
#[test]
fn a_compressed_layer_sticks_inside_and_slips_outside() {
    let (length, friction, slip) = (20.0, 0.15_f64, 3e-4);
    // This is the pressure for ε = 1.
    let pressure = |x: f64| 4.0 * (friction * (length - x)).exp();
    let (mut low, mut c) = (0.0, length);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + c);
        match 3.0 * middle < friction * pressure(middle) {
            true => low = middle,
            false => c = middle,
        }
    }
    let slipping = (pressure(c) - pressure(length)) / friction;
    let force = pressure(c) * c + c.powi(3) + slipping;
    let rubbed = 1.5 * c * c + friction * slipping;
    let places = [0.5 * c, 10.0, 15.0];
    // The slope of the pressure inside is −3 x.
    let pressure_inside = pressure(c) + 1.5 * (c * c - places[0].powi(2));
    let probes = places.iter().enumerate().map(|(i, x)| {
        format!("[[probe]]\nname = \"at{i}\"\ntype = \"point\"\nat = [{x}, 1.0]\ninterval = 1.0\n")
    });
    // The plate does not stop before t = 1 s, where friction would vanish.
    let text = format!(
        "analysis = \"quasi-static\"\n[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = {length}\nheight = 1.0\n\
         cells = [40, 2]\n[solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"small-strain\"\ndensity = 1.0\nshear_modulus = 1.0\n\
         [[fixed]]\ngroup = \"bottom\"\ncomponents = [\"y\"]\n[[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n\
         [[contact]]\ngroup = \"top\"\ntype = \"plane\"\npoint = [0.0, 1.0]\nnormal = [0.0, -1.0]\nstiffness = 1e5\n\
         y = {{ type = \"step\", value = -0.01, rise = 1.5 }}\nfriction = {friction}\nslip_velocity = {slip:e}\n{}\
         [[probe]]\nname = \"plate\"\ntype = \"contact\"\ngroup = \"top\"\ninterval = 1.0\n[integrator]\nrtol = 1e-3\n",
        probes.collect::<String>()
    );
    let [plate, inside, ten, fifteen] =
        tables_in(&text, Path::new(""), ["plate", "at0", "at1", "at2"]);
    let strain = last(&plate, "displacement");
    let neglected = friction * friction;
    for (found, exact) in [
        (-last(&plate, "F_y"), force),
        (-last(&plate, "F_x"), rubbed),
        (last(&ten, "u_x"), places[1] - friction * pressure(places[1]) / 3.0),
        (last(&fifteen, "u_x"), places[2] - friction * pressure(places[2]) / 3.0),
    ] {
        let error = found / (strain * exact) - 1.0;
        assert!(error.abs() < neglected, "{found} {exact}: {error}");
    }
    // The inside creeps for less than 1 s with the velocity w at which the regularized friction μ p w/√(w² + v₀²) is τ.
    let part = 3.0 * places[0] / (friction * pressure_inside);
    let creep = slip * part / (1.0 - part * part).sqrt() / (strain * places[0]);
    let crept = last(&inside, "u_x") / (strain * places[0]);
    assert!((0.0..creep * (1.0 + neglected)).contains(&crept), "{crept} {creep}");
}

/// Checks that friction without its slip velocity, and in analyses without slip, gives an error with the line of the key.
#[test]
fn invalid_friction_is_rejected() {
    let motion = "[time]\nend = 1.0\n[[fixed]]\ngroup = \"bottom\"\n";
    let full = "friction = 0.3\nslip_velocity = 1e-3";
    let build = |head: &str, contact: &str| {
        Scene::build("scene.toml", &block(2, head, contact, 1e-3), &[], Path::new(""))
    };
    assert!(build(motion, full).is_ok());
    // This is the remedy that the error in statics names.
    assert!(build(&format!("analysis = \"quasi-static\"\n{motion}"), full).is_ok());
    let of = |analysis: &str| format!("analysis = \"{analysis}\"\n[[fixed]]\ngroup = \"bottom\"\n");
    for (head, contact, line) in [
        (motion, "friction = 0.3", "friction = 0.3"),
        (motion, "slip_velocity = 1e-3", "slip_velocity = 1e-3"),
        (motion, "friction = -0.3", "friction = -0.3"),
        (motion, "friction = 0.3\nslip_velocity = 0.0", "slip_velocity = 0.0"),
        (
            motion,
            &format!("{full}\nx = {{ type = \"ramp\", value = 0.01, end = 1.0 }}"),
            "x = { type",
        ),
        (&of("static"), full, "friction = 0.3"),
        (&of("modes"), full, "friction = 0.3"),
    ] {
        let error = build(head, contact).unwrap_err().to_string();
        assert!(error.contains(&format!(" | {line}")), "{head} {contact}: {error}");
    }
}

/// Regression: the message of a run that stopped when a block began to slip named no remedy.
#[test]
fn the_remedy_for_a_sudden_slip_works() {
    let run = |slip: f64| {
        let contact = format!(
            "y = {{ type = \"step\", value = -1e-3, rise = 0.2 }}\n\
             x = {{ type = \"step\", start = 0.2, value = 0.02, rise = 0.8 }}\nfriction = 0.2\nslip_velocity = {slip:e}"
        );
        let head =
            "analysis = \"quasi-static\"\n[time]\nend = 1.0\n[[fixed]]\ngroup = \"bottom\"\n";
        let text = block(2, head, &contact, 1e-4)
            .replace("[0.0, 0.01]", "[0.0, 0.02]")
            .replace(
                "width = 0.02\nheight = 0.01\ncells = [4, 2]",
                "width = 0.04\nheight = 0.02\ncells = [8, 4]",
            )
            .replace("bulk_modulus = 1e6", "bulk_modulus = 1e5");
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let out = tempfile::tempdir().unwrap();
        compute(&scene, &RunOptions::into_folder(out.path())).unwrap()
    };
    let stopped = run(SLIP);
    let message = stopped.document["message"].as_str().unwrap();
    assert!(stopped.outcome.reason().is_some() && message.contains("`slip_velocity`"), "{message}");
    assert!(run(10.0 * SLIP).outcome.reason().is_none());
}
