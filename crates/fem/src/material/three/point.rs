//! A law at one point of a body of three dimensions.

use super::super::tensor::Volumetric;
use super::super::{Law, with_law};
use super::strain::{Axes, Strain3};
use super::tensor::UPPER3;
use super::{Tensor3, Tensor3Of};

/// A derivative of a tensor by a tensor; entry (i, J) has row and column 3 i + J.
pub type Tangent3 = [[f64; 9]; 9];

/// The law in three dimensions; `axes` count for laws with fibres only.
impl Law {
    /// W at `h` = ∇u, without the pressure's part.
    pub fn energy3(self, h: Tensor3, axes: Axes<f64>) -> f64 {
        with_law!(
            self,
            w => Strain3::new(&w, h, axes).energy(&w),
            own => own.energy(&Strain3::at(h, axes, own.is_finite()))
        )
    }

    /// First Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tensor3 {
        let volumetric = Volumetric::pressure(p);
        with_law!(
            self,
            w => Strain3::new(&w, h, axes).stress(&w, volumetric),
            own => own.stress(&Strain3::at(h, axes, own.is_finite()), &volumetric, None)
        )
    }

    /// Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ, with `v` = ∇v.
    pub fn stress_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tensor3 {
        let volumetric = Volumetric {
            p,
            p_rate,
            kappa: 0.0,
        };
        with_law!(
            self,
            w => Strain3::new(&w, h, axes).stress_rate(&w, &v, volumetric),
            own => own.stress(&Strain3::at(h, axes, own.is_finite()), &volumetric, Some(&v))
        )
    }

    /// ∂P/∂F at fixed p.
    pub fn tangent3(self, h: Tensor3, p: f64, axes: Axes<f64>) -> Tangent3 {
        let volumetric = Volumetric::pressure(p);
        let a = with_law!(
            self,
            w => Strain3::new(&w, h, axes).tangent(&w, volumetric),
            own => own.tangent(&Strain3::at(h, axes, own.is_finite()), &volumetric, None)
        );
        UPPER3.map(|row| row.map(|place| a.0[place]))
    }

    /// ∂Ṗ/∂F at fixed ∇v, p, ṗ: the rate of the tangent along `v` = ∇v.
    pub fn tangent_rate3(
        self,
        h: Tensor3,
        v: Tensor3,
        [p, p_rate]: [f64; 2],
        axes: Axes<f64>,
    ) -> Tangent3 {
        let volumetric = Volumetric {
            p,
            p_rate,
            kappa: 0.0,
        };
        let a = with_law!(
            self,
            w => Strain3::new(&w, h, axes).tangent_rate(&w, &v, volumetric),
            own => own.tangent(&Strain3::at(h, axes, own.is_finite()), &volumetric, Some(&v))
        );
        UPPER3.map(|row| row.map(|place| a.0[place]))
    }

    /// J − 1, or div u for small strains.
    pub fn volume_change3(self, h: Tensor3) -> f64 {
        Strain3::at(h, Axes::cartesian(0.0), !self.is_linear()).d
    }

    /// ∂(J − 1)/∂F = cof F, or I for small strains.
    pub fn volume_gradient3(self, h: Tensor3) -> Tensor3Of<f64> {
        Strain3::at(h, Axes::cartesian(0.0), !self.is_linear()).normal
    }
}
