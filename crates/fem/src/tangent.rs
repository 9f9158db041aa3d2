//! One pass over the elements for all tangents, scattered into fixed patterns.

use pulp::{Simd, WithSimd};

use crate::batch::{Batch, Batches, LANES, Lanes, Point, TensorLanes, lane, tensor_lanes};
use crate::material::tensor::{
    UPPER, tangent, tangent_rate, volume_gradient, volume_gradient_rate, volume_tangent,
};
use crate::material::{Potential, with_potential};
use crate::residual::{AtPoint, Local};
use crate::solid::{Fields, Inverted, Tangents};
use crate::sparsity::{NOWHERE, Places, ScatterMap};

/// Element matrices: `[a][b][i][k]` for nodes a ≤ b, components i of a and k of b.
type Matrix<const N: usize> = [[[[Lanes; 2]; 2]; N]; N];

/// Element divergences: `[v][b][k]` for vertex v, component k of node b.
type Divergence<const N: usize> = [[[Lanes; 2]; N]; 3];

/// A tangent per element: its upper triangle as in [`UPPER`].
type TangentLanes = [Lanes; 10];

/// The [`TangentLanes`] of an expression in the lane's number.
macro_rules! tangent_lanes {
    ($l:ident => $value:expr) => {{
        let mut lanes = [Lanes::ZERO; 10];
        for $l in 0..LANES {
            let tangent = $value;
            for (lanes, entry) in lanes.iter_mut().zip(tangent.0) {
                lanes.0[$l] = entry;
            }
        }
        lanes
    }};
}

/// w J⁻¹ A J⁻ᵀ: both gradient directions pulled back to the reference triangle, times the
/// quadrature weight. Rows and columns (i, m) → 2 i + m.
#[inline(always)]
fn pull_back<const N: usize>(batch: &Batch<N>, point: &Point<N>, a: &TangentLanes) -> TangentLanes {
    let weights = batch.weights(point);
    let inverse = &batch.inverse;
    let mut out = [Lanes::ZERO; 10];
    for (i, k) in [(0, 0), (0, 1), (1, 1)] {
        for m in 0..2 {
            // half[n] = w Σ_j inverse[m][j] A[(i, j), (k, n)]
            let mut half = [Lanes::ZERO; 2];
            for (n, half) in half.iter_mut().enumerate() {
                let (left, right) = (a[UPPER[2 * i][2 * k + n]], a[UPPER[2 * i + 1][2 * k + n]]);
                *half = weights * (inverse[m][0] * left + inverse[m][1] * right);
            }
            // The lower triangle of a diagonal block writes the same place twice.
            for n in 0..2 {
                out[UPPER[2 * i + m][2 * k + n]] =
                    half[0] * inverse[n][0] + half[1] * inverse[n][1];
            }
        }
    }
    out
}

/// Adds ∇φ_a : A : ∇φ_b of one point to the element matrices.
#[inline(always)]
fn accumulate<const N: usize>(
    out: &mut Matrix<N>,
    batch: &Batch<N>,
    point: &Point<N>,
    a: &TangentLanes,
) {
    let a = pull_back(batch, point, a);
    for (b, gradient_b) in point.gradients.iter().enumerate() {
        // column[k][r] = Σ_n A[r, (k, n)] ∂_n φ_b
        let mut column = [[Lanes::ZERO; 4]; 2];
        for (k, column) in column.iter_mut().enumerate() {
            for (r, entry) in column.iter_mut().enumerate() {
                *entry =
                    a[UPPER[r][2 * k]] * gradient_b[0] + a[UPPER[r][2 * k + 1]] * gradient_b[1];
            }
        }
        for (gradient_a, row) in point.gradients.iter().zip(out.iter_mut()).take(b + 1) {
            for i in 0..2 {
                for k in 0..2 {
                    row[b][i][k] +=
                        column[k][2 * i] * gradient_a[0] + column[k][2 * i + 1] * gradient_a[1];
                }
            }
        }
    }
}

/// Adds ψ_v N : ∇φ_b of one point to the element divergences.
#[inline(always)]
fn accumulate_divergence<const N: usize>(
    out: &mut Divergence<N>,
    batch: &Batch<N>,
    point: &Point<N>,
    normal: &TensorLanes,
) {
    let normal = batch.pull_back(point, normal);
    for (b, gradient) in point.gradients.iter().enumerate() {
        for (k, row) in normal.iter().enumerate() {
            let flux = row[0] * gradient[0] + row[1] * gradient[1];
            for (out, psi) in out.iter_mut().zip(point.psi) {
                out[b][k] += flux * psi;
            }
        }
    }
}

#[inline(always)]
fn scatter<const N: usize>(map: &ScatterMap<N>, local: &Matrix<N>, values: &mut [f64]) {
    for (b, map) in map.displacement.iter().enumerate() {
        for (k, map) in map.iter().enumerate() {
            for (a, map) in map.iter().enumerate() {
                for (i, places) in map.iter().enumerate() {
                    let entries = if a <= b {
                        &local[a][b][i][k]
                    } else {
                        &local[b][a][k][i]
                    };
                    add(places, entries, values);
                }
            }
        }
    }
}

#[inline(always)]
fn scatter_divergence<const N: usize>(
    map: &ScatterMap<N>,
    local: &Divergence<N>,
    values: &mut [f64],
) {
    for (b, map) in map.divergence.iter().enumerate() {
        for (k, map) in map.iter().enumerate() {
            for (places, row) in map.iter().zip(local) {
                add(places, &row[b][k], values);
            }
        }
    }
}

#[inline(always)]
fn add(places: &Places, entries: &Lanes, values: &mut [f64]) {
    for (&place, entry) in places.iter().zip(entries.0) {
        if place != NOWHERE {
            values[place as usize] += entry;
        }
    }
}

#[inline(always)]
fn tangents_batch<const N: usize, W: Potential>(
    w: &W,
    batch: &Batch<N>,
    map: &ScatterMap<N>,
    points: &[Point<N>],
    fields: &Fields<'_>,
    out: &mut Tangents<'_>,
) -> Result<(), Inverted> {
    let local = Local::gather(batch, fields);
    let zero: Matrix<N> = [[[[Lanes::ZERO; 2]; 2]; N]; N];
    let (mut stiffness, mut rate_stiffness, mut multiplier_stiffness) = (zero, zero, zero);
    let zero: Divergence<N> = [[[Lanes::ZERO; 2]; N]; 3];
    let (mut divergence, mut divergence_rate) = (zero, zero);
    let rates = out.rate_stiffness.is_some() || out.divergence_rate.is_some();
    for point in points {
        let at = AtPoint::new(w, batch, point, &local, rates)
            .map_err(|(l, jacobian)| Inverted::new(batch.elements[l], point.psi, jacobian))?;
        let (h, v) = (&at.h, &at.v);
        if out.stiffness.is_some() {
            let a = tangent_lanes!(l => tangent(w, lane(h, l), at.volumetric(l)));
            accumulate(&mut stiffness, batch, point, &a);
        }
        if out.rate_stiffness.is_some() {
            let a = tangent_lanes!(l => tangent_rate(w, lane(h, l), lane(v, l), at.volumetric(l)));
            accumulate(&mut rate_stiffness, batch, point, &a);
        }
        if out.multiplier_stiffness.is_some() {
            let a = tangent_lanes!(l => volume_tangent(w, at.mu.0[l]));
            accumulate(&mut multiplier_stiffness, batch, point, &a);
        }
        if out.divergence.is_some() {
            let normal = tensor_lanes!(l => volume_gradient(w, lane(h, l)));
            accumulate_divergence(&mut divergence, batch, point, &normal);
        }
        if out.divergence_rate.is_some() {
            let normal = tensor_lanes!(l => volume_gradient_rate(w, lane(v, l)));
            accumulate_divergence(&mut divergence_rate, batch, point, &normal);
        }
    }
    for (local, global) in [
        (&stiffness, &mut out.stiffness),
        (&rate_stiffness, &mut out.rate_stiffness),
        (&multiplier_stiffness, &mut out.multiplier_stiffness),
    ] {
        if let Some(global) = global {
            scatter(map, local, global);
        }
    }
    for (local, global) in [
        (&divergence, &mut out.divergence),
        (&divergence_rate, &mut out.divergence_rate),
    ] {
        if let Some(global) = global {
            scatter_divergence(map, local, global);
        }
    }
    Ok(())
}

/// The pass over all batches, to be run with the processor's vector instructions.
pub(crate) struct Linearize<'a, 'b, const N: usize> {
    pub(crate) elements: &'a Batches<N>,
    pub(crate) maps: &'a [ScatterMap<N>],
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) out: &'a mut Tangents<'b>,
}

impl<const N: usize> WithSimd for Linearize<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self {
            elements,
            maps,
            fields,
            out,
        } = self;
        for values in out.all_mut() {
            values.fill(0.0);
        }
        for (batch, map) in elements.batches.iter().zip(maps) {
            with_potential!(batch.law, w => {
                tangents_batch(&w, batch, map, &elements.points, fields, out)
            })?;
        }
        Ok(())
    }
}
