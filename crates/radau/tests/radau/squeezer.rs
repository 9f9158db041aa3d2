//! Andrews' squeezing mechanism, with hidden constraints and fast motion of all bodies from the start.
//!
//! Seven bodies in a plane are connected in three loops through one point. They are driven by a torque against a
//! spring. Source of the equations, constants, initial values, and the solution at t = 0.03: F. Mazzia, C. Magherini,
//! Test Set for Initial Value Problem Solvers, release 2.4 (2008), problem `andrews`.

use myovib_conformance::AnyProblem;
use myovib_dae::{Outcome, Problem, StepError};
use myovib_radau::{RadauOptions, RadauSolver};

use crate::common::{radau, scd, tolerance};

const M1: f64 = 0.04325;
const M2: f64 = 0.00365;
const M3: f64 = 0.02373;
const M4: f64 = 0.00706;
const M5: f64 = 0.07050;
const M6: f64 = 0.00706;
const M7: f64 = 0.05498;
const I: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
const A_PLACE: [f64; 2] = [-0.06934, -0.00227];
const B_PLACE: [f64; 2] = [-0.03635, 0.03273];
const C_PLACE: [f64; 2] = [0.014, 0.072];
const D: f64 = 28e-3;
const DA: f64 = 115e-4;
const E: f64 = 2e-2;
const EA: f64 = 1421e-5;
const RR: f64 = 7e-3;
const RA: f64 = 92e-5;
const SS: f64 = 35e-3;
const SA: f64 = 1874e-5;
const SB: f64 = 1043e-5;
const SC: f64 = 18e-3;
const SD: f64 = 2e-2;
const TA: f64 = 2308e-5;
const TB: f64 = 916e-5;
const U: f64 = 4e-2;
const UA: f64 = 1228e-5;
const UB: f64 = 449e-5;
const ZF: f64 = 2e-2;
const ZT: f64 = 4e-2;
const FA: f64 = 1421e-5;
const C0: f64 = 4530.0;
const L0: f64 = 0.07785;
const TORQUE: f64 = 0.033;

/// The mechanism with the unknowns (q, v, w, λ): q̇ = v, v̇ = w, 0 = M w − f + Gᵀ λ, 0 = g.
struct Squeezer {
    index: u8,
}

fn inertia(q: &[f64], a: &[f64]) -> [f64; 7] {
    let (th, ph, om) = (q[1], q[3], q[5]);
    let (e, z) = (E - EA, ZF - FA);
    let (co, sp, so) = (th.cos(), ph.sin(), om.sin());
    let m00 = M1 * RA * RA + M2 * (RR * RR - 2.0 * DA * RR * co + DA * DA) + I[0] + I[1];
    let m01 = M2 * (DA * DA - DA * RR * co) + I[1];
    let m11 = M2 * DA * DA + I[1];
    let m22 = M3 * (SA * SA + SB * SB) + I[2];
    let m33 = M4 * e * e + I[3];
    let m34 = M4 * (e * e + ZT * e * sp) + I[3];
    let m44 = M4 * (ZT * ZT + 2.0 * ZT * e * sp + e * e) + M5 * (TA * TA + TB * TB) + I[3] + I[4];
    let m55 = M6 * z * z + I[5];
    let m56 = M6 * (z * z - U * z * so) + I[5];
    let m66 = M6 * (z * z - 2.0 * U * z * so + U * U) + M7 * (UA * UA + UB * UB) + I[5] + I[6];
    [
        m00 * a[0] + m01 * a[1],
        m01 * a[0] + m11 * a[1],
        m22 * a[2],
        m33 * a[3] + m34 * a[4],
        m34 * a[3] + m44 * a[4],
        m55 * a[5] + m56 * a[6],
        m56 * a[5] + m66 * a[6],
    ]
}

fn force(q: &[f64], v: &[f64]) -> [f64; 7] {
    let (th, ga, ph, om) = (q[1], q[2], q[3], q[5]);
    let (e, z) = (E - EA, ZF - FA);
    let (sg, cg) = ga.sin_cos();
    let x = SD * cg + SC * sg + B_PLACE[0] - C_PLACE[0];
    let y = SD * sg - SC * cg + B_PLACE[1] - C_PLACE[1];
    let l = x.hypot(y);
    let pull = -C0 * (l - L0) / l;
    [
        TORQUE - M2 * DA * RR * v[1] * (v[1] + 2.0 * v[0]) * th.sin(),
        M2 * DA * RR * v[0] * v[0] * th.sin(),
        pull * (x * (SC * cg - SD * sg) + y * (SD * cg + SC * sg)),
        M4 * ZT * e * v[4] * v[4] * ph.cos(),
        -M4 * ZT * e * v[3] * (v[3] + 2.0 * v[4]) * ph.cos(),
        -M6 * U * z * v[6] * v[6] * om.cos(),
        M6 * U * z * v[5] * (v[5] + 2.0 * v[6]) * om.cos(),
    ]
}

fn constraint(q: &[f64]) -> [f64; 6] {
    let [be, th, ga, ph, de, om, ep] = [q[0], q[1], q[2], q[3], q[4], q[5], q[6]];
    let x = RR * be.cos() - D * (be + th).cos();
    let y = RR * be.sin() - D * (be + th).sin();
    [
        x - SS * ga.sin() - B_PLACE[0],
        y + SS * ga.cos() - B_PLACE[1],
        x - E * (ph + de).sin() - ZT * de.cos() - A_PLACE[0],
        y + E * (ph + de).cos() - ZT * de.sin() - A_PLACE[1],
        x - ZF * (om + ep).cos() - U * ep.sin() - A_PLACE[0],
        y - ZF * (om + ep).sin() + U * ep.cos() - A_PLACE[1],
    ]
}

fn gradient(q: &[f64]) -> [[f64; 7]; 6] {
    let [be, th, ga, ph, de, om, ep] = [q[0], q[1], q[2], q[3], q[4], q[5], q[6]];
    let (sb, cb) = be.sin_cos();
    let (sbt, cbt) = (be + th).sin_cos();
    let (sg, cg) = ga.sin_cos();
    let (spd, cpd) = (ph + de).sin_cos();
    let (sd, cd) = de.sin_cos();
    let (soe, coe) = (om + ep).sin_cos();
    let (se, ce) = ep.sin_cos();
    let mut g = [[0.0; 7]; 6];
    for k in [0, 2, 4] {
        g[k][0] = -RR * sb + D * sbt;
        g[k][1] = D * sbt;
        g[k + 1][0] = RR * cb - D * cbt;
        g[k + 1][1] = -D * cbt;
    }
    g[0][2] = -SS * cg;
    g[1][2] = -SS * sg;
    g[2][3] = -E * cpd;
    g[2][4] = -E * cpd + ZT * sd;
    g[3][3] = -E * spd;
    g[3][4] = -E * spd - ZT * cd;
    g[4][5] = ZF * soe;
    g[4][6] = ZF * soe - U * ce;
    g[5][5] = -ZF * coe;
    g[5][6] = -ZF * coe - U * se;
    g
}

impl Problem for Squeezer {
    fn n_unknowns(&self) -> usize {
        27
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let (q, s, w, l) = (&y[..7], &y[7..14], &y[14..21], &y[21..]);
        let (moment, f, g, jac) = (inertia(q, w), force(q, s), constraint(q), gradient(q));
        for i in 0..7 {
            r[i] = v[i] - s[i];
            r[7 + i] = v[7 + i] - w[i];
            let reaction: f64 = (0..6).map(|k| jac[k][i] * l[k]).sum();
            r[14 + i] = moment[i] - f[i] + reaction;
        }
        for k in 0..6 {
            r[21 + k] = match self.index {
                3 => g[k],
                _ => (0..7).map(|i| jac[k][i] * s[i]).sum(),
            };
        }
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        let index = self.index;
        let of = [(7, 1), (7, index - 1), (13, index)];
        Some(of.into_iter().flat_map(|(n, k)| vec![k; n]).collect())
    }
}

const Q0: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_9,
    0.487_364_979_543_842_55,
    -0.222_668_390_165_885_9,
    1.230_547_444_549_821_2,
];
const W0: [f64; 2] = [14_222.443_919_954_138, -10_666.832_939_965_585];
const MULTIPLIERS: [f64; 2] = [98.566_870_396_241_09, -6.122_688_344_255_662];

/// Published q at t = 0.03.
const PUBLISHED: [f64; 7] = [
    15.810_771_196_299_04,
    -15.756_371_059_842_98,
    0.040_822_240_130_731_01,
    -0.534_730_116_322_694_8,
    0.524_409_965_880_530_4,
    0.534_730_116_322_694_8,
    1.048_080_741_042_263,
];

fn squeezer(index: u8, options: RadauOptions) -> RadauSolver<AnyProblem> {
    let (mut y, mut y_dot) = ([0.0; 27], [0.0; 27]);
    y[..7].copy_from_slice(&Q0);
    y[14..16].copy_from_slice(&W0);
    y_dot[7..9].copy_from_slice(&W0);
    y[21..23].copy_from_slice(&MULTIPLIERS);
    let builder = radau(Squeezer { index }).options(options);
    builder.build(0.0, &y, &y_dot).unwrap()
}

/// Returns the positions at t = 0.03, and the number of steps.
fn at_end(index: u8, options: RadauOptions) -> (Vec<f64>, u64) {
    let mut solver = squeezer(index, options);
    let outcome = solver.integrate_to(0.03).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 0.03 });
    (solver.y()[..7].to_vec(), solver.statistics().steps)
}

/// Checks that steps become longer, not shorter, after short first steps in which rounding errors dominate the
/// constraints.
#[test]
fn no_first_step_is_too_short() {
    for stages in [3, 5, 7] {
        for (tol, digits) in [(1e-4, 5.1), (1e-7, 9.2), (1e-10, 9.5)] {
            for initial_step in [None, Some(1e-4), Some(1e-5), Some(1e-6), Some(1e-7), Some(1e-8)] {
                let options = RadauOptions {
                    stages,
                    initial_step,
                    max_steps: Some(10_000),
                    ..tolerance(tol)
                };
                let (q, steps) = at_end(3, options);
                let reached = scd(&q, &PUBLISHED);
                println!("{stages} {tol:e} {initial_step:?}: {steps} steps, {reached:.2} digits");
                // The expected value is the smallest number of digits of the first runs (November 2026), as in
                // `published`. Half a digit less is accepted. Runs at small tolerances agree with the reference to 9.57
                // digits in all forms.
                assert!(reached > digits - 0.5, "{stages} {tol:e} {initial_step:?}: {reached:.2}");
            }
        }
    }
}

/// Checks that the published values are reproduced if the constraint is G v = 0 instead of g = 0.
#[test]
fn the_published_positions_are_those_of_index_2() {
    let options = RadauOptions { stages: 7, ..tolerance(1e-11) };
    let (q, _) = at_end(2, options);
    let reached = scd(&q, &PUBLISHED);
    println!("index 2: {reached:.2} digits");
    assert!(reached > 9.0, "{reached:.2}");
}
