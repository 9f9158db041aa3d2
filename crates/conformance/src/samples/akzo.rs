use super::{FullMatrix, Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

const K1: f64 = 18.7;
const K2: f64 = 0.58;
const K3: f64 = 0.09;
const K4: f64 = 0.42;
const K: f64 = 34.4;
const KLA: f64 = 3.3;
const KS: f64 = 115.83;
const P_CO2: f64 = 0.9;
const H: f64 = 737.0;

/// The chemical Akzo Nobel problem: carbon dioxide is added continuously to a reaction, and one species is in
/// equilibrium.
///
/// ```text
/// r1 = k1 y1⁴ √y2   r2 = k2 y3 y4   r3 = (k2/K) y1 y5   r4 = k3 y1 y4²   r5 = k4 y6² √y2
/// ẏ1 = −2 r1 + r2 − r3 − r4
/// ẏ2 = −r1/2 − r4 − r5/2 + klA (p/H − y2)
/// ẏ3 = r1 − r2 + r3
/// ẏ4 = −r2 + r3 − 2 r4
/// ẏ5 = r2 − r3 + r5
///  0 = Ks y1 y4 − y6
/// ```
///
/// For y2 < 0, the square root is not real, and the residual returns a recoverable error. The usual interval is [0,
/// 180].
///
/// Source: W. J. H. Stortelder, Parameter estimation in nonlinear dynamical systems, 1998; Test Set
/// for IVP Solvers, problem chemakzo.
#[derive(Debug, Clone, Copy, Default)]
pub struct Akzo;

impl Akzo {
    fn rates(y: &[f64]) -> Result<[f64; 5], StepError> {
        if y[1] < 0.0 {
            return Err(StepError::Recoverable(format!("y2 = {} is negative", y[1])));
        }
        let root = y[1].sqrt();
        Ok([
            K1 * y[0].powi(4) * root,
            K2 * y[2] * y[3],
            K2 / K * y[0] * y[4],
            K3 * y[0] * y[3] * y[3],
            K4 * y[5] * y[5] * root,
        ])
    }

    /// Returns ẏ1 to ẏ5 as functions of y.
    fn slopes(y: &[f64]) -> Result<[f64; 5], StepError> {
        let [r1, r2, r3, r4, r5] = Self::rates(y)?;
        let inflow = KLA * (P_CO2 / H - y[1]);
        Ok([
            -2.0 * r1 + r2 - r3 - r4,
            -0.5 * r1 - r4 - 0.5 * r5 + inflow,
            r1 - r2 + r3,
            -r2 + r3 - 2.0 * r4,
            r2 - r3 + r5,
        ])
    }
}

impl Sample for Akzo {
    fn start(&self) -> Start {
        let mut y = vec![0.444, 0.00123, 0.0, 0.007, 0.0, 0.0];
        y[5] = KS * y[0] * y[3];
        let slopes = Self::slopes(&y).expect("the initial concentrations are not negative");
        let mut y_dot = slopes.to_vec();
        y_dot.push(KS * (slopes[0] * y[3] + y[0] * slopes[3]));
        Start { t: 0.0, y, y_dot }
    }
}

impl Problem for Akzo {
    fn n_unknowns(&self) -> usize {
        6
    }

    fn residual(
        &mut self,
        _t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let slopes = Self::slopes(y)?;
        for i in 0..5 {
            residual[i] = slopes[i] - y_dot[i];
        }
        residual[5] = KS * y[0] * y[3] - y[5];
        Ok(())
    }

    fn jacobian(
        &mut self,
        _t: f64,
        y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let [r1, _, _, _, r5] = Self::rates(y)?;
        let root = y[1].sqrt();
        // Each entry contains a rate r, an unknown j, and the derivative ∂r/∂y_j.
        let slopes = [
            (0, 0, 4.0 * K1 * y[0].powi(3) * root),
            (0, 1, r1 / (2.0 * y[1])),
            (1, 2, K2 * y[3]),
            (1, 3, K2 * y[2]),
            (2, 0, K2 / K * y[4]),
            (2, 4, K2 / K * y[0]),
            (3, 0, K3 * y[3] * y[3]),
            (3, 3, 2.0 * K3 * y[0] * y[3]),
            (4, 1, r5 / (2.0 * y[1])),
            (4, 5, 2.0 * K4 * y[5] * root),
        ];
        // Coefficients of each rate in ẏ1 to ẏ5.
        let stoichiometry = [
            [-2.0, -0.5, 1.0, 0.0, 0.0],
            [1.0, 0.0, -1.0, -1.0, 1.0],
            [-1.0, 0.0, 1.0, 1.0, -1.0],
            [-1.0, -1.0, 0.0, -2.0, 0.0],
            [0.0, -0.5, 0.0, 0.0, 1.0],
        ];
        let mut matrix = FullMatrix::zeroed(6, values);
        for (rate, unknown, slope) in slopes {
            for (row, coefficient) in stoichiometry[rate].into_iter().enumerate() {
                matrix.add(row, unknown, a * coefficient * slope);
            }
        }
        matrix.add(1, 1, -a * KLA);
        for i in 0..5 {
            matrix.add(i, i, -b);
        }
        matrix.add(5, 0, a * KS * y[3]);
        matrix.add(5, 3, a * KS * y[0]);
        matrix.add(5, 5, -a);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; 6];
        kinds[5] = VariableKind::Algebraic;
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0, 0, 0, 0, 0, 1])
    }
}
