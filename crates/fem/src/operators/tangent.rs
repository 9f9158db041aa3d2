//! One pass over the elements for all tangents, scattered into fixed patterns.

use pulp::{Simd, WithSimd};

use crate::material::Real;
use crate::operators::constitutive::{
    Constitutive, Tangent, Tensor, with_plane_law, with_sheet_law, with_spatial_law,
};
use crate::operators::fields::{Fields, Inverted, Tangents};
use crate::operators::residual::{AtPoint, Local};
use crate::simd::batch::{Batch, Part, Point, Stretch, add_dot, dot, dot_numbers};
use crate::simd::lanes::{Lanes, outlined};
use crate::space::sparsity::{NOWHERE, ScatterMap};

/// Element matrices: `[a][b][i][k]` for nodes a ≤ b, components i of a and k of b.
pub(crate) type Matrix<S, const D: usize, const N: usize> = [[Tensor<Lanes<S>, D>; N]; N];

/// Element divergences: `[v][b][k]` for pressure v, component k of node b.
type Divergence<S, const D: usize, const N: usize, const P: usize> = [[[Lanes<S>; D]; N]; P];

/// w J⁻¹ A J⁻ᵀ: both gradient directions pulled back to the reference element, times the quadrature
/// weight, for i ≤ k.
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
                // The diagonal blocks are symmetric.
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

/// Adds ∇φ_a : A : ∇φ_b of one point to the element matrices.
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

/// The same; in space, where it is long, as a function of its own.
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
        let whole = Accumulate {
            out,
            part,
            point,
            a,
        };
        outlined(part.zero().simd(), whole);
    }
}

/// The arguments of [`accumulate`].
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

/// Adds ψ_v N : ∇φ_b of one point to the element divergences.
#[inline(always)]
fn accumulate_divergence<S: Simd, const D: usize, const N: usize, const P: usize>(
    out: &mut Divergence<S, D, N, P>,
    part: &Part<'_, S, D, N, P>,
    point: &Point<D, N, P>,
    normal: &Tensor<Lanes<S>, D>,
) {
    let normal = part.pull_back(point, normal);
    for (b, gradient) in point.gradients.iter().enumerate() {
        for (k, row) in normal.iter().enumerate() {
            let flux = dot_numbers(row, gradient);
            for (out, psi) in out.iter_mut().zip(point.psi) {
                let entry = &mut out[b][k];
                *entry = flux.mul_add(flux.like(psi), *entry);
            }
        }
    }
}

/// Adds element matrices to the values of the global one, element by element.
#[inline(always)]
pub(crate) fn scatter<S: Simd, const D: usize, const N: usize, const P: usize>(
    part: &Part<'_, S, D, N, P>,
    map: &ScatterMap<D, N, P>,
    local: &Matrix<S, D, N>,
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
                        put(places[l], entries.as_slice()[lane], values);
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
                for (places, row) in map.iter().zip(local) {
                    put(places[l], row[b][k].as_slice()[lane], values);
                }
            }
        }
    }
}

#[inline(always)]
pub(crate) fn put(place: u32, entry: f64, values: &mut [f64]) {
    if place != NOWHERE {
        values[place as usize] += entry;
    }
}

/// Multiplies an element matrix, if there is one.
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

/// Zero where a matrix is wanted, nothing where it is not.
#[inline(always)]
pub(crate) fn room<T: Copy>(wanted: bool, zero: T) -> Option<T> {
    if wanted { Some(zero) } else { None }
}

#[inline(always)]
fn tangents_part<
    S: Simd,
    const D: usize,
    const N: usize,
    const P: usize,
    const RATES: bool,
    C: Constitutive<D>,
>(
    law: &C,
    part: &mut Part<'_, S, D, N, P>,
    map: &ScatterMap<D, N, P>,
    points: &[Point<D, N, P>],
    fields: &Fields<'_>,
    out: &mut Tangents<'_>,
) -> Result<(), Inverted> {
    let local = Local::<S, D, N, P, RATES>::gather(part, fields, out.has_rates());
    let zero: Matrix<S, D, N> = [[[[part.zero(); D]; D]; N]; N];
    let mut stiffness = room(
        out.stiffness.is_some() || out.damped_stiffness.is_some(),
        zero,
    );
    let mut rate_stiffness = room(RATES && out.rate_stiffness.is_some(), zero);
    let mut multiplier_stiffness = room(RATES && out.multiplier_stiffness.is_some(), zero);
    let zero: Divergence<S, D, N, P> = [[[part.zero(); D]; N]; P];
    let mut divergence = room(out.divergence.is_some(), zero);
    let mut divergence_rate = room(RATES && out.divergence_rate.is_some(), zero);
    for (number, point) in points.iter().enumerate() {
        part.move_to(number);
        let at = AtPoint::new(law, part, (number, point), &local)?;
        if let Some(stiffness) = &mut stiffness {
            let a = law.tangent(&at.strain, at.volumetric);
            add(stiffness, part, point, &a);
        }
        if let Some(rate_stiffness) = &mut rate_stiffness {
            let a = law.tangent_rate(&at.strain, at.v, at.volumetric);
            add(rate_stiffness, part, point, &a);
        }
        if let Some(multiplier_stiffness) = &mut multiplier_stiffness {
            let a = law.volume_tangent(&at.strain, at.mu);
            add(multiplier_stiffness, part, point, &a);
        }
        if let Some(divergence) = &mut divergence {
            accumulate_divergence(divergence, part, point, &law.normal(&at.strain));
        }
        if let Some(divergence_rate) = &mut divergence_rate {
            let normal = law.normal_rate(&at.strain, at.v);
            accumulate_divergence(divergence_rate, part, point, &normal);
        }
    }
    let beta = part.ratios().beta;
    scale(&mut rate_stiffness, beta);
    if let (Some(local), Some(global)) = (&stiffness, &mut out.stiffness) {
        scatter(part, map, local, global);
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
            scatter(part, map, local, global);
        }
    }
    for (local, global) in [
        (&divergence, &mut out.divergence),
        (&divergence_rate, &mut out.divergence_rate),
    ] {
        if let (Some(local), Some(global)) = (local, global) {
            scatter_divergence(part, map, local, global);
        }
    }
    Ok(())
}

/// The pass over all batches, to be run with the processor's vector instructions.
pub(crate) struct Linearize<'a, 'b, const D: usize, const N: usize, const P: usize> {
    pub(crate) elements: Stretch<'a, D, N, P>,
    pub(crate) maps: &'a [ScatterMap<D, N, P>],
    pub(crate) fields: &'a Fields<'a>,
    pub(crate) out: &'a mut Tangents<'b>,
}

/// The pass over batches of one law, a function of its own.
struct Run<'a, 'b, C, const D: usize, const N: usize, const P: usize, const RATES: bool> {
    law: C,
    batches: &'a [Batch<D, N, P>],
    maps: &'a [ScatterMap<D, N, P>],
    points: &'a [Point<D, N, P>],
    fields: &'a Fields<'a>,
    out: &'a mut Tangents<'b>,
}

impl<C, const D: usize, const N: usize, const P: usize, const RATES: bool> WithSimd
    for Run<'_, '_, C, D, N, P, RATES>
where
    C: Constitutive<D>,
{
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for (batch, map) in self.batches.iter().zip(self.maps) {
            for part in 0..batch.n_parts(simd) {
                let part = &mut batch.part(simd, part);
                tangents_part::<_, _, _, _, RATES, _>(
                    &self.law,
                    part,
                    map,
                    self.points,
                    self.fields,
                    self.out,
                )?;
            }
        }
        Ok(())
    }
}

/// The pass over one kind of element; `$with_law` binds its laws.
macro_rules! pass {
    ($dimension:literal, $nodes:literal, $pressures:literal, $with_law:ident) => {
        impl WithSimd for Linearize<'_, '_, $dimension, $nodes, $pressures> {
            type Output = Result<(), Inverted>;

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
                // In space the work at a point hides what is asked there: one loop serves both.
                if $dimension == 3 || self.out.has_rates() {
                    self.pass::<S, true>(simd)
                } else {
                    self.pass::<S, false>(simd)
                }
            }
        }

        impl Linearize<'_, '_, $dimension, $nodes, $pressures> {
            #[inline(always)]
            fn pass<S: Simd, const RATES: bool>(self, simd: S) -> Result<(), Inverted> {
                let Self {
                    elements: Stretch { points, batches, .. },
                    maps,
                    fields,
                    out,
                } = self;
                for values in out.all_mut() {
                    values.fill(0.0);
                }
                let mut rest = maps;
                for batches in batches.chunk_by(|a, b| a.kind.law == b.kind.law) {
                    let (maps, after) = rest.split_at(batches.len());
                    rest = after;
                    $with_law!(batches[0].kind.law, law => outlined(
                        simd,
                        Run::<_, $dimension, $nodes, $pressures, RATES> {
                            law,
                            batches,
                            maps,
                            points,
                            fields,
                            out,
                        },
                    )?);
                }
                Ok(())
            }
        }
    };
}

pass!(2, 3, 3, with_sheet_law);
pass!(2, 6, 3, with_plane_law);
pass!(3, 4, 4, with_spatial_law);
pass!(3, 10, 4, with_spatial_law);
