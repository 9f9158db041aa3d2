//! Checks that element passes over a body with all features do not allocate memory.

use myovib_dae::Problem;
use myovib_model::{Formulation, MuscleDae};

use crate::relaxation::relaxing;

#[test]
fn passes_over_a_body_that_contracts_and_relaxes_allocate_nothing() {
    for dimension in [2, 3] {
        // β, viscosity, Hill's curve, both kinds of activation, foundations, and two series of
        // Prony terms.
        let muscle = relaxing(dimension, 1e5, 1e-3);
        let mut dae = MuscleDae::new(muscle, Formulation::ImplicitRate).unwrap();
        let n = dae.n_unknowns();
        let wave = |k: usize| 1e-4 * (k as f64).sin();
        let (y, y_dot): (Vec<f64>, Vec<f64>) = (0..n).map(|k| (wave(k), wave(k + n))).unzip();
        let mut rows = vec![0.0; n];
        let mut passes = |t: f64| {
            dae.residual(t, &y, &y_dot, &mut rows).unwrap();
            dae.update_matrices(t, &y, &y_dot).unwrap();
        };
        passes(0.0);
        let allocations =
            allocation_counter::measure(|| (1..10).for_each(|k| passes(0.01 * f64::from(k))));
        assert_eq!(allocations.count_total, 0, "{dimension}");
        let counters = dae.counters();
        let passes = [
            counters.residual_passes,
            counters.tangent_passes,
            counters.added_passes,
            counters.added_tangent_passes,
            counters.bed_passes,
            counters.relaxing_tangent_passes,
        ];
        assert_eq!(passes, [10; 6], "{dimension}");
    }
}
