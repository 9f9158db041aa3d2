//! Several columns stored row by row.

/// Applies `each` to a contiguous copy of each of the `n_columns` columns of `x`, and writes the result back.
///
/// # Errors
/// Returns the first error of `each`.
pub fn one_by_one<T: Copy, E>(
    x: &mut [T],
    n_columns: usize,
    mut each: impl FnMut(&mut [T]) -> Result<(), E>,
) -> Result<(), E> {
    let mut column = Vec::with_capacity(x.len() / n_columns.max(1));
    for j in 0..n_columns {
        column.clear();
        column.extend(x.iter().skip(j).step_by(n_columns));
        each(&mut column)?;
        put(&column, x, j, n_columns);
    }
    Ok(())
}

/// Writes `column` to column j of `x`, which has `n_columns` columns.
pub fn put<T: Copy>(column: &[T], x: &mut [T], j: usize, n_columns: usize) {
    let own = x.iter_mut().skip(j).step_by(n_columns);
    own.zip(column).for_each(|(x, own)| *x = *own);
}
