//! The operators of a solid: forces, volume defects, their rates and tangents, masses.
//!
//! Cast: [`Solid`] owns the spaces, laws and maps; [`Fields`] is what operators are evaluated at;
//! [`Vectors`] and [`Tangents`] say which are wanted and where they go. The tangents are related by
//!
//! ```text
//! ∂force/∂p = −B(u)ᵀ              ∂force_rate/∂v = stiffness     ∂force_rate/∂ṗ = −B(u)ᵀ
//! ∂force_rate/∂p = −divergence_rateᵀ      ∂defect_rate/∂v = B(u)    ∂defect_rate/∂u = divergence_rate
//! ```
//!
//! so five blocks serve all formulations. References: MODEL, section 2.

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use pulp::Arch;

use crate::batch::Batches;
use crate::dofs::DofMap;
use crate::error::FemError;
pub use crate::fields::{Fields, Inverted, Pressure, Tangents, Vectors};
use crate::mass::Symmetric;
use crate::material::Law;
use crate::quadrature::TriangleRule;
use crate::residual::Evaluate;
use crate::space::{Degree, Space};
use crate::sparsity::{ScatterMap, displacement_pattern, divergence_pattern, place};
use crate::tangent::Linearize;

/// Batches by the number of displacement nodes of an element.
#[derive(Debug, Clone)]
enum Elements {
    Linear(Batches<3>, Vec<ScatterMap<3>>),
    Quadratic(Batches<6>, Vec<ScatterMap<6>>),
}

/// A solid in plane strain, per unit thickness: spaces, fixed nodes, material, density.
///
/// # Units
/// SI: force vectors in N/m, masses in kg/m.
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
/// let u: Vec<f64> = solid.space().node_points().iter().flatten().map(|x| 0.1 * x).collect();
/// let mut defect = vec![0.0; solid.space().n_vertices()];
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
    rule: TriangleRule,
    elements: Elements,
    displacement_pattern: SparsityPattern,
    divergence_pattern: SparsityPattern,
    mass: Symmetric,
    pressure_mass: Symmetric,
    pressure_weights: Vec<f64>,
    /// The vector instructions this processor has; all give the same bits.
    arch: Arch,
}

impl Solid {
    /// A solid with a law for each triangle.
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
        Self::with_rule(space, dofs, laws, density, TriangleRule::default())
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
        rule: TriangleRule,
    ) -> Result<Self, FemError> {
        let densities = vec![density; space.n_elements()];
        Self::build(space, dofs, laws, &densities, rule)
    }

    /// A solid with a law and a density for each triangle.
    ///
    /// # Errors
    /// As for [`new`](Solid::new).
    pub fn with_densities(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        densities: &[f64],
    ) -> Result<Self, FemError> {
        Self::build(space, dofs, laws, densities, TriangleRule::default())
    }

    fn build(
        space: Arc<Space>,
        dofs: DofMap,
        laws: Vec<Law>,
        densities: &[f64],
        rule: TriangleRule,
    ) -> Result<Self, FemError> {
        check_count("laws, one per triangle", laws.len(), space.n_elements())?;
        check_count(
            "densities, one per triangle",
            densities.len(),
            space.n_elements(),
        )?;
        check_count(
            "components in the dof map",
            dofs.n_full(),
            2 * space.n_nodes(),
        )?;
        let unfit = |density: &&f64| !(**density > 0.0 && density.is_finite());
        if let Some(&value) = densities.iter().find(unfit) {
            let (name, condition) = ("density", "positive and finite");
            return Err(FemError::Parameter {
                name,
                value,
                condition,
            });
        }
        let displacement_pattern = displacement_pattern(&space, &dofs);
        let divergence_pattern = divergence_pattern(&space, &dofs);
        let elements = match space.degree() {
            Degree::One => {
                let batches = Batches::linear(&space, &laws, rule);
                let maps = maps(&batches, &dofs, &displacement_pattern, &divergence_pattern);
                Elements::Linear(batches, maps)
            }
            Degree::Two => {
                let batches = Batches::quadratic(&space, &laws, rule);
                let maps = maps(&batches, &dofs, &displacement_pattern, &divergence_pattern);
                Elements::Quadratic(batches, maps)
            }
        };
        let pressure_mass = Symmetric::pressure_mass(&space);
        Ok(Self {
            mass: Symmetric::node_mass(&space, densities),
            pressure_weights: pressure_mass.row_sums(),
            pressure_mass,
            space,
            dofs,
            laws,
            rule,
            elements,
            displacement_pattern,
            divergence_pattern,
            arch: Arch::new(),
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

    /// The law of each triangle.
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// The quadrature rule of force and volume terms.
    pub fn rule(&self) -> TriangleRule {
        self.rule
    }

    /// Whether all operators are linear in the fields.
    pub fn is_linear(&self) -> bool {
        self.laws.iter().all(|law| law.is_linear())
    }

    /// The vectors asked for, all in one pass over the elements.
    ///
    /// # Errors
    /// [`Inverted`] where det F ≤ 0 or is not a number; the vectors then hold nothing of use.
    ///
    /// # Panics
    /// If a length is wrong, or a rate is wanted without `v`.
    pub fn evaluate(&self, fields: &Fields<'_>, out: &mut Vectors<'_>) -> Result<(), Inverted> {
        self.check_fields(fields);
        let (n, m) = (2 * self.space.n_nodes(), self.space.n_vertices());
        check_length(n, out.force.as_deref(), "force");
        check_length(n, out.force_rate.as_deref(), "force_rate");
        check_length(n, out.multiplier_force.as_deref(), "multiplier_force");
        check_length(m, out.defect.as_deref(), "defect");
        check_length(m, out.defect_rate.as_deref(), "defect_rate");
        let rates = out.force_rate.is_some() || out.defect_rate.is_some();
        assert!(fields.v.is_some() || !rates, "rates need a velocity");
        match &self.elements {
            Elements::Linear(elements, _) => self.arch.dispatch(Evaluate {
                elements,
                fields,
                out,
            }),
            Elements::Quadratic(elements, _) => self.arch.dispatch(Evaluate {
                elements,
                fields,
                out,
            }),
        }
    }

    /// The tangents asked for, all in one pass over the elements.
    ///
    /// # Errors
    /// [`Inverted`] where det F ≤ 0 or is not a number; the values then hold nothing of use.
    ///
    /// # Panics
    /// If a length is wrong, or a rate is wanted without `v`.
    pub fn tangents(&self, fields: &Fields<'_>, out: &mut Tangents<'_>) -> Result<(), Inverted> {
        self.check_fields(fields);
        let (n, m) = (
            self.displacement_pattern.nnz(),
            self.divergence_pattern.nnz(),
        );
        check_length(n, out.stiffness.as_deref(), "stiffness");
        check_length(n, out.rate_stiffness.as_deref(), "rate_stiffness");
        check_length(
            n,
            out.multiplier_stiffness.as_deref(),
            "multiplier_stiffness",
        );
        check_length(m, out.divergence.as_deref(), "divergence");
        check_length(m, out.divergence_rate.as_deref(), "divergence_rate");
        let rates = out.rate_stiffness.is_some() || out.divergence_rate.is_some();
        assert!(fields.v.is_some() || !rates, "rates need a velocity");
        match &self.elements {
            Elements::Linear(elements, maps) => self.arch.dispatch(Linearize {
                elements,
                maps,
                fields,
                out,
            }),
            Elements::Quadratic(elements, maps) => self.arch.dispatch(Linearize {
                elements,
                maps,
                fields,
                out,
            }),
        }
    }

    fn check_fields(&self, fields: &Fields<'_>) {
        let (n, m) = (2 * self.space.n_nodes(), self.space.n_vertices());
        check_length(n, Some(fields.u), "u");
        check_length(n, fields.v, "v");
        check_length(m, fields.p_rate, "p_rate");
        check_length(m, fields.mu, "mu");
        if let Some(factors) = fields.factors {
            assert_eq!(factors.len(), self.space.n_elements(), "factors");
        }
        if let Pressure::Nodal(p) = fields.pressure {
            check_length(m, Some(p), "p");
        }
    }

    /// Pattern of tangents by displacement: n_free × n_free, columns major.
    pub fn displacement_pattern(&self) -> &SparsityPattern {
        &self.displacement_pattern
    }

    /// Pattern of B: n_vertices × n_free, columns major.
    pub fn divergence_pattern(&self) -> &SparsityPattern {
        &self.divergence_pattern
    }

    /// Pattern of the pressure's mass matrix: n_vertices × n_vertices.
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

    /// A nodal matrix on either component.
    fn on_free_components(&self, nodal: &Symmetric) -> Vec<f64> {
        let pattern = &self.displacement_pattern;
        let mut values = vec![0.0; pattern.nnz()];
        let free_to_full = self.dofs.free_to_full();
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
            if a % 2 == b % 2 {
                let value = nodal.values[place(&nodal.pattern, a / 2, b / 2)];
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
    /// If a length is not `2 n_nodes`.
    pub fn apply_mass(&self, a: &[f64], out: &mut [f64]) {
        self.mass.apply_interleaved(a, out);
    }

    /// out = M_p p.
    ///
    /// # Panics
    /// If a length is not `n_vertices`.
    pub fn apply_pressure_mass(&self, p: &[f64], out: &mut [f64]) {
        self.pressure_mass.apply(p, out);
    }

    /// ∫ ψ_k, by which projected defects are measured.
    pub fn pressure_weights(&self) -> &[f64] {
        &self.pressure_weights
    }

    /// Volume at rest per unit thickness, m².
    pub fn volume(&self) -> f64 {
        self.space.mesh().area()
    }
}

fn maps<const N: usize>(
    batches: &Batches<N>,
    dofs: &DofMap,
    displacement: &SparsityPattern,
    divergence: &SparsityPattern,
) -> Vec<ScatterMap<N>> {
    batches
        .batches
        .iter()
        .map(|batch| ScatterMap::new(batch, dofs, displacement, divergence))
        .collect()
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

fn check_length(n: usize, slice: Option<&[f64]>, name: &str) {
    if let Some(slice) = slice {
        assert_eq!(slice.len(), n, "length of {name}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The instruction sets that this processor has, the widest last.
    fn instruction_sets() -> Vec<Arch> {
        let mut sets = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
        sets.push(Arch::new());
        sets
    }

    fn wave(n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|i| size * (i as f64).sin()).collect()
    }

    /// Every vector and every tangent.
    fn everything(solid: &Solid, fields: &Fields<'_>) -> Result<[Vec<f64>; 10], Inverted> {
        let (n, m) = (fields.u.len(), solid.space.n_vertices());
        let (nnz, nnz_divergence) = (
            solid.displacement_pattern.nnz(),
            solid.divergence_pattern.nnz(),
        );
        let lengths = [n, n, n, m, m, nnz, nnz, nnz, nnz_divergence, nnz_divergence];
        let mut all = lengths.map(|n| vec![f64::NAN; n]);
        let [a, b, c, d, e, f, g, h, i, j] = &mut all;
        let mut vectors = Vectors {
            force: Some(a),
            force_rate: Some(b),
            multiplier_force: Some(c),
            defect: Some(d),
            defect_rate: Some(e),
        };
        solid.evaluate(fields, &mut vectors)?;
        let mut tangents = Tangents {
            stiffness: Some(f),
            rate_stiffness: Some(g),
            multiplier_stiffness: Some(h),
            divergence: Some(i),
            divergence_rate: Some(j),
        };
        solid.tangents(fields, &mut tangents)?;
        Ok(all)
    }

    #[test]
    fn vector_instructions_change_no_bit() {
        // 8 elements fill a batch; the last batch is not full.
        let mesh = crate::generate::spindle([10, 2]).unwrap();
        let space = Arc::new(Space::taylor_hood(&mesh));
        let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
        let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
        let solid = Solid::uniform(space.clone(), dofs, law, 1.0).unwrap();
        let (n, m) = (2 * space.n_nodes(), space.n_vertices());
        let (u, v) = (wave(n, 1e-4), wave(n, 1e-2));
        let (p, p_rate, mu) = (wave(m, 50.0), wave(m, 70.0), wave(m, 90.0));
        let corner = |e: usize, k: usize| 1.0 + 0.5 * ((3 * e + k) as f64).cos();
        let factors: Vec<_> = (0..space.n_elements())
            .map(|e| [0, 1, 2].map(|k| corner(e, k)))
            .collect();
        let fields = Fields {
            v: Some(&v),
            p_rate: Some(&p_rate),
            mu: Some(&mu),
            factors: Some(&factors),
            ..Fields::new(&u, Pressure::Nodal(&p))
        };
        // The middle node of element 13's first edge, out on the other side of the element.
        let moved = space.element_nodes(13)[3];
        let mut inverted = u.clone();
        inverted[2 * moved] += 1.0;
        let inverted = Fields {
            u: &inverted,
            ..fields
        };
        let sets = instruction_sets().into_iter().map(|arch| Solid {
            arch,
            ..solid.clone()
        });
        let solids: Vec<_> = sets.collect();
        let scalar = everything(&solids[0], &fields).unwrap();
        assert!(scalar.iter().flatten().all(|x| x.is_finite()));
        for (k, solid) in solids.iter().enumerate() {
            assert_eq!(everything(solid, &fields).unwrap(), scalar, "set {k}");
            let error = everything(solid, &inverted).unwrap_err();
            let around = space.element_nodes(error.element);
            assert!(around.contains(&moved), "set {k}: {error}");
        }
    }
}
