//! The runs behind tables, figures and films are those of the scenes in `data/scenes/`.
//!
//! (The film of the inclusion is made from its scene; the others keep the command line's options
//! and say here that without them they are the same runs.)

use clap::Parser;
use myovib_fem::Mesh;
use myovib_model::coupling::StateTolerances;
use myovib_model::{
    Formulation, IntegratorKind, Muscle, Quantity, Settings, Signal, paper, table1,
};

use super::figure::muscle_run::PERIOD;
use super::figure::{MUSCLE_END, MuscleRun, PER_PERIOD, ROD_END};
use crate::experiments::{ChainArgs, EVERY, muscle_chain_settings};
use myovib_scene::mesh_file;
use myovib_scene::probe::{Point, ProbeKind};
use myovib_scene::scene_file::chain::Place;
use myovib_scene::scene_file::integrator::Method;
use myovib_scene::{Body, Scene};

/// The commands' options when none is given.
#[derive(Parser)]
struct Defaults {
    #[command(flatten)]
    chain: ChainArgs,
}

fn defaults() -> Defaults {
    Defaults::parse_from(["myovib"])
}

fn mesh() -> Mesh {
    mesh_file::load(None).unwrap().0
}

fn scene(name: &str) -> Scene {
    Scene::built_in(name, &[]).unwrap()
}

fn body(scene: &Scene) -> &Body {
    scene.body.as_ref().unwrap()
}

/// All that a muscle is made of, every number to its last digit.
fn data(muscle: &Muscle) -> String {
    let solid = &muscle.solid;
    format!(
        "{:?}",
        (
            solid.space().mesh(),
            solid.dofs(),
            solid.laws(),
            solid.mass_values(),
            muscle.parameters,
            &muscle.loads,
            &muscle.prescribed,
        )
    )
}

#[track_caller]
fn assert_same(
    name: &str,
    scene: &Body,
    muscle: &Muscle,
    formulation: Formulation,
    run: &Settings,
) {
    assert_eq!(scene.formulation, formulation, "{name}");
    assert_eq!(scene.settings, *run, "{name}");
    // Too long to be shown.
    assert!(
        data(&scene.muscle) == data(muscle),
        "{name}: the bodies differ"
    );
}

/// The interval of the probe that looks at the origin's displacement and pressure.
fn origin_interval(scene: &Scene) -> f64 {
    let probe = &scene.file.probe[0];
    let quantities = vec![Quantity::Displacement, Quantity::Pressure];
    let at = vec![0.0, 0.0];
    assert_eq!(probe.kind, ProbeKind::Point(Point { at, quantities }));
    probe.every
}

#[test]
fn the_linear_rows_of_table_1() {
    let mesh = mesh();
    let cases = table1::cases();
    let linear: Vec<_> = cases.iter().filter(|c| c.equation == Some("26")).collect();
    assert_eq!(linear.len(), 4);
    for case in linear {
        let kappa = if case.kappa.is_finite() {
            "finite"
        } else {
            "inf"
        };
        let beta = if case.beta > 0.0 {
            "damped"
        } else {
            "undamped"
        };
        let name = format!("table1-26-{kappa}-{beta}");
        let scene = scene(&name);
        let Body {
            muscle,
            formulation,
            ..
        } = body(&scene);
        let load = Signal::paper(paper::LOAD_AMPLITUDE);
        let (kappa, beta) = (case.kappa, case.beta);
        let ours = paper::muscle_with_load(&mesh, case.law, kappa, beta, load).unwrap();
        assert!(data(muscle) == data(&ours), "{name}: the bodies differ");
        // Without damping (26) is (28) with the linear law.
        let index = formulation.index(&muscle.parameters);
        assert_eq!(Some(usize::from(index)), case.printed, "{name}");
    }
}

#[test]
fn figure_4() {
    let scene = scene("figure4");
    let ours = paper::muscle(&mesh(), paper::KAPPA, paper::BETA).unwrap();
    let theirs = &body(&scene).muscle.solid;
    assert_eq!(theirs.space().mesh(), ours.solid.space().mesh());
    assert_eq!(
        theirs.dofs().free_to_full(),
        ours.solid.dofs().free_to_full()
    );
}

#[test]
fn figures_5_and_6_and_the_film_of_the_muscle() {
    let muscle = paper::muscle(&mesh(), paper::KAPPA, paper::BETA).unwrap();
    let settings = MuscleRun::settings(MUSCLE_END, IntegratorKind::Ida);
    for name in ["figure5", "figure6"] {
        assert_same(
            name,
            body(&scene(name)),
            &muscle,
            Formulation::Rate,
            &settings,
        );
    }
    assert_eq!(origin_interval(&scene("figure6")), PERIOD / PER_PERIOD);
}

/// The chain of a scene is that of the options' defaults, driven at `place`.
fn assert_same_chain(scene: &Scene, oscillators: usize, width: f64, place: Place) {
    let setup = defaults().chain.setup(oscillators, width).unwrap();
    let [chain] = &scene.chains[..] else {
        panic!("one chain")
    };
    let networks = [chain.chain.network().unwrap(), setup.network().unwrap()];
    let [theirs, ours] = networks.map(|network| format!("{network:?}"));
    assert_eq!(theirs, ours);
    assert_eq!(
        (chain.drive, chain.at.clone()),
        (setup.drive(), Some(place))
    );
    assert_eq!(chain.initial, 0.0);
    let tolerances = &scene.file.integrator.oscillators;
    let theirs = StateTolerances {
        relative: tolerances.rtol,
        absolute: tolerances.atol,
        tested: tolerances.in_error_test,
    };
    assert_eq!(theirs, StateTolerances::default());
}

#[test]
fn figures_2_and_3_and_the_film_of_the_chain() {
    for name in ["figure2", "figure3"] {
        let scene = scene(name);
        let rod = paper::rod().unwrap();
        assert_eq!(
            format!("{:?}", scene.rod),
            format!("{:?}", Some(rod)),
            "{name}"
        );
        assert_same_chain(&scene, 20, 0.05, Place::Position(paper::ROD_POINT));
        assert_eq!(scene.t_end, ROD_END);
        let integrator = &scene.file.integrator;
        assert_eq!(
            (integrator.method, integrator.max_order),
            (Method::Bdf, None)
        );
    }
    assert_eq!(scene("figure3").file.probe[0].every, EVERY);
}

#[test]
fn figure_7() {
    let scene = scene("figure7");
    let muscle = paper::muscle(&mesh(), paper::KAPPA, paper::BETA).unwrap();
    let settings = Settings {
        t_end: MUSCLE_END,
        ..muscle_chain_settings(IntegratorKind::Ida)
    };
    assert_same(
        "figure7",
        body(&scene),
        &muscle,
        Formulation::Rate,
        &settings,
    );
    assert_same_chain(&scene, 5, 0.5, Place::Point(vec![0.0, 0.0]));
    assert_eq!(scene.chains[0].places[0].direction, [0.0, 1.0, 0.0]);
    assert_eq!(scene.file.probe[0].every, EVERY);
}
