//! The muscle: elastic body, damping and loads, independent of the formulation.

pub(crate) mod activation;
pub(crate) mod load;
pub(crate) mod parameters;
pub(crate) mod robin_support;

use myovib_fem::material::Bestel;
use myovib_fem::{ElementScale, Solid};

use crate::error::ModelError;
use crate::signal::Signal;
use crate::signal::schedule::Schedule;
use crate::signal::timing::Unforeseen;
use activation::Activation;
use load::{
    BoundaryForce, Contact, Load, Prescribed, SurfaceLoad, boundary_forces, set_multipliers,
};
use parameters::Parameters;
use robin_support::RobinSupport;

/// An elastic body with its physical constants and loads.
#[derive(Debug, Clone)]
pub struct Muscle {
    /// Finite element operators of the body, with its material law and density.
    pub solid: Solid,
    /// Damping and compressibility. For graded bodies, the maximum values of κ, α and β.
    pub parameters: Parameters,
    /// Forces with fixed directions.
    pub loads: Vec<Load>,
    /// Loads on the deformed boundary, such as pressures.
    pub surface_loads: Vec<SurfaceLoad>,
    /// Contacts of the boundary with rigid obstacles.
    pub contacts: Vec<Contact>,
    /// Displacement components prescribed as functions of time. Other constrained components are zero.
    pub prescribed: Vec<Prescribed>,
    /// Elastic and viscous foundations of the boundary.
    pub foundations: Vec<RobinSupport>,
    /// Index of each active added stress of the solid, with its tension. Unlisted stresses have zero
    /// tension.
    pub activations: Vec<(usize, Activation)>,
    /// Factor of the given tensions in each element, if they are not uniform.
    pub tension_factors: Option<Vec<f64>>,
}

impl Muscle {
    /// Creates a body without loads.
    pub fn unloaded(solid: Solid, parameters: Parameters) -> Self {
        Self {
            solid,
            parameters,
            loads: Vec::new(),
            surface_loads: Vec::new(),
            contacts: Vec::new(),
            prescribed: Vec::new(),
            foundations: Vec::new(),
            activations: Vec::new(),
            tension_factors: None,
        }
    }

    /// Creates an unloaded body with separate values of κ, α and β for each element.
    ///
    /// [`parameters`](Self::parameters) then contains the maximum of each constant. κ must be infinite in all elements
    /// or finite in all elements. β must be zero in all elements or positive in all elements.
    ///
    /// # Errors
    /// [`ModelError::MixedParameters`] if κ = ∞ and κ < ∞, or β = 0 and β > 0, are mixed, because the index would then
    /// differ between elements; errors of [`Solid::with_element_scales`].
    pub fn graded(solid: Solid, elements: &[Parameters]) -> Result<Self, ModelError> {
        let mixed = |what, which: fn(&Parameters) -> bool| {
            let first = elements.iter().position(which);
            let other = elements.iter().position(|own| !which(own));
            let elements = first.zip(other);
            elements.map(|(a, b)| ModelError::MixedParameters { what, elements: [a, b] })
        };
        let mixed = mixed("κ = inf combined with a finite κ", Parameters::is_incompressible)
            .or_else(|| mixed("β > 0 combined with β = 0", Parameters::is_damped));
        if let Some(error) = mixed {
            return Err(error);
        }
        let largest = |of: fn(&Parameters) -> f64| elements.iter().map(of).fold(0.0, f64::max);
        let [alpha, beta] = [largest(|own| own.alpha), largest(|own| own.beta)];
        let body = Parameters::new(alpha, beta, largest(Parameters::kappa))?;
        let ratio = |own: f64, largest: f64| if own == largest { 1.0 } else { own / largest };
        let ratios = elements.iter().map(|own| ElementScale {
            kappa: ratio(own.kappa(), body.kappa()),
            alpha: ratio(own.alpha, alpha),
            beta: ratio(own.beta, beta),
        });
        let ratios: Vec<ElementScale> = ratios.collect();
        let solid = match ratios.iter().all(|own| *own == ElementScale::ONE) {
            true => solid,
            false => solid.with_element_scales(&ratios)?,
        };
        Ok(Self::unloaded(solid, body))
    }

    /// Checks the prescribed motions and tensions. Each prescribed component must be constrained, must occur only once,
    /// and must move continuously. If the body has inertia, the velocity must also be continuous. Each tension must
    /// belong to an active stress.
    ///
    /// # Errors
    /// [`ModelError::Prescribed`], [`ModelError::Activation`], or [`ModelError::Fem`] for an invalid activation model.
    pub fn check(&self) -> Result<(), ModelError> {
        let has_inertia = self.solid.has_inertia();
        self.check_with(|motion| match has_inertia {
            false if motion.lowest_jump() > 0 => None,
            _ => motion.unfit_for_motion(),
        })
    }

    /// Checks the body before a search for equilibrium. Prescribed motions may jump, in contrast to
    /// [`check`](Self::check).
    ///
    /// # Errors
    /// As for [`check`](Self::check).
    pub(crate) fn check_at_rest(&self) -> Result<(), ModelError> {
        self.check_with(|_| None)
    }

    fn check_with(
        &self,
        unfit: impl Fn(&Signal) -> Option<&'static str>,
    ) -> Result<(), ModelError> {
        self.check_activations()?;
        let dofs = self.solid.dofs();
        for (k, prescribed) in self.prescribed.iter().enumerate() {
            let component = prescribed.component;
            let again = |other: &Prescribed| other.component == component;
            let objection = match () {
                () if component >= dofs.n_full() => "the body does not have this component",
                () if dofs.free_to_full().binary_search(&component).is_ok() => {
                    "it is free; constrain it in the solid's DofMap"
                }
                () if self.prescribed[..k].iter().any(again) => "it is prescribed twice",
                () => match unfit(&prescribed.signal) {
                    Some(objection) => objection,
                    None => continue,
                },
            };
            return Err(ModelError::Prescribed { component, objection });
        }
        Ok(())
    }

    fn check_activations(&self) -> Result<(), ModelError> {
        let stresses = self.solid.added_stresses();
        let is_negative =
            |activation: &Activation| !(0.0..f64::INFINITY).contains(&activation.at(0.0, 0.0));
        for (k, (number, activation)) in self.activations.iter().enumerate() {
            let again = |(other, _): &(usize, Activation)| other == number;
            let is_active = stresses.get(*number).map(|stress| stress.active.is_some());
            let objection = match is_active {
                None => "the solid has no such added stress",
                Some(false) => "it is not active; give it an active stress",
                Some(true) if self.activations[..k].iter().any(again) => {
                    "its tension is given twice"
                }
                Some(true) if activation.is_coherent() && is_negative(activation) => {
                    "its tension is negative, but a muscle can only pull"
                }
                Some(true) => {
                    if let Some(model) = activation.model() {
                        model.check()?;
                    }
                    continue;
                }
            };
            let number = *number;
            return Err(ModelError::Activation { number, objection });
        }
        Ok(())
    }

    /// Returns the activation models, whose tensions are unknowns, each with the index of its stress.
    pub fn models(&self) -> impl Iterator<Item = (usize, &Bestel)> {
        let activations = self.activations.iter();
        activations.filter_map(|(number, activation)| Some((*number, activation.model()?)))
    }

    /// Returns the tension in each element of a body at rest at time `t`. Tensions of activation models have their
    /// initial value, zero. Tensions that depend on chains have their value for incoherent oscillators.
    pub(crate) fn tensions_at_rest(&self, t: f64) -> Vec<f64> {
        let mut tensions = vec![0.0; self.solid.n_tensions()];
        let at_start = vec![0.0; self.models().count()];
        self.fill_tensions(t, &at_start, None, &mut tensions);
        tensions
    }

    /// Computes the tension in each element at time `t`. `unknowns` contains the tensions of activation models.
    /// `coherent` contains the tension in each element whose tension depends on the coherence of oscillators.
    pub(crate) fn fill_tensions(
        &self,
        t: f64,
        unknowns: &[f64],
        coherent: Option<&[f64]>,
        tensions: &mut [f64],
    ) {
        tensions.fill(0.0);
        let mut unknowns = unknowns.iter();
        for (number, activation) in &self.activations {
            let own = activation.model().and_then(|_| unknowns.next());
            let of_element = coherent.filter(|_| activation.is_coherent());
            let of_all = activation.at(t, own.copied().unwrap_or(0.0));
            let factors = self.tension_factors.as_deref();
            let factors = factors.filter(|_| matches!(activation, Activation::Given(_)));
            for (element, tension) in tensions.iter_mut().enumerate() {
                if self.solid.added_number(element) == Some(*number) {
                    let factor = factors.map_or(1.0, |factors| factors[element]);
                    *tension = of_element.map_or(factor * of_all, |tensions| tensions[element]);
                }
            }
        }
    }

    /// Returns the largest factor of a given tension in the elements of the added stress `number`.
    pub(crate) fn largest_tension_factor(&self, number: usize) -> f64 {
        let Some(factors) = &self.tension_factors else {
            return 1.0;
        };
        let own = factors.iter().enumerate();
        let own = own.filter(|(element, _)| self.solid.added_number(*element) == Some(number));
        own.map(|(_, factor)| *factor).fold(0.0, f64::max)
    }

    /// Returns the body with its loads scaled by `part`, as in an equilibrium of
    /// [`approach`](crate::statics::approach). This includes the motions of supports and obstacles, and all tensions
    /// that are not unknowns.
    #[must_use]
    pub fn under_part_of_loads(&self, part: f64) -> Self {
        Self {
            loads: self.loads.iter().map(|load| load.scaled(part)).collect(),
            surface_loads: self.surface_loads.iter().map(|own| own.scaled(part)).collect(),
            contacts: self.contacts.iter().map(|own| own.scaled(part)).collect(),
            prescribed: self
                .prescribed
                .iter()
                .map(|Prescribed { component, signal }| Prescribed {
                    component: *component,
                    signal: signal.scaled(part),
                })
                .collect(),
            activations: self
                .activations
                .iter()
                .map(|(number, activation)| (*number, activation.scaled(part)))
                .collect(),
            ..self.clone()
        }
    }

    /// Returns the body with the contact multipliers of a state on a loading path.
    #[must_use]
    pub fn with_multipliers(mut self, of_contacts: Vec<Vec<f64>>) -> Self {
        set_multipliers(&mut self.contacts, of_contacts);
        self
    }

    /// Returns the forces that depend on the displacement of the boundary.
    pub(crate) fn boundary_forces(&self) -> impl Iterator<Item = &dyn BoundaryForce> {
        boundary_forces(&self.surface_loads, &self.contacts)
    }

    /// Returns whether any contact has friction.
    pub(crate) fn has_friction(&self) -> bool {
        self.contacts.iter().any(|own| own.friction().is_some())
    }

    /// Returns whether any force depends on the displacement of the boundary.
    pub(crate) fn has_boundary_forces(&self) -> bool {
        self.boundary_forces().next().is_some()
    }

    /// Returns the body without its Prony terms, so that its stress is always relaxed.
    #[must_use]
    pub fn relaxed(&self) -> Self {
        let mut muscle = self.clone();
        if muscle.solid.n_internal() > 0 {
            muscle.solid = muscle.solid.relaxed();
        }
        muscle
    }

    /// Returns the body with supports fixed at their displacements at time `t`, as in an equilibrium.
    #[must_use]
    pub fn with_supports_at(mut self, t: f64) -> Self {
        for Prescribed { signal, .. } in &mut self.prescribed {
            *signal = Signal::constant(signal.at(t).value);
        }
        self
    }

    /// Returns the body with each activation model replaced by its tangent at time `t` and `tensions`. The tensions are
    /// then functions of time instead of unknowns.
    pub(crate) fn with_tangents_of_tensions(&self, t: f64, tensions: &[f64]) -> Self {
        let mut muscle = self.clone();
        let modeled = muscle.activations.iter_mut().filter(|(_, a)| a.model().is_some());
        for ((_, activation), &tension) in modeled.zip(tensions) {
            *activation = activation.tangent_at(t, tension);
        }
        muscle
    }

    /// Returns the number of coefficients q and λ, counted as in the paper: constrained nodes are included.
    pub fn n_unknowns_paper(&self) -> usize {
        self.solid.space().n_components() + self.solid.space().n_pressures()
    }

    /// Returns the highest frequency (Hz) of the loads, tensions and prescribed motions, or `None` if no function has a
    /// frequency.
    pub fn forcing_frequency(&self) -> Option<f64> {
        let frequencies = self.signals().filter_map(Signal::frequency);
        frequencies.reduce(f64::max)
    }

    /// Returns the lowest and highest frequencies (Hz) of each frequency sweep until the time `to` (s).
    pub fn sweeps(&self, to: f64) -> Vec<[f64; 2]> {
        let mut sweeps: Vec<_> = self.signals().filter_map(|signal| signal.sweep(to)).collect();
        sweeps.dedup();
        sweeps
    }

    /// Returns the first time up to `t_end` (s) at which a load, a tension or a prescribed motion jumps.
    pub fn first_jump(&self, t_end: f64) -> Option<f64> {
        let first = |signal: &Signal| {
            let mut breaks = signal.breaks(0.0_f64.next_down(), t_end);
            breaks.find(|next| next.order == 0).map(|jump| jump.t)
        };
        self.signals().filter_map(first).reduce(f64::min)
    }

    /// Returns the schedule of all signals. With inertia, it includes the loads, and the prescribed motions with their
    /// velocities and accelerations. Without inertia, it includes the slopes of all signals, because the rates of the
    /// unknowns jump if a slope jumps.
    pub fn schedule(&self) -> Schedule {
        let mut schedule = Schedule::default();
        let (of_loads, of_motions) = if self.solid.has_inertia() { (0, 2) } else { (1, 1) };
        for load in &self.loads {
            schedule.add(load.signal().clone(), of_loads);
        }
        for load in &self.surface_loads {
            schedule.add(load.signal().clone(), of_loads);
        }
        for signal in self.contacts.iter().flat_map(Contact::signals) {
            schedule.add(signal.clone(), of_loads);
        }
        if !self.contacts.is_empty() {
            schedule.add(Unforeseen, 0);
        }
        for prescribed in &self.prescribed {
            schedule.add(prescribed.signal.clone(), of_motions);
        }
        for (_, activation) in &self.activations {
            match activation {
                Activation::Given(signal) => schedule.add(signal.clone(), of_loads),
                Activation::Bestel(model) => schedule.add(*model, 0),
                Activation::Coherence { .. } | Activation::Line { .. } => {}
            }
        }
        schedule
    }

    /// Returns the functions of time that define loads, tensions and prescribed motions.
    pub fn signals(&self) -> impl Iterator<Item = &Signal> {
        let loads = self.loads.iter().map(Load::signal);
        let surface_loads = self.surface_loads.iter().map(SurfaceLoad::signal);
        let obstacles = self.contacts.iter().flat_map(Contact::signals);
        let motions = self.prescribed.iter().map(|p| &p.signal).chain(obstacles);
        let tensions = self.activations.iter().filter_map(|(_, activation)| match activation {
            Activation::Given(signal) => Some(signal),
            _ => None,
        });
        loads.chain(surface_loads).chain(motions).chain(tensions)
    }
}
