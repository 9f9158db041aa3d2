//! Closed-form natural frequencies and harmonic response of the rod.

use std::f64::consts::{PI, TAU};

use myovib_fem::rod::{EndLoad, RodData};

use crate::Complex64;

/// Returns the `k`-th natural frequency of the undamped rod, k = 1, 2, …
///
/// For a rod fixed at one end and free at the other, `f_k = (2k − 1)/(4 L) sqrt(EA/ρ)`.
///
/// # Units
/// Hz
pub(crate) fn natural_frequency(data: &RodData, k: usize) -> f64 {
    quarter_waves(k) / data.length * wave_speed(data) / TAU
}

/// Returns the `k`-th natural frequency of the undamped rod with linear elements, k = 1 … number of elements.
///
/// `(2π f_k h)² = 6 (EA/ρ) (1 − cos φ)/(2 + cos φ)` with φ = (2k − 1) π/(2 n) and h = L/n. The value of the mode
/// at node j is sin(j φ).
///
/// # Units
/// Hz
pub(crate) fn discrete_natural_frequency(data: &RodData, k: usize) -> f64 {
    let n = data.n_elements as f64;
    let phi = quarter_waves(k) / n;
    // 1 − cos φ = 2 sin² (φ/2), which is evaluated without cancellation.
    let squared = 12.0 * (phi / 2.0).sin().powi(2) / (2.0 + phi.cos());
    squared.sqrt() * n / data.length * wave_speed(data) / TAU
}

/// Returns the complex amplitude U(x) of the steady response u = Re(U e^{iωt}) to τ = Re(e^{iωt}).
///
/// `U = sin(k x)/(k cos(k L))`, `k² = ρ (ω² − iωα)/(EA (1 + iωβ))`. If the load is a traction, U is divided by
/// `1 + iωβ`.
///
/// # Units
/// `frequency` = ω/(2π) is in Hz.
pub(crate) fn harmonic_response(
    data: &RodData,
    load: EndLoad,
    frequency: f64,
    x: f64,
) -> Complex64 {
    let omega = TAU * frequency;
    let inertia = data.density * Complex64::new(omega.powi(2), -omega * data.mass_damping);
    let loss = Complex64::new(1.0, omega * data.stiffness_damping);
    let k = (inertia / (data.axial_stiffness * loss)).sqrt();
    let strain_driven = (k * x).sin() / (k * (k * data.length).cos());
    match load {
        EndLoad::Strain => strain_driven,
        EndLoad::Traction => strain_driven / loss,
    }
}

/// Returns (2k − 1) π/2, the phase of mode k at the free end.
fn quarter_waves(k: usize) -> f64 {
    (k as f64 - 0.5) * PI
}

fn wave_speed(data: &RodData) -> f64 {
    (data.axial_stiffness / data.density).sqrt()
}
