//! Frequencies chosen by the response.

use std::f64::consts::PI;
use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::modes::Modes;
use myovib_scene::response::{Peak, Response};
use myovib_scene::watch::Watcher;

use super::{column, response};

/// Returns a beam loaded at its tip. With zero `damping` (s), the response is the limit of small damping.
fn beam(frequencies: &str, damping: f64) -> String {
    format!(
        "analysis = \"response\"\n[response]\nfrequencies = \"{frequencies}\"\n[mesh]\ntype = \"beam\"\nlength = 0.1\n\
         height = 0.02\ncells = [10, 2]\n[solid]\nbulk_modulus = 1e5\nrayleigh_stiffness = {damping}\n[[material]]\n\
         law = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n[[fixed]]\ngroup = \"fixed\"\n[[traction]]\n\
         group = \"load\"\nresponse = {{ x = 1.0, y = 1.0 }}\n[[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.1, 0.0]\n\
         quantities = [\"u\"]\n"
    )
}

fn peaks<'a>(found: &'a Response, column: &str) -> Vec<&'a Peak> {
    found.peaks.iter().filter(|peak| peak.column == column).collect()
}

/// Checks adaptive frequencies against a fixed grid that resolves the same peaks with more than three times as many
/// frequencies.
#[test]
fn adaptive_frequencies_find_the_peaks_of_a_fine_grid() {
    let damping = 2e-5;
    let fine = response(&beam("1..100:397", damping));
    let found = response(&beam("1..100:adaptive:1e-4", damping));
    assert!(found.interpolation_error.unwrap() <= 1e-4);
    let n = found.frequencies.len();
    assert!(3 * n < fine.frequencies.len(), "{n} frequencies");
    for column in ["u_x", "u_y"] {
        let (found, fine) = (peaks(&found, column), peaks(&fine, column));
        assert_eq!(found.len(), fine.len(), "{column}: {found:?} {fine:?}");
        for (a, b) in found.iter().zip(fine) {
            // Both peaks are interpolated. The accepted error of an amplitude is 1e-4 with adaptive frequencies and
            // 1e-2 with the fixed grid.
            assert!((a.frequency / b.frequency - 1.0).abs() < 1e-4, "{a:?} {b:?}");
            assert!((a.amplitude / b.amplitude - 1.0).abs() < 1e-2, "{a:?} {b:?}");
        }
    }
}

/// Checks peaks with widths of 1e-3 Hz to 0.1 Hz, far below the spacing of the first frequencies (9 Hz).
#[test]
fn narrow_peaks_lie_at_the_natural_frequencies() {
    let damping = 2e-7;
    let text = beam("1..100:adaptive", damping);
    let found = response(&text);
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let modes = Modes::of_scene(&scene, Some(20), Watcher::NOBODY).unwrap();
    let modes: Vec<f64> = modes.muscles[0].modes.iter().filter_map(|mode| mode.frequency).collect();
    let modes: Vec<f64> = modes.into_iter().filter(|f| *f < 99.0).collect();
    assert!(modes.len() >= 5, "{modes:?}");
    for &frequency in &modes {
        let mut all = peaks(&found, "u_x").into_iter().chain(peaks(&found, "u_y"));
        // The damping ratio is π f β; other modes shift a peak by less than its half-power width.
        let width = 2.0 * PI * frequency * damping;
        let is_there = all.any(|peak| (peak.frequency / frequency - 1.0).abs() < width);
        assert!(is_there, "{frequency} Hz: {:?}", found.peaks);
    }
    // The table names the modes of these peaks. A maximum between two resonances is much wider.
    let is_narrow = |peak: &&Peak| peak.damping_ratio.is_some_and(|ratio| ratio < 1e-3);
    let narrow: Vec<&Peak> = found.peaks.iter().filter(is_narrow).collect();
    assert!(narrow.len() >= modes.len(), "{:?}", found.peaks);
    for peak in narrow {
        // Regression: 1e-4 of the range exceeded the width of the peak, and the table contained only half of its power.
        let curve = column(&found, "tip", &peak.column);
        let largest = found
            .frequencies
            .iter()
            .zip(curve)
            .filter(|(f, _)| (**f / peak.frequency - 1.0).abs() < 1e-2);
        let largest = largest.map(|(_, value)| value.norm()).fold(0.0, f64::max);
        // A frequency at a distance of 3 % of the half width has an amplitude smaller by 5e-4, and the rational function may
        // have an error of 1e-3.
        assert!((largest / peak.amplitude - 1.0).abs() < 2e-3, "{peak:?} {largest}");
        let mode = peak.mode.unwrap();
        let width = 2.0 * PI * mode.frequency * damping;
        assert!((peak.frequency / mode.frequency - 1.0).abs() < width, "{peak:?}");
        // Both frequencies are computed to the tolerance of the eigenvalue solver, but with different subspaces.
        assert!((mode.frequency / modes[mode.number - 1] - 1.0).abs() < 1e-9, "{peak:?}");
    }
}

/// Regression: the volume ratio of an incompressible body, a rounding error, was resolved with hundreds of frequencies.
#[test]
fn a_constant_volume_ratio_has_no_amplitude() {
    let text = |quantities: &str| {
        let incompressible = beam("1..100:adaptive", 2e-5).replace("= 1e5", "= inf");
        incompressible
            + &format!(
                "[[probe]]\nname = \"body\"\ntype = \"average\"\ngroup = \"body\"\nquantities = {quantities}\n"
            )
    };
    let [without, with] =
        ["[\"u\"]", "[\"u\", \"J\"]"].map(|quantities| response(&text(quantities)));
    assert_eq!(with.frequencies, without.frequencies);
    assert!(with.probes.iter().all(|probe| !probe.columns.contains(&"J".to_owned())));
    assert_eq!(with.notes.len(), without.notes.len() + 1, "{:?}", with.notes);
}

#[test]
fn invalid_adaptive_ranges_are_refused() {
    for frequencies in [
        "60..1:adaptive",
        "-1..60:adaptive",
        "1..60:adaptive:0",
        "1..60:adaptive:x",
        "1..60:adaptively",
    ] {
        let built = Scene::build("scene.toml", &beam(frequencies, 1e-5), &[], Path::new(""));
        assert!(built.is_err(), "{frequencies}");
    }
}

/// Regression: the width of the flank between two antiresonances was reported as a damping ratio of 0.305 at 24.40 Hz,
/// next to a mode at 23.98 Hz with a damping ratio of 2e-4.
#[test]
fn maxima_that_are_not_resonances_have_no_damping_ratio() {
    let text = beam("1..60:adaptive", 0.0)
        .replace("bulk_modulus = 1e5", "bulk_modulus = 1e6\nrayleigh_mass = 0.0216")
        .replace("shear_modulus = 1e4", "shear_modulus = 1e4\nviscosity = 0.0336")
        .replace("y = 1.0 }", "y = 0.3 }")
        + "[[probe]]\nname = \"root\"\ntype = \"reaction\"\ngroup = \"fixed\"\n";
    let found = response(&text);
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let modes = Modes::of_scene(&scene, Some(20), Watcher::NOBODY).unwrap();
    let modes = &modes.muscles[0].modes;
    let (mut with, mut without) = (0, 0);
    for peak in &found.peaks {
        let Some(ratio) = peak.damping_ratio else {
            without += 1;
            continue;
        };
        with += 1;
        let mode = &modes[peak.mode.unwrap().number - 1];
        // Half-power widths equal the modal damping up to the contributions of other modes. At the weakest peak, these
        // contributions cause a factor of 2.7. At maxima between antiresonances (0.04 to 0.33), the factor would be at
        // least 160.
        let modal = mode.damping_ratio.unwrap();
        assert!((0.5..5.0).contains(&(ratio / modal)), "{peak:?} {modal}");
    }
    assert!(with >= 8 && without >= 1, "{with} {without} {:?}", found.peaks);
}
