//! One pass over the elements for all tangents, scattered into fixed patterns.

use pulp::{Simd, WithSimd};

use crate::batch::{Batches, Part, Point};
use crate::fields::{Fields, Inverted, Tangents};
use crate::lanes::Lanes;
use crate::material::tensor::{Symmetric, TensorOf, UPPER, volume_gradient_rate, volume_tangent};
use crate::material::{Potential, Real, with_potential};
use crate::residual::{AtPoint, Local};
use crate::sparsity::{NOWHERE, ScatterMap};

/// Element matrices: `[a][b][i][k]` for nodes a ≤ b, components i of a and k of b.
type Matrix<S, const N: usize> = [[TensorOf<Lanes<S>>; N]; N];

/// Element divergences: `[v][b][k]` for vertex v, component k of node b.
type Divergence<S, const N: usize> = [[[Lanes<S>; 2]; N]; 3];

/// w J⁻¹ A J⁻ᵀ: both gradient directions pulled back to the reference triangle, times the
/// quadrature weight. Rows and columns (i, m) → 2 i + m.
#[inline(always)]
fn pull_back<S: Simd, const N: usize>(
    part: &Part<'_, S, N>,
    point: &Point<N>,
    a: &Symmetric<Lanes<S>>,
) -> Symmetric<Lanes<S>> {
    let weights = part.weights(point);
    let inverse = part.inverse();
    let mut out = Symmetric([part.zero(); 10]);
    for (i, k) in [(0, 0), (0, 1), (1, 1)] {
        for m in 0..2 {
            // half[n] = w Σ_j inverse[m][j] A[(i, j), (k, n)]
            let mut half = [part.zero(); 2];
            for (n, half) in half.iter_mut().enumerate() {
                let column = 2 * k + n;
                let (left, right) = (a.0[UPPER[2 * i][column]], a.0[UPPER[2 * i + 1][column]]);
                *half = weights * inverse[m][0].mul_add(left, inverse[m][1] * right);
            }
            // The lower triangle of a diagonal block writes the same place twice.
            for n in 0..2 {
                out.0[UPPER[2 * i + m][2 * k + n]] =
                    half[0].mul_add(inverse[n][0], half[1] * inverse[n][1]);
            }
        }
    }
    out
}

/// Adds ∇φ_a : A : ∇φ_b of one point to the element matrices.
#[inline(always)]
fn accumulate<S: Simd, const N: usize>(
    out: &mut Matrix<S, N>,
    part: &Part<'_, S, N>,
    point: &Point<N>,
    a: &Symmetric<Lanes<S>>,
) {
    let a = pull_back(part, point, a).0;
    for (b, gradient_b) in point.gradients.iter().enumerate() {
        // column[k][r] = Σ_n A[r, (k, n)] ∂_n φ_b
        let mut column = [[part.zero(); 4]; 2];
        for (k, column) in column.iter_mut().enumerate() {
            for (r, entry) in column.iter_mut().enumerate() {
                let (xi, eta) = (a[UPPER[r][2 * k]], a[UPPER[r][2 * k + 1]]);
                *entry = xi.mul_add(xi.like(gradient_b[0]), eta * gradient_b[1]);
            }
        }
        for (gradient_a, row) in point.gradients.iter().zip(out.iter_mut()).take(b + 1) {
            let [xi, eta] = [a[0].like(gradient_a[0]), a[0].like(gradient_a[1])];
            for i in 0..2 {
                for k in 0..2 {
                    let entry = &mut row[b][i][k];
                    let along = column[k][2 * i + 1].mul_add(eta, *entry);
                    *entry = column[k][2 * i].mul_add(xi, along);
                }
            }
        }
    }
}

/// Adds ψ_v N : ∇φ_b of one point to the element divergences.
#[inline(always)]
fn accumulate_divergence<S: Simd, const N: usize>(
    out: &mut Divergence<S, N>,
    part: &Part<'_, S, N>,
    point: &Point<N>,
    normal: &TensorOf<Lanes<S>>,
) {
    let normal = part.pull_back(point, normal);
    for (b, gradient) in point.gradients.iter().enumerate() {
        for (k, row) in normal.iter().enumerate() {
            let flux = row[0].mul_add(row[0].like(gradient[0]), row[1] * gradient[1]);
            for (out, psi) in out.iter_mut().zip(point.psi) {
                let entry = &mut out[b][k];
                *entry = flux.mul_add(flux.like(psi), *entry);
            }
        }
    }
}

/// Adds element matrices to the values of the global one, element by element.
#[inline(always)]
fn scatter<S: Simd, const N: usize>(
    part: &Part<'_, S, N>,
    map: &ScatterMap<N>,
    local: &Matrix<S, N>,
    values: &mut [f64],
) {
    for (lane, l) in part.occupied().enumerate() {
        for (b, map) in map.displacement.iter().enumerate() {
            for (k, map) in map.iter().enumerate() {
                for (a, map) in map.iter().enumerate() {
                    for (i, places) in map.iter().enumerate() {
                        let entries = if a <= b {
                            &local[a][b][i][k]
                        } else {
                            &local[b][a][k][i]
                        };
                        add(places[l], entries.as_slice()[lane], values);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn scatter_divergence<S: Simd, const N: usize>(
    part: &Part<'_, S, N>,
    map: &ScatterMap<N>,
    local: &Divergence<S, N>,
    values: &mut [f64],
) {
    for (lane, l) in part.occupied().enumerate() {
        for (b, map) in map.divergence.iter().enumerate() {
            for (k, map) in map.iter().enumerate() {
                for (places, row) in map.iter().zip(local) {
                    add(places[l], row[b][k].as_slice()[lane], values);
                }
            }
        }
    }
}

#[inline(always)]
fn add(place: u32, entry: f64, values: &mut [f64]) {
    if place != NOWHERE {
        values[place as usize] += entry;
    }
}

#[inline(always)]
fn tangents_part<S: Simd, const N: usize, const RATES: bool, W: Potential>(
    w: &W,
    part: &Part<'_, S, N>,
    map: &ScatterMap<N>,
    points: &[Point<N>],
    fields: &Fields<'_>,
    out: &mut Tangents<'_>,
) -> Result<(), Inverted> {
    let local = Local::<S, N, RATES>::gather(part, fields);
    let zero: Matrix<S, N> = [[[[part.zero(); 2]; 2]; N]; N];
    let (mut stiffness, mut rate_stiffness, mut multiplier_stiffness) = (zero, zero, zero);
    let zero: Divergence<S, N> = [[[part.zero(); 2]; N]; 3];
    let (mut divergence, mut divergence_rate) = (zero, zero);
    for point in points {
        let at = AtPoint::new(w, part, point, &local)?;
        if out.stiffness.is_some() {
            let a = at.strain.tangent(w, at.volumetric);
            accumulate(&mut stiffness, part, point, &a);
        }
        if RATES && out.rate_stiffness.is_some() {
            let a = at.strain.tangent_rate(w, at.v, at.volumetric);
            accumulate(&mut rate_stiffness, part, point, &a);
        }
        if RATES && out.multiplier_stiffness.is_some() {
            let a = volume_tangent(w, at.mu);
            accumulate(&mut multiplier_stiffness, part, point, &a);
        }
        if out.divergence.is_some() {
            accumulate_divergence(&mut divergence, part, point, &at.strain.normal);
        }
        if RATES && out.divergence_rate.is_some() {
            let normal = volume_gradient_rate(w, at.v);
            accumulate_divergence(&mut divergence_rate, part, point, &normal);
        }
    }
    for (local, global) in [
        (&stiffness, &mut out.stiffness),
        (&rate_stiffness, &mut out.rate_stiffness),
        (&multiplier_stiffness, &mut out.multiplier_stiffness),
    ] {
        if let Some(global) = global {
            scatter(part, map, local, global);
        }
    }
    for (local, global) in [
        (&divergence, &mut out.divergence),
        (&divergence_rate, &mut out.divergence_rate),
    ] {
        if let Some(global) = global {
            scatter_divergence(part, map, local, global);
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
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        if self.out.has_rates() {
            self.pass::<S, true>(simd)
        } else {
            self.pass::<S, false>(simd)
        }
    }
}

impl<const N: usize> Linearize<'_, '_, N> {
    #[inline(always)]
    fn pass<S: Simd, const RATES: bool>(self, simd: S) -> Result<(), Inverted> {
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
                for part in 0..batch.n_parts(simd) {
                    let part = batch.part(simd, part);
                    tangents_part::<_, _, RATES, _>(&w, &part, map, &elements.points, fields, out)?;
                }
            });
        }
        Ok(())
    }
}
