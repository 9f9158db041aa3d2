//! Scenes for which a response cannot be computed: each gives one error, at the key to change.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::modes::Modes;
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;

pub(crate) const SCENE: &str = r#"analysis = "response"
[mesh]
type = "beam"
length = 0.1
height = 0.02
cells = [4, 1]
[solid]
bulk_modulus = 1e5
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = "fixed"
[[traction]]
group = "load"
response = { y = 1.0 }
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.0]
[response]
frequencies = [1.0, 2.0]
"#;

/// Returns the error of the scene with changed values.
fn refusal(set: &[&str]) -> Option<String> {
    refusal_of(SCENE, set)
}

/// Returns the error of a scene with changed values.
pub(crate) fn refusal_of(text: &str, set: &[&str]) -> Option<String> {
    let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
    let built = Scene::build("scene.toml", text, &set, Path::new(""));
    let error = match built {
        Err(error) => return Some(error.to_string()),
        Ok(scene) => Response::of_scene(&scene, Watcher::NOBODY).err()?,
    };
    Some(error.to_string())
}

#[test]
fn values_without_a_derivative_at_rest_are_omitted() {
    let quantities = "probe[0].quantities=[\"von-mises\", \"u\"]".to_owned();
    let scene = Scene::build("scene.toml", SCENE, &[quantities], Path::new("")).unwrap();
    let response = Response::of_scene(&scene, Watcher::NOBODY).unwrap();
    assert_eq!(response.probes[0].columns, ["u_x", "u_y"]);
    assert!(response.notes.iter().any(|note| note.contains("`tip`")));
}

#[test]
fn invalid_responses_are_refused_at_their_key() {
    assert_eq!(refusal(&[]), None);
    assert_eq!(refusal(&["response.frequencies=[0.0, 1.0]"]), None);
    for (set, place) in [
        (&["response.frequencies=[-1.0]"][..], "--set response.frequencies"),
        (&["response.frequencies=1..2"], "--set response.frequencies"),
        (&["response.frequencies=fast"], "--set response.frequencies"),
        // The body can slide along x, so a solution at 0 Hz does not exist.
        (
            &["response.frequencies=[0.0, 1.0]", "fixed[0].components=[\"y\"]"],
            "--set response.frequencies",
        ),
        (&["traction[0].response.y=0.0"], "line 1,"),
        (&["traction[0].response=", "traction[0].y=1.0"], "line 1,"),
        (&["response="], "line 1,"),
        (&["probe=[]"], "--set probe=[]"),
        (
            &[
                "material[0].prony=[{ relative_modulus = 0.1, relaxation_time = 1.0 }]",
                "probe[0].quantities=[\"stress\"]",
            ],
            "--set probe[0].quantities",
        ),
        (&["probe[0].quantities=[\"von-mises\"]"], "line "),
        (
            &[
                "analysis=dynamic",
                "time.end=1.0",
                "material[0].springpot={ modulus = 1e3, viscosity = 1.0, exponent = 0.3 }",
            ],
            "--set material[0].springpot",
        ),
        (
            &[
                "material[0].law=small-strain",
                "material[0].viscosity=1.0",
                "response.preload_time=0.0",
            ],
            "line 9,",
        ),
    ] {
        let message = refusal(set).unwrap_or_else(|| panic!("{set:?} is accepted"));
        let line = message.lines().find(|line| line.contains("where:"));
        let line = line.unwrap_or_else(|| panic!("no place: {message}"));
        assert!(line.contains(place), "{set:?}: {place}: {message}");
    }
}

/// Checks that a body without supports along x has a response above 0 Hz: a rigid motion remains, but the matrix is not
/// singular.
#[test]
fn free_bodies_respond_above_zero() {
    assert_eq!(refusal(&["fixed[0].components=[\"y\"]"]), None);
}

/// Regression: the modes of a scene were rejected with its response.
#[test]
fn a_chain_that_acts_back_excludes_a_response_but_not_modes() {
    let chain = "[[chain]]\nname = \"c\"\noscillators = 3\nat = [0.05, 0.01]\n\
                 [[feedback]]\nchain = \"c\"\nat_zero_coherence = 1.5\n";
    let text = format!("{SCENE}{chain}");
    assert!(refusal_of(&text, &[]).is_some_and(|error| error.contains("`c`")));
    let modes = |text: &str| {
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        Modes::of_scene(&scene, Some(3), Watcher::NOBODY).unwrap().muscles.remove(0)
    };
    let (alone, with_chain) = (modes(SCENE), modes(&text));
    assert_eq!(with_chain.modes, alone.modes);
    assert_eq!(with_chain.notes.len(), alone.notes.len() + 1);
}
