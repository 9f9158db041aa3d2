//! Tests that all instruction sets give bitwise equal results.

use std::sync::Arc;

use pulp::Arch;

use super::Solid;
use crate::material::Law;
use crate::operators::fields::{Fields, Inverted, Pressure, Tangents, Vectors};
use crate::space::Space;
use crate::space::dofs::DofMap;

/// Returns the instruction sets of this processor. The widest set is the last.
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

/// Evaluates all vectors and tangents.
fn all_results(solid: &Solid, fields: &Fields<'_>) -> Result<[Vec<f64>; 10], Inverted> {
    let (n, m) = (fields.u.len(), solid.space.n_pressures());
    let (nnz, nnz_divergence) = (solid.displacement_pattern.nnz(), solid.divergence_pattern.nnz());
    let lengths = [n, n, n, m, m, nnz, nnz, nnz, nnz_divergence, nnz_divergence];
    let mut all = lengths.map(|n| vec![f64::NAN; n]);
    let [a, b, c, d, e, f, g, h, i, j] = &mut all;
    let mut vectors = Vectors {
        force: Some(a),
        force_rate: Some(b),
        multiplier_force: Some(c),
        volume_residual: Some(d),
        volume_residual_rate: Some(e),
    };
    solid.evaluate(fields, &mut vectors)?;
    let mut tangents = Tangents {
        stiffness: Some(f),
        rate_stiffness: Some(g),
        multiplier_stiffness: Some(h),
        divergence: Some(i),
        divergence_rate: Some(j),
        ..Tangents::default()
    };
    solid.tangents(fields, &mut tangents)?;
    Ok(all)
}

#[test]
fn instruction_sets_give_bitwise_equal_results() {
    // A batch holds 8 elements, and the last batch is not full.
    let mesh = crate::mesh::generate::spindle([10, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = Solid::uniform(space.clone(), dofs, law, 1.0).unwrap();
    let (n, m) = (space.n_components(), space.n_pressures());
    let (u, v) = (wave(n, 1e-4), wave(n, 1e-2));
    let (p, p_rate, mu) = (wave(m, 50.0), wave(m, 70.0), wave(m, 90.0));
    let corner = |e: usize, k: usize| 1.0 + 0.5 * ((3 * e + k) as f64).cos();
    let factors: Vec<_> =
        (0..space.n_elements()).flat_map(|e| [0, 1, 2].map(|k| corner(e, k))).collect();
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        factors: Some(&factors),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    // The midside node of the first edge of element 13 is moved outside the element.
    let moved = space.element_nodes(13)[3];
    let mut inverted = u.clone();
    inverted[2 * moved] += 1.0;
    let inverted = Fields { u: &inverted, ..fields };
    let sets = instruction_sets().into_iter().map(|arch| Solid { arch, ..solid.clone() });
    let solids: Vec<_> = sets.collect();
    let scalar = all_results(&solids[0], &fields).unwrap();
    assert!(scalar.iter().flatten().all(|x| x.is_finite()));
    for (k, solid) in solids.iter().enumerate() {
        assert_eq!(all_results(solid, &fields).unwrap(), scalar, "set {k}");
        let error = all_results(solid, &inverted).unwrap_err();
        let around = space.element_nodes(error.element);
        assert!(around.contains(&moved), "set {k}: {error}");
    }
}

/// The factors of the solid and of the fields are multiplied.
#[test]
fn factors_of_a_solid_equal_factors_of_the_fields() {
    let mesh = crate::mesh::generate::spindle([10, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = Solid::uniform(space.clone(), dofs, law, 1.0).unwrap();
    let (n, m) = (space.n_components(), space.n_pressures());
    let (u, v, p) = (wave(n, 1e-4), wave(n, 1e-2), wave(m, 50.0));
    let corners = 3 * space.n_elements();
    let own: Vec<f64> = wave(corners, 0.5).iter().map(|x| 1.0 + x).collect();
    let other: Vec<f64> = wave(corners, 0.3).iter().map(|x| 2.0 - x).collect();
    let both: Vec<f64> = own.iter().zip(&other).map(|(a, b)| b * a).collect();
    let graded = solid.clone().with_factors(own.clone()).unwrap();
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p),
        mu: Some(&p),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    for (given, all) in [(None, &own), (Some(&other[..]), &both)] {
        let given = Fields { factors: given, ..fields };
        let all = Fields { factors: Some(all), ..fields };
        assert_eq!(all_results(&graded, &given).unwrap(), all_results(&solid, &all).unwrap());
        assert_eq!(graded.strain_energy(&given), solid.strain_energy(&all));
        let powers = |solid: &Solid, fields: &Fields<'_>| {
            let mut out = vec![0.0; space.n_elements()];
            solid.add_powers(fields, 0.1, &v, &mut out).unwrap();
            out
        };
        assert_eq!(powers(&graded, &given), powers(&solid, &all));
    }
    assert!(solid.with_factors(vec![1.0]).is_err());
}
