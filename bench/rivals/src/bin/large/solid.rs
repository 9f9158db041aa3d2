//! Newton matrices of incompressible solids: P2–P1 tetrahedra on a grid of cubes, small strain.
//!
//! ( c² M + K  −Bᵀ )   K = ∫ 2μ ε(φ_i):ε(φ_j), M = ∫ ρ φ_i·φ_j, B = ∫ ψ_i div φ_j,
//! ( −B         0  )   clamped at z = 0.

use myovib_sparse::Scalar;
use nalgebra_sparse::pattern::SparsityPattern;

/// Shear modulus of the paper's muscle in SI units.
const MU: f64 = 2.04e4;
const RHO: f64 = 1.06e3;
/// Edge length of a cube, m.
const H: f64 = 2e-3;

/// The six tetrahedra of a cube, which share one diagonal of the cube. The edges of each tetrahedron form a path from
/// one end of the diagonal to the other, which is given by the order of the axes along the path.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// Edges of a tetrahedron, whose midpoints are nodes.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
/// Barycentric coordinates of the points of the quadrature rule of degree 2.
const POINT: [f64; 2] = [0.585_410_196_624_968_5, 0.138_196_601_125_010_5];

/// Mass and stiffness parts of a Newton matrix, with a common pattern.
pub struct Solid {
    pub pattern: SparsityPattern,
    pub mass: Vec<f64>,
    /// K, −B and −Bᵀ.
    pub stiffness: Vec<f64>,
}

impl Solid {
    /// Creates a block of cubes.
    pub fn block(cubes: [usize; 3]) -> Self {
        let nodes = cubes.map(|n| 2 * n + 1);
        let vertices = cubes.map(|n| n + 1);
        let node = |p: [usize; 3]| p[0] + nodes[0] * (p[1] + nodes[1] * p[2]);
        let n_clamped = nodes[0] * nodes[1];
        let n_q = 3 * (nodes.iter().product::<usize>() - n_clamped);
        let n = n_q + vertices.iter().product::<usize>();
        let mut elements = Vec::new();
        for z in 0..cubes[2] {
            for y in 0..cubes[1] {
                for x in 0..cubes[0] {
                    for path in PATHS {
                        let mut corner = [2 * x, 2 * y, 2 * z];
                        let corners: [[usize; 3]; 4] = std::array::from_fn(|i| {
                            if i > 0 {
                                corner[path[i - 1]] += 2;
                            }
                            corner
                        });
                        elements.push(corners);
                    }
                }
            }
        }
        let unknowns = |corners: &[[usize; 3]; 4]| -> [Option<usize>; 34] {
            std::array::from_fn(|i| {
                if i >= 30 {
                    let v = corners[i - 30].map(|p| p / 2);
                    return Some(n_q + v[0] + vertices[0] * (v[1] + vertices[1] * v[2]));
                }
                let at = match i / 3 {
                    v @ 0..4 => corners[v],
                    e => {
                        let [a, b] = EDGES[e - 4].map(|v| corners[v]);
                        std::array::from_fn(|d| (a[d] + b[d]) / 2)
                    }
                };
                node(at).checked_sub(n_clamped).map(|k| 3 * k + i % 3)
            })
        };
        let mut lanes: Vec<Vec<u32>> = vec![Vec::new(); n];
        for corners in &elements {
            let own = unknowns(corners);
            for (j, column) in own.iter().enumerate() {
                let Some(column) = *column else { continue };
                let rows = own.iter().enumerate().filter(|(i, _)| *i < 30 || j < 30);
                lanes[column].extend(rows.filter_map(|(_, row)| row.map(|row| row as u32)));
            }
            for column in own.into_iter().flatten() {
                if lanes[column].len() > 1000 {
                    lanes[column].sort_unstable();
                    lanes[column].dedup();
                }
            }
        }
        let mut offsets = vec![0];
        let mut indices = Vec::new();
        for lane in &mut lanes {
            lane.sort_unstable();
            lane.dedup();
            indices.extend(lane.iter().map(|&row| row as usize));
            offsets.push(indices.len());
            *lane = Vec::new();
        }
        let pattern = SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices);
        let pattern = pattern.expect("lanes are sorted");
        let (mut mass, mut stiffness) = (vec![0.0; pattern.nnz()], vec![0.0; pattern.nnz()]);
        for corners in &elements {
            let local = Local::new(corners);
            let own = unknowns(corners);
            for (j, column) in own.iter().enumerate() {
                let Some(column) = *column else { continue };
                let (start, lane) = (pattern.major_offsets()[column], pattern.lane(column));
                for (i, row) in own.iter().enumerate().filter(|(i, _)| *i < 30 || j < 30) {
                    let Some(row) = *row else { continue };
                    let at = start + lane.binary_search(&row).expect("entered above");
                    stiffness[at] += local.stiffness(i, j);
                    mass[at] += local.mass(i, j);
                }
            }
        }
        Self { pattern, mass, stiffness }
    }

    /// Returns the values of c² M + K, including the rows and columns of the constraint.
    pub fn values<T: Scalar>(&self, c: T) -> Vec<T> {
        let parts = self.mass.iter().zip(&self.stiffness);
        parts.map(|(&m, &k)| c * c * m + T::one() * k).collect()
    }
}

/// Integrals over one tetrahedron.
struct Local {
    volume: f64,
    /// Gradients ∇φ_i at the four quadrature points.
    gradients: [[[f64; 3]; 10]; 4],
    /// Integrals ∫ φ_i φ_j.
    products: [[f64; 10]; 10],
}

impl Local {
    fn new(corners: &[[usize; 3]; 4]) -> Self {
        let at = corners.map(|c| c.map(|k| 0.5 * H * k as f64));
        let edge = |i: usize| -> [f64; 3] { std::array::from_fn(|d| at[i][d] - at[0][d]) };
        let [a, b, c] = [edge(1), edge(2), edge(3)];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let det = dot(a, cross(b, c));
        let [g1, g2, g3] = [cross(b, c), cross(c, a), cross(a, b)].map(|g| g.map(|x| x / det));
        let g0 = std::array::from_fn(|d| -g1[d] - g2[d] - g3[d]);
        let of_coordinates = [g0, g1, g2, g3];
        let gradients = std::array::from_fn(|p| {
            let l: [f64; 4] = std::array::from_fn(|i| POINT[usize::from(i != p)]);
            std::array::from_fn(|i| match i {
                0..4 => of_coordinates[i].map(|g| (4.0 * l[i] - 1.0) * g),
                _ => {
                    let [u, v] = EDGES[i - 4];
                    let (gu, gv) = (of_coordinates[u], of_coordinates[v]);
                    std::array::from_fn(|d| 4.0 * (l[u] * gv[d] + l[v] * gu[d]))
                }
            })
        });
        let volume = det.abs() / 6.0;
        // Each φ is a sum of monomials of degree 2 in barycentric coordinates, each multiplied by a coefficient.
        let monomials = |i: usize| -> Vec<(f64, [usize; 2])> {
            match i {
                0..4 => (0..4).map(|k| (if k == i { 1.0 } else { -1.0 }, [i, k])).collect(),
                _ => vec![(4.0, EDGES[i - 4])],
            }
        };
        let factorial = [1.0, 1.0, 2.0, 6.0, 24.0];
        let products = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let mut sum = 0.0;
                for (a, [p, q]) in monomials(i) {
                    for (b, [r, s]) in monomials(j) {
                        let mut powers = [0; 4];
                        [p, q, r, s].into_iter().for_each(|k| powers[k] += 1);
                        let top: f64 = powers.iter().map(|&k: &usize| factorial[k]).product();
                        // The integral of a monomial is 3! V Π a_k! / (4 + 3)!.
                        sum += a * b * 6.0 * volume * top / 5040.0;
                    }
                }
                sum
            })
        });
        Self { volume, gradients, products }
    }

    fn mass(&self, i: usize, j: usize) -> f64 {
        match i < 30 && j < 30 && i % 3 == j % 3 {
            true => RHO * self.products[i / 3][j / 3],
            false => 0.0,
        }
    }

    fn stiffness(&self, i: usize, j: usize) -> f64 {
        let at_points =
            |value: &dyn Fn(usize) -> f64| 0.25 * self.volume * (0..4).map(value).sum::<f64>();
        match (i < 30, j < 30) {
            (true, true) => at_points(&|p| {
                let (g, h) = (self.gradients[p][i / 3], self.gradients[p][j / 3]);
                let (a, b) = (i % 3, j % 3);
                let inner = if a == b { g[0] * h[0] + g[1] * h[1] + g[2] * h[2] } else { 0.0 };
                MU * (inner + g[b] * h[a])
            }),
            (true, false) => {
                at_points(&|p| -POINT[usize::from(j - 30 != p)] * self.gradients[p][i / 3][i % 3])
            }
            (false, true) => self.stiffness(j, i),
            (false, false) => 0.0,
        }
    }
}
