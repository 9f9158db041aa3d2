//! Central differences.

use nalgebra::DMatrix;

/// Writes the Jacobian of `function`, computed by central differences. The step is ∛ε max(|p|, scale), which balances
/// truncation and rounding errors (both about ε^(2/3)).
pub(crate) fn central<E>(
    mut function: impl FnMut(&[f64], &mut [f64]) -> Result<(), E>,
    p: &[f64],
    scale: &[f64],
    out: &mut DMatrix<f64>,
) -> Result<(), E> {
    let mut at = p.to_vec();
    let mut sides = [vec![0.0; out.nrows()], vec![0.0; out.nrows()]];
    for j in 0..p.len() {
        let step = f64::EPSILON.cbrt() * p[j].abs().max(scale[j]);
        let (above, below) = (p[j] + step, p[j] - step);
        for (side, value) in sides.iter_mut().zip([above, below]) {
            at[j] = value;
            function(&at, side)?;
        }
        at[j] = p[j];
        for (entry, (plus, minus)) in
            out.column_mut(j).iter_mut().zip(sides[0].iter().zip(&sides[1]))
        {
            *entry = (plus - minus) / (above - below);
        }
    }
    Ok(())
}
