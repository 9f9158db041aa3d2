//! Force and tangents of the active and viscous stresses.

use crate::error::FemError;
use crate::material::Range;
use crate::operators::added::{
    AddedMotion, AddedStress, AddedTangents, Force, ForceTangents, Regions,
};
use crate::operators::relaxation::InternalStresses;
use crate::solid::assembler::Pass;

use super::evaluation::check_length;
use super::partition::assert_infallible;
use super::threads::{self, Entries};
use super::{Elements, Solid, VectorPasses, with_elements};

impl Solid {
    /// Returns the solid with active or viscous stresses, which are added in disjoint regions of elements.
    ///
    /// # Errors
    /// Returns [`FemError::OutOfRange`] if an element does not exist, [`FemError::DuplicateAddedStress`] if an
    /// element is in two regions, [`FemError::AddedToSmallStrain`] if an element has a small-strain law, or
    /// [`FemError::Parameter`] if a constant is out of range.
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
        let region_of_element =
            self.region_of_element(regions.iter().map(|(members, _)| members))?;
        for (material, added) in self.materials.iter_mut().zip(region_of_element) {
            material.added = added;
        }
        self.added = regions.iter().map(|(_, stress)| *stress).collect();
        let active = self.added.iter().map(|stress| AddedStress { viscosity: 0.0, ..*stress });
        self.active = active.collect();
        Ok(self.with_rebuilt_batches())
    }

    /// Returns the region of each element, or `None` if the element is not in a region.
    pub(super) fn region_of_element<'r>(
        &self,
        regions: impl Iterator<Item = &'r Vec<usize>>,
    ) -> Result<Vec<Option<usize>>, FemError> {
        let mut region_of_element = vec![None; self.space.n_elements()];
        for (number, members) in regions.enumerate() {
            for &element in members {
                let count = region_of_element.len();
                let Some(region) = region_of_element.get_mut(element) else {
                    let (what, index) = ("element", element);
                    return Err(FemError::OutOfRange { what, index, count });
                };
                if region.replace(number).is_some() {
                    return Err(FemError::DuplicateAddedStress { element });
                }
                if self.laws[element].is_linear() {
                    return Err(FemError::AddedToSmallStrain { element });
                }
            }
        }
        Ok(region_of_element)
    }

    /// Rebuilds the batches after the materials of elements have changed.
    pub(super) fn with_rebuilt_batches(mut self) -> Self {
        let patterns = [&self.displacement_pattern, &self.divergence_pattern];
        self.elements =
            Elements::new(&self.space, &self.materials, self.rule, &self.dofs, patterns);
        self.internal = with_elements!(&self.elements, mapped =>
            InternalStresses::new(&mapped.batches, &self.prony));
        match self.fibers.take() {
            Some(fibers) => self.with_fibers(fibers),
            None => self,
        }
    }

    /// Returns the index of the added stress of an element, if it has one.
    pub fn added_number(&self, element: usize) -> Option<usize> {
        self.materials[element].added
    }

    /// Returns the added stresses.
    pub fn added_stresses(&self) -> &[AddedStress] {
        &self.added
    }

    /// Returns the number of tensions, which is one per element, or 0 without added stresses.
    pub fn n_tensions(&self) -> usize {
        match self.added.is_empty() {
            true => 0,
            false => self.space.n_elements(),
        }
    }

    /// Writes the force ∫ P : ∇φ of the added stresses to `out`.
    ///
    /// # Shapes
    /// `out` has length `n_components`.
    pub fn added_force(&self, motion: &AddedMotion<'_>, out: &mut [f64]) {
        self.check_motion(motion);
        check_length(self.space.n_components(), Some(out), "added force");
        self.begin(&Pass::AddedForce(*motion));
        self.force_of(&self.added, motion, out);
        self.end_infallible([out]);
    }

    /// Writes the force of the active stresses alone to `out`. This force is linear in the tensions.
    pub fn active_force(&self, motion: &AddedMotion<'_>, out: &mut [f64]) {
        self.check_motion(motion);
        check_length(self.space.n_components(), Some(out), "active force");
        self.begin(&Pass::ActiveForce(*motion));
        self.force_of(&self.active, motion, out);
        self.end_infallible([out]);
    }

    /// Writes ∫ P : ∇φ of the given stresses over the local elements to `out`.
    fn force_of(&self, stresses: &[AddedStress], motion: &AddedMotion<'_>, out: &mut [f64]) {
        assert_infallible(with_elements!(self.local_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            [Entries::Vector],
            [Some(out)],
            |elements, _, [out]| {
                let regions = Regions { elements, stresses, motion: *motion };
                out.into_iter().for_each(|out| mapped.run(self.arch, Force { regions, out }));
                Ok(())
            },
        )));
    }

    /// Evaluates the requested tangents of [`added_force`](Self::added_force) in one pass.
    pub fn added_tangents(&self, motion: &AddedMotion<'_>, mut out: AddedTangents<'_>) {
        self.check_motion(motion);
        let n = self.displacement_pattern.nnz();
        check_length(n, out.by_displacement.as_deref(), "by_displacement");
        check_length(n, out.by_velocity.as_deref(), "by_velocity");
        self.begin(&Pass::AddedTangents(*motion, out.requested()));
        assert_infallible(with_elements!(self.local_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            threads::ADDED_TANGENTS,
            out.slots(),
            |elements, maps, slots| {
                let regions = Regions { elements, stresses: &self.added, motion: *motion };
                mapped.run(self.arch, ForceTangents { regions, maps, out: AddedTangents::from(slots) });
                Ok(())
            },
        )));
        self.end_infallible(out.all_mut());
    }

    fn check_motion(&self, motion: &AddedMotion<'_>) {
        let n = self.space.n_components();
        check_length(n, Some(motion.u), "u");
        check_length(n, Some(motion.v), "v");
        check_length(self.n_tensions(), Some(motion.tensions), "tensions");
    }
}
