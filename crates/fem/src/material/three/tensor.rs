//! Three-dimensional tensors of any number type.

use super::super::Real;

/// 3 × 3 tensor.
pub type Tensor3Of<R> = [[R; 3]; 3];

/// Symmetric derivative of a 3 × 3 tensor with respect to a 3 × 3 tensor. The upper triangle is stored row by row.
/// The row or column of component (i, J) is 3 i + J.
#[derive(Debug, Clone, Copy)]
pub struct Symmetric3<R>(pub(crate) [R; 45]);

/// Index of the entry (row, column) in [`Symmetric3`].
pub(crate) const UPPER3: [[usize; 9]; 9] = {
    let mut table = [[0; 9]; 9];
    let (mut row, mut index) = (0, 0);
    while row < 9 {
        let mut column = row;
        while column < 9 {
            table[row][column] = index;
            table[column][row] = index;
            index += 1;
            column += 1;
        }
        row += 1;
    }
    table
};

/// Even and odd permutations of three indices with their signs.
const PERMUTATIONS: [(usize, usize, usize, f64); 6] = [
    (0, 1, 2, 1.0),
    (1, 2, 0, 1.0),
    (2, 0, 1, 1.0),
    (0, 2, 1, -1.0),
    (2, 1, 0, -1.0),
    (1, 0, 2, -1.0),
];

impl<R: Real> Symmetric3<R> {
    /// Returns zero with the number type of `like`.
    #[inline(always)]
    pub fn zero(like: R) -> Self {
        Self([like.like(0.0); 45])
    }

    /// Returns the derivative of entry (i, J) with respect to entry (k, L).
    #[inline(always)]
    pub fn entry(&self, i: usize, j: usize, k: usize, l: usize) -> R {
        self.0[UPPER3[3 * i + j][3 * k + l]]
    }

    /// Adds a x⊗x.
    #[inline(always)]
    pub fn add_square(&mut self, a: R, x: &Tensor3Of<R>) {
        let (x, ax) = (in_plane(x), in_plane(&scaled3(a, x)));
        for r in 0..9 {
            for c in r..9 {
                let entry = &mut self.0[UPPER3[r][c]];
                *entry = x[r].mul_add(ax[c], *entry);
            }
        }
    }

    /// Adds x⊗y + y⊗x.
    #[inline(always)]
    pub fn add_pair(&mut self, x: &Tensor3Of<R>, y: &Tensor3Of<R>) {
        let (x, y) = (in_plane(x), in_plane(y));
        for r in 0..9 {
            for c in r..9 {
                let entry = &mut self.0[UPPER3[r][c]];
                *entry = x[r].mul_add(y[c], y[r].mul_add(x[c], *entry));
            }
        }
    }

    /// Adds the derivative of F s for a symmetric s: δ_ik s_JL.
    #[inline(always)]
    pub fn add_geometric(&mut self, s: &Tensor3Of<R>) {
        for i in 0..3 {
            for j in 0..3 {
                for l in j..3 {
                    let entry = &mut self.0[UPPER3[3 * i + j][3 * i + l]];
                    *entry = *entry + s[j][l];
                }
            }
        }
    }

    /// Adds the derivative of a sym F: a (δ_ik δ_JL + δ_iL δ_Jk) / 2.
    #[inline(always)]
    pub fn add_symmetrizer(&mut self, a: R) {
        let half = a * 0.5;
        for i in 0..3 {
            for j in 0..3 {
                for (k, l) in [(i, j), (j, i)] {
                    if 3 * k + l >= 3 * i + j {
                        let entry = &mut self.0[UPPER3[3 * i + j][3 * k + l]];
                        *entry = *entry + half;
                    }
                }
            }
        }
    }

    /// Adds the derivative of m cof F at constant m: m ε_ikm ε_JLM F_mM.
    #[inline(always)]
    pub fn add_cofactor_slope(&mut self, m: R, f: &Tensor3Of<R>) {
        let mf = scaled3(m, f);
        for (i, k, n, sign) in PERMUTATIONS {
            if k < i {
                continue;
            }
            for (j, l, o, other) in PERMUTATIONS {
                let entry = &mut self.0[UPPER3[3 * i + j][3 * k + l]];
                *entry = if sign * other > 0.0 { *entry + mf[n][o] } else { *entry - mf[n][o] };
            }
        }
    }

    /// Multiplies all entries by a.
    #[inline(always)]
    pub fn scale(&mut self, a: R) {
        for entry in &mut self.0 {
            *entry = *entry * a;
        }
    }

    /// Adds another tangent.
    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        for (entry, other) in self.0.iter_mut().zip(&other.0) {
            *entry = *entry + *other;
        }
    }
}

/// Returns the entries row by row.
#[inline(always)]
fn in_plane<R: Real>(t: &Tensor3Of<R>) -> [R; 9] {
    let [[a, b, c], [d, e, f], [g, h, i]] = *t;
    [a, b, c, d, e, f, g, h, i]
}

/// Returns x : y.
#[inline(always)]
pub fn contract3<R: Real>(x: &Tensor3Of<R>, y: &Tensor3Of<R>) -> R {
    let (x, y) = (in_plane(x), in_plane(y));
    let mut sum = x[0] * y[0];
    for k in 1..9 {
        sum = x[k].mul_add(y[k], sum);
    }
    sum
}

/// Returns a x.
#[inline(always)]
pub fn scaled3<R: Real>(a: R, x: &Tensor3Of<R>) -> Tensor3Of<R> {
    let mut out = *x;
    for row in &mut out {
        for entry in row {
            *entry = a * *entry;
        }
    }
    out
}

/// Adds a x to `out`.
#[inline(always)]
pub fn add_scaled3<R: Real>(out: &mut Tensor3Of<R>, a: R, x: &Tensor3Of<R>) {
    for (row, x) in out.iter_mut().zip(x) {
        for (entry, x) in row.iter_mut().zip(x) {
            *entry = a.mul_add(*x, *entry);
        }
    }
}

/// Returns the product a b.
#[inline(always)]
pub fn product3<R: Real>(a: &Tensor3Of<R>, b: &Tensor3Of<R>) -> Tensor3Of<R> {
    let mut out = *a;
    for (row, a) in out.iter_mut().zip(a) {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = a[2].mul_add(b[2][j], a[1].mul_add(b[1][j], a[0] * b[0][j]));
        }
    }
    out
}

/// Returns the symmetric tensor aᵀ a.
#[inline(always)]
pub(crate) fn gram3<R: Real>(a: &Tensor3Of<R>) -> Tensor3Of<R> {
    let mut out = *a;
    for i in 0..3 {
        for j in i..3 {
            let entry = a[2][i].mul_add(a[2][j], a[1][i].mul_add(a[1][j], a[0][i] * a[0][j]));
            out[i][j] = entry;
            out[j][i] = entry;
        }
    }
    out
}

/// Returns cof a.
#[inline(always)]
pub(crate) fn cofactor3<R: Real>(a: &Tensor3Of<R>) -> Tensor3Of<R> {
    let mut out = *a;
    for (i, row) in out.iter_mut().enumerate() {
        let (next, last) = (&a[(i + 1) % 3], &a[(i + 2) % 3]);
        for (j, entry) in row.iter_mut().enumerate() {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            *entry = next[k].mul_add(last[l], -(next[l] * last[k]));
        }
    }
    out
}

/// Returns the trace.
#[inline(always)]
pub fn trace3<R: Real>(a: &Tensor3Of<R>) -> R {
    a[0][0] + a[1][1] + a[2][2]
}
