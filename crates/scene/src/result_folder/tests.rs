use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

use serde_json::json;

use super::*;
use crate::atomic_file::faults::with_disk_that_stops_after;

fn request<'a>(path: &'a Path, existing: Existing, files: &[&str]) -> FolderRequest<'a> {
    FolderRequest {
        path,
        command: "run",
        existing,
        can_resume: true,
        files: files.iter().map(|&name| name.to_owned()).collect(),
        origin: json!({ "scene": 1 }),
        reads: &[],
    }
}

/// Returns a folder with a file `old` that the program created and a file `mine` that it did not create.
fn used() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let open = request(folder.path(), Existing::Refuse, &["old"]).open();
    open.unwrap().write("old", "1").unwrap();
    fs::write(folder.path().join("mine"), "precious").unwrap();
    folder
}

/// Returns the names and contents of all files except the lock and the manifest.
fn contents(folder: &Path) -> BTreeSet<(String, String)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| entry.file_name().into_string().unwrap())
        .filter(|name| ![LOCK, manifest::NAME].contains(&name.as_str()))
        .map(|name| (name.clone(), fs::read_to_string(folder.join(name)).unwrap()))
        .collect()
}

fn set(pairs: &[(&str, &str)]) -> BTreeSet<(String, String)> {
    let pairs = pairs.iter();
    pairs.map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
}

#[test]
fn results_are_refused_overwritten_or_continued() {
    let folder = used();
    let both = set(&[("old", "1"), ("mine", "precious")]);
    assert!(request(folder.path(), Existing::Refuse, &["new"]).open().is_err());
    assert_eq!(contents(folder.path()), both);
    let resumed = request(folder.path(), Existing::Resume, &["old"]).open();
    assert_eq!(contents(folder.path()), both);
    resumed.unwrap().write("old", "2").unwrap();
    let new = request(folder.path(), Existing::Overwrite, &["new"]).open().unwrap();
    assert_eq!(contents(folder.path()), set(&[("mine", "precious")]));
    drop(new);
    let empty = tempfile::tempdir().unwrap();
    assert!(request(empty.path(), Existing::Resume, &["old"]).open().is_err());
    assert_eq!(fs::read_dir(empty.path()).unwrap().count(), 0);
}

/// Regression: `--overwrite` replaced files that no run had created.
#[test]
fn a_file_that_the_program_did_not_make_is_neither_replaced_nor_removed() {
    for existing in [Existing::Refuse, Existing::Overwrite, Existing::Resume, Existing::Add] {
        let folder = used();
        let refused = request(folder.path(), existing, &["mine"]);
        assert!(refused.check().is_err() && refused.open().is_err(), "{existing:?}");
        assert_eq!(contents(folder.path()), set(&[("old", "1"), ("mine", "precious")]));
    }
    let folder = used();
    let open = request(folder.path(), Existing::Overwrite, &[]).open().unwrap();
    assert!(open.write("mine", "").is_err() && open.create("mine").is_err());
    assert!(open.remove("mine").is_err());
    assert_eq!(contents(folder.path()), set(&[("mine", "precious")]));
}

/// Regression: a run was allowed in the folder of a fit.
#[test]
fn a_folder_holds_results_of_one_command() {
    for existing in [Existing::Refuse, Existing::Overwrite, Existing::Resume, Existing::Add] {
        let folder = used();
        let other = FolderRequest { command: "fit", ..request(folder.path(), existing, &[]) };
        assert!(other.check().is_err() && other.open().is_err(), "{existing:?}");
        assert_eq!(contents(folder.path()), set(&[("old", "1"), ("mine", "precious")]));
    }
}

/// Regression: two runs could write into the same folder at the same time.
#[test]
fn a_folder_takes_one_process_at_a_time() {
    let folder = used();
    let first = request(folder.path(), Existing::Resume, &[]).open().unwrap();
    for existing in [Existing::Overwrite, Existing::Resume, Existing::Add] {
        let second = || request(folder.path(), existing, &[]);
        assert!(second().open().is_err() && second().open_shared().is_err());
    }
    drop(first);
    let shared = [(); 2].map(|()| request(folder.path(), Existing::Add, &[]).open_shared());
    assert!(shared.iter().all(Result::is_ok));
    assert!(request(folder.path(), Existing::Resume, &[]).open().is_err());
}

/// Regression: a folder that another process removed at the same time was reported as already existing.
#[test]
fn a_folder_that_another_process_removes_is_busy() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("out");
    let is_done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !is_done.load(SeqCst) {
                let _ = fs::create_dir(&path).and_then(|()| fs::remove_dir(&path));
            }
        });
        for _ in 0..20_000 {
            let made = make(&path);
            assert!(matches!(made, Ok(()) | Err(Error::Busy(_))), "{made:?}");
        }
        is_done.store(true, SeqCst);
    });
    fs::write(&path, "mine").unwrap_or_else(|_| fs::remove_dir(&path).unwrap());
    fs::write(&path, "mine").unwrap();
    assert!(matches!(make(&path), Err(Error::File { .. })));
}

/// Checks that a killed program leaves no unlisted file, and that its temporary files are removed.
#[test]
fn a_killed_program_leaves_nothing_behind_and_nothing_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let open = |existing| request(folder.path(), existing, &[]).open().unwrap();
    let names = || {
        let entries = fs::read_dir(folder.path()).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap())
    };
    let last = 6; // append to the manifest, create, write, sync, rename, sync the folder
    let whole = || open(Existing::Add).write("whole", "1").unwrap();
    drop(open(Existing::Refuse));
    let (_, before) = with_disk_that_stops_after(u64::MAX, false, || drop(open(Existing::Add)));
    let (_, changes) = with_disk_that_stops_after(u64::MAX, false, whole);
    assert_eq!(changes - before, last);
    let mut temporary = 0;
    for stop in 0..last {
        for torn in [false, true] {
            let name = format!("file-{stop}-{torn}");
            let open = open(Existing::Add);
            let write = || open.write(&name, "two");
            let (written, _) = with_disk_that_stops_after(stop, torn, write);
            assert_eq!(written.is_err(), stop < last - 1, "{stop}");
            temporary += names().filter(|name| atomic_file::is_temporary(name)).count();
        }
    }
    // The write, the sync or the rename failed, with or without a partial write.
    assert_eq!(temporary, 6);
    drop(open(Existing::Overwrite));
    let left: BTreeSet<String> = names().collect();
    assert_eq!(left, [LOCK, manifest::NAME].map(str::to_owned).into());
}

/// Checks that a malicious or damaged manifest cannot affect files outside the folder.
#[test]
fn a_manifest_that_names_files_elsewhere_is_refused() {
    let folder = used();
    let path = folder.path().join(manifest::NAME);
    let good = fs::read_to_string(&path).unwrap();
    for line in ["\"../mine\"", "\"/etc/passwd\"", "\"..\"", "\"\"", "no JSON", "1"] {
        fs::write(&path, format!("{good}{line}\n")).unwrap();
        assert!(request(folder.path(), Existing::Overwrite, &[]).check().is_err(), "{line}");
    }
    fs::write(&path, format!("{good}\"torn")).unwrap();
    assert!(request(folder.path(), Existing::Overwrite, &[]).check().is_ok());
    for text in ["", "{}\n", "{\"schema\":\"myovib/manifest/9\"}\n"] {
        fs::write(&path, text).unwrap();
        assert!(request(folder.path(), Existing::Overwrite, &[]).check().is_err(), "{text}");
    }
}

/// Checks that overwriting a sweep removes the folders of its cases, except for files that the sweep did not create.
#[test]
fn folders_of_cases_are_removed_with_their_own_files() {
    let folder = tempfile::tempdir().unwrap();
    drop(request(folder.path(), Existing::Refuse, &["case", "other"]).open().unwrap());
    for name in ["case", "other"] {
        let path = folder.path().join(name);
        let open = request(&path, Existing::Refuse, &["run.json"]).open();
        open.unwrap().write("run.json", "{}").unwrap();
    }
    fs::write(folder.path().join("other/mine"), "precious").unwrap();
    drop(request(folder.path(), Existing::Overwrite, &[]).open().unwrap());
    assert!(!folder.path().join("case").exists());
    let left = fs::read_dir(folder.path().join("other")).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["mine"]);
    // A folder that has the name of a listed file remains.
    let folder = used();
    fs::remove_file(folder.path().join("old")).unwrap();
    fs::create_dir(folder.path().join("old")).unwrap();
    fs::write(folder.path().join("old/mine"), "precious").unwrap();
    assert!(request(folder.path(), Existing::Overwrite, &[]).check().is_err());
}

/// Regression: a run that starts from another run was allowed to overwrite that run.
#[test]
fn a_file_that_the_command_reads_is_not_overwritten() {
    let folder = used();
    let reads = [folder.path().join("../").join(folder.path().file_name().unwrap()).join("old")];
    let wanted =
        FolderRequest { reads: &reads, ..request(folder.path(), Existing::Overwrite, &[]) };
    assert!(wanted.check().is_err());
    assert!(FolderRequest { reads: &[], ..wanted }.check().is_ok());
}

/// Checks that a link in place of a listed file is removed and not followed.
#[cfg(unix)]
#[test]
fn links_are_not_followed() {
    let folder = used();
    let [old, mine] = ["old", "mine"].map(|name| folder.path().join(name));
    fs::remove_file(&old).unwrap();
    std::os::unix::fs::symlink(&mine, &old).unwrap();
    drop(request(folder.path(), Existing::Overwrite, &["old"]).open().unwrap());
    assert_eq!(contents(folder.path()), set(&[("mine", "precious")]));
    std::os::unix::fs::symlink("nowhere", &old).unwrap();
    let open = request(folder.path(), Existing::Overwrite, &["old"]).open().unwrap();
    open.write("old", "2").unwrap();
    assert!(!folder.path().join("nowhere").exists());
}

/// Regression: another process could replace a sweep between the exclusive and the shared lock of its folder.
#[test]
fn a_shared_folder_contains_the_results_that_its_processes_expect() {
    let folder = tempfile::tempdir().unwrap();
    let of = |scene, existing| FolderRequest {
        origin: json!({ "scene": scene }),
        ..request(folder.path(), existing, &["table"])
    };
    let (of, opened) = (&of, &AtomicUsize::new(0));
    thread::scope(|scope| {
        for scene in [1, 2] {
            scope.spawn(move || {
                for _ in 0..100 {
                    if let Ok(open) = of(scene, Existing::Overwrite).open_shared() {
                        let found = of(scene, Existing::Add).earlier_origin().unwrap();
                        assert_eq!(found, Some(json!({ "scene": scene })));
                        opened.fetch_add(1, SeqCst);
                        drop(open);
                    }
                }
            });
        }
    });
    assert!(opened.load(SeqCst) > 0);
}

/// Regression: if another process removed a file between opening and locking, the lock excluded no other process.
#[test]
fn a_lock_file_that_is_removed_admits_one_process_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(LOCK);
    let (is_held, opened) = (AtomicBool::new(false), AtomicUsize::new(0));
    let open_and_remove = || {
        for _ in 0..2000 {
            if let Ok(held) = lock(folder.path(), LOCK, Lock::Exclusive) {
                assert!(!is_held.swap(true, SeqCst));
                opened.fetch_add(1, SeqCst);
                thread::yield_now();
                is_held.store(false, SeqCst);
                fs::remove_file(&path).unwrap();
                drop(held);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(open_and_remove);
        }
    });
    assert!(opened.load(SeqCst) > 0);
}

/// Regression: clean-up stopped at a temporary file that could not be removed.
#[test]
fn temporary_files_that_cannot_be_removed_do_not_protect_others() {
    let folder = tempfile::tempdir().unwrap();
    let names = [".myovib-a.part", ".myovib-b.part", ".myovib-c.part"];
    for name in names {
        fs::write(folder.path().join(name), "").unwrap();
    }
    let remove = || remove_temporary_files(folder.path(), Duration::ZERO);
    let (_, changes) = with_disk_that_stops_after(0, false, remove);
    assert_eq!(changes, 3);
    remove();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
