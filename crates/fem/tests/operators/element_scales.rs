//! Damping coefficients that differ between elements.

use myovib_fem::solid::{Fields, Pressure, Solid, Tangents, Vectors};
use myovib_fem::{ElementScale, Space};

use crate::common::{MUSCLE_LAW, clamped, muscle_mesh, random};

#[test]
fn scale_of_beta_multiplies_only_rates_and_their_tangents() {
    let halved = ElementScale { beta: 0.5, ..ElementScale::ONE };
    let plain = clamped(Space::taylor_hood(&muscle_mesh()), "fixed", MUSCLE_LAW);
    let scales = vec![halved; plain.space().n_elements()];
    let (n, m) = (plain.space().n_components(), plain.space().n_pressures());
    let [u, v] = [(1e-4, 1), (1e-2, 2)].map(|(size, seed)| random(n, size, seed));
    let [p, p_rate, mu] = [3, 4, 5].map(|seed| random(m, 1e2, seed));
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    let operators = |solid: &Solid| {
        let mut rate = vec![0.0; n];
        let mut out = Vectors { force_rate: Some(&mut rate), ..Vectors::default() };
        solid.evaluate(&fields, &mut out).unwrap();
        let [mut k, mut damped, mut k_rate, mut k_mu] =
            [(); 4].map(|()| vec![0.0; solid.displacement_pattern().nnz()]);
        let mut out = Tangents {
            stiffness: Some(&mut k),
            damped_stiffness: Some(&mut damped),
            rate_stiffness: Some(&mut k_rate),
            multiplier_stiffness: Some(&mut k_mu),
            ..Tangents::default()
        };
        solid.tangents(&fields, &mut out).unwrap();
        ([k, k_mu], [rate, damped, k_rate])
    };
    let (same, rates) = operators(&plain);
    // The results are bitwise equal, because multiplication by a power of two commutes with rounding.
    let half = rates.map(|values| values.into_iter().map(|x| 0.5 * x).collect::<Vec<_>>());
    assert!(half.iter().all(|values| values.iter().any(|x| *x != 0.0)));
    assert_eq!(operators(&plain.with_element_scales(&scales).unwrap()), (same, half));
}
