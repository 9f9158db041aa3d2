//! Numerical computation of the paper's Table 1.

use std::sync::Arc;

use myovib_fem::{DofMap, FemError, Law, Mesh, Solid, Space, generate};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::analysis::index::IndexReport;
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::muscle::parameters::Parameters;
use crate::muscle_dae::MuscleDae;
use crate::operators::element_size;
use crate::paper;

/// Magnitude of the strains in the random states. The strains are large, but no element is inverted.
const STRAIN: f64 = 0.1;
/// Ratio of the strain rates to the strains in these states, 1/s.
const RATE: f64 = 5.0;

/// A formulation with its parameters and the index printed in the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Equation number in the paper; `None` if the paper does not contain the case.
    pub equation: Option<&'static str>,
    /// The material law.
    pub law: Law,
    /// The formulation.
    pub formulation: Formulation,
    /// κ, Pa.
    pub kappa: f64,
    /// β, s.
    pub beta: f64,
    /// Index printed in the table or in the remark below it.
    pub printed: Option<usize>,
}

const INF: f64 = f64::INFINITY;

/// Returns the eight rows of Table 1, the paper's remark on (29), and the formulations that the table
/// does not list.
pub fn cases() -> Vec<Case> {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    let case = |equation, law, formulation, kappa, beta, printed| Case {
        equation: Some(equation),
        law,
        formulation,
        kappa,
        beta,
        printed,
    };
    let ours = |kappa, beta| Case {
        equation: None,
        ..case("", paper::LAW, ImplicitRate, kappa, beta, None)
    };
    vec![
        case("26", paper::SMALL_STRAIN, ImplicitRate, INF, 0.0, Some(3)),
        case("26", paper::SMALL_STRAIN, ImplicitRate, 1e5, 0.0, Some(1)),
        case("26", paper::SMALL_STRAIN, ImplicitRate, INF, 1e-4, Some(2)),
        case("26", paper::SMALL_STRAIN, ImplicitRate, 1e5, 1e-4, Some(1)),
        case("28", paper::LAW, Position, INF, 0.0, Some(3)),
        case("28", paper::LAW, Position, 1e5, 0.0, Some(1)),
        case("29", paper::LAW, Rate, INF, 1e-4, Some(3)),
        case("29", paper::LAW, Rate, 1e5, 1e-4, Some(2)),
        case("29", paper::LAW, Rate, INF, 0.0, Some(4)),
        case("29", paper::LAW, Rate, 1e5, 0.0, None),
        case("18", paper::LAW, Displacement, 1e5, 1e-4, None),
        case("31", paper::LAW, Velocity, INF, 0.0, None),
        case("31", paper::LAW, Velocity, 1e5, 0.0, None),
        case("33", paper::LAW, Stabilized, INF, 0.0, None),
        ours(INF, 1e-4),
        ours(1e5, 1e-4),
    ]
}

/// Returns a beam of the muscle's size with few enough unknowns to compute the index from the
/// matrices.
pub(crate) fn coarse_beam(columns: usize) -> Result<Mesh, FemError> {
    generate::beam(0.1, 0.04, [columns, 2])
}

/// Returns a block of the muscle's size with six tetrahedra, the 3D counterpart of [`coarse_beam`].
pub(crate) fn coarse_block() -> Result<Mesh, FemError> {
    let mesh = generate::block([0.0; 3], [0.1, 0.04, 0.04], [1, 1, 1])?;
    let mut groups = mesh.groups().clone();
    if let Some(left) = groups.remove("left") {
        groups.insert(paper::FIXED_GROUP.to_owned(), left);
    }
    mesh.with_groups(groups)
}

/// Differentiation index of a case, computed on one mesh at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Number of triangles of the mesh.
    pub triangles: usize,
    /// Seed of the random state.
    pub seed: u64,
    /// Computed index.
    pub report: IndexReport,
}

impl Case {
    /// Computes the index on two meshes, each at two random consistent states with large strains.
    pub fn samples(&self) -> Result<Vec<Sample>, ModelError> {
        let mut samples = Vec::new();
        for columns in [3, 5] {
            let mesh = coarse_beam(columns)?;
            for seed in [1, 2] {
                samples.push(Sample {
                    triangles: mesh.n_elements(),
                    seed,
                    report: self.at_random_state(&mesh, seed)?,
                });
            }
        }
        Ok(samples)
    }

    /// Computes the index on a mesh at a random state generated from `seed`.
    pub fn at_random_state(&self, mesh: &Mesh, seed: u64) -> Result<IndexReport, ModelError> {
        let muscle = self.muscle(mesh)?;
        let solid = &muscle.solid;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |size: f64| -> Vec<f64> {
            (0..solid.dofs().n_free()).map(|_| size * rng.random_range(-1.0..1.0)).collect()
        };
        // The gradient of a quadratic shape function is about 4 / h.
        let size = STRAIN * element_size(solid) / 4.0;
        let (q, v) = (draw(size), draw(RATE * size));
        let mut dae = MuscleDae::for_analysis(muscle, self.formulation);
        IndexReport::of_motion(&mut dae, 0.0, &q, &v)
    }

    fn muscle(&self, mesh: &Mesh) -> Result<Muscle, ModelError> {
        let space = Arc::new(Space::taylor_hood(mesh));
        let dofs = DofMap::clamped(&space, &space.nodes_of(paper::FIXED_GROUP)?)?;
        let solid = Solid::uniform(space, dofs, self.law, paper::DENSITY)?;
        let parameters = Parameters::new(paper::ALPHA, self.beta, self.kappa)?;
        Ok(Muscle::unloaded(solid, parameters))
    }
}

/// Computes the index of (29) along a sequence with κ → ∞ and β → 0.
///
/// The index is 2 for every member of the sequence and 4 in the limit. The rank gap shrinks along the sequence; at the
/// last finite κ, rank decisions are barely possible.
pub fn limit() -> Result<Vec<(Case, IndexReport)>, ModelError> {
    let mesh = coarse_beam(3)?;
    let kappas = [1e5, 1e7, 1e9, 1e11, 1e13, INF];
    let toward_limit = |kappa: f64| -> Result<(Case, IndexReport), ModelError> {
        let case = Case {
            equation: Some("29"),
            law: paper::LAW,
            formulation: Formulation::Rate,
            kappa,
            // β κ = 10 Pa s at the paper's preferred pair.
            beta: 10.0 / kappa,
            printed: None,
        };
        Ok((case, case.at_random_state(&mesh, 1)?))
    };
    kappas.into_iter().map(toward_limit).collect()
}
