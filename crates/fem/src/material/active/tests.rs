//! Tests of the active stress: derivatives, power and factors.

use super::*;

const FIBER: [f64; 3] = [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0];
const H: [[f64; 3]; 3] = [[0.1, 0.2, -0.1], [-0.1, -0.05, 0.2], [0.05, -0.2, 0.1]];
const V: [[f64; 3]; 3] = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];

fn at(active: &ActiveStress, h: [[f64; 3]; 3], v: [[f64; 3]; 3]) -> ActiveFiber<f64, 3> {
    active.at(FIBER, &h, &v, 7e4)
}

fn materials() -> Vec<ActiveStress> {
    let mut all = Vec::new();
    for tension in [Tension::SecondPiolaKirchhoff, Tension::Nominal] {
        for force_length in [
            ForceLength::Constant,
            ForceLength::Parabola { optimal: 1.2 },
            ForceLength::Gaussian { optimal: 1.1, width: 0.4 },
        ] {
            for force_velocity in [None, Some(ForceVelocity::hill(2.0))] {
                all.push(ActiveStress { tension, force_length, force_velocity });
            }
        }
    }
    all
}

#[test]
fn derivatives_match_central_differences() {
    let step = 6e-6;
    // The fibers lengthen in one case and shorten in the other.
    for sign in [1.0, -1.0] {
        let v = V.map(|row| row.map(|v| sign * v));
        for active in materials() {
            let point = at(&active, H, v);
            let (by_u, by_v) = (point.by_displacement(), point.by_velocity());
            for k in 0..3 {
                for l in 0..3 {
                    let shift = |t: [[f64; 3]; 3], step: f64| {
                        let mut t = t;
                        t[k][l] += step;
                        t
                    };
                    let plus = at(&active, shift(H, step), v).stress();
                    let minus = at(&active, shift(H, -step), v).stress();
                    let faster = at(&active, H, shift(v, step)).stress();
                    let slower = at(&active, H, shift(v, -step)).stress();
                    for i in 0..3 {
                        for j in 0..3 {
                            let dyad = FIBER[j] * FIBER[l];
                            let by_h = (plus[i][j] - minus[i][j]) / (2.0 * step);
                            let by_rate = (faster[i][j] - slower[i][j]) / (2.0 * step);
                            // The difference errors are of order ε^(2/3) times the tension.
                            assert!((by_u[i][k] * dyad - by_h).abs() < 1e-8 * 7e4);
                            assert!((by_v[i][k] * dyad - by_rate).abs() < 1e-8 * 7e4);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn power_is_stress_times_velocity_gradient() {
    for active in materials() {
        let point = at(&active, H, V);
        let stress = point.stress();
        let power: f64 = (0..9).map(|r| stress[r / 3][r % 3] * V[r / 3][r % 3]).sum();
        assert!((point.power() - power).abs() < 1e-12 * 7e4);
    }
}

#[test]
fn stress_measures_give_their_nominal_stress() {
    let (stretched, still) = ([[0.2, 0.0], [0.0; 2]], [[0.0; 2]; 2]);
    let along =
        |active: ActiveStress| active.at([1.0, 0.0], &stretched, &still, 100.0).stress()[0][0];
    let nominal = ActiveStress { tension: Tension::Nominal, ..ActiveStress::PLAIN };
    assert!((along(ActiveStress::PLAIN) - 120.0).abs() < 1e-12);
    assert!((along(nominal) - 100.0).abs() < 1e-12);
}

#[test]
fn factors_match_their_formulas() {
    let parabola = ForceLength::Parabola { optimal: 1.2 };
    for ratio in [0.5, 0.7, 1.0, 1.3, 1.5] {
        let formula: f64 = -6.25 * ratio * ratio + 12.5 * ratio - 5.25;
        assert!((parabola.factor(1.2 * ratio) - formula.max(0.0)).abs() < 1e-14);
    }
    // The exponent is −(1/2)⁴, since (0.375/0.5 − 1)/0.5 = −1/2.
    let gaussian = ForceLength::Gaussian { optimal: 0.5, width: 0.5 };
    assert_eq!(gaussian.factor(0.375_f64), (-0.0625_f64).exp());
    let hill = ForceVelocity::hill(4.0);
    assert_eq!(hill.factor(0.0), 1.0);
    assert_eq!(hill.factor(-4.0), 0.0);
    assert_eq!(hill.factor(-8.0), 0.0);
    assert!((hill.factor(-2.0_f64) - 0.5 / 3.0).abs() < 1e-15);
    assert!((hill.factor(1e9_f64) - 1.4).abs() < 1e-8);
    let slope = |rate: f64| {
        let dual = Dual { value: rate, rate: 4.0 };
        hill.factor(dual).rate
    };
    // The slope is 1 + 1/a on both sides.
    assert!((slope(0.0) - 5.0).abs() < 1e-14);
    assert!((slope(-1e-12) - 5.0).abs() < 1e-9);
}
