//! Tables of numbers as comma-separated values, line by line while they are computed.

use std::io::{self, Write};

/// Writes a header with the names, then rows of numbers with 17 significant digits, which is
/// enough to read back the same `f64`.
///
/// Each line is handed to the sink whole and flushed: a killed run leaves only whole lines.
#[derive(Debug)]
pub struct CsvWriter<W: Write> {
    sink: W,
    n_columns: usize,
    line: String,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(mut sink: W, names: &[&str]) -> io::Result<Self> {
        write_line(&mut sink, &format!("{}\n", names.join(",")))?;
        Ok(Self {
            sink,
            n_columns: names.len(),
            line: String::new(),
        })
    }

    /// Goes on with a sink that has its header of `n_columns` names.
    pub fn continued(sink: W, n_columns: usize) -> Self {
        Self {
            sink,
            n_columns,
            line: String::new(),
        }
    }

    /// Writes one row.
    ///
    /// # Errors
    /// Those of the sink.
    ///
    /// # Panics
    /// When the number of values is not that of the names.
    pub fn row(&mut self, values: &[f64]) -> io::Result<()> {
        assert_eq!(values.len(), self.n_columns, "as many values as names");
        self.line.clear();
        for (i, value) in values.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            self.line.push_str(&format!("{comma}{value:.16e}"));
        }
        self.line.push('\n');
        write_line(&mut self.sink, &self.line)
    }
}

fn write_line(sink: &mut impl Write, line: &str) -> io::Result<()> {
    sink.write_all(line.as_bytes())?;
    sink.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Remembers each write by itself.
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
        let text = String::from_utf8(bytes).unwrap();
        let (header, row) = text.split_once('\n').unwrap();
        assert_eq!(header, "a,b,c,d,e");
        let read: Vec<f64> = row
            .trim()
            .split(',')
            .map(|word| word.parse().unwrap())
            .collect();
        assert_eq!(read, values);
    }

    #[test]
    fn every_write_is_a_whole_line() {
        let mut writes = Writes::default();
        let mut csv = CsvWriter::new(&mut writes, &["t", "u_y"]).unwrap();
        csv.row(&[0.0, 1.0]).unwrap();
        csv.row(&[0.5, 2.0]).unwrap();
        assert_eq!(writes.0.len(), 3);
        assert!(
            writes
                .0
                .iter()
                .all(|bytes| bytes.iter().filter(|&&b| b == b'\n').count() == 1
                    && bytes.ends_with(b"\n"))
        );
    }
}
