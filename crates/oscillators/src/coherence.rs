//! Coherence of the oscillators at one time.
//!
//! Each oscillator is a point in the complex plane, its phasor. The paper's measures Ψ and χ are the centroids of the
//! phasors and of their directions.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// Returns the phasors of the oscillators, `r_n e^{iθ_n} = y_n + i ẏ_n/ω_n`.
///
/// Paper: after eq. (23). A free oscillator moves clockwise: θ_n decreases. The radius r_n is the modulus and
/// the phase θ_n the argument of the n-th phasor.
///
/// # Shapes
/// `omega`, `y`, `w` (= ẏ): N values each.
///
/// # Panics
/// Panics if the lengths differ.
pub fn phasors(omega: &[f64], y: &[f64], w: &[f64]) -> impl Iterator<Item = Complex64> {
    assert_eq!(omega.len(), y.len(), "positions");
    assert_eq!(omega.len(), w.len(), "velocities");
    omega.iter().zip(y).zip(w).map(|((omega, &y), w)| Complex64::new(y, w / omega))
}

/// The two complex order parameters of the oscillators at one time.
///
/// `Ψ = (1/N) Σ r_n e^{iθ_n}`, `χ = (1/N) Σ e^{iθ_n}`. Paper: eq. (23). For an oscillator at rest
/// e^{iθ} is undefined; its contribution to χ is 0.
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
    /// Ψ = R e^{iΘ}, the centroid of the oscillators: amplitude and phase of their common motion.
    pub centroid: Complex64,
    /// χ, the phase coherence; its modulus is 1 if all phases agree.
    pub phase: Complex64,
}

impl Coherence {
    /// Computes Ψ and χ for frequencies `omega`, positions `y` and velocities `w`.
    ///
    /// # Panics
    /// Panics if the slices are empty or their lengths differ.
    pub fn new(omega: &[f64], y: &[f64], w: &[f64]) -> Self {
        Self {
            centroid: mean(phasors(omega, y, w)),
            phase: mean(phasors(omega, y, w).map(direction)),
        }
    }
}

/// Computes Ψ and χ for each of the chains at `places` points in a network; see
/// [`Chain::network_at`](crate::Chain::network_at).
///
/// # Panics
/// Panics if `places` is zero or the lengths are not multiples of it.
pub fn coherence_at(places: usize, omega: &[f64], y: &[f64], w: &[f64]) -> Vec<Coherence> {
    let n = omega.len() / places;
    assert_eq!(n * places, omega.len(), "oscillators at each place");
    let own = |place: usize| place * n..(place + 1) * n;
    let chains = (0..places).map(own);
    chains.map(|own| Coherence::new(&omega[own.clone()], &y[own.clone()], &w[own])).collect()
}

/// Returns the instantaneous frequency of the centroid in Hz, positive for the natural (clockwise) sense of rotation;
/// `None` if Ψ = 0.
///
/// `f = −Θ̇/(2π)`, `Θ̇ = Im(conj(Ψ) Ψ̇)/|Ψ|²`, `Ψ̇ = (1/N) Σ (ẏ_n + i ÿ_n/ω_n)`. The derivative is computed from the
/// states, not from differences of samples. f varies within one revolution because the orbit is not a circle; its mean
/// over a revolution is the frequency of the motion.
///
/// # Shapes
/// `omega`, `y`, `w` (= ẏ), `w_dot` (= ÿ): N values each.
///
/// # Units
/// Hz; `omega` in rad/s.
///
/// # Panics
/// Panics if the slices are empty or their lengths differ.
pub fn centroid_frequency(omega: &[f64], y: &[f64], w: &[f64], w_dot: &[f64]) -> Option<f64> {
    let centroid = mean(phasors(omega, y, w));
    let rate = mean(phasors(omega, w, w_dot));
    let squared = centroid.norm_sqr();
    (squared > 0.0).then(|| -(centroid.conj() * rate).im / squared / TAU)
}

/// # Panics
/// Panics if the iterator is empty.
pub(crate) fn mean(numbers: impl Iterator<Item = Complex64>) -> Complex64 {
    let (sum, count) = numbers.fold((Complex64::ZERO, 0), |(sum, count), z| (sum + z, count + 1));
    assert!(count > 0, "the mean needs at least one oscillator");
    sum / f64::from(count)
}

/// Returns e^{iθ} for z = r e^{iθ}, and 0 for r = 0.
fn direction(z: Complex64) -> Complex64 {
    let r = z.norm();
    if r > 0.0 { z / r } else { Complex64::ZERO }
}
