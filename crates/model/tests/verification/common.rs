//! Small bodies and runs used by several tests.

use myovib_dae::Problem;
use myovib_fem::{Law, Mesh};
use myovib_model::{
    Field, Formulation, IdaIntegrator, Muscle, MuscleDae, Outcome, Probe, SampleTimes, Sampler,
    Settings, Signal, paper, run,
};

pub(crate) const LAWS: [Law; 2] = [paper::LAW, Law::SmallStrain { shear_modulus: 2.04e4 }];

/// Returns a block of 1.1 m by 1 m, fixed on the left edge and loaded on the right edge: four triangles around a free
/// node, refined `levels` times.
pub(crate) fn block(levels: usize) -> Mesh {
    let coarse =
        Mesh::parse_msh(include_str!("../../../../data/meshes/block.msh"), "block.msh").unwrap();
    (0..levels).fold(coarse, |mesh, _| mesh.refined().unwrap())
}

/// Returns the block under a vertical traction on its right edge.
pub(crate) fn loaded_block(
    levels: usize,
    law: Law,
    kappa: f64,
    beta: f64,
    signal: Signal,
) -> Muscle {
    paper::muscle_with_load(&block(levels), law, kappa, beta, signal).unwrap()
}

/// Returns settings with relative tolerance `rtol` and absolute tolerances that are small relative to the solution,
/// with all multipliers excluded from the error test.
pub(crate) fn accurate(formulation: Formulation, rtol: f64, t_end: f64) -> Settings {
    let mut settings = Settings::paper(formulation);
    settings.t_end = t_end;
    settings.relative_tolerance = rtol;
    settings.absolute_tolerances.displacement = 1e-2 * rtol;
    settings.absolute_tolerances.velocity = 1e-1 * rtol;
    settings.absolute_tolerances.pressure = 1e3 * rtol;
    settings.absolute_tolerances.multiplier = 1e4 * rtol;
    settings
}

/// Returns u_y at `point` at multiples of `every` up to the end time.
pub(crate) fn history(
    muscle: Muscle,
    formulation: Formulation,
    settings: &Settings,
    point: [f64; 2],
    every: f64,
) -> Vec<f64> {
    let probe = Probe::at(muscle.solid.space(), point).unwrap();
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let n = dae.n_unknowns();
    let mut integrator = IdaIntegrator::from_rest(dae, settings).unwrap();
    let mut values = Vec::new();
    let mut sampler = Sampler::new(
        SampleTimes::new(every, settings.t_end),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            let (displacement, _) = dae.nodal_motion(t, y);
            values.push(probe.vector(displacement)[1]);
            Ok(())
        },
    );
    let statistics = run(&mut integrator, &mut [&mut sampler]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished, "{formulation}");
    values
}

/// Returns the largest difference of two histories relative to the largest value of the second.
pub(crate) fn relative_difference(ours: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(ours.len(), reference.len());
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    largest(&mut ours.iter().zip(reference).map(|(a, b)| (a - b).abs()))
        / largest(&mut reference.iter().map(|b| b.abs()))
}

/// The blocks of a vector.
pub(crate) fn blocks(dae: &MuscleDae, q: &[f64], pressure: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; dae.n_unknowns()];
    for (field, range) in dae.layout().blocks() {
        match field {
            Field::Displacement => y[range.clone()].copy_from_slice(q),
            Field::Pressure => y[range.clone()].copy_from_slice(pressure),
            _ => {}
        }
    }
    y
}
