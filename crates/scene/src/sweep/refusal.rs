//! Rejection of invalid scenes before any case of a sweep is computed.

use std::any::Any;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::grid::Case;
use crate::{Error, InputError, Scene, parallel, run};

/// Returns the scene of a case. `common` contains the overrides for all cases.
///
/// # Errors
/// Fails if the scene is invalid. The error names `--vary` if a varied value caused the error.
pub(super) fn scene_of(path: &Path, common: &[String], case: &Case) -> Result<Scene, InputError> {
    let set = [common, &case.set].concat();
    Scene::load(path, &set).map_err(|error| error.of_vary(&case.set))
}

/// Reads the scene of a case before any case is computed.
///
/// # Errors
/// Fails if the scene is invalid; the error contains the number of the case. Also fails if reading the scene causes a
/// panic.
pub(super) fn read(path: &Path, common: &[String], case: &Case) -> Result<Scene, Error> {
    let scene = caught(|| Ok(scene_of(path, common, case)?));
    scene.map_err(|error| of_case(error, case))
}

/// Reads the scene of a case and rehearses its run.
fn rehearse(path: &Path, common: &[String], case: &Case) -> Result<(), Error> {
    let scene = read(path, common, case)?;
    let outcome = caught(|| run::rehearse(&scene).map_err(Error::before_any_output));
    outcome.map_err(|error| of_case(error, case))
}

/// Rehearses the runs of all `cases` except for skipped cases, up to the first invalid scene. A panic does not make a
/// scene invalid; it occurs again when the case is computed.
///
/// # Errors
/// Returns the error of the first invalid scene.
pub(super) fn expect_right(
    path: &Path,
    common: &[String],
    cases: &[Case],
    n_threads: NonZeroUsize,
    skip: impl Fn(&Case) -> bool + Sync,
) -> Result<(), Error> {
    // All cases before the first invalid case are checked, so that the reported error does not depend on the timing of
    // the threads.
    let first_wrong = AtomicUsize::new(usize::MAX);
    let outcomes = parallel::map(cases, n_threads, |case| {
        if case.number > first_wrong.load(Ordering::Relaxed) || skip(case) {
            return Ok(());
        }
        match rehearse(path, common, case) {
            Ok(()) | Err(Error::Panic(_)) => Ok(()),
            Err(error) => {
                first_wrong.fetch_min(case.number, Ordering::Relaxed);
                Err(error)
            }
        }
    });
    outcomes.into_iter().collect()
}

/// Calls `f` and converts a panic to an error.
pub(super) fn caught<T>(f: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(f))
        .unwrap_or_else(|panic| Err(Error::Panic(panic_message(&*panic))))
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message").to_owned()
}

fn of_case(error: Error, case: &Case) -> Error {
    match error {
        Error::Input(error) => {
            let (number, values) = (case.number + 1, case.set.join(", "));
            error.case(format!("{number}: {values}")).into()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::{axes, cases};
    use super::*;

    /// Regression: all scenes were read before the error of the first scene was reported.
    #[test]
    fn cases_after_the_first_that_is_wrong_are_not_read() {
        let vary = "material[0].density=1,-1,2,-2".to_owned();
        let cases = cases(&axes(&[vary]).unwrap()).unwrap();
        let read = AtomicUsize::new(0);
        let count = |_: &Case| {
            read.fetch_add(1, Ordering::Relaxed);
            false
        };
        let scene = Path::new("cook-static");
        let outcome = expect_right(scene, &[], &cases, NonZeroUsize::MIN, count);
        let printed = outcome.unwrap_err().to_string();
        assert!(printed.contains("case: 2: material[0].density=-1"), "{printed}");
        assert_eq!(read.into_inner(), 2);
    }

    /// Regression: a panic while reading a scene ended the program.
    #[test]
    fn a_panic_is_a_separate_error() {
        let outcome = caught(|| -> Result<(), Error> { panic!("a bound") });
        assert!(matches!(outcome, Err(Error::Panic(printed)) if printed == "a bound"));
    }
}
