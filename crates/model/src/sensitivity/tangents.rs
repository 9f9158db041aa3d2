//! Products with a muscle's tangents, matrix by matrix.

use std::ops::Range;

use myovib_dae::StepError;
use myovib_sparse::Product;
use nalgebra_sparse::pattern::SparsityPattern;

use super::elements::ElementProduct;
use super::relaxation::RelaxationProduct;
use crate::field::Field;
use crate::matrix::Matrix;
use crate::muscle_dae::MuscleDae;

/// ∂F/∂y and ∂F/∂ẏ at several states.
///
/// Products take one matrix after the other from the list of the equations' terms. What is constant
/// (masses, identities) is never summed into the matrix of the whole, and a matrix that acts on two
/// blocks of unknowns (K on q and β K on v) is multiplied with once. For internal stresses there is no
/// matrix at all, but passes over the elements; nor is there one of what an [`ElementProduct`] takes.
#[derive(Debug)]
pub(super) struct Tangents {
    places: Places,
    /// For each block of rows its matrices.
    rows: Vec<(Range<usize>, Vec<Placed>)>,
    products: Vec<Product>,
    operand: Vec<f64>,
    relaxation: Option<RelaxationProduct>,
}

/// What is kept of the states.
#[derive(Debug)]
enum Places {
    /// Muscles with the matrices of each.
    Matrices(Vec<MuscleDae>),
    /// The states (t, y, ẏ) alone, and a muscle.
    States(Box<MuscleDae>, ElementProduct, Vec<(f64, [Vec<f64>; 2])>),
}

/// A matrix in a block of rows.
#[derive(Debug)]
struct Placed {
    matrix: Matrix,
    how: How,
    operands: Vec<Operand>,
}

/// How to multiply with it.
#[derive(Debug, Clone, Copy)]
enum How {
    Identity,
    /// By this product.
    Straight(usize),
    Transposed(usize),
}

/// Unknowns that a matrix acts on, with their coefficients in ∂F/∂y and ∂F/∂ẏ.
#[derive(Debug)]
struct Operand {
    unknowns: Range<usize>,
    of_value: f64,
    of_rate: f64,
}

impl Operand {
    /// Whether the unknowns are multiplied with as they are, and their rates are not.
    fn is_value(&self) -> bool {
        self.of_value == 1.0 && self.of_rate == 0.0
    }
}

impl Tangents {
    /// Those of a muscle; none where models of activation are unknowns too.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        Self::with(dae, ElementProduct::new(dae))
    }

    /// Those that can be multiplied with transposed too; none where stress relaxes, moreover.
    pub(super) fn transposable(dae: &MuscleDae) -> Option<Self> {
        Self::with(dae, None).filter(|tangents| tangents.relaxation.is_none())
    }

    fn with(dae: &MuscleDae, elements: Option<ElementProduct>) -> Option<Self> {
        let range = |field| dae.layout().range(field);
        if range(Field::Tension).is_some() {
            return None;
        }
        let parts = dae.muscle().solid.relaxing_parts();
        let (mut known, mut products) = (Vec::<&SparsityPattern>::new(), Vec::new());
        let mut rows = Vec::new();
        for (field, terms) in dae.blocks() {
            let mut matrices: Vec<Placed> = Vec::new();
            for term in terms {
                if elements.is_some() && ElementProduct::takes(term.matrix) {
                    continue;
                }
                // Under constant internal stresses; reductions put other factors in the place of Σ g.
                let factor = match term.matrix {
                    Matrix::RelaxingStiffness(k) => parts[k].prony.instantaneous() - 1.0,
                    _ => 1.0,
                };
                let operand = Operand {
                    unknowns: range(term.column)?,
                    of_value: factor * term.of_value,
                    of_rate: term.of_rate,
                };
                let same = |placed: &&mut Placed| placed.matrix == term.matrix;
                if let Some(placed) = matrices.iter_mut().find(same) {
                    placed.operands.push(operand);
                    continue;
                }
                let (pattern, is_transposed) = dae.pattern_of(term.matrix);
                let found = known.iter().position(|p| std::ptr::eq(*p, pattern));
                let how = match term.matrix {
                    Matrix::DisplacementIdentity | Matrix::PressureIdentity => How::Identity,
                    _ => {
                        let product = found.unwrap_or_else(|| {
                            known.push(pattern);
                            products.push(Product::new(pattern));
                            products.len() - 1
                        });
                        // Sums along a row write once where sums along a column write for each entry.
                        let is_symmetric = matches!(
                            term.matrix,
                            Matrix::Mass | Matrix::Stiffness | Matrix::PressureMass
                        );
                        match is_transposed || is_symmetric {
                            true => How::Transposed(product),
                            false => How::Straight(product),
                        }
                    }
                };
                matrices.push(Placed {
                    matrix: term.matrix,
                    how,
                    operands: vec![operand],
                });
            }
            rows.push((range(field)?, matrices));
        }
        Some(Self {
            places: match elements {
                Some(product) => Places::States(Box::new(dae.clone()), product, Vec::new()),
                None => Places::Matrices(Vec::new()),
            },
            rows,
            products,
            operand: Vec::new(),
            relaxation: RelaxationProduct::new(dae),
        })
    }

    /// Keeps the state of a place, and evaluates its matrices.
    ///
    /// # Errors
    /// Those of the matrices.
    pub(super) fn keep(
        &mut self,
        dae: &MuscleDae,
        place: usize,
        (t, y, y_dot): (f64, &[f64], &[f64]),
    ) -> Result<(), StepError> {
        match &mut self.places {
            Places::Matrices(places) => {
                if places.len() <= place {
                    places.resize(place + 1, dae.clone());
                }
                places[place].update_matrices(t, y, y_dot)
            }
            Places::States(_, _, places) => {
                if places.len() <= place {
                    places.resize(place + 1, (t, [y.to_vec(), y_dot.to_vec()]));
                }
                let (at, [own_y, own_y_dot]) = &mut places[place];
                *at = t;
                own_y.copy_from_slice(y);
                own_y_dot.copy_from_slice(y_dot);
                Ok(())
            }
        }
    }

    /// Subtracts ∂F/∂y X + ∂F/∂ẏ Ẋ from `out`, all of `n_columns` side by side.
    ///
    /// # Errors
    /// Those of passes over the elements.
    pub(super) fn subtract(
        &mut self,
        place: usize,
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let dae = match &mut self.places {
            Places::Matrices(places) => &places[place],
            Places::States(dae, product, places) => {
                let (t, [y, y_dot]) = &places[place];
                product.subtract(dae, (*t, y, y_dot), [x, x_dot], out, n_columns)?;
                &**dae
            }
        };
        let side_by_side = |rows: &Range<usize>| rows.start * n_columns..rows.end * n_columns;
        for (rows, matrices) in &self.rows {
            let out = &mut out[side_by_side(rows)];
            for Placed {
                matrix,
                how,
                operands,
            } in matrices
            {
                let values = dae.matrix_values(*matrix);
                let operand = match &operands[..] {
                    [one] if one.is_value() => &x[side_by_side(&one.unknowns)],
                    several => {
                        self.operand.clear();
                        self.operand
                            .resize(several[0].unknowns.len() * n_columns, 0.0);
                        for one in several {
                            for (factor, of) in [(one.of_value, x), (one.of_rate, x_dot)] {
                                if factor != 0.0 {
                                    let of = &of[side_by_side(&one.unknowns)];
                                    let sum = self.operand.iter_mut().zip(of);
                                    sum.for_each(|(sum, of)| *sum += factor * of);
                                }
                            }
                        }
                        &self.operand[..]
                    }
                };
                match *how {
                    How::Identity => {
                        let sum = out.iter_mut().zip(operand);
                        sum.for_each(|(out, x)| *out -= x);
                    }
                    How::Straight(k) => {
                        self.products[k].subtract_columns(values, operand, out, n_columns);
                    }
                    How::Transposed(k) => self.products[k]
                        .subtract_transposed_columns(values, operand, out, n_columns),
                }
            }
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.subtract(dae, [x, x_dot], out, n_columns);
        }
        Ok(())
    }

    /// Subtracts (∂F/∂y)ᵀ x and (∂F/∂ẏ)ᵀ x from the two `out`, with tangents that are
    /// [transposable](Self::transposable).
    pub(super) fn subtract_transposed(
        &mut self,
        place: usize,
        x: &[f64],
        [out, out_rate]: [&mut [f64]; 2],
    ) {
        let Places::Matrices(places) = &self.places else {
            unreachable!("passes over the elements are not transposed");
        };
        for (rows, matrices) in &self.rows {
            let x = &x[rows.clone()];
            for Placed {
                matrix,
                how,
                operands,
            } in matrices
            {
                let values = places[place].matrix_values(*matrix);
                let alone = match &operands[..] {
                    [one] if one.is_value() => Some(one),
                    _ => None,
                };
                let product = match alone {
                    Some(one) => &mut out[one.unknowns.clone()],
                    None => {
                        self.operand.clear();
                        self.operand.resize(operands[0].unknowns.len(), 0.0);
                        &mut self.operand[..]
                    }
                };
                match *how {
                    How::Identity => product.iter_mut().zip(x).for_each(|(p, x)| *p -= x),
                    How::Straight(k) => self.products[k].subtract_transposed(values, x, product),
                    How::Transposed(k) => self.products[k].subtract(values, x, product),
                }
                if alone.is_some() {
                    continue;
                }
                let product = &self.operand[..];
                for one in operands {
                    for (factor, out) in [(one.of_value, &mut *out), (one.of_rate, &mut *out_rate)]
                    {
                        if factor != 0.0 {
                            let sum = out[one.unknowns.clone()].iter_mut().zip(product);
                            sum.for_each(|(sum, p)| *sum += factor * p);
                        }
                    }
                }
            }
        }
    }
}
