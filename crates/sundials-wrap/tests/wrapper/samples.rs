//! Tests of the sample problems: initial values, Jacobians, exact solutions.

use myovib_conformance::samples::{
    Akzo, CarAxis, Heat2d, JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Robertson, Sample,
    VanDerPol,
};
use myovib_dae::VariableKind;

use crate::common::{check_jacobian, numbers, reference};

const FORMS: [MechanicalForm; 3] =
    [MechanicalForm::Index3, MechanicalForm::Index2, MechanicalForm::Stabilized];

fn all() -> Vec<Box<dyn Sample>> {
    let mut samples: Vec<Box<dyn Sample>> = vec![
        Box::new(Robertson),
        Box::new(Akzo),
        Box::new(Heat2d::new(5)),
        Box::new(LinearIndex1),
        Box::new(JayIndex2),
        Box::new(VanDerPol { vdp_mu: 5.0 }),
    ];
    for form in FORMS {
        samples.push(Box::new(Pendulum::new(form)));
        samples.push(Box::new(CarAxis::new(form)));
    }
    samples
}

#[test]
fn start_consistently() {
    for (which, mut sample) in all().into_iter().enumerate() {
        let start = sample.start();
        let n = sample.n_unknowns();
        assert_eq!((start.y.len(), start.y_dot.len()), (n, n), "sample {which}");
        let mut residual = vec![f64::NAN; n];
        sample.residual(start.t, &start.y, &start.y_dot, &mut residual).unwrap();
        let scale = start.y_dot.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        for (i, r) in residual.iter().enumerate() {
            assert!(r.abs() < 8.0 * f64::EPSILON * scale, "sample {which}: residual[{i}] = {r}");
        }
    }
}

#[test]
fn have_the_jacobians_of_their_residuals() {
    for mut sample in all() {
        let start = sample.start();
        // This state is away from the start, where many entries vanish, but close enough to be in the domain of every
        // sample.
        let shift = |(i, v): (usize, &f64)| v + 1e-3 * (1.0 + (i as f64).cos());
        let y: Vec<f64> = start.y.iter().enumerate().map(shift).collect();
        let y_dot: Vec<f64> = start.y_dot.iter().enumerate().map(shift).collect();
        check_jacobian(&mut *sample, 0.3, &y, &y_dot);
    }
}

#[test]
fn have_exact_solutions_that_satisfy_the_equations() {
    for (which, mut sample) in all().into_iter().enumerate() {
        let Some(y0) = sample.exact(0.0) else {
            continue;
        };
        for (exact, start) in y0.iter().zip(&sample.start().y) {
            // For a horizontal pendulum, asin does not lose digits, because θ/2 is 45°.
            assert!((exact - start).abs() < 1e-13, "sample {which}: {exact} ≠ {start}");
        }
        for t in [0.1, 0.7, 0.95] {
            let h = 6e-6; // cube root of ε
            let (y, plus, minus) = (sample.exact(t), sample.exact(t + h), sample.exact(t - h));
            let (y, plus, minus) = (y.unwrap(), plus.unwrap(), minus.unwrap());
            let y_dot: Vec<f64> =
                plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * h)).collect();
            let mut residual = vec![f64::NAN; y.len()];
            sample.residual(t, &y, &y_dot, &mut residual).unwrap();
            for (i, r) in residual.iter().enumerate() {
                // The error is h² times a third derivative of at most g^(3/2) ≈ 300, plus rounding.
                assert!(r.abs() < 1e-8, "sample {which}: residual[{i}] = {r} at t = {t}");
            }
        }
    }
}

#[test]
fn the_pendulum_is_where_the_elliptic_functions_say() {
    let reference = reference("s4_exact_daes")["C"].clone();
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    for row in reference["values"].as_array().unwrap() {
        let y = pendulum.exact(row["t"].as_f64().unwrap()).unwrap();
        for (i, key) in [(0, "x"), (1, "y"), (4, "lam")] {
            // A phase of up to 31 has a rounding error of 4e-15, and λ is 3 g times a cosine.
            assert!((y[i] - row[key].as_f64().unwrap()).abs() < 1e-12, "{key}: {}", y[i]);
        }
    }
    let period = reference["period"].as_f64().unwrap();
    for (after, start) in pendulum.exact(period).unwrap().iter().zip(&pendulum.start().y) {
        assert!((after - start).abs() < 1e-12, "{after} ≠ {start} after one period");
    }
}

#[test]
fn start_values_agree_with_the_published_ones() {
    let akzo = reference("s1_akzo");
    for (ours, published) in Akzo.start().y.iter().zip(numbers(&akzo["y0"])) {
        assert!((ours - published).abs() < 1e-15, "{ours} ≠ {published}");
    }
    let car = reference("s2_caraxis");
    let start = CarAxis::new(MechanicalForm::Index3).start();
    assert_eq!(start.y, numbers(&car["y0"]));
    assert_eq!(start.y_dot, numbers(&car["yp0"]));
}

#[test]
fn samples_state_algebraic_variables_and_indices() {
    for sample in all() {
        let (kinds, indices) = (sample.kinds().unwrap(), sample.indices().unwrap());
        assert_eq!((kinds.len(), indices.len()), (sample.n_unknowns(), sample.n_unknowns()));
        for (kind, index) in kinds.iter().zip(&indices) {
            assert!(*kind == VariableKind::Differential || *index >= 1);
        }
    }
    let car = reference("s2_caraxis");
    let published: Vec<u8> = numbers(&car["index_of_variables"]).iter().map(|&i| i as u8).collect();
    assert_eq!(Some(published), myovib_dae::Problem::indices(&CarAxis::new(FORMS[0])));
}
