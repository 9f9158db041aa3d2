//! Runs of higher index that stop report the reason, and the suggested remedies work.

use std::collections::VecDeque;

use myovib_fem::{Barycentric, Inverted, Mesh, generate};
use myovib_model::advice::{Advice, Advised, Remedy, WithMuscle};
use myovib_model::{
    Advance, Counts, EndReason, Field, Formulation, Integrator, IntegratorKind, Limits, ModelError,
    MuscleDae, Outcome, Settings, Statistics, WorkCounters, check, paper, run, start_at_rest,
};

const INFINITE: f64 = f64::INFINITY;

/// A run of the muscle.
struct Run {
    mesh: Mesh,
    formulation: Formulation,
    beta: f64,
    settings: Settings,
}

impl Run {
    fn new(
        mesh: Mesh,
        formulation: Formulation,
        beta: f64,
        suppressed: &[Field],
        order: u8,
    ) -> Self {
        let settings = Settings {
            suppressed: suppressed.to_vec(),
            max_order: order,
            ..Settings::paper(formulation)
        };
        Self { mesh, formulation, beta, settings }
    }

    fn with_tolerance(self, rtol: f64) -> Self {
        Self { settings: self.settings.with_relative_tolerance(rtol), ..self }
    }

    fn until(mut self, t_end: f64) -> Self {
        self.settings.t_end = t_end;
        // The test considers stops after a first step of this size from rest.
        self.settings.steps.initial_step = Some(1e-3 * t_end);
        self
    }

    fn integrate(&self) -> Statistics {
        let muscle = paper::muscle(&self.mesh, INFINITE, self.beta).unwrap();
        let dae = MuscleDae::new(muscle, self.formulation).unwrap();
        let mut integrator = start_at_rest(dae, &self.settings).unwrap();
        // Detects a remedy with which the run takes extremely small steps.
        let mut limits = Limits::new(60.0, None);
        run(&mut *integrator, &mut [&mut limits]).unwrap()
    }

    /// Returns the message with which the run stops.
    fn message(&self) -> String {
        match self.integrate().outcome {
            Outcome::Stopped { message, .. } => message,
            Outcome::Finished => panic!("the run is expected to stop"),
        }
    }

    fn advice(&self) -> Advice {
        let muscle = paper::muscle(&self.mesh, INFINITE, self.beta).unwrap();
        Advice::new(&muscle, self.formulation, &self.settings)
    }

    /// Checks that the run stops with the words of its advice, and that each remedy alone leads to the end.
    fn stops_and_every_remedy_works(&self, words: &[&str]) {
        let message = self.message();
        for word in words {
            assert!(message.contains(word), "`{word}` in: {message}");
        }
        let causes = self.advice().causes();
        assert!(!causes.is_empty());
        for cause in causes {
            // An order limit has no effect on Radau IIA.
            let is_method = |remedy: &Remedy| matches!(remedy, Remedy::Method(_));
            assert!(!cause.remedies.iter().any(is_method) || cause.remedies.len() == 1);
            // A problem with two remedies is reported once.
            let remedies = cause.remedies.iter().map(ToString::to_string);
            for words in remedies.chain([cause.problem.clone()]) {
                assert!(message.contains(&words), "`{words}` in: {message}");
            }
            let (mut formulation, mut settings) = (self.formulation, self.settings.clone());
            for remedy in &cause.remedies {
                remedy.apply(&mut formulation, &mut settings);
            }
            let mended = Run { mesh: self.mesh.clone(), formulation, beta: self.beta, settings };
            assert_eq!(mended.integrate().outcome, Outcome::Finished, "{cause}");
        }
    }
}

fn muscle() -> Mesh {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/meshes/muscle.msh");
    Mesh::read_msh(path).unwrap()
}

fn spindle() -> Mesh {
    generate::spindle([10, 2]).unwrap()
}

/// Row 4 of Table 2: (28) with κ = ∞, λ of index 3 in the error test, order 5.
#[test]
fn row_4_names_index_variable_and_remedy() {
    Run::new(muscle(), Formulation::Position, 0.0, &[], 5).stops_and_every_remedy_works(&[
        "index 3",
        "p (index 3)",
        "exclude p",
        "step-scaled",
        "order 2",
    ]);
}

/// (29) with κ = ∞ and μ of index 3 in the error test, at the paper's tolerances.
#[test]
fn mu_in_the_error_test() {
    Run::new(spindle(), Formulation::Rate, 1e-4, &[], 5)
        .until(1.0)
        .stops_and_every_remedy_works(&["index 3", "p_rate (index 3)", "exclude p, p_rate"]);
}

/// μ of (29) in the error test at a tolerance of 1e-6, order 2.
#[test]
fn mu_in_the_error_test_at_a_tight_tolerance() {
    Run::new(muscle(), Formulation::Rate, 1e-4, &[], 2)
        .with_tolerance(1e-6)
        .until(1.0)
        .stops_and_every_remedy_works(&[
            "index 3",
            "p_rate (index 3)",
            "tolerance of 1e-6",
            "loosen",
        ]);
}

/// (28) with κ = ∞ at a tight tolerance, order 2.
#[test]
fn a_tight_tolerance() {
    Run::new(spindle(), Formulation::Position, 0.0, &[], 2)
        .with_tolerance(1e-6)
        .until(1.0)
        .stops_and_every_remedy_works(&["index 3", "p (index 3)", "tolerance of 1e-6"]);
}

/// Checks that `check` predicts the text that the run reports when it stops.
#[test]
fn check_warns_in_the_same_words() {
    let bad = Run::new(spindle(), Formulation::Position, 0.0, &[], 5);
    let muscle = paper::muscle(&bad.mesh, INFINITE, 0.0).unwrap();
    let report = check::check(&muscle, bad.formulation, &bad.settings, None).unwrap();
    assert_eq!(report.advice.index(), 3);
    assert_eq!(report.computed.decided(), Some(3));
    assert_eq!(report.advice.to_exclude(), [Field::Pressure]);
    assert_eq!(report.findings[0], bad.advice().causes()[0]);
    assert!(report.residuals.iter().all(|block| block.largest == 0.0));

    let good = Run::new(spindle(), Formulation::Position, 0.0, &[Field::Pressure], 2);
    let report = check::check(&muscle, good.formulation, &good.settings, None).unwrap();
    assert!(report.findings.is_empty(), "{:?}", report.findings);
}

/// Regression: `check` did not object to a mesh in mm, nor to a run of 8e10 periods.
#[test]
fn check_names_units_that_do_not_go_together_and_endless_runs() {
    let mut run = Run::new(spindle(), Formulation::Position, 0.0, &[Field::Pressure], 2);
    let found = |run: &Run| {
        let muscle = paper::muscle(&run.mesh, paper::KAPPA, 0.0).unwrap();
        let report = check::check(&muscle, run.formulation, &run.settings, None).unwrap();
        let words = report.findings.iter().map(ToString::to_string);
        words.collect::<Vec<String>>().join("\n")
    };
    assert_eq!(found(&run), "");
    run.settings.t_end = 1e10;
    assert!(found(&run).contains("8e10 periods"), "{}", found(&run));
    run.settings.t_end = 1.0;
    let in_mm: Vec<[f64; 2]> =
        run.mesh.points().iter().map(|x: &[f64; 2]| x.map(|x| 1e3 * x)).collect();
    let triangles = run.mesh.connectivity::<3>().to_vec();
    run.mesh = Mesh::new(in_mm, triangles, run.mesh.groups().clone()).unwrap();
    let words = found(&run);
    assert!(words.contains("200.000 m") && words.contains("1e-3"), "{words}");
}

/// At a tight tolerance, λ determines the convergence test of Newton's method even if it is
/// excluded from the error test.
#[test]
fn a_tight_tolerance_requires_weights_scaled_by_the_step() {
    let run = |rtol: f64| {
        Run::new(spindle(), Formulation::Position, 0.0, &[Field::Pressure], 2).with_tolerance(rtol)
    };
    assert!(run(1e-3).advice().findings().is_empty());
    let mut tight = run(1e-6);
    let findings = tight.advice().findings();
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_eq!(findings[0].remedies, [Remedy::WeighByStep]);
    Remedy::WeighByStep.apply(&mut tight.formulation, &mut tight.settings);
    assert!(tight.advice().findings().is_empty());
    // Radau IIA needs no such weights.
    let mut radau = run(1e-6);
    radau.settings.integrator = IntegratorKind::Radau9;
    assert!(radau.advice().findings().is_empty());
}

/// The maximum order of BDF is limited by the damping of the modes that steps do not resolve.
#[test]
fn order_by_damping() {
    let order =
        |beta: f64| Run::new(spindle(), Formulation::Rate, beta, &[], 5).advice().max_order();
    // Damping ratio at ω = 10 · 2π · 8 Hz = 503 rad/s, βω/2 for the most part: 0.026, 0.10, 0.35,
    // 0.75 against 0.069 (order 3), 0.287 (4), 0.618 (5).
    assert_eq!([1e-4, 4e-4, 1.4e-3, 3e-3].map(order), [2, 3, 4, 5]);
}

/// A problem that provides only its work counters and the smallest det F.
struct Strained {
    work: WorkCounters,
    ratio: f64,
}

impl WithMuscle for Strained {
    fn unknowns(&self) -> usize {
        0
    }

    fn work(&self) -> WorkCounters {
        self.work
    }

    fn least_volume_ratio(&mut self, _: f64, _: &[f64]) -> (f64, usize) {
        (self.ratio, FLATTEST)
    }
}

/// An integrator that provides only the inversions in each step, and the outcome of the last step.
struct Scripted {
    problem: Strained,
    inversions: VecDeque<u64>,
    end: EndReason,
}

impl Integrator<Strained> for Scripted {
    fn pass_jump(&mut self) -> Result<(), ModelError> {
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, ModelError> {
        let met = self.inversions.pop_front().unwrap();
        let work = &mut self.problem.work;
        work.inversions += met;
        if met > 0 {
            work.inverted = Some(ELEMENT);
        }
        Ok(if self.inversions.is_empty() {
            Advance::Stopped { reason: self.end, message: "stopped".to_owned(), inverted: None }
        } else {
            Advance::Stepped
        })
    }

    fn time(&self) -> f64 {
        0.0
    }

    fn dense_output(&mut self, _: f64, _: u32, _: &mut [f64]) -> Result<(), ModelError> {
        Ok(())
    }

    fn counts(&self) -> Counts {
        Counts::default()
    }

    fn problem(&self) -> &Strained {
        &self.problem
    }

    fn problem_mut(&mut self) -> &mut Strained {
        &mut self.problem
    }
}

/// The element with the smallest det F.
const FLATTEST: usize = 3;

const ELEMENT: Inverted =
    Inverted { element: 7, barycentric: Barycentric::new(&[1.0, 0.0, 0.0]), jacobian: -0.5 };

#[test]
fn only_an_inversion_that_ends_the_run_is_reported() {
    let named = |inversions: [u64; 2], end| {
        let inner = Scripted {
            problem: Strained { work: WorkCounters::default(), ratio: 1.0 },
            inversions: inversions.into(),
            end,
        };
        let bad = Run::new(spindle(), Formulation::Position, 0.0, &[], 5);
        let mut advised = Advised::new(Box::new(inner), bad.advice());
        let outcome = run(&mut advised, &mut []).unwrap().outcome;
        let Outcome::Stopped { message, inverted, .. } = outcome else {
            panic!("the script ends in a stop");
        };
        // The advice names either the element or the index as the cause.
        let blamed = message.contains("element 7");
        assert_eq!(message.contains("p (index 3)"), !blamed, "{message}");
        assert_eq!(inverted, blamed.then_some(ELEMENT));
        blamed
    };
    assert!(named([0, 2], EndReason::ConvergenceFailures));
    assert!(named([1, 1], EndReason::ResidualFailed));
    // A step was taken since.
    assert!(!named([3, 0], EndReason::ConvergenceFailures));
    // A state that fails the error test could be evaluated, so no element was inverted.
    assert!(!named([0, 2], EndReason::ErrorTestFailures));
}

/// A run stopped by the error test without inversions, with a smallest det F of 0.1 or of 0.9.
#[test]
fn a_flat_element_is_blamed_before_the_index() {
    let message = |ratio: f64| {
        let inner = Scripted {
            problem: Strained { work: WorkCounters::default(), ratio },
            inversions: [0].into(),
            end: EndReason::ErrorTestFailures,
        };
        let index_3 = Run::new(spindle(), Formulation::Position, 0.0, &[], 5);
        let mut advised = Advised::new(Box::new(inner), index_3.advice());
        let Advance::Stopped { message, .. } = advised.advance().unwrap() else {
            panic!("the script ends in a stop");
        };
        message
    };
    let flat = message(0.1);
    let place = |text: &str, part: &str| text.find(part).unwrap_or_else(|| panic!("{text}"));
    assert!(flat.contains("det F = 0.100"), "{flat}");
    assert!(place(&flat, "element 3") < place(&flat, "p (index 3)"));
    let sound = message(0.9);
    assert!(sound.contains("p (index 3)"), "{sound}");
    assert!(!sound.contains("element 3"), "{sound}");
}
