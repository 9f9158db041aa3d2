//! Columns whose numbers stand side by side, row by row.

/// Hands each of the `n_columns` of `x` to `each` as a vector of its own, and takes it back.
///
/// # Errors
/// The first of `each`.
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

/// Writes `column` into column j of the `n_columns` of `x`.
pub fn put<T: Copy>(column: &[T], x: &mut [T], j: usize, n_columns: usize) {
    let own = x.iter_mut().skip(j).step_by(n_columns);
    own.zip(column).for_each(|(x, own)| *x = *own);
}

/// Moves those of the `n_columns` of `x` whose numbers are in `kept`, ascending, to the front, side by
/// side; how many numbers that are.
pub fn keep<T: Copy>(x: &mut [T], n_columns: usize, kept: &[usize]) -> usize {
    let mut end = 0;
    for start in (0..x.len()).step_by(n_columns) {
        for k in kept {
            x[end] = x[start + k];
            end += 1;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_are_kept_stand_at_the_front() {
        let mut x = [1, 2, 3, 10, 20, 30];
        assert_eq!(keep(&mut x, 3, &[0, 2]), 4);
        assert_eq!(x[..4], [1, 3, 10, 30]);
        assert_eq!(keep(&mut x[..4], 2, &[]), 0);
    }
}
