//! The index with all added stresses, and rejected settings.

use myovib_dae::{Problem, StepError};
use myovib_fem::material::{ActiveStress, Bestel};
use myovib_fem::{AddedStress, SupportDirection, generate};
use myovib_model::index::IndexReport;
use myovib_model::{Activation, Formulation, MuscleDae, Parameters, RobinSupport, Signal, formula};

use crate::common::{INF, contracting, on_mesh, viscous};

/// Checks that elastic foundations, viscosity and activation do not change the index given by κ, β
/// and the formulation, in 2D and in 3D.
#[test]
fn no_index_changes() {
    let cases = [(1e5, 0.0), (1e5, 1e-2), (INF, 0.0), (INF, 1e-2)];
    let meshes = [
        generate::rectangle([0.0; 2], [1.0, 0.8], [2, 1]).unwrap(),
        generate::block([0.0; 3], [1.0, 0.8, 0.6], [1, 1, 1]).unwrap(),
    ];
    for (mesh, formulation) in
        meshes.iter().flat_map(|mesh| Formulation::ALL.map(|formulation| (mesh, formulation)))
    {
        for (kappa, beta) in cases {
            let parameters = Parameters::new(1.0, beta, kappa).unwrap();
            let muscle = on_mesh(mesh, parameters, viscous());
            let Ok(mut dae) = MuscleDae::new(muscle, formulation) else {
                continue;
            };
            let n = dae.muscle().solid.dofs().n_free();
            let wave =
                |size: f64| -> Vec<f64> { (0..n).map(|i| size * (1.7 * i as f64).sin()).collect() };
            let report = IndexReport::of_motion(&mut dae, 0.1, &wave(0.01), &wave(0.3)).unwrap();
            let rule = usize::from(dae.index());
            assert_eq!(
                report.decided(),
                Some(rule),
                "{}D {formulation} {kappa} {beta}: {report:?}",
                mesh.dimension()
            );
        }
    }
}

#[test]
fn invalid_tensions_are_rejected() {
    let with = |activations| {
        let mut muscle = contracting(
            2,
            1e5,
            0.0,
            [
                AddedStress { active: Some(ActiveStress::PLAIN), viscosity: 0.0 },
                AddedStress { active: None, viscosity: 1.0 },
            ],
        );
        muscle.activations = activations;
        MuscleDae::new(muscle, Formulation::Position)
    };
    let tension = || Activation::Given(Signal::constant(1.0));
    for (activations, reason) in [
        (vec![(7, tension())], "no such added stress"),
        (vec![(1, tension())], "not active"),
        (vec![(0, tension()), (0, tension())], "given twice"),
        (vec![(0, Activation::Bestel(Bestel::ventricle(-1.0)))], "activation tension = -1"),
    ] {
        let message = with(activations).unwrap_err().to_string();
        assert!(message.contains(reason), "{message}");
    }
    let pushing =
        Activation::Given(Signal::from(formula::Ramp { value: -3.0, start: 0.0, end: 1.0 }));
    let mut dae = with(vec![(0, pushing)]).unwrap();
    let zero = vec![0.0; dae.n_unknowns()];
    let mut residual = zero.clone();
    dae.residual(0.0, &zero, &zero, &mut residual).unwrap();
    let error = dae.residual(0.5, &zero, &zero, &mut residual).unwrap_err();
    assert!(matches!(error, StepError::Fatal(_)), "{error:?}");
}

#[test]
fn invalid_foundations_and_stresses_are_rejected() {
    let muscle = contracting(2, 1e5, 0.0, viscous());
    let foundation = |constants| {
        RobinSupport::new(&muscle.solid, "right", SupportDirection::All, constants).unwrap_err()
    };
    assert!(foundation([-1.0, 0.0]).to_string().contains("stiffness = -1"));
    assert!(foundation([0.0, f64::NAN]).to_string().contains("damping = NaN"));
    let negative = AddedStress { active: None, viscosity: -1.0 };
    let add = |regions: &[(Vec<usize>, AddedStress)]| {
        let added = muscle.solid.clone().with_added_stresses(regions);
        added.unwrap_err().to_string()
    };
    assert!(add(&[(vec![0], negative)]).contains("viscosity = -1"));
    let fine = AddedStress { viscosity: 1.0, ..negative };
    assert!(add(&[(vec![0, 1], fine), (vec![1], fine)]).contains("element 1 "));
    assert!(add(&[(vec![10_000], fine)]).contains("10000"));
}
