//! Element pass for products of the tangents with several directions.
//!
//! The moduli at each point are pulled back to the reference element once for all directions, and no matrix is
//! assembled. For a few directions, this is faster than assembling the matrices.

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::operators::constitutive::{Constitutive, Tangent, Tensor};
use crate::operators::fields::{Change, Fields, Inverted, TangentProduct};
use crate::operators::pass::Kernel;
use crate::operators::residual::{AtPoint, Local};
use crate::operators::tangent::pull_back;
use crate::simd::batch::{Part, Point, add_dot, add_scaled};
use crate::simd::lanes::{Lanes, outlined};

/// Moduli at a quadrature point of a part. They are pulled back and multiplied by the quadrature weight.
pub(crate) struct Moduli<S: Simd, const D: usize> {
    /// Tangent ∂P/∂F.
    tangent: Tangent<Lanes<S>, D>,
    /// Tangent ∂(P + β Ṗ)/∂F.
    total: Tangent<Lanes<S>, D>,
    cofactor: Tensor<Lanes<S>, D>,
    cofactor_rate: Tensor<Lanes<S>, D>,
}

/// Returns the gradient of a displacement-like field in reference coordinates.
#[inline(always)]
fn reference_gradient<S: Simd, const D: usize, const N: usize, const P: usize>(
    zero: Lanes<S>,
    u: &[[Lanes<S>; D]; N],
    point: &Point<D, N, P>,
) -> Tensor<Lanes<S>, D> {
    let mut gradient = [[zero; D]; D];
    for (value, slopes) in u.iter().zip(&point.gradients) {
        for (row, value) in gradient.iter_mut().zip(value) {
            for (entry, &slope) in row.iter_mut().zip(slopes) {
                *entry = value.mul_add(zero.like(slope), *entry);
            }
        }
    }
    gradient
}

/// Adds A : G to `flux`, where the pulled-back tangent A is given by its blocks with i ≤ k.
#[inline(always)]
fn add_contracted<S: Simd, const D: usize>(
    flux: &mut Tensor<Lanes<S>, D>,
    a: &Tangent<Lanes<S>, D>,
    gradient: &Tensor<Lanes<S>, D>,
) {
    for i in 0..D {
        for k in 0..D {
            for m in 0..D {
                for n in 0..D {
                    let entry = if i <= k { a[i][k][m][n] } else { a[k][i][n][m] };
                    flux[i][m] = entry.mul_add(gradient[k][n], flux[i][m]);
                }
            }
        }
    }
}

/// Returns `sum` + x : y.
#[inline(always)]
fn add_double_dot<S: Simd, const D: usize>(
    x: &Tensor<Lanes<S>, D>,
    y: &Tensor<Lanes<S>, D>,
    mut sum: Lanes<S>,
) -> Lanes<S> {
    for (x, y) in x.iter().zip(y) {
        for (x, y) in x.iter().zip(y) {
            sum = x.mul_add(*y, sum);
        }
    }
    sum
}

#[inline(always)]
fn moduli<S: Simd, const D: usize, const N: usize, const P: usize, C: Constitutive<D>>(
    law: &C,
    part: &mut Part<'_, S, D, N, P>,
    points: &[Point<D, N, P>],
    (fields, at): (&Fields<'_>, TangentProduct),
    out: &mut Vec<Moduli<S, D>>,
) -> Result<(), Inverted> {
    let local = Local::<S, D, N, P, true>::gather(part, fields, at.has_rates());
    let beta = part.zero().like(at.beta * part.scale().beta);
    out.clear();
    for (number, point) in points.iter().enumerate() {
        part.move_to(number);
        let state = AtPoint::new(law, part, (number, point), &local)?;
        let a = law.tangent(&state.strain, state.volumetric, None);
        let tangent = pull_back(part, point, &a);
        let mut total = tangent;
        if at.beta > 0.0 {
            let a = law.tangent(&state.strain, state.volumetric, Some(&state.v));
            let rate = pull_back(part, point, &a);
            for i in 0..D {
                for k in i..D {
                    for m in 0..D {
                        for n in 0..D {
                            total[i][k][m][n] = beta.mul_add(rate[i][k][m][n], total[i][k][m][n]);
                        }
                    }
                }
            }
        }
        let mut cofactor_rate = [[part.zero(); D]; D];
        if at.has_rates() {
            cofactor_rate =
                part.pull_back(point, &law.volume_gradient(&state.strain, Some(&state.v)));
        }
        out.push(Moduli {
            tangent,
            total,
            cofactor: part.pull_back(point, &law.volume_gradient(&state.strain, None)),
            cofactor_rate,
        });
    }
    Ok(())
}

/// Adds the changes along one direction to the results.
#[inline(always)]
fn add_change<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &Part<'_, S, D, N, P>,
    points: &[Point<D, N, P>],
    at: TangentProduct,
    moduli: &[Moduli<S, D>],
    change: &mut Change<'_>,
) {
    let zero = part.zero();
    let beta = zero.like(at.beta * part.scale().beta);
    let u = part.gather_vector(Some(change.u));
    let v = part.gather_vector(change.v.filter(|_| at.has_rates()));
    let p = part.gather_scalar(change.p);
    let p_rate = part.gather_scalar(change.p_rate.filter(|_| at.has_rates()));
    let (mut force, mut volume_residual) = ([[zero; D]; N], [zero; P]);
    for (point, moduli) in points.iter().zip(moduli) {
        let by_u = reference_gradient(zero, &u, point);
        let pressure = part.interpolate(&p, point);
        let mut flux = [[zero; D]; D];
        add_contracted(&mut flux, &moduli.total, &by_u);
        let mut rate = zero;
        if at.has_rates() {
            let by_v = reference_gradient(zero, &v, point);
            rate = add_double_dot(&moduli.cofactor, &by_v, rate);
            rate = add_double_dot(&moduli.cofactor_rate, &by_u, rate);
            if at.beta > 0.0 {
                let mut damped = [[zero; D]; D];
                add_contracted(&mut damped, &moduli.tangent, &by_v);
                add_scaled(&mut damped, -pressure, &moduli.cofactor_rate);
                let pressure_rate = part.interpolate(&p_rate, point);
                add_scaled(&mut damped, -pressure_rate, &moduli.cofactor);
                add_scaled(&mut flux, beta, &damped);
            }
        }
        add_scaled(&mut flux, -pressure, &moduli.cofactor);
        for (node, gradient) in force.iter_mut().zip(&point.gradients) {
            for (sum, row) in node.iter_mut().zip(&flux) {
                *sum = add_dot(row, gradient, *sum);
            }
        }
        let constraint = match at.constraint_rate {
            true => rate,
            false => add_double_dot(&moduli.cofactor, &by_u, zero),
        };
        for (sum, psi) in volume_residual.iter_mut().zip(point.psi) {
            *sum = constraint.mul_add(zero.like(psi), *sum);
        }
    }
    part.scatter_vector(&force, change.force);
    if let Some(global) = &mut change.volume_residual {
        part.scatter_scalar(&volume_residual, global);
    }
}

/// Kernel for products with several directions.
pub(crate) struct Multiply<'a, 'b> {
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) at: TangentProduct,
    pub(crate) changes: &'a mut [Change<'b>],
}

impl<const D: usize, const N: usize, const P: usize> Kernel<D, N, P> for Multiply<'_, '_> {
    type Workspace<S: Simd> = Vec<Moduli<S, D>>;

    fn clear(&mut self) {
        for change in self.changes.iter_mut() {
            change.force.fill(0.0);
            let volume_residual = change.volume_residual.as_deref_mut();
            volume_residual.unwrap_or_default().fill(0.0);
        }
    }

    #[inline(always)]
    fn part<S: Simd, C: Constitutive<D>, const RATES: bool>(
        &mut self,
        law: &C,
        part: &mut Part<'_, S, D, N, P>,
        points: &[Point<D, N, P>],
        _: usize,
        moduli_at_points: &mut Vec<Moduli<S, D>>,
    ) -> Result<(), Inverted> {
        let at = self.at;
        moduli(law, part, points, (self.fields, at), moduli_at_points)?;
        let changes =
            Changes { part, points, at, moduli: moduli_at_points, changes: &mut *self.changes };
        // This function is compiled once for all laws.
        outlined(part.zero().simd(), changes);
        Ok(())
    }
}

/// Arguments of [`add_change`] for all directions.
struct Changes<'a, 'b, S: Simd, const D: usize, const N: usize, const P: usize> {
    part: &'a Part<'a, S, D, N, P>,
    points: &'a [Point<D, N, P>],
    at: TangentProduct,
    moduli: &'a [Moduli<S, D>],
    changes: &'a mut [Change<'b>],
}

impl<T: Simd, const D: usize, const N: usize, const P: usize> WithSimd
    for Changes<'_, '_, T, D, N, P>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for change in self.changes {
            add_change(self.part, self.points, self.at, self.moduli, change);
        }
    }
}
