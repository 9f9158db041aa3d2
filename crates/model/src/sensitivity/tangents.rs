//! Products with the tangents of a muscle, computed matrix by matrix.

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
/// A product is the sum of the products with all terms of the equations. Constant matrices (masses, identities) are
/// never assembled into the full matrix. A matrix that multiplies two blocks of unknowns (K multiplies q and β K
/// multiplies v) is applied only once. Internal stresses and the terms of an [`ElementProduct`] use element passes
/// instead of matrices.
#[derive(Debug)]
pub(super) struct Tangents {
    places: States,
    /// Matrices for each block of rows.
    rows: Vec<(Range<usize>, Vec<PlacedMatrix>)>,
    products: Vec<Product>,
    operand: Vec<f64>,
    relaxation: Option<RelaxationProduct>,
}

/// Data stored for the states.
#[derive(Debug)]
enum States {
    /// Muscles with the matrices of each state.
    Matrices(Vec<MuscleDae>),
    /// The states (t, y, ẏ) and one muscle.
    Vectors(Box<MuscleDae>, ElementProduct, Vec<(f64, [Vec<f64>; 2])>),
}

/// A matrix in a block of rows.
#[derive(Debug)]
struct PlacedMatrix {
    matrix: Matrix,
    multiplication: Multiplication,
    operands: Vec<Operand>,
}

#[derive(Debug, Clone, Copy)]
enum Multiplication {
    Identity,
    /// Product with a matrix. The index refers to the field `products` of [`Tangents`].
    Plain(usize),
    Transposed(usize),
}

/// Unknowns that a matrix multiplies, with their coefficients in ∂F/∂y and ∂F/∂ẏ.
#[derive(Debug)]
struct Operand {
    unknowns: Range<usize>,
    df_dy: f64,
    df_dyp: f64,
}

impl Operand {
    /// Returns whether the matrix multiplies the unknowns with coefficient 1, but not their rates.
    fn is_value(&self) -> bool {
        self.df_dy == 1.0 && self.df_dyp == 0.0
    }
}

impl Tangents {
    /// Creates the tangents of a muscle. Returns `None` if activation models add unknowns.
    pub(super) fn new(dae: &MuscleDae) -> Option<Self> {
        Self::with(dae, ElementProduct::new(dae))
    }

    /// Creates tangents that also support transposed products. Returns `None` if the stress is viscoelastic or
    /// activation models add unknowns.
    pub(super) fn transposable(dae: &MuscleDae) -> Option<Self> {
        Self::with(dae, None).filter(|tangents| tangents.relaxation.is_none())
    }

    fn with(dae: &MuscleDae, elements: Option<ElementProduct>) -> Option<Self> {
        let range = |field| dae.layout().range(field);
        if range(Field::Tension).is_some() {
            return None;
        }
        let parts = dae.muscle().solid.relaxation_regions();
        let (mut known, mut products) = (Vec::<&SparsityPattern>::new(), Vec::new());
        let mut rows = Vec::new();
        for (field, terms) in dae.blocks() {
            let mut matrices: Vec<PlacedMatrix> = Vec::new();
            for term in terms {
                if elements.is_some() && ElementProduct::takes(term.matrix) {
                    continue;
                }
                // The tangent at constant internal stresses has the factor Σ g; condensed matrices have other factors.
                let factor = match term.matrix {
                    Matrix::RelaxingStiffness(k) => parts[k].prony.instantaneous() - 1.0,
                    _ => 1.0,
                };
                let operand = Operand {
                    unknowns: range(term.column)?,
                    df_dy: factor * term.df_dy,
                    df_dyp: term.df_dyp,
                };
                let same = |placed: &&mut PlacedMatrix| placed.matrix == term.matrix;
                if let Some(placed) = matrices.iter_mut().find(same) {
                    placed.operands.push(operand);
                    continue;
                }
                let (pattern, is_transposed) = dae.pattern_of(term.matrix);
                let found = known.iter().position(|p| std::ptr::eq(*p, pattern));
                let multiplication = match term.matrix {
                    Matrix::DisplacementIdentity | Matrix::PressureIdentity => {
                        Multiplication::Identity
                    }
                    _ => {
                        let product = found.unwrap_or_else(|| {
                            known.push(pattern);
                            products.push(Product::new(pattern));
                            products.len() - 1
                        });
                        // A sum along a row requires one write per row; a sum along a column requires one write per
                        // entry.
                        let is_symmetric = matches!(
                            term.matrix,
                            Matrix::Mass | Matrix::Stiffness | Matrix::PressureMass
                        );
                        match is_transposed || is_symmetric {
                            true => Multiplication::Transposed(product),
                            false => Multiplication::Plain(product),
                        }
                    }
                };
                matrices.push(PlacedMatrix {
                    matrix: term.matrix,
                    multiplication,
                    operands: vec![operand],
                });
            }
            rows.push((range(field)?, matrices));
        }
        Some(Self {
            places: match elements {
                Some(product) => States::Vectors(Box::new(dae.clone()), product, Vec::new()),
                None => States::Matrices(Vec::new()),
            },
            rows,
            products,
            operand: Vec::new(),
            relaxation: RelaxationProduct::new(dae),
        })
    }

    /// Stores a state, and evaluates the matrices of the state unless element passes replace them.
    pub(super) fn keep(
        &mut self,
        dae: &MuscleDae,
        place: usize,
        (t, y, y_dot): (f64, &[f64], &[f64]),
    ) -> Result<(), StepError> {
        match &mut self.places {
            States::Matrices(places) => {
                if places.len() <= place {
                    places.resize(place + 1, dae.clone());
                }
                places[place].update_matrices(t, y, y_dot)
            }
            States::Vectors(_, _, places) => {
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

    /// Subtracts ∂F/∂y X + ∂F/∂ẏ Ẋ from `out` for `n_columns` columns, which are stored row by row.
    pub(super) fn subtract(
        &mut self,
        place: usize,
        [x, x_dot]: [&[f64]; 2],
        out: &mut [f64],
        n_columns: usize,
    ) -> Result<(), StepError> {
        let dae = match &mut self.places {
            States::Matrices(places) => &places[place],
            States::Vectors(dae, product, places) => {
                let (t, [y, y_dot]) = &places[place];
                product.subtract(dae, (*t, y, y_dot), [x, x_dot], out, n_columns)?;
                &**dae
            }
        };
        let side_by_side = |rows: &Range<usize>| rows.start * n_columns..rows.end * n_columns;
        for (rows, matrices) in &self.rows {
            let out = &mut out[side_by_side(rows)];
            for PlacedMatrix { matrix, multiplication, operands } in matrices {
                let values = dae.matrix_values(*matrix);
                let operand = match &operands[..] {
                    [one] if one.is_value() => &x[side_by_side(&one.unknowns)],
                    several => {
                        self.operand.clear();
                        self.operand.resize(several[0].unknowns.len() * n_columns, 0.0);
                        for one in several {
                            for (factor, of) in [(one.df_dy, x), (one.df_dyp, x_dot)] {
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
                match *multiplication {
                    Multiplication::Identity => {
                        let sum = out.iter_mut().zip(operand);
                        sum.for_each(|(out, x)| *out -= x);
                    }
                    Multiplication::Plain(k) => {
                        self.products[k].subtract_columns(values, operand, out, n_columns);
                    }
                    Multiplication::Transposed(k) => self.products[k]
                        .subtract_transposed_columns(values, operand, out, n_columns),
                }
            }
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.subtract(dae, [x, x_dot], out, n_columns);
        }
        Ok(())
    }

    /// Subtracts (∂F/∂y)ᵀ x and (∂F/∂ẏ)ᵀ x from the two vectors of `out`. The tangents must be
    /// [transposable](Self::transposable).
    pub(super) fn subtract_transposed(
        &mut self,
        place: usize,
        x: &[f64],
        [out, out_rate]: [&mut [f64]; 2],
    ) {
        let States::Matrices(places) = &self.places else {
            unreachable!("element passes do not support transposed products");
        };
        for (rows, matrices) in &self.rows {
            let x = &x[rows.clone()];
            for PlacedMatrix { matrix, multiplication, operands } in matrices {
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
                match *multiplication {
                    Multiplication::Identity => {
                        product.iter_mut().zip(x).for_each(|(p, x)| *p -= x)
                    }
                    Multiplication::Plain(k) => {
                        self.products[k].subtract_transposed(values, x, product)
                    }
                    Multiplication::Transposed(k) => self.products[k].subtract(values, x, product),
                }
                if alone.is_some() {
                    continue;
                }
                let product = &self.operand[..];
                for one in operands {
                    for (factor, out) in [(one.df_dy, &mut *out), (one.df_dyp, &mut *out_rate)] {
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
