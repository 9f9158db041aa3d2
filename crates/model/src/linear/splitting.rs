//! The Newton system of the stabilized equations (33) in two halves.
//!
//! The first line of (33), M (q̇ − v) + B(q)ᵀμ = 0, is no kinematic equation: δv would be M⁻¹ of
//! the rest, which is dense. But μ acts on the motion as λ acts on the momentum. With s = c + α the
//! rows of the Newton system for a given c are
//!
//! ```text
//! (c M + K_μ) δq − M δv + Bᵀ δμ = b_q        B δv + Ḃ δq = b_λ
//! K δq + s M δv − Bᵀ δλ         = b_v        B δq        = b_μ
//! ```
//!
//! The third and s times the first add up to an equation free of δv, with λ' = δλ − s δμ in the
//! place of both multipliers. So the motion is found first; with it known, either the third or the
//! first with the second gives the velocity and a multiplier. Both are saddle problems of half the
//! size:
//!
//! ```text
//! ( K + s (c M + K_μ)   −Bᵀ ) ( δq )   ( b_v + s b_q )
//! ( −B                      ) ( λ' ) = ( −b_μ        )
//!
//! ( M   −Bᵀ ) ( s δv )   ( b_v − K δq      )      ( M   −Bᵀ ) ( s δv )   ( s (c M + K_μ) δq − s b_q )
//! ( −B      ) ( δλ   ) = ( −s (b_λ − Ḃ δq) )  or  ( −B      ) ( s δμ ) = ( −s (b_λ − Ḃ δq)          ).
//! ```
//!
//! The two differ by rounding: either cancels where its product with δq is the larger part of the
//! first system. So the smaller of K and s c M is taken ([`Source`]).

use std::ops::Range;

use myovib_sparse::SparseOptions;
use myovib_sparse::{Kind, SparseError, Structure};

use crate::assembly::{Assembly, Entry};
use crate::equation::Equation;
use crate::field::Field;
use crate::matrix::{Matrix, Term};
use crate::muscle_dae::MuscleDae;

use super::relaxation::Series;
use super::{Elimination, Quadratic, Scalar, symmetric_signs};

/// Which equation the velocity is found from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// The balance of momentum, where inertia outweighs stiffness.
    Momentum,
    /// The stabilized kinematic equation.
    Kinematic,
}

/// The coefficient of a matrix in the right-hand side of the second problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassedOn {
    /// Where it is from; none: used with either source.
    source: Option<Source>,
    coefficient: Quadratic,
}

impl PassedOn {
    /// The value at `c`, zero if it is not from `source`.
    pub(super) fn at<T: Scalar>(&self, c: T, source: Source) -> T {
        match self.source {
            Some(own) if own != source => T::zero(),
            _ => self.coefficient.at(c),
        }
    }
}

/// The two saddle problems laid out for a muscle: patterns, places, coefficients.
#[derive(Debug, Clone)]
pub struct Splitting {
    /// Of (δq, λ'); square.
    pub(super) motion: Assembly<Quadratic>,
    /// Of s δv and a multiplier, with the same shape; it does not depend on c.
    pub(super) velocity: Assembly<Quadratic>,
    /// (K, Ḃ) or (−s (c M + K_μ), Ḃ): less its product with δq is the second right-hand side.
    pub(super) passed_on: Assembly<PassedOn>,
    pub(super) alpha: f64,
    /// The terms of the equations that the above is made of, by their rows.
    taken: Vec<(Field, Term)>,
    /// Of stress that relaxes.
    pub(super) series: Series,
    /// Whether each of both is symmetric.
    kinds: [Kind; 2],
    /// q, v, λ, μ in the full system; each equation has the rows of its own unknowns.
    pub(super) places: Places,
}

/// Where the unknowns lie in the full system.
#[derive(Debug, Clone)]
pub(super) struct Places {
    pub(super) q: Range<usize>,
    pub(super) v: Range<usize>,
    pub(super) lambda: Range<usize>,
    pub(super) mu: Range<usize>,
}

impl Splitting {
    /// Lays out the two problems for `dae`; `None` unless it has the stabilized kinematic equation, or
    /// where a viscous stress or bed, or α by element, damps it: s times the first line then does not take δv away.
    pub fn new(dae: &MuscleDae) -> Option<Self> {
        let rows = dae.formulation().rows();
        let stabilized = rows.contains(&(Field::Displacement, Equation::StabilizedKinematic));
        if !stabilized || dae.is_damped_beside_mass() {
            return None;
        }
        let range = |field| {
            dae.layout()
                .range(field)
                .expect("stabilized equations have q, v, λ and μ")
        };
        let places = Places {
            q: range(Field::Displacement),
            v: range(Field::Velocity),
            lambda: range(Field::Pressure),
            mu: range(Field::GglMultiplier),
        };
        let (n_q, n) = (places.q.len(), places.q.len() + places.mu.len());
        let alpha = dae.muscle().parameters.alpha;
        let blocks = dae.blocks();
        let mut taken = bordering_terms(alpha);
        let acting_on_q = |rows| {
            let block = blocks.iter().find(|(own, _)| *own == rows);
            let terms = block.map_or(&[][..], |(_, terms)| terms);
            let acting = |term: &&Term| term.column == Field::Displacement;
            terms.iter().filter(acting).copied()
        };
        // Of what acts on displacements, rates count in the kinematic equation alone.
        let of_value = |term| Term {
            of_rate: 0.0,
            ..term
        };
        for rows in [Field::Velocity, Field::Pressure] {
            taken.extend(acting_on_q(rows).map(|term| (rows, of_value(term))));
        }
        taken.extend(acting_on_q(Field::Displacement).map(|term| (Field::Displacement, term)));
        let on_q = |rows: &Range<usize>, term: Term, [p0, p1, p2]: [f64; 3]| Entry {
            rows: rows.clone(),
            columns: 0..n_q,
            matrix: term.matrix,
            coefficient: Quadratic([p0, p1, p2]),
        };
        let (motion, constraint) = (0..n_q, n_q..n);
        let momentum: Vec<_> = acting_on_q(Field::Velocity)
            .map(|term| on_q(&motion, term, [term.of_value, 0.0, 0.0]))
            .collect();
        // s (value + c rate).
        let kinematic: Vec<_> = acting_on_q(Field::Displacement)
            .map(|term| {
                let (value, rate) = (term.of_value, term.of_rate);
                on_q(&motion, term, [alpha * value, value + alpha * rate, rate])
            })
            .collect();
        let drift = acting_on_q(Field::Pressure)
            .map(|term| on_q(&constraint, term, [term.of_value, 0.0, 0.0]));
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

        let passed_on = |entry: &Entry<Quadratic>, source, sign: f64| Entry {
            rows: entry.rows.clone(),
            columns: entry.columns.clone(),
            matrix: entry.matrix,
            coefficient: PassedOn {
                source,
                coefficient: Quadratic(entry.coefficient.0.map(|p| sign * p)),
            },
        };
        let from_momentum = momentum
            .iter()
            .map(|entry| passed_on(entry, Some(Source::Momentum), 1.0));
        let from_kinematic = kinematic
            .iter()
            .map(|entry| passed_on(entry, Some(Source::Kinematic), -1.0));
        let always = drift.map(|entry| passed_on(&entry, None, 1.0));
        let second = from_momentum.chain(from_kinematic).chain(always);
        let pattern_of = |matrix| dae.pattern_of(matrix);
        let velocity: Vec<_> = std::iter::once(on_q(&motion, inertia, [1.0, 0.0, 0.0]))
            .chain(bordering.clone())
            .collect();
        let motion: Vec<_> = momentum
            .iter()
            .chain(&kinematic)
            .chain(&bordering)
            .cloned()
            .collect();
        let kinds = [&motion, &velocity].map(|entries| match symmetric_signs(entries) {
            Some(signs) if signs.values().all(|&sign| sign > 0.0) => Kind::Symmetric,
            _ => Kind::General,
        });
        Some(Self {
            passed_on: Assembly::new((n, n_q), second, pattern_of),
            velocity: Assembly::new((n, n), velocity, pattern_of),
            motion: Assembly::new((n, n), motion, pattern_of),
            kinds,
            alpha,
            taken,
            series: Series::of(dae),
            places,
        })
    }

    /// The terms of the equations that it is made of, by their rows.
    pub(super) fn taken(&self) -> Vec<(Field, Term)> {
        self.taken.clone()
    }

    /// Analyses the patterns of both problems.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn eliminations(&self, options: SparseOptions) -> Result<[Elimination; 2], SparseError> {
        let constraints = self.places.q.len()..self.motion.pattern().major_dim();
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

/// The terms that the two problems are made of whatever acts on displacements, by their rows.
fn bordering_terms(alpha: f64) -> Vec<(Field, Term)> {
    use Field::{Displacement, GglMultiplier, Pressure, Velocity};
    let inertia = Term {
        of_rate: 1.0,
        ..Term::value(Velocity, Matrix::Mass, alpha)
    };
    let coupling = |column, sign| Term::value(column, Matrix::DivergenceTransposed, sign);
    let divergence = |column| Term::value(column, Matrix::Divergence, 1.0);
    vec![
        (Velocity, inertia),
        (Velocity, coupling(Pressure, -1.0)),
        (Displacement, Term::value(Velocity, Matrix::Mass, -1.0)),
        (Displacement, coupling(GglMultiplier, 1.0)),
        (Pressure, divergence(Velocity)),
        (GglMultiplier, divergence(Displacement)),
    ]
}
