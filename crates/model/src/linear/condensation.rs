//! Which unknowns of the Newton system can be eliminated, and what is left of it.
//!
//! A kinematic equation ẋ − w = 0 (q̇ − v, λ̇ − μ) gives its row of (∂F/∂y + c ∂F/∂ẏ) δ = b as
//! c δx − δw = b_w, so δw = c δx − b_w exactly. Put into the other rows, a matrix A that acts on
//! δw acts c-fold on δx, and A b_w goes to the right-hand side:
//!
//! ```text
//! ( A_x + c A_w ) δx + … = b + A_w b_w
//! ```
//!
//! What is left for the muscle is the system in (q, λ), of half the size and symmetric but for the
//! damping: the dynamic stiffness c² M + c D + K bordered by B. It is a sum of the same matrices
//! with coefficients that are polynomials in c, so all places are found once. Where a change of sign
//! of some rows (those of B) makes it symmetric, they are changed. In space, where factors cost most,
//! a matrix that is nearly symmetric is [made so](super::symmetry::NearlySymmetric).
//!
//! The first line of (33) is not of this kind; its system is [split](super::Splitting) instead, or
//! kept whole where damping beside Rayleigh's forbids that.

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
    /// The block of rows the equation stands in.
    rows: Field,
    base: Field,
    eliminated: Field,
    rate: f64,
    value: f64,
}

impl Kinematic {
    /// Reads the terms of a block of rows as a kinematic equation, if they are one.
    fn read(rows: Field, terms: &[Term]) -> Option<Self> {
        let is_identity = |term: &Term| {
            matches!(
                term.matrix,
                Matrix::DisplacementIdentity | Matrix::PressureIdentity
            )
        };
        let find = |holds: fn(&Term) -> bool| terms.iter().find(|term| holds(term));
        let rate = find(|term| term.of_rate != 0.0 && term.of_value == 0.0)?;
        let value = find(|term| term.of_value != 0.0 && term.of_rate == 0.0)?;
        (terms.len() == 2 && terms.iter().all(is_identity)).then_some(Self {
            rows,
            base: rate.column,
            eliminated: value.column,
            rate: rate.of_rate,
            value: value.of_value,
        })
    }
}

/// A block that is copied between the full vectors and the condensed ones.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    /// The rows of the full system.
    pub(super) rows: Range<usize>,
    /// The unknowns of the full system.
    pub(super) unknowns: Range<usize>,
    /// Both in the condensed system.
    pub(super) condensed: Range<usize>,
    /// What its rows are multiplied by there: 1 or -1.
    pub(super) sign: f64,
    /// What they are multiplied by besides, once what is eliminated is subtracted.
    pub(super) scale: Option<Quadratic>,
}

impl Kept {
    /// Multiplies numbers of its rows by their scale, if they have one, for `c`.
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
    /// The rows of the kinematic equation in the full system.
    pub(super) rows: Range<usize>,
    /// The eliminated unknowns in the full system.
    pub(super) unknowns: Range<usize>,
    /// The same among all eliminated ones.
    pub(super) place: Range<usize>,
    /// The base's unknowns in the condensed system.
    pub(super) base: Range<usize>,
    pub(super) rate: f64,
    pub(super) value: f64,
}

/// The elimination laid out for one formulation: patterns, places, coefficients.
#[derive(Debug, Clone)]
pub struct Condensation {
    pub(super) kept: Vec<Kept>,
    pub(super) recovered: Vec<Recovered>,
    /// The condensed matrix; square.
    pub(super) condensed: Assembly<Quadratic>,
    /// A_w / value for all eliminated unknowns, which acts on the rows of the kinematic equations.
    pub(super) coupling: Assembly<Quadratic>,
    pub(super) n_full: usize,
    /// The terms of the equations that the above is made of, by their rows.
    taken: Vec<(Field, Term)>,
    /// Of stress that relaxes.
    pub(super) series: Series,
    structure: Structure,
}

impl Condensation {
    /// Analyses the pattern that is left, for all matrices with it.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn elimination(&self, options: SparseOptions) -> Result<Elimination, SparseError> {
        Elimination::new(self.condensed.pattern(), self.structure.clone(), options)
    }

    /// The terms of the equations that it is made of, by their rows.
    pub(super) fn taken(&self) -> Vec<(Field, Term)> {
        self.taken.clone()
    }

    /// Lays out the elimination for `dae`.
    pub fn new(dae: &MuscleDae) -> Self {
        let blocks = dae.blocks();
        let kinematic: Vec<_> = blocks
            .iter()
            .filter_map(|(rows, terms)| Kinematic::read(*rows, terms))
            .collect();
        let is_kinematic = |rows: &Field| kinematic.iter().any(|k| k.rows == *rows);
        let read = blocks.iter().filter(|(rows, _)| is_kinematic(rows));
        let read = read.flat_map(|(rows, terms)| terms.iter().map(|term| (*rows, *term)));
        let mut taken: Vec<_> = read.collect();
        let range = |field| {
            dae.layout()
                .range(field)
                .expect("equations name fields there are")
        };
        let eliminating = |field| kinematic.iter().find(|k| k.eliminated == field);
        // An eliminated unknown leaves its row to its base, whose row the kinematic equation has.
        let owner = |field| eliminating(field).map_or(field, |k| k.base);

        let mut kept = Vec::new();
        let mut end = 0;
        let remaining = blocks.iter().filter(|(rows, _)| !is_kinematic(rows));
        for (rows, _) in remaining.clone() {
            let unknowns = range(owner(*rows));
            let start = end;
            end += unknowns.len();
            kept.push((
                owner(*rows),
                Kept {
                    rows: range(*rows),
                    unknowns,
                    condensed: start..end,
                    sign: 1.0,
                    scale: None,
                },
            ));
        }
        let condensed_range = |field| {
            let (_, block) = kept
                .iter()
                .find(|(f, _)| *f == field)
                .expect("each unknown that is kept has a row that is kept");
            block.condensed.clone()
        };
        let mut recovered = Vec::new();
        let mut n_eliminated = 0;
        for k in &kinematic {
            let unknowns = range(k.eliminated);
            let start = n_eliminated;
            n_eliminated += unknowns.len();
            recovered.push((
                k.eliminated,
                Recovered {
                    rows: range(k.rows),
                    unknowns,
                    place: start..n_eliminated,
                    base: condensed_range(k.base),
                    rate: k.rate,
                    value: k.value,
                },
            ));
        }
        let place = |field| {
            let (_, block) = recovered
                .iter()
                .find(|(f, _)| *f == field)
                .expect("looked up for eliminated fields only");
            block.place.clone()
        };

        let mut condensed = Vec::new();
        let mut coupling = Vec::new();
        for (rows, term) in remaining.flat_map(|(rows, terms)| terms.iter().map(move |t| (rows, t)))
        {
            let entry = |columns, [p0, p1, p2]: [f64; 3]| Entry {
                rows: condensed_range(owner(*rows)),
                columns,
                matrix: term.matrix,
                coefficient: Quadratic([p0, p1, p2]),
            };
            let (value, rate) = (term.of_value, term.of_rate);
            taken.push((*rows, *term));
            match eliminating(term.column) {
                None => condensed.push(entry(condensed_range(term.column), [value, rate, 0.0])),
                Some(k) => {
                    let chain = -k.rate / k.value;
                    let base = condensed_range(k.base);
                    condensed.push(entry(base, [0.0, chain * value, chain * rate]));
                    let by_rows = [value / k.value, rate / k.value, 0.0];
                    coupling.push(entry(place(k.eliminated), by_rows));
                }
            }
        }
        let beside = [Field::Tension, Field::InternalStress];
        let beside = beside.map(|field| dae.layout().range(field).map_or(0, |r| r.len()));
        assert_eq!(
            end + n_eliminated + beside.iter().sum::<usize>(),
            dae.n_unknowns(),
            "each unknown of the body is kept or eliminated"
        );
        let mut signs = symmetric_signs(&condensed);
        if signs.is_none()
            && dae.muscle().solid.space().dimension() == 3
            && let Some(nearly) = NearlySymmetric::of(&condensed)
        {
            condensed = nearly.entries;
            for (_, block) in &mut kept {
                let is_constraint = block.condensed.start != nearly.balance;
                block.scale = is_constraint.then_some(nearly.scale);
            }
            signs = Some(nearly.signs);
        }
        if signs.is_some() && dae.has_viscous_stress() {
            // All else is symmetric: what the skew part of this stiffness saves of Newton's
            // iterations is less than the other half of the factorisation costs.
            for entry in &mut condensed {
                if entry.matrix == Matrix::AddedStiffness {
                    entry.matrix = Matrix::AddedSymmetricStiffness;
                }
            }
        }
        let kind = match signs {
            Some(_) => Kind::Symmetric,
            None => Kind::General,
        };
        let sign = |row: usize| {
            *signs
                .iter()
                .flat_map(|s| s.get(&row))
                .next()
                .unwrap_or(&1.0)
        };
        for entry in condensed.iter_mut().chain(&mut coupling) {
            let sign = sign(entry.rows.start);
            entry.coefficient.0 = entry.coefficient.0.map(|p| sign * p);
        }
        for (_, block) in &mut kept {
            block.sign = sign(block.condensed.start);
        }
        let scalars = kept
            .iter()
            .filter(|(field, _)| !field.is_displacement_like());
        let constraints = scalars
            .map(|(_, block)| block.condensed.clone())
            .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        let pattern_of = |matrix| dae.pattern_of(matrix);
        Self {
            structure: Structure {
                kind,
                constraints: constraints.unwrap_or(end..end),
            },
            condensed: Assembly::new((end, end), condensed, pattern_of),
            coupling: Assembly::new((end, n_eliminated), coupling, pattern_of),
            kept: kept.into_iter().map(|(_, block)| block).collect(),
            recovered: recovered.into_iter().map(|(_, block)| block).collect(),
            n_full: dae.n_unknowns(),
            taken,
            series: Series::of(dae),
        }
    }

    /// The pattern of the condensed matrix.
    pub fn pattern(&self) -> &SparsityPattern {
        self.condensed.pattern()
    }

    /// Unknowns of the condensed system.
    pub fn n_condensed(&self) -> usize {
        self.condensed.pattern().major_dim()
    }

    /// Unknowns of the full system.
    pub fn n_full(&self) -> usize {
        self.n_full
    }
}
