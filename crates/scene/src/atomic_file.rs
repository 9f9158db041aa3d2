//! All operations that change result files: replacing a whole file, appending to a growing file, and removing a file. A
//! replacement is written under a temporary name and then renamed.

#[cfg(test)]
pub(crate) mod faults;

use std::cell::Cell;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use tempfile::{Builder, TempDir};

use crate::Error;

/// Prefix and suffix of temporary files and folders.
const TEMPORARY: (&str, &str) = (".myovib-", ".part");

/// Returns an error if a test simulates a disk failure at this operation.
#[cfg(not(test))]
fn allow() -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
use faults::allow;
#[cfg(test)]
pub(crate) use faults::has_stopped;

#[cfg(not(test))]
pub(crate) fn has_stopped() -> bool {
    false
}

thread_local! {
    static PASSING: Cell<bool> = const { Cell::new(false) };
}

/// Runs a computation whose files are needed only while this process is running. During the computation, this thread
/// does not wait for files to reach the disk.
pub fn passing<T>(compute: impl FnOnce() -> T) -> T {
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            PASSING.set(self.0);
        }
    }
    let _before = Before(PASSING.replace(true));
    compute()
}

/// Waits until a file is on the disk. Within [`passing`], returns without waiting.
pub(crate) fn sync(file: &File) -> io::Result<()> {
    allow()?;
    match PASSING.get() {
        true => Ok(()),
        false => file.sync_all(),
    }
}

/// Writes the content produced by `fill` to `path`. Readers see either the old file or the complete new file, never a
/// partial one. A symbolic link at `path` is replaced, not followed.
///
/// # Errors
/// Returns the errors of `fill` and of the file system. In case of an error, the old file (if any) is unchanged, and no
/// temporary file remains.
fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    // The temporary file is in the same folder because a rename across file systems is not atomic.
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1);
    if let Some(permissions) = permissions() {
        builder.permissions(permissions);
    }
    allow()?;
    let mut temporary = builder.tempfile_in(folder)?;
    // The file is locked while it is written. A temporary file without a lock is an orphan.
    let _ = temporary.as_file().try_lock();
    let written = fill_temporary(temporary.as_file_mut(), fill);
    temporary.disable_cleanup(has_stopped());
    written?;
    temporary.persist(path).map_err(|error| error.error)?;
    sync_folder(folder);
    Ok(())
}

/// Performs all steps that precede the rename.
fn fill_temporary(
    file: &mut File,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = BufWriter::new(Growing(file));
    fill(&mut file)?;
    let Growing(file) = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    sync(file)?;
    allow()
}

/// File to which data is written incrementally.
#[derive(Debug)]
pub(crate) struct Growing<F>(pub(crate) F);

impl<F: Write> Write for Growing<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        #[cfg(test)]
        faults::tear(&mut self.0, bytes)?;
        allow()?;
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Creates a file to which data is written incrementally. Fails if the file already exists.
pub(crate) fn create(path: &Path) -> io::Result<Growing<File>> {
    allow()?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true).open(path).map(Growing)
}

pub(crate) fn append(path: &Path) -> io::Result<Growing<File>> {
    OpenOptions::new().append(true).open(path).map(Growing)
}

pub(crate) fn remove(path: &Path) -> io::Result<()> {
    allow()?;
    fs::remove_file(path)
}

pub(crate) fn truncate(file: &File, bytes: u64) -> io::Result<()> {
    allow()?;
    file.set_len(bytes)
}

/// Creates a temporary folder in `parent`. The folder is removed when the returned value is dropped. If the process is
/// killed first, the next program that writes into `parent` removes the folder.
pub fn temporary_folder(parent: &Path) -> io::Result<TempDir> {
    let mut builder = Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1);
    builder.tempdir_in(parent)
}

pub(crate) fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1)
}

/// Removes a temporary file or folder unless a running program is using it. While a program uses a folder, it locks the
/// file `lock` in that folder.
pub(crate) fn remove_orphan(path: &Path, lock: &str) -> io::Result<()> {
    let there = fs::symlink_metadata(path)?;
    if there.is_file() {
        return match File::open(path)?.try_lock() {
            Ok(()) => remove(path),
            Err(_) => Ok(()),
        };
    }
    let is_in_use = || File::open(path.join(lock)).is_ok_and(|file| file.try_lock().is_err());
    match there.is_dir() && !is_in_use() {
        true => {
            allow()?;
            fs::remove_dir_all(path)
        }
        false => Ok(()),
    }
}

/// Writes `contents` to `path` atomically. If writing fails, the old file is unchanged.
///
/// # Errors
/// Returns the error of the file system together with the path.
pub fn save(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Error> {
    write(path, |file| file.write_all(contents.as_ref())).map_err(Error::file("write", path))
}

/// Returns the permissions of a new file before the user's umask is applied.
#[cfg(unix)]
fn permissions() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(0o666))
}

#[cfg(not(unix))]
fn permissions() -> Option<Permissions> {
    None
}

/// Syncs the folder so that the rename survives a power failure, if the operating system supports this.
fn sync_folder(folder: &Path) {
    // An error is ignored because some operating systems cannot sync folders. The file exists in any case.
    let _ = File::open(folder).and_then(|folder| sync(&folder));
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;
    use std::fs;

    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect()
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        write(&path, |file| file.write_all(b"old")).unwrap();
        let failed = write(&path, |file| {
            file.write_all(b"half of the n")?;
            Err(io::Error::other("out of luck"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "out of luck");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["run.json"]);
    }

    #[test]
    fn atomic_files_retry_after_transient_errors() {
        passing(|| {
            passing(|| assert!(PASSING.get()));
            assert!(PASSING.get());
            std::thread::spawn(|| assert!(!PASSING.get())).join().unwrap();
        });
        assert!(!PASSING.get());
        std::panic::catch_unwind(|| passing(|| panic!("on the way"))).unwrap_err();
        assert!(!PASSING.get());
    }

    #[test]
    fn a_file_appears_only_when_complete() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        write(&path, |file| {
            file.write_all(b"new")?;
            assert!(!path.exists());
            Ok(())
        })
        .unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(folder.path()), ["run.json"]);
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/run.json");
        assert_eq!(write(&path, |_| Ok(())).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    /// Regression: a symbolic link at the output path was followed.
    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (mine, link) = (folder.path().join("mine"), folder.path().join("run.json"));
        fs::write(&mine, "precious").unwrap();
        std::os::unix::fs::symlink(&mine, &link).unwrap();
        write(&link, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&mine).unwrap(), "precious");
        assert_eq!(fs::read_to_string(&link).unwrap(), "new");
    }
}
