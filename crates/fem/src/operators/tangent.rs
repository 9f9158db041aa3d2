//! Element pass for all tangents, whose entries are scattered into fixed patterns.

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::operators::constitutive::{Constitutive, Tangent, Tensor};
use crate::operators::fields::{Fields, Inverted, Tangents};
use crate::operators::pass::Kernel;
use crate::operators::residual::{AtPoint, Local};
use crate::simd::batch::{Part, Point, add_dot, dot, dot_numbers};
use crate::simd::lanes::{Lanes, outlined};
use crate::space::sparsity::{NO_ENTRY, ScatterMap};

/// Element matrices `[a][b][i][k]` for nodes a ≤ b, where i is a component of node a and k is a component of node
/// b.
pub(crate) type Matrix<S, const D: usize, const N: usize> = [[Tensor<Lanes<S>, D>; N]; N];

/// Element divergences `[v][b][k]` for pressure v and component k of node b.
type Divergence<S, const D: usize, const N: usize, const P: usize> = [[[Lanes<S>; D]; N]; P];

/// Returns w J⁻¹ A J⁻ᵀ for i ≤ k. Both gradient directions are pulled back to the reference element, and the
/// result is multiplied by the quadrature weight.
#[inline(always)]
pub(crate) fn pull_back<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    a: &Tangent<Lanes<S>, D>,
) -> Tangent<Lanes<S>, D> {
    let weights = part.weights(point);
    let inverse = part.inverse();
    let mut out = [[[[part.zero(); D]; D]; D]; D];
    for i in 0..D {
        for k in i..D {
            for m in 0..D {
                // half[l] = w Σ_j inverse[m][j] A[i][k][j][l]
                let mut half = [part.zero(); D];
                for (l, half) in half.iter_mut().enumerate() {
                    let mut column = [part.zero(); D];
                    for (j, entry) in column.iter_mut().enumerate() {
                        let (j, l) = if i == k && j > l { (l, j) } else { (j, l) };
                        *entry = a[i][k][j][l];
                    }
                    *half = weights * dot(&inverse[m], &column);
                }
                // Diagonal blocks are symmetric.
                for n in 0..if i == k { m + 1 } else { D } {
                    let entry = dot(&half, &inverse[n]);
                    out[i][k][m][n] = entry;
                    if i == k {
                        out[i][k][n][m] = entry;
                    }
                }
            }
        }
    }
    out
}

/// Adds ∇φ_a : A : ∇φ_b at one point to the element matrices.
#[inline(always)]
fn accumulate<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut Matrix<S, D, N>,
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    a: &Tangent<Lanes<S>, D>,
) {
    let a = pull_back(part, point, a);
    for (b, gradient_b) in point.gradients.iter().enumerate() {
        // columns[i][k][m] = Σ_n A[i][k][m][n] ∂_n φ_b
        let mut columns = [[[part.zero(); D]; D]; D];
        for (i, columns) in columns.iter_mut().enumerate() {
            for (k, column) in columns.iter_mut().enumerate() {
                for (m, entry) in column.iter_mut().enumerate() {
                    let mut row = [part.zero(); D];
                    for (n, value) in row.iter_mut().enumerate() {
                        *value = if i <= k { a[i][k][m][n] } else { a[k][i][n][m] };
                    }
                    *entry = dot_numbers(&row, gradient_b);
                }
            }
        }
        for (gradient_a, row) in point.gradients.iter().zip(out.iter_mut()).take(b + 1) {
            for i in 0..D {
                for k in 0..D {
                    let entry = &mut row[b][i][k];
                    *entry = add_dot(&columns[i][k], gradient_a, *entry);
                }
            }
        }
    }
}

/// Calls [`accumulate`]. In 3D, this function is long and is therefore compiled as a separate function.
#[inline(always)]
pub(crate) fn add<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut Matrix<S, D, N>,
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    a: &Tangent<Lanes<S>, D>,
) {
    if D == 2 {
        accumulate(out, part, point, a);
    } else {
        let arguments = Accumulate { out, part, point, a };
        outlined(part.zero().simd(), arguments);
    }
}

/// Arguments of [`accumulate`].
struct Accumulate<'a, S: Simd, const D: usize, const N: usize, const P: usize> {
    out: &'a mut Matrix<S, D, N>,
    part: &'a Part<'a, S, D, N, P>,
    point: &'a Point<D, N, P>,
    a: &'a Tangent<Lanes<S>, D>,
}

impl<T: Simd, const D: usize, const N: usize, const P: usize> WithSimd
    for Accumulate<'_, T, D, N, P>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        accumulate(self.out, self.part, self.point, self.a);
    }
}

/// Adds ψ_v N : ∇φ_b at one point to the element divergences.
#[inline(always)]
fn accumulate_divergence<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut Divergence<S, D, N, P>,
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    cofactor: &Tensor<Lanes<S>, D>,
) {
    let cofactor = part.pull_back(point, cofactor);
    for (b, gradient) in point.gradients.iter().enumerate() {
        for (k, row) in cofactor.iter().enumerate() {
            let flux = dot_numbers(row, gradient);
            for (out, psi) in out.iter_mut().zip(point.psi) {
                let entry = &mut out[b][k];
                *entry = flux.mul_add(flux.like(psi), *entry);
            }
        }
    }
}

/// Adds element matrices to the global matrix, element by element. For symmetric matrices, only the upper blocks
/// are read.
#[inline(always)]
pub(crate) fn scatter<
    S: Simd,
    const D: usize,
    const N: usize,
    const P: usize,
    const SYMMETRIC: bool,
>(
    part: &Part<'_, S, D, N, P>,
    map: &ScatterMap<D, N, P>,
    local: &Matrix<S, D, N>,
    values: &mut [f64],
) {
    for (lane, l) in part.occupied().enumerate() {
        for (b, map) in map.displacement.iter().enumerate() {
            for (k, map) in map.iter().enumerate() {
                for (a, map) in map.iter().enumerate() {
                    for (i, indices) in map.iter().enumerate() {
                        let is_stored = !SYMMETRIC || a <= b;
                        let entries =
                            if is_stored { &local[a][b][i][k] } else { &local[b][a][k][i] };
                        add_entry(indices[l], entries.as_slice()[lane], values);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn scatter_divergence<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &Part<'_, S, D, N, P>,
    map: &ScatterMap<D, N, P>,
    local: &Divergence<S, D, N, P>,
    values: &mut [f64],
) {
    for (lane, l) in part.occupied().enumerate() {
        for (b, map) in map.divergence.iter().enumerate() {
            for (k, map) in map.iter().enumerate() {
                for (indices, row) in map.iter().zip(local) {
                    add_entry(indices[l], row[b][k].as_slice()[lane], values);
                }
            }
        }
    }
}

#[inline(always)]
pub(crate) fn add_entry(index: u32, entry: f64, values: &mut [f64]) {
    if index != NO_ENTRY {
        values[index as usize] += entry;
    }
}

/// Scales an element matrix, if it is present.
#[inline(always)]
fn scale<S: Simd, const D: usize, const N: usize>(
    local: &mut Option<Matrix<S, D, N>>,
    factor: f64,
) {
    let Some(local) = local.as_mut().filter(|_| factor != 1.0) else {
        return;
    };
    for entry in local.iter_mut().flatten().flatten().flatten() {
        *entry = *entry * factor;
    }
}

#[inline(always)]
pub(crate) fn zero_if<T: Copy>(requested: bool, zero: T) -> Option<T> {
    if requested { Some(zero) } else { None }
}

/// Kernel for the requested tangents.
pub(crate) struct Linearize<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) out: Tangents<'b>,
}

impl<const D: usize, const N: usize, const P: usize> Kernel<D, N, P>
    for Linearize<'_, '_, D, N, P>
{
    const SPLIT: bool = true;

    type Workspace<S: Simd> = ();

    fn clear(&mut self) {
        self.out.all_mut().for_each(|values| values.fill(0.0));
    }

    fn has_rates(&self) -> bool {
        self.out.has_rates()
    }

    #[inline(always)]
    fn part<S: Simd, C: Constitutive<D>, const RATES: bool>(
        &mut self,
        law: &C,
        part: &mut Part<'_, S, D, N, P>,
        points: &[Point<D, N, P>],
        batch: usize,
        (): &mut (),
    ) -> Result<(), Inverted> {
        let Self { maps, fields, out } = self;
        let map = &maps[batch];
        let local = Local::<S, D, N, P, RATES>::gather(part, fields, out.has_rates());
        let zero: Matrix<S, D, N> = [[[[part.zero(); D]; D]; N]; N];
        let mut stiffness =
            zero_if(out.stiffness.is_some() || out.damped_stiffness.is_some(), zero);
        let mut rate_stiffness = zero_if(RATES && out.rate_stiffness.is_some(), zero);
        let mut multiplier_stiffness = zero_if(RATES && out.multiplier_stiffness.is_some(), zero);
        let zero: Divergence<S, D, N, P> = [[[part.zero(); D]; N]; P];
        let mut divergence = zero_if(out.divergence.is_some(), zero);
        let mut divergence_rate = zero_if(RATES && out.divergence_rate.is_some(), zero);
        for (number, point) in points.iter().enumerate() {
            part.move_to(number);
            let at = AtPoint::new(law, part, (number, point), &local)?;
            if let Some(stiffness) = &mut stiffness {
                let a = law.tangent(&at.strain, at.volumetric, None);
                add(stiffness, part, point, &a);
            }
            if let Some(rate_stiffness) = &mut rate_stiffness {
                let a = law.tangent(&at.strain, at.volumetric, Some(&at.v));
                add(rate_stiffness, part, point, &a);
            }
            if let Some(multiplier_stiffness) = &mut multiplier_stiffness {
                let a = law.volume_tangent(&at.strain, at.mu);
                add(multiplier_stiffness, part, point, &a);
            }
            if let Some(divergence) = &mut divergence {
                accumulate_divergence(
                    divergence,
                    part,
                    point,
                    &law.volume_gradient(&at.strain, None),
                );
            }
            if let Some(divergence_rate) = &mut divergence_rate {
                let cofactor = law.volume_gradient(&at.strain, Some(&at.v));
                accumulate_divergence(divergence_rate, part, point, &cofactor);
            }
        }
        let beta = part.scale().beta;
        scale(&mut rate_stiffness, beta);
        if let (Some(local), Some(global)) = (&stiffness, &mut out.stiffness) {
            scatter::<S, D, N, P, true>(part, map, local, global);
        }
        if out.damped_stiffness.is_some() {
            scale(&mut stiffness, beta);
        }
        for (local, global) in [
            (&stiffness, &mut out.damped_stiffness),
            (&rate_stiffness, &mut out.rate_stiffness),
            (&multiplier_stiffness, &mut out.multiplier_stiffness),
        ] {
            if let (Some(local), Some(global)) = (local, global) {
                scatter::<S, D, N, P, true>(part, map, local, global);
            }
        }
        for (local, global) in
            [(&divergence, &mut out.divergence), (&divergence_rate, &mut out.divergence_rate)]
        {
            if let (Some(local), Some(global)) = (local, global) {
                scatter_divergence(part, map, local, global);
            }
        }
        Ok(())
    }
}
