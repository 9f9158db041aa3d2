//! Response of a law at a strain, including the volumetric terms and the factor: P, A and their rates.

use super::super::tensor::{VolumeFunction, Volumetric};
use super::super::{Dual, Real};
use super::law::Law3;
use super::strain::{Axes, Strain3};
use super::tensor::{Symmetric3, Tensor3Of, add_scaled3, scaled3};

impl<R: Real> Strain3<R> {
    /// Creates the finite or small strain at `h` = ∇u, depending on the law.
    #[inline(always)]
    pub fn new<W: Law3>(_: &W, h: Tensor3Of<R>, axes: Axes<R>) -> Self {
        Self::at(h, axes, W::FINITE)
    }

    /// Returns the strain as dual numbers whose rate is `v` = ∇v.
    #[inline(always)]
    pub(crate) fn moving<W: Law3>(&self, w: &W, v: &Tensor3Of<R>) -> Strain3<Dual<R>> {
        let zero = Dual::constant(self.d.like(0.0));
        let mut h = [[zero; 3]; 3];
        for ((row, value), rate) in h.iter_mut().zip(&self.h).zip(v) {
            for ((entry, value), rate) in row.iter_mut().zip(value).zip(rate) {
                *entry = Dual { value: *value, rate: *rate };
            }
        }
        let mut moving = Strain3::new(w, h, self.axes.constant());
        if let Some(factor) = self.factor {
            moving.factor = Some(Dual::constant(factor));
        }
        moving.volume_function = self.volume_function;
        moving
    }

    /// Returns g, the function of the volume that the pressure controls.
    #[inline(always)]
    pub(crate) fn volume(&self) -> R {
        self.volume_function.value(self.d)
    }

    /// Returns ∂g/∂F = g' N.
    #[inline(always)]
    pub(crate) fn volume_gradient(&self) -> Tensor3Of<R> {
        match self.volume_function {
            VolumeFunction::Quadratic => self.cofactor,
            function => scaled3(function.slope(self.d), &self.cofactor),
        }
    }

    /// Adds m ∂²g/∂F² = m (g' ∂N/∂F + g'' N⊗N) for finite strains.
    #[inline(always)]
    fn add_volume_tangent(&self, m: R, a: &mut Symmetric3<R>) {
        match self.volume_function {
            VolumeFunction::Quadratic => a.add_cofactor_slope(m, &self.f),
            function => {
                a.add_cofactor_slope(m * function.slope(self.d), &self.f);
                a.add_square(m * function.curvature(self.d), &self.cofactor);
            }
        }
    }

    /// Returns W times the factor, without the pressure term.
    #[inline(always)]
    pub(crate) fn energy<W: Law3>(&self, w: &W) -> R {
        match self.factor {
            Some(factor) => factor * w.energy(self),
            None => w.energy(self),
        }
    }

    /// Returns P = ∂W/∂F + (κ g − p) ∂g/∂F.
    #[inline(always)]
    pub(crate) fn stress<W: Law3>(&self, w: &W, volumetric: Volumetric<R>) -> Tensor3Of<R> {
        let mut stress = w.stress(self);
        if let Some(factor) = self.factor {
            stress = scaled3(factor, &stress);
        }
        add_scaled3(&mut stress, self.volume_slope(w, volumetric), &self.volume_gradient());
        stress
    }

    /// Returns A = ∂P/∂F.
    #[inline(always)]
    pub(crate) fn tangent<W: Law3>(&self, w: &W, volumetric: Volumetric<R>) -> Symmetric3<R> {
        let mut a = w.tangent(self);
        if let Some(factor) = self.factor {
            a.scale(factor);
        }
        if !W::COMPLETE {
            a.add_square(self.d.like(volumetric.kappa), &self.volume_gradient());
        }
        if W::FINITE {
            self.add_volume_tangent(self.volume_slope(w, volumetric), &mut a);
        }
        a
    }

    /// Returns κ g − p.
    #[inline(always)]
    fn volume_slope<W: Law3>(&self, _: &W, volumetric: Volumetric<R>) -> R {
        match self.volume_function {
            _ if W::COMPLETE => -volumetric.p,
            // Without a penalty, the logarithm need not be evaluated.
            VolumeFunction::Logarithmic if volumetric.kappa == 0.0 => -volumetric.p,
            function => function.value(self.d) * volumetric.kappa - volumetric.p,
        }
    }

    /// Returns Ṗ along `v` = ∇v and ṗ.
    #[inline(always)]
    pub(crate) fn stress_rate<W: Law3>(
        &self,
        w: &W,
        v: &Tensor3Of<R>,
        volumetric: Volumetric<R>,
    ) -> Tensor3Of<R> {
        rates(&self.moving(w, v).stress(w, volumetric.moving()))
    }

    /// Returns Ȧ, the derivative of A along `v` = ∇v and ṗ, which equals ∂Ṗ/∂F.
    #[inline(always)]
    pub(crate) fn tangent_rate<W: Law3>(
        &self,
        w: &W,
        v: &Tensor3Of<R>,
        volumetric: Volumetric<R>,
    ) -> Symmetric3<R> {
        let moving = self.moving(w, v).tangent(w, volumetric.moving());
        let mut out = Symmetric3::zero(self.d);
        for (entry, moving) in out.0.iter_mut().zip(&moving.0) {
            *entry = moving.rate;
        }
        out
    }

    /// Returns the derivative of ∂g/∂F along `v` = ∇v. The result is symmetric in H and V, and zero for small
    /// strains.
    #[inline(always)]
    pub(crate) fn volume_gradient_rate<W: Law3>(&self, w: &W, v: &Tensor3Of<R>) -> Tensor3Of<R> {
        rates(&self.moving(w, v).volume_gradient())
    }

    /// Returns m ∂²g/∂F², or zero for small strains.
    #[inline(always)]
    pub(crate) fn volume_tangent<W: Law3>(&self, _: &W, m: R) -> Symmetric3<R> {
        let mut a = Symmetric3::zero(m);
        if W::FINITE {
            self.add_volume_tangent(m, &mut a);
        }
        a
    }
}

#[inline(always)]
fn rates<R: Real>(moving: &Tensor3Of<Dual<R>>) -> Tensor3Of<R> {
    let mut out = [[moving[0][0].rate; 3]; 3];
    for (row, moving) in out.iter_mut().zip(moving) {
        for (entry, moving) in row.iter_mut().zip(moving) {
            *entry = moving.rate;
        }
    }
    out
}
