//! One pass over the elements for all tangents, scattered into fixed patterns.

use crate::batch::{Batch, Batches, LANES, Lanes, Point, TensorLanes, lane, set_lane};
use crate::material::tensor::{
    Symmetric, UPPER, tangent, tangent_rate, volume_gradient, volume_gradient_rate, volume_tangent,
};
use crate::material::{Potential, Tensor, with_potential};
use crate::residual::{AtPoint, Local};
use crate::solid::{Fields, Inverted, Tangents};
use crate::sparsity::{NOWHERE, Places, ScatterMap};

/// Element matrices: `[a][b][i][k]` for nodes a ≤ b, components i of a and k of b.
type Matrix<const N: usize> = [[[[Lanes; 2]; 2]; N]; N];

/// Element divergences: `[v][b][k]` for vertex v, component k of node b.
type Divergence<const N: usize> = [[[Lanes; 2]; N]; 3];

/// A at one point, both gradient directions pulled back to the reference triangle, times the
/// quadrature weight. Rows and columns (i, m) → 2 i + m as in [`UPPER`].
#[inline(always)]
fn pull_back<const N: usize>(
    batch: &Batch<N>,
    point: &Point<N>,
    a: impl Fn(usize) -> Symmetric,
) -> [Lanes; 10] {
    let weights = batch.weights(point);
    let mut out = [Lanes::ZERO; 10];
    for l in 0..LANES {
        let (a, inverse) = (a(l).0, lane(&batch.inverse, l));
        for i in 0..2 {
            for k in i..2 {
                for m in 0..2 {
                    // half[n] = Σ_j inverse[m][j] A[(i, j), (k, n)]
                    let half = |n: usize| {
                        inverse[m][0] * a[UPPER[2 * i][2 * k + n]]
                            + inverse[m][1] * a[UPPER[2 * i + 1][2 * k + n]]
                    };
                    for n in if i == k { m } else { 0 }..2 {
                        out[UPPER[2 * i + m][2 * k + n]].0[l] =
                            weights.0[l] * (half(0) * inverse[n][0] + half(1) * inverse[n][1]);
                    }
                }
            }
        }
    }
    out
}

/// Adds ∇φ_a : A : ∇φ_b of one point to the element matrices.
#[inline(always)]
fn accumulate<const N: usize>(out: &mut Matrix<N>, point: &Point<N>, a: &[Lanes; 10]) {
    for (b, gradient_b) in point.gradients.iter().enumerate() {
        // column[k][r] = Σ_n A[r, (k, n)] ∂_n φ_b
        let mut column = [[Lanes::ZERO; 4]; 2];
        for (k, column) in column.iter_mut().enumerate() {
            for (r, entry) in column.iter_mut().enumerate() {
                let (left, right) = (&a[UPPER[r][2 * k]], &a[UPPER[r][2 * k + 1]]);
                for l in 0..LANES {
                    entry.0[l] = left.0[l] * gradient_b[0] + right.0[l] * gradient_b[1];
                }
            }
        }
        for (gradient_a, row) in point.gradients.iter().zip(out.iter_mut()).take(b + 1) {
            for i in 0..2 {
                for k in 0..2 {
                    for l in 0..LANES {
                        row[b][i][k].0[l] += gradient_a[0] * column[k][2 * i].0[l]
                            + gradient_a[1] * column[k][2 * i + 1].0[l];
                    }
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
    normal: impl Fn(usize) -> Tensor,
) {
    let weights = batch.weights(point);
    let mut pulled_back: TensorLanes = [[Lanes::ZERO; 2]; 2];
    for l in 0..LANES {
        let (normal, inverse) = (normal(l), lane(&batch.inverse, l));
        let entry = |k: usize, n: usize| {
            weights.0[l] * (normal[k][0] * inverse[n][0] + normal[k][1] * inverse[n][1])
        };
        let rows = [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]];
        set_lane(&mut pulled_back, l, rows);
    }
    for (b, gradient) in point.gradients.iter().enumerate() {
        for (k, normal) in pulled_back.iter().enumerate() {
            let flux =
                Lanes::from_fn(|l| normal[0].0[l] * gradient[0] + normal[1].0[l] * gradient[1]);
            for (row, psi) in out.iter_mut().zip(point.psi) {
                for l in 0..LANES {
                    row[b][k].0[l] += psi * flux.0[l];
                }
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
    for point in points {
        let at = AtPoint::new(w, batch, point, &local, fields.v.is_some())
            .map_err(|(l, jacobian)| Inverted::new(batch.elements[l], point.psi, jacobian))?;
        let (h, v) = (&at.h, &at.v);
        if out.stiffness.is_some() {
            let a = pull_back(batch, point, |l| tangent(w, lane(h, l), at.volumetric(l)));
            accumulate(&mut stiffness, point, &a);
        }
        if out.rate_stiffness.is_some() {
            let a = pull_back(batch, point, |l| {
                tangent_rate(w, lane(h, l), lane(v, l), at.volumetric(l))
            });
            accumulate(&mut rate_stiffness, point, &a);
        }
        if out.multiplier_stiffness.is_some() {
            let a = pull_back(batch, point, |l| volume_tangent(w, at.mu.0[l]));
            accumulate(&mut multiplier_stiffness, point, &a);
        }
        if out.divergence.is_some() {
            accumulate_divergence(&mut divergence, batch, point, |l| {
                volume_gradient(w, lane(h, l))
            });
        }
        if out.divergence_rate.is_some() {
            accumulate_divergence(&mut divergence_rate, batch, point, |l| {
                volume_gradient_rate(w, lane(v, l))
            });
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

#[inline(always)]
pub(crate) fn tangents<const N: usize>(
    elements: &Batches<N>,
    maps: &[ScatterMap<N>],
    fields: &Fields<'_>,
    out: &mut Tangents<'_>,
) -> Result<(), Inverted> {
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
