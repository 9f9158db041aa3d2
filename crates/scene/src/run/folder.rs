//! The folder of a run: who may write into it, and what it holds.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Existing, RunOptions};
use crate::scene_file::{Analysis, SceneFile};
use crate::state::State;
use crate::{Error, Input, InputError, Scene, atomic_file, json, vtu};

/// What runs write besides the tables of their probes.
const OURS: [&str; 8] = [
    Record::NAME,
    State::NAME,
    "run.json",
    "checkpoint.json",
    "report.html",
    vtu::LIST,
    vtu::PLACES_LIST,
    LOCK,
];
/// Held while a run writes.
const LOCK: &str = ".lock";

/// What a folder is of: the scene with its defaults, the files it was made of, the tables of its
/// probes. Written before anything else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    scene: Value,
    inputs: Vec<Input>,
    tables: Vec<String>,
}

impl Record {
    const NAME: &'static str = "scene.json";

    /// The record of a scene.
    pub(super) fn of(scene: &Scene) -> Result<Self, Error> {
        Ok(Self {
            scene: serde_json::to_value(&scene.file)?,
            inputs: scene.inputs.clone(),
            tables: tables_of(&scene.file).map(table_of).collect(),
        })
    }

    fn read(folder: &Path) -> Option<Self> {
        let text = fs::read_to_string(folder.join(Self::NAME)).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// Refuses to go on with what is not the same scene, made of the same files.
    fn check(&self, before: &Self, folder: &Path) -> Result<(), InputError> {
        let wrong = |message: String| {
            InputError::new(message)
                .at(folder.display())
                .next("--overwrite computes the run again")
        };
        if without_end(&before.scene) != without_end(&self.scene) {
            let error = wrong("the run in the folder is of another scene".to_owned());
            return Err(error.next("or resume with the scene and the --set values of that run"));
        }
        match self.inputs.iter().find(|now| !before.inputs.contains(now)) {
            Some(input) => Err(wrong(format!(
                "`{}` has changed since the run began",
                input.file.display()
            ))),
            None => Ok(()),
        }
    }
}

/// The scene but for its end time, to which a run may be extended.
fn without_end(scene: &Value) -> Value {
    let mut scene = scene.clone();
    if let Some(time) = scene.get_mut("time").and_then(Value::as_object_mut) {
        time.remove("end");
    }
    scene
}

/// The name of the table of modes, which stands for a probe's.
pub(super) const MODES: &str = "modes";

/// Names of the tables that a run of the scene writes: those of its probes, or that of the modes.
fn tables_of(file: &SceneFile) -> impl Iterator<Item = &str> {
    let of_modes = file.analysis == Analysis::Modes;
    let probes = file.probe.iter().map(|probe| probe.name.as_str());
    let modes = of_modes.then_some(MODES).into_iter();
    modes.chain(probes.filter(move |_| !of_modes))
}

/// The name of the file of a table.
pub(super) fn table_of(probe: &str) -> String {
    format!("{probe}.csv")
}

/// A folder that takes the results of one run. No other run writes into it as long as this is there.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    _lock: File,
}

impl Folder {
    /// Refuses a folder that holds a run which is to stay: before long work, too.
    pub(super) fn expect_free(options: &RunOptions<'_>, record: &Record) -> Result<(), InputError> {
        if options.existing != Existing::Refuse {
            return Ok(());
        }
        let path = &options.out;
        let ours = |name: &str| OURS.contains(&name) && name != LOCK;
        let is_there = |name: &String| fs::symlink_metadata(path.join(name)).is_ok();
        let there = entries(path)
            .into_iter()
            .find(|name| ours(name))
            .or_else(|| record.tables.iter().find(|name| is_there(name)).cloned());
        let Some(name) = there else { return Ok(()) };
        let resume = match record.scene["analysis"] == "dynamic" {
            true => ", or --resume to go on with it",
            false => "",
        };
        Err(
            InputError::new(format!("{} holds a run already", path.display()))
                .at("--out")
                .found(name)
                .next(format!("give another folder, or --overwrite{resume}")),
        )
    }

    /// Refuses to replace a run that the scene reads from, as one that starts from it.
    pub(super) fn expect_not_read(
        options: &RunOptions<'_>,
        scene: &Scene,
    ) -> Result<(), InputError> {
        let is_ours = |path: &&PathBuf| OURS.iter().any(|name| path.ends_with(name));
        let folder = |path: &Path| path.canonicalize().ok();
        let out = folder(&options.out);
        let mut read = scene.paths.iter().filter(is_ours);
        let within = read.find(|path| out.is_some() && path.parent().and_then(folder) == out);
        match within.filter(|_| options.existing == Existing::Overwrite) {
            None => Ok(()),
            Some(path) => Err(InputError::new(
                "the scene reads from the run that it is to replace",
            )
            .at("--out")
            .found(path.display())
            .next("give another folder")),
        }
    }

    /// Makes the folder, or takes the one that is there as the options say.
    pub(super) fn open(options: &RunOptions<'_>, record: &Record) -> Result<Self, Error> {
        Self::expect_free(options, record)?;
        let path = options.out.clone();
        if options.existing == Existing::Resume {
            let before = Record::read(&path).ok_or_else(|| {
                InputError::new("there is no run to go on with")
                    .at(path.join(Record::NAME).display())
                    .next("run without --resume")
            })?;
            record.check(&before, &path)?;
            let lock = lock(&path)?;
            let folder = Self { path, _lock: lock };
            if before != *record {
                folder.write(Record::NAME, &json::document("scene", record)?)?; // to a later end
            }
            return Ok(folder);
        }
        fs::create_dir_all(&path).map_err(Error::file("make", &path))?;
        let lock = lock(&path)?;
        clear(&path, record)?;
        let folder = Self { path, _lock: lock };
        let text = json::document("scene", record)?;
        folder.write(Record::NAME, &text)?;
        Ok(folder)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file whole.
    pub(super) fn write(&self, name: &str, text: &str) -> Result<(), Error> {
        atomic_file::save(&self.path.join(name), text)
    }
}

/// Removes what an earlier run left, and what lies where this one will write.
fn clear(folder: &Path, record: &Record) -> Result<(), Error> {
    let before = Record::read(folder).map_or(Vec::new(), |before| before.tables);
    let is_of_a_run = |name: &String| {
        (OURS.contains(&name.as_str()) && name != LOCK)
            || before.contains(name)
            || record.tables.contains(name)
            || vtu::is_of_a_series(name)
            || atomic_file::is_under_way(name)
    };
    for name in entries(folder).into_iter().filter(is_of_a_run) {
        let file = folder.join(name);
        fs::remove_file(&file).map_err(Error::file("remove", &file))?;
    }
    Ok(())
}

/// Names in a folder; none where there is no folder.
fn entries(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect()
}

/// Takes the folder for this run.
fn lock(folder: &Path) -> Result<File, Error> {
    let path = folder.join(LOCK);
    let fail = Error::file("lock", &path);
    if fs::symlink_metadata(&path).is_ok_and(|there| !there.is_file()) {
        return Err(fail(io::Error::other("it is no regular file")));
    }
    let mut options = OpenOptions::new();
    let opened = options.write(true).create(true).truncate(false).open(&path);
    let file = match opened {
        Ok(file) => file,
        Err(error) => return Err(fail(error)),
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let error = InputError::new(format!("another run writes into {}", folder.display()));
            Err(error.next("wait for it, or give another folder").into())
        }
        // A file system without locks has none to offer.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(tables: &[&str]) -> Record {
        Record {
            scene: Value::Null,
            inputs: Vec::new(),
            tables: tables.iter().map(|&name| name.to_owned()).collect(),
        }
    }

    fn options(path: &Path, existing: Existing) -> RunOptions<'static> {
        RunOptions {
            existing,
            ..RunOptions::into_folder(path)
        }
    }

    /// Regression: `--overwrite` left fields, tables and the report of the earlier run.
    #[test]
    fn what_an_earlier_run_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        drop(Folder::open(&options(path, Existing::Refuse), &record(&["old.csv"])).unwrap());
        let left = [
            "old.csv",
            "run.json",
            "report.html",
            "fields.pvd",
            "fields_00003.vtu",
            "places.pvd",
            "places_00003.vtu",
        ];
        for name in left.iter().chain(&["mine.csv", "fields_of_mine.vtu"]) {
            fs::write(path.join(name), "").unwrap();
        }
        let again = Folder::open(&options(path, Existing::Refuse), &record(&["new.csv"]));
        assert!(again.unwrap_err().to_string().contains("holds a run"));
        drop(Folder::open(&options(path, Existing::Overwrite), &record(&["new.csv"])).unwrap());
        let mut there = entries(path);
        there.sort();
        assert_eq!(
            there,
            [".lock", "fields_of_mine.vtu", "mine.csv", "scene.json"]
        );
    }

    /// Regression: two runs wrote into one folder.
    #[test]
    fn a_folder_takes_one_run_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = Folder::open(&options(folder.path(), Existing::Refuse), &record(&[])).unwrap();
        for existing in [Existing::Overwrite, Existing::Resume] {
            let second = Folder::open(&options(folder.path(), existing), &record(&[]));
            let message = second.unwrap_err().to_string();
            assert!(message.contains("another run writes"), "{message}");
        }
        drop(first);
        assert!(Folder::open(&options(folder.path(), Existing::Resume), &record(&[])).is_ok());
    }

    /// Regression: a changed mesh was not seen.
    #[test]
    fn a_run_of_changed_files_is_not_gone_on_with() {
        let folder = tempfile::tempdir().unwrap();
        let with = |sha256: &str| Record {
            inputs: vec![Input {
                file: "a.msh".into(),
                sha256: sha256.to_owned(),
            }],
            ..record(&[])
        };
        let refuse = options(folder.path(), Existing::Refuse);
        drop(Folder::open(&refuse, &with("1")).unwrap());
        let resume = options(folder.path(), Existing::Resume);
        assert!(Folder::open(&resume, &with("1")).is_ok());
        let message = Folder::open(&resume, &with("2")).unwrap_err().to_string();
        assert!(message.contains("`a.msh` has changed"), "{message}");
    }
}
