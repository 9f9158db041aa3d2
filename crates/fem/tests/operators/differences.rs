//! Comparison of every tangent block of the solid with central differences of its vectors.

use std::collections::BTreeMap;

use crate::common::{MUSCLE_LAW, SMALL_LAW, clamped, dense, random};
use myovib_fem::material::{Law, VolumeFunction};
use myovib_fem::solid::{Change, Fields, Pressure, Solid, TangentProduct, Tangents, Vectors};
use myovib_fem::{Fibers, Space, generate};
use nalgebra::{DMatrix, DVector};

/// Step of the differences. Displacements are about 1 % of the element size, and the step is ε^(1/3) of the
/// displacements.
pub(crate) const STEP: f64 = 1e-7;

const GUCCIONE: Law = Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };
const ISOCHORIC_GUCCIONE: Law = Law::IsochoricGuccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };
const ST_VENANT_KIRCHHOFF: Law = Law::StVenantKirchhoff { lambda: 8e4, shear_modulus: 2e4 };
const DEVIATORIC: Law = Law::DeviatoricStVenantKirchhoff { shear_modulus: 2e4 };
/// Holzapfel–Ogden law with the constants of Aróstica et al. (2025).
pub(crate) const HEART: Law = Law::HolzapfelOgden {
    a: 59.0,
    b: 8.023,
    a_f: 18_472.0,
    b_f: 16.026,
    a_s: 2481.0,
    b_s: 11.12,
    a_fs: 216.0,
    b_fs: 11.436,
    k: 100.0,
    dispersion_f: 0.0,
    dispersion_s: 0.0,
};
/// Law whose fibers are straight at a stretch of 2 %. The strains of these tests cover all three branches of the
/// law.
const TENDON: Law = Law::TransverseMooneyRivlin {
    c10: 1e4,
    c01: 2e2,
    c3: 500.0,
    c4: 8.0,
    c5: 1.2e4,
    stretch_max: 1.02,
};

struct State {
    u: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    p_rate: Vec<f64>,
    mu: Vec<f64>,
    factors: Option<Vec<f64>>,
    kappa: Option<f64>,
}

/// Force, force rate and Bᵀμ (for free components), volume residual, and volume residual rate.
type All = [Vec<f64>; 5];

impl State {
    fn fields(&self) -> Fields<'_> {
        Fields {
            u: &self.u,
            pressure: match self.kappa {
                Some(kappa) => Pressure::Penalty { kappa },
                None => Pressure::Nodal(&self.p),
            },
            v: Some(&self.v),
            p_rate: Some(&self.p_rate),
            mu: Some(&self.mu),
            factors: self.factors.as_deref(),
        }
    }

    fn evaluate(&self, solid: &Solid) -> All {
        let (n, m) = (self.u.len(), self.p.len());
        let mut all = [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; m], vec![0.0; m]];
        let [force, force_rate, multiplier_force, volume_residual, volume_residual_rate] = &mut all;
        let mut vectors = Vectors {
            force: Some(force),
            force_rate: Some(force_rate),
            multiplier_force: Some(multiplier_force),
            volume_residual: Some(volume_residual),
            volume_residual_rate: Some(volume_residual_rate),
        };
        solid.evaluate(&self.fields(), &mut vectors).unwrap();
        for vector in &mut all[..3] {
            let mut free = vec![0.0; solid.dofs().n_free()];
            solid.dofs().restrict(vector, &mut free);
            *vector = free;
        }
        all
    }
}

/// Returns central differences of all vectors with respect to the field entry selected by `entry`.
fn slopes(
    solid: &Solid,
    state: &mut State,
    step: f64,
    entry: impl Fn(&mut State) -> &mut f64,
) -> All {
    let start = *entry(state);
    *entry(state) = start + step;
    let plus = state.evaluate(solid);
    *entry(state) = start - step;
    let minus = state.evaluate(solid);
    *entry(state) = start;
    std::array::from_fn(|k| {
        plus[k].iter().zip(&minus[k]).map(|(a, b)| (a - b) / (2.0 * step)).collect()
    })
}

fn check(what: &str, found: impl Iterator<Item = f64>, slope: &[f64], scale: f64) {
    for (a, b) in found.zip(slope) {
        // Differences lose two thirds of the digits. The limit 1e-7 leaves a margin for the conditioning.
        assert!((a - b).abs() <= 1e-7 * scale, "{what}: {a} {b} (scale {scale})");
    }
}

/// Compares products along two directions, computed at once, with products of the matrices.
fn check_products(
    solid: &Solid,
    state: &State,
    [k, k_rate]: [&DMatrix<f64>; 2],
    [b, b_rate]: [&DMatrix<f64>; 2],
) {
    let (n, m) = (state.u.len(), state.p.len());
    let dofs = solid.dofs();
    let (n_free, has_pressure) = (dofs.n_free(), state.kappa.is_none());
    for at in [(0.0, false), (0.3, false), (0.0, true), (0.3, true)] {
        let (beta, constraint_rate) = at;
        let directions = [10, 20].map(|seed| {
            let nodal = |seed| {
                let mut full = vec![0.0; n];
                dofs.expand(&random(n_free, 1.0, seed), &mut full);
                full
            };
            let [u, v] = [nodal(seed), nodal(seed + 1)];
            // Pressures are scaled such that all terms are of similar magnitude.
            let [p, p_rate] = [2, 3].map(|k| random(m, 1e3, seed + k));
            (u, v, p, p_rate)
        });
        let mut forces = [vec![f64::NAN; n], vec![f64::NAN; n]];
        let mut volume_residuals = [vec![f64::NAN; m], vec![f64::NAN; m]];
        let out = forces.iter_mut().zip(&mut volume_residuals);
        let mut changes: Vec<_> = out
            .zip(&directions)
            .map(|((force, volume_residual), (u, v, p, p_rate))| Change {
                u,
                v: Some(v),
                p: has_pressure.then_some(p),
                p_rate: has_pressure.then_some(p_rate),
                force,
                volume_residual: Some(volume_residual),
            })
            .collect();
        let linearized = TangentProduct { beta, constraint_rate };
        let fields = state.fields();
        solid.multiply(&fields, linearized, &mut changes).unwrap();
        for (((u, v, p, p_rate), force), volume_residual) in
            directions.iter().zip(&forces).zip(&volume_residuals)
        {
            let free = |full: &[f64]| {
                let mut free = DVector::zeros(n_free);
                dofs.restrict(full, free.as_mut_slice());
                free
            };
            let (u, v) = (free(u), free(v));
            let size = f64::from(u8::from(has_pressure));
            let [p, p_rate] = [p, p_rate].map(|p| size * DVector::from_column_slice(p));
            let expected = k * &u + beta * (k_rate * &u + k * &v)
                - b.tr_mul(&p)
                - beta * (b_rate.tr_mul(&p) + b.tr_mul(&p_rate));
            let constraint = match constraint_rate {
                true => b * &v + b_rate * &u,
                false => b * &u,
            };
            for (found, expected) in [
                (&free(force), &expected),
                (&DVector::from_column_slice(volume_residual), &constraint),
            ] {
                // The error is the rounding of sums of a few hundred products, which cancel by two or three
                // digits.
                let error = (found - expected).amax();
                let scale = expected.amax();
                assert!(error <= 1e-11 * scale, "{at:?}: {error:e} of {scale:e}");
            }
        }
    }
}

fn check_all(law: Law, space: Space, kappa: Option<f64>) {
    check_with(law, space, kappa, None, VolumeFunction::Quadratic);
}

/// Returns the solid with fibers oblique to the axes, if its law has fibers. In 2D, the sheet direction is
/// arbitrary.
pub(crate) fn with_oblique_fibers(solid: Solid) -> Solid {
    let mesh = solid.space().mesh();
    if !solid.laws()[0].has_fibers() {
        return solid;
    }
    let mut fibers = Fibers::new(mesh);
    let all: Vec<usize> = (0..mesh.n_elements()).collect();
    let (fiber, sheet) = match mesh.dimension() {
        2 => ([0.8, 0.6, 0.0], None),
        _ => ([2.0, 2.0, 1.0], Some([-2.0, 1.0, 2.0])),
    };
    fibers.set_constant(mesh, &all, fiber, sheet).unwrap();
    solid.with_fibers(fibers)
}

pub(crate) fn check_with(
    law: Law,
    space: Space,
    kappa: Option<f64>,
    factors: Option<Vec<f64>>,
    function: VolumeFunction,
) {
    let (n, m) = (space.n_components(), space.n_pressures());
    let mut solid = clamped(space, "left", law);
    solid = solid.with_volume_function(function).unwrap();
    solid = with_oblique_fibers(solid);
    let mut state = State {
        u: random(n, 0.02, 1),
        v: random(n, 1.0, 2),
        p: random(m, 3e3, 3),
        p_rate: random(m, 2e3, 4),
        mu: random(m, 5e3, 5),
        factors,
        kappa,
    };
    let nnz = solid.displacement_pattern().nnz();
    let mut k = [vec![0.0; nnz], vec![0.0; nnz], vec![0.0; nnz]];
    let mut b = [0, 1].map(|_| vec![0.0; solid.divergence_pattern().nnz()]);
    let [stiffness, rate_stiffness, multiplier_stiffness] = &mut k;
    let [divergence, divergence_rate] = &mut b;
    let mut tangents = Tangents {
        stiffness: Some(stiffness),
        rate_stiffness: Some(rate_stiffness),
        divergence: Some(divergence),
        divergence_rate: Some(divergence_rate),
        multiplier_stiffness: Some(multiplier_stiffness),
        ..Tangents::default()
    };
    solid.tangents(&state.fields(), &mut tangents).unwrap();
    let [k, k_rate, k_mu] = k.map(|values| dense(solid.displacement_pattern(), &values));
    let [b, b_rate] = b.map(|values| dense(solid.divergence_pattern(), &values));
    let scale = k.amax();
    let rate_scale = scale.max(k_rate.amax());
    check_products(&solid, &state, [&k, &k_rate], [&b, &b_rate]);

    for (column, &full) in solid.dofs().free_to_full().to_vec().iter().enumerate() {
        let by_u = slopes(&solid, &mut state, STEP, |s| &mut s.u[full]);
        check("stiffness", k.column(column).iter().copied(), &by_u[0], scale);
        check("rate", k_rate.column(column).iter().copied(), &by_u[1], rate_scale);
        check("multiplier", k_mu.column(column).iter().copied(), &by_u[2], scale);
        check("divergence", b.column(column).iter().copied(), &by_u[3], b.amax());
        check("divergence rate", b_rate.column(column).iter().copied(), &by_u[4], b.amax());
        let by_v = slopes(&solid, &mut state, STEP, |s| &mut s.v[full]);
        check("force_rate by v", k.column(column).iter().copied(), &by_v[1], scale);
        check("volume_residual_rate by v", b.column(column).iter().copied(), &by_v[4], b.amax());
    }
    if kappa.is_none() {
        for vertex in 0..m {
            let by_p = slopes(&solid, &mut state, 1.0, |s| &mut s.p[vertex]);
            check("force by p", b.row(vertex).iter().map(|x| -x), &by_p[0], b.amax());
            check("rate by p", b_rate.row(vertex).iter().map(|x| -x), &by_p[1], b.amax());
            let by_rate = slopes(&solid, &mut state, 1.0, |s| &mut s.p_rate[vertex]);
            check("rate by p_rate", b.row(vertex).iter().map(|x| -x), &by_rate[1], b.amax());
        }
    }
    for vertex in 0..m {
        let by_mu = slopes(&solid, &mut state, 1.0, |s| &mut s.mu[vertex]);
        check("multiplier force by mu", b.row(vertex).iter().copied(), &by_mu[2], b.amax());
    }
}

macro_rules! difference_tests {
    ($($name:ident: $law:expr, $space:expr, $kappa:expr;)*) => {$(
        #[test]
        fn $name() {
            // The mesh has eighteen elements, so the last batch is not full.
            let mesh = generate::rectangle([0.0, 0.0], [1.5, 1.0], [3, 3]).unwrap();
            check_all($law, $space(&mesh), $kappa);
        }
    )*};
}

difference_tests! {
    mooney_rivlin: MUSCLE_LAW, Space::taylor_hood, None;
    mooney_rivlin_penalty: MUSCLE_LAW, Space::taylor_hood, Some(1e5);
    mooney_rivlin_equal_order: MUSCLE_LAW, Space::equal_order, None;
    small_strain: SMALL_LAW, Space::taylor_hood, None;
    small_strain_penalty: SMALL_LAW, Space::taylor_hood, Some(1e5);
    guccione: GUCCIONE, Space::taylor_hood, None;
    isochoric_guccione: ISOCHORIC_GUCCIONE, Space::taylor_hood, None;
    isochoric_guccione_penalty: ISOCHORIC_GUCCIONE, Space::taylor_hood, Some(1e5);
    st_venant_kirchhoff: ST_VENANT_KIRCHHOFF, Space::taylor_hood, Some(1e5);
    deviatoric_st_venant_kirchhoff: DEVIATORIC, Space::taylor_hood, None;
    deviatoric_st_venant_kirchhoff_penalty: DEVIATORIC, Space::taylor_hood, Some(1e5);
    holzapfel_ogden: HEART, Space::taylor_hood, None;
    holzapfel_ogden_penalty: HEART, Space::taylor_hood, Some(1e5);
    transverse_mooney_rivlin: TENDON, Space::taylor_hood, None;
    transverse_mooney_rivlin_penalty: TENDON, Space::taylor_hood, Some(1e5);
}

/// In 3D, the cofactor is quadratic, so some quantities depend on the state although they are constant in 2D.
macro_rules! spatial_difference_tests {
    ($($name:ident: $law:expr, $space:expr, $kappa:expr;)*) => {$(
        #[test]
        fn $name() {
            // The mesh has twelve elements, so the last batch is not full.
            let mesh = generate::block([0.0; 3], [1.5, 1.0, 0.8], [2, 1, 1]).unwrap();
            check_all($law, $space(&mesh), $kappa);
        }
    )*};
}

spatial_difference_tests! {
    spatial_mooney_rivlin: MUSCLE_LAW, Space::taylor_hood, None;
    spatial_mooney_rivlin_penalty: MUSCLE_LAW, Space::taylor_hood, Some(1e5);
    spatial_mooney_rivlin_equal_order: MUSCLE_LAW, Space::equal_order, None;
    spatial_small_strain: SMALL_LAW, Space::taylor_hood, None;
    spatial_guccione: GUCCIONE, Space::taylor_hood, None;
    spatial_isochoric_guccione: ISOCHORIC_GUCCIONE, Space::taylor_hood, None;
    spatial_isochoric_guccione_penalty: ISOCHORIC_GUCCIONE, Space::taylor_hood, Some(1e5);
    spatial_st_venant_kirchhoff: ST_VENANT_KIRCHHOFF, Space::taylor_hood, Some(1e5);
    spatial_deviatoric_st_venant_kirchhoff: DEVIATORIC, Space::taylor_hood, None;
    spatial_deviatoric_st_venant_kirchhoff_penalty: DEVIATORIC, Space::taylor_hood, Some(1e5);
    spatial_holzapfel_ogden: HEART, Space::taylor_hood, None;
    spatial_holzapfel_ogden_penalty: HEART, Space::taylor_hood, Some(1e5);
    spatial_transverse_mooney_rivlin: TENDON, Space::taylor_hood, None;
    spatial_transverse_mooney_rivlin_penalty: TENDON, Space::taylor_hood, Some(1e5);
}

/// In curved elements, the map differs from point to point.
#[test]
fn curved_tetrahedra_and_triangles() {
    let mesh = generate::block([0.0; 3], [1.5, 1.0, 0.8], [1, 1, 1]).unwrap();
    let midside = [0.78, 0.53, -0.05];
    let curved = mesh.with_midside_nodes(BTreeMap::from([([0, 3], midside)])).unwrap();
    let space = Space::taylor_hood(&curved);
    assert_eq!((0..6).filter(|&e| space.is_curved(e)).count(), 2);
    check_all(MUSCLE_LAW, space, None);
    let mesh = generate::rectangle([0.0; 2], [1.5, 1.0], [1, 1]).unwrap();
    let curved = mesh.with_midside_nodes(BTreeMap::from([([0, 1], [0.8, -0.1])])).unwrap();
    check_all(MUSCLE_LAW, Space::taylor_hood(&curved), None);
}

#[test]
fn factors_of_the_law() {
    let mesh = generate::rectangle([0.0, 0.0], [1.0, 1.0], [2, 2]).unwrap();
    let factors = random(3 * mesh.n_elements(), 0.4, 9);
    let factors = factors.iter().map(|change| 1.0 + change);
    let space = Space::taylor_hood(&mesh);
    let (factors, function) = (Some(factors.collect()), VolumeFunction::Quadratic);
    check_with(MUSCLE_LAW, space, None, factors, function);
}

#[test]
fn uniform_factor_equals_a_scaled_law() {
    let mesh = generate::rectangle([0.0, 0.0], [0.02, 0.02], [2, 2]).unwrap();
    let solid = |law| clamped(Space::taylor_hood(&mesh), "left", law);
    let (soft, stiff) = (solid(MUSCLE_LAW), solid(MUSCLE_LAW.scaled(1.7)));
    let (n, m) = (soft.space().n_components(), soft.space().n_pressures());
    let mut state = State {
        u: random(n, 2e-4, 1),
        v: random(n, 1e-2, 2),
        p: random(m, 3e3, 3),
        p_rate: random(m, 2e3, 4),
        mu: random(m, 5e3, 5),
        factors: Some(vec![1.7; 3 * soft.space().n_elements()]),
        kappa: None,
    };
    let scaled = state.evaluate(&soft);
    let energy = soft.strain_energy(&state.fields());
    state.factors = None;
    // The same few dozen operations are performed in two different orders.
    for (a, b) in scaled.iter().zip(state.evaluate(&stiff)) {
        let largest = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
    }
    let expected = stiff.strain_energy(&state.fields());
    assert!((energy - expected).abs() < 1e-12 * expected.abs());
}
