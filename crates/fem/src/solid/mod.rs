//! The operators of a solid: forces, volume defects, their rates and tangents, masses.
//!
//! Cast: [`Solid`] owns the spaces, laws and maps, and the constant matrices; [`Fields`] is what
//! the element loops ([`Solid::evaluate`], [`Solid::tangents`]) are evaluated at; [`Vectors`] and
//! [`Tangents`] say which are wanted and where they go. The tangents are related by
//!
//! ```text
//! ∂force/∂p = −B(u)ᵀ              ∂force_rate/∂v = stiffness     ∂force_rate/∂ṗ = −B(u)ᵀ
//! ∂force_rate/∂p = −divergence_rateᵀ      ∂defect_rate/∂v = B(u)    ∂defect_rate/∂u = divergence_rate
//! ```
//!
//! so five blocks serve all formulations. References: paper, section 2.

mod added;
pub(crate) mod crew;
mod evaluation;
mod graded;
pub(crate) mod kind;
mod relaxation;
mod shared;
#[cfg(test)]
mod tests;
mod threads;

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use pulp::{Arch, WithSimd};
use rayon::ThreadPool;

use crate::element::quadrature::Rule;
use crate::error::FemError;
use crate::material::fibres::Fibres;
use crate::material::three::Axes;
use crate::material::{Law, Prony, Range};
use crate::operators::added::AddedStress;
pub use crate::operators::fields::{
    Change, Fields, Inverted, Linearized, Pressure, Tangents, Vectors,
};
use crate::operators::mass::Symmetric;
use crate::operators::relaxation::InternalStresses;
use crate::simd::batch::Batches;
use crate::solid::kind::{Kind, Ratios};
use crate::space::dofs::DofMap;
use crate::space::sparsity::{ScatterMap, displacement_pattern, divergence_pattern, place};
use crate::space::{Degree, Located, Space};

use graded::Graded;
use shared::Shared;

/// Batches by dimension and number of nodes and pressures of an element.
#[derive(Debug, Clone)]
#[cfg_attr(test, allow(dead_code))] // see `with_elements`
enum Elements {
    LinearTriangles(Mapped<2, 3, 3>),
    QuadraticTriangles(Mapped<2, 6, 3>),
    LinearTetrahedra(Mapped<3, 4, 4>),
    QuadraticTetrahedra(Mapped<3, 10, 4>),
}

/// Evaluates an expression with `$mapped` bound to the batches of whatever elements.
///
/// Bodies in space are tested from outside this crate. Its unit tests leave them out: the loops take
/// minutes to compile, and would be compiled a second time.
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
        kinds: &[Kind],
        rule: Rule,
        dofs: &DofMap,
        patterns: [&SparsityPattern; 2],
    ) -> Self {
        match (space.dimension(), space.degree()) {
            (2, Degree::One) => {
                Self::LinearTriangles(Mapped::new(space, kinds, rule, dofs, patterns))
            }
            (2, Degree::Two) => {
                Self::QuadraticTriangles(Mapped::new(space, kinds, rule, dofs, patterns))
            }
            (_, Degree::One) => {
                Self::LinearTetrahedra(Mapped::new(space, kinds, rule, dofs, patterns))
            }
            (_, Degree::Two) => {
                Self::QuadraticTetrahedra(Mapped::new(space, kinds, rule, dofs, patterns))
            }
        }
    }
}

/// Batches and where their matrices go.
#[derive(Debug, Clone)]
struct Mapped<const D: usize, const N: usize, const P: usize> {
    batches: Batches<D, N, P>,
    maps: Vec<ScatterMap<D, N, P>>,
}

impl<const D: usize, const N: usize, const P: usize> Mapped<D, N, P> {
    fn new(
        space: &Space,
        kinds: &[Kind],
        rule: Rule,
        dofs: &DofMap,
        [displacement, divergence]: [&SparsityPattern; 2],
    ) -> Self {
        let batches = Batches::new(space, kinds, rule);
        let maps = batches.batches.iter();
        Self {
            maps: maps
                .map(|batch| ScatterMap::new(batch, dofs, displacement, divergence))
                .collect(),
            batches,
        }
    }
}

impl<const N: usize, const P: usize> Mapped<2, N, P> {
    /// Runs the loop of the vectors with all of the processor's vector instructions: in the plane
    /// AVX-512 saves a tenth of it.
    fn evaluate<Op: WithSimd>(&self, arch: Arch, op: Op) -> Op::Output {
        arch.dispatch(op)
    }
}

impl<const N: usize, const P: usize> Mapped<3, N, P> {
    /// Runs the loop of the vectors.
    #[cfg_attr(test, allow(dead_code))] // see `with_elements`
    fn evaluate<Op: WithSimd>(&self, arch: Arch, op: Op) -> Op::Output {
        narrow(arch, op)
    }
}

/// Runs an element loop with vector instructions, those of AVX-512 left out: where much is worked
/// on at a point, or loops are rare, they save nothing, and would be a third of the code.
fn narrow<Op: WithSimd>(arch: Arch, op: Op) -> Op::Output {
    #[cfg(target_arch = "x86_64")]
    match arch {
        Arch::V4(wide) => pulp::Simd::vectorize(*wide, op),
        Arch::V3(simd) => pulp::Simd::vectorize(simd, op),
        _ => pulp::Simd::vectorize(pulp::Scalar::new(), op),
    }
    #[cfg(not(target_arch = "x86_64"))]
    arch.dispatch(op)
}

/// A solid in space, or in plane strain and per unit thickness: spaces, fixed nodes, material,
/// density.
///
/// # Units
/// SI: force vectors in N, masses in kg; in plane strain in N/m, kg/m.
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
/// // A tenth more length and width: the volume grows by 21 %.
/// let u: Vec<f64> = solid.space().coordinates().iter().map(|x| 0.1 * x).collect();
/// let mut defect = vec![0.0; solid.space().n_pressures()];
/// solid.evaluate(
///     &Fields::new(&u, Pressure::Penalty { kappa: 1e5 }),
///     &mut Vectors { defect: Some(&mut defect), ..Default::default() },
/// )?;
/// assert!((defect.iter().sum::<f64>() - 0.21).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solid {
    space: Arc<Space>,
    dofs: DofMap,
    laws: Vec<Law>,
    rule: Rule,
    elements: Elements,
    fibres: Option<Fibres>,
    /// The stresses that are added to the laws'.
    added: Vec<AddedStress>,
    /// The same without viscosity.
    active: Vec<AddedStress>,
    /// The Prony terms of elements whose stress relaxes, and where their internal stresses lie.
    prony: Vec<Prony>,
    internal: InternalStresses,
    /// Law, added stress and constants of each element.
    kinds: Vec<Kind>,
    densities: Vec<f64>,
    displacement_pattern: SparsityPattern,
    divergence_pattern: SparsityPattern,
    mass: Symmetric,
    pressure_mass: Symmetric,
    /// What constants that differ between elements make of the matrices.
    graded: Option<Graded>,
    pressure_weights: Vec<f64>,
    /// The share of the elements that passes go over, and who computes the others.
    shared: Option<Box<Shared>>,
    /// In which passes run if the body is large.
    threads: Option<Arc<ThreadPool>>,
    /// The vector instructions this processor has; all give the same bits.
    arch: Arch,
}

impl Solid {
    /// A solid with a law for each element.
    ///
    /// # Errors
    /// [`FemError::Count`] if the numbers do not match, [`FemError::Parameter`] for a density that
    /// is not positive.
    pub fn new(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        density: f64,
    ) -> Result<Self, FemError> {
        Self::with_rule(space, dofs, laws, density, Rule::default())
    }

    /// A solid of one law.
    ///
    /// # Errors
    /// As for [`new`](Solid::new).
    pub fn uniform(
        space: Arc<Space>,
        dofs: DofMap,
        law: Law,
        density: f64,
    ) -> Result<Self, FemError> {
        let laws = vec![law; space.n_elements()];
        Self::new(space, dofs, laws, density)
    }

    /// A solid whose force and volume terms use another quadrature rule than the one of degree 4.
    ///
    /// # Errors
    /// As for [`new`](Solid::new).
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

    /// A solid with a law and a density for each element.
    ///
    /// # Errors
    /// As for [`new`](Solid::new).
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
        check_count(
            "densities, one per element",
            densities.len(),
            space.n_elements(),
        )?;
        check_count(
            "components in the dof map",
            dofs.n_full(),
            space.n_components(),
        )?;
        for &density in densities {
            Range::Positive.check("density", density)?;
        }
        let displacement_pattern = displacement_pattern(&space, &dofs);
        let divergence_pattern = divergence_pattern(&space, &dofs);
        let patterns = [&displacement_pattern, &divergence_pattern];
        let kind = |&law: &Law| Kind {
            law,
            added: None,
            relaxing: None,
            ratios: Ratios::ONE,
        };
        let kinds: Vec<Kind> = laws.iter().map(kind).collect();
        let elements = Elements::new(&space, &kinds, rule, &dofs, patterns);
        let pressure_mass = Symmetric::pressure_mass(&space, |_| 1.0);
        Ok(Self {
            mass: Symmetric::node_mass(&space, densities),
            pressure_weights: pressure_mass.row_sums(),
            pressure_mass,
            space,
            dofs,
            laws,
            rule,
            elements,
            fibres: None,
            added: Vec::new(),
            active: Vec::new(),
            prony: Vec::new(),
            internal: InternalStresses::default(),
            kinds,
            densities: densities.to_vec(),
            graded: None,
            displacement_pattern,
            divergence_pattern,
            shared: None,
            threads: None,
            arch: Arch::new(),
        })
    }

    /// The solid with its fibres; without, they run along x and their sheets along y.
    #[must_use]
    pub fn with_fibres(mut self, fibres: Fibres) -> Self {
        let added = &self.added;
        let is_active = |stress: usize| added[stress].active.is_some();
        with_elements!(&mut self.elements, mapped => mapped.batches.set_fibres(&fibres, is_active));
        self.fibres = Some(fibres);
        self
    }

    /// The axes of the fibres at a place.
    pub fn axes_at(&self, at: &Located) -> Axes<f64> {
        self.fibres.as_ref().map_or(Axes::cartesian(0.0), |fibres| {
            fibres.axes(at.element, &at.barycentric)
        })
    }

    /// The spaces.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// The free components.
    pub fn dofs(&self) -> &DofMap {
        &self.dofs
    }

    /// The law of each element.
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// The quadrature rule of force and volume terms.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// Whether all operators are linear in the fields.
    pub fn is_linear(&self) -> bool {
        self.laws.iter().all(|law| law.is_linear())
    }

    /// Pattern of tangents by displacement: n_free × n_free, columns major.
    pub fn displacement_pattern(&self) -> &SparsityPattern {
        &self.displacement_pattern
    }

    /// Pattern of B: n_pressures × n_free, columns major.
    pub fn divergence_pattern(&self) -> &SparsityPattern {
        &self.divergence_pattern
    }

    /// Pattern of the pressure's mass matrix: n_pressures × n_pressures.
    pub fn pressure_pattern(&self) -> &SparsityPattern {
        &self.pressure_mass.pattern
    }

    /// ρ ∫ φ_i φ_j between free components, in the displacement pattern.
    pub fn mass_values(&self) -> Vec<f64> {
        self.on_free_components(&self.mass)
    }

    /// ∫ ∇φ_i : ∇φ_j between free components, in the displacement pattern: the square of the H1
    /// seminorm, in which inf–sup constants are measured. Paper: eq. (27).
    pub fn gradient_values(&self) -> Vec<f64> {
        self.on_free_components(&Symmetric::node_gradients(&self.space))
    }

    /// A nodal matrix on each component.
    fn on_free_components(&self, nodal: &Symmetric) -> Vec<f64> {
        let pattern = &self.displacement_pattern;
        let mut values = vec![0.0; pattern.nnz()];
        let free_to_full = self.dofs.free_to_full();
        let dimension = self.space.dimension();
        for (column, row) in pattern
            .major_offsets()
            .windows(2)
            .enumerate()
            .flat_map(|(c, w)| {
                pattern.minor_indices()[w[0]..w[1]]
                    .iter()
                    .map(move |&row| (c, row))
            })
        {
            let (a, b) = (free_to_full[row], free_to_full[column]);
            if a % dimension == b % dimension {
                let value = nodal.values[place(&nodal.pattern, a / dimension, b / dimension)];
                values[place(pattern, row, column)] = value;
            }
        }
        values
    }

    /// ∫ ψ_k ψ_l in the pressure pattern.
    pub fn pressure_mass_values(&self) -> &[f64] {
        &self.pressure_mass.values
    }

    /// out = M a over all nodes, rows and columns of constrained components included.
    ///
    /// # Panics
    /// If a length is not `n_components`.
    pub fn apply_mass(&self, a: &[f64], out: &mut [f64]) {
        self.mass.apply_interleaved(self.space.dimension(), a, out);
    }

    /// out = M_p p.
    ///
    /// # Panics
    /// If a length is not `n_pressures`.
    pub fn apply_pressure_mass(&self, p: &[f64], out: &mut [f64]) {
        self.pressure_mass.apply(p, out);
    }

    /// ∫ ψ_k, by which projected defects are measured.
    pub fn pressure_weights(&self) -> &[f64] {
        &self.pressure_weights
    }

    /// Volume at rest, m³; in plane strain per unit thickness, m².
    pub fn volume(&self) -> f64 {
        self.space.measure()
    }
}

fn check_count(what: &'static str, found: usize, needed: usize) -> Result<(), FemError> {
    if found == needed {
        Ok(())
    } else {
        Err(FemError::Count {
            what,
            found,
            needed,
        })
    }
}
