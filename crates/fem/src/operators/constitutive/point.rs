//! Evaluation of a 3D law at a single point, with the functions of the element passes.

use super::spatial::Spatial;
use super::{Constitutive, Tensor};
use crate::material::Law;
use crate::material::tensor::Volumetric;
use crate::material::three::{Axes, Strain3, Symmetric3, Tangent3, Tensor3, UPPER3};
use crate::simd::lanes::Lanes;

type Lane = Lanes<pulp::Scalar>;

fn lane(value: f64) -> Lane {
    Lanes::splat(pulp::Scalar::new(), value)
}

fn value(lane: Lane) -> f64 {
    lane.as_slice()[0]
}

fn tensor(t: Tensor3) -> Tensor<Lane, 3> {
    t.map(|row| row.map(lane))
}

fn full(a: &Symmetric3<Lane>) -> Tangent3 {
    UPPER3.map(|row| row.map(|index| value(a.0[index])))
}

fn volumetric(p: f64, p_rate: f64) -> Volumetric<Lane> {
    Volumetric { p: lane(p), p_rate: lane(p_rate), kappa: 0.0 }
}

fn strain(law: Spatial, h: Tensor3, axes: Axes<f64>) -> Strain3<Lane> {
    let axes = Axes { fiber: axes.fiber.map(lane), sheet: axes.sheet.map(lane) };
    law.strain(tensor(h), axes, None)
}

/// Evaluation at a point in 3D. Only laws with fibers use `axes`.
impl Law {
    /// Returns W at `h` = ∇u without the pressure term.
    pub fn energy3(self, h: Tensor3, axes: Axes<f64>) -> f64 {
        let law = Spatial::new(self);
        value(law.energy(&strain(law, h, axes)))
    }

    /// Returns the first Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tensor3 {
        let law = Spatial::new(self);
        let stress = law.stress(&strain(law, h, axes), volumetric(p, 0.0), None);
        stress.map(|row| row.map(value))
    }

    /// Returns Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ for `v` = ∇v.
    pub fn stress_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tensor3 {
        let (law, v) = (Spatial::new(self), tensor(v));
        let rate = law.stress(&strain(law, h, axes), volumetric(p, p_rate), Some(&v));
        rate.map(|row| row.map(value))
    }

    /// Returns ∂P/∂F at fixed p.
    pub fn tangent3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tangent3 {
        let law = Spatial::new(self);
        full(&law.packed_tangent(&strain(law, h, axes), volumetric(p, 0.0), None))
    }

    /// Returns the bulk modulus and the shear modulus (Pa) at small strains, computed from the stress of the law.
    /// For a law with fibers, these are means over all directions (Voigt average).
    pub fn moduli(self) -> [f64; 2] {
        let c = self.tangent3([[0.0; 3]; 3], 0.0, Axes::cartesian(0.0));
        // Sums of C_iijj and C_ijij.
        let normal = [0, 4, 8];
        let dilation: f64 = normal.iter().flat_map(|&i| normal.map(|j| c[i][j])).sum();
        let trace: f64 = (0..9).map(|i| c[i][i]).sum();
        [dilation / 9.0, (3.0 * trace - dilation) / 30.0]
    }

    /// Returns ∂Ṗ/∂F at fixed ∇v, p and ṗ, which is the rate of the tangent along `v` = ∇v.
    pub fn tangent_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tangent3 {
        let (law, v) = (Spatial::new(self), tensor(v));
        full(&law.packed_tangent(&strain(law, h, axes), volumetric(p, p_rate), Some(&v)))
    }

    /// Returns J − 1, or div u for small strains.
    pub fn volume_change3(self, h: Tensor3) -> f64 {
        let law = Spatial::new(self);
        value(strain(law, h, Axes::cartesian(0.0)).d)
    }

    /// Returns ∂(J − 1)/∂F = cof F, or I for small strains.
    pub fn volume_gradient3(self, h: Tensor3) -> Tensor3 {
        let law = Spatial::new(self);
        strain(law, h, Axes::cartesian(0.0)).cofactor.map(|row| row.map(value))
    }
}
