//! Tests of coherence measures: identities, limits and derivatives.

use std::f64::consts::{PI, TAU};

use crate::common::random;
use myovib_oscillators::{
    Coherence, Error, Neighborhood, Settled, SmoothCoherence, centroid_frequency, coherence_at,
};
use num_complex::Complex64;

#[test]
fn identical_oscillators_count_as_one() {
    let one = Coherence::new(&[50.0], &[1.2], &[-31.0]);
    assert_eq!(one.centroid, Complex64::new(1.2, -31.0 / 50.0));
    for n in [2, 5, 20] {
        let all = Coherence::new(&vec![50.0; n], &vec![1.2; n], &vec![-31.0; n]);
        // A sum of n equal numbers, divided by n, has at most n rounding errors.
        let rounding = n as f64 * f64::EPSILON;
        assert!((all.centroid - one.centroid).norm() <= rounding * one.centroid.norm());
        assert!((all.phase - one.phase).norm() <= rounding);
        assert!((all.phase.norm() - 1.0).abs() <= rounding);
    }
}

#[test]
fn evenly_spread_phases_are_incoherent() {
    let n = 12;
    let theta = |k: usize| TAU * k as f64 / n as f64;
    let y: Vec<f64> = (0..n).map(|k| 2.0 * theta(k).cos()).collect();
    let w: Vec<f64> = (0..n).map(|k| 2.0 * 50.0 * theta(k).sin()).collect();
    let spread = Coherence::new(&vec![50.0; n], &y, &w);
    // The error is the rounding of n numbers of magnitude 2.
    assert!(spread.centroid.norm() < 2.0 * n as f64 * f64::EPSILON);
    assert!(spread.phase.norm() < n as f64 * f64::EPSILON);
}

#[test]
fn an_oscillator_at_rest_has_no_phase() {
    let half = Coherence::new(&[50.0; 2], &[0.0, 3.0], &[0.0, 0.0]);
    assert_eq!((half.centroid.re, half.phase.re), (1.5, 0.5));
    assert_eq!(Coherence::new(&[50.0], &[0.0], &[0.0]).phase, Complex64::ZERO);
    // An oscillator with a tiny radius is not at rest.
    assert_eq!(Coherence::new(&[50.0], &[1e-200], &[0.0]).phase.re, 1.0);
}

#[test]
fn the_centroid_turns_at_the_common_frequency() {
    // The motion y = cos(2π f t) is clockwise. It is on a circle if ω = 2π f.
    let (f, t) = (8.0, 0.017);
    let omega = TAU * f;
    let (y, w) = ((omega * t).cos(), -omega * (omega * t).sin());
    let measured = centroid_frequency(&[omega; 3], &[y; 3], &[w; 3], &[-omega * omega * y; 3]);
    // The error is the rounding of a few operations on numbers of relative accuracy ε.
    assert!((measured.unwrap() - f).abs() < 16.0 * f64::EPSILON * f);
    assert_eq!(centroid_frequency(&[omega], &[0.0], &[0.0], &[1.0]), None);
}

#[test]
fn the_frequency_is_the_turning_of_the_phase() {
    // For a straight motion in the plane, with y and w linear in t, the frequency is compared with central
    // differences of arg Ψ.
    let (omega, y, w) = ([50.0, 49.0, 52.0], random(1, 3), random(2, 3));
    let w: Vec<f64> = w.iter().map(|w| 50.0 * w).collect();
    let w_dot: Vec<f64> = random(3, 3).iter().map(|x| 2500.0 * x).collect();
    let argument = |t: f64| {
        let moved = |x: &[f64], v: &[f64]| -> Vec<f64> {
            x.iter().zip(v).map(|(x, v)| x + t * v).collect()
        };
        Coherence::new(&omega, &moved(&y, &w), &moved(&w, &w_dot)).centroid.arg()
    };
    let h = 1e-6;
    let turning = -(argument(h) - argument(-h)) / (2.0 * h) / TAU;
    let measured = centroid_frequency(&omega, &y, &w, &w_dot).unwrap();
    // The errors are h² Θ'''/6 ≈ 1e-12 · 50³/6 and ε/h ≈ 1e-10, relative to a few Hz.
    assert!((turning - measured).abs() < 1e-6 * measured.abs().max(1.0), "{turning} {measured}");
}

#[test]
fn window_statistics_are_time_averages() {
    // Samples of 1.64 + 0.02 sin(2π 8 t) at uneven times over whole cycles.
    let t: Vec<f64> = (0..=40_000_u32)
        .map(|k| f64::from(k) / 1000.0)
        .map(|t| t + 2e-4 * (37.0 * t).sin())
        .collect();
    let ripple: Vec<f64> = t.iter().map(|t| 1.64 + 0.02 * (16.0 * PI * t).sin()).collect();
    let settled = Settled::over_window(&t, &ripple, 20.0).unwrap();
    // The trapezoidal rule with 125 points per cycle has an error of order 0.02 (2π/125)²/12 = 4e-6. If the window
    // differs from whole cycles by up to 1e-3 s in 20 s, this adds 0.02 · 5e-5 = 1e-6.
    assert!((settled.mean - 1.64).abs() < 5e-6, "{settled:?}");
    assert!((settled.std - 0.02 / 2_f64.sqrt()).abs() < 1e-5, "{settled:?}");
    // Each crest has a sample within half a step, 0.025 rad, so the error is 0.02 · 0.025²/2 = 6e-6.
    assert!((settled.max - 1.66).abs() < 7e-6 && (settled.min - 1.62).abs() < 7e-6);
}

#[test]
fn a_window_includes_a_sample_at_its_start() {
    let settled = Settled::over_window(&[0.0, 1.0, 2.0, 3.0], &[9.0, 1.0, 2.0, 4.0], 2.0).unwrap();
    assert_eq!((settled.min, settled.samples), (1.0, 3));
}

#[test]
fn a_window_requires_two_samples() {
    assert_eq!(
        Settled::over_window(&[0.0, 1.0, 2.0], &[1.0; 3], 0.5),
        Err(Error::Window { window: 0.5, found: 1 })
    );
    assert_eq!(Settled::over_window(&[], &[], 0.5), Err(Error::Window { window: 0.5, found: 0 }));
    assert!(Settled::over_window(&[2.0, 2.0], &[1.0; 2], 0.5).is_err());
    for window in [-1.0, f64::NAN] {
        assert!(matches!(
            Settled::over_window(&[0.0, 1.0, 2.0], &[1.0; 3], window),
            Err(Error::Window { found: 0, .. })
        ));
    }
}

#[test]
fn the_smooth_coherence_tends_to_the_phase_coherence() {
    let (omega, y, w) = ([50.0, 49.0, 52.0], [1.0, -0.3, 0.8], [20.0, 30.0, -10.0]);
    let chi = Coherence::new(&omega, &y, &w).phase.norm_sqr();
    for radius in [1e-2, 1e-3, 1e-4] {
        let smooth = SmoothCoherence::new(radius).unwrap().squared(&omega, &y, &w);
        // The length of each unit vector is too small by ε²/(2 r²) with r > 0.66, so |χ|² changes by at most
        // ε²/r².
        assert!((smooth - chi).abs() < radius * radius / 0.66_f64.powi(2), "{radius}");
    }
    assert!(SmoothCoherence::new(0.0).is_err());
}

#[test]
fn the_gradient_is_the_derivative_of_the_smooth_coherence() {
    let n = 4;
    let omega = [50.0, 49.0, 52.0, 51.0];
    let smooth = SmoothCoherence::new(0.1).unwrap();
    let moving = (random(4, n), random(5, n).iter().map(|w| 50.0 * w).collect::<Vec<_>>());
    let at_rest = (vec![0.0; n], vec![0.0; n]);
    for (y, w) in [moving, at_rest] {
        let (mut by_position, mut by_velocity) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        smooth.gradient(&omega, &y, &w, &mut by_position, &mut by_velocity);
        // With steps of 1e-5 in the phasors, the terms with S''' contribute h²/ε² · O(1) ≈ 1e-8, and rounding
        // contributes ε/h ≈ 2e-11.
        let h = 1e-5;
        let moved = |x: &[f64], k: usize, by: f64| {
            let mut moved = x.to_vec();
            moved[k] += by;
            moved
        };
        for k in 0..n {
            let at = |by: f64| smooth.squared(&omega, &moved(&y, k, by), &w);
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!((slope - by_position[k]).abs() < 1e-7, "y {k}");
            let h = h * omega[k];
            let at = |by: f64| smooth.squared(&omega, &y, &moved(&w, k, by));
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!((slope - by_velocity[k]).abs() < 1e-7 / 50.0, "w {k}");
        }
    }
}

/// Compares the grid search for neighbors with a search over all places.
#[test]
fn neighborhoods_contain_all_places_within_the_radius() {
    let n = 300;
    let coordinates = random(7, 3 * n);
    let places: Vec<[f64; 3]> = coordinates.as_chunks().0.to_vec();
    let omega: Vec<f64> = random(8, 2 * n).iter().map(|x| 50.0 + x).collect();
    let (y, w) = (random(9, 2 * n), random(10, 2 * n));
    let w: Vec<f64> = w.iter().map(|w| 50.0 * w).collect();
    let single = coherence_at(n, &omega, &y, &w);
    for radius in [0.05, 0.3, 1.0, 10.0] {
        let found = Neighborhood::new(places.clone(), radius).unwrap();
        for (place, found) in places.iter().zip(found.coherence(&single)) {
            let distance = |other: &[f64; 3]| -> f64 {
                let squares = place.iter().zip(other).map(|(a, b)| (a - b).powi(2));
                squares.sum::<f64>().sqrt()
            };
            let near: Vec<usize> = (0..n).filter(|&j| distance(&places[j]) <= radius).collect();
            // The expected value is the coherence of all oscillators at these places.
            let own = |all: &[f64]| -> Vec<f64> {
                near.iter().flat_map(|j| [all[2 * j], all[2 * j + 1]]).collect()
            };
            let all = Coherence::new(&own(&omega), &own(&y), &own(&w)).phase.norm();
            // The error is the rounding of sums of at most 600 numbers of magnitude 1 in a different order.
            assert!((found - all).abs() < 600.0 * f64::EPSILON, "{radius}: {found} {all}");
        }
    }
    let alone = Neighborhood::new(places.clone(), 1e-300).unwrap();
    let own: Vec<f64> = single.iter().map(|place| place.phase.norm()).collect();
    assert_eq!(alone.coherence(&single), own);
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Neighborhood::new(places.clone(), radius);
        assert!(matches!(refused, Err(Error::Radius { .. })), "{radius}");
    }
}
