//! Stiffness of each element as a parameter.

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, StepError};

use super::tangents::Tangents;
use crate::muscle_dae::MuscleDae;

/// A factor of the law's energy in each element: a field to be identified from measurements. The factors are 1 unless
/// the muscle has other [factors](MuscleDae::set_factors).
///
/// F is linear in the factors. The products of λ with the forces of all elements require one element pass.
#[derive(Debug)]
pub struct ElementStiffness {
    list: Vec<Parameter>,
    n_corners: usize,
    weights: Vec<f64>,
    /// Tangents, if transposed products with the tangents are available.
    tangents: Option<Tangents>,
    /// Copy of the muscle used for evaluations, so that the matrices of the integrator's muscle remain valid for the
    /// next factorization.
    copy: Box<MuscleDae>,
}

impl ElementStiffness {
    /// Creates the parameters for all elements of a muscle.
    pub fn new(dae: &MuscleDae) -> Self {
        let solid = &dae.muscle().solid;
        let n_elements = solid.space().n_elements();
        let parameter = |element| Parameter::new(format!("stiffness of element {element}"), 1.0);
        let n_corners = solid.space().dimension() + 1;
        Self {
            list: (0..n_elements).map(parameter).collect(),
            n_corners,
            weights: vec![0.0; n_corners * n_elements],
            tangents: Tangents::transposable(dae),
            copy: Box::new(dae.clone()),
        }
    }
}

impl Parameters<MuscleDae> for ElementStiffness {
    fn list(&self) -> &[Parameter] {
        &self.list
    }

    fn derivative(
        &mut self,
        problem: &mut MuscleDae,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let _ = y_dot;
        self.weights.fill(0.0);
        self.weights[j * self.n_corners..][..self.n_corners].fill(1.0);
        out.fill(0.0);
        problem.add_factor_response(t, y, &self.weights, out)
    }

    fn add_products(
        &mut self,
        problem: &mut MuscleDae,
        t: f64,
        [y, _]: [&[f64]; 2],
        adjoint: &[f64],
        products: &mut [f64],
    ) -> Result<(), StepError> {
        problem.add_factor_products(t, y, adjoint, products)
    }

    fn keep_tangents(
        &mut self,
        problem: &mut MuscleDae,
        place: usize,
        at: &Linearization<'_>,
    ) -> Result<bool, StepError> {
        let Some(tangents) = &mut self.tangents else {
            return Ok(false);
        };
        tangents.keep(problem, place, (at.t, at.y, at.y_dot))?;
        Ok(true)
    }

    fn subtract_tangents(
        &mut self,
        place: usize,
        at: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        match &mut self.tangents {
            Some(tangents) => tangents.subtract(place, at, out, n_columns),
            None => Ok(()),
        }
    }

    fn transposes_tangents(&self) -> bool {
        self.tangents.is_some()
    }

    fn subtract_transposed_tangents(&mut self, place: usize, x: &[f64], out: [&mut [f64]; 2]) {
        if let Some(tangents) = &mut self.tangents {
            tangents.subtract_transposed(place, x, out);
        }
    }

    fn linearize(
        &mut self,
        _problem: &mut MuscleDae,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        jacobian.parts(&mut *self.copy, at, parts)
    }
}
