//! Operators of a body as sparse matrices that act on its free displacement components and its pressures.

use myovib_fem::{Fields, Inverted, Pressure, Solid, Space, Tangents};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

/// Returns the mass matrix M.
pub(crate) fn mass(solid: &Solid) -> CscMatrix<f64> {
    matrix(solid.displacement_pattern(), solid.mass_values())
}

/// Returns ∫ ∇φ_i : ∇φ_j, the Gram matrix of the H1 seminorm.
pub(crate) fn gradients(solid: &Solid) -> CscMatrix<f64> {
    matrix(solid.displacement_pattern(), solid.gradient_values())
}

/// Returns M_p, the Gram matrix of the pressures' L2 norm.
pub(crate) fn pressure_mass(solid: &Solid) -> CscMatrix<f64> {
    let values = solid.pressure_mass_values().to_vec();
    matrix(solid.pressure_pattern(), values)
}

/// Returns ∫ψψ κ_body/κ, which is M_p if κ is uniform.
pub(crate) fn compliance(solid: &Solid) -> CscMatrix<f64> {
    matrix(solid.pressure_pattern(), solid.compliance_values().to_vec())
}

/// Returns B at the displacement `u` of all nodes.
pub(crate) fn divergence(solid: &Solid, u: &[f64]) -> Result<CscMatrix<f64>, Inverted> {
    let mut values = vec![0.0; solid.divergence_pattern().nnz()];
    let wanted = Tangents { divergence: Some(&mut values), ..Tangents::default() };
    tangents(solid, u, &no_pressure(solid), wanted)?;
    Ok(matrix(solid.divergence_pattern(), values))
}

/// Returns ∂/∂u ∫ P : ∇φ at the displacement `u` of all nodes and the pressure `p`.
pub(crate) fn stiffness(solid: &Solid, u: &[f64], p: &[f64]) -> Result<CscMatrix<f64>, Inverted> {
    let mut values = vec![0.0; solid.displacement_pattern().nnz()];
    let wanted = Tangents { stiffness: Some(&mut values), ..Tangents::default() };
    tangents(solid, u, p, wanted)?;
    Ok(matrix(solid.displacement_pattern(), values))
}

/// Returns zero displacements for all nodes.
pub(crate) fn rest(solid: &Solid) -> Vec<f64> {
    vec![0.0; solid.dofs().n_full()]
}

pub(crate) fn no_pressure(solid: &Solid) -> Vec<f64> {
    vec![0.0; solid.space().n_pressures()]
}

/// Returns a measure of the gradient of a displacement `u` of all nodes: the maximum over all element edges of the
/// difference between the displacements of the two vertices, divided by the edge length.
pub(crate) fn largest_gradient(space: &Space, u: &[f64]) -> f64 {
    let (mesh, dimension) = (space.mesh(), space.dimension());
    let distance = |values: &[f64], [a, b]: [usize; 2]| {
        let of = |node: usize| &values[dimension * node..][..dimension];
        let squares = of(a).iter().zip(of(b)).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let edges = mesh.elements().flat_map(|element| mesh.edges_of(element));
    edges.map(|edge| distance(u, edge) / distance(space.coordinates(), edge)).fold(0.0, f64::max)
}

/// Returns the edge length (m) of a square or cube whose area or volume is the mean over all elements.
pub(crate) fn element_size(solid: &Solid) -> f64 {
    let mean = solid.volume() / solid.space().n_elements() as f64;
    match solid.space().dimension() {
        2 => mean.sqrt(),
        _ => mean.cbrt(),
    }
}

fn tangents(solid: &Solid, u: &[f64], p: &[f64], mut wanted: Tangents<'_>) -> Result<(), Inverted> {
    solid.tangents(&Fields::new(u, Pressure::Nodal(p)), &mut wanted)
}

pub(crate) fn matrix(pattern: &SparsityPattern, values: Vec<f64>) -> CscMatrix<f64> {
    CscMatrix::try_from_pattern_and_values(pattern.clone(), values).expect("values of the pattern")
}
