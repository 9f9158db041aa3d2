//! Interrupted and resumed fits.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use myovib_scene::Error;
use myovib_scene::fit::{FitOptions, FitResult, Outcome};
use myovib_scene::run::Existing;
use myovib_scene::watch::ProgressSink;

use crate::fits::{fitted, measure};
use crate::{SMALL, scene};

/// Checks that a fit that ended early, or was killed after any of its evaluations, is resumed as if it had never been
/// interrupted.
#[test]
fn a_resumed_fit_is_the_uninterrupted_fit() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "solid.rayleigh_mass"], "");
    let data = folder.path().join("measured.csv");
    let more = [&["material[0].c10=3e4"], &SMALL[..]].concat();
    measure(&path, &more, 1.0, &data);
    let run = |existing, max_iterations| {
        fitted(path.clone(), data.clone(), &more[1..], |options| FitOptions {
            existing,
            max_iterations,
            ..options
        })
    };
    let header = folder.path().join("fit");
    std::fs::create_dir(&header).unwrap();
    let is_input = |result: Result<FitResult, Error>| matches!(result, Err(Error::Input(_)));
    assert!(is_input(run(Existing::Resume, 30)), "no history");
    // A file that was not created by a fit is not replaced.
    let mine = header.join("report.html");
    std::fs::write(&mine, "precious").unwrap();
    for existing in [Existing::Refuse, Existing::Overwrite] {
        assert!(is_input(run(existing, 30)), "a file of another origin");
    }
    assert_eq!(std::fs::read_to_string(&mine).unwrap(), "precious");
    std::fs::remove_file(&mine).unwrap();
    let whole = run(Existing::Refuse, 30).unwrap();
    assert!(whole.fit.is_converged(), "{}", whole.ending());
    assert!(is_input(run(Existing::Refuse, 1)), "a fit is there");
    let twice = fitted(path.clone(), data.clone(), &more[1..], |options| FitOptions {
        experiments: vec![options.experiments[0].clone(); 2],
        ..options
    });
    assert!(is_input(twice), "the same measurements twice");
    let own = fitted(path.clone(), data.clone(), &more[1..], |options| {
        let set = vec!["material[0].c10=2e4".to_owned()];
        FitOptions { experiments: vec![(data.clone(), set)], ..options }
    });
    assert!(is_input(own), "a fitted parameter is set");
    // An earlier fit is kept until the first iteration of the new one.
    let names = || -> BTreeSet<_> {
        let files = std::fs::read_dir(&header).unwrap();
        files.map(|file| file.unwrap().file_name()).collect()
    };
    std::fs::write(header.join("fit.json"), "{}").unwrap();
    let kept = names();
    static INTERRUPT: AtomicBool = AtomicBool::new(true);
    let interrupted = fitted(path.clone(), data.clone(), &more[1..], |options| FitOptions {
        interrupt: Some(&INTERRUPT),
        ..options
    });
    assert!(matches!(interrupted, Err(Error::Stopped(_))), "{interrupted:?}");
    assert_eq!(names(), kept);
    let text = |name: &str| std::fs::read_to_string(header.join(name)).unwrap();
    let files = || ["history.csv", "evaluations.txt"].map(text);
    let expected = files();
    let early = run(Existing::Overwrite, 1).unwrap();
    assert!(!early.fit.is_converged(), "{}", early.ending());
    // A killed program may leave an incomplete line.
    let first = text("evaluations.txt").lines().next().unwrap().to_owned();
    let torn = text("evaluations.txt") + &first[..first.len() / 2];
    assert!(expected[1].starts_with(&first));
    std::fs::write(header.join("evaluations.txt"), torn).unwrap();
    let resumed = run(Existing::Resume, 30).unwrap();
    assert_eq!(resumed.document(), whole.document());
    assert_eq!(text("history.csv"), expected[0]);
    // The program was killed after some of its evaluations.
    run(Existing::Overwrite, 30).unwrap();
    let lines: Vec<String> = expected[1].lines().map(str::to_owned).collect();
    for kept in [0, 1, lines.len() / 2, lines.len() - 1, lines.len()] {
        let cut: String = lines[..kept].iter().map(|line| format!("{line}\n")).collect();
        std::fs::write(header.join("evaluations.txt"), cut).unwrap();
        let resumed = run(Existing::Resume, 30).unwrap();
        assert_eq!(resumed.document(), whole.document(), "{kept}");
        assert_eq!(files(), expected, "{kept}");
    }
    let other = fitted(path.clone(), data.clone(), &more, |options| FitOptions {
        existing: Existing::Resume,
        ..options
    });
    let other = other.unwrap_err().to_string();
    assert!(other.contains("scene"), "{other}");
}

/// Interrupts a fit after some iterations and profiles, or after some progress lines of its runs.
struct Patience {
    left: AtomicUsize,
    interrupt: AtomicBool,
    counts_lines: bool,
}

impl ProgressSink for Patience {
    fn on_progress(&self, line: &dyn Fn() -> String) {
        let is_counted = |start| line().starts_with(start);
        let counts = self.counts_lines || ["iteration", "profile"].into_iter().any(is_counted);
        if counts && self.left.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.interrupt.store(true, Ordering::Relaxed);
        }
    }
}

/// Checks a fit interrupted within a run. It has a result if and only if an iteration was written.
#[test]
fn a_fit_interrupted_within_a_run_keeps_its_iterations() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10"], "");
    let data = folder.path().join("measured.csv");
    let more = [&["material[0].c10=1.3e4"], &SMALL[..]].concat();
    measure(&path, &more, 1.0, &data);
    let lines = usize::MAX / 2;
    let fit_of = |left: usize| {
        let patience: &'static Patience = Box::leak(Box::new(Patience {
            left: AtomicUsize::new(left),
            interrupt: AtomicBool::new(false),
            counts_lines: true,
        }));
        let _ = std::fs::remove_dir_all(folder.path().join("fit"));
        let result = fitted(path.clone(), data.clone(), &more[1..], |options| FitOptions {
            interrupt: Some(&patience.interrupt),
            progress: patience,
            ..options
        });
        (result, lines - patience.left.load(Ordering::Relaxed).min(lines))
    };
    let (whole, all) = fit_of(lines);
    assert!(whole.unwrap().fit.is_converged());
    let mut results = [0, 0];
    for percent in [1, 20, 40, 50, 60, 70, 80, 90, 95] {
        let (result, _) = fit_of(1 + all * percent / 100);
        let is_written = folder.path().join("fit/history.csv").exists();
        assert_eq!(result.is_ok(), is_written, "{percent} %");
        if let Ok(result) = &result {
            assert_eq!(result.outcome(), Outcome::Interrupted, "{percent} %");
        }
        results[usize::from(result.is_ok())] += 1;
    }
    assert!(results.iter().all(|count| *count > 0), "{results:?}");
}

/// Checks a fit from two starts, interrupted after each iteration. Its result must use the measurements of the
/// latest phase, its residuals must agree with its points, and computed profiles must be kept. The first phase uses
/// half of the time.
#[test]
fn an_interrupted_fit_keeps_its_results() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].c10", "solid.rayleigh_mass"], "");
    let data = folder.path().join("measured.csv");
    let more = [&["material[0].c10=1.3e4"], &SMALL[..]].concat();
    measure(&path, &more, 1.0, &data);
    let interrupted_after = |iterations| {
        let patience: &'static Patience = Box::leak(Box::new(Patience {
            left: AtomicUsize::new(iterations),
            interrupt: AtomicBool::new(false),
            counts_lines: false,
        }));
        fitted(path.clone(), data.clone(), &more[1..], |options| FitOptions {
            starts: 2,
            profile: true,
            interrupt: Some(&patience.interrupt),
            progress: patience,
            ..options
        })
        .unwrap()
    };
    let (mut reached, mut iterations) = (0, 0);
    loop {
        iterations += 1;
        let result = interrupted_after(iterations);
        let n = result.points.len();
        println!("{iterations}: {n} measurements, {}", result.ending());
        assert_eq!(result.fit.residuals.len(), n);
        assert!(n >= reached, "{n} measurements after {reached}");
        reached = n;
        let residuals = result.points.iter().map(|point| point.residual);
        assert!(residuals.eq(result.fit.residuals.iter().copied()));
        let half: f64 = result.fit.residuals.iter().map(|r| 0.5 * r * r).sum();
        // The same squares are summed, so the results agree up to rounding errors.
        assert!((half - result.fit.cost).abs() < 1e-12 * half);
        if result.fit.is_converged() {
            break;
        }
    }
    let all = std::fs::read_to_string(&data).unwrap().lines().count() - 1;
    assert!(reached >= all, "{reached} of {all}");
    // The fit is interrupted first in its first profile, then in its second.
    let is_known = |result: FitResult| result.profiles.iter().map(Result::is_ok).collect();
    let profiles: [Vec<bool>; 2] =
        [0, 1].map(|more| is_known(interrupted_after(iterations + more)));
    assert_eq!(profiles, [[false, false], [true, false]]);
}

/// Checks that a fit interrupted in its first run reports the interruption instead of an invalid start.
#[test]
fn a_fit_interrupted_in_its_first_run_is_interrupted() {
    static INTERRUPT: AtomicBool = AtomicBool::new(true);
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["solid.rayleigh_mass"], "");
    let data = folder.path().join("measured.csv");
    measure(&path, &SMALL, 1.0, &data);
    let error =
        fitted(path, data, &SMALL, |options| FitOptions { interrupt: Some(&INTERRUPT), ..options });
    assert!(matches!(error, Err(myovib_scene::Error::Stopped(_))), "{error:?}");
}
