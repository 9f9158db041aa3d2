//! The Newton system of the stabilized equations (33), split into two systems.
//!
//! The first line of (33), M (q̇ − v) + B(q)ᵀμ = 0, is not a kinematic equation: eliminating δv would require M⁻¹,
//! which is dense. However, μ occurs in the kinematic equation in the same way as λ in the momentum balance. With
//! s = c + α, the rows of the Newton system for a given c are
//!
//! ```text
//! (c M + K_μ) δq − M δv + Bᵀ δμ = b_q        B δv + Ḃ δq = b_λ
//! K δq + s M δv − Bᵀ δλ         = b_v        B δq        = b_μ
//! ```
//!
//! The sum of the third row and s times the first row does not contain δv, and the two multipliers combine to
//! λ' = δλ − s δμ. The motion (δq, λ') is therefore computed first. Then the second row, together with either the
//! third or the first row, determines the velocity and one multiplier. Both systems are saddle-point problems of half
//! the size:
//!
//! ```text
//! ( K + s (c M + K_μ)   −Bᵀ ) ( δq )   ( b_v + s b_q )
//! ( −B                      ) ( λ' ) = ( −b_μ        )
//!
//! ( M   −Bᵀ ) ( s δv )   ( b_v − K δq      )      ( M   −Bᵀ ) ( s δv )   ( s (c M + K_μ) δq − s b_q )
//! ( −B      ) ( δλ   ) = ( −s (b_λ − Ḃ δq) )  or  ( −B      ) ( s δμ ) = ( −s (b_λ − Ḃ δq)          ).
//! ```
//!
//! The two variants of the second system differ only in rounding errors. A variant loses digits if its product with δq
//! is the larger part of the first system. The smaller of K and s c M is therefore used ([`Source`]).

use std::ops::Range;

use myovib_sparse::{Kind, SparseError, Structure};
use myovib_sparse::{Precision, SparseOptions};

use crate::assembly::{Assembly, Entry};
use crate::equation::Equation;
use crate::field::{Field, Layout};
use crate::matrix::{Matrix, Term};
use crate::muscle_dae::MuscleDae;

use super::relaxation::Series;
use super::{Elimination, Quadratic, Scalar, symmetric_signs};

/// Equation from which the velocity is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// The balance of momentum, used if inertia outweighs stiffness.
    Momentum,
    /// The stabilized kinematic equation.
    Kinematic,
}

/// Coefficient of a matrix in the right-hand side of the second problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transferred {
    /// Equation to which the coefficient belongs; `None` if it is used for both.
    source: Option<Source>,
    coefficient: Quadratic,
}

impl Transferred {
    /// Returns the value at `c`, or zero if it does not belong to `source`.
    pub(super) fn at<T: Scalar>(&self, c: T, source: Source) -> T {
        match self.source {
            Some(own) if own != source => T::zero(),
            _ => self.coefficient.at(c),
        }
    }
}

/// The two saddle-point problems of a muscle: patterns, positions and coefficients.
#[derive(Debug, Clone)]
pub struct Splitting {
    /// Matrix of (δq, λ'); square.
    pub(super) motion: Assembly<Quadratic>,
    /// Matrix of s δv and a multiplier, with the same shape; independent of c.
    pub(super) velocity: Assembly<Quadratic>,
    /// (K, Ḃ) or (−s (c M + K_μ), Ḃ). Its product with δq is subtracted from the second right-hand
    /// side.
    pub(super) transferred: Assembly<Transferred>,
    pub(super) alpha: f64,
    /// Terms of the equations that the matrices above include, each with the block of its rows.
    pub(super) included: Vec<(Field, Term)>,
    /// Prony series of viscoelastic stress.
    pub(super) series: Series,
    /// Symmetry of both matrices.
    kinds: [Kind; 2],
    /// Ranges of q, v, λ, μ in the full system. Each equation occupies the rows of its unknowns.
    pub(super) ranges: Ranges,
}

/// Ranges of the unknowns in the full system.
#[derive(Debug, Clone)]
pub(super) struct Ranges {
    pub(super) q: Range<usize>,
    pub(super) v: Range<usize>,
    pub(super) lambda: Range<usize>,
    pub(super) mu: Range<usize>,
}

impl Ranges {
    fn of(layout: &Layout) -> Self {
        let range = |field| {
            let range = layout.range(field);
            range.expect("stabilized equations have q, v, λ and μ")
        };
        Self {
            q: range(Field::Displacement),
            v: range(Field::Velocity),
            lambda: range(Field::Pressure),
            mu: range(Field::GglMultiplier),
        }
    }
}

impl Splitting {
    /// Sets up the two problems for `dae`. Returns `None` if `dae` lacks the stabilized kinematic equation. Also
    /// returns `None` if it has damping other than α times the mass matrix, because adding s times the first line then
    /// does not eliminate δv.
    pub fn new(dae: &MuscleDae) -> Option<Self> {
        let rows = dae.formulation().rows();
        let stabilized = rows.contains(&(Field::Displacement, Equation::StabilizedKinematic));
        if !stabilized || dae.has_damping_besides_mass() {
            return None;
        }
        let ranges = Ranges::of(dae.layout());
        let (n_q, n) = (ranges.q.len(), ranges.q.len() + ranges.mu.len());
        let alpha = dae.muscle().parameters.alpha;
        let blocks = dae.blocks();
        let (motion, constraint) = (0..n_q, n_q..n);
        let on_q = |rows: &Range<usize>, term: Term, coefficient| Entry {
            rows: rows.clone(),
            columns: 0..n_q,
            matrix: term.matrix,
            coefficient: Quadratic(coefficient),
        };
        let momentum: Vec<_> = acting_on_q(&blocks, Field::Velocity)
            .map(|term| on_q(&motion, term, [term.df_dy, 0.0, 0.0]))
            .collect();
        // s (value + c rate).
        let kinematic: Vec<_> = acting_on_q(&blocks, Field::Displacement)
            .map(|term| {
                let (value, rate) = (term.df_dy, term.df_dyp);
                on_q(&motion, term, [alpha * value, value + alpha * rate, rate])
            })
            .collect();
        let drift: Vec<_> = acting_on_q(&blocks, Field::Pressure)
            .map(|term| on_q(&constraint, term, [term.df_dy, 0.0, 0.0]))
            .collect();
        let inertia = Term::value(Field::Displacement, Matrix::Mass, 1.0);
        let divergence = Term::value(Field::Displacement, Matrix::Divergence, 1.0);
        let bordering = [
            on_q(&constraint, divergence, [-1.0, 0.0, 0.0]),
            Entry {
                rows: motion.clone(),
                columns: constraint.clone(),
                matrix: Matrix::DivergenceTransposed,
                coefficient: Quadratic([-1.0, 0.0, 0.0]),
            },
        ];
        let transferred = transferred(&momentum, Some(Source::Momentum), 1.0)
            .chain(transferred(&kinematic, Some(Source::Kinematic), -1.0))
            .chain(transferred(&drift, None, 1.0));
        let inertia = on_q(&motion, inertia, [1.0, 0.0, 0.0]);
        let velocity = [&[inertia][..], &bordering].concat();
        let motion = [&momentum[..], &kinematic, &bordering].concat();
        let kinds = [&motion, &velocity].map(|entries| match symmetric_signs(entries) {
            Some(signs) if signs.values().all(|&sign| sign > 0.0) => Kind::Symmetric,
            _ => Kind::General,
        });
        let pattern_of = |matrix| dae.pattern_of(matrix);
        Some(Self {
            transferred: Assembly::new((n, n_q), transferred, pattern_of),
            velocity: Assembly::new((n, n), velocity, pattern_of),
            motion: Assembly::new((n, n), motion, pattern_of),
            kinds,
            alpha,
            included: included(&blocks, alpha),
            series: Series::of(dae),
            ranges,
        })
    }

    /// Analyzes the patterns of both problems. The factors are in double precision, because the multipliers are
    /// differences between the two solutions: errors of 1e-7 would become errors of several percent.
    pub(crate) fn eliminations(
        &self,
        options: SparseOptions,
    ) -> Result<[Elimination; 2], SparseError> {
        let options = SparseOptions { precision: Precision::Double, ..options };
        let constraints = self.ranges.q.len()..self.motion.pattern().major_dim();
        let eliminate = |pattern, kind| {
            let constraints = constraints.clone();
            Elimination::new(pattern, Structure { kind, constraints }, options)
        };
        let [motion, velocity] = self.kinds;
        Ok([
            eliminate(self.motion.pattern(), motion)?,
            eliminate(self.velocity.pattern(), velocity)?,
        ])
    }
}

/// Returns the terms in a block of rows that multiply displacements.
fn acting_on_q(blocks: &[(Field, Vec<Term>)], rows: Field) -> impl Iterator<Item = Term> {
    let block = blocks.iter().find(|(own, _)| *own == rows);
    let terms = block.map_or(&[][..], |(_, terms)| terms);
    let acting = |term: &&Term| term.column == Field::Displacement;
    terms.iter().filter(acting).copied()
}

/// Returns `entries` times `sign` as part of the right-hand side of the second problem.
fn transferred(
    entries: &[Entry<Quadratic>],
    source: Option<Source>,
    sign: f64,
) -> impl Iterator<Item = Entry<Transferred>> {
    entries.iter().map(move |entry| Entry {
        rows: entry.rows.clone(),
        columns: entry.columns.clone(),
        matrix: entry.matrix,
        coefficient: Transferred {
            source,
            coefficient: Quadratic(entry.coefficient.0.map(|p| sign * p)),
        },
    })
}

/// Returns the terms that the two problems include, each with the block of its rows.
fn included(blocks: &[(Field, Vec<Term>)], alpha: f64) -> Vec<(Field, Term)> {
    use Field::{Displacement, GglMultiplier, Pressure, Velocity};
    let inertia = Term { df_dyp: 1.0, ..Term::value(Velocity, Matrix::Mass, alpha) };
    let coupling = |column, sign| Term::value(column, Matrix::DivergenceTransposed, sign);
    let divergence = |column| Term::value(column, Matrix::Divergence, 1.0);
    let mut included = vec![
        (Velocity, inertia),
        (Velocity, coupling(Pressure, -1.0)),
        (Displacement, Term::value(Velocity, Matrix::Mass, -1.0)),
        (Displacement, coupling(GglMultiplier, 1.0)),
        (Pressure, divergence(Velocity)),
        (GglMultiplier, divergence(Displacement)),
    ];
    // For terms that multiply displacements, the rates are included only in the kinematic equation.
    let df_dy = |term| Term { df_dyp: 0.0, ..term };
    for rows in [Velocity, Pressure] {
        included.extend(acting_on_q(blocks, rows).map(|term| (rows, df_dy(term))));
    }
    included.extend(acting_on_q(blocks, Displacement).map(|term| (Displacement, term)));
    included
}
