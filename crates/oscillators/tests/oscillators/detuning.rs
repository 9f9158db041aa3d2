//! Tests of the random streams, compared with published values, and of the frequency interval.

use std::f64::consts::PI;

use myovib_oscillators::{Detuning, Error, Generator};

/// Compares the stream with MATLAB's documented output of `rng default; rand(1, 5)`, in four and in fifteen
/// digits.
#[test]
fn the_matlab_stream_matches_published_values() {
    let numbers = Generator::Matlab.uniform(5489, 5);
    let long = ["0.814723686393179", "0.905791937075619", "0.126986816293506"];
    for (number, digits) in numbers.iter().zip(long) {
        // MATLAB's `format long` rounds to 15 decimals.
        let printed: f64 = digits.parse().unwrap();
        assert!((number - printed).abs() <= 0.5000001e-15, "{number} {digits}");
    }
    for (number, digits) in numbers[3..].iter().zip([0.9134, 0.6324]) {
        assert!((number - digits).abs() <= 0.5e-4, "{number} {digits}");
    }
}

/// The 10000th word of MT19937 with its default seed is 4123659995 (C++ standard, [rand.predef]); words 9999 and 10000
/// form the 5000th double.
#[test]
fn the_mersenne_twister_matches_the_standard() {
    let number = Generator::Matlab.uniform(5489, 5000)[4999];
    let bits = (number * (1_u64 << 53) as f64) as u64;
    assert_eq!(bits & ((1 << 26) - 1), 4_123_659_995 >> 6);
}

#[test]
fn the_chacha_stream_is_uniform_and_reproducible() {
    let numbers = Generator::ChaCha8.uniform(1, 10_000);
    assert_eq!(numbers, Generator::ChaCha8.uniform(1, 10_000));
    assert_ne!(numbers[..3], Generator::ChaCha8.uniform(2, 3));
    assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
    // The mean of n uniform numbers has the standard deviation 1/sqrt(12 n) = 0.0029. The limit is five times as
    // large.
    let mean = numbers.iter().sum::<f64>() / 1e4;
    assert!((mean - 0.5).abs() < 5.0 * 0.0029, "{mean}");
}

#[test]
fn the_interval_is_filled_symmetrically() {
    let omega = Detuning::default().frequencies(20).unwrap();
    // The first number of the stream, mapped to the interval: 16π − 0.05 + 0.1 · 0.8147…
    let first = 16.0 * PI - 0.05 + 0.1 * 0.814723686393179;
    assert!((omega[0] - first).abs() < 4.0 * 50.0 * f64::EPSILON);
    assert!(omega.iter().all(|w| (w - 16.0 * PI).abs() <= 0.05));
    assert!(omega.iter().any(|w| *w < 16.0 * PI) && omega.iter().any(|w| *w > 16.0 * PI));

    let identical = Detuning { half_width: 0.0, ..Detuning::default() }.frequencies(3).unwrap();
    assert_eq!(identical, [16.0 * PI; 3]);
}

#[test]
fn invalid_intervals_are_rejected() {
    let negative = Detuning { half_width: -0.1, ..Detuning::default() };
    assert_eq!(negative.frequencies(5), Err(Error::HalfWidth { value: -0.1 }));
    let nan = Detuning { half_width: f64::NAN, ..Detuning::default() };
    assert!(matches!(nan.frequencies(5), Err(Error::HalfWidth { .. })));
    assert_eq!(Detuning::default().frequencies(0), Err(Error::NoOscillators));
}
