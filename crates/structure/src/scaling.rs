//! Scaling of a pencil that makes its structure independent of the units of equations and variables.

use nalgebra::{DMatrix, DVector};

use crate::pencil::Pencil;

/// Entries at least this many decades below the envelope are treated as rounding errors of the assembly and ignored.
const ROUNDING_DECADES: f64 = 10.0;
/// Weight of entries below the envelope in its fit. Entries above the envelope have weight 1.
const BELOW: f64 = 0.01;
/// Maximum number of iterations in the fit of the envelope. The fit ends when no entry moves to the other side of
/// the envelope.
const ROUNDS: usize = 20;
/// Regularization that selects one solution if the fit is not unique. It is small compared with the weight of each
/// unknown, so it does not change the first 10 digits of the fit.
const RIDGE: f64 = 1e-10;

/// Returns the scaled matrices R (τ E) C and R A C. R and C are diagonal with positive entries, and τ is a unit of
/// time.
///
/// The exponents are the least-squares solution of
///
///   log|e_ij| + r_i + c_j + τ ≈ 0,   log|a_ij| + r_i + c_j ≈ 0   over all non-zero entries,
///
/// which is the scaling of Curtis and Reid (J. Inst. Maths Applics 10 (1972) 118), extended to a pair of matrices.
/// A change of units changes r, c and τ but not the scaled pencil, so the results do not depend on the units. The
/// index is independent of R, C and τ.
///
/// Terms that cancel in an assembly leave rounding errors as entries, and these would distort the fit. Such
/// entries are identified by their distance below an upper envelope, which results from the same fit with a small
/// weight for entries below it. The envelope does not depend on the units either.
pub(crate) fn scale(pencil: &Pencil) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = pencil.size();
    let mut entries: Vec<Entry> = [(pencil.e(), 1.0), (pencil.a(), 0.0)]
        .into_iter()
        .flat_map(|(matrix, time)| non_zeros(matrix, time))
        .collect();
    let envelope = envelope(n, &entries);
    entries.retain(|entry| entry.log + envelope.of(entry) > -ROUNDING_DECADES);
    let shifts = fit(n, &entries, |_| 1.0);
    let scaled = |matrix: &DMatrix<f64>, time: f64| {
        DMatrix::from_fn(n, n, |row, column| {
            matrix[(row, column)] * 10f64.powf(shifts.of(&Entry { row, column, time, log: 0.0 }))
        })
    };
    (scaled(pencil.e(), 1.0), scaled(pencil.a(), 0.0))
}

/// A non-zero entry of the pencil (E, A). `time` is the power of the unit of time: 1 in E and 0 in A.
struct Entry {
    row: usize,
    column: usize,
    time: f64,
    log: f64,
}

/// Decimal exponents r, c, τ of the scaling.
struct Shifts {
    rows: DVector<f64>,
    columns: DVector<f64>,
    time: f64,
}

impl Shifts {
    fn of(&self, entry: &Entry) -> f64 {
        self.rows[entry.row] + self.columns[entry.column] + entry.time * self.time
    }
}

fn non_zeros(matrix: &DMatrix<f64>, time: f64) -> impl Iterator<Item = Entry> {
    matrix.iter().enumerate().filter(|(_, value)| **value != 0.0).map(move |(at, value)| {
        let (row, column) = matrix.vector_to_matrix_index(at);
        Entry { row, column, time, log: value.abs().log10() }
    })
}

/// Fits an upper envelope. Only a few entries are above it, and only by small amounts.
fn envelope(n: usize, entries: &[Entry]) -> Shifts {
    let mut shifts = fit(n, entries, |_| 1.0);
    let mut above = Vec::new();
    for _ in 0..ROUNDS {
        let sides = entries.iter().map(|entry| entry.log + shifts.of(entry) > 0.0).collect();
        if sides == above {
            break;
        }
        above = sides;
        shifts = fit(n, entries, |k| if above[k] { 1.0 } else { BELOW });
    }
    shifts
}

/// Solves the normal equations of the fit for (r, c, τ). Entry k has the weight `weight(k)`.
fn fit(n: usize, entries: &[Entry], weight: impl Fn(usize) -> f64) -> Shifts {
    let mut normal = DMatrix::from_diagonal_element(2 * n + 1, 2 * n + 1, RIDGE);
    let mut right = DVector::zeros(2 * n + 1);
    for (k, entry) in entries.iter().enumerate() {
        let weight = weight(k);
        let terms = [(entry.row, 1.0), (n + entry.column, 1.0), (2 * n, entry.time)];
        for (i, part_i) in terms {
            right[i] -= weight * part_i * entry.log;
            for (j, part_j) in terms {
                normal[(i, j)] += weight * part_i * part_j;
            }
        }
    }
    let x = normal
        .cholesky()
        .expect("a Gram matrix plus a positive diagonal is positive definite")
        .solve(&right);
    Shifts { rows: x.rows(0, n).into(), columns: x.rows(n, n).into(), time: x[2 * n] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scaled_pencil_does_not_depend_on_units() {
        let e = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 2.0, 1e-3, 0.0, 0.0, 0.0]);
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, 5.0, 0.1, 1.0, 1.0, 0.0, 0.2]);
        let rows = DMatrix::from_diagonal(&DVector::from_vec(vec![1e6, 1e-6, 1e3]));
        let columns = DMatrix::from_diagonal(&DVector::from_vec(vec![1e-5, 1.0, 1e6]));
        let tau = 1e-4;
        let plain = scale(&Pencil::new(e.clone(), a.clone()).unwrap());
        let scaled = scale(&Pencil::new(&rows * e * &columns * tau, &rows * a * &columns).unwrap());
        // The regularization preserves ten digits.
        assert!((plain.0 - scaled.0).amax() < 1e-7);
        assert!((plain.1 - scaled.1).amax() < 1e-7);
    }

    /// Three quarters of the entries are rounding errors, as after the cancellation of terms in an assembly.
    #[test]
    fn rounding_errors_do_not_affect_the_scaling() {
        let n = 12;
        let entry = |i: usize, j: usize| 2.0 + ((3 * i + 5 * j) as f64).sin();
        let rounding = |i: usize, j: usize| 1e-16 * entry(j, i);
        let banded = |width: usize, outside: &dyn Fn(usize, usize) -> f64| {
            let value = |i: usize, j: usize| {
                if i.abs_diff(j) <= width { entry(i, j) } else { outside(i, j) }
            };
            DMatrix::from_fn(n, n, value)
        };
        let zero = |_: usize, _: usize| 0.0;
        let clean = Pencil::new(banded(0, &zero), banded(1, &zero)).unwrap();
        let noisy = Pencil::new(banded(0, &zero), banded(1, &rounding)).unwrap();
        // The regularization preserves ten digits, reduced by the spread of the exponents.
        assert!((scale(&clean).0 - scale(&noisy).0).amax() < 1e-7);
        assert!((scale(&clean).1 - scale(&noisy).1).amax() < 1e-7);
    }
}
