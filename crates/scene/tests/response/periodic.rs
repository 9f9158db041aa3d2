//! Periodic states equal the harmonic response under small loads and the settled motion under large loads.

use std::path::Path;

use myovib_model::ModelError;
use myovib_scene::csv::Table;
use myovib_scene::periodic::{Column, Periodic};
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{Error, Scene};
use num_complex::Complex64;

use crate::{column, error, number, reference, response, response_of};

const FREQUENCY: f64 = 20.0;

/// Returns a body under a shear traction of the given amplitude.
fn body(solid: &str, material: &str, amplitude: f64) -> String {
    format!(
        "[mesh]\ntype = \"rectangle\"\nwidth = 0.05\nheight = 0.02\ncells = [1, 1]\n[solid]\nrayleigh_mass = 100.0\n{solid}\n\
         [[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4\n{material}\n\
         [[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\n\
         y = {{ type = \"sine\", amplitude = {amplitude:?}, frequency = {FREQUENCY:?} }}\n\
         response = {{ y = {amplitude:?} }}\n[response]\nfrequencies = [{FREQUENCY:?}]\n\
         [[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.05, 0.01]\nquantities = [\"u\"]\ninterval = 0.003125\n"
    )
}

fn built(text: &str, set: &[&str]) -> Result<Scene, String> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::build("scene.toml", text, &set, Path::new("")).map_err(|error| error.to_string())
}

/// Computes a scene and returns the periodic state, if it has one, and the table of the probe `tip`.
fn computed(text: &str, set: &[&str]) -> (Option<Periodic>, Vec<Vec<f64>>) {
    let out = tempfile::tempdir().unwrap();
    let scene = built(text, set).unwrap();
    let result = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(result.document["outcome"], "finished");
    let table = std::fs::read_to_string(out.path().join("tip.csv")).unwrap();
    let table = Table::parse(&table).unwrap();
    let rows = table.rows.iter().map(|row| table.numbers(row).unwrap());
    (result.periodic, rows.collect())
}

fn periodic(text: &str, set: &[&str]) -> (Periodic, Vec<Vec<f64>>) {
    let (found, rows) = computed(text, &[&["analysis=periodic"], set].concat());
    (found.unwrap(), rows)
}

fn of<'a>(found: &'a Periodic, name: &str) -> &'a Column {
    let columns = &found.probes[0].columns;
    columns.iter().find(|column| column.name == name).unwrap()
}

/// Checks a small periodic motion. A strain of 3e-4 changes the amplitude by terms of the order of its square. The
/// periodic state has a tolerance of 1e-7.
#[test]
fn a_small_periodic_motion_is_the_harmonic_response() {
    let prony = "viscosity = 2.0\nprony = [{ relative_modulus = 0.3, relaxation_time = 0.01 }]";
    for (solid, material) in [
        ("bulk_modulus = 1e6\nformulation = \"displacement\"", ""),
        ("bulk_modulus = inf\nformulation = \"position\"", prony),
        ("bulk_modulus = inf\nformulation = \"velocity\"", ""),
        ("bulk_modulus = inf\nformulation = \"stabilized\"", ""),
        ("bulk_modulus = inf\nrayleigh_stiffness = 1e-3\nformulation = \"rate\"", ""),
        ("bulk_modulus = 1e6\nrayleigh_stiffness = 1e-3\nformulation = \"implicit-rate\"", prony),
    ] {
        let text = body(solid, material, 2.0);
        let (found, _) = periodic(&text, &["periodic.tolerance=1e-7", "periodic.multipliers=1"]);
        let u = of(&found, "u_y");
        let own = Complex64::from_polar(u.amplitudes[0], u.phases[0].to_radians());
        // The load is sin ωt = Re(−i e^{iωt}).
        let analysis = format!("analysis = \"response\"\n{text}");
        let expected = -Complex64::I * column(&response(&analysis), "tip", "u_y")[0];
        assert!(error(own, expected) < 1e-6, "{solid}: {own} {expected}");
        assert_eq!(found.is_stable, Some(true));
        // Harmonic balance finds the state, which needs one integration. The multipliers need two integrations at the start
        // and one for each of at most 16 products, and the probes need one.
        assert_eq!(found.newton_iterations, 0, "{solid}");
        assert!(found.integrations <= 20, "{solid}: {}", found.integrations);
    }
}

/// Checks that the search without multipliers takes two integrations, for the residual and for the probes, if harmonic
/// balance finds the state.
#[test]
fn multipliers_can_be_omitted() {
    let text = body("bulk_modulus = inf", "", 2.0);
    let [with, without] =
        ["1", "0"].map(|count| periodic(&text, &[&format!("periodic.multipliers={count}")]).0);
    assert_eq!((without.spectral_radius, without.is_stable), (None, None));
    assert!(without.multipliers.is_empty());
    assert!(without.integrations <= 2, "{} {}", without.integrations, with.integrations);
    assert_eq!(of(&without, "u_y"), of(&with, "u_y"));
}

/// Checks that a muscle has the same periodic state with and without a chain that it drives.
#[test]
fn a_chain_does_not_change_the_search_for_its_muscle() {
    let text = body("bulk_modulus = inf", "", 200.0);
    let chain = "[[chain]]\nname = \"c\"\noscillators = 3\nvan_der_pol = -20.0\nat = [0.05, 0.01]\ncomponent = \"y\"\ngain = 5e3\n\
         [[probe]]\nname = \"own\"\ntype = \"coherence\"\nchain = \"c\"\ninterval = 0.01\n";
    let set = ["periodic.multipliers=1"];
    let (alone, _) = periodic(&text, &set);
    let (found, rows) = periodic(&format!("{text}{chain}"), &set);
    assert_eq!(found.is_stable, Some(true));
    assert!(found.spectral_radius >= alone.spectral_radius);
    let [own, expected] = [&found, &alone].map(|found| of(found, "u_y").amplitudes[0]);
    // The tolerance of both states is 1e-6.
    assert!((own / expected - 1.0).abs() < 1e-5, "{own} {expected}");
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert!((first[1] - last[1]).abs() < 1e-5 * expected);
    let radius = &found.probes[1].columns[0];
    assert_eq!(radius.name, "Psi_abs");
    assert!(radius.amplitudes[1] > 0.0 && radius.minimum > 0.0);
}

/// Checks a large periodic motion. After 24 periods the transient has decayed to e^{−αt/2} = 1e-26, so only the
/// integration has errors.
#[test]
fn a_large_periodic_motion_is_the_settled_motion() {
    let text = body("bulk_modulus = inf", "", 2000.0);
    let (found, rows) = periodic(&text, &["periodic.samples=16", "periodic.tolerance=1e-8"]);
    let motion = ["time.end=1.25", "integrator.rtol=1e-9"];
    let (_, all) = computed(&text, &motion);
    let last = &all[all.len() - 17..];
    let largest = of(&found, "u_y").maximum;
    assert!(largest > 0.005, "the strain is not large: {largest}");
    for (own, settled) in rows.iter().zip(last) {
        assert!((own[0] - (settled[0] - 1.2)).abs() < 1e-12);
        for (own, settled) in own[1..].iter().zip(&settled[1..]) {
            assert!((own - settled).abs() < 1e-7 * largest, "{own} {settled}");
        }
    }
    // If the modulus does not depend on the deformation, the second harmonic along the load vanishes.
    let u = of(&found, "u_x");
    assert!(u.amplitudes[1] > 0.01 * largest);
    // Multipliers of modes with the damping α have the modulus e^{−αT/2}, apart from nonlinear effects.
    let damped = (-0.5 * 100.0 / FREQUENCY).exp();
    assert!((found.spectral_radius.unwrap() / damped - 1.0).abs() < 0.2);
}

/// Checks that a run that restarts from the periodic state continues it.
#[test]
fn a_motion_continues_the_periodic_state() {
    let out = tempfile::tempdir().unwrap();
    let text = body("bulk_modulus = inf", "", 200.0);
    let scene = built(&text, &["analysis=periodic"]).unwrap();
    compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    let restart = format!(
        "{text}[initial_state]\ntype = \"restart\"\nfolder = {:?}\n[time]\nend = 0.05\n",
        out.path()
    );
    let (_, rows) = computed(&restart, &["integrator.rtol=1e-8"]);
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let largest = rows.iter().map(|row| row[2].abs()).fold(0.0, f64::max);
    // The tolerance of the periodic state is 1e-6.
    assert!((first[2] - last[2]).abs() < 1e-5 * largest);
}

/// Checks a rod with a chain whose amplitude is far below its limit cycle: the chain follows the rod.
#[test]
fn a_chain_follows_the_rod_that_drives_it() {
    let text = "[rod]\nelements = 8\nrayleigh_mass = 20.0\n\
         load = { type = \"sine\", amplitude = 0.5, frequency = 8.0 }\n\
         [[chain]]\nname = \"c\"\noscillators = 3\nvan_der_pol = -20.0\nat = 0.1\ngain = 5e3\n\
         [[probe]]\nname = \"tip\"\ntype = \"coherence\"\nchain = \"c\"\n";
    let (found, rows) = periodic(text, &[]);
    assert_eq!(found.is_stable, Some(true));
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert!((first[1] - last[1]).abs() < 1e-4 * first[1]);
    let chi = of(&found, "chi_abs");
    assert!(chi.minimum > 0.0 && chi.maximum <= 1.0 + 1e-12);
    assert!((found.period - 0.125).abs() < 1e-15);
}

#[test]
fn scenes_without_a_period_are_refused_where_the_reason_is() {
    let text = body("bulk_modulus = inf", "", 1.0);
    let second = "[[pressure]]\ngroup = \"top\"\nvalue = { type = \"sine\", amplitude = 1.0, frequency = 30.0 }\n";
    let two = format!("{text}{second}");
    let refused = |text: &str, set: &[&str]| {
        built(text, &[&["analysis=periodic"], set].concat()).unwrap_err()
    };
    let found = refused(&two, &[]);
    assert!(found.contains("20, 30 Hz"), "{found}");
    assert!(built(&two, &["analysis=periodic", "periodic.frequency=10"]).is_ok());
    let found = refused(&two, &["periodic.frequency=20"]);
    assert!(found.contains("pressure[0].value") || found.contains("value ="), "{found}");
    let constant = text.replace("{ type = \"sine\", amplitude = 1.0, frequency = 20.0 }", "1.0");
    for (text, set) in [
        (&constant, "periodic.samples=8"),
        (&constant, "periodic.frequency=20"),
        (&text, "periodic.frequency=0"),
        (&text, "periodic.samples=4"),
    ] {
        assert!(built(text, &["analysis=periodic", set]).is_err(), "{set}");
    }
    let energy = format!("{text}[[probe]]\nname = \"e\"\ntype = \"energy\"\ninterval = 0.1\n");
    assert!(refused(&energy, &[]).contains("energy"));
}

/// Checks that, without `start_time`, the period begins after the rise of the load, and that BDF is replaced.
#[test]
fn loads_that_rise_repeat_from_a_later_period() {
    let text = body("bulk_modulus = inf", "", 2.0);
    let ramped = text.replace("\"sine\"", "\"ramped-sine\"");
    let (expected, _) = periodic(&text, &[]);
    let bdf = ["integrator.method=\"bdf\"", "integrator.max_order=2"];
    let (found, rows) = periodic(&ramped, &bdf);
    let periods = found.start_time * FREQUENCY;
    // The tolerance covers the rounding errors of a quotient and a product.
    assert!(periods >= 1.0 && (periods - periods.round()).abs() < 1e-12, "{periods}");
    assert_eq!(rows[0][0], found.start_time);
    let [own, expected] = [of(&found, "u_y"), of(&expected, "u_y")].map(|u| u.amplitudes[0]);
    // The ramp ends at 1 − 1/(1 + e^shift). The tolerance of both states is 1e-6.
    let height = 1.0 - 1.0 / (1.0 + 8.0_f64.exp());
    assert!((own / expected - height).abs() < 1e-5, "{own} {expected}");
    let early = built(&ramped, &["analysis=periodic", "periodic.start_time=0.1"]).unwrap_err();
    assert!(early.contains("y = "), "{early}");
}

/// Regression: a load with many periods of zeros at its start resulted in the state of rest.
#[test]
fn a_load_that_begins_late_repeats_after_its_beginning() {
    let text = body("bulk_modulus = inf", "", 2.0);
    let line = text.lines().find(|line| line.starts_with("y = ")).unwrap();
    let rise = "{ type = \"step\", value = 1.0, start = 2.0, rise = 0.1 }";
    let late = format!("y = {{ type = \"product\", of = [{rise}, {}] }}", &line[4..]);
    let [(own, _), (expected, _)] =
        [text.replace(line, &late), text.clone()].map(|text| periodic(&text, &[]));
    assert!(own.start_time > 2.0, "{}", own.start_time);
    let [own, expected] = [own, expected].map(|found| of(&found, "u_y").amplitudes[0]);
    // The tolerance of both states is 1e-6.
    assert!((own / expected - 1.0).abs() < 1e-5, "{own} {expected}");
}

/// Checks that the paper's chain follows the rod only with a larger gain. Otherwise, the motion leaves the state near
/// rest.
#[test]
fn an_unlocked_chain_has_only_an_unstable_state() {
    for (gain, is_stable) in [(6000.0, true), (1.0, false)] {
        let set = [
            "analysis=periodic".to_owned(),
            format!("chain[0].gain={gain:?}"),
            "chain[0].oscillators=2".to_owned(),
            "periodic.tolerance=1e-4".to_owned(),
            "periodic.multipliers=1".to_owned(),
        ];
        let scene = Scene::built_in("figure3", &set).unwrap();
        let out = tempfile::tempdir().unwrap();
        let result = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
        assert_eq!(result.notes.is_empty(), is_stable, "{:?}", result.notes);
        let found = result.periodic.unwrap();
        assert_eq!(found.is_stable, Some(is_stable));
        let radius = of(&found, "Psi_abs").mean;
        // The amplitude of the limit cycle is 2.
        assert_eq!(radius > 1.0, is_stable, "{radius}");
    }
}

/// Returns a built-in scene with probes of the driven point and of the chain, sampled at 32 times of a period of 8 Hz.
fn figure(name: &str, set: &[&str]) -> Scene {
    let (kind, at) = match name {
        "figure3" => ("rod", "0.05"),
        _ => ("point", "[0.0, 0.0]"),
    };
    let probes = format!(
        "probe=[{{ name = \"point\", type = \"{kind}\", at = {at}, interval = 0.00390625 }}, \
         {{ name = \"chain\", type = \"coherence\", chain = \"chain\", interval = 0.00390625 }}]"
    );
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).chain([probes]).collect();
    Scene::built_in(name, &set).unwrap()
}

/// Returns the rows of both probes over the last period, sampled at 33 times.
fn last_period(name: &str, set: &[&str]) -> (Option<Periodic>, [Vec<Vec<f64>>; 2]) {
    let out = tempfile::tempdir().unwrap();
    let result = compute(&figure(name, set), &RunOptions::into_folder(out.path())).unwrap();
    let tables = ["point", "chain"].map(|name| {
        let text = std::fs::read_to_string(out.path().join(format!("{name}.csv"))).unwrap();
        let table = Table::parse(&text).unwrap();
        let rows = table.rows.iter().map(|row| table.numbers(row).unwrap());
        let rows: Vec<Vec<f64>> = rows.collect();
        rows[rows.len() - 33..].to_vec()
    });
    (result.periodic, tables)
}

/// Checks the rod of Figure 3 against the closed form of its elements, and rod and chain against the end of the motion, with a gain at
/// which the chain follows. The deviation decays by 0.67 in each of 160 periods.
#[test]
fn figure_3_has_the_periodic_state_to_which_it_settles() {
    let set =
        ["analysis=periodic", "periodic.samples=32", "periodic.multipliers=1", "chain[0].gain=3e4"];
    let (found, own) = last_period("figure3", &set);
    let found = found.unwrap();
    assert_eq!(found.is_stable, Some(true));
    let (_, settled) = last_period("figure3", &["time.end=20.0", "chain[0].gain=3e4"]);
    for (own, settled) in own.iter().zip(&settled) {
        for k in 1..own[0].len() {
            let size = settled.iter().fold(0.0, |size: f64, row| size.max(row[k].abs()));
            for (own, settled) in own.iter().zip(settled) {
                // The allowed error is the tolerance of the periodic state, divided by 1 − 0.67.
                let error = (own[k] - settled[k]).abs();
                assert!(error < 3e-6 * size, "column {k}: {} {}", own[k], settled[k]);
            }
        }
    }
    let case = reference("s13_02_rod.json");
    let row = case["rows"].as_array().unwrap().iter().find(|row| row["f_hz"] == 8).unwrap();
    let exact = &row["strain_form"]["x=0.05"]["ten_linear_elements"];
    let exact = number(&exact["re"]).hypot(number(&exact["im"]));
    // The load rises to 1 − 1/(1 + e^8). The integrator has a relative tolerance of 1e-8.
    let height = 1.0 - 1.0 / (1.0 + 8.0_f64.exp());
    let found = of(&found, "u").amplitudes[0];
    assert!((found / (height * exact) - 1.0).abs() < 1e-8, "{found} {exact}");
}

/// Checks the muscle of Figure 7 against the response by an independent finite element program, with a gain at which its chain follows.
///
/// Regression: the tolerances of the chain were below the rounding errors of the load, so that the steps of muscle and chain
/// stayed at 3e-9 s.
#[test]
fn figure_7_has_the_response_of_its_muscle() {
    let set = ["analysis=periodic", "periodic.samples=32", "periodic.multipliers=1"];
    let (found, _) = last_period("figure7", &[&set[..], &["chain[0].gain=7e5"]].concat());
    let found = found.unwrap();
    assert_eq!(found.is_stable, Some(true));
    let case = reference("s13_07_muscle_frf.json");
    let all = case["results"].as_array().unwrap();
    let own = all.iter().find(|own| own["kappa"] == 1e5 && own["damping"] == "beta1e-4").unwrap();
    let row = own["rows"].as_array().unwrap().iter().find(|row| row[0] == 8).unwrap();
    let expected = number(&row[1]).hypot(number(&row[2]));
    let found = of(&found, "u_y").amplitudes[0];
    // Strains of 1 % change the amplitude by terms of the order of their square, and the load rises to 1 − 1/(1 + e^8).
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
}

/// Checks a body without damping, whose multipliers are on the unit circle.
///
/// Regression: the reason why the stability is unknown was not reported.
#[test]
fn stability_without_damping_is_reported_as_unresolved() {
    let text = body("bulk_modulus = 1e6\nformulation = \"displacement\"", "", 2.0);
    let out = tempfile::tempdir().unwrap();
    let scene = built(&text, &["analysis=periodic", "solid.rayleigh_mass=0.0"]).unwrap();
    let result = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(result.periodic.unwrap().is_stable, None);
    assert_eq!(result.notes.len(), 1, "{:?}", result.notes);
}

/// Regression: the error did not name the free motion of a body that a constant force moves without end.
#[test]
fn the_free_motion_of_a_body_without_a_periodic_state_is_reported() {
    let text = body("bulk_modulus = 1e5", "", 2.0);
    let out = tempfile::tempdir().unwrap();
    let set = ["analysis=periodic", "body_force=[{ y = -3.0 }]", "fixed[0].components=[\"x\"]"];
    let error = compute(&built(&text, &set).unwrap(), &RunOptions::into_folder(out.path()));
    let error = error.map(|found| found.outcome).unwrap_err();
    assert!(matches!(error, Error::Model(ModelError::NotHeld(_))), "{error:?}");
}

/// A strip of contracting fibers, whose force–velocity relation has a kink at rest.
const CONTRACTED: &str = "[mesh]\ntype = \"rectangle\"\nwidth = 0.04\nheight = 0.01\ncells = [4, 1]\n\
    [solid]\nbulk_modulus = 5e4\nrayleigh_mass = 1.0\n[[material]]\nlaw = \"mooney-rivlin\"\nc10 = 4e3\nc01 = 1e3\n\
    density = 1e3\nfiber = [1.0, 0.2]\nviscosity = 3.0\n\
    active = { type = \"given\", tension = 3e3, force_velocity = { v_max = 6.0 } }\n[[fixed]]\ngroup = \"left\"\n\
    [[traction]]\ngroup = \"top\"\ny = { type = \"sine\", amplitude = 1.0, frequency = 7.0 }\n\
    [[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.04, 0.005]\n";

/// Checks that the tolerances of the integrator are tightened, because its errors at the kink exceed them.
///
/// Regression: the search failed.
#[test]
fn tolerances_are_tightened_at_kinks() {
    let [own, expected] =
        ["1e-4", "1e-12"].map(|rtol| periodic(CONTRACTED, &[&format!("integrator.rtol={rtol}")]).0);
    let [own, expected] = [&own, &expected].map(|found| of(found, "u_y").amplitudes[0]);
    // The tolerance of both states is 1e-6.
    assert!((own / expected - 1.0).abs() < 1e-5, "{own} {expected}");
}

/// Checks multipliers whose deviations lead away from the kinks: their fixed steps are shorter than the steps of the state, or
/// adaptive.
///
/// Regression: Newton's method failed in the first step.
#[test]
fn multipliers_have_shorter_steps_than_the_state() {
    let pressure = "pressure=[{ group = \"top\", value = 300.0 }]";
    let stretched = "prescribed_displacement=[{ group = \"right\", x = 0.004 }]";
    for set in [&[pressure, stretched][..], &[pressure]] {
        let set = [set, &["material[0].viscosity=1.0", "periodic.multipliers=1"]].concat();
        assert_eq!(periodic(CONTRACTED, &set).0.is_stable, Some(true));
    }
}

/// Checks a state near a fold, which the motion of three periods does not approach.
///
/// Regression: the search failed.
#[test]
fn the_motion_settles_until_the_search_succeeds() {
    let text = include_str!("../../../../examples/periodic.toml");
    let set = ["body_force[0].y.frequency=18.0", "periodic.continuation="].map(str::to_owned);
    let out = tempfile::tempdir().unwrap();
    let scene = Scene::build("scene.toml", text, &set, Path::new("")).unwrap();
    let found = compute(&scene, &RunOptions::into_folder(out.path())).unwrap().periodic.unwrap();
    assert_eq!(found.is_stable, Some(true));
}

/// Checks a small vibration of a stretched body whose end is shaken.
///
/// Regression: the body had to be at rest at t = 0.
#[test]
fn a_shaken_end_of_a_stretched_body_has_the_harmonic_response() {
    let text = body("bulk_modulus = inf", "", 0.0);
    let set = [
        "traction=[{ group = \"right\", x = 2000.0 }]",
        "prescribed_displacement=[{ group = \"right\", y = { type = \"sine\", amplitude = 1e-5, frequency = 20.0 }, \
         response = { y = 1e-5 } }]",
        "probe[0].at=[0.025, 0.02]",
        "initial_state.type=equilibrium",
    ];
    // The tolerance is relative to the stretch, which is 200 times the vibration.
    let (found, _) = periodic(&text, &[&set[..], &["periodic.tolerance=1e-9"]].concat());
    let u = of(&found, "u_y");
    let own = Complex64::from_polar(u.amplitudes[0], u.phases[0].to_radians());
    let as_response = ["analysis=response", "response.preload_time=0.0"];
    let response = response_of(&built(&text, &[&set[..], &as_response].concat()).unwrap());
    let expected = -Complex64::I * column(&response, "tip", "u_y")[0];
    // A strain of 5e-4 changes the amplitude by terms of the order of its square.
    assert!(error(own, expected) < 1e-6, "{own} {expected}");
}
