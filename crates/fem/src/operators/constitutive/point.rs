//! A law at one point of a body in space, by the functions of the element loops on one number.

use pulp::Scalar;

use super::spatial::Spatial;
use super::{Constitutive, Tensor};
use crate::material::Law;
use crate::material::tensor::Volumetric;
use crate::material::three::{Axes, Strain3, Symmetric3, Tangent3, Tensor3, UPPER3};
use crate::simd::lanes::Lanes;

/// One number.
type One = Lanes<Scalar>;

fn one(value: f64) -> One {
    Lanes::splat(Scalar::new(), value)
}

fn number(one: One) -> f64 {
    one.as_slice()[0]
}

fn tensor(t: Tensor3) -> Tensor<One, 3> {
    t.map(|row| row.map(one))
}

fn full(a: &Symmetric3<One>) -> Tangent3 {
    UPPER3.map(|row| row.map(|place| number(a.0[place])))
}

fn volumetric(p: f64, p_rate: f64) -> Volumetric<One> {
    Volumetric {
        p: one(p),
        p_rate: one(p_rate),
        kappa: 0.0,
    }
}

fn strain(law: Spatial, h: Tensor3, axes: Axes<f64>) -> Strain3<One> {
    let axes = Axes {
        fibre: axes.fibre.map(one),
        sheet: axes.sheet.map(one),
    };
    law.strain(tensor(h), axes, None)
}

/// The law in three dimensions; `axes` count for laws with fibres only.
impl Law {
    /// W at `h` = ∇u, without the pressure's part.
    pub fn energy3(self, h: Tensor3, axes: Axes<f64>) -> f64 {
        let law = Spatial(self);
        number(law.energy(&strain(law, h, axes)))
    }

    /// First Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tensor3 {
        let law = Spatial(self);
        let stress = law.stress_along(&strain(law, h, axes), volumetric(p, 0.0), None);
        stress.map(|row| row.map(number))
    }

    /// Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ, with `v` = ∇v.
    pub fn stress_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tensor3 {
        let (law, v) = (Spatial(self), tensor(v));
        let rate = law.stress_along(&strain(law, h, axes), volumetric(p, p_rate), Some(&v));
        rate.map(|row| row.map(number))
    }

    /// ∂P/∂F at fixed p.
    pub fn tangent3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tangent3 {
        let law = Spatial(self);
        full(&law.slope_along(&strain(law, h, axes), volumetric(p, 0.0), None))
    }

    /// ∂Ṗ/∂F at fixed ∇v, p, ṗ: the rate of the tangent along `v` = ∇v.
    pub fn tangent_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tangent3 {
        let (law, v) = (Spatial(self), tensor(v));
        full(&law.slope_along(&strain(law, h, axes), volumetric(p, p_rate), Some(&v)))
    }

    /// J − 1, or div u for small strains.
    pub fn volume_change3(self, h: Tensor3) -> f64 {
        let law = Spatial(self);
        number(strain(law, h, Axes::cartesian(0.0)).d)
    }

    /// ∂(J − 1)/∂F = cof F, or I for small strains.
    pub fn volume_gradient3(self, h: Tensor3) -> Tensor3 {
        let law = Spatial(self);
        strain(law, h, Axes::cartesian(0.0))
            .normal
            .map(|row| row.map(number))
    }
}
