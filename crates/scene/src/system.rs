//! Systems that a scene can contain: a muscle, or oscillators with or without a body.

use std::ops::Range;

use myovib_dae::Problem;
use myovib_model::coupling::{self, CoupledDae, Driven, Driving, FeedbackDae, Multirate, NoBody};
use myovib_model::{Counts, ModelError, MuscleDae, Quantity, RodDae, WorkCounters};
use myovib_oscillators::Network;

/// Interface through which the outputs access a system.
pub(crate) trait System {
    /// Returns the length of the state `y`.
    fn state_len(&self) -> usize;

    /// Returns the muscle in state `y` and the range of its unknowns, or `None` if the system has no muscle.
    fn muscle_at(&mut self, y: &[f64]) -> Option<(&mut MuscleDae, Range<usize>)>;

    /// Returns the rod, if the system has one. The unknowns of the rod come first.
    fn rod(&self) -> Option<&RodDae> {
        None
    }

    /// Returns the network with the zero-based index `k` and the range of its unknowns, if the network exists.
    fn network(&self, _k: usize) -> Option<(&Network, Range<usize>)> {
        None
    }

    /// Returns the factor of each feedback in state `y`: first the stiffness factors, then the tensions.
    fn factors(&self, _y: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    fn counters(&self) -> WorkCounters;

    /// Returns the counters of the integrator of the chains if the chains are integrated separately.
    fn chain_counts(&self) -> Option<Counts> {
        None
    }

    /// Returns the magnitudes of the displacements that drive separately integrated chains, and of the resulting
    /// positions.
    fn driven(&self) -> Option<&Driven> {
        None
    }

    /// Restores the magnitudes that [`driven`](Self::driven) returned in an earlier part of the run. Returns `false` if
    /// they belong to other chains.
    fn set_driven(&mut self, _driven: &Driven) -> bool {
        false
    }

    /// Returns how a separately integrated body drives the network with index `k`, or `None` if it does not.
    fn driving(&self, _k: usize) -> Option<Driving> {
        None
    }
}

pub(crate) fn muscle_of<'s, P: System + ?Sized>(
    system: &'s mut P,
    y: &[f64],
) -> Result<(&'s mut MuscleDae, Range<usize>), ModelError> {
    system.muscle_at(y).ok_or(ModelError::NoSuchPart { part: "muscle" })
}

pub(crate) fn network_of(
    system: &dyn System,
    k: usize,
) -> Result<(&Network, Range<usize>), ModelError> {
    let part = "chain";
    system.network(k).ok_or(ModelError::NoSuchPart { part })
}

/// Returns whether the evaluation of these `quantities` of the muscle requires ẏ.
pub(crate) fn need_rates<P: System + ?Sized>(
    quantities: &[Quantity],
    system: &mut P,
    y: &[f64],
) -> bool {
    let stress_needs_rates = |(dae, _): (&mut MuscleDae, _)| dae.stress_needs_rates();
    quantities.contains(&Quantity::Acceleration)
        || quantities.iter().any(|quantity| quantity.is_of_stress())
            && system.muscle_at(y).is_some_and(stress_needs_rates)
}

impl System for MuscleDae {
    fn state_len(&self) -> usize {
        self.n_unknowns()
    }

    fn muscle_at(&mut self, _: &[f64]) -> Option<(&mut MuscleDae, Range<usize>)> {
        let n = self.n_unknowns();
        Some((self, 0..n))
    }

    fn counters(&self) -> WorkCounters {
        *MuscleDae::counters(self)
    }
}

/// Body that can be coupled to oscillators.
pub(super) trait Body: coupling::Body {
    fn as_muscle(&mut self) -> Option<&mut MuscleDae> {
        None
    }

    fn as_rod(&self) -> Option<&RodDae> {
        None
    }

    fn counters(&self) -> WorkCounters {
        WorkCounters::default()
    }
}

impl Body for MuscleDae {
    fn as_muscle(&mut self) -> Option<&mut MuscleDae> {
        Some(self)
    }

    fn counters(&self) -> WorkCounters {
        *MuscleDae::counters(self)
    }
}

impl Body for RodDae {
    fn as_rod(&self) -> Option<&RodDae> {
        Some(self)
    }
}

impl Body for NoBody {}

impl<B: System> System for Multirate<B> {
    fn state_len(&self) -> usize {
        self.n_unknowns().iter().sum()
    }

    fn muscle_at(&mut self, y: &[f64]) -> Option<(&mut MuscleDae, Range<usize>)> {
        let [n_body, _] = self.n_unknowns();
        self.body_mut().muscle_at(&y[..n_body])
    }

    fn rod(&self) -> Option<&RodDae> {
        self.body().rod()
    }

    fn network(&self, k: usize) -> Option<(&Network, Range<usize>)> {
        let [n_body, _] = self.n_unknowns();
        let (network, range) = self.chains().network(k)?;
        Some((network, n_body + range.start..n_body + range.end))
    }

    fn counters(&self) -> WorkCounters {
        self.body().counters()
    }

    fn chain_counts(&self) -> Option<Counts> {
        Some(Multirate::chain_counts(self))
    }

    fn driven(&self) -> Option<&Driven> {
        Some(Multirate::driven(self))
    }

    fn set_driven(&mut self, driven: &Driven) -> bool {
        Multirate::set_driven(self, driven)
    }

    fn driving(&self, k: usize) -> Option<Driving> {
        Multirate::driving(self, k)
    }
}

impl<B: Body> System for CoupledDae<B> {
    fn state_len(&self) -> usize {
        self.n_unknowns()
    }

    fn muscle_at(&mut self, _: &[f64]) -> Option<(&mut MuscleDae, Range<usize>)> {
        let range = self.body_range();
        self.body_mut().as_muscle().map(|muscle| (muscle, range))
    }

    fn rod(&self) -> Option<&RodDae> {
        self.body().as_rod()
    }

    fn network(&self, k: usize) -> Option<(&Network, Range<usize>)> {
        (k < self.n_networks()).then(|| (self.oscillators(k).network(), self.range(k)))
    }

    fn counters(&self) -> WorkCounters {
        self.body().counters()
    }
}

impl System for FeedbackDae {
    fn state_len(&self) -> usize {
        self.n_unknowns()
    }

    fn muscle_at(&mut self, y: &[f64]) -> Option<(&mut MuscleDae, Range<usize>)> {
        let range = self.one_way().body_range();
        Some((FeedbackDae::muscle_at(self, y), range))
    }

    fn network(&self, k: usize) -> Option<(&Network, Range<usize>)> {
        self.one_way().network(k)
    }

    fn factors(&self, y: &[f64]) -> Vec<f64> {
        FeedbackDae::factors(self, y)
    }

    fn counters(&self) -> WorkCounters {
        System::counters(self.one_way())
    }
}
