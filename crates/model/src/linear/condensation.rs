//! Elimination of unknowns from the Newton system, and the remaining (condensed) system.
//!
//! In the Newton system (∂F/∂y + c ∂F/∂ẏ) δ = b, a kinematic equation ẋ − w = 0 (q̇ − v, λ̇ − μ) leads to the row
//! c δx − δw = b_w. Therefore δw = c δx − b_w exactly. After substitution into the other rows, a matrix A that
//! multiplied δw multiplies c δx, and A b_w is added to the right-hand side:
//!
//! ```text
//! ( A_x + c A_w ) δx + … = b + A_w b_w
//! ```
//!
//! For the muscle, the remaining system in (q, λ) has half the size. Its matrix is the dynamic stiffness
//! c² M + c D + K bordered by B, and is symmetric except for the damping. It is a sum of the same matrices with
//! polynomials in c as coefficients, so all positions are computed only once. The signs of some rows (the rows of B)
//! are changed if this makes the matrix symmetric. In 3D, where factorizations are most expensive, a nearly symmetric
//! matrix is [symmetrized](super::symmetry::NearlySymmetric) unless contacts have friction.
//!
//! The first line of (33) is not a kinematic equation. The system of (33) is therefore [split](super::Splitting), or
//! retained in full if damping other than Rayleigh damping prevents the splitting.

use std::collections::HashMap;
use std::ops::Range;

use myovib_dae::Problem;
use myovib_sparse::SparseOptions;
use myovib_sparse::{Kind, Scalar, SparseError, Structure};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::assembly::{Assembly, Entry};
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::muscle_dae::MuscleDae;

use super::relaxation::Series;
use super::symmetry::NearlySymmetric;
use super::{Elimination, Quadratic, symmetric_signs};

/// One kinematic equation, `rate · c δbase + value · δeliminated = b`.
#[derive(Debug, Clone, Copy)]
struct Kinematic {
    /// Block of rows that contains the equation.
    rows: Field,
    base: Field,
    eliminated: Field,
    rate: f64,
    value: f64,
}

impl Kinematic {
    /// Interprets the terms of a block of rows as a kinematic equation, if possible.
    fn read(rows: Field, terms: &[Term]) -> Option<Self> {
        let is_identity = |term: &Term| {
            matches!(term.matrix, Matrix::DisplacementIdentity | Matrix::PressureIdentity)
        };
        let find = |holds: fn(&Term) -> bool| terms.iter().find(|term| holds(term));
        let rate = find(|term| term.df_dyp != 0.0 && term.df_dy == 0.0)?;
        let value = find(|term| term.df_dy != 0.0 && term.df_dyp == 0.0)?;
        (terms.len() == 2 && terms.iter().all(is_identity)).then_some(Self {
            rows,
            base: rate.column,
            eliminated: value.column,
            rate: rate.df_dyp,
            value: value.df_dy,
        })
    }
}

/// A block copied between the full and the condensed vectors.
#[derive(Debug, Clone)]
pub(super) struct RetainedBlock {
    /// Rows of the full system.
    pub(super) rows: Range<usize>,
    /// Unknowns of the full system.
    pub(super) unknowns: Range<usize>,
    /// Rows and unknowns of the condensed system.
    pub(super) condensed: Range<usize>,
    /// Sign of the block's rows in the condensed system: 1 or -1.
    pub(super) sign: f64,
    /// Additional factor of the block's rows. It is applied after the eliminated part is subtracted.
    pub(super) scale: Option<Quadratic>,
}

impl RetainedBlock {
    /// Multiplies values of the block's rows by the scale at `c`, if the block has a scale.
    pub(super) fn scale_rows<T: Scalar>(&self, c: T, rows: &mut [T]) {
        if let Some(scale) = &self.scale {
            let scale: T = scale.at(c);
            rows.iter_mut().for_each(|row| *row *= scale);
        }
    }
}

/// A block of unknowns recovered from its base: δw = (b − rate · c δx) / value.
#[derive(Debug, Clone)]
pub(super) struct Recovered {
    /// Rows of the kinematic equation in the full system.
    pub(super) rows: Range<usize>,
    /// Eliminated unknowns in the full system.
    pub(super) unknowns: Range<usize>,
    /// Range of these unknowns among all eliminated unknowns.
    pub(super) position: Range<usize>,
    /// Unknowns of the base in the condensed system.
    pub(super) base: Range<usize>,
    pub(super) rate: f64,
    pub(super) value: f64,
}

/// Returns the terms of all equations, each with the block of its rows.
fn terms_of_body(blocks: &[(Field, Vec<Term>)]) -> impl Iterator<Item = (Field, Term)> {
    let terms = |(rows, terms): &(Field, Vec<Term>)| {
        let rows = *rows;
        terms.clone().into_iter().map(move |term| (rows, term))
    };
    blocks.iter().flat_map(terms)
}

/// Positions of all blocks in the full system and in the condensed system.
struct Arrangement {
    kinematic: Vec<Kinematic>,
    retained: Vec<(Field, RetainedBlock)>,
    recovered: Vec<(Field, Recovered)>,
    n_condensed: usize,
    n_eliminated: usize,
}

impl Arrangement {
    /// Finds the kinematic equations among the `blocks` of rows and arranges all unknowns.
    fn new(dae: &MuscleDae, blocks: &[(Field, Vec<Term>)]) -> Self {
        let read = |(rows, terms): &(Field, Vec<Term>)| Kinematic::read(*rows, terms);
        let mut places = Self {
            kinematic: blocks.iter().filter_map(read).collect(),
            retained: Vec::new(),
            recovered: Vec::new(),
            n_condensed: 0,
            n_eliminated: 0,
        };
        let range = |field| {
            let range = dae.layout().range(field);
            range.expect("equations use fields of the layout")
        };
        for rows in blocks.iter().map(|(rows, _)| *rows) {
            if places.is_kinematic(rows) {
                continue;
            }
            let owner = places.owner(rows);
            let (unknowns, start) = (range(owner), places.n_condensed);
            places.n_condensed += unknowns.len();
            let block = RetainedBlock {
                rows: range(rows),
                unknowns,
                condensed: start..places.n_condensed,
                sign: 1.0,
                scale: None,
            };
            places.retained.push((owner, block));
        }
        for k in places.kinematic.clone() {
            let (unknowns, start) = (range(k.eliminated), places.n_eliminated);
            places.n_eliminated += unknowns.len();
            let block = Recovered {
                rows: range(k.rows),
                unknowns,
                position: start..places.n_eliminated,
                base: places.condensed(k.base),
                rate: k.rate,
                value: k.value,
            };
            places.recovered.push((k.eliminated, block));
        }
        let other_unknowns = [Field::Tension, Field::InternalStress];
        let other_unknowns =
            other_unknowns.map(|field| dae.layout().range(field).map_or(0, |r| r.len()));
        assert_eq!(
            places.n_condensed + places.n_eliminated + other_unknowns.iter().sum::<usize>(),
            dae.n_unknowns(),
            "each unknown of the body is retained or eliminated"
        );
        places
    }

    fn is_kinematic(&self, rows: Field) -> bool {
        self.kinematic.iter().any(|k| k.rows == rows)
    }

    /// Returns the equation that eliminates a field.
    fn eliminating(&self, field: Field) -> Option<&Kinematic> {
        self.kinematic.iter().find(|k| k.eliminated == field)
    }

    /// Returns the retained field whose condensed rows contain the equation of `field`. The equation of an eliminated
    /// field is in the condensed rows of its base, because the base's own rows contain the kinematic equation.
    fn owner(&self, field: Field) -> Field {
        self.eliminating(field).map_or(field, |k| k.base)
    }

    /// Returns the range of a retained field in the condensed system.
    fn condensed(&self, field: Field) -> Range<usize> {
        let block = self.retained.iter().find(|(f, _)| *f == field);
        let (_, block) = block.expect("each retained unknown has a retained row");
        block.condensed.clone()
    }

    /// Returns the range of an eliminated field among all eliminated unknowns.
    fn position(&self, field: Field) -> Range<usize> {
        let block = self.recovered.iter().find(|(f, _)| *f == field);
        let (_, block) = block.expect("looked up for eliminated fields only");
        block.position.clone()
    }

    /// Returns the entries of the condensed matrix and of the coupling to eliminated unknowns.
    fn entries(&self, blocks: &[(Field, Vec<Term>)]) -> [Vec<Entry<Quadratic>>; 2] {
        let (mut condensed, mut coupling) = (Vec::new(), Vec::new());
        for (rows, term) in terms_of_body(blocks).filter(|(rows, _)| !self.is_kinematic(*rows)) {
            let entry = |columns, coefficient| Entry {
                rows: self.condensed(self.owner(rows)),
                columns,
                matrix: term.matrix,
                coefficient: Quadratic(coefficient),
            };
            let (value, rate) = (term.df_dy, term.df_dyp);
            match self.eliminating(term.column) {
                None => {
                    let columns = self.condensed(term.column);
                    condensed.push(entry(columns, [value, rate, 0.0]));
                }
                Some(k) => {
                    let chain = -k.rate / k.value;
                    let base = self.condensed(k.base);
                    condensed.push(entry(base, [0.0, chain * value, chain * rate]));
                    let by_rows = [value / k.value, rate / k.value, 0.0];
                    coupling.push(entry(self.position(k.eliminated), by_rows));
                }
            }
        }
        [condensed, coupling]
    }

    /// Returns the condensed matrix and the row signs that make it symmetric. If there are no such signs and
    /// `is_requested` is set, replaces a nearly symmetric matrix by a symmetric one.
    fn symmetrized(
        &mut self,
        entries: Vec<Entry<Quadratic>>,
        is_requested: bool,
    ) -> (Vec<Entry<Quadratic>>, Option<HashMap<usize, f64>>) {
        let signs = symmetric_signs(&entries);
        if signs.is_some() || !is_requested {
            return (entries, signs);
        }
        let Some(nearly) = NearlySymmetric::of(&entries) else {
            return (entries, None);
        };
        for (_, block) in &mut self.retained {
            let is_constraint = block.condensed.start != nearly.balance;
            block.scale = is_constraint.then_some(nearly.scale);
        }
        (nearly.entries, Some(nearly.signs))
    }

    /// Returns the range of the pressures and multipliers in the condensed system.
    fn constraints(&self) -> Range<usize> {
        let scalars = self.retained.iter();
        let scalars = scalars.filter(|(field, _)| !field.is_displacement_like());
        let ranges = scalars.map(|(_, block)| block.condensed.clone());
        let range = ranges.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        range.unwrap_or(self.n_condensed..self.n_condensed)
    }
}

/// The elimination for one formulation: patterns, positions and coefficients.
#[derive(Debug, Clone)]
pub struct Condensation {
    pub(super) retained: Vec<RetainedBlock>,
    pub(super) recovered: Vec<Recovered>,
    /// The condensed matrix; square.
    pub(super) condensed: Assembly<Quadratic>,
    /// A_w / value for all eliminated unknowns. It multiplies the right-hand sides of the kinematic equations.
    pub(super) coupling: Assembly<Quadratic>,
    /// Terms of the equations that the matrices above include, each with the block of its rows.
    pub(super) included: Vec<(Field, Term)>,
    /// Prony series of viscoelastic stress.
    pub(super) series: Series,
    structure: Structure,
}

impl Condensation {
    /// Analyzes the condensed pattern, once for all matrices.
    pub fn elimination(&self, options: SparseOptions) -> Result<Elimination, SparseError> {
        Elimination::new(self.condensed.pattern(), self.structure.clone(), options)
    }

    /// Sets up the elimination for `dae`.
    pub fn new(dae: &MuscleDae) -> Self {
        let in_space = dae.muscle().solid.space().dimension() == 3;
        // Friction couples slip with the stiff normal direction. Without the skew part of this coupling, Newton's
        // iteration diverges.
        let symmetrizes = in_space && !dae.muscle().has_friction();
        Self::build(dae, symmetrizes, dae.has_viscous_stress())
    }

    /// Sets up the elimination for matrices at states with zero velocities. At these states, the stiffness of viscous
    /// stresses and the terms that [`NearlySymmetric`] replaces are symmetric, except for the stiffness of boundary
    /// forces.
    pub(crate) fn at_rest(dae: &MuscleDae) -> Self {
        Self::build(dae, !dae.muscle().has_boundary_forces(), false)
    }

    /// Sets up the elimination. If requested, replaces a nearly symmetric matrix (`symmetrizes`) or an unsymmetric
    /// stiffness of added stresses (`symmetrizes_added`) by its symmetric part.
    fn build(dae: &MuscleDae, symmetrizes: bool, symmetrizes_added: bool) -> Self {
        let blocks = dae.blocks();
        let mut places = Arrangement::new(dae, &blocks);
        let [condensed, mut coupling] = places.entries(&blocks);
        let (mut condensed, signs) = places.symmetrized(condensed, symmetrizes);
        if signs.is_some() && symmetrizes_added {
            // All other terms are symmetric. The Newton iterations saved by the skew part of this stiffness would cost
            // less than the unsymmetric factorization.
            for entry in &mut condensed {
                if entry.matrix == Matrix::AddedStiffness {
                    entry.matrix = Matrix::AddedSymmetricStiffness;
                }
            }
        }
        let sign = |row| signs.as_ref().and_then(|signs| signs.get(&row)).unwrap_or(&1.0);
        for entry in condensed.iter_mut().chain(&mut coupling) {
            let sign = sign(entry.rows.start);
            entry.coefficient.0 = entry.coefficient.0.map(|p| sign * p);
        }
        for (_, block) in &mut places.retained {
            block.sign = *sign(block.condensed.start);
        }
        let [n_condensed, n_eliminated] = [places.n_condensed, places.n_eliminated];
        let pattern_of = |matrix| dae.pattern_of(matrix);
        Self {
            structure: Structure {
                kind: match signs {
                    Some(_) => Kind::Symmetric,
                    None => Kind::General,
                },
                constraints: places.constraints(),
            },
            condensed: Assembly::new((n_condensed, n_condensed), condensed, pattern_of),
            coupling: Assembly::new((n_condensed, n_eliminated), coupling, pattern_of),
            retained: places.retained.into_iter().map(|(_, block)| block).collect(),
            recovered: places.recovered.into_iter().map(|(_, block)| block).collect(),
            included: terms_of_body(&blocks).collect(),
            series: Series::of(dae),
        }
    }

    /// Returns the pattern of the condensed matrix.
    pub fn pattern(&self) -> &SparsityPattern {
        self.condensed.pattern()
    }

    /// Returns the number of unknowns of the condensed system.
    pub fn n_condensed(&self) -> usize {
        self.condensed.pattern().major_dim()
    }
}
