//! Rod and chains of a scene.

use std::f64::consts::TAU;

use myovib_fem::rod::{EndLoad, Rod, RodData};
use myovib_model::{ModelError, RodDae};
use myovib_oscillators::{Chain, Coefficients, Detuning, Drive, Neighborhood};

use super::Body;
use super::builder::Builder;
use super::chain_places::{DrivenPlace, Found, MAX_OSCILLATORS};
use crate::InputError;
use crate::probe::expect_chain;
use crate::scene_file::chain::{self, Place, RodLoadType};
use crate::scene_file::output::Stop;

#[derive(Debug, Clone)]
pub struct DrivenChain {
    pub name: String,
    pub chain: Chain,
    /// Gain and range of the forcing.
    pub drive: Drive,
    /// Definition of the positions of the forcing, if given.
    pub at: Option<Place>,
    pub places: Vec<DrivenPlace>,
    /// Number of grid points outside the body.
    pub outside: usize,
    /// Neighborhoods of the places, if requested.
    pub neighborhood: Option<Neighborhood>,
    /// Initial position of all oscillators.
    pub initial: f64,
}

impl DrivenChain {
    /// Returns the number of positions, each of which has one chain; 1 if no position is given.
    pub fn n_places(&self) -> usize {
        self.places.len().max(1)
    }

    /// Returns the number of unknowns. These are the position and velocity of each oscillator at all places.
    pub fn n_unknowns(&self) -> usize {
        2 * self.chain.omega.len()
    }

    /// Returns the element of each chain if the chains are defined by elements.
    pub fn elements(&self) -> Option<Vec<usize>> {
        let elements = self.places.iter().map(|place| place.at.element);
        matches!(self.at, Some(Place::Elements { .. })).then(|| elements.collect())
    }

    /// Returns whether there are chains at many places, each with its own coherence.
    pub fn is_in_many_places(&self) -> bool {
        !matches!(self.at, None | Some(Place::Point(_) | Place::Position(_)))
    }

    /// Returns whether there are chains at many points that do not belong to elements. The fields of a run show them as
    /// separate points.
    pub fn is_at_many_points(&self) -> bool {
        self.is_in_many_places() && self.elements().is_none()
    }

    /// Returns a note if grid points of the chain are outside the body.
    pub(super) fn note(&self) -> Option<String> {
        let (kept, all) = (self.places.len(), self.places.len() + self.outside);
        (self.outside > 0).then(|| {
            format!("chain `{}`: {kept} of the {all} grid points are in the body", self.name)
        })
    }
}

impl Builder<'_> {
    pub(super) fn rod(&self, rod: &chain::Rod) -> Result<RodDae, InputError> {
        let data = RodData {
            axial_stiffness: rod.stiffness,
            density: rod.density,
            length: rod.length,
            mass_damping: rod.rayleigh_mass,
            stiffness_damping: rod.rayleigh_stiffness,
            n_elements: rod.elements,
        };
        let load = match rod.load_type {
            RodLoadType::Strain => EndLoad::Strain,
            RodLoadType::Traction => EndLoad::Traction,
        };
        let signal = self.signal(&rod.load, "rod.load")?;
        let rod = self.at("rod", Rod::new(data))?;
        self.at("rod.load", RodDae::new(rod, load, signal))
    }

    /// Creates the chains. Their names must be unique.
    pub(super) fn chains(&self, body: Option<&Body>) -> Result<Vec<DrivenChain>, InputError> {
        for (i, chain) in self.file.chain.iter().enumerate() {
            if self.file.chain[..i].iter().any(|before| before.name == chain.name) {
                let error = InputError::new(format!("two chains have the name `{}`", chain.name))
                    .next("set a unique `name` of each chain");
                return Err(self.wrong(&format!("chain[{i}]"), error));
            }
        }
        let chains = self.file.chain.iter().enumerate();
        chains.map(|(i, chain)| self.chain(body, chain, &format!("chain[{i}]"))).collect()
    }

    fn chain(
        &self,
        body: Option<&Body>,
        chain: &chain::Chain,
        path: &str,
    ) -> Result<DrivenChain, InputError> {
        let place = format!("{path}.at");
        match (&chain.at, body, self.file.rod.is_some()) {
            (Some(Place::Position(_)), _, true) | (None, ..) => {}
            (Some(Place::Position(_)), _, false) => {
                let error = InputError::new("a position requires a rod, but the scene has no rod")
                    .next("for a muscle, write the point as a list of its coordinates");
                return Err(self.wrong(&place, error));
            }
            (Some(_), None, _) => {
                let error = InputError::new("a point requires a body, but the scene has no mesh")
                    .next("for a rod, write the position as one number");
                return Err(self.wrong(&place, error));
            }
            (Some(_), Some(_), _) => {}
        }
        let Found { places, outside } = match body {
            Some(body) => self.places_of(body, chain, path)?,
            None => Found::default(),
        };
        let neighborhood = self.neighborhood(body, chain, &places, path)?;
        let n_places = places.len().max(1);
        let n = chain.oscillators.saturating_mul(n_places);
        if n > MAX_OSCILLATORS {
            let error = InputError::new("too many oscillators")
                .found(format!("{} at each of {n_places} places", chain.oscillators))
                .allowed(format!("at most {MAX_OSCILLATORS} in total"));
            return Err(self.wrong(&format!("{path}.oscillators"), error));
        }
        let detuning = Detuning {
            center: TAU * chain.frequency,
            half_width: TAU * chain.frequency_spread,
            generator: chain.generator,
            seed: chain.seed,
        };
        let omega = detuning.frequencies(n).map_err(ModelError::from);
        let reach = chain.driven;
        Ok(DrivenChain {
            name: chain.name.clone(),
            chain: Chain {
                omega: self.at(path, omega)?,
                coefficients: Coefficients {
                    vdp_mu: chain.van_der_pol,
                    duffing: chain.duffing,
                    coupling: chain.coupling,
                },
                ends: chain.ends,
                reach,
            },
            drive: Drive { gain: chain.gain, reach },
            at: chain.at.clone(),
            places,
            outside,
            neighborhood,
            initial: chain.initial,
        })
    }

    /// Returns the neighborhoods of the places of a chain with field output.
    fn neighborhood(
        &self,
        body: Option<&Body>,
        chain: &chain::Chain,
        places: &[DrivenPlace],
        path: &str,
    ) -> Result<Option<Neighborhood>, InputError> {
        let Some(radius) = chain.coherence_radius else {
            return Ok(None);
        };
        let path = format!("{path}.coherence_radius");
        let (Some(body), 2.., Some(_)) = (body, places.len(), &self.file.fields) else {
            let error = InputError::new(
                "a coherence radius requires a chain at several positions of the body, and [fields]",
            )
            .next("place the chain at many positions and add [fields], or remove the radius");
            return Err(self.wrong(&path, error));
        };
        let space = body.muscle.solid.space();
        let points = places.iter().map(|place| place.point(space));
        let neighborhood = Neighborhood::new(points.collect(), radius);
        Ok(Some(self.at(&path, neighborhood.map_err(ModelError::from))?))
    }

    /// Checks that probes refer to parts of the scene and have unique names.
    pub(super) fn probes(&self) -> Result<(), InputError> {
        for (i, stop) in self.file.stop.iter().enumerate() {
            if let Stop::Coherence { chain, .. } = stop {
                let checked = expect_chain(self.file, chain);
                checked.map_err(|(key, error)| self.wrong(&format!("stop[{i}]{key}"), error))?;
            }
        }
        self.table_names()?;
        for (i, probe) in self.file.probe.iter().enumerate() {
            let checked = probe.kind.kind().check_part(self.file);
            checked.map_err(|(key, error)| self.wrong(&format!("probe[{i}]{key}"), error))?;
        }
        Ok(())
    }

    /// Checks the names of the tables for probes and ratios.
    fn table_names(&self) -> Result<(), InputError> {
        let probes = self.file.probe.iter().map(|probe| &probe.name);
        let probes = probes.enumerate().map(|(i, name)| (format!("probe[{i}]"), name));
        let ratios = self.file.response.iter().flat_map(|response| &response.ratio);
        let ratios = ratios.map(|ratio| &ratio.name).enumerate();
        let ratios = ratios.map(|(i, name)| (format!("response.ratio[{i}]"), name));
        let all: Vec<(String, &String)> = probes.chain(ratios).collect();
        for (i, (path, name)) in all.iter().enumerate() {
            let wrong = |error| Err(self.wrong(&format!("{path}.name"), error));
            let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || !name.chars().all(good) {
                let error = InputError::new("the name is used as a file name");
                return wrong(error.found(name).allowed("letters, digits, `_` and `-`"));
            }
            if all[..i].iter().any(|(_, before)| before == name) {
                return wrong(InputError::new(format!("the name `{name}` is already used")));
            }
        }
        Ok(())
    }
}
