//! Reader for the files of the NIST Statistical Reference Datasets for nonlinear regression.

use std::path::Path;

pub(crate) struct DataSet {
    pub(crate) starts: [Vec<f64>; 2],
    pub(crate) certified: Vec<f64>,
    pub(crate) standard_errors: Vec<f64>,
    pub(crate) sum_of_squares: f64,
    /// Rows of the data; in each row, the response is followed by the predictors.
    pub(crate) rows: Vec<Vec<f64>>,
}

pub(crate) fn read(name: &str) -> DataSet {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/nist_strd/data")
        .join(name)
        .with_extension("dat");
    let text = std::fs::read_to_string(path).unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let parameter = |line: &&str| {
        let line = line.trim_start();
        line.starts_with('b') && line.contains('=') && line[1..2].parse::<u8>().is_ok()
    };
    let table: Vec<_> = text
        .lines()
        .filter(parameter)
        .map(|line| numbers(line.split_once('=').unwrap().1))
        .collect();
    let column = |k: usize| table.iter().map(|row| row[k]).collect::<Vec<_>>();
    let sum_of_squares = text
        .lines()
        .find_map(|line| line.trim().strip_prefix("Residual Sum of Squares:"))
        .map(|rest| rest.trim().parse().unwrap())
        .unwrap();
    // "Data:" begins the description of the data in the header, and occurs again before the table.
    let rows = text.lines().skip(60).map(numbers).filter(|row| row.len() > 1).collect();
    DataSet {
        starts: [column(0), column(1)],
        certified: column(2),
        standard_errors: column(3),
        sum_of_squares,
        rows,
    }
}
