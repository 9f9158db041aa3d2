//! Forward sensitivities, compared with SUNDIALS' examples.

use crate::common::{numbers, reference};
use myovib_dae::{
    ConsistencyMode, Differenced, Parameter, Problem, StepError, Suppressed, Tolerances,
    VariableKind,
};
use sundials_wrap::{IdaOptions, IdaSolver, SensitivityMethod, SensitivityOptions};

use SensitivityMethod::{Simultaneous, Staggered};

/// Robertson's kinetics, with the three rate constants as parameters.
pub(crate) struct Kinetics {
    pub(crate) p: [f64; 3],
}

impl Problem for Kinetics {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let [p1, p2, p3] = self.p;
        let (decay, back, pair) = (p1 * y[0], p2 * y[1] * y[2], p3 * y[1] * y[1]);
        r[0] = v[0] + decay - back;
        r[1] = v[1] - decay + back + pair;
        r[2] = y[0] + y[1] + y[2] - 1.0;
        Ok(())
    }

    fn jacobian(
        &mut self,
        _: f64,
        y: &[f64],
        _: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let [p1, p2, p3] = self.p.map(|p| a * p);
        let [of_2, of_3] = [p2 * y[2], p2 * y[1]];
        values.copy_from_slice(&[
            b + p1,
            -p1,
            a,
            -of_2,
            b + of_2 + 2.0 * p3 * y[1],
            a,
            -of_3,
            of_3,
            a,
        ]);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        use VariableKind::{Algebraic, Differential};
        Some(vec![Differential, Differential, Algebraic])
    }
}

/// Returns the rate constants, with the typical sizes used in the example.
pub(crate) fn rates(p: [f64; 3]) -> Differenced<Kinetics> {
    let list = ["p1", "p2", "p3"].into_iter().zip(p);
    let list = list.map(|(name, value)| Parameter::new(name, value));
    Differenced::new(
        list.collect(),
        |problem: &Kinetics, j| problem.p[j],
        |problem: &mut Kinetics, j, value| {
            problem.p[j] = value;
        },
    )
}

/// The run of SUNDIALS' example idasRoberts_FSA_dns, with the staggered method and full error control. Only the linear
/// solver differs. The example prints five digits; rounding in Newton's method changes the sixth.
#[test]
fn reproduces_the_published_sensitivities_of_robertson() {
    let published = reference("s3_robertson_sensitivities");
    let p = numbers(&published["parameters"]);
    let p = [p[0], p[1], p[2]];
    let (rtol, atol) = (published["rtol"].as_f64().unwrap(), numbers(&published["atol"]));
    let zero = || [vec![0.0; 3], vec![0.0; 3]];
    let mut solver = IdaSolver::builder(Kinetics { p })
        .tolerances(Tolerances::vector(rtol, atol.clone()))
        .sensitivities(rates(p), SensitivityOptions::default(), vec![zero(), zero(), zero()])
        .build(0.0, &[1.0, 0.0, 0.0], &[0.1, 0.0, 0.0])
        .unwrap();
    solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, 0.4).unwrap();
    // The initial values are consistent: Ṡ of the first rate is (−1, 1, 0).
    let mut slope = [0.0; 3];
    solver.sensitivity_dense_output(0, 0.0, 1, &mut slope).unwrap();
    assert!((slope[0] + 1.0).abs() < 1e-6 && (slope[1] - 1.0).abs() < 1e-6, "{slope:?}");
    let rows = published["rows"].as_array().unwrap();
    for row in rows {
        let t = row["t"].as_f64().unwrap();
        solver.integrate_to(t).unwrap();
        for j in 0..3 {
            let mut s = [0.0; 3];
            solver.sensitivity(j, &mut s).unwrap();
            let expected = numbers(&row["sensitivities"][j]);
            for i in 0..3 {
                // The bound covers five printed digits, plus the tolerance of p̄ S, which exceeds y late in the run.
                let allowed = 1e-4 * expected[i].abs() + atol[i] / p[j];
                assert!(
                    (s[i] - expected[i]).abs() <= allowed,
                    "t = {t}: dy{i}/dp{j} = {:e}, not {:e}",
                    s[i],
                    expected[i]
                );
            }
        }
    }
    let steps = rows.last().unwrap()["steps"].as_u64().unwrap();
    let (ours, of) = (solver.statistics(), solver.sensitivity_statistics());
    println!("{} steps, published {steps}; {of:?}", ours.steps);
    assert!(ours.steps.abs_diff(steps) * 20 < steps, "{}", ours.steps);
    // Sensitivities reuse the matrices of the solution. The published run has one additional setup.
    assert!(of.linear_setups <= 2 + ours.linear_setups / 50, "{of:?}");
    assert!(of.newton_iterations > 0 && of.residual_evaluations > 0);
}

/// Slider-crank of SUNDIALS' example idasSlCrank_FSA_dns, in the stabilized form of index 2. The crank has the length
/// 1/2, and the rod has the length 1. A spring and a damper connect their midpoints, and a force of 1 acts along x at
/// (x + cos p). The unknowns are the angle q of the crank, the position x of the slider, the angle p of the rod, their
/// velocities, two multipliers of the positions, two multipliers of the velocities, and the integral of the kinetic
/// energy, which the example computes by a quadrature. The parameters are the stiffness and the damping.
#[derive(Clone, Copy)]
struct Crank {
    stiffness: f64,
    damping: f64,
}

const CRANK: f64 = 0.5;
const INERTIA: [f64; 3] = [1.0, 1.0, 2.0];

/// Returns the gradients of the constraints x − cos p − a cos q and −sin p − a sin q with respect to (q, x, p).
fn gradients(q: f64, p: f64) -> [[f64; 3]; 2] {
    [[CRANK * q.sin(), 1.0, p.sin()], [-CRANK * q.cos(), 0.0, -p.cos()]]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Crank {
    /// Returns the generalized forces, from virtual work.
    fn forces(&self, y: &[f64]) -> [f64; 3] {
        let (q, x, p, v) = (y[0], y[1], y[2], &y[3..6]);
        let half = 0.5 * CRANK;
        // Vector from the midpoint of the crank to the midpoint of the rod, whose end is at the slider.
        let d = [x - 0.5 * p.cos() - half * q.cos(), -0.5 * p.sin() - half * q.sin()];
        let length = d[0].hypot(d[1]);
        let by = [[half * q.sin(), 1.0, 0.5 * p.sin()], [-half * q.cos(), 0.0, -0.5 * p.cos()]];
        let of_length = [0, 1, 2].map(|i| (d[0] * by[0][i] + d[1] * by[1][i]) / length);
        let tension = self.stiffness * (length - 1.0) + self.damping * dot(&of_length, v);
        let pushed = [0.0, 1.0, -p.sin()];
        [0, 1, 2].map(|i| pushed[i] - tension * of_length[i])
    }

    fn start() -> [f64; 3] {
        let p = (-CRANK).asin();
        [std::f64::consts::FRAC_PI_2, p.cos(), p]
    }
}

impl Problem for Crank {
    fn n_unknowns(&self) -> usize {
        11
    }

    fn residual(
        &mut self,
        _: f64,
        y: &[f64],
        dot_y: &[f64],
        r: &mut [f64],
    ) -> Result<(), StepError> {
        let (positions, v) = (&y[..3], &y[3..6]);
        let [first, second] = gradients(positions[0], positions[2]);
        let forces = self.forces(y);
        for i in 0..3 {
            r[i] = dot_y[i] - v[i] + first[i] * y[8] + second[i] * y[9];
            let reaction = first[i] * y[6] + second[i] * y[7];
            r[3 + i] = INERTIA[i] * dot_y[3 + i] - forces[i] + reaction;
        }
        let [q, x, p] = [positions[0], positions[1], positions[2]];
        r[6] = x - p.cos() - CRANK * q.cos();
        r[7] = -p.sin() - CRANK * q.sin();
        r[8] = dot(&first, v);
        r[9] = dot(&second, v);
        let energy: f64 = (0..3).map(|i| 0.5 * INERTIA[i] * v[i] * v[i]).sum();
        r[10] = dot_y[10] - energy;
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; 11];
        kinds[6..10].fill(VariableKind::Algebraic);
        Some(kinds)
    }
}

/// The example prints G = 3.33662 and dG/dp = (0.33346, −0.36375). Its difference quotients vary by 2e-5 at these
/// tolerances.
#[test]
fn reproduces_the_published_sensitivities_of_the_slider_crank() {
    for method in [Simultaneous, Staggered] {
        let crank = Crank { stiffness: 1.0, damping: 1.0 };
        let [q, x, p] = Crank::start();
        let mut y = vec![0.0; 11];
        y[..3].copy_from_slice(&[q, x, p]);
        let mut y_dot = vec![0.0; 11];
        let forces = crank.forces(&y);
        (0..3).for_each(|i| y_dot[3 + i] = forces[i] / INERTIA[i]);
        let list = vec![Parameter::new("stiffness", 1.0), Parameter::new("damping", 1.0)];
        let get = |crank: &Crank, j: usize| [crank.stiffness, crank.damping][j];
        let set = |crank: &mut Crank, j: usize, value: f64| match j {
            0 => crank.stiffness = value,
            _ => crank.damping = value,
        };
        let zero = || [vec![0.0; 11], vec![0.0; 11]];
        let options = SensitivityOptions { method, in_error_test: true };
        let mut solver = IdaSolver::builder(crank)
            .options(IdaOptions {
                tolerances: Tolerances::scalar(1e-6, 1e-7),
                suppressed: Suppressed::Algebraic,
                ..IdaOptions::default()
            })
            .sensitivities(Differenced::new(list, get, set), options, vec![zero(), zero()])
            .build(0.0, &y, &y_dot)
            .unwrap();
        let outcome = solver.integrate_to(10.0).unwrap();
        assert_eq!(outcome.t(), 10.0, "{outcome:?}");
        let mut found = [0.0; 2];
        for (j, found) in found.iter_mut().enumerate() {
            let mut s = vec![0.0; 11];
            solver.sensitivity(j, &mut s).unwrap();
            *found = s[10];
        }
        let g = solver.y()[10];
        println!("{method:?}: G = {g:.6}, dG/dp = {found:.5?}, {:?}", solver.statistics().steps);
        // The bound is ten times the relative tolerance: steps that differ by 2 % change G by 1e-5.
        assert!((g - 3.336_616).abs() < 1e-5 * 3.336_616, "{g}");
        for (found, published) in found.into_iter().zip([0.33346, -0.36375]) {
            assert!((found - published).abs() < 5e-5, "{method:?}: {found}");
        }
    }
}
