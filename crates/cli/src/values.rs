//! Parsers of option values.

use std::io::ErrorKind;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use myovib_model::IntegratorKind;

use crate::output::not_replaceable;

/// Parses the path of an output file. A path that cannot be written is rejected here, before a long computation starts.
pub fn output_file(path: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(path);
    if path.is_empty() {
        return Err("the file name is empty".to_owned());
    }
    if let Some(reason) = not_replaceable(&file) {
        return Err(reason);
    }
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    match folder {
        Some(folder) if !folder.is_dir() => {
            let folder = folder.display();
            Err(format!("the folder `{folder}` does not exist: mkdir -p {folder}"))
        }
        folder => {
            let folder = folder.unwrap_or(Path::new("."));
            match tempfile::tempfile_in(folder) {
                // A full disk is not an error here, because there may be space when the file is written.
                Err(error)
                    if ![ErrorKind::StorageFull, ErrorKind::QuotaExceeded]
                        .contains(&error.kind()) =>
                {
                    Err(format!("cannot write to `{}`: {error}", folder.display()))
                }
                _ => Ok(file),
            }
        }
    }
}

/// Parses the path of a result folder, which need not exist yet.
pub fn output_folder(path: &str) -> Result<PathBuf, String> {
    let folder = PathBuf::from(path);
    if path.is_empty() {
        return Err("the folder name is empty; `.` is the current folder".to_owned());
    }
    match folder.ancestors().find(|ancestor| ancestor.exists()) {
        Some(there) if !there.is_dir() => Err(format!("`{}` is not a folder", there.display())),
        _ => Ok(folder),
    }
}

/// Parses a memory size in bytes.
pub fn memory(text: &str) -> Result<usize, String> {
    let units = [("GiB", 30), ("MiB", 20), ("G", 30), ("M", 20)];
    let size = units.iter().find_map(|(unit, power)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * f64::from(1u32 << power))
    });
    match size {
        Some(bytes) if bytes >= 1.0 && bytes < usize::MAX as f64 => Ok(bytes as usize),
        _ => Err("not a size such as 8GiB or 500MiB".to_owned()),
    }
}

pub fn threads(text: &str) -> Result<NonZeroUsize, String> {
    up_to::<1024>(text)
}

/// Parses a count from 1 to `MAX`.
pub fn up_to<const MAX: usize>(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.parse().ok().filter(|n: &NonZeroUsize| n.get() <= MAX);
    number.ok_or_else(|| format!("not a whole number from 1 to {MAX}"))
}

pub fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value: &f64| value.is_finite());
    number.ok_or_else(|| "not a finite number".to_owned())
}

/// Parses a finite positive number.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && f64::is_finite(value) => Ok(value),
        _ => Err("not a finite number above 0".to_owned()),
    }
}

/// Parses `KEY=FROM..TO` with two different finite numbers.
pub fn key_and_range(text: &str) -> Result<(String, [f64; 2]), String> {
    let wrong = || "expected KEY=FROM..TO, such as traction[0].y.frequency=5..15".to_owned();
    let (key, range) = text.split_once('=').ok_or_else(wrong)?;
    let (from, to) = range.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    let (from, to) = (number(from)?, number(to)?);
    match from.is_finite() && to.is_finite() && from != to {
        true => Ok((key.trim().to_owned(), [from, to])),
        false => Err("FROM and TO must be different finite numbers".to_owned()),
    }
}

pub fn relative_tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("not a number above 0 and below 1".to_owned()),
    }
}

pub fn integrator(name: &str) -> Result<IntegratorKind, String> {
    by_name(&IntegratorKind::ALL, IntegratorKind::name, name)
        .map_err(|names| format!("unknown integrator `{name}`: must be one of {names}"))
}

/// Returns the entry of `all` with this name.
pub fn by_name<T: Copy>(
    all: &[T],
    name_of: fn(T) -> &'static str,
    name: &str,
) -> Result<T, String> {
    let named = all.iter().copied().find(|one| name_of(*one) == name);
    named.ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|one| name_of(*one)).collect();
        names.join(", ")
    })
}

#[cfg(test)]
mod tests {
    use super::{key_and_range, memory, output_folder, threads};

    #[test]
    fn ranges_of_keys_have_two_different_numbers() {
        let found = key_and_range("traction[0].y.frequency = 5..1.5e1");
        let key = "traction[0].y.frequency".to_owned();
        assert_eq!(found, Ok((key, [5.0, 15.0])));
        for wrong in ["a", "a=5", "a=5..", "a=5..5", "a=5..inf", "a=NaN..5"] {
            assert!(key_and_range(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_folder_has_a_name() {
        assert!(output_folder("").is_err());
        assert!(output_folder("out").is_ok());
    }

    #[test]
    fn sizes_of_memory_have_a_unit() {
        assert_eq!(memory("2GiB"), Ok(2 << 30));
        assert_eq!(memory("1.5 G"), Ok(3 << 29));
        assert_eq!(memory("500M"), Ok(500 << 20));
        for wrong in ["0", "-1", "1025", "1e12", "99999999999999999999", ""] {
            assert!(threads(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "8", "GiB", "-1GiB", "NaNM", "infG", "0M", "1e30G", "2kB"] {
            assert!(memory(wrong).is_err(), "{wrong}");
        }
    }
}
