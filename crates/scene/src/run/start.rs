//! Integrators for the systems of a scene. An integrator starts from the initial state or from a checkpoint.
//!
//! | Scene | Function | System |
//! |---|---|---|
//! | body | `muscle` | `MuscleDae` |
//! | body and chains that act on it | `muscle_with_feedback` | `FeedbackDae` |
//! | body and chains with separate steps | `muscle_beside_chains` | `Multirate<MuscleDae>` |
//! | body and chains with the same steps | `muscle_and_chains` | `CoupledDae<MuscleDae>` |
//! | rod and chains with separate steps | `rod_beside_chains` | `Multirate<CoupledDae<RodDae>>` |
//! | rod, with or without chains | `rod_and_chains` | `CoupledDae<RodDae>` |
//! | chains | `chains` | `CoupledDae<NoBody>` |

mod checks;
mod initial;
mod without_body;

use std::slice::SliceIndex;
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_model::advice::{Advice, Advised, WithMuscle};
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, FeedbackDae, Multirate, NoBody, Oscillators, Recording,
    Source, StateTolerances, start_coupled, start_coupled_from, start_with_feedback,
};
use myovib_model::start::Consistent;
use myovib_model::{
    Displacement, Integrator, ModelError, MuscleDae, Probe, RodDae, Settings, StepOptions, start,
    start_from,
};

use super::checkpoint::Checkpoint;
use crate::Error;
use crate::scene::{Body, DrivenChain, DrivenPlace, Scene};
use crate::system::{Body as CoupledBody, System};
use crate::watch::Watcher;
pub(super) use checks::expect_start;
pub use initial::initial;
pub(super) use without_body::{driven_by_rod, options};

/// Operation on the integrator of a scene, independent of the type of the system.
pub(super) trait Driver {
    type Result;

    fn drive<P: System>(self, integrator: Box<dyn Integrator<P>>) -> Result<Self::Result, Error>;
}

/// Creates the integrator of a scene, at the initial state or at a checkpoint, and passes it to the driver.
///
/// # Errors
/// Fails if the system cannot start; in this case, nothing is written. Also returns the errors of the driver.
pub(super) fn start<D: Driver>(
    scene: &Scene,
    checkpoint: Option<&Checkpoint>,
    watcher: Watcher<'_>,
    driver: D,
) -> Result<D::Result, Error> {
    let starter = Starter { scene, checkpoint, watcher };
    let wrong = Error::before_any_output;
    match (&scene.body, &scene.rod) {
        (Some(body), _) if scene.chains.is_empty() => {
            driver.drive(starter.muscle(body).map_err(wrong)?.0)
        }
        (Some(body), _) if !scene.feedbacks.is_empty() => {
            driver.drive(starter.muscle_with_feedback(body).map_err(wrong)?)
        }
        (Some(body), _) if scene.has_separate_chains() => {
            driver.drive(starter.muscle_beside_chains(body).map_err(wrong)?)
        }
        (Some(body), _) => driver.drive(starter.muscle_and_chains(body).map_err(wrong)?),
        (None, Some(rod)) if scene.has_separate_chains() => {
            driver.drive(starter.rod_beside_chains(rod).map_err(wrong)?)
        }
        (None, Some(rod)) => driver.drive(starter.rod_and_chains(rod).map_err(wrong)?),
        (None, None) => driver.drive(starter.chains(|| Source::Rest).map_err(wrong)?),
    }
}

/// Returns an integrator for the muscle of a scene, excluding the chains. The integrator starts from the initial state.
///
/// # Errors
/// Fails if the scene has no body or the body cannot start. Also returns the errors of the integrator.
pub fn muscle_alone(scene: &Scene) -> Result<Box<dyn Integrator<MuscleDae>>, Error> {
    let body = scene.expect_body()?;
    Ok(Starter::initial(scene).muscle(body)?.0)
}

/// Returns an integrator for the rod of a scene, coupled to the chains. The integrator starts from rest.
///
/// # Errors
/// Fails if the scene has no rod. Also returns the errors of the integrator.
pub fn rod_with_chains(scene: &Scene) -> Result<Box<dyn Integrator<CoupledDae<RodDae>>>, Error> {
    let rod = scene.rod.as_ref().ok_or(ModelError::NoSuchPart { part: "rod" })?;
    Starter::initial(scene).rod_and_chains(rod)
}

/// Returns an integrator for the chains of a scene, driven by a recorded motion.
///
/// # Errors
/// Returns the errors of the integrator.
pub fn replayed(
    scene: &Scene,
    motion: &Arc<Recording>,
) -> Result<Box<dyn Integrator<CoupledDae<NoBody>>>, Error> {
    Starter::initial(scene).chains(|| Source::Recorded(Arc::clone(motion)))
}

/// Returns an integrator for the muscle of a scene, coupled to the chains. The integrator starts from the initial
/// state.
///
/// # Errors
/// Fails if the scene has no body or the body cannot start. Also returns the errors of the integrator.
pub fn with_chains(scene: &Scene) -> Result<Box<dyn Integrator<CoupledDae<MuscleDae>>>, Error> {
    let body = scene.expect_body()?;
    Starter::initial(scene).muscle_and_chains(body)
}

type Boxed<P> = Box<dyn Integrator<P>>;

/// Integrator of a body, and the state of the body.
type Started<B> = (Boxed<B>, Vec<f64>);

/// Muscle coupled to its chains, with the error test, the options, and initial values.
type Coupled<Y> = (CoupledDae<MuscleDae>, (ErrorTest, CoupledOptions), Y);

/// Scene whose integrators start at the initial state or at a checkpoint.
struct Starter<'a> {
    scene: &'a Scene,
    checkpoint: Option<&'a Checkpoint>,
    watcher: Watcher<'a>,
}

impl<'a> Starter<'a> {
    fn initial(scene: &'a Scene) -> Self {
        Self { scene, checkpoint: None, watcher: Watcher::NOBODY }
    }

    /// Returns the part of the checkpoint that contains the unknowns in `range`, if there is a checkpoint.
    fn resumed(
        &self,
        range: impl SliceIndex<[f64], Output = [f64]> + Clone,
    ) -> Option<Resumed<'a>> {
        self.checkpoint.map(|checkpoint| Resumed {
            t: checkpoint.t,
            y: &checkpoint.y[range.clone()],
            y_dot: &checkpoint.y_dot[range],
            step: Some(checkpoint.step),
            has_history: checkpoint.continuation.is_some(),
        })
    }

    fn muscle(&self, body: &Body) -> Result<Started<MuscleDae>, Error> {
        let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let Some(resumed) = self.resumed(..dae.n_unknowns()) else {
            let [y, y_dot] = initial(body, &mut dae, self.watcher)?;
            return Ok((start_from(dae, &body.settings, 0.0, &y, &y_dot)?, y));
        };
        let [y, y_dot] = resumed.values(&mut dae)?;
        let steps = resumed.steps(body.settings.steps);
        let settings = Settings { steps, ..body.settings.clone() };
        Ok((start_from(dae, &settings, resumed.t, &y, &y_dot)?, y))
    }

    /// Starts a muscle with separately integrated chains.
    fn muscle_beside_chains(&self, body: &Body) -> Result<Boxed<Multirate<MuscleDae>>, Error> {
        let muscle = self.muscle(body)?;
        let oscillators = driven_by(self.scene, muscle.0.problem())?;
        self.beside(muscle, oscillators)
    }

    /// Starts the separately integrated chains, given the integrator and the state of the body.
    fn beside<B: 'static>(
        &self,
        (body, y): Started<B>,
        oscillators: Vec<Oscillators>,
    ) -> Result<Boxed<Multirate<B>>, Error> {
        let wanted = &self.scene.file.integrator;
        let kind = wanted.method;
        let at = (body.time(), &y[..]);
        let start = |dae: CoupledDae<NoBody>| {
            let test = ErrorTest::of_states(0, tolerances(self.scene));
            let options = CoupledOptions::of_oscillators(kind).with_steps(wanted.steps);
            let resumed = self.resumed(y.len()..).map(|resumed| Resumed {
                step: wanted.steps.initial_step, // the stored step size belongs to the body
                ..resumed
            });
            self.coupled(dae, (test, options), resumed, &[])
        };
        let both = Multirate::new(body, at, oscillators, kind, start)?;
        Ok(Box::new(both))
    }

    fn muscle_and_chains(&self, body: &Body) -> Result<Boxed<CoupledDae<MuscleDae>>, Error> {
        let (dae, how, start) = self.one_way(body, &body.settings)?;
        let integrator = self.coupled(dae, how, self.resumed(..), &start)?;
        Ok(advised(integrator, body))
    }

    /// Starts a muscle with chains that act back on its stiffness or tension.
    fn muscle_with_feedback(&self, body: &Body) -> Result<Boxed<FeedbackDae>, Error> {
        let scene = self.scene;
        let (dae, (test, options), rest) = self.one_way(body, &body.settings)?;
        let test = test.with_oscillators(&dae, tolerances(scene));
        let rest = initial_state(scene, &dae, &rest);
        let mut dae = FeedbackDae::new(dae, scene.feedbacks.clone());
        let (t, [y, y_dot], options) = match self.resumed(..) {
            Some(resumed) => {
                let steps = resumed.steps(scene.file.integrator.steps);
                (resumed.t, resumed.values(&mut dae)?, options.with_steps(steps))
            }
            None => {
                let (y_dot, _) = dae.derivatives_at(0.0, &rest).map_err(ModelError::from)?;
                (0.0, [rest, y_dot], options)
            }
        };
        let times = [t, scene.t_end];
        let integrator = start_with_feedback(dae, test, options, times, &y, &y_dot)?;
        Ok(advised(integrator, body))
    }

    /// Returns a muscle with its chains, the error test of the muscle, the options, and the initial unknowns of the
    /// muscle. The unknowns are empty for a resumed run.
    fn one_way(&self, body: &Body, settings: &Settings) -> Result<Coupled<Vec<f64>>, Error> {
        let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let start = match self.checkpoint {
            None => {
                let [y, _] = initial(body, &mut dae, self.watcher)?;
                y
            }
            Some(_) => Vec::new(),
        };
        let options = CoupledOptions::of_muscle(&dae, settings);
        let test = ErrorTest::of_muscle(&dae, settings);
        let oscillators = driven_by(self.scene, &dae)?;
        Ok((CoupledDae::new(dae, oscillators), (test, options), start))
    }

    fn coupled<B: CoupledBody>(
        &self,
        mut dae: CoupledDae<B>,
        (test, options): (ErrorTest, CoupledOptions),
        resumed: Option<Resumed<'_>>,
        start: &[f64],
    ) -> Result<Boxed<CoupledDae<B>>, Error> {
        let scene = self.scene;
        let test = test.with_oscillators(&dae, tolerances(scene));
        Ok(match resumed {
            None => {
                let y = initial_state(scene, &dae, start);
                start_coupled(dae, test, options, scene.t_end, &y)?
            }
            Some(resumed) => {
                let [y, y_dot] = resumed.values(&mut dae)?;
                let options = options.with_steps(resumed.steps(scene.file.integrator.steps));
                start_coupled_from(dae, test, options, [resumed.t, scene.t_end], &y, &y_dot)?
            }
        })
    }
}

/// Part of the state in a checkpoint.
struct Resumed<'a> {
    t: f64,
    y: &'a [f64],
    y_dot: &'a [f64],
    /// First step size (s).
    step: Option<f64>,
    /// Whether the integrator continues with its stored history.
    has_history: bool,
}

impl Resumed<'_> {
    /// Returns the values of y and ẏ from which the system continues. Without a stored history, ẏ is computed again,
    /// because the derivative of the BDF polynomial is too inaccurate to restart a system of index 3 at order 1.
    fn values<P: Consistent>(&self, dae: &mut P) -> Result<[Vec<f64>; 2], ModelError> {
        match self.has_history {
            true => Ok([self.y.to_vec(), self.y_dot.to_vec()]),
            false => dae.consistent(self.t, self.y),
        }
    }

    fn steps(&self, steps: StepOptions) -> StepOptions {
        StepOptions { initial_step: self.step, ..steps }
    }
}

/// Returns the chains of a scene, driven by the muscle `dae`.
///
/// # Errors
/// Fails if a network is invalid.
pub(crate) fn driven_by(scene: &Scene, dae: &MuscleDae) -> Result<Vec<Oscillators>, Error> {
    let source = |place: &DrivenPlace| Source::Body(place.displacement(dae));
    oscillators(scene, |chain| match &chain.places[..] {
        [] => Ok(vec![Source::Rest]),
        places => Ok(places.iter().map(source).collect()),
    })
}

/// Returns the muscle of a scene with its chains, ready to be integrated with the given `settings`, and consistent values
/// of y and ẏ at t = 0.
///
/// # Errors
/// Fails if the body cannot start.
pub(crate) fn driving(
    scene: &Scene,
    body: &Body,
    settings: &Settings,
    watcher: Watcher<'_>,
) -> Result<Coupled<[Vec<f64>; 2]>, Error> {
    let starter = Starter { scene, checkpoint: None, watcher };
    let (mut dae, (test, options), start) = starter.one_way(body, settings)?;
    let test = test.with_oscillators(&dae, tolerances(scene));
    let y = initial_state(scene, &dae, &start);
    let start = start::Consistent::consistent(&mut dae, 0.0, &y)?;
    Ok((dae, (test, options), start))
}

/// Wraps the integrator so that the outcome of a stopped run contains advice about the body.
fn advised<P: WithMuscle + 'static>(
    integrator: Box<dyn Integrator<P>>,
    body: &Body,
) -> Box<dyn Integrator<P>> {
    let advice = Advice::new(&body.muscle, body.formulation, &body.settings);
    Box::new(Advised::new(integrator, advice))
}

impl DrivenPlace {
    /// Returns the displacement of the muscle that drives the chain at this position.
    pub fn displacement(&self, dae: &MuscleDae) -> Displacement {
        let probe = Probe::located_at(dae.muscle().solid.space(), self.at);
        dae.displacement_along(&probe, self.direction)
    }
}

/// Returns the initial state of a body and its oscillators. `body` contains the unknowns of the body; if it is empty,
/// the body is at rest. The oscillators start at the positions given in the scene.
pub(super) fn initial_state<B: CoupledBody>(
    scene: &Scene,
    dae: &CoupledDae<B>,
    body: &[f64],
) -> Vec<f64> {
    let mut y = vec![0.0; dae.n_unknowns()];
    y[dae.body_range()][..body.len()].copy_from_slice(body);
    for (k, chain) in scene.chains.iter().enumerate().take(dae.n_networks()) {
        let n = dae.oscillators(k).network().n_oscillators();
        y[dae.range(k)][..n].fill(chain.initial);
    }
    y
}

fn oscillators(
    scene: &Scene,
    sources: impl Fn(&DrivenChain) -> Result<Vec<Source>, ModelError>,
) -> Result<Vec<Oscillators>, Error> {
    let chains = scene.chains.iter().enumerate();
    chains
        .map(|(i, chain)| {
            let path = format!("chain[{i}]");
            let network = chain.chain.network_at(chain.n_places());
            let network = scene.at(&path, network.map_err(ModelError::from))?;
            let sources = scene.at(&format!("{path}.at"), sources(chain))?;
            Ok(scene.at(&path, Oscillators::new(network, chain.drive, sources))?)
        })
        .collect()
}

pub(super) fn tolerances(scene: &Scene) -> StateTolerances {
    let wanted = &scene.file.integrator.oscillators;
    StateTolerances { relative: wanted.rtol, absolute: wanted.atol, tested: wanted.in_error_test }
}
