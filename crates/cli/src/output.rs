//! Printing, and writing of single files that options name.
//!
//! No function panics: if standard output or standard error is closed, the computation continues.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use myovib_report::{plot, table2};
use myovib_scene::{Error, InputError, atomic_file, plain, result_folder};

/// Prints results to standard output. A closed pipe, as in `myovib … | head`, is not an error.
///
/// # Errors
/// Returns [`Error::File`] if standard output cannot be written, for example on a full disk.
pub fn print(text: impl AsRef<[u8]>) -> Result<(), Error> {
    let mut stdout = io::stdout();
    let written = stdout.write_all(text.as_ref());
    match written.and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::file("write", Path::new("standard output"))(error))
        }
        _ => Ok(()),
    }
}

/// Prints text to standard error unchanged. Write errors are ignored.
pub fn print_error(text: &str) {
    let mut stderr = io::stderr();
    let _ = stderr.write_all(text.as_bytes());
    let _ = stderr.flush();
}

/// Prints a line to standard error, without control characters.
pub fn line(text: &str) {
    print_error(&format!("{}\n", plain(text)));
}

/// Prints a note to standard error.
pub fn note(text: &str) {
    line(&format!("note: {text}"));
}

/// Prints a warning to standard error.
pub fn warn(text: &str) {
    line(&format!("warning: {text}"));
}

/// Writes a file that an option names, atomically.
pub fn save(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Error> {
    if let Some(reason) = not_replaceable(path) {
        return Err(InputError::new(reason).at(path.display()).into());
    }
    atomic_file::save(path, contents)
}

/// First lines of the job scripts that this program writes. The program recognizes its own scripts by these lines.
pub const JOB_SCRIPT: &str = "#!/bin/bash\n# Made by myovib sweep.\n";

/// Returns the reason why a file must not be replaced, or `None` if it may be replaced.
pub fn not_replaceable(path: &Path) -> Option<String> {
    let there = match std::fs::symlink_metadata(path) {
        Ok(there) => there,
        Err(error) if error.kind() == io::ErrorKind::InvalidFilename => {
            return Some("the name is too long".to_owned());
        }
        Err(_) => return None,
    };
    if there.is_dir() {
        return Some("it is a folder".to_owned());
    }
    // Links, pipes and devices are not replaced.
    if !there.is_file() {
        return Some("it is not a regular file".to_owned());
    }
    if let Some(command) = result_folder::command_of(path) {
        return Some(format!("`myovib {command}` wrote it as a result of this folder"));
    }
    let reason = "the file exists and was not written by this program, so it is not replaced";
    (!is_ours(path)).then(|| reason.to_owned())
}

/// Returns whether this program wrote the file, which is determined from its first bytes.
fn is_ours(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(4096).read_to_end(&mut start));
    let text = String::from_utf8_lossy(&start);
    let starts = ["{\n  \"schema\": \"myovib/", JOB_SCRIPT, &table2::csv(&[])];
    read.is_ok()
        && (starts.iter().any(|own| text.starts_with(own))
            || plot::is_own_svg(&text)
            || plot::movie::is_own_gif(&start))
}

#[cfg(test)]
mod tests {
    use myovib_report::plot::{Figure, LinePlot, movie};

    use super::*;

    #[test]
    fn own_files_are_replaced_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let figure = || Figure::of("title", LinePlot::default());
        let mut film = Vec::new();
        movie::write(&mut film, [Ok(figure())], 64, 4).unwrap();
        let own = [
            myovib_scene::json::document("doctor", &()).unwrap_or_default().into_bytes(),
            figure().render().into_bytes(),
            table2::csv(&[]).into_bytes(),
            JOB_SCRIPT.as_bytes().to_vec(),
            film,
        ];
        let path = folder.path().join("file");
        for bytes in own.iter().filter(|bytes| !bytes.is_empty()) {
            std::fs::write(&path, bytes).unwrap();
            save(&path, "replaced").unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), "replaced");
        }
        let foreign = ["", "{}", "t,u_x\n", "#!/bin/bash\n", "<svg></svg>", "GIF89a"];
        for text in foreign {
            std::fs::write(&path, text).unwrap();
            assert!(save(&path, "replaced").is_err(), "{text}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }
}
