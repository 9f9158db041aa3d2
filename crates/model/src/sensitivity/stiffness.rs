//! The stiffness of each element as a parameter.

use myovib_dae::{Jacobian, Linearization, Parameter, Parameters, StepError};

use super::tangents::Tangents;
use crate::colouring::colours;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// A factor of the law's energy in each element, 1 unless the muscle has
/// [factors](MuscleDae::set_factors): a field to be found from measurements.
///
/// F is linear in the factors. The forces of elements that share no node stand in rows of their own, so
/// that one pass gives those of all elements of a colour: the products of all elements cost as many passes
/// as there are colours, about ten, however many elements there are.
#[derive(Debug)]
pub struct ElementStiffness {
    list: Vec<Parameter>,
    /// Elements that share no node.
    colours: Vec<Vec<usize>>,
    /// The rows in which the force of each element stands.
    rows: Vec<Vec<usize>>,
    n_corners: usize,
    weights: Vec<f64>,
    response: Vec<f64>,
    /// Where products with them can be transposed.
    tangents: Option<Tangents>,
    /// The muscle again: the matrices of the integrator's are kept for its next factorisation.
    again: Box<MuscleDae>,
}

impl ElementStiffness {
    /// Of all elements of a muscle.
    pub fn new(dae: &MuscleDae) -> Self {
        let solid = &dae.muscle().solid;
        let (space, dofs) = (solid.space(), solid.dofs());
        let n_elements = space.n_elements();
        let momentum = dae
            .layout()
            .range(Field::Velocity)
            .expect("the momentum balance stands in the rows of v");
        let mut row_of = vec![None; dofs.n_full()];
        for (row, &component) in momentum.zip(dofs.free_to_full()) {
            row_of[component] = Some(row);
        }
        let dimension = space.dimension();
        let rows = |element| {
            let nodes = space.element_nodes(element).iter();
            let components =
                nodes.flat_map(|node| (0..dimension).map(move |m| node * dimension + m));
            components
                .filter_map(|component| row_of[component])
                .collect()
        };
        let parameter = |element| Parameter::new(format!("stiffness of element {element}"), 1.0);
        let n_corners = dimension + 1;
        Self {
            list: (0..n_elements).map(parameter).collect(),
            colours: colours(n_elements, |element| {
                space.element_nodes(element).iter().copied()
            }),
            rows: (0..n_elements).map(rows).collect(),
            n_corners,
            weights: vec![0.0; n_corners * n_elements],
            response: vec![0.0; dae.layout().n_unknowns()],
            tangents: Tangents::new(dae).filter(Tangents::can_transpose),
            again: Box::new(dae.clone()),
        }
    }

    /// Weighs these elements alone.
    fn weigh(weights: &mut [f64], n_corners: usize, elements: &[usize]) {
        weights.fill(0.0);
        for element in elements {
            weights[element * n_corners..][..n_corners].fill(1.0);
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
        Self::weigh(&mut self.weights, self.n_corners, &[j]);
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
        for colour in &self.colours {
            Self::weigh(&mut self.weights, self.n_corners, colour);
            self.response.fill(0.0);
            problem.add_factor_response(t, y, &self.weights, &mut self.response)?;
            for &element in colour {
                let rows = self.rows[element].iter();
                let terms = rows.map(|&row| adjoint[row] * self.response[row]);
                products[element] += terms.sum::<f64>();
            }
        }
        Ok(())
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
    ) {
        if let Some(tangents) = &mut self.tangents {
            tangents.subtract(place, at, out, n_columns);
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

    fn linearise(
        &mut self,
        _problem: &mut MuscleDae,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        jacobian.parts(&mut *self.again, at, parts)
    }
}
