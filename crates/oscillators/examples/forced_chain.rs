//! The paper's chain of 20 oscillators under an 8 Hz forcing, integrated from rest until its coherence is steady.
//!
//! The forcing replaces the rod, which follows its load almost instantly at 8 Hz. The amplitude of the forcing
//! increases to L/2 = 0.05 with the paper's ramp. Paper: section 3.1, Figure 3.
//!
//! `cargo run -p myovib-oscillators --example forced_chain`

use std::f64::consts::PI;

use myovib_oscillators::{
    Chain, Coefficients, Coherence, Detuning, Drive, Ends, Network, Settled, centroid_frequency,
};

const STEP: f64 = 1e-3;
const T_END: f64 = 200.0;
const WINDOW: f64 = 20.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let detuning = Detuning::default();
    let drive = Drive::default();
    let chain = Chain {
        omega: detuning.frequencies(20)?,
        coefficients: Coefficients::default(),
        ends: Ends::Periodic,
        reach: drive.reach,
    };
    let network = chain.network()?;
    let forcing = |t: f64| {
        let ramp = 1.0 / (1.0 + (8.0 - 10.0 * t).exp()) - 1.0 / (1.0 + 8.0_f64.exp());
        drive.forcing(0.05 * ramp * (16.0 * PI * t).sin())
    };

    let n = network.n_oscillators();
    let mut s = vec![0.0; network.n_states()];
    let (mut times, mut centroid, mut phase, mut frequency) = (vec![], vec![], vec![], vec![]);
    for k in 1..=(T_END / STEP) as u32 {
        let t = f64::from(k) * STEP;
        s = runge_kutta_step(&network, &forcing, t - STEP, &s);
        let (y, w) = s.split_at(n);
        let coherence = Coherence::new(network.omega(), y, w);
        let acceleration = rhs(&network, forcing(t), &s).split_off(n);
        times.push(t);
        centroid.push(coherence.centroid.norm());
        phase.push(coherence.phase.norm());
        frequency.extend(centroid_frequency(network.omega(), y, w, &acceleration));
    }

    println!("generator {:?}, seed {}", detuning.generator, detuning.seed);
    for (name, values) in [("|Ψ|", &centroid), ("|χ|", &phase), ("f/Hz", &frequency)] {
        let Settled { mean, min, max, std, .. } = Settled::over_window(&times, values, WINDOW)?;
        println!("{name:>5}: mean {mean:.4}, range [{min:.4}, {max:.4}], deviation {std:.4}");
    }
    Ok(())
}

/// Returns ṡ = −F(s, 0; c).
fn rhs(network: &Network, c: f64, s: &[f64]) -> Vec<f64> {
    let mut s_dot = vec![0.0; s.len()];
    network.residual(s, &vec![0.0; s.len()], &[c], &mut s_dot);
    s_dot.iter_mut().for_each(|x| *x = -*x);
    s_dot
}

/// Performs one step of the classical Runge–Kutta method of order 4.
fn runge_kutta_step(
    network: &Network,
    forcing: &impl Fn(f64) -> f64,
    t: f64,
    s: &[f64],
) -> Vec<f64> {
    let slope = |c: f64, h: f64, k: &[f64]| {
        let moved: Vec<f64> = s.iter().zip(k).map(|(s, k)| s + h * k).collect();
        rhs(network, c, &moved)
    };
    let middle = forcing(t + STEP / 2.0);
    let k1 = slope(forcing(t), 0.0, s);
    let k2 = slope(middle, STEP / 2.0, &k1);
    let k3 = slope(middle, STEP / 2.0, &k2);
    let k4 = slope(forcing(t + STEP), STEP, &k3);
    let increment = |i: usize| STEP / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    (0..s.len()).map(|i| s[i] + increment(i)).collect()
}
