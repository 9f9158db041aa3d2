//! Energies of volume changes other than the default.

use myovib_fem::material::VolumeFunction;
use myovib_fem::solid::{Fields, Pressure, Vectors};
use myovib_fem::{Space, generate};

use crate::common::{MUSCLE_LAW, clamped, random};
use crate::differences::{HEART, STEP, check_with};

/// The energy κ/2 (ln J)², with and without pressure; the force without pressure is the derivative of the energy.
#[test]
fn logarithmic_volumes() {
    let function = VolumeFunction::Logarithmic;
    let plane = generate::rectangle([0.0, 0.0], [1.5, 1.0], [3, 3]).unwrap();
    let spatial = generate::block([0.0; 3], [1.5, 1.0, 0.8], [2, 1, 1]).unwrap();
    for (mesh, law) in [(&plane, MUSCLE_LAW), (&plane, HEART), (&spatial, MUSCLE_LAW)] {
        for kappa in [None, Some(1e5)] {
            check_with(law, Space::taylor_hood(mesh), kappa, None, function);
        }
        let solid = clamped(Space::taylor_hood(mesh), "left", MUSCLE_LAW);
        let solid = solid.with_volume_function(function).unwrap();
        let mut u = random(solid.space().n_components(), 0.02, 1);
        let pressure = Pressure::Penalty { kappa: 1e5 };
        let mut force = vec![0.0; u.len()];
        let mut vectors = Vectors { force: Some(&mut force), ..Vectors::default() };
        solid.evaluate(&Fields::new(&u, pressure), &mut vectors).unwrap();
        let scale = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        for i in (0..u.len()).step_by(7) {
            let [below, above] = [-STEP, STEP].map(|step| {
                u[i] += step;
                let energy = solid.strain_energy(&Fields::new(&u, pressure));
                u[i] -= step;
                energy
            });
            // Differences of energies lose two thirds of the digits.
            let error = force[i] - (above - below) / (2.0 * STEP);
            assert!(error.abs() < 1e-6 * scale, "{i}: {error:e} of {scale:e}");
        }
    }
}
