//! Tables of comma-separated values. A table is read as a whole, and written line by line during a computation.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::Error;

/// Amount of data that has been written to a table. It is stored in checkpoints.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Number of rows, excluding the header.
    pub rows: u64,
    /// Number of bytes, including the header.
    pub bytes: u64,
    /// Last line, including its line break.
    pub last: String,
}

/// Writer for a header with column names, followed by rows of numbers. Each number has 17 significant digits, so that
/// reading it restores the same `f64`.
///
/// Each line is passed to the sink in a single call and then flushed, so that a killed run leaves only complete lines.
#[derive(Debug)]
pub struct CsvWriter<W: Write> {
    sink: W,
    n_columns: usize,
    written: Written,
}

impl<W: Write> CsvWriter<W> {
    /// Creates a writer and writes the header.
    pub fn new(sink: W, names: &[impl AsRef<[u8]>]) -> io::Result<Self> {
        let mut csv = Self::continued(sink, names.len(), Written::default());
        csv.line(line(names))?;
        Ok(csv)
    }

    /// Creates a writer that continues an existing table. The `sink` already contains the `written` part, whose header
    /// has `n_columns` names.
    pub fn continued(sink: W, n_columns: usize, written: Written) -> Self {
        Self { sink, n_columns, written }
    }

    /// # Panics
    /// Panics if the number of values differs from the number of names.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        assert_eq!(values.len(), self.n_columns, "as many values as names");
        let words: Vec<String> = values.iter().map(|value| format!("{value:.16e}")).collect();
        self.line(words.join(",") + "\n")?;
        self.written.rows += 1;
        Ok(())
    }

    pub fn written(&self) -> &Written {
        &self.written
    }

    pub fn sink(&self) -> &W {
        &self.sink
    }

    fn line(&mut self, line: String) -> io::Result<()> {
        self.sink.write_all(line.as_bytes())?;
        self.sink.flush()?;
        self.written.bytes += line.len() as u64;
        self.written.last = line;
        Ok(())
    }
}

/// Formats one line of a table. Fields with commas, quotes or line breaks are quoted.
pub fn line(fields: &[impl AsRef<[u8]>]) -> String {
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    writer.write_record(fields).expect("writing to memory does not fail");
    let bytes = writer.into_inner().expect("writing to memory does not fail");
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Formats a table as a string.
///
/// # Panics
/// Panics if the number of values in a row differs from the number of names.
pub fn table(
    names: &[impl AsRef<[u8]>],
    rows: impl IntoIterator<Item = impl AsRef<[f64]>>,
) -> String {
    let in_memory = "writing to memory does not fail";
    let mut csv = CsvWriter::new(Vec::new(), names).expect(in_memory);
    for row in rows {
        csv.row(row.as_ref()).expect(in_memory);
    }
    String::from_utf8_lossy(csv.sink()).into_owned()
}

/// Table read from text: column names and rows of fields.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    pub names: Vec<String>,
    /// Rows, excluding blank lines. A row may have any number of fields.
    pub rows: Vec<Vec<String>>,
    /// One-based line number at which each row starts.
    pub lines: Vec<u64>,
}

impl Table {
    /// Parses a table with a header. Spaces around fields are ignored.
    ///
    /// # Errors
    /// Returns the errors of the CSV reader, which contain the line number.
    pub fn parse(text: &str) -> Result<Self, ::csv::Error> {
        let header = text.lines().next().unwrap_or_default();
        let records = ::csv::ReaderBuilder::new()
            .delimiter(if header.contains('\t') { b'\t' } else { b',' })
            .has_headers(false)
            .flexible(true)
            .trim(::csv::Trim::All)
            .from_reader(text.as_bytes())
            .into_records();
        let mut table = Self::default();
        let (mut line, mut counted) = (1, 0);
        for record in records {
            let record = record?;
            let words: Vec<String> = record.iter().map(str::to_owned).collect();
            if words.concat().is_empty() {
                continue;
            }
            if table.names.is_empty() {
                table.names = words;
                continue;
            }
            // The reported position precedes any blank lines that the reader skips before the record.
            let start = record.position().map_or(0, |position| position.byte()) as usize;
            let blank = text[start..].bytes().take_while(|byte| b"\r\n".contains(byte));
            let start = start + blank.count();
            line += text[counted..start].matches('\n').count() as u64;
            counted = start;
            table.rows.push(words);
            table.lines.push(line);
        }
        Ok(table)
    }

    /// Returns the numbers of a row, or `None` if the row does not consist of exactly one number per column.
    pub fn numbers(&self, row: &[String]) -> Option<Vec<f64>> {
        let numbers = row.iter().map(|word| word.parse().ok());
        let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
        (numbers.len() == self.names.len()).then_some(numbers)
    }
}

/// Reads the column names and rows of a numeric table from a file.
///
/// # Errors
/// Returns [`Error::File`] if the file cannot be read or a row does not consist of one number per column. In the latter
/// case, the error contains the line number.
pub fn read_numbers(path: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), Error> {
    let text = fs::read_to_string(path).map_err(Error::file("read", path))?;
    let table =
        Table::parse(&text).map_err(|error| Error::file("read", path)(io::Error::other(error)))?;
    let rows = table.rows.iter().zip(&table.lines).map(|(row, line)| {
        table.numbers(row).ok_or_else(|| {
            let expected = format!("line {line}: expected {} numbers", table.names.len());
            Error::file("read", path)(io::Error::other(expected))
        })
    });
    let rows = rows.collect::<Result<_, Error>>()?;
    Ok((table.names, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sink that records each write separately.
    #[derive(Default)]
    struct Writes(Vec<Vec<u8>>);

    impl Write for Writes {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.push(bytes.to_vec());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn numbers_come_back_to_the_last_bit() {
        let values = [0.1, -1.0 / 3.0, 5e-324, 1.797_693_134_862_315_7e308, 0.0];
        let mut bytes = Vec::new();
        let mut csv = CsvWriter::new(&mut bytes, &["a", "b", "c", "d", "e"]).unwrap();
        csv.row(&values).unwrap();
        let written = csv.written().clone();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.starts_with("a,b,c,d,e\n"));
        let table = Table::parse(&text).unwrap();
        assert_eq!(table.numbers(&table.rows[0]).unwrap(), values);
        assert_eq!((written.rows, written.bytes), (1, text.len() as u64));
        assert!(text.ends_with(&written.last));
    }

    #[test]
    fn every_write_is_a_whole_line() {
        let mut writes = Writes::default();
        let mut csv = CsvWriter::new(&mut writes, &["t", "u_y"]).unwrap();
        csv.row(&[0.0, 1.0]).unwrap();
        csv.row(&[0.5, 2.0]).unwrap();
        assert_eq!(writes.0.len(), 3);
        assert!(
            writes.0.iter().all(|bytes| bytes.iter().filter(|&&b| b == b'\n').count() == 1
                && bytes.ends_with(b"\n"))
        );
    }

    /// Regression: commas and line breaks in names corrupted headers, and quoted headers were
    /// rejected.
    #[test]
    fn names_may_hold_anything_and_come_back() {
        let names = ["t", "a,b", "c \"d\"", "e\nf"];
        let mut bytes = Vec::new();
        CsvWriter::new(&mut bytes, &names).unwrap().row(&[0.0; 4]).unwrap();
        let table = Table::parse(&String::from_utf8(bytes).unwrap()).unwrap();
        assert_eq!(table.names, names);
        assert_eq!(table.rows.len(), 1);
        let spaced = Table::parse("\"time\",\"force\"\n 0 , 1\n\n  \n2,3\n").unwrap();
        assert_eq!(spaced.names, ["time", "force"]);
        assert_eq!(spaced.rows, [["0", "1"], ["2", "3"]]);
        assert_eq!(spaced.lines, [2, 5]);
        let quoted = Table::parse("a,\"b\nc\"\r\n\r\n1,2\r\n\"x\ny\",2\r\n3,4\r\n").unwrap();
        assert_eq!(quoted.lines, [4, 5, 7]);
    }

    /// Regression: rows that could not be read were dropped.
    #[test]
    fn a_damaged_row_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tip.csv");
        for (damaged, is_read) in [("1,2", true), ("1,nan", true), ("1,x", false), ("1", false)] {
            fs::write(&path, format!("t,u_x\n0,1\n{damaged}\n2,3\n")).unwrap();
            let found = read_numbers(&path).map(|(_, rows)| rows.len());
            match found {
                Ok(rows) => assert!(is_read && rows == 3, "{damaged}"),
                Err(error) => {
                    assert!(!is_read && format!("{error:?}").contains("line 3"), "{error:?}")
                }
            }
        }
    }
}
