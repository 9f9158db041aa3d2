//! Groups of columns whose difference quotients can be computed with one evaluation of the residual.

use nalgebra_sparse::pattern::SparsityPattern;

/// Groups the columns of a pattern so that no two columns of a group have an entry in the same row. Uses greedy
/// coloring in column order (Curtis, Powell, Reid 1974).
pub(crate) fn color(pattern: &SparsityPattern) -> Vec<Vec<usize>> {
    let mut columns_of_row = vec![Vec::new(); pattern.minor_dim()];
    for column in 0..pattern.major_dim() {
        for &row in pattern.lane(column) {
            columns_of_row[row].push(column);
        }
    }
    // If a row is full, no two columns can be in the same group. For a full matrix, the search below would need O(n³)
    // operations to find this result.
    let n = pattern.major_dim();
    if n > 0 && columns_of_row.iter().any(|columns| columns.len() == n) {
        return (0..n).map(|column| vec![column]).collect();
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of = vec![usize::MAX; pattern.major_dim()];
    // For each group, the last column that cannot be added to the group.
    let mut barred_for: Vec<usize> = Vec::new();
    for column in 0..pattern.major_dim() {
        let rows = pattern.lane(column).iter();
        for &other in rows.flat_map(|&row| &columns_of_row[row]) {
            if let Some(barred) = barred_for.get_mut(group_of[other]) {
                *barred = column;
            }
        }
        let free = barred_for.iter().position(|&barred| barred != column);
        let group = free.unwrap_or(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
            barred_for.push(usize::MAX);
        }
        groups[group].push(column);
        group_of[column] = group;
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::color;
    use nalgebra_sparse::pattern::SparsityPattern;

    /// Columns j of a tridiagonal matrix have rows j − 1, j, j + 1, so three colors suffice.
    #[test]
    fn a_tridiagonal_pattern_has_three_colors_and_a_full_one_a_color_a_column() {
        let n: usize = 11;
        let column = |j: usize| j.saturating_sub(1)..(j + 2).min(n);
        let mut offsets = vec![0];
        for j in 0..n {
            offsets.push(offsets[j] + column(j).len());
        }
        let rows = (0..n).flat_map(column).collect();
        let pattern = SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows).unwrap();
        let groups = color(&pattern);
        assert_eq!(groups.len(), 3);
        for (g, group) in groups.iter().enumerate() {
            assert!(group.iter().all(|j| j % 3 == g), "{group:?}");
        }
        assert_eq!(color(&crate::problem::full_pattern(n)).len(), n);
    }

    /// Regression test: coloring took 14 s for n = 1600 and would have taken minutes for n = 4000.
    #[test]
    fn a_full_pattern_is_colored_in_the_time_of_a_pass() {
        let groups = color(&crate::problem::full_pattern(4000));
        assert!((0..4000).eq(groups.into_iter().flatten()));
    }

    #[test]
    fn empty_columns_join_the_first_group() {
        assert_eq!(color(&SparsityPattern::zeros(3, 3)), [[0, 1, 2]]);
    }
}
