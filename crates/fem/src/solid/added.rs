//! The force of active and viscous stresses, and its tangents.

use crate::error::FemError;
use crate::material::Range;
use crate::operators::added::{AddedMotion, AddedStress, AddedTangents, Force, Regions, Slopes};
use crate::operators::relaxation::InternalStresses;
use crate::solid::crew::Pass;

use super::evaluation::check_length;
use super::shared::sure;
use super::threads::{self, Entries};
use super::{Elements, Solid, narrow, with_elements};

impl Solid {
    /// The solid with stresses that are added to those of its laws, each in elements of its own.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for an element that does not exist; [`FemError::TwoAdded`] for one
    /// that is given two; [`FemError::AddedToSmallStrain`] for one whose law is of small strains;
    /// [`FemError::Parameter`] for constants out of range.
    pub fn with_added_stresses(
        mut self,
        regions: &[(Vec<usize>, AddedStress)],
    ) -> Result<Self, FemError> {
        for (_, stress) in regions {
            if let Some(active) = &stress.active {
                active.check()?;
            }
            Range::NotNegative.check("viscosity", stress.viscosity)?;
        }
        let of_element = self.numbered(regions.iter().map(|(members, _)| members))?;
        for (kind, added) in self.kinds.iter_mut().zip(of_element) {
            kind.added = added;
        }
        self.added = regions.iter().map(|(_, stress)| *stress).collect();
        let active = self.added.iter().map(|stress| AddedStress {
            viscosity: 0.0,
            ..*stress
        });
        self.active = active.collect();
        Ok(self.regrouped())
    }

    /// The number of each element's region, if it is in one.
    pub(super) fn numbered<'r>(
        &self,
        regions: impl Iterator<Item = &'r Vec<usize>>,
    ) -> Result<Vec<Option<usize>>, FemError> {
        let mut of_element = vec![None; self.space.n_elements()];
        for (number, members) in regions.enumerate() {
            for &element in members {
                let count = of_element.len();
                let Some(own) = of_element.get_mut(element) else {
                    let (what, index) = ("element", element);
                    return Err(FemError::OutOfRange { what, index, count });
                };
                if own.replace(number).is_some() {
                    return Err(FemError::TwoAdded { element });
                }
                if self.laws[element].is_linear() {
                    return Err(FemError::AddedToSmallStrain { element });
                }
            }
        }
        Ok(of_element)
    }

    /// The solid with its elements in batches of what are now their kinds.
    pub(super) fn regrouped(mut self) -> Self {
        let patterns = [&self.displacement_pattern, &self.divergence_pattern];
        self.elements = Elements::new(&self.space, &self.kinds, self.rule, &self.dofs, patterns);
        self.internal = with_elements!(&self.elements, mapped =>
            InternalStresses::new(&mapped.batches, &self.prony));
        match self.fibres.take() {
            Some(fibres) => self.with_fibres(fibres),
            None => self,
        }
    }

    /// The number of the stress that is added in an element, if there is one.
    pub fn added_number(&self, element: usize) -> Option<usize> {
        self.kinds[element].added
    }

    /// The stresses that are added to those of the laws.
    pub fn added_stresses(&self) -> &[AddedStress] {
        &self.added
    }

    /// Number of tensions: one for each element, if there are added stresses.
    pub fn n_tensions(&self) -> usize {
        match self.added.is_empty() {
            true => 0,
            false => self.space.n_elements(),
        }
    }

    /// ∫ P : ∇φ of the added stresses.
    ///
    /// # Shapes
    /// `out`: `n_components`.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn added_force(&self, motion: &AddedMotion<'_>, out: &mut [f64]) {
        self.check_motion(motion);
        check_length(self.space.n_components(), Some(out), "added force");
        self.begin(&Pass::AddedForce(*motion));
        self.force_of(&self.added, motion, out);
        self.end_sure([out]);
    }

    /// The same without viscous stress: linear in the tensions.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn active_force(&self, motion: &AddedMotion<'_>, out: &mut [f64]) {
        self.check_motion(motion);
        check_length(self.space.n_components(), Some(out), "active force");
        self.begin(&Pass::ActiveForce(*motion));
        self.force_of(&self.active, motion, out);
        self.end_sure([out]);
    }

    /// ∫ P : ∇φ of these stresses in one's own elements.
    fn force_of(&self, stresses: &[AddedStress], motion: &AddedMotion<'_>, out: &mut [f64]) {
        sure(with_elements!(self.own_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            [Entries::Vector],
            [Some(out)],
            |elements, _, [out]| {
                let regions = Regions { elements, stresses, motion: *motion };
                out.into_iter().for_each(|out| narrow(self.arch, Force { regions, out }));
                Ok(())
            },
        )));
    }

    /// The tangents asked for of [`added_force`](Self::added_force), in one pass.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn added_tangents(&self, motion: &AddedMotion<'_>, mut out: AddedTangents<'_>) {
        self.check_motion(motion);
        let n = self.displacement_pattern.nnz();
        check_length(n, out.by_displacement.as_deref(), "by_displacement");
        check_length(n, out.by_velocity.as_deref(), "by_velocity");
        self.begin(&Pass::AddedTangents(*motion, out.wanted()));
        sure(with_elements!(self.own_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            threads::ADDED_TANGENTS,
            out.slots(),
            |elements, maps, slots| {
                let regions = Regions { elements, stresses: &self.added, motion: *motion };
                narrow(self.arch, Slopes { regions, maps, out: AddedTangents::from(slots) });
                Ok(())
            },
        )));
        self.end_sure(out.slots().into_iter().flatten());
    }

    fn check_motion(&self, motion: &AddedMotion<'_>) {
        let n = self.space.n_components();
        check_length(n, Some(motion.u), "u");
        check_length(n, Some(motion.v), "v");
        check_length(self.n_tensions(), Some(motion.tensions), "tensions");
    }
}
