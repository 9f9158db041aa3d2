//! Field output of chains at many positions.

use myovib_model::{ModelError, Probe, Snapshot};
use myovib_oscillators::{Neighborhood, coherence_at};

use crate::Error;
use crate::result_folder::ResultFolder;
use crate::scene::{DrivenPlace, Scene};
use crate::system::{System, network_of};
use crate::vtu::{CellField, Cloud};

/// Chains of a scene at many positions. Chains located in elements are written as cell fields, and all other chains as
/// separate points.
#[derive(Default)]
pub(super) struct Oscillations {
    chains: Vec<Shown>,
    /// Points of all chains without cell fields.
    pub(super) cloud: Option<Cloud>,
}

/// Chain at many positions.
struct Shown {
    network: usize,
    name: String,
    in_elements: bool,
    places: Vec<DrivenPlace>,
    neighborhood: Option<Neighborhood>,
}

/// Order parameters of a chain at a given time, with one value per position.
pub(super) struct Measured {
    /// |χ|.
    coherence: Vec<f64>,
    /// |Ψ|.
    amplitude: Vec<f64>,
    /// Value of |χ| in each neighborhood; NaN if not requested.
    neighborhood: Vec<f64>,
}

const NAMES: [&str; 3] = ["coherence", "amplitude", "neighborhood"];

impl Measured {
    /// Returns the values in the order of `NAMES`.
    fn fields(&self) -> [&[f64]; 3] {
        [&self.coherence, &self.amplitude, &self.neighborhood]
    }
}

impl Shown {
    fn measure<P: System>(&self, system: &P, y: &[f64]) -> Result<Measured, ModelError> {
        let (network, range) = network_of(system, self.network)?;
        let (position, velocity) = y[range].split_at(network.n_oscillators());
        let n = self.places.len();
        let found = coherence_at(n, network.omega(), position, velocity);
        Ok(Measured {
            coherence: found.iter().map(|place| place.phase.norm()).collect(),
            amplitude: found.iter().map(|place| place.centroid.norm()).collect(),
            neighborhood: match &self.neighborhood {
                Some(neighborhood) => neighborhood.coherence(&found),
                None => vec![f64::NAN; n],
            },
        })
    }
}

impl Oscillations {
    /// Returns the chains of a scene that have field output. `done` contains the times of existing files.
    pub(super) fn new(scene: &Scene, done: &[f64]) -> Self {
        let Some(body) = &scene.body else {
            return Self::default();
        };
        let chains = scene.chains.iter().enumerate();
        let in_many = chains.filter(|(_, chain)| chain.is_in_many_places());
        let shown = in_many.map(|(network, chain)| Shown {
            network,
            name: chain.name.clone(),
            in_elements: chain.elements().is_some(),
            places: chain.places.clone(),
            neighborhood: chain.neighborhood.clone(),
        });
        let chains: Vec<Shown> = shown.collect();
        let space = body.muscle.solid.space();
        let at_points = chains.iter().filter(|chain| !chain.in_elements);
        let points = at_points.flat_map(|chain| {
            let points = chain.places.iter().map(|place| place.point(space));
            points.map(|point| (chain.network, point))
        });
        let points: Vec<_> = points.collect();
        let cloud = (!points.is_empty()).then(|| Cloud::new(points, done));
        Self { chains, cloud }
    }

    /// Returns the order parameters of each chain in state `y`.
    pub(super) fn measure<P: System>(
        &self,
        system: &P,
        y: &[f64],
    ) -> Result<Vec<Measured>, ModelError> {
        let chains = self.chains.iter();
        chains.map(|chain| chain.measure(system, y)).collect()
    }

    /// Returns the cell fields of the chains located in elements.
    pub(super) fn cell_fields(&self, measured: &[Measured]) -> Vec<CellField> {
        let of_chain = |(chain, measured): (&Shown, &Measured)| {
            let wanted = if chain.neighborhood.is_some() { 3 } else { 2 };
            let fields = NAMES.iter().zip(measured.fields()).take(wanted);
            let named = fields.map(|(name, values)| CellField {
                name: format!("{name}_{}", chain.name),
                values: chain
                    .places
                    .iter()
                    .map(|place| place.at.element)
                    .zip(values.iter().copied())
                    .collect(),
            });
            named.collect::<Vec<_>>()
        };
        let all = self.chains.iter().zip(measured);
        let in_elements = all.filter(|(chain, _)| chain.in_elements);
        in_elements.flat_map(of_chain).collect()
    }

    /// Writes the points of all chains without cell fields.
    pub(super) fn write(
        &mut self,
        folder: &ResultFolder,
        t: f64,
        snapshot: &Snapshot<'_>,
        measured: &[Measured],
    ) -> Result<(), Error> {
        let Some(cloud) = &mut self.cloud else {
            return Ok(());
        };
        let space = snapshot.solid.space();
        let at_points = || {
            let all = self.chains.iter().zip(measured);
            all.filter(|(chain, _)| !chain.in_elements)
        };
        let places = at_points().flat_map(|(chain, _)| &chain.places);
        let moved =
            places.map(|place| Probe::located_at(space, place.at).vector(snapshot.displacement));
        let fields = NAMES.iter().enumerate().map(|(i, name)| {
            let values = at_points().flat_map(|(_, measured)| measured.fields()[i]);
            (*name, values.copied().collect())
        });
        cloud.write(folder, t, moved, fields.collect())
    }
}
