//! How coherently the oscillators move at one time.
//!
//! Each oscillator is a point in the complex plane, its phasor; the centroid of the points and
//! that of their directions are the paper's measures Ψ and χ.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// The oscillators in the complex plane: `r_n e^{iθ_n} = y_n + i ẏ_n/ω_n`.
///
/// Paper: after eq. (23). A free oscillator runs clockwise: θ_n falls. The radius r_n is the
/// modulus of the n-th number, the phase θ_n its argument.
///
/// # Shapes
/// `omega`, `y`, `w` (= ẏ): N numbers each.
///
/// # Panics
/// When the lengths differ.
pub fn phasors(omega: &[f64], y: &[f64], w: &[f64]) -> impl Iterator<Item = Complex64> {
    assert_eq!(omega.len(), y.len(), "positions");
    assert_eq!(omega.len(), w.len(), "velocities");
    omega
        .iter()
        .zip(y)
        .zip(w)
        .map(|((omega, &y), w)| Complex64::new(y, w / omega))
}

/// The two complex order parameters of the oscillators at one time.
///
/// `Ψ = (1/N) Σ r_n e^{iθ_n}`, `χ = (1/N) Σ e^{iθ_n}`. Paper: eq. (23). For an oscillator at rest
/// e^{iθ} is undefined; it counts as 0 in χ.
///
/// # Examples
/// ```
/// use myovib_oscillators::Coherence;
/// let omega = [50.0, 50.0];
/// let opposed = Coherence::new(&omega, &[1.0, -2.0], &[0.0, 0.0]);
/// assert_eq!(opposed.centroid.re, -0.5);
/// assert_eq!(opposed.phase.norm(), 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coherence {
    /// Ψ = R e^{iΘ}, the centroid of the oscillators: strength and phase of their common motion.
    pub centroid: Complex64,
    /// χ, the phase coherence: modulus 1 when all phases agree.
    pub phase: Complex64,
}

impl Coherence {
    /// Ψ and χ of oscillators with frequencies `omega`, positions `y` and velocities `w`.
    ///
    /// # Panics
    /// When there is no oscillator or the lengths differ.
    pub fn new(omega: &[f64], y: &[f64], w: &[f64]) -> Self {
        Self {
            centroid: mean(phasors(omega, y, w)),
            phase: mean(phasors(omega, y, w).map(direction)),
        }
    }
}

/// Ψ and χ of each of the chains at `places` that make up a network: see
/// [`Chain::network_at`](crate::Chain::network_at).
///
/// # Panics
/// When there is no place, or the lengths are no multiple of their number.
pub fn coherence_at(places: usize, omega: &[f64], y: &[f64], w: &[f64]) -> Vec<Coherence> {
    let n = omega.len() / places;
    assert_eq!(n * places, omega.len(), "oscillators at each place");
    let own = |place: usize| place * n..(place + 1) * n;
    let chains = (0..places).map(own);
    chains
        .map(|own| Coherence::new(&omega[own.clone()], &y[own.clone()], &w[own]))
        .collect()
}

/// The instantaneous frequency of the centroid in Hz, positive in the oscillators' natural
/// (clockwise) sense; `None` while Ψ = 0.
///
/// `f = −Θ̇/(2π)`, `Θ̇ = Im(conj(Ψ) Ψ̇)/|Ψ|²`, `Ψ̇ = (1/N) Σ (ẏ_n + i ÿ_n/ω_n)`. The derivative is
/// that of the states, no difference of samples. Within one turn f varies, as the orbit is no
/// circle; its mean over a turn is the frequency of the motion.
///
/// # Shapes
/// `omega`, `y`, `w` (= ẏ), `w_dot` (= ÿ): N numbers each.
///
/// # Units
/// Hz; `omega` in rad/s.
///
/// # Panics
/// When there is no oscillator or the lengths differ.
pub fn centroid_frequency(omega: &[f64], y: &[f64], w: &[f64], w_dot: &[f64]) -> Option<f64> {
    let centroid = mean(phasors(omega, y, w));
    let rate = mean(phasors(omega, w, w_dot));
    let squared = centroid.norm_sqr();
    (squared > 0.0).then(|| -(centroid.conj() * rate).im / squared / TAU)
}

/// # Panics
/// When there is none.
pub(crate) fn mean(numbers: impl Iterator<Item = Complex64>) -> Complex64 {
    let (sum, count) = numbers.fold((Complex64::ZERO, 0), |(sum, count), z| (sum + z, count + 1));
    assert!(count > 0, "the mean needs at least one oscillator");
    sum / f64::from(count)
}

/// e^{iθ} of z = r e^{iθ}, and 0 for r = 0.
fn direction(z: Complex64) -> Complex64 {
    let r = z.norm();
    if r > 0.0 { z / r } else { Complex64::ZERO }
}
