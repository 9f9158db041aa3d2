//! Storage of the matrices of one formulation. Matrices that the formulation does not use are
//! neither stored nor computed.

use std::collections::HashMap;

use myovib_fem::{AddedMotion, AddedTangents, Overstress, Solid, Tangents};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

use crate::matrix::{Matrix, Pattern, Properties, Source};
use crate::muscle::Muscle;
use crate::muscle::load::BoundaryForce;
use crate::muscle::robin_support::RobinSupport;

/// Values of the matrices of one formulation.
#[derive(Debug, Clone)]
pub(crate) struct Matrices {
    displacement_identity: SparsityPattern,
    pressure_identity: SparsityPattern,
    tension_identity: SparsityPattern,
    /// Pattern of the entries that couple the same component of two nodes; a subset of the displacement pattern.
    mass: SparsityPattern,
    /// Patterns of the nonzero entries of the stiffness and damping of the elastic foundations.
    foundations: [SparsityPattern; 2],
    /// Pattern with one column per unknown tension. The rows of a column are the free components of the active region.
    tensions: SparsityPattern,
    /// Values of the matrices in use, except for those in `relaxing` and `coherence`.
    values: HashMap<Matrix, Vec<f64>>,
    /// Tangents of the regions with viscoelastic (Prony) stress, if there are any.
    relaxing: Option<ViscoelasticMatrices>,
    /// Contribution of eliminated oscillators to the stiffness and the damping.
    coherence: Option<[Vec<f64>; 2]>,
    /// Position of the transposed entry for each entry of the displacement pattern; empty unless a
    /// symmetric part is used.
    mirrored: Vec<u32>,
    /// Workspace: a nodal force, and one tension per element.
    tension_workspace: [Vec<f64>; 2],
}

/// Tangents of viscoelastic stress and the displacement of all nodes at which they were evaluated.
#[derive(Debug, Clone)]
struct ViscoelasticMatrices {
    geometric: Vec<f64>,
    /// One array per Prony series.
    material: Vec<Vec<f64>>,
    at: Vec<f64>,
}

impl Matrices {
    pub(crate) fn new(muscle: &Muscle, used: impl IntoIterator<Item = Matrix>) -> Self {
        let solid = &muscle.solid;
        let whole = solid.displacement_pattern();
        let (mass, mass_values) = without_zeros(whole, solid.mass_values());
        let [stiffness, damping] =
            [RobinSupport::stiffness, RobinSupport::damping].map(|constant| {
                let mut values = vec![0.0; whole.nnz()];
                for foundation in &muscle.foundations {
                    let operator = foundation.operator();
                    operator.add_values(constant(foundation), solid, &mut values);
                }
                without_zeros(whole, values)
            });
        let tensions = tension_pattern(muscle);
        let [n_free, n_vertices, n_tensions] =
            [solid.dofs().n_free(), solid.space().n_pressures(), tensions.major_dim()];
        let mut matrices = Self {
            displacement_identity: diagonal(n_free),
            pressure_identity: diagonal(n_vertices),
            tension_identity: diagonal(n_tensions),
            mass,
            foundations: [stiffness.0, damping.0],
            values: HashMap::from([
                (Matrix::DisplacementIdentity, vec![1.0; n_free]),
                (Matrix::PressureIdentity, vec![1.0; n_vertices]),
                (Matrix::TensionIdentity, vec![1.0; n_tensions]),
                (Matrix::Mass, mass_values),
                (Matrix::FoundationStiffness, stiffness.1),
                (Matrix::FoundationDamping, damping.1),
                (Matrix::TensionForce, vec![0.0; tensions.nnz()]),
                (Matrix::TensionDecay, vec![0.0; n_tensions]),
            ]),
            tensions,
            relaxing: None,
            coherence: None,
            mirrored: Vec::new(),
            tension_workspace: match n_tensions {
                0 => Default::default(),
                _ => [solid.space().n_components(), solid.n_tensions()].map(|n| vec![0.0; n]),
            },
        };
        for matrix in used {
            matrices.allocate(solid, matrix);
        }
        matrices
    }

    /// Allocates a matrix and the matrix from which it is computed.
    fn allocate(&mut self, solid: &Solid, matrix: Matrix) {
        let source = match matrix.properties().source {
            Source::Constant if matrix == Matrix::DampingMass => {
                let values = on_pattern(solid, &self.mass, &solid.damping_mass_values());
                self.values.insert(matrix, values);
                return;
            }
            Source::Relaxation if self.relaxing.is_none() => {
                let zeros = vec![0.0; solid.displacement_pattern().nnz()];
                self.relaxing = Some(ViscoelasticMatrices {
                    material: vec![zeros.clone(); solid.relaxation_regions().len()],
                    geometric: zeros,
                    at: vec![0.0; solid.dofs().n_full()],
                });
                return;
            }
            Source::Constant | Source::Relaxation | Source::Coherence => return,
            Source::Computed => None,
            Source::TransposeOf(whole) => return self.allocate(solid, whole),
            Source::ScaledRows(whole) => Some(whole),
            Source::SymmetricPartOf(_) => {
                if self.mirrored.is_empty() {
                    self.mirrored = mirrored(solid.displacement_pattern());
                }
                None
            }
        };
        for matrix in source.into_iter().chain([matrix]) {
            let n = self.pattern(solid, matrix).0.nnz();
            self.values.entry(matrix).or_insert_with(|| vec![0.0; n]);
        }
    }

    /// Returns the pattern that determines the order of the values of `matrix`, and whether `matrix` has the transpose
    /// of this pattern.
    pub(crate) fn pattern<'a>(
        &'a self,
        solid: &'a Solid,
        matrix: Matrix,
    ) -> (&'a SparsityPattern, bool) {
        let Properties { pattern, source, .. } = matrix.properties();
        let transposed = matches!(source, Source::TransposeOf(_) | Source::ScaledRows(_));
        let pattern = match pattern {
            Pattern::DisplacementIdentity => &self.displacement_identity,
            Pattern::PressureIdentity => &self.pressure_identity,
            Pattern::TensionIdentity => &self.tension_identity,
            Pattern::Mass => &self.mass,
            Pattern::FoundationStiffness => &self.foundations[0],
            Pattern::FoundationDamping => &self.foundations[1],
            Pattern::Tensions => &self.tensions,
            Pattern::Displacement => solid.displacement_pattern(),
            Pattern::Pressure => solid.pressure_pattern(),
            Pattern::Divergence => solid.divergence_pattern(),
        };
        (pattern, transposed)
    }

    /// Returns the values of `matrix` in the order of its pattern.
    pub(crate) fn values<'a>(&'a self, solid: &'a Solid, matrix: Matrix) -> &'a [f64] {
        let stored = match (matrix, matrix.properties().source) {
            (Matrix::PressureMass, _) => return solid.compliance_values(),
            (Matrix::CoherenceStiffness, _) => self.coherence.as_ref().map(|parts| &parts[0]),
            (Matrix::CoherenceDamping, _) => self.coherence.as_ref().map(|parts| &parts[1]),
            (Matrix::RelaxingGeometric, _) => Some(&self.relaxing().geometric),
            (Matrix::RelaxingStiffness(k), _) => Some(&self.relaxing().material[k]),
            (_, Source::TransposeOf(whole)) => self.values.get(&whole),
            _ => self.values.get(&matrix),
        };
        stored.expect("only matrices in use are requested")
    }

    /// Returns the buffers for the contribution of eliminated oscillators to stiffness and damping. Allocates the
    /// buffers on the first call.
    pub(crate) fn coherence_mut(&mut self, solid: &Solid) -> &mut [Vec<f64>; 2] {
        let nnz = solid.displacement_pattern().nnz();
        self.coherence.get_or_insert_with(|| [vec![0.0; nnz], vec![0.0; nnz]])
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
        if let Some(ViscoelasticMatrices { geometric, material, at }) = &mut self.relaxing {
            at.copy_from_slice(u);
            solid.relaxation_tangents(u, over, geometric, material);
        }
    }

    /// Evaluates the stiffness of the boundary forces at time `t` and nodal displacements `u`, with the loads scaled
    /// by `part`. Also evaluates the symmetric part of this stiffness, if used.
    pub(crate) fn update_boundary_forces<'a>(
        &mut self,
        forces: impl Iterator<Item = &'a dyn BoundaryForce>,
        (t, part): (f64, f64),
        u: &[f64],
    ) {
        if let Some(values) = self.values.get_mut(&Matrix::PressureStiffness) {
            values.fill(0.0);
            for load in forces {
                load.add_stiffness(t, part, u, values);
            }
        }
        self.symmetrize(Matrix::PressureSymmetricStiffness);
    }

    /// Computes `part`, which is the symmetric part of another matrix, if it is used.
    pub(crate) fn symmetrize(&mut self, part: Matrix) {
        let Source::SymmetricPartOf(whole) = part.properties().source else {
            return;
        };
        if let [Some(part), Some(whole)] = self.values.get_disjoint_mut([&part, &whole]) {
            for ((part, own), &mirrored) in part.iter_mut().zip(&*whole).zip(&self.mirrored) {
                *part = 0.5 * (own + whole[mirrored as usize]);
            }
        }
    }

    /// Computes the matrices with scaled rows.
    pub(crate) fn derive(&mut self, solid: &Solid) {
        let Some(damping) = solid.pressure_damping() else {
            return;
        };
        let rows = solid.divergence_pattern().minor_indices();
        for pair in [
            [&Matrix::DampedDivergenceTransposed, &Matrix::Divergence],
            [&Matrix::DampedDivergenceRateTransposed, &Matrix::DivergenceRate],
        ] {
            if let [Some(damped), Some(whole)] = self.values.get_disjoint_mut(pair) {
                for ((damped, whole), &row) in damped.iter_mut().zip(whole).zip(rows) {
                    *damped = damping[row] * *whole;
                }
            }
        }
    }

    /// Returns the buffers that the solid fills with the tangents of added stresses.
    pub(crate) fn requested_added(&mut self) -> AddedTangents<'_> {
        let requested = [&Matrix::AddedStiffness, &Matrix::AddedDamping];
        let [by_displacement, by_velocity] = self.requested_of(requested);
        AddedTangents { by_displacement, by_velocity }
    }

    fn requested_of<const N: usize>(&mut self, requested: [&Matrix; N]) -> [Option<&mut [f64]>; N] {
        let stored = self.values.get_disjoint_mut(requested);
        stored.map(|values| values.map(|values| &mut values[..]))
    }

    /// Evaluates the matrices of the tensions at time `t` for the displacement `u` and the velocity `v` of all nodes.
    pub(crate) fn update_tensions(&mut self, muscle: &Muscle, t: f64, u: &[f64], v: &[f64]) {
        let Muscle { solid, .. } = muscle;
        let [force, tensions] = &mut self.tension_workspace;
        let stored = [&Matrix::TensionForce, &Matrix::TensionDecay];
        let [Some(by_tension), Some(decay)] = self.values.get_disjoint_mut(stored) else {
            return;
        };
        let free = solid.dofs().free_to_full();
        for (k, (number, model)) in muscle.models().enumerate() {
            decay[k] = -model.rate_slope(t);
            for (element, tension) in tensions.iter_mut().enumerate() {
                *tension = f64::from(solid.added_number(element) == Some(number));
            }
            solid.active_force(&AddedMotion { u, v, tensions }, force);
            let entries = self.tensions.major_offsets();
            let entries = entries[k]..entries[k + 1];
            let rows = &self.tensions.minor_indices()[entries.clone()];
            for (value, &row) in by_tension[entries].iter_mut().zip(rows) {
                *value = force[free[row]];
            }
        }
    }

    /// Returns the buffers that the solid fills with the state-dependent matrices.
    pub(crate) fn requested(&mut self) -> Tangents<'_> {
        Tangents::from(self.requested_of([
            &Matrix::Stiffness,
            &Matrix::DampedStiffness,
            &Matrix::RateStiffness,
            &Matrix::Divergence,
            &Matrix::DivergenceRate,
            &Matrix::MultiplierStiffness,
        ]))
    }
}

/// Returns the position of the transposed entry for each entry of a symmetric pattern.
fn mirrored(pattern: &SparsityPattern) -> Vec<u32> {
    let place = |(column, row): (usize, usize)| {
        let within = pattern.lane(row).binary_search(&column);
        let within = within.expect("the pattern is symmetric");
        u32::try_from(pattern.major_offsets()[row] + within)
            .expect("fewer than 2^32 entries in a matrix")
    };
    pattern.entries().map(place).collect()
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

/// Extracts the entries of the subpattern `part` from `values`, which are ordered by the displacement pattern.
fn on_pattern(solid: &Solid, part: &SparsityPattern, values: &[f64]) -> Vec<f64> {
    let whole = solid.displacement_pattern();
    let entry = |(column, row): (usize, usize)| {
        let within = whole.lane(column).binary_search(&row);
        values[whole.major_offsets()[column] + within.expect("a subset of the pattern")]
    };
    part.entries().map(entry).collect()
}

/// Removes the zero entries of a constant matrix.
fn without_zeros(pattern: &SparsityPattern, values: Vec<f64>) -> (SparsityPattern, Vec<f64>) {
    let matrix = CscMatrix::try_from_pattern_and_values(pattern.clone(), values);
    let matrix = matrix.expect("one value for each entry");
    matrix.filter(|_, _, value| *value != 0.0).into_pattern_and_values()
}

fn diagonal(n: usize) -> SparsityPattern {
    SparsityPattern::try_from_offsets_and_indices(n, n, (0..=n).collect(), (0..n).collect())
        .expect("a diagonal is a valid pattern")
}
