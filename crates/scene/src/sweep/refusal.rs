//! Cases whose scene is wrong are refused before any case is computed.

use std::num::NonZeroUsize;
use std::path::Path;

use super::grid::Case;
use crate::{Error, InputError, Scene, parallel, run};

/// The scene of a case: `common` overrides are those of all cases.
///
/// # Errors
/// What is wrong in it, told of `--vary` where that gave it.
pub(super) fn scene_of(path: &Path, common: &[String], case: &Case) -> Result<Scene, InputError> {
    let set = [common, &case.set].concat();
    Scene::load(path, &set).map_err(|error| error.of_vary(&case.set))
}

/// Reads the scenes of `cases`, but for those to skip.
///
/// # Errors
/// What is wrong with the first that is.
pub(super) fn expect_right(
    path: &Path,
    common: &[String],
    cases: &[Case],
    n_threads: NonZeroUsize,
    skip: impl Fn(&Case) -> bool + Sync,
) -> Result<(), Error> {
    let outcomes = parallel::map(cases, n_threads, |case| {
        if skip(case) {
            return Ok(());
        }
        let scene = scene_of(path, common, case).map_err(Error::from);
        let outcome = scene.and_then(|scene| run::rehearse(&scene));
        outcome.map_err(|error| of_case(error.before_any_output(), case))
    });
    outcomes.into_iter().collect()
}

/// The error with the case that it is of.
fn of_case(error: Error, case: &Case) -> Error {
    match error {
        Error::Input(error) => {
            let (number, values) = (case.number + 1, case.set.join(", "));
            error.case(format!("{number}: {values}")).into()
        }
        other => other,
    }
}
