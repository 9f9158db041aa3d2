//! Dependence of a muscle and its chains on parameters.

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, Problem, StepError};
use myovib_sparse::Product;

use super::chain::ChainDependence;
use super::dependence::{Dependences, copy_of};
use super::perturbed::PerturbedSystems;
use crate::coupling::{CoupledDae, Oscillators};
use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;

/// A muscle and the networks that it drives.
type Driving = CoupledDae<MuscleDae>;

/// Dependences of a muscle and its chains.
#[derive(Debug)]
pub struct DrivenDependences {
    all: Dependences,
    copy: Option<Box<Driving>>,
    residual: Vec<f64>,
    /// Products with ∂F/∂s of each network; empty until first used.
    products: Vec<Product>,
    /// Values of ∂F/∂s for each stored state and each network.
    places: Vec<Vec<Vec<f64>>>,
    networks: Vec<Oscillators>,
}

impl DrivenDependences {
    /// Creates the dependences of a muscle and its [chains](Dependences::with_chains).
    pub(super) fn new(all: Dependences) -> Self {
        Self {
            all,
            copy: None,
            residual: Vec::new(),
            products: Vec::new(),
            places: Vec::new(),
            networks: Vec::new(),
        }
    }

    /// Returns ∂y_0/∂p for each parameter.
    pub(super) fn starts(&self, dae: &Driving) -> Vec<Vec<f64>> {
        let mut starts = self.all.starts(dae.body_range().len());
        for (j, start) in starts.iter_mut().enumerate() {
            start.resize(dae.n_unknowns(), 0.0);
            if let Some(chain) = self.chain(j).filter(|chain| chain.is_start) {
                let n = dae.oscillators(chain.network).network().n_oscillators();
                start[dae.range(chain.network)][..n].fill(1.0);
            }
        }
        starts
    }

    fn chain(&self, j: usize) -> Option<&ChainDependence> {
        self.all.chains.get(j)?.as_ref()
    }
}

/// Restricts a linearization of the coupled system to the muscle.
fn of_muscle<'a>(at: &Linearization<'a>, n: usize) -> Linearization<'a> {
    Linearization { y: &at.y[..n], y_dot: &at.y_dot[..n], weights: &at.weights[..n], ..*at }
}

impl Parameters<Driving> for DrivenDependences {
    fn list(&self) -> &[Parameter] {
        Parameters::<MuscleDae>::list(&self.all)
    }

    fn derivative(
        &mut self,
        problem: &mut Driving,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let n = problem.body_range().len();
        let (of_muscle, of_chains) = out.split_at_mut(n);
        let muscle = problem.body_mut();
        self.all.derivative(muscle, j, t, &y[..n], &y_dot[..n], of_muscle)?;
        of_chains.fill(0.0);
        let Some(chain) = self.all.chains.get(j).and_then(Option::as_ref) else {
            return Ok(());
        };
        let range = problem.range(chain.network);
        self.residual.resize(range.len(), 0.0);
        let perturbed = chain.perturbed.iter().map(|(weight, other)| (*weight, Some(other)));
        let own = std::iter::once((chain.own_weight, None));
        for (weight, oscillators) in own.chain(perturbed).filter(|(weight, _)| *weight != 0.0) {
            let of = (chain.network, oscillators);
            problem.residual_of(of, t, [y, y_dot], &mut self.residual)?;
            let rows = of_chains[range.start - n..range.end - n].iter_mut();
            rows.zip(&self.residual).for_each(|(o, f)| *o += weight * f);
        }
        Ok(())
    }

    fn keep_tangents(
        &mut self,
        problem: &mut Driving,
        place: usize,
        at: &Linearization<'_>,
    ) -> Result<bool, StepError> {
        let n = problem.body_range().len();
        let muscle = problem.body_mut();
        if !self.all.keep_tangents(muscle, place, &of_muscle(at, n))? {
            return Ok(false);
        }
        if self.products.is_empty() {
            let networks = (0..problem.n_networks()).map(|k| problem.oscillators(k).clone());
            self.networks = networks.collect();
            let pattern = |own: &Oscillators| Product::new(own.network().jacobian_pattern());
            self.products = self.networks.iter().map(pattern).collect();
        }
        if self.places.len() <= place {
            let zeros = |own: &Oscillators| vec![0.0; own.network().jacobian_pattern().nnz()];
            let values = self.networks.iter().map(zeros).collect();
            self.places.resize(place + 1, values);
        }
        for (k, values) in self.places[place].iter_mut().enumerate() {
            let states = &at.y[problem.range(k)];
            let network = self.networks[k].network();
            network.jacobian(states, 1.0, 0.0, values);
        }
        Ok(true)
    }

    fn subtract_tangents(
        &mut self,
        place: usize,
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let states = self.networks.iter().map(|own| own.network().n_states());
        let mut start = x.len() / n_columns - states.sum::<usize>();
        let (x_muscle, x_dot_muscle) = (&x[..start * n_columns], &x_dot[..start * n_columns]);
        let of_muscle = &mut out[..start * n_columns];
        self.all.subtract_tangents(place, [x_muscle, x_dot_muscle], of_muscle, n_columns)?;
        let parts = self.networks.iter().zip(&mut self.products);
        for ((own, product), values) in parts.zip(&self.places[place]) {
            let end = start + own.network().n_states();
            let range = start * n_columns..end * n_columns;
            let rows = &mut out[range.clone()];
            product.subtract_columns(values, &x[range.clone()], rows, n_columns);
            own.subtract_forcing_columns(x_muscle, rows, n_columns);
            let rates = rows.iter_mut().zip(&x_dot[range]);
            rates.for_each(|(row, rate)| *row -= rate);
            start = end;
        }
        Ok(())
    }

    fn linearize(
        &mut self,
        problem: &mut Driving,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        jacobian.parts(copy_of(&mut self.copy, problem), at, parts)
    }
}

impl PerturbedSystems<Driving> for DrivenDependences {
    fn reading_derivative(
        &mut self,
        problem: &Driving,
        j: usize,
        own: &[f64],
        read: &mut dyn FnMut(&mut Driving) -> Result<Vec<f64>, ModelError>,
    ) -> Result<Vec<f64>, ModelError> {
        let copy = copy_of(&mut self.copy, problem);
        let muscles = self.all.get_mut(j);
        let mut sum = muscles.reading_derivative(own, &mut |other| {
            std::mem::swap(copy.body_mut(), other);
            let read = read(copy);
            std::mem::swap(copy.body_mut(), other);
            read
        })?;
        let chain = self.all.chains.get_mut(j).and_then(Option::as_mut);
        let Some(ChainDependence { network, own_weight, perturbed, .. }) = chain else {
            return Ok(sum);
        };
        let mut add = |weight: f64, values: &[f64]| {
            let both = sum.iter_mut().zip(values);
            both.for_each(|(sum, value)| *sum += weight * value);
        };
        add(*own_weight, own);
        for (weight, other) in perturbed {
            copy.exchange(*network, other);
            let values = read(copy);
            copy.exchange(*network, other);
            add(*weight, &values?);
        }
        Ok(sum)
    }
}
