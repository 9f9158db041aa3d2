//! Operators of a solid: forces, volume residuals, the rates and tangents of both, and mass matrices.
//!
//! [`Solid`] owns the space, the laws, the scatter maps and the constant matrices. [`Fields`] holds the input
//! fields of [`Solid::evaluate`] and [`Solid::tangents`]. [`Vectors`] and [`Tangents`] select the results and hold
//! the buffers for them. The tangents satisfy
//!
//! ```text
//! ∂force/∂p = −B(u)ᵀ              ∂force_rate/∂v = stiffness     ∂force_rate/∂ṗ = −B(u)ᵀ
//! ∂force_rate/∂p = −divergence_rateᵀ
//! ∂volume_residual_rate/∂v = B(u)             ∂volume_residual_rate/∂u = divergence_rate
//! ```
//!
//! so that five blocks are sufficient for all formulations. Reference: paper, section 2.

mod added;
pub(crate) mod assembler;
pub(crate) mod element_material;
mod element_scales;
mod evaluation;
mod matrices;
mod partition;
mod relaxation;
#[cfg(test)]
mod tests;
mod threads;

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use pulp::{Arch, WithSimd};
use rayon::ThreadPool;

use crate::element::quadrature::Rule;
use crate::error::FemError;
use crate::material::fibers::Fibers;
use crate::material::three::Axes;
use crate::material::{Law, Prony, Range, VolumeFunction};
use crate::operators::added::AddedStress;
pub use crate::operators::fields::{
    Change, Fields, Inverted, Pressure, TangentProduct, Tangents, Vectors,
};
use crate::operators::mass::SymmetricMatrix;
use crate::operators::relaxation::InternalStresses;
use crate::simd::batch::Batches;
use crate::solid::element_material::{ElementMaterial, ElementScale};
use crate::space::dofs::DofMap;
use crate::space::sparsity::{ScatterMap, displacement_pattern, divergence_pattern};
use crate::space::{Degree, ElementPoint, Space};

use element_scales::ScaledMatrices;
use partition::Partition;

/// Batches, distinguished by the dimension and by the number of nodes and pressures of an element.
#[derive(Debug, Clone)]
#[cfg_attr(test, allow(dead_code))] // see `with_elements`
enum Elements {
    LinearTriangles(MappedBatches<2, 3, 3>),
    QuadraticTriangles(MappedBatches<2, 6, 3>),
    LinearTetrahedra(MappedBatches<3, 4, 4>),
    QuadraticTetrahedra(MappedBatches<3, 10, 4>),
}

/// Evaluates an expression with `$mapped` bound to the batches of any element type.
///
/// Integration tests cover three-dimensional bodies. The unit tests exclude these bodies, because it would take
/// minutes to compile their loops a second time.
macro_rules! with_elements {
    ($elements:expr, $mapped:ident => $body:expr) => {
        match $elements {
            Elements::LinearTriangles($mapped) => $body,
            Elements::QuadraticTriangles($mapped) => $body,
            #[cfg(not(test))]
            Elements::LinearTetrahedra($mapped) => $body,
            #[cfg(not(test))]
            Elements::QuadraticTetrahedra($mapped) => $body,
            #[cfg(test)]
            Elements::LinearTetrahedra(_) | Elements::QuadraticTetrahedra(_) => unreachable!(),
        }
    };
}
use with_elements;

impl Elements {
    fn new(
        space: &Space,
        materials: &[ElementMaterial],
        rule: Rule,
        dofs: &DofMap,
        patterns: [&SparsityPattern; 2],
    ) -> Self {
        match (space.dimension(), space.degree()) {
            (2, Degree::One) => {
                Self::LinearTriangles(MappedBatches::new(space, materials, rule, dofs, patterns))
            }
            (2, Degree::Two) => {
                Self::QuadraticTriangles(MappedBatches::new(space, materials, rule, dofs, patterns))
            }
            (_, Degree::One) => {
                Self::LinearTetrahedra(MappedBatches::new(space, materials, rule, dofs, patterns))
            }
            (_, Degree::Two) => Self::QuadraticTetrahedra(MappedBatches::new(
                space, materials, rule, dofs, patterns,
            )),
        }
    }
}

/// Batches and the locations of their element matrices in the global matrices.
#[derive(Debug, Clone)]
struct MappedBatches<const D: usize, const N: usize, const P: usize> {
    batches: Batches<D, N, P>,
    maps: Vec<ScatterMap<D, N, P>>,
}

impl<const D: usize, const N: usize, const P: usize> MappedBatches<D, N, P> {
    fn new(
        space: &Space,
        materials: &[ElementMaterial],
        rule: Rule,
        dofs: &DofMap,
        [displacement, divergence]: [&SparsityPattern; 2],
    ) -> Self {
        let batches = Batches::new(space, materials, rule);
        let maps = batches.batches.iter();
        Self {
            maps: maps
                .map(|batch| ScatterMap::new(batch, dofs, displacement, divergence))
                .collect(),
            batches,
        }
    }
}

/// Selection of the vector instructions for the passes over one element type.
trait VectorPasses {
    /// Runs an element pass without AVX-512. In rare passes and in passes with much work per point, AVX-512 would not
    /// save time, but it would increase the code size by a third.
    fn run<Op: WithSimd>(&self, arch: Arch, op: Op) -> Op::Output {
        #[cfg(target_arch = "x86_64")]
        match arch {
            Arch::V4(wide) => pulp::Simd::vectorize(*wide, op),
            Arch::V3(simd) => pulp::Simd::vectorize(simd, op),
            _ => pulp::Simd::vectorize(pulp::Scalar::new(), op),
        }
        #[cfg(not(target_arch = "x86_64"))]
        arch.dispatch(op)
    }

    /// Runs the pass for the vectors.
    fn evaluate<Op: WithSimd>(&self, arch: Arch, op: Op) -> Op::Output {
        self.run(arch, op)
    }
}

impl VectorPasses for MappedBatches<2, 6, 3> {
    /// Uses the widest instructions of the processor. In 2D, AVX-512 saves a tenth of the time.
    fn evaluate<Op: WithSimd>(&self, arch: Arch, op: Op) -> Op::Output {
        arch.dispatch(op)
    }
}

impl VectorPasses for MappedBatches<3, 10, 4> {}

// Linear elements only serve as a counterexample for inf–sup constants. Their passes are compiled without vector
// instructions, which saves code.
impl VectorPasses for MappedBatches<2, 3, 3> {
    fn run<Op: WithSimd>(&self, _: Arch, op: Op) -> Op::Output {
        pulp::Simd::vectorize(pulp::Scalar::new(), op)
    }
}

impl VectorPasses for MappedBatches<3, 4, 4> {
    fn run<Op: WithSimd>(&self, _: Arch, op: Op) -> Op::Output {
        pulp::Simd::vectorize(pulp::Scalar::new(), op)
    }
}

/// Solid in 3D, or in plane strain per unit thickness. It consists of a space, constrained components, laws and
/// densities. Methods panic if the length of an array is wrong, or if their parameter `D` is not the dimension.
///
/// # Units
/// SI units: force vectors are in N and masses in kg. In plane strain, they are in N/m and kg/m.
///
/// # Examples
/// ```
/// use std::sync::Arc;
/// use myovib_fem::{dofs::DofMap, generate, material::Law, space::Space};
/// use myovib_fem::solid::{Fields, Pressure, Solid, Vectors};
/// let mesh = generate::rectangle([0.0, 0.0], [1.0, 1.0], [2, 2])?;
/// let space = Arc::new(Space::taylor_hood(&mesh));
/// let dofs = DofMap::clamped(&space, &space.nodes_of("left")?)?;
/// let solid = Solid::uniform(space, dofs, Law::MooneyRivlin { c10: 1e4, c01: 2e2 }, 1.1e3)?;
/// // Length and width grow by a tenth, so the volume grows by 21 %.
/// let u: Vec<f64> = solid.space().coordinates().iter().map(|x| 0.1 * x).collect();
/// let mut volume_residual = vec![0.0; solid.space().n_pressures()];
/// solid.evaluate(
///     &Fields::new(&u, Pressure::Penalty { kappa: 1e5 }),
///     &mut Vectors { volume_residual: Some(&mut volume_residual), ..Default::default() },
/// )?;
/// assert!((volume_residual.iter().sum::<f64>() - 0.21).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solid {
    space: Arc<Space>,
    dofs: DofMap,
    laws: Vec<Law>,
    rule: Rule,
    elements: Elements,
    fibers: Option<Fibers>,
    added: Vec<AddedStress>,
    /// The added stresses without their viscosity.
    active: Vec<AddedStress>,
    /// Prony series of viscoelastic elements.
    prony: Vec<Prony>,
    internal: InternalStresses,
    materials: Vec<ElementMaterial>,
    /// Factor of the law's energy at each vertex of each element, which is interpolated linearly. `None` means
    /// one.
    factors: Option<Vec<f64>>,
    densities: Vec<f64>,
    displacement_pattern: SparsityPattern,
    divergence_pattern: SparsityPattern,
    mass: SymmetricMatrix,
    pressure_mass: SymmetricMatrix,
    /// Matrices that depend on the scales of elements; `None` for uniform scales.
    scaled_matrices: Option<ScaledMatrices>,
    pressure_weights: Vec<f64>,
    /// Local partition of the elements and the workers that compute the other partitions. `None` if the solid
    /// computes all elements.
    partition: Option<Box<Partition>>,
    /// Threads for passes over large bodies.
    threads: Option<Arc<ThreadPool>>,
    /// Vector instructions of the processor. The results of all instruction sets are bitwise equal.
    arch: Arch,
}

impl Solid {
    /// Creates a solid with one law per element.
    ///
    /// # Errors
    /// Returns [`FemError::Count`] if array lengths do not match, or [`FemError::Parameter`] unless the density is
    /// positive.
    pub fn new(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        density: f64,
    ) -> Result<Self, FemError> {
        Self::with_rule(space, dofs, laws, density, Rule::default())
    }

    /// Creates a solid with the same law in all elements.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Solid::new).
    pub fn uniform(
        space: Arc<Space>,
        dofs: DofMap,
        law: Law,
        density: f64,
    ) -> Result<Self, FemError> {
        let laws = vec![law; space.n_elements()];
        Self::new(space, dofs, laws, density)
    }

    /// Creates a solid with the given quadrature rule for force and volume terms. [`new`](Solid::new) uses
    /// degree 4.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Solid::new).
    pub fn with_rule(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        density: f64,
        rule: Rule,
    ) -> Result<Self, FemError> {
        let densities = vec![density; space.n_elements()];
        Self::build(space, dofs, laws, &densities, rule)
    }

    /// Creates a solid with one law and one density per element.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Solid::new).
    pub fn with_densities(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        densities: &[f64],
    ) -> Result<Self, FemError> {
        Self::build(space, dofs, laws, densities, Rule::default())
    }

    fn build(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        densities: &[f64],
        rule: Rule,
    ) -> Result<Self, FemError> {
        check_count("laws, one per element", laws.len(), space.n_elements())?;
        check_count("densities, one per element", densities.len(), space.n_elements())?;
        check_count("components in the dof map", dofs.n_full(), space.n_components())?;
        for &density in densities {
            Range::Positive.check("density", density)?;
        }
        let displacement_pattern = displacement_pattern(&space, &dofs);
        let divergence_pattern = divergence_pattern(&space, &dofs);
        let patterns = [&displacement_pattern, &divergence_pattern];
        let material = |&law: &Law| ElementMaterial {
            law,
            added: None,
            prony: None,
            scale: ElementScale::ONE,
            volume_function: VolumeFunction::default(),
        };
        let materials: Vec<ElementMaterial> = laws.iter().map(material).collect();
        let elements = Elements::new(&space, &materials, rule, &dofs, patterns);
        let pressure_mass = SymmetricMatrix::pressure_mass(&space, |_| 1.0);
        Ok(Self {
            mass: SymmetricMatrix::node_mass(&space, densities),
            pressure_weights: pressure_mass.row_sums(),
            pressure_mass,
            space,
            dofs,
            laws,
            rule,
            elements,
            fibers: None,
            added: Vec::new(),
            active: Vec::new(),
            prony: Vec::new(),
            internal: InternalStresses::default(),
            materials,
            factors: None,
            densities: densities.to_vec(),
            scaled_matrices: None,
            displacement_pattern,
            divergence_pattern,
            partition: None,
            threads: None,
            arch: Arch::new(),
        })
    }

    /// Returns the solid with the given fibers. By default, fibers are along x, and sheets are along y.
    #[must_use]
    pub fn with_fibers(mut self, fibers: Fibers) -> Self {
        let added = &self.added;
        let is_active = |stress: usize| added[stress].active.is_some();
        with_elements!(&mut self.elements, mapped => mapped.batches.set_fibers(&fibers, is_active));
        self.fibers = Some(fibers);
        self
    }

    /// Multiplies the energy of the laws by factors, which are linear in each element. Volume terms, added
    /// stresses and viscous stresses do not change. Prony terms are not supported.
    ///
    /// # Errors
    /// Returns [`FemError::Count`] unless there is a factor for each vertex of each element, or
    /// [`FemError::Parameter`] if a factor is not positive.
    pub fn with_factors(mut self, factors: Vec<f64>) -> Result<Self, FemError> {
        let n = self.space.mesh().shape().n_vertices() * self.space.n_elements();
        check_count("factors, one per vertex of each element", factors.len(), n)?;
        for factor in &factors {
            Range::Positive.check("factor", *factor)?;
        }
        self.factors = Some(factors);
        Ok(self)
    }

    /// Returns the mean factor of the energy in an element.
    pub fn mean_factor(&self, element: usize) -> f64 {
        let n = self.space.mesh().shape().n_vertices();
        self.factors
            .as_ref()
            .map_or(1.0, |factors| factors[n * element..][..n].iter().sum::<f64>() / n as f64)
    }

    /// Returns the fiber axes at a point.
    pub fn axes_at(&self, at: &ElementPoint) -> Axes<f64> {
        self.fibers
            .as_ref()
            .map_or(Axes::cartesian(0.0), |fibers| fibers.axes(at.element, &at.barycentric))
    }

    /// Returns the space.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// Returns the map of free components.
    pub fn dofs(&self) -> &DofMap {
        &self.dofs
    }

    /// Returns the law of each element.
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// Returns the quadrature rule of force and volume terms.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// Returns whether all laws are linear in the fields.
    pub fn is_linear(&self) -> bool {
        self.laws.iter().all(|law| law.is_linear())
    }

    /// Returns the mass density (kg/m³) of each element.
    pub fn densities(&self) -> &[f64] {
        &self.densities
    }

    /// Returns the solid with a mass matrix of zero, for quasi-static motions. The densities are kept.
    #[must_use]
    pub fn without_inertia(mut self) -> Self {
        self.mass.values.fill(0.0);
        self
    }

    /// Returns whether the mass matrix is different from zero.
    pub fn has_inertia(&self) -> bool {
        self.mass.values.iter().any(|mass| *mass != 0.0)
    }

    /// Returns the integrals ∫ ψ_k, which are the weights of projected volume residuals.
    pub fn pressure_weights(&self) -> &[f64] {
        &self.pressure_weights
    }

    /// Returns the undeformed volume in m³. In plane strain, the volume per unit thickness is in m².
    pub fn volume(&self) -> f64 {
        self.space.measure()
    }
}

fn check_count(what: &'static str, found: usize, needed: usize) -> Result<(), FemError> {
    if found == needed { Ok(()) } else { Err(FemError::Count { what, found, needed }) }
}
