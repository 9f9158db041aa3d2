//! Sweep of one scene over a grid of parameter values, with one folder per case.
//!
//! The cases are numbered in the order of the grid, in which the last key changes fastest. A case depends only on its
//! number. Therefore, each case can be computed alone, on any machine, with the same result.

#[cfg(test)]
mod faults;
mod grid;
mod record;
mod refusal;
mod results;
mod table;

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use myovib_model::{EndReason, ModelError};
use serde_json::{Value, json};

use crate::result_folder::{self, Existing, FolderRequest, ResultFolder, program};
use crate::run::{self, RunOptions, RunResult};
use crate::scene::runs_at_once;
use crate::watch::ProgressSink;
use crate::{Error, Input, InputError, Scene, parallel};
use grid::{Case, axes, case_numbers, cases, expect_free};
use record::{Record, table_sizes};
use refusal::{caught, expect_right, read, scene_of};
use results::{ResultColumn, columns};
use table::{is_complete, numbered, stopped, table};

/// Scene, varied keys and output folder of a sweep.
pub struct SweepOptions<'a> {
    /// Scene: a TOML file, or the name of a built-in scene.
    pub scene: PathBuf,
    /// Keys to vary and their values: `key=a,b,c`, `key=lo..hi:n` or `key=lo..hi:n:log`.
    pub vary: Vec<String>,
    /// Table columns to compute from the probes: `name=expression`.
    pub results: Vec<String>,
    /// Overrides that apply to all cases.
    pub set: Vec<String>,
    /// Folder that will contain the folders of the cases.
    pub out: PathBuf,
    pub cases: Cases,
    /// Whether to recompute finished cases.
    pub overwrite: bool,
    /// Whether each case starts from the equilibrium of the case with the preceding value of the last key.
    pub from_neighbor: bool,
    /// Maximum number of cases computed concurrently.
    pub n_threads: NonZeroUsize,
    /// Flag that requests an orderly end of the sweep.
    pub interrupt: Option<&'static AtomicBool>,
    pub progress: &'a dyn ProgressSink,
    /// Callback for each computed case, called with the folder of the case.
    pub finished: &'a (dyn Fn(&Path, &Scene, &RunResult) -> Result<(), Error> + Sync),
}

/// Selection of cases to compute. The table contains all cases, including cases computed earlier.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cases {
    All,
    /// Case `K/N` or cases `K-L/N`, numbered from 1.
    Some(String),
    /// No cases. Only earlier results are collected.
    None,
}

/// Checks the scenes of all cases defined by `vary`, and returns the number of cases.
///
/// # Errors
/// Fails if the values are invalid, if there are too many cases, or if the scene of a case is invalid.
pub fn rehearse(
    scene: &Path,
    set: &[String],
    vary: &[String],
    n_threads: NonZeroUsize,
) -> Result<usize, Error> {
    let all = cases(&axes(vary)?)?;
    expect_right(scene, set, &all, n_threads, |_| false)?;
    Ok(all.len())
}

#[derive(Debug, Clone)]
pub struct SweepResult {
    /// Body of `sweep.json`.
    pub document: Value,
    /// Contents of `sweep.csv`.
    pub csv: String,
    pub keys: Vec<String>,
    /// Names of the requested result columns.
    pub results: Vec<String>,
    /// Reasons why requested or collected cases did not finish.
    pub stopped: Vec<String>,
    /// Notes on cases that did not start from the equilibrium of their neighbor, and on requested columns without
    /// values.
    pub notes: Vec<String>,
    /// Whether results of a case could not be written, for example because the disk is full.
    pub failed_to_write: bool,
}

/// Computes the requested cases and the table of all cases.
///
/// # Errors
/// Fails if the options are invalid, if the scene of a case is invalid, or if the folder cannot be written. A case that
/// fails during its run becomes a row of the table.
pub fn compute(options: &SweepOptions<'_>) -> Result<SweepResult, Error> {
    let axes = axes(&options.vary)?;
    expect_free(&axes, &options.set)?;
    let all = cases(&axes)?;
    let wanted = match &options.cases {
        Cases::All => &all[..],
        Cases::Some(text) => &all[case_numbers(text, all.len())?],
        Cases::None => &[],
    };
    let requested = match options.cases {
        Cases::None => &all[..],
        _ => wanted,
    };
    // An error that does not depend on the varied values occurs already in the first case.
    let scene = read(&options.scene, &options.set, &requested[0])?;
    if options.from_neighbor {
        run::expect_one_equilibrium(&scene).map_err(|error| error.at("--from-neighbor"))?;
    }
    let results = columns(&options.results, &axes, &scene)?;
    let sweep = Sweep {
        options,
        results,
        cases: &all,
        chain_length: if options.from_neighbor { axes[axes.len() - 1].len() } else { 1 },
        n_threads: options.n_threads.min(runs_at_once(&scene.file)),
        scene: scene.text().to_owned(),
        program: program(),
        hashes: Mutex::default(),
        failed_to_write: AtomicBool::new(false),
    };
    if options.cases == Cases::None && all.iter().all(|case| sweep.record(case).is_none()) {
        let error = InputError::new("no case of this sweep was computed in the folder")
            .at("--collect")
            .found(options.out.display())
            .next("use the same scene, --vary, --set and --out as for the computed cases");
        return Err(error.into());
    }
    let request = request(options, &scene, &all);
    let request = FolderRequest { existing: existing(options, &request)?, ..request };
    request.check()?;
    sweep.expect_right(wanted)?;
    let folder = request.open_shared()?;
    sweep.compute_all(wanted, &folder)?;

    let rows: Vec<Value> = all.iter().map(|case| sweep.row(&axes, case)).collect();
    let csv = table(&axes, &sweep.results, &rows);
    let stopped = requested.iter().filter_map(|case| stopped(&rows[case.number])).collect();
    let restarted = requested.iter().filter_map(|case| sweep.restart_note(case));
    let without_values = sweep.results.iter().filter_map(|column| {
        let rows = requested.iter().map(|case| &rows[case.number]);
        let count = rows.filter(|row| is_complete(row) && row[&column.name].is_null()).count();
        (count > 0).then(|| {
            format!(
                "--result {}: {count} finished case(s) have no finite value: the expression is undefined, or the \
                 probe has no rows at or after the given time",
                column.name
            )
        })
    });
    let notes = restarted.chain(without_values).collect();
    let rows: Vec<Value> = rows.into_iter().map(|row| numbered(&axes, row)).collect();
    let document = json!({ "rows": rows });
    for (name, text) in
        [("sweep.csv", csv.clone()), ("sweep.json", crate::json::document("sweep", &document)?)]
    {
        folder.write(name, text)?;
    }
    let results = sweep.results.iter().map(|column| column.name.clone());
    Ok(SweepResult {
        document,
        csv,
        keys: axes.iter().map(|axis| axis.key.clone()).collect(),
        results: results.collect(),
        stopped,
        notes,
        failed_to_write: sweep.failed_to_write.into_inner(),
    })
}

/// Returns the request for the folder of a sweep. For each case, the folder contains a subfolder, a record and a lock
/// file.
fn request<'a>(
    options: &'a SweepOptions<'_>,
    scene: &'a Scene,
    cases: &[Case],
) -> FolderRequest<'a> {
    let of_cases = cases.iter().flat_map(|case| [folder_of(case), record_of(case), lock_of(case)]);
    let mut origin = json!({
        "scene": options.scene.file_name().map(|name| name.to_string_lossy()),
        "vary": options.vary,
        "set": options.set,
    });
    if options.from_neighbor {
        origin["from_neighbor"] = json!(true);
    }
    let tables = ["sweep.csv", "sweep.json", result_folder::PAGE].map(str::to_owned);
    FolderRequest {
        path: &options.out,
        command: "sweep",
        existing: Existing::Add,
        can_resume: false,
        files: of_cases.chain(tables).collect(),
        origin,
        reads: &scene.paths,
    }
}

/// Returns the treatment of existing results. The same sweep is continued. Another sweep is replaced only if
/// overwriting is requested.
fn existing(
    options: &SweepOptions<'_>,
    request: &FolderRequest<'_>,
) -> Result<Existing, InputError> {
    match request.earlier_origin()? {
        Some(other) if other != request.origin && options.overwrite => Ok(Existing::Overwrite),
        Some(other) if other != request.origin => {
            Err(InputError::new(format!("{} contains another sweep", options.out.display()))
                .at("--out")
                .found(other)
                .next("choose another folder, or use --overwrite"))
        }
        _ => Ok(Existing::Add),
    }
}

fn folder_of(case: &Case) -> String {
    format!("case-{:04}", case.number + 1)
}

/// Returns the name of the file that records the result of a case.
fn record_of(case: &Case) -> String {
    format!("case-{:04}.json", case.number + 1)
}

/// Returns the name of the lock file of a case. A process holds the lock until it has recorded the case.
fn lock_of(case: &Case) -> String {
    format!(".case-{:04}.lock", case.number + 1)
}

/// Data shared by all cases.
struct Sweep<'a> {
    options: &'a SweepOptions<'a>,
    results: Vec<ResultColumn>,
    cases: &'a [Case],
    /// Number of successive cases in a chain. Each case except the first in the chain starts from the equilibrium of
    /// the previous case.
    chain_length: usize,
    /// Number of concurrent cases: the requested number, reduced if the program could otherwise not open enough files.
    n_threads: NonZeroUsize,
    /// Scene text without overrides.
    scene: String,
    program: String,
    /// Hashes of the input files of cases. Each hash is computed only once; it is `None` for an unreadable file.
    hashes: Mutex<HashMap<PathBuf, Option<String>>>,
    /// Whether results of a case could not be written.
    failed_to_write: AtomicBool,
}

impl Sweep<'_> {
    fn is_interrupted(&self) -> bool {
        let flag = self.options.interrupt;
        flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn folder(&self, case: &Case) -> PathBuf {
        self.options.out.join(folder_of(case))
    }

    /// Returns the neighboring case whose equilibrium is the starting point of a case, if there is one.
    fn neighbor(&self, case: &Case) -> Option<&Case> {
        let is_first = case.number.is_multiple_of(self.chain_length);
        (!is_first).then(|| &self.cases[case.number - 1])
    }

    /// Returns a note if a case has a neighbor but started from the unloaded body.
    fn restart_note(&self, case: &Case) -> Option<String> {
        self.neighbor(case)?;
        let is_continued = self.record(case)?.result["is_continued"] == true;
        (!is_continued).then(|| {
            format!(
                "case {}: the search started from the unloaded body and may have left the branch of the previous \
                 case; \
                 choose closer values of the last key",
                case.number + 1
            )
        })
    }

    /// Fails if a case to be computed has an invalid scene.
    fn expect_right(&self, cases: &[Case]) -> Result<(), Error> {
        let Self { options, n_threads, .. } = self;
        let skip = |case: &Case| self.is_interrupted() || !self.is_due(case);
        expect_right(&options.scene, &options.set, cases, *n_threads, skip)
    }

    /// Returns whether a case must be computed, because it has no result or because recomputation is requested.
    fn is_due(&self, case: &Case) -> bool {
        self.options.overwrite || !self.is_done(case)
    }

    /// Computes all due cases. If another process is computing a case, waits for that process, and computes the case
    /// here if that process fails.
    fn compute_all(&self, cases: &[Case], folder: &ResultFolder) -> Result<(), Error> {
        let done = AtomicUsize::new(0);
        let compute = |case: &Case| {
            if self.is_interrupted() {
                return Ok(());
            }
            while self.is_due(case) && !self.is_interrupted() {
                match self.compute(case, folder) {
                    Err(Error::Busy(_)) => thread::sleep(Duration::from_millis(200)),
                    computed => {
                        computed?;
                        break;
                    }
                }
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let progress = self.options.progress;
            progress.on_progress(&|| format!("{done} of {} cases", cases.len()));
            Ok(())
        };
        let chains = cases.chunk_by(|_, next| self.neighbor(next).is_some());
        let chains: Vec<&[Case]> = chains.collect();
        let outcomes =
            parallel::map(&chains, self.n_threads, |chain| chain.iter().try_for_each(compute));
        outcomes.into_iter().collect()
    }

    /// Computes a case and records its result. A failure is also recorded, but a failed case is computed again when the
    /// sweep is repeated.
    ///
    /// # Errors
    /// Fails if another process is computing the case, or if the record cannot be written.
    fn compute(&self, case: &Case, folder: &ResultFolder) -> Result<(), Error> {
        let options = self.options;
        let _lock = folder.lock_part(&lock_of(case))?;
        if !self.is_due(case) {
            return Ok(()); // another process has just computed it
        }
        // If this sweep is killed, the next sweep computes the case again.
        folder.remove(&record_of(case))?;
        let mut inputs = Vec::new();
        let (done, result) = match caught(|| self.run(case, &mut inputs)) {
            Ok(result) => {
                // Whether a case reaches its CPU time limit depends on the machine.
                let machine_dependent = [EndReason::Interrupted, EndReason::WorkCap];
                let reason = result.outcome.reason();
                (!reason.is_some_and(|reason| machine_dependent.contains(&reason)), result.document)
            }
            Err(error @ Error::Busy(_)) => return Err(error),
            Err(error) => {
                let is_output =
                    matches!(error, Error::File { .. } | Error::Model(ModelError::Output(_)));
                self.failed_to_write.fetch_or(is_output, Ordering::Relaxed);
                let cause = std::error::Error::source(&error);
                let cause = cause.map_or(String::new(), |cause| format!(": {cause}"));
                let message = format!("{error}{cause}");
                (false, json!({ "outcome": "failed", "message": message }))
            }
        };
        let record = Record {
            program: self.program.clone(),
            scene: self.scene.clone(),
            common: options.set.clone(),
            set: case.set.clone(),
            inputs,
            done,
            tables: table_sizes(&self.folder(case)),
            result,
        };
        folder.write(&record_of(case), serde_json::to_string(&record)?)
    }

    fn run(&self, case: &Case, inputs: &mut Vec<Input>) -> Result<RunResult, Error> {
        let options = self.options;
        let scene = scene_of(&options.scene, &options.set, case)?;
        inputs.clone_from(&scene.inputs);
        let run = RunOptions {
            existing: Existing::Overwrite,
            interrupt: options.interrupt,
            neighbor: self.neighbor(case).map(|neighbor| self.folder(neighbor)),
            ..RunOptions::into_folder(self.folder(case))
        };
        let result = run::compute(&scene, &run)?;
        (options.finished)(&run.out, &scene, &result)?;
        Ok(result)
    }
}
