//! Reproducible pseudorandom numbers.

/// Returns a pseudorandom number in [0.5, 1] or [−1, −0.5], computed by splitmix64 from a trial number and an index.
pub(crate) fn draw(trial: u64, index: usize) -> f64 {
    let mut z = (trial << 40 | index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let size = 0.5 + 0.5 * (z >> 11) as f64 / (1u64 << 53) as f64;
    if z & 1 == 0 { size } else { -size }
}

/// Returns the values with their last digits changed at random.
pub(crate) fn rounded(values: &[f64], trial: u64, k: usize) -> Vec<f64> {
    let factor = |j| 1.0 + 4.0 * f64::EPSILON * draw(trial, 2 * j + k);
    values.iter().enumerate().map(|(j, value)| value * factor(j)).collect()
}
