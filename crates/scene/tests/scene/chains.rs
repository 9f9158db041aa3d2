//! Chains in the elements of a group: forcing, output and error messages.

use std::path::Path;

use myovib_dae::Problem;
use myovib_model::MuscleDae;
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};

const SCENE: &str = r#"
[time]
end = 0.06
[mesh]
type = "muscle3d"
cells = [10, 2, 2]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 100.0, rise = 0.03 }
[[chain]]
name = "spindles"
at = { elements = "muscle" }
oscillators = 4
frequency_spread = 0.3183098861837907
gain = 4e5
[fields]
interval = 0.06
quantities = ["u"]
[[probe]]
name = "all"
type = "coherence"
chain = "spindles"
interval = 0.06
"#;

fn refusal(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    let text = SCENE.replacen(from, to, 1);
    match Scene::build("scene.toml", &text, &[], Path::new("")) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn each_element_of_a_group_has_a_chain_with_its_own_frequencies() {
    let scene = Scene::build("scene.toml", SCENE, &[], Path::new("")).unwrap();
    let body = scene.body.as_ref().unwrap();
    let space = body.muscle.solid.space();
    let elements = scene.chains[0].elements().unwrap();
    let (places, omega) = (elements.len(), &scene.chains[0].chain.omega);
    assert!(places > 10 && places < space.n_elements(), "{places}");
    assert_eq!(omega.len(), 4 * places);
    // All places share one seed, so the first frequencies equal the frequencies of a single chain.
    let single = SCENE.replacen("{ elements = \"muscle\" }", "[0.0, 0.0, 0.0]", 1);
    let single = Scene::build("scene.toml", &single, &[], Path::new("")).unwrap();
    assert_eq!(omega[..4], single.chains[0].chain.omega);
    assert!(omega[4..8] != omega[..4]);

    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions::into_folder(folder.path());
    let document = compute(&scene, &options).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let n = MuscleDae::new(body.muscle.clone(), body.formulation).unwrap().n_unknowns();
    assert_eq!(document["unknowns"], n + 2 * 4 * places);
    let text = std::fs::read_to_string(folder.path().join("fields_00001.vtu")).unwrap();
    let field = myovib_scene::vtu::read_field(&text, "coherence_spindles").unwrap();
    assert_eq!(field.len(), space.n_elements());
    let inside: Vec<f64> = elements.iter().map(|&e| field[e]).collect();
    assert!(inside.iter().all(|chi| (0.0..=1.0 + 1e-12).contains(chi)), "{inside:?}");
    assert!(inside.iter().any(|chi| *chi > 0.5), "{inside:?}");
    let without = field.iter().filter(|chi| chi.is_nan()).count();
    assert_eq!(without, space.n_elements() - places);
}

#[test]
fn chains_without_elements_are_refused() {
    let feedback =
        "[[feedback]]\nchain = \"spindles\"\ngroup = \"muscle\"\nat_zero_coherence = 1.5\n[fields]";
    for (from, to, messages) in [
        ("elements = \"muscle\"", "elements = \"muscles\"", ["muscles", "muscle"]),
        ("elements = \"muscle\"", "elements = \"left\"", ["left", "contains no tetrahedra"]),
        ("oscillators = 4", "oscillators = 900000", ["too many oscillators", "in total"]),
        ("[fields]", feedback, ["acts only on this element", "remove `group`"]),
    ] {
        let found = refusal(from, to);
        for message in messages {
            assert!(found.contains(message), "{to}: {found}");
        }
    }
}

/// Returns the scene with chains that stiffen and contract their elements.
fn two_way() -> String {
    let feedback = "[[feedback]]\nchain = \"spindles\"\nat_zero_coherence = 1.5\n[fields]";
    let active = "c10 = 1e4\nfiber = \"fiber\"\ngroup = \"muscle\"\nactive = { type = \"coherence\", chain = \
                  \"spindles\", at_full_coherence = 2e4 }\n[[material]]\nlaw = \"mooney-rivlin\"\ndensity = 1e3\n\
                  group = \"tendon\"\nc10 = 1e4";
    let text = SCENE.replacen("[fields]", feedback, 1);
    let text = text.replacen("c10 = 1e4", active, 1);
    text.replacen("quantities = [\"u\"]", "quantities = [\"u\", \"tension\"]", 1)
}

#[test]
fn chains_stiffen_and_contract_the_elements_they_are_in() {
    let scene = Scene::build("scene.toml", &two_way(), &[], Path::new("")).unwrap();
    let elements = scene.chains[0].elements().unwrap();
    // There are two feedbacks, each with one place for each element that has a chain.
    assert_eq!(scene.feedbacks.len(), 2);
    for feedback in &scene.feedbacks {
        assert_eq!(feedback.weights.len(), elements.len());
    }
    let folder = tempfile::tempdir().unwrap();
    let document = compute(&scene, &RunOptions::into_folder(folder.path())).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    // The oscillators are eliminated before the factorization.
    assert!(
        document["work"]["linear"]["factorizations"].as_u64() > Some(0),
        "{}",
        document["work"]
    );
    assert!(document["work"]["coherence_passes"].as_u64() > Some(0));
    let text = std::fs::read_to_string(folder.path().join("fields_00001.vtu")).unwrap();
    let chi = myovib_scene::vtu::read_field(&text, "coherence_spindles").unwrap();
    assert!(elements.iter().any(|&element| chi[element] > 0.5));
}

const PRONY: &str = "prony = [{ relative_modulus = 0.5, relaxation_time = 0.02 }]\n";
const FEEDBACK: &str = "[[feedback]]\nchain = \"spindles\"\nat_zero_coherence = 1.5\n";

/// Returns the final displacement and tension in the middle: with relaxation, for which Radau IIA and BDF must agree,
/// and without relaxation.
fn with_and_without_relaxation(text: &str) -> [Vec<f64>; 2] {
    let probe = "[[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.0, 0.0, 0.0]\n\
                 quantities = [\"u\", \"tension\"]\ninterval = 0.06\n";
    let last = |text: &str, method: &str| -> Vec<f64> {
        let method = format!("integrator.method={method}");
        let set = [method, "integrator.rtol=1e-6".to_owned()];
        let text = format!("{text}{probe}");
        let scene = Scene::build("scene.toml", &text, &set, Path::new("")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let document = compute(&scene, &RunOptions::into_folder(folder.path()));
        assert_eq!(document.unwrap().document["outcome"], "finished");
        let table = std::fs::read_to_string(folder.path().join("middle.csv")).unwrap();
        let last = table.lines().last().unwrap().split(',').skip(1);
        last.map(|word| word.parse().unwrap()).collect()
    };
    assert!(text.contains(PRONY));
    let elastic = last(&text.replacen(PRONY, "", 1), "radau5");
    let [radau, bdf] = ["radau5", "bdf"].map(|method| last(text, method));
    for (i, (radau, bdf)) in radau.iter().zip(&bdf).enumerate() {
        // The error is at most a thousand times the tolerance, because the errors of the many steps of BDF accumulate.
        let size = if i < 3 { length(&elastic) } else { 2e4 };
        assert!((radau - bdf).abs() < 1e-3 * size, "{i}: {radau} {bdf}");
    }
    [radau, elastic]
}

fn length(of: &[f64]) -> f64 {
    of[..3].iter().map(|u| u * u).sum::<f64>().sqrt()
}

/// Checks that two methods agree for a contracting body with relaxation. Internal stresses are unknowns of the body,
/// and oscillators are still eliminated, both in contracting elements and at one point.
#[test]
fn chains_contract_a_body_whose_stress_relaxes() {
    let relaxing = format!("fiber = \"fiber\"\n{PRONY}");
    let text = two_way().replacen("fiber = \"fiber\"\n", &relaxing, 1);
    assert!(text.contains(FEEDBACK));
    let text = text.replacen(FEEDBACK, "", 1);
    let at_one_point = text.replacen("{ elements = \"muscle\" }", "[0.0, 0.0, 0.0]", 1);
    assert_ne!(at_one_point, text);
    for text in [text, at_one_point] {
        let [relaxed, elastic] = with_and_without_relaxation(&text);
        // Both the relaxing stress and the tension must have an effect.
        let pairs = relaxed.iter().zip(&elastic);
        let moved: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        assert!(length(&moved) > 0.01 * length(&elastic), "{relaxed:?} {elastic:?}");
        assert!(relaxed[3] > 1.0, "{relaxed:?}");
    }
}

/// Checks the energy balance of a viscous body with stress relaxation, contracted by oscillators at many places.
/// The balance includes the powers of tensions that follow the oscillators and of the internal stresses.
#[test]
fn chains_and_stress_that_relaxes_keep_the_balance_of_energy() {
    const RTOL: f64 = 1e-5;
    let relaxing = format!("fiber = \"fiber\"\nviscosity = 20.0\n{PRONY}");
    let text = two_way().replacen("fiber = \"fiber\"\n", &relaxing, 1);
    assert!(text.contains(FEEDBACK));
    let text = text.replacen(FEEDBACK, "", 1)
        + "[[probe]]\nname = \"energy\"\ntype = \"energy\"\ninterval = 0.005\n";
    for method in ["radau5", "radau9"] {
        let set = [format!("integrator.method={method}"), format!("integrator.rtol={RTOL}")];
        let scene = Scene::build("scene.toml", &text, &set, Path::new("")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        compute(&scene, &RunOptions::into_folder(folder.path())).unwrap();
        let table = std::fs::read_to_string(folder.path().join("energy.csv")).unwrap();
        let table = Table::parse(&table).unwrap();
        let rows = table.rows.iter().map(|row| table.numbers(row).unwrap());
        let rows: Vec<Vec<f64>> = rows.collect();
        let largest = |column: usize| {
            let values = rows.iter().map(|row| row[column].abs());
            values.fold(0.0, f64::max)
        };
        let [work, dissipated, imbalance] = [3, 4, 5].map(largest);
        assert!(dissipated > 0.2 * work, "{dissipated:e} {work:e}");
        // The bound is the tolerance of one step, because Radau IIA is more accurate than its error estimate at the
        // ends of steps.
        assert!(imbalance < RTOL * work, "{method}: {imbalance:e} {work:e}");
    }
}

/// Checks a body in which one part relaxes and chains stiffen another part.
#[test]
fn chains_stiffen_a_body_beside_stress_that_relaxes() {
    let tendon = "group = \"tendon\"\n";
    let text = two_way().replacen(tendon, &format!("{tendon}{PRONY}"), 1);
    assert!(text.contains(FEEDBACK));
    let [relaxed, elastic] = with_and_without_relaxation(&text);
    let pairs = relaxed.iter().zip(&elastic);
    let moved: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
    assert!(length(&moved) > 1e-3 * length(&elastic), "{relaxed:?} {elastic:?}");
}

#[test]
fn tensions_that_cannot_follow_a_chain_are_refused() {
    for (from, to, messages) in [
        ("at_full_coherence = 2e4", "at_full_coherence = -1.0", ["at_full_coherence", "-1"]),
        (
            "active = { type = \"coherence\", chain = \"spindles\"",
            "active = { type = \"coherence\", chain = \"none\"",
            ["unknown chain `none`", "spindles"],
        ),
        ("oscillators = 4", "oscillators = 4\ninitial = 1.0", ["jump at the start", "initial"]),
        (
            "elements = \"muscle\"",
            "elements = \"tendon\"",
            ["elements of the material have no chain", "all elements"],
        ),
        (
            "quantities = [\"u\", \"tension\"]",
            "quantities = [\"u\"]\n[initial_state]\ntype = \"velocity\"\nvalue = [0.0, 0.0, 1.0]",
            ["must start at rest", "[initial_state]"],
        ),
        (
            "fiber = \"fiber\"",
            "fiber = \"fiber\"\nprony = [{ relative_modulus = 0.5, relaxation_time = 0.1 }]",
            ["where stress relaxes (material[0].prony)", "constant coefficients"],
        ),
    ] {
        let text = two_way();
        assert!(text.contains(from), "{from}");
        let found =
            match Scene::build("scene.toml", &text.replacen(from, to, 1), &[], Path::new("")) {
                Ok(_) => "accepted".to_owned(),
                Err(error) => error.to_string(),
            };
        for message in messages {
            assert!(found.contains(message), "{to}: {found}");
        }
    }
}
