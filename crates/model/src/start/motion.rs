//! Displacement, velocity and acceleration at all nodes, and the terms of the constraint.

use myovib_fem::{Fields, Inverted, Pressure, Vectors};
use nalgebra_sparse::CscMatrix;

use crate::muscle::Muscle;
use crate::operators;

/// Strain of the displaced bodies from which central differences are computed.
const SMALL_STRAIN: f64 = 1e-3;

/// A motion of the body at one point in time, including prescribed components.
#[derive(Debug, Clone)]
pub(crate) struct Motion<'a> {
    muscle: &'a Muscle,
    pub(crate) displacement: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// Creates the motion at time `t` with the free components `q`, `v` and `v_dot`.
    pub(crate) fn new(muscle: &'a Muscle, t: f64, q: &[f64], v: &[f64], v_dot: &[f64]) -> Self {
        let dofs = muscle.solid.dofs();
        let nodal = |free: &[f64]| {
            let mut full = vec![0.0; dofs.n_full()];
            dofs.expand(free, &mut full);
            full
        };
        let (mut displacement, mut velocity, mut acceleration) = (nodal(q), nodal(v), nodal(v_dot));
        for prescribed in &muscle.prescribed {
            let motion = prescribed.signal.at(t);
            displacement[prescribed.component] = motion.value;
            velocity[prescribed.component] = motion.d1;
            acceleration[prescribed.component] = motion.d2;
        }
        Self { muscle, displacement, velocity, acceleration }
    }

    fn vectors(&self, u: &[f64], w: &[f64], out: &mut Vectors<'_>) -> Result<(), Inverted> {
        let pressure = operators::no_pressure(&self.muscle.solid);
        let fields = Fields { v: Some(w), ..Fields::new(u, Pressure::Nodal(&pressure)) };
        self.muscle.solid.evaluate(&fields, out)
    }

    /// Computes ∫ψ g(J).
    pub(crate) fn volume_residual(&self) -> Result<Vec<f64>, Inverted> {
        let mut volume_residual = vec![0.0; self.muscle.solid.space().n_pressures()];
        let mut out = Vectors { volume_residual: Some(&mut volume_residual), ..Vectors::default() };
        self.vectors(&self.displacement, &self.velocity, &mut out)?;
        Ok(volume_residual)
    }

    /// Computes ∫ψ g' cof F(u):∇w for nodal u and w.
    fn flux_at(&self, u: &[f64], w: &[f64]) -> Result<Vec<f64>, Inverted> {
        let mut flux = vec![0.0; self.muscle.solid.space().n_pressures()];
        let mut out = Vectors { volume_residual_rate: Some(&mut flux), ..Vectors::default() };
        self.vectors(u, w, &mut out)?;
        Ok(flux)
    }

    /// Computes the first derivative of ∫ψ g(J) with respect to time: ∫ψ g' cof F:∇v.
    pub(crate) fn volume_residual_rate(&self) -> Result<Vec<f64>, Inverted> {
        self.flux_at(&self.displacement, &self.velocity)
    }

    /// Computes the second derivative of ∫ψ g(J) with respect to time: ∫ψ (N:∇v̇ + (∂N/∂F:∇v):∇v) with N = g' cof F.
    ///
    /// The solid provides no product with ∂N/∂F for nodal v. Therefore the second term is the central difference of ∫ψ
    /// N:∇v between the bodies displaced by ±τ v. For g = J - 1, it is exact, because cof F is a polynomial of degree 1
    /// in plane strain and 2 in 3D. For g = ln J, its relative error is about the square of the strain of τ v.
    pub(crate) fn volume_residual_acceleration(&self) -> Result<Vec<f64>, Inverted> {
        let mut sum = self.flux_at(&self.displacement, &self.acceleration)?;
        let fastest = largest(&self.velocity);
        if fastest > 0.0 {
            let time = SMALL_STRAIN * operators::element_size(&self.muscle.solid) / fastest;
            let shifted = |time: f64| {
                let motion = self.displacement.iter().zip(&self.velocity);
                let u: Vec<f64> = motion.map(|(u, v)| u + time * v).collect();
                self.flux_at(&u, &self.velocity)
            };
            let (before, after) = (shifted(-time)?, shifted(time)?);
            for ((sum, after), before) in sum.iter_mut().zip(after).zip(before) {
                *sum += (after - before) / (2.0 * time);
            }
        }
        Ok(sum)
    }

    /// Computes the matrix B(q) for the free components.
    pub(crate) fn divergence(&self) -> Result<CscMatrix<f64>, Inverted> {
        operators::divergence(&self.muscle.solid, &self.displacement)
    }
}

/// Returns max |x_i|.
pub(crate) fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}
