//! Truncation of a table to the rows that a checkpoint counts.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::atomic_file::truncate;
use crate::csv::Written;
use crate::{Error, InputError};

/// Truncates a table after the rows that a checkpoint counts. These rows must be unchanged. Also returns a note if the
/// removed part ends with an incomplete row.
pub(super) fn cut(path: &Path, written: &Written) -> Result<(File, Option<String>), Error> {
    let missing = |found: String| {
        InputError::new("the table was changed after the checkpoint: rows would be missing")
            .at(path.display())
            .found(found)
            .allowed(format!("at least {} rows, {} bytes", written.rows, written.bytes))
            .next("--overwrite computes the run from the start")
    };
    match fs::symlink_metadata(path) {
        Err(error) => return Err(missing(error.to_string()).into()),
        Ok(there) if !there.is_file() => {
            return Err(missing("it is not a regular file".to_owned()).into());
        }
        Ok(there) if there.len() < written.bytes => {
            return Err(missing(format!("{} bytes", there.len())).into());
        }
        Ok(_) => {}
    }
    let fail = |error| Error::file("continue", path)(error);
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(fail)?;
    let n_last = written.last.len();
    let last_starts = written.bytes.saturating_sub(n_last as u64);
    file.seek(SeekFrom::Start(last_starts)).map_err(fail)?;
    let mut rest = Vec::new();
    file.read_to_end(&mut rest).map_err(fail)?;
    let (last, beyond) = rest.split_at(n_last.min(rest.len()));
    if last != written.last.as_bytes() {
        return Err(missing(format!("another row {}", written.rows)).into());
    }
    let torn = beyond.contains(&0) || beyond.last().is_some_and(|&byte| byte != b'\n');
    let note = torn.then(|| {
        let n = beyond.len();
        format!(
            "{}: the table ends with an incomplete row of {n} bytes, which is removed and computed again",
            path.display()
        )
    });
    truncate(&file, written.bytes).map_err(fail)?;
    file.seek(SeekFrom::End(0)).map_err(fail)?;
    Ok((file, note))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "t,u\n0.0,1\n1.0,2\n";

    fn written() -> Written {
        Written { rows: 2, bytes: HEAD.len() as u64, last: "1.0,2\n".to_owned() }
    }

    #[test]
    fn rows_after_the_checkpoint_and_torn_ends_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("origin.csv");
        for (beyond, torn) in
            [("", false), ("2.0,3\n", false), ("2.0,3\n2.5,", true), ("\0\0\n", true)]
        {
            fs::write(&path, format!("{HEAD}{beyond}")).unwrap();
            let (_, note) = cut(&path, &written()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), HEAD);
            assert_eq!(note.is_some(), torn, "{beyond:?}");
        }
    }

    /// Regression: rows that the checkpoint counted but that were missing from the table were replaced by zero bytes.
    #[test]
    fn a_table_shorter_than_its_checkpoint_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("origin.csv");
        let nul = HEAD.replace("1.0,2", "\0\0\0\0\0");
        for text in ["t,u\n0.0,1\n", "", nul.as_str(), "t,u\n0.0,1\n1.5,2\n"] {
            fs::write(&path, text).unwrap();
            let message = cut(&path, &written()).unwrap_err().to_string();
            assert!(message.contains("origin.csv"), "{message}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text, "it is left as it is");
        }
    }
}
