//! Elimination of unknowns from the Newton system, and the remaining (condensed) system.
//!
//! A kinematic equation ẋ − w = 0 (q̇ − v, λ̇ − μ) gives in its row of (∂F/∂y + c ∂F/∂ẏ) δ = b the
//! equation c δx − δw = b_w, so δw = c δx − b_w exactly. Substituted into the other rows, a matrix
//! A that multiplies δw multiplies c δx, and A b_w is added to the right-hand side:
//!
//! ```text
//! ( A_x + c A_w ) δx + … = b + A_w b_w
//! ```
//!
//! For the muscle, the remaining system in (q, λ) has half the size and is symmetric except for the
//! damping: the dynamic stiffness c² M + c D + K bordered by B. It is a sum of the same matrices
//! with coefficients that are polynomials in c, so all positions are computed once. If a change of
//! sign of some rows (those of B) makes it symmetric, these signs are changed. In 3D, where
//! factorizations are most expensive, a nearly symmetric matrix is
//! [symmetrized](super::symmetry::NearlySymmetric).
//!
//! The first line of (33) is not a kinematic equation; its system is [split](super::Splitting)
//! instead, or retained in full if damping other than Rayleigh damping prevents this.

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
            matches!(
                term.matrix,
                Matrix::DisplacementIdentity | Matrix::PressureIdentity
            )
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
    /// Sign of its rows in the condensed system: 1 or -1.
    pub(super) sign: f64,
    /// Additional factor of its rows, applied after the eliminated part is subtracted.
    pub(super) scale: Option<Quadratic>,
}

impl RetainedBlock {
    /// Multiplies values of its rows by their scale for `c`, if they have one.
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
    /// Their range among all eliminated unknowns.
    pub(super) position: Range<usize>,
    /// Unknowns of the base in the condensed system.
    pub(super) base: Range<usize>,
    pub(super) rate: f64,
    pub(super) value: f64,
}

/// The elimination for one formulation: patterns, positions, coefficients.
#[derive(Debug, Clone)]
pub struct Condensation {
    pub(super) retained: Vec<RetainedBlock>,
    pub(super) recovered: Vec<Recovered>,
    /// The condensed matrix; square.
    pub(super) condensed: Assembly<Quadratic>,
    /// A_w / value for all eliminated unknowns, which multiplies the rows of the kinematic
    /// equations.
    pub(super) coupling: Assembly<Quadratic>,
    pub(super) n_full: usize,
    /// Terms of the equations included above, with their rows.
    included: Vec<(Field, Term)>,
    /// Prony series of viscoelastic stress.
    pub(super) series: Series,
    structure: Structure,
}

impl Condensation {
    /// Analyzes the condensed pattern for all matrices with this pattern.
    ///
    /// # Errors
    /// Errors of the symbolic analysis.
    pub fn elimination(&self, options: SparseOptions) -> Result<Elimination, SparseError> {
        Elimination::new(self.condensed.pattern(), self.structure.clone(), options)
    }

    /// Returns the terms of the equations that it includes, with their rows.
    pub(super) fn included(&self) -> Vec<(Field, Term)> {
        self.included.clone()
    }

    /// Sets up the elimination for `dae`.
    pub fn new(dae: &MuscleDae) -> Self {
        let in_space = dae.muscle().solid.space().dimension() == 3;
        // Friction couples slip with the stiff normal direction: without its skew part, Newton's iteration diverges.
        let symmetrizes = in_space && !dae.muscle().has_friction();
        Self::build(dae, symmetrizes, dae.has_viscous_stress())
    }

    /// Sets up the elimination for matrices at states without velocities. There the terms that
    /// [`NearlySymmetric`] replaces and the stiffness of viscous stresses are symmetric; only
    /// follower pressures are not.
    pub(crate) fn at_rest(dae: &MuscleDae) -> Self {
        Self::build(dae, !dae.muscle().has_boundary_forces(), false)
    }

    /// Sets up the elimination, with a nearly symmetric matrix or an unsymmetric stiffness of added
    /// stresses replaced by its symmetric part if requested.
    fn build(dae: &MuscleDae, symmetrizes: bool, symmetrizes_added: bool) -> Self {
        let blocks = dae.blocks();
        let kinematic: Vec<_> = blocks
            .iter()
            .filter_map(|(rows, terms)| Kinematic::read(*rows, terms))
            .collect();
        let is_kinematic = |rows: &Field| kinematic.iter().any(|k| k.rows == *rows);
        let read = blocks.iter().filter(|(rows, _)| is_kinematic(rows));
        let read = read.flat_map(|(rows, terms)| terms.iter().map(|term| (*rows, *term)));
        let mut included: Vec<_> = read.collect();
        let range = |field| {
            dae.layout()
                .range(field)
                .expect("equations use fields of the layout")
        };
        let eliminating = |field| kinematic.iter().find(|k| k.eliminated == field);
        // The row of an eliminated unknown is included by its base, whose own row holds the kinematic
        // equation.
        let owner = |field| eliminating(field).map_or(field, |k| k.base);

        let mut retained = Vec::new();
        let mut end = 0;
        let remaining = blocks.iter().filter(|(rows, _)| !is_kinematic(rows));
        for (rows, _) in remaining.clone() {
            let unknowns = range(owner(*rows));
            let start = end;
            end += unknowns.len();
            retained.push((
                owner(*rows),
                RetainedBlock {
                    rows: range(*rows),
                    unknowns,
                    condensed: start..end,
                    sign: 1.0,
                    scale: None,
                },
            ));
        }
        let condensed_range = |field| {
            let (_, block) = retained
                .iter()
                .find(|(f, _)| *f == field)
                .expect("each retained unknown has a retained row");
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
                    position: start..n_eliminated,
                    base: condensed_range(k.base),
                    rate: k.rate,
                    value: k.value,
                },
            ));
        }
        let position = |field| {
            let (_, block) = recovered
                .iter()
                .find(|(f, _)| *f == field)
                .expect("looked up for eliminated fields only");
            block.position.clone()
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
            let (value, rate) = (term.df_dy, term.df_dyp);
            included.push((*rows, *term));
            match eliminating(term.column) {
                None => condensed.push(entry(condensed_range(term.column), [value, rate, 0.0])),
                Some(k) => {
                    let chain = -k.rate / k.value;
                    let base = condensed_range(k.base);
                    condensed.push(entry(base, [0.0, chain * value, chain * rate]));
                    let by_rows = [value / k.value, rate / k.value, 0.0];
                    coupling.push(entry(position(k.eliminated), by_rows));
                }
            }
        }
        let beside = [Field::Tension, Field::InternalStress];
        let beside = beside.map(|field| dae.layout().range(field).map_or(0, |r| r.len()));
        assert_eq!(
            end + n_eliminated + beside.iter().sum::<usize>(),
            dae.n_unknowns(),
            "each unknown of the body is retained or eliminated"
        );
        let mut signs = symmetric_signs(&condensed);
        if signs.is_none()
            && symmetrizes
            && let Some(nearly) = NearlySymmetric::of(&condensed)
        {
            condensed = nearly.entries;
            for (_, block) in &mut retained {
                let is_constraint = block.condensed.start != nearly.balance;
                block.scale = is_constraint.then_some(nearly.scale);
            }
            signs = Some(nearly.signs);
        }
        if signs.is_some() && symmetrizes_added {
            // All other terms are symmetric: the skew part of this stiffness would save fewer
            // Newton iterations than the unsymmetric factorization costs.
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
        for (_, block) in &mut retained {
            block.sign = sign(block.condensed.start);
        }
        let scalars = retained
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
            retained: retained.into_iter().map(|(_, block)| block).collect(),
            recovered: recovered.into_iter().map(|(_, block)| block).collect(),
            n_full: dae.n_unknowns(),
            included,
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

    /// Returns the number of unknowns of the full system.
    pub fn n_full(&self) -> usize {
        self.n_full
    }
}
