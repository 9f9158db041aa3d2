//! Storage of the matrices of one formulation. Matrices that the formulation does not use are
//! neither stored nor computed.

use myovib_fem::{AddedMotion, AddedTangents, Overstress, Solid, Tangents};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::matrix::Matrix;
use crate::muscle::Muscle;
use crate::muscle::load::PressureLoad;
use crate::muscle::robin_support::RobinSupport;

/// Values of the matrices of one formulation.
#[derive(Debug, Clone)]
pub(crate) struct Matrices {
    displacement_identity: SparsityPattern,
    pressure_identity: SparsityPattern,
    ones: Vec<f64>,
    /// Entries that couple equal components: a subset of the displacement pattern.
    mass_pattern: SparsityPattern,
    mass: Vec<f64>,
    stiffness: Option<Vec<f64>>,
    pressure_stiffness: Option<Vec<f64>>,
    pressure_symmetric: Option<Symmetrized>,
    rate_stiffness: Option<Vec<f64>>,
    damped_stiffness: Option<Vec<f64>>,
    damped_divergence: Option<Vec<f64>>,
    damped_divergence_rate: Option<Vec<f64>>,
    damping_mass: Vec<f64>,
    divergence: Option<Vec<f64>>,
    divergence_rate: Option<Vec<f64>>,
    multiplier_stiffness: Option<Vec<f64>>,
    /// Nonzero entries of the stiffness and damping of the elastic foundations.
    foundations: [(SparsityPattern, Vec<f64>); 2],
    added_stiffness: Option<Vec<f64>>,
    added_symmetric: Option<Symmetrized>,
    added_damping: Option<Vec<f64>>,
    /// Rows: free components of each active region whose tension is an unknown.
    tension_pattern: SparsityPattern,
    tension_identity: SparsityPattern,
    tension_force: Vec<f64>,
    tension_decay: Vec<f64>,
    /// Workspace: a nodal force, and one tension per element.
    tension_room: [Vec<f64>; 2],
    /// Tangents of the regions with viscoelastic (Prony) stress, if there are any.
    relaxing: Option<ViscoelasticMatrices>,
    /// Contribution of eliminated oscillators to the stiffness and the damping.
    coherence: Option<[Vec<f64>; 2]>,
}

/// Tangents of viscoelastic stress and the displacement (all nodes) at which they were evaluated.
#[derive(Debug, Clone)]
struct ViscoelasticMatrices {
    geometric: Vec<f64>,
    /// One array per Prony series.
    material: Vec<Vec<f64>>,
    at: Vec<f64>,
}

impl Matrices {
    /// Allocates the matrices in `used`.
    pub(crate) fn new(muscle: &Muscle, used: impl IntoIterator<Item = Matrix>) -> Self {
        let solid = &muscle.solid;
        let n_free = solid.dofs().n_free();
        let n_vertices = solid.space().n_pressures();
        let (mass_pattern, mass) =
            without_zeros(solid.displacement_pattern(), &solid.mass_values());
        let tension_pattern = tension_pattern(muscle);
        let n_tensions = tension_pattern.major_dim();
        let mut matrices = Self {
            foundations: [RobinSupport::stiffness, RobinSupport::damping].map(|constant| {
                let mut values = vec![0.0; solid.displacement_pattern().nnz()];
                for foundation in &muscle.foundations {
                    foundation
                        .operator()
                        .add_values(constant(foundation), solid, &mut values);
                }
                without_zeros(solid.displacement_pattern(), &values)
            }),
            added_stiffness: None,
            added_symmetric: None,
            added_damping: None,
            tension_force: vec![0.0; tension_pattern.nnz()],
            tension_decay: vec![0.0; n_tensions],
            tension_room: match n_tensions {
                0 => Default::default(),
                _ => [
                    muscle.solid.space().n_components(),
                    muscle.solid.n_tensions(),
                ]
                .map(|n| vec![0.0; n]),
            },
            tension_identity: diagonal(n_tensions),
            tension_pattern,
            displacement_identity: diagonal(n_free),
            pressure_identity: diagonal(n_vertices),
            ones: vec![1.0; n_free.max(n_vertices).max(n_tensions)],
            mass_pattern,
            mass,
            stiffness: None,
            pressure_stiffness: None,
            pressure_symmetric: None,
            rate_stiffness: None,
            damped_stiffness: None,
            damped_divergence: None,
            damped_divergence_rate: None,
            relaxing: None,
            coherence: None,
            damping_mass: Vec::new(),
            divergence: None,
            divergence_rate: None,
            multiplier_stiffness: None,
        };
        for matrix in used {
            let slot = match matrix {
                Matrix::Stiffness => &mut matrices.stiffness,
                Matrix::PressureStiffness => &mut matrices.pressure_stiffness,
                Matrix::DampingMass => {
                    let values = solid.damping_mass_values();
                    matrices.damping_mass = on_pattern(solid, &matrices.mass_pattern, &values);
                    continue;
                }
                Matrix::RateStiffness => &mut matrices.rate_stiffness,
                Matrix::DampedStiffness => &mut matrices.damped_stiffness,
                Matrix::DampedDivergenceTransposed => &mut matrices.damped_divergence,
                Matrix::DampedDivergenceRateTransposed => &mut matrices.damped_divergence_rate,
                Matrix::Divergence | Matrix::DivergenceTransposed => &mut matrices.divergence,
                Matrix::DivergenceRate | Matrix::DivergenceRateTransposed => {
                    &mut matrices.divergence_rate
                }
                Matrix::MultiplierStiffness => &mut matrices.multiplier_stiffness,
                Matrix::AddedStiffness => &mut matrices.added_stiffness,
                Matrix::AddedDamping => &mut matrices.added_damping,
                Matrix::RelaxingGeometric => {
                    let room = vec![0.0; solid.displacement_pattern().nnz()];
                    matrices.relaxing = Some(ViscoelasticMatrices {
                        material: vec![room.clone(); solid.relaxation_regions().len()],
                        geometric: room,
                        at: vec![0.0; solid.dofs().n_full()],
                    });
                    continue;
                }
                Matrix::PressureSymmetricStiffness => {
                    let pattern = solid.displacement_pattern();
                    matrices.pressure_symmetric = Some(Symmetrized::new(pattern));
                    continue;
                }
                Matrix::AddedSymmetricStiffness => {
                    let pattern = solid.displacement_pattern();
                    matrices.added_symmetric = Some(Symmetrized::new(pattern));
                    continue;
                }
                _ => continue,
            };
            let room = || vec![0.0; Self::state_pattern(solid, matrix).nnz()];
            slot.get_or_insert_with(room);
            // A derived matrix also requires the matrices from which it is computed.
            match matrix {
                Matrix::DampedDivergenceTransposed => {
                    matrices.divergence.get_or_insert_with(room);
                }
                Matrix::DampedDivergenceRateTransposed => {
                    matrices.divergence_rate.get_or_insert_with(room);
                }
                _ => {}
            }
        }
        matrices
    }

    fn state_pattern(solid: &Solid, matrix: Matrix) -> &SparsityPattern {
        match matrix {
            Matrix::Divergence
            | Matrix::DivergenceTransposed
            | Matrix::DivergenceRate
            | Matrix::DivergenceRateTransposed
            | Matrix::DampedDivergenceTransposed
            | Matrix::DampedDivergenceRateTransposed => solid.divergence_pattern(),
            Matrix::PressureMass => solid.pressure_pattern(),
            _ => solid.displacement_pattern(),
        }
    }

    /// Returns the pattern in which the values of `matrix` are ordered and whether `matrix` is its
    /// transpose.
    pub(crate) fn pattern<'a>(
        &'a self,
        solid: &'a Solid,
        matrix: Matrix,
    ) -> (&'a SparsityPattern, bool) {
        let transposed = matches!(
            matrix,
            Matrix::DivergenceTransposed
                | Matrix::DivergenceRateTransposed
                | Matrix::DampedDivergenceTransposed
                | Matrix::DampedDivergenceRateTransposed
        );
        let pattern = match matrix {
            Matrix::DisplacementIdentity => &self.displacement_identity,
            Matrix::PressureIdentity => &self.pressure_identity,
            Matrix::Mass | Matrix::DampingMass => &self.mass_pattern,
            Matrix::FoundationStiffness => &self.foundations[0].0,
            Matrix::FoundationDamping => &self.foundations[1].0,
            Matrix::TensionForce => &self.tension_pattern,
            Matrix::TensionIdentity | Matrix::TensionDecay => &self.tension_identity,
            _ => Self::state_pattern(solid, matrix),
        };
        (pattern, transposed)
    }

    /// Returns the values of `matrix` in the order of its pattern.
    pub(crate) fn values<'a>(&'a self, solid: &'a Solid, matrix: Matrix) -> &'a [f64] {
        let stored = match matrix {
            Matrix::DisplacementIdentity | Matrix::PressureIdentity | Matrix::TensionIdentity => {
                return &self.ones;
            }
            Matrix::FoundationStiffness => return &self.foundations[0].1,
            Matrix::FoundationDamping => return &self.foundations[1].1,
            Matrix::TensionForce => return &self.tension_force,
            Matrix::TensionDecay => return &self.tension_decay,
            Matrix::AddedSymmetricStiffness | Matrix::PressureSymmetricStiffness => {
                let stored = match matrix {
                    Matrix::AddedSymmetricStiffness => self.added_symmetric.as_ref(),
                    _ => self.pressure_symmetric.as_ref(),
                };
                return &stored.expect("only matrices in use are requested").values;
            }
            Matrix::CoherenceStiffness => return &self.coherence()[0],
            Matrix::CoherenceDamping => return &self.coherence()[1],
            Matrix::RelaxingGeometric => return &self.relaxing().geometric,
            Matrix::RelaxingStiffness(k) => return &self.relaxing().material[k],
            Matrix::AddedStiffness => &self.added_stiffness,
            Matrix::AddedDamping => &self.added_damping,
            Matrix::Mass => return &self.mass,
            Matrix::PressureMass => return solid.compliance_values(),
            Matrix::DampingMass => return &self.damping_mass,
            Matrix::Stiffness => &self.stiffness,
            Matrix::PressureStiffness => &self.pressure_stiffness,
            Matrix::RateStiffness => &self.rate_stiffness,
            Matrix::DampedStiffness => &self.damped_stiffness,
            Matrix::DampedDivergenceTransposed => &self.damped_divergence,
            Matrix::DampedDivergenceRateTransposed => &self.damped_divergence_rate,
            Matrix::Divergence | Matrix::DivergenceTransposed => &self.divergence,
            Matrix::DivergenceRate | Matrix::DivergenceRateTransposed => &self.divergence_rate,
            Matrix::MultiplierStiffness => &self.multiplier_stiffness,
        };
        stored
            .as_deref()
            .expect("only matrices in use are requested")
    }

    fn coherence(&self) -> &[Vec<f64>; 2] {
        let coherence = self.coherence.as_ref();
        coherence.expect("only matrices in use are requested")
    }

    /// Returns the contribution of eliminated oscillators to stiffness and damping, to be filled.
    /// Allocates it at the first call.
    pub(crate) fn coherence_mut(&mut self, solid: &Solid) -> &mut [Vec<f64>; 2] {
        let nnz = solid.displacement_pattern().nnz();
        self.coherence
            .get_or_insert_with(|| [vec![0.0; nnz], vec![0.0; nnz]])
    }

    fn relaxing(&self) -> &ViscoelasticMatrices {
        let relaxing = self.relaxing.as_ref();
        relaxing.expect("only matrices in use are requested")
    }

    /// Returns the displacement at which the tangents of viscoelastic stress were evaluated.
    pub(crate) fn relaxing_at(&self) -> &[f64] {
        &self.relaxing().at
    }

    /// Evaluates the tangents of viscoelastic stress, if there are any.
    pub(crate) fn update_relaxing(&mut self, solid: &Solid, u: &[f64], over: Overstress<'_>) {
        if let Some(ViscoelasticMatrices {
            geometric,
            material,
            at,
        }) = &mut self.relaxing
        {
            at.copy_from_slice(u);
            solid.relaxation_tangents(u, over, geometric, material);
        }
    }

    /// Evaluates the load stiffness of follower pressures and its symmetric part, if used: `factor`
    /// times the stiffness of `loads` at time `t` and displacement `u` of all nodes.
    pub(crate) fn update_pressures(
        &mut self,
        loads: &[PressureLoad],
        t: f64,
        factor: f64,
        u: &[f64],
    ) {
        if let Some(values) = &mut self.pressure_stiffness {
            values.fill(0.0);
            for load in loads {
                load.add_stiffness_at(t, factor, u, values);
            }
            if let Some(part) = &mut self.pressure_symmetric {
                part.take(values);
            }
        }
    }

    /// Computes the symmetric part of the stiffness of added stresses, if used.
    pub(crate) fn symmetrize(&mut self) {
        if let (Some(part), Some(whole)) = (&mut self.added_symmetric, &self.added_stiffness) {
            part.take(whole);
        }
    }

    /// Computes the matrices derived from other matrices.
    pub(crate) fn derive(&mut self, solid: &Solid) {
        let Some(damping) = solid.pressure_damping() else {
            return;
        };
        let rows = solid.divergence_pattern().minor_indices();
        for (damped, whole) in [
            (&mut self.damped_divergence, &self.divergence),
            (&mut self.damped_divergence_rate, &self.divergence_rate),
        ] {
            if let (Some(damped), Some(whole)) = (damped, whole) {
                for ((damped, whole), &row) in damped.iter_mut().zip(whole).zip(rows) {
                    *damped = damping[row] * whole;
                }
            }
        }
    }

    /// Returns the tangents of added stresses, to be filled by the solid.
    pub(crate) fn wanted_added(&mut self) -> AddedTangents<'_> {
        AddedTangents {
            by_displacement: self.added_stiffness.as_deref_mut(),
            by_velocity: self.added_damping.as_deref_mut(),
        }
    }

    /// Evaluates the matrices of the tensions at time `t` for displacement and velocity of all
    /// nodes.
    pub(crate) fn update_tensions(&mut self, muscle: &Muscle, t: f64, u: &[f64], v: &[f64]) {
        let Muscle { solid, .. } = muscle;
        let [force, tensions] = &mut self.tension_room;
        let free = solid.dofs().free_to_full();
        for (k, (number, model)) in muscle.models().enumerate() {
            self.tension_decay[k] = -model.rate_slope(t);
            for (element, tension) in tensions.iter_mut().enumerate() {
                *tension = f64::from(solid.added_number(element) == Some(number));
            }
            solid.active_force(&AddedMotion { u, v, tensions }, force);
            let entries = self.tension_pattern.major_offsets();
            let entries = entries[k]..entries[k + 1];
            let rows = &self.tension_pattern.minor_indices()[entries.clone()];
            for (value, &row) in self.tension_force[entries].iter_mut().zip(rows) {
                *value = force[free[row]];
            }
        }
    }

    /// Returns the state-dependent matrices, to be filled by the solid.
    pub(crate) fn wanted(&mut self) -> Tangents<'_> {
        Tangents {
            stiffness: self.stiffness.as_deref_mut(),
            damped_stiffness: self.damped_stiffness.as_deref_mut(),
            rate_stiffness: self.rate_stiffness.as_deref_mut(),
            divergence: self.divergence.as_deref_mut(),
            divergence_rate: self.divergence_rate.as_deref_mut(),
            multiplier_stiffness: self.multiplier_stiffness.as_deref_mut(),
        }
    }
}

/// Symmetric part of a matrix with a symmetric pattern.
#[derive(Debug, Clone)]
struct Symmetrized {
    /// Position of the transposed entry.
    mirrored: Vec<u32>,
    values: Vec<f64>,
}

impl Symmetrized {
    fn new(pattern: &SparsityPattern) -> Self {
        let place = |(column, row): (usize, usize)| {
            let within = pattern.lane(row).binary_search(&column);
            let within = within.expect("the pattern is symmetric");
            u32::try_from(pattern.major_offsets()[row] + within)
                .expect("fewer than 2^32 entries in a matrix")
        };
        Self {
            mirrored: pattern.entries().map(place).collect(),
            values: vec![0.0; pattern.nnz()],
        }
    }

    fn take(&mut self, whole: &[f64]) {
        let entries = self.values.iter_mut().zip(whole).zip(&self.mirrored);
        for ((part, own), &mirrored) in entries {
            *part = 0.5 * (own + whole[mirrored as usize]);
        }
    }
}

/// Returns a pattern with one column per unknown tension and the free components of its region as
/// rows.
fn tension_pattern(muscle: &Muscle) -> SparsityPattern {
    let Muscle { solid, .. } = muscle;
    let space = solid.space();
    let dimension = space.dimension();
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for (number, _) in muscle.models() {
        let mut acted = vec![false; space.n_nodes()];
        for element in 0..space.n_elements() {
            if solid.added_number(element) == Some(number) {
                for &node in space.element_nodes(element) {
                    acted[node] = true;
                }
            }
        }
        let free = solid.dofs().free_to_full().iter().enumerate();
        let own = free.filter(|(_, full)| acted[**full / dimension]);
        rows.extend(own.map(|(row, _)| row));
        offsets.push(rows.len());
    }
    let n_columns = offsets.len() - 1;
    SparsityPattern::try_from_offsets_and_indices(n_columns, solid.dofs().n_free(), offsets, rows)
        .expect("free components ascend")
}

/// Extracts from values on the displacement pattern the entries of the subpattern `part`.
fn on_pattern(solid: &Solid, part: &SparsityPattern, values: &[f64]) -> Vec<f64> {
    let whole = solid.displacement_pattern();
    let entry = |(column, row): (usize, usize)| {
        let within = whole.lane(column).binary_search(&row);
        values[whole.major_offsets()[column] + within.expect("a subset of the pattern")]
    };
    part.entries().map(entry).collect()
}

/// Removes the zero entries of a constant matrix.
fn without_zeros(pattern: &SparsityPattern, values: &[f64]) -> (SparsityPattern, Vec<f64>) {
    let (mut offsets, mut rows, mut kept) = (vec![0], Vec::new(), Vec::new());
    for column in pattern.major_offsets().windows(2) {
        let own = column[0]..column[1];
        let entries = pattern.minor_indices()[own.clone()]
            .iter()
            .zip(&values[own]);
        for (&row, &value) in entries.filter(|(_, value)| **value != 0.0) {
            rows.push(row);
            kept.push(value);
        }
        offsets.push(rows.len());
    }
    let (n_columns, n_rows) = (pattern.major_dim(), pattern.minor_dim());
    let pattern = SparsityPattern::try_from_offsets_and_indices(n_columns, n_rows, offsets, rows)
        .expect("a subset of a valid pattern is valid");
    (pattern, kept)
}

fn diagonal(n: usize) -> SparsityPattern {
    SparsityPattern::try_from_offsets_and_indices(n, n, (0..=n).collect(), (0..n).collect())
        .expect("a diagonal is a valid pattern")
}
