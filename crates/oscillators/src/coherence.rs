//! Coherence of the oscillators at one point in time.
//!
//! The state of each oscillator is a point in the complex plane, its phasor. The paper's measure Ψ is the centroid
//! of the phasors, and χ is the centroid of their directions.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// Returns the phasors of the oscillators, `r_n e^{iθ_n} = y_n + i ẏ_n/ω_n`.
///
/// Paper: after eq. (23). The radius r_n is the modulus of the n-th phasor, and the phase θ_n is its argument. A
/// free oscillator moves clockwise: θ_n decreases.
///
/// # Shapes
/// `omega`, `y` and `w` (= ẏ) hold N values each.
///
/// # Panics
/// Panics if the lengths differ.
pub fn phasors(omega: &[f64], y: &[f64], w: &[f64]) -> impl Iterator<Item = Complex64> {
    assert_eq!(omega.len(), y.len(), "positions");
    assert_eq!(omega.len(), w.len(), "velocities");
    omega.iter().zip(y).zip(w).map(|((omega, &y), w)| Complex64::new(y, w / omega))
}

/// The two complex order parameters of the oscillators at one point in time.
///
/// `Ψ = (1/N) Σ r_n e^{iθ_n}`, `χ = (1/N) Σ e^{iθ_n}`. Paper: eq. (23). For an oscillator at rest, e^{iθ} is
/// undefined, and the contribution to χ is 0.
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
    /// The centroid Ψ = R e^{iΘ} of the oscillators: amplitude and phase of their common motion.
    pub centroid: Complex64,
    /// The phase coherence χ. Its modulus is 1 if all phases agree.
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

/// Computes Ψ and χ for each chain of a network with chains at `places` points; see
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

/// Returns the instantaneous frequency of the centroid in Hz, or `None` if Ψ = 0. The frequency is positive for
/// the natural (clockwise) sense of rotation.
///
/// `f = −Θ̇/(2π)`, `Θ̇ = Im(conj(Ψ) Ψ̇)/|Ψ|²`, `Ψ̇ = (1/N) Σ (ẏ_n + i ÿ_n/ω_n)`. The derivative is computed from
/// the states, not from differences of samples. The orbit is not a circle, so f varies within one revolution. The
/// mean of f over a revolution is the frequency of the motion.
///
/// # Shapes
/// `omega`, `y`, `w` (= ẏ) and `w_dot` (= ÿ) hold N values each.
///
/// # Units
/// The result is in Hz; `omega` is in rad/s.
///
/// # Panics
/// Panics if the slices are empty or their lengths differ.
pub fn centroid_frequency(omega: &[f64], y: &[f64], w: &[f64], w_dot: &[f64]) -> Option<f64> {
    let centroid = mean(phasors(omega, y, w));
    let rate = mean(phasors(omega, w, w_dot));
    let squared = centroid.norm_sqr();
    (squared > 0.0).then(|| -(centroid.conj() * rate).im / squared / TAU)
}

/// Returns the mean of complex numbers.
///
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
