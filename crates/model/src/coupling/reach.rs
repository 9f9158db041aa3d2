//! Places where the coherence of oscillators acts on a body, and the derivatives of the body's
//! forces there.

use std::ops::Range;

use myovib_dae::StepError;
use myovib_sparse::Scalar;

use super::dae::CoupledDae;
use super::effect::{Effect, Feedback};
use crate::coloring::colors;
use crate::muscle_dae::MuscleDae;

/// One place of a network. Its coherence determines one value g of the body.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) feedback: usize,
    /// Index of the place within the feedback.
    pub(super) number: usize,
    /// Range of the place's oscillators in the network.
    oscillators: Range<usize>,
    of_network: usize,
    /// Rows of the momentum balance, counted from its first row, on which g acts.
    pub(super) rows: Vec<usize>,
    /// ∂F/∂g in these rows.
    pub(super) force: Vec<f64>,
    /// ∂g/∂s: first for the positions of the place's oscillators, then for their velocities.
    pub(super) slope: Vec<f64>,
}

impl Place {
    /// Returns the ranges of the positions and velocities of the place's oscillators in the states of the network.
    fn states(&self) -> [Range<usize>; 2] {
        let Range { start, end } = self.oscillators;
        let n = self.of_network;
        [start..end, start + n..end + n]
    }

    /// Returns the entries of ∂g/∂s as pairs (index of the state in the network, value).
    pub(super) fn slopes(&self) -> impl Iterator<Item = (usize, f64)> {
        let slopes = self.slope.iter().copied();
        self.states().into_iter().flatten().zip(slopes)
    }

    /// Returns ∇gᵀ x for states x of the network.
    pub(super) fn along<T: Scalar>(&self, x: &[T]) -> T {
        let [positions, velocities] = self.states();
        let (by_position, by_velocity) = self.slope.split_at(positions.len());
        let terms = |x: &[T], slope: &[f64]| {
            let terms = x.iter().zip(slope);
            terms.fold(T::zero(), |sum, (&x, &slope)| sum + x * slope)
        };
        terms(&x[positions], by_position) + terms(&x[velocities], by_velocity)
    }

    /// Returns g for the states of the network.
    pub(super) fn gain(&self, feedback: &Feedback, omega: &[f64], s: &[f64]) -> f64 {
        let [y, w] = self.states();
        let omega = &omega[self.oscillators.clone()];
        let coherence = feedback.coherence.squared(omega, &s[y], &s[w]);
        feedback.coherent + (feedback.unsynchronized - feedback.coherent) * (1.0 - coherence)
    }

    /// Computes ∂g/∂s.
    fn differentiate(&mut self, feedback: &Feedback, omega: &[f64], s: &[f64]) {
        let [y, w] = self.states();
        let omega = &omega[self.oscillators.clone()];
        let (by_position, by_velocity) = self.slope.split_at_mut(omega.len());
        let coherence = &feedback.coherence;
        coherence.gradient(omega, &s[y], &s[w], by_position, by_velocity);
        let range = feedback.coherent - feedback.unsynchronized;
        self.slope.iter_mut().for_each(|slope| *slope *= range);
    }
}

#[derive(Debug, Clone)]
pub(super) struct Places {
    pub(super) list: Vec<Place>,
    /// Groups of places with the same effect and without common rows. One element pass yields the forces of a whole
    /// group.
    colors: Vec<(Effect, Vec<usize>)>,
    weights: Vec<f64>,
    response: Vec<f64>,
}

impl Places {
    pub(super) fn new(one_way: &CoupledDae<MuscleDae>, feedbacks: &[Feedback]) -> Self {
        let body = one_way.body();
        let solid = &body.muscle().solid;
        let (space, free) = (solid.space(), solid.dofs().free_to_full());
        let dimension = space.dimension();
        let rows = |effect: Effect, weights: &[(usize, f64)]| {
            let per_element = effect.numbers_per_element(solid);
            let mut elements: Vec<usize> = weights.iter().map(|(i, _)| i / per_element).collect();
            elements.dedup();
            let nodes = elements.iter().flat_map(|e| space.element_nodes(*e));
            let components =
                nodes.flat_map(|node| (0..dimension).map(move |m| dimension * node + m));
            let mut rows: Vec<usize> =
                components.filter_map(|component| free.binary_search(&component).ok()).collect();
            rows.sort_unstable();
            rows.dedup();
            rows
        };
        let mut list = Vec::new();
        for (k, feedback) in feedbacks.iter().enumerate() {
            let of_network = one_way.oscillators(feedback.network).network().n_oscillators();
            let n = of_network / feedback.weights.len();
            for (number, weights) in feedback.weights.iter().enumerate() {
                let rows = rows(feedback.effect, weights);
                list.push(Place {
                    feedback: k,
                    number,
                    oscillators: number * n..(number + 1) * n,
                    of_network,
                    force: vec![0.0; rows.len()],
                    slope: vec![0.0; 2 * n],
                    rows,
                });
            }
        }
        let mut groups = Vec::new();
        for effect in [Effect::Stiffness, Effect::Tension] {
            let of_effect = |place: &usize| feedbacks[list[*place].feedback].effect == effect;
            let own: Vec<usize> = (0..list.len()).filter(of_effect).collect();
            let alike = colors(own.len(), |k| list[own[k]].rows.iter().copied());
            let members = |color: Vec<usize>| color.into_iter().map(|k| own[k]).collect();
            groups.extend(alike.into_iter().map(|color| (effect, members(color))));
        }
        Self {
            list,
            colors: groups,
            weights: Vec::new(),
            response: vec![0.0; body.layout().n_unknowns()],
        }
    }

    /// Evaluates ∂F/∂g and ∂g/∂s of all places at the state `y` of the coupled system.
    pub(super) fn linearize(
        &mut self,
        one_way: &mut CoupledDae<MuscleDae>,
        feedbacks: &[Feedback],
        t: f64,
        y: &[f64],
    ) -> Result<(), StepError> {
        for place in &mut self.list {
            let feedback = &feedbacks[place.feedback];
            let omega = one_way.oscillators(feedback.network).network().omega();
            place.differentiate(feedback, omega, &y[one_way.range(feedback.network)]);
        }
        let own = one_way.body_range();
        let body = one_way.body_mut();
        let momentum = body.layout().momentum();
        for (effect, color) in &self.colors {
            let solid = &body.muscle().solid;
            self.weights.clear();
            self.weights.resize(effect.numbers(solid), 0.0);
            for place in color.iter().map(|k| &self.list[*k]) {
                for &(i, weight) in &feedbacks[place.feedback].weights[place.number] {
                    self.weights[i] = weight;
                }
            }
            self.response.fill(0.0);
            let (weights, response) = (&self.weights, &mut self.response);
            body.counters_mut().coherence_passes += 1;
            match effect {
                Effect::Stiffness => {
                    body.add_factor_response(t, &y[own.clone()], weights, response)?;
                }
                Effect::Tension => {
                    body.add_tension_response(t, &y[own.clone()], weights, response);
                }
            }
            for &k in color {
                let Place { rows, force, .. } = &mut self.list[k];
                for (force, row) in force.iter_mut().zip(rows) {
                    *force = self.response[momentum.start + *row];
                }
            }
        }
        Ok(())
    }
}
