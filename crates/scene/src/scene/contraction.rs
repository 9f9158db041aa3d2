//! Stresses that materials have in addition to their laws (fiber tension, viscosity), and elastic foundations of the
//! boundary.

use myovib_fem::material::{ActiveStress, Bestel, ForceLength, Prony, Springpot, unit_vector};
use myovib_fem::{AddedStress, FemError, Mesh, Solid, SupportDirection};
use myovib_model::{Activation, RobinSupport, Signal, TimeScales};

use super::builder::Builder;
use super::distribution::point;
use crate::InputError;
use crate::scene_file::active::{Active, Tension};
use crate::scene_file::chain::Place;
use crate::scene_file::material::Material;
use crate::scene_file::solid::{Direction, SpatialFactor};
use crate::scene_file::{self, Analysis, SceneFile};

/// Minimum and maximum number of sample times for the check of the sign of a prescribed tension.
const SAMPLES: [f64; 2] = [1e3, 1e6];
/// Number of sample times per time scale of the tension.
const SAMPLES_OF_A_CHANGE: f64 = 4.0;

/// A law whose ratio of bulk to shear modulus is below this value counts as having no volumetric part. The value allows
/// for a few rounding errors.
const ISOCHORIC: f64 = 1e-10;

/// Stresses that materials have in addition to their laws.
#[derive(Default)]
pub(super) struct Added {
    /// Stresses with their elements.
    pub(super) stresses: Vec<(Vec<usize>, AddedStress)>,
    /// Tension of each active material, with the index of its stress.
    pub(super) activations: Vec<(usize, Activation)>,
    /// Factor of the tension in each element, if a material has a `spatial_factor`.
    pub(super) tension_factors: Option<Vec<f64>>,
}

/// Returns the names of the chains that act back on the body.
pub(super) fn chains_that_act(file: &SceneFile) -> impl Iterator<Item = &str> {
    let of_stiffness = file.feedback.iter().map(|feedback| feedback.chain.as_str());
    of_stiffness.chain(file.material.iter().filter_map(chain_of_tension))
}

/// Returns whether chains act back only on the elements that drive them.
pub(super) fn act_on_own_elements(file: &SceneFile) -> bool {
    chains_that_act(file).all(|name| {
        let mut chains = file.chain.iter().filter(|chain| chain.name == name);
        chains.all(|chain| matches!(chain.at, Some(Place::Elements { .. })))
    })
}

/// Returns the name of the chain that drives the tension of a material, if there is one.
fn chain_of_tension(material: &Material) -> Option<&str> {
    match &material.active.as_ref()?.tension {
        Tension::Coherence { chain, .. } => Some(chain),
        Tension::Given { .. } | Tension::Bestel { .. } => None,
    }
}

impl Builder<'_> {
    /// Returns active and viscous stresses of the materials. `regions` contains the material of
    /// each element.
    pub(super) fn added(&self, mesh: &Mesh, regions: &[usize]) -> Result<Added, InputError> {
        let Added { mut stresses, mut activations, mut tension_factors } = Added::default();
        for (i, material) in self.file.material.iter().enumerate() {
            let viscosity = material.viscosity.unwrap_or(0.0);
            if material.active.is_none() && viscosity == 0.0 {
                continue;
            }
            let path = format!("material[{i}]");
            let of_region = |element: &usize| regions[*element] == i;
            let members: Vec<usize> = (0..regions.len()).filter(of_region).collect();
            let refused = material.active.is_some() || self.file.analysis != Analysis::Response;
            let refused = refused && material.law.law.is_linear();
            if let (true, Some(&element)) = (refused, members.first()) {
                self.at(&path, Err(FemError::AddedToSmallStrain { element }))?;
            }
            let mut stress = AddedStress { active: None, viscosity };
            if let Some(active) = &material.active {
                let path = format!("{path}.active");
                if material.fiber.is_none() {
                    let error = InputError::new("active stress needs the direction of the fibers")
                        .next(super::materials::GIVE_FIBER);
                    return Err(self.wrong(&path, error));
                }
                stress.active = Some(self.active_stress(active, &path)?);
                let activation = self.activation(active, &path)?;
                if let Some(factor) = &active.spatial_factor {
                    if !matches!(activation, Activation::Given(_)) {
                        let error = InputError::new(
                            "only a tension of type = \"given\" can have a spatial factor",
                        );
                        let error = error.next("use type = \"given\", or several materials");
                        return Err(self.wrong(&format!("{path}.spatial_factor"), error));
                    }
                    let factors = tension_factors.get_or_insert_with(|| vec![1.0; regions.len()]);
                    self.set_tension_factors(factors, mesh, &members, factor, &path)?;
                }
                activations.push((stresses.len(), activation));
            }
            stresses.push((members, stress));
        }
        Ok(Added { stresses, activations, tension_factors })
    }

    /// Sets the factors of a material's tension at the centers of its elements.
    fn set_tension_factors(
        &self,
        factors: &mut [f64],
        mesh: &Mesh,
        members: &[usize],
        given: &SpatialFactor,
        path: &str,
    ) -> Result<(), InputError> {
        let factor = self.factor(Some(given), mesh, 0, path)?;
        let mut negative = None;
        for &element in members {
            let vertices = mesh.element(element);
            let weight = 1.0 / vertices.len() as f64;
            let coordinate =
                |axis| vertices.iter().map(|&vertex| weight * point(mesh, vertex)[axis]).sum();
            let center: Vec<f64> = (0..mesh.dimension()).map(coordinate).collect();
            factors[element] = factor.at(vertices, &vec![weight; vertices.len()], &center);
            if factors[element] < 0.0 {
                negative = negative.or(Some((factors[element], center)));
            }
        }
        self.finite(factor)?;
        let Some((value, center)) = negative else {
            return Ok(());
        };
        let error = InputError::new(format!("the tension factor at {center:?} is negative"));
        let error = error.found(value).allowed("0 or more at the centers of the elements");
        Err(self.wrong(&format!("{path}.spatial_factor"), error))
    }

    /// Returns the Prony terms and springpots of the materials, each with the elements to which they apply.
    pub(super) fn relaxation(
        &self,
        regions: &[usize],
    ) -> Result<Vec<(Vec<usize>, Prony)>, InputError> {
        let mut relaxing = Vec::new();
        for (i, material) in self.file.material.iter().enumerate() {
            let terms = material.prony.as_deref().unwrap_or_default();
            let path = format!("material[{i}].prony");
            for (k, term) in terms.iter().enumerate() {
                let one = Prony::new(vec![term.into()]);
                self.at(&format!("{path}[{k}]"), one)?;
            }
            let prony = Prony::new(terms.iter().map(Into::into).collect());
            let mut prony = self.at(&path, prony)?;
            if let Some(springpot) = &material.springpot {
                let path = format!("material[{i}].springpot");
                let springpot = self.springpot(material, springpot, &path)?;
                prony = self.at(&path, prony.with_springpot(springpot))?;
            }
            if prony.is_empty() {
                continue;
            }
            if material.law.law.is_linear() && self.file.analysis != Analysis::Response {
                let error =
                    InputError::new("Prony terms require a finite-strain law in this analysis")
                        .next("choose a finite-strain law, or Rayleigh damping");
                return Err(self.wrong(&path, error));
            }
            let members: Vec<usize> = (0..regions.len()).filter(|e| regions[*e] == i).collect();
            relaxing.push((members, prony));
        }
        Ok(relaxing)
    }

    /// Returns the springpot of a material relative to the shear modulus of its law.
    fn springpot(
        &self,
        material: &Material,
        springpot: &scene_file::material::Springpot,
        path: &str,
    ) -> Result<Springpot, InputError> {
        if self.file.analysis.is_in_time() || self.file.analysis == Analysis::Periodic {
            let error = InputError::new("springpots are not supported in the time domain")
                .next("compute a response, or use `prony` in a dynamic analysis");
            return Err(self.wrong(path, error));
        }
        let law = self.at(path, material.stiffened())?;
        let [bulk, shear] = law.moduli();
        if law.has_fibers() || bulk.abs() > ISOCHORIC * shear {
            let error =
                InputError::new("a springpot needs an isotropic law without a volumetric part");
            let error = error.next(
                "use mooney-rivlin, neo-hooke, small-strain or deviatoric-st-venant-kirchhoff",
            );
            return Err(self.wrong(path, error));
        }
        let scene_file::material::Springpot { modulus, viscosity, exponent } = *springpot;
        Ok(Springpot {
            weight: modulus.powf(1.0 - exponent) * viscosity.powf(exponent) / shear,
            exponent,
        })
    }

    fn active_stress(&self, active: &Active, path: &str) -> Result<ActiveStress, InputError> {
        let stress = ActiveStress {
            tension: active.stress.into(),
            force_length: match &active.force_length {
                Some(curve) => curve.into(),
                None => ForceLength::Constant,
            },
            force_velocity: active.force_velocity.as_ref().map(Into::into),
        };
        self.at(path, stress.check())?;
        Ok(stress)
    }

    fn activation(&self, active: &Active, path: &str) -> Result<Activation, InputError> {
        match active.tension {
            Tension::Coherence { at_zero_coherence, .. } => {
                Ok(Activation::Coherence { unsynchronized: at_zero_coherence })
            }
            Tension::Given { ref tension } => {
                let path = format!("{path}.tension");
                let signal = self.signal(tension, &path)?;
                self.not_negative(&signal, &path)?;
                Ok(Activation::Given(signal))
            }
            Tension::Bestel { contractility, rise, decay, systole, diastole, width } => {
                if self.file.analysis == Analysis::Static {
                    let error = InputError::new(
                        "Bestel's tension requires a dynamic analysis: it starts at 0",
                    )
                    .next("use a tension of type = \"given\", or analysis = \"dynamic\"");
                    return Err(self.wrong(path, error));
                }
                let model =
                    Bestel { tension: contractility, rise, decay, systole, diastole, width };
                self.at(path, model.check())?;
                Ok(Activation::Bestel(model))
            }
        }
    }

    /// Rejects a tension that is negative at a sample time. A tension that is negative only between sample times stops
    /// the run instead.
    fn not_negative(&self, signal: &Signal, path: &str) -> Result<(), InputError> {
        let [least, most] = SAMPLES;
        let changes = signal.time_scale(0.0, self.t_end);
        let n = changes.map_or(least, |scale| SAMPLES_OF_A_CHANGE * self.t_end / scale);
        let n = n.clamp(least, most).ceil();
        let samples = (0..=n as u32).map(|k| self.t_end * f64::from(k) / n);
        let kinks = signal.breaks(0.0, self.t_end).map(|kink| kink.t);
        let mut values = samples.chain(kinks).map(|t| (t, signal.at(t).value));
        match values.find(|(_, tension)| *tension < 0.0) {
            None => Ok(()),
            Some((t, tension)) => {
                let error =
                    InputError::new("a muscle can only pull: its tension cannot be negative")
                        .found(format!("{tension:e} Pa at t = {t} s"))
                        .allowed("0 Pa or more at all times");
                Err(self.wrong(path, error))
            }
        }
    }

    /// Returns the elastic foundations of the boundary, followed by the springs.
    pub(super) fn foundations(&self, solid: &Solid) -> Result<Vec<RobinSupport>, InputError> {
        let foundations = self.file.elastic_foundation.iter().enumerate();
        let foundations = foundations.map(|(i, foundation)| {
            let path = format!("elastic_foundation[{i}]");
            let constants = [foundation.stiffness, foundation.damping];
            self.expect_effect("an elastic foundation", constants, ["Pa/m", "Pa·s/m"], &path)?;
            let along = match foundation.along {
                Direction::All => SupportDirection::All,
                Direction::Normal => SupportDirection::Normal,
            };
            let foundation = RobinSupport::new(solid, &foundation.group, along, constants);
            self.at(&format!("{path}.group"), foundation)
        });
        let springs = self.file.spring.iter().enumerate().map(|(i, spring)| {
            let path = format!("spring[{i}]");
            let constants = [spring.stiffness, spring.damping];
            self.expect_effect("a spring", constants, ["N/m", "N·s/m"], &path)?;
            let mesh = solid.space().mesh();
            let direction = spring.direction.as_ref().map(|given| {
                let vector = self.vector(given, mesh, &format!("{path}.direction"))?;
                Ok(unit_vector(vector))
            });
            let point = self.point(solid.space(), &spring.at, &path)?;
            let spring = RobinSupport::spring(solid, &point, direction.transpose()?, constants);
            self.at(&path, spring)
        });
        foundations.chain(springs).collect()
    }

    /// Rejects a support that has neither stiffness nor damping.
    fn expect_effect(
        &self,
        what: &str,
        constants: [f64; 2],
        units: [&str; 2],
        path: &str,
    ) -> Result<(), InputError> {
        if constants != [0.0; 2] {
            return Ok(());
        }
        let error = InputError::new(format!("{what} without stiffness and damping has no effect"));
        let next = format!("set `stiffness` in {}, or `damping` in {}", units[0], units[1]);
        Err(self.wrong(path, error.next(next)))
    }
}
