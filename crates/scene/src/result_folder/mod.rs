//! Folder for the results of a command.
//!
//! All commands follow the same rules: a manifest lists the files that the program created, a lock excludes other
//! processes, and a file that the manifest does not list is never replaced or removed.

mod manifest;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};

use crate::atomic_file::{self, Growing};
use crate::versions::Versions;
use crate::{Error, InputError, Scene, inputs};
use manifest::Manifest;
pub use manifest::command_of;

pub(crate) const DOCUMENT: &str = "run.json";
/// Name of the page that the report crate writes.
pub(crate) const PAGE: &str = "report.html";

/// Length of a file name, in bytes, that all common file systems support.
const LONGEST_NAME: usize = 255;

/// File locked by a command while it writes to the folder.
const LOCK: &str = ".lock";

/// Treatment of earlier results in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep the earlier results and refuse to write.
    Refuse,
    /// Remove the files that the earlier command created.
    Overwrite,
    /// Continue the earlier command.
    Resume,
    /// Add files to the earlier results. A file of the same name is replaced if the same command created it.
    Add,
}

impl Existing {
    /// Returns the treatment for the options `--resume` and `--overwrite`, which are mutually exclusive.
    pub fn of(resume: bool, overwrite: bool) -> Self {
        match (resume, overwrite) {
            (true, _) => Self::Resume,
            (_, true) => Self::Overwrite,
            _ => Self::Refuse,
        }
    }
}

/// Request by a command to use a folder. Call [`check`](Self::check) before a long computation, and
/// [`open`](Self::open) as soon as results must be written.
#[derive(Debug, Clone)]
pub struct FolderRequest<'a> {
    /// Folder for the results. It is created if it does not exist.
    pub path: &'a Path,
    /// Name of the command. A folder contains results of only one command.
    pub command: &'static str,
    pub existing: Existing,
    pub can_resume: bool,
    /// Names of all files that the command will write, if they are known before it starts.
    pub files: Vec<String>,
    /// Scene, input files and settings, to be stored in the manifest.
    pub origin: Value,
    /// Files that the command reads. They must not be replaced.
    pub reads: &'a [PathBuf],
}

impl<'a> FolderRequest<'a> {
    /// Returns a request that adds `files` to a folder. It is intended for commands that do not read a scene file.
    pub fn to_add(path: &'a Path, command: &'static str, files: Vec<String>) -> Self {
        Self {
            path,
            command,
            existing: Existing::Add,
            can_resume: false,
            files,
            origin: Value::Null,
            reads: &[],
        }
    }

    /// Returns a request for results computed from a scene.
    ///
    /// # Errors
    /// Fails if the scene cannot be serialized as JSON.
    pub fn of_scene(
        path: &'a Path,
        command: &'static str,
        existing: Existing,
        scene: &'a Scene,
        files: Vec<String>,
    ) -> Result<Self, Error> {
        Ok(Self {
            path,
            command,
            existing,
            can_resume: false,
            files,
            origin: json!({
                "scene": serde_json::to_value(&scene.file)?,
                "inputs": scene.inputs,
            }),
            reads: &scene.paths,
        })
    }

    /// Removes the results that the request would overwrite. Call this function if a command fails before it opens the
    /// folder.
    ///
    /// # Errors
    /// Returns the errors of [`open`](Self::open).
    pub(crate) fn discard(&self) -> Result<(), Error> {
        match self.existing {
            Existing::Overwrite if self.manifest()?.is_some() => remove(self.path),
            _ => Ok(()),
        }
    }

    /// Checks whether the folder can be used. Nothing is written.
    ///
    /// # Errors
    /// Fails if the folder contains results that must be kept or results of another command, if a file to be written
    /// already exists but was not created by the program, or if overwriting would remove a file that the command reads.
    pub fn check(&self) -> Result<(), InputError> {
        self.manifest().map(drop)
    }

    /// Returns the origin of the results in the folder, if it contains results.
    ///
    /// # Errors
    /// Fails if the manifest cannot be read or belongs to another command.
    pub fn earlier_origin(&self) -> Result<Option<Value>, InputError> {
        let found = self.own_manifest()?;
        Ok(found.map(|manifest| manifest.header.origin))
    }

    /// Prepares the folder: acquires the lock, removes the results to be overwritten, and writes the manifest.
    ///
    /// # Errors
    /// Returns the errors of [`check`](Self::check) and of the file system. Also fails if another process has locked
    /// the folder.
    pub fn open(self) -> Result<ResultFolder, Error> {
        self.check()?;
        let path = self.path.to_owned();
        make(&path)?;
        let lock = lock(&path, LOCK, Lock::Exclusive)?;
        self.open_locked(lock, Duration::ZERO)
    }

    /// Prepares the folder like [`open`](Self::open), but shares the lock of the folder with other processes that write
    /// different files.
    pub fn open_shared(self) -> Result<ResultFolder, Error> {
        self.check()?;
        let path = self.path.to_owned();
        make(&path)?;
        match lock(&path, LOCK, Lock::Exclusive) {
            Ok(alone) => drop(self.clone().open_locked(alone, Duration::ZERO)?),
            Err(Error::Busy(_)) if self.existing != Existing::Overwrite => {}
            Err(error) => return Err(error),
        }
        let shared = lock_shared(&path)?;
        let added = Self { existing: Existing::Add, ..self };
        // A lock cannot be changed from exclusive to shared atomically, so another process may have replaced the
        // results in the meantime.
        match added.earlier_origin()? {
            // Other processes may have just created temporary files that they have not locked yet.
            Some(origin) if origin == added.origin => {
                added.open_locked(shared, Duration::from_secs(60))
            }
            _ => Err(Error::Busy(path)),
        }
    }

    /// Opens the folder, which `lock` protects. Removes temporary files with an age of at least `min_age`.
    fn open_locked(self, lock: File, min_age: Duration) -> Result<ResultFolder, Error> {
        let path = self.path.to_owned();
        // Check again, because another process may have written before the lock was acquired.
        let found = self.manifest()?;
        remove_temporary_files(&path, min_age);
        let manifest = match found {
            Some(mut found) if matches!(self.existing, Existing::Resume | Existing::Add) => {
                if found.header.origin != self.origin || found.is_torn {
                    found.header.origin = self.origin;
                    found.save(&path)?;
                }
                for name in &self.files {
                    if !found.lists(name) {
                        found.add(&path, name)?;
                    }
                }
                found
            }
            found => {
                let mut old = found.iter().flat_map(|found| &found.files);
                old.try_for_each(|name| remove(&path.join(name)))?;
                let mut new = Manifest::new(self.command, self.origin, &self.files);
                new.save(&path)?;
                new
            }
        };
        Ok(ResultFolder { path, manifest: Mutex::new(manifest), _lock: lock })
    }

    /// Returns the manifest in the folder, if there is one. Fails if the manifest belongs to another command.
    fn own_manifest(&self) -> Result<Option<Manifest>, InputError> {
        let found = Manifest::read(self.path)?;
        match &found {
            Some(other) if other.header.command != self.command => {
                let command = &other.header.command;
                let error = self.wrong(format!("contains results of `myovib {command}`"));
                Err(error.next("choose another folder"))
            }
            _ => Ok(found),
        }
    }

    /// Returns the manifest in the folder, if there is one. Fails if the request is not allowed in this folder.
    fn manifest(&self) -> Result<Option<Manifest>, InputError> {
        let found = self.own_manifest()?;
        match (&found, self.existing) {
            (Some(_), Existing::Refuse) => {
                let resume = match self.can_resume {
                    true => ", or --resume to continue",
                    false => "",
                };
                let error = self.wrong("already contains results".to_owned());
                return Err(
                    error.next(format!("choose another folder, or use --overwrite{resume}"))
                );
            }
            // A program that was killed before it wrote the manifest leaves its lock file behind.
            (None, Existing::Resume) if !(is_bare(self.path) && self.path.join(LOCK).exists()) => {
                let error = self.wrong("contains no results to continue".to_owned());
                return Err(error.next("omit --resume"));
            }
            _ => {}
        }
        if let Some(name) = self.files.iter().find(|name| name.len() > LONGEST_NAME) {
            let error = InputError::new("a file name is too long").found(name);
            return Err(error.allowed(format!("{LONGEST_NAME} bytes")));
        }
        let is_listed = |name: &str| found.as_ref().is_some_and(|found| found.lists(name));
        let foreign = self
            .files
            .iter()
            .find(|name| !is_listed(name) && fs::symlink_metadata(self.path.join(name)).is_ok());
        if let Some(name) = foreign {
            return Err(not_ours(&self.path.join(name)));
        }
        if let Some(found) = &found {
            self.expect_removable(found)?;
        }
        Ok(found)
    }

    /// Fails if overwriting would remove a file that the command reads, or a foreign folder that has the name of a
    /// listed file.
    fn expect_removable(&self, found: &Manifest) -> Result<(), InputError> {
        if self.existing != Existing::Overwrite {
            return Ok(());
        }
        let real = |path: &Path| path.canonicalize().ok();
        for name in &found.files {
            let path = self.path.join(name);
            let there = fs::symlink_metadata(&path);
            let is_folder = there.is_ok_and(|there| there.is_dir());
            if is_folder && Manifest::read(&path)?.is_none() && !is_bare(&path) {
                return Err(not_ours(&path));
            }
            let file = real(&path);
            let read = self.reads.iter().find(|read| file.is_some() && real(read) == file);
            if let Some(read) = read {
                let error = self.wrong("contains a file that the command reads".to_owned());
                return Err(error.found(read.display()).next("choose another folder"));
            }
        }
        Ok(())
    }

    fn wrong(&self, message: String) -> InputError {
        InputError::new(format!("{} {message}", self.path.display())).at("--out")
    }
}

/// Folder for the results of one command, locked against other processes while this value exists.
#[derive(Debug)]
pub struct ResultFolder {
    path: PathBuf,
    manifest: Mutex<Manifest>,
    _lock: File,
}

impl ResultFolder {
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a file to the manifest before the file is created. Returns the path of the file.
    ///
    /// # Errors
    /// Fails if an unlisted file with this name exists, or if the manifest cannot be written.
    pub fn claim(&self, name: &str) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        let mut manifest = match self.manifest.lock() {
            Ok(manifest) => manifest,
            Err(poisoned) => poisoned.into_inner(),
        };
        if !manifest.lists(name) {
            if fs::symlink_metadata(&path).is_ok() {
                let error = io::Error::other("the file exists and was not written by this program");
                return Err(Error::file("write", &path)(error));
            }
            manifest.add(&self.path, name)?;
        }
        Ok(path)
    }

    /// Writes a complete file atomically.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> Result<(), Error> {
        atomic_file::save(&self.claim(name)?, contents)
    }

    /// Creates a file to which data is written incrementally, such as a table.
    ///
    /// # Errors
    /// Returns the errors of [`claim`](Self::claim). Also fails if the file already exists.
    pub(crate) fn create(&self, name: &str) -> Result<Growing<File>, Error> {
        let path = self.claim(name)?;
        atomic_file::create(&path).map_err(Error::file("write", &path))
    }

    /// Locks a part of a shared folder by means of the file `name`. The lock is held while the returned value exists.
    ///
    /// # Errors
    /// Returns [`Error::Busy`] if another process has locked the file. Also returns the errors of
    /// [`claim`](Self::claim).
    pub(crate) fn lock_part(&self, name: &str) -> Result<File, Error> {
        self.claim(name)?;
        lock(&self.path, name, Lock::Exclusive)
    }

    /// Removes a file from the folder if the file exists.
    pub fn remove(&self, name: &str) -> Result<(), Error> {
        remove(&self.claim(name)?)
    }
}

/// Returns the version and revision of the program. If the revision does not identify the program, a hash of the
/// executable is added.
pub(crate) fn program() -> String {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    let describe = || {
        let Versions { myovib, git, .. } = Versions::found();
        let content = || {
            let bytes = fs::read(std::env::current_exe().ok()?).ok()?;
            Some(inputs::sha256(&bytes))
        };
        let is_known = git != "unknown" && !git.ends_with("-modified");
        let content = if is_known { None } else { content() };
        format!("{myovib} {git} {}", content.unwrap_or_default())
    };
    PROGRAM.get_or_init(describe).clone()
}

/// Returns whether a folder contains nothing except the lock file and temporary files. This is the case if a program
/// was killed before it wrote the manifest.
fn is_bare(folder: &Path) -> bool {
    let mut entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.all(|entry| {
        let name = entry.file_name();
        name == LOCK || name.to_str().is_some_and(atomic_file::is_temporary)
    })
}

fn not_ours(path: &Path) -> InputError {
    InputError::new("the file exists and was not written by this program, so it is not replaced")
        .at(path.display())
        .next("move it, or choose another folder")
}

/// Removes a file or a folder. In a folder, only the files listed in its manifest are removed; the folder itself is
/// removed if it is then empty.
fn remove(path: &Path) -> Result<(), Error> {
    let fail = || Error::file("remove", path);
    let is_folder = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(fail()(error)),
        Ok(there) => there.is_dir(),
    };
    if !is_folder {
        return atomic_file::remove(path).map_err(fail());
    }
    let held = lock(path, LOCK, Lock::Exclusive)?;
    let manifest = Manifest::read(path)?;
    for name in manifest.iter().flat_map(|manifest| &manifest.files) {
        remove(&path.join(name))?;
    }
    remove_temporary_files(path, Duration::ZERO);
    remove(&path.join(manifest::NAME))?;
    remove(&path.join(LOCK))?;
    drop(held);
    match fs::remove_dir(path) {
        Err(error) if error.kind() != io::ErrorKind::DirectoryNotEmpty => Err(fail()(error)),
        _ => Ok(()),
    }
}

/// Removes temporary files of killed programs if the files are at least `min_age` old. Files that cannot be removed,
/// such as files of other users, are kept.
pub fn remove_temporary_files(folder: &Path, min_age: Duration) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let written = entry.metadata().and_then(|there| there.modified());
        let age = written.ok().and_then(|time| time.elapsed().ok());
        let is_old = age.unwrap_or_default() >= min_age;
        if is_old && name.to_str().is_some_and(atomic_file::is_temporary) {
            let _ = atomic_file::remove_orphan(&entry.path(), LOCK);
        }
    }
}

/// Creates a folder unless it exists.
fn make(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| {
        let is_occupied = fs::symlink_metadata(folder).is_ok_and(|there| !there.is_dir());
        match error.kind() {
            // Another process has just removed the folder.
            io::ErrorKind::AlreadyExists if !is_occupied => Error::Busy(folder.to_owned()),
            _ => Error::file("make", folder)(error),
        }
    })
}

/// Acquires the shared lock of a folder. Several attempts are made because processes that prepare the folder briefly
/// hold the exclusive lock.
fn lock_shared(folder: &Path) -> Result<File, Error> {
    for _ in 0..25 {
        match lock(folder, LOCK, Lock::Shared) {
            Err(Error::Busy(_)) => thread::sleep(Duration::from_millis(20)),
            locked => return locked,
        }
    }
    lock(folder, LOCK, Lock::Shared)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Lock {
    Exclusive,
    Shared,
}

/// Locks a file in a folder. If another process removes the file after it is opened and before it is locked, the lock
/// would exclude no other process. In this case, the file is opened again.
fn lock(folder: &Path, name: &str, kind: Lock) -> Result<File, Error> {
    let path = folder.join(name);
    let fail = Error::file("lock", &path);
    if fs::symlink_metadata(&path).is_ok_and(|there| !there.is_file()) {
        return Err(fail(io::Error::other("it is not a regular file")));
    }
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    for _ in 0..25 {
        let file = match options.open(&path) {
            Ok(file) => file,
            // Another process has just removed the folder.
            Err(error) if error.kind() == io::ErrorKind::NotFound => break,
            Err(error) => return Err(fail(error)),
        };
        let locked = match kind {
            Lock::Exclusive => file.try_lock(),
            Lock::Shared => file.try_lock_shared(),
        };
        match locked {
            Err(TryLockError::WouldBlock) => break,
            Ok(()) if !is_at(&file, &path) => {}
            // Some file systems do not support locks.
            Ok(()) | Err(TryLockError::Error(_)) => return Ok(file),
        }
    }
    Err(Error::Busy(folder.to_owned()))
}

/// Returns whether `path` still names the open `file`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |found: io::Result<fs::Metadata>| found.ok().map(|own| (own.dev(), own.ino()));
    id(file.metadata()) == id(fs::symlink_metadata(path))
}

/// Returns `true`, because open files cannot be removed on other systems.
#[cfg(not(unix))]
fn is_at(_file: &File, _path: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests;
