//! Measurements from a table.

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::Path;

use crate::InputError;
use crate::csv::Table;
use crate::sensitivity::Output;

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// When, s.
    pub t: f64,
    /// Number of the output.
    pub output: usize,
    /// What was measured.
    pub value: f64,
    /// Its standard deviation, if it is known.
    pub noise: Option<f64>,
}

/// Names of the time in plain tables.
const TIME: [&str; 2] = ["t", "time"];
/// PEtab's name for the column of what was different.
const CONDITION: &str = "simulationConditionId";
/// What the name of a column of standard deviations ends with, in plain tables.
const NOISE: &str = ".noise";

/// Reads measurements of `outputs` between 0 and `t_end`, in the order of time.
///
/// Either a plain table, with a column `t` or `time`, a column for each output measured, and perhaps
/// one NAME.noise of its standard deviations; an empty word is no measurement. Or PEtab's long table
/// with the columns `observableId`, `time`, `measurement` and perhaps `noiseParameters`. Columns are
/// separated by commas, or by tabs if the header is.
///
/// # Errors
/// With the line and the column: what is no finite number, an output that there is not, a time
/// outside of the run, a standard deviation that is not positive.
pub fn read(
    name: &Path,
    text: &str,
    outputs: &[Output],
    t_end: f64,
) -> Result<Vec<Datum>, InputError> {
    let reader = Reader {
        name: name.display().to_string(),
        outputs,
        t_end,
    };
    let nothing = || InputError::new("the data hold no measurement").at(name.display());
    if text.trim().is_empty() {
        return Err(nothing());
    }
    let table = Table::parse(text).map_err(|error| {
        InputError::new(format!("the data are no table: {error}")).at(&reader.name)
    })?;
    let is_long = table.names.iter().any(|name| name == "observableId");
    let mut data = match is_long {
        true => reader.long(&table)?,
        false => reader.plain(&table)?,
    };
    if data.is_empty() {
        return Err(nothing());
    }
    let known = data.iter().filter(|datum| datum.noise.is_some()).count();
    if known != 0 && known != data.len() {
        let error = InputError::new("some measurements have a standard deviation, some have none")
            .at(&reader.name)
            .next("give `noise` to each [[output]], or to none");
        return Err(error);
    }
    data.sort_by(|a, b| a.t.total_cmp(&b.t));
    Ok(data)
}

struct Reader<'a> {
    name: String,
    outputs: &'a [Output],
    t_end: f64,
}

impl Reader<'_> {
    fn column(&self, table: &Table, names: &[&str]) -> Result<usize, InputError> {
        let found = table
            .names
            .iter()
            .position(|name| names.contains(&name.as_str()));
        found.ok_or_else(|| {
            InputError::new(format!(
                "the data have no column `{}`",
                names.join("` or `")
            ))
            .at(&self.name)
            .found(table.names.join(", "))
        })
    }

    fn output(&self, name: &str, place: &str) -> Result<usize, InputError> {
        let found = self.outputs.iter().position(|output| output.name == name);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.outputs.iter().map(|o| o.name.as_str()).collect();
            InputError::new(format!("the scene has no output `{name}`"))
                .at(place)
                .allowed(names.join(", "))
                .next("name it in an [[output]] with its probe and column")
        })
    }

    /// Refuses a row that is cut short, as an empty cell says that nothing was measured, a missing one nothing; and
    /// one with cells that no column names.
    fn expect_whole(&self, table: &Table, row: usize) -> Result<(), InputError> {
        let (found, wanted) = (table.rows[row].len(), table.names.len());
        let (what, next) = match found.cmp(&wanted) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => (
                "the row is cut short",
                "leave a cell empty where nothing was measured",
            ),
            Ordering::Greater => (
                "the row has more cells than the header",
                "write decimal points, not commas, and nothing behind the last cell",
            ),
        };
        Err(InputError::new(what)
            .at(format!("{}, row {} under the header", self.name, row + 1))
            .found(format!("{found} cells"))
            .allowed(wanted)
            .next(next))
    }

    /// Refuses measurements under more than one of PEtab's conditions, which an experiment has no word for.
    fn expect_one_condition(&self, table: &Table) -> Result<(), InputError> {
        let column = table.names.iter().position(|name| name == CONDITION);
        let Some(column) = column else { return Ok(()) };
        let named: BTreeSet<_> = table
            .rows
            .iter()
            .filter_map(|row| row.get(column))
            .collect();
        if named.len() <= 1 {
            return Ok(());
        }
        let named: Vec<&str> = named.into_iter().map(String::as_str).collect();
        Err(InputError::new("the measurements are of several conditions")
            .at(format!("{}, column {CONDITION}", self.name))
            .found(named.join(", "))
            .next("give each condition a file of its own, and what is different in it after the file's name"))
    }

    /// The number in a row's column, none if it is empty. Row 0 is in line 2.
    fn number(&self, table: &Table, row: usize, column: usize) -> Result<Option<f64>, InputError> {
        let word = table.rows[row].get(column).map_or("", String::as_str);
        if word.is_empty() {
            return Ok(None);
        }
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => {
                let error = InputError::new("measurements, times and noise are finite numbers");
                Err(error
                    .at(self.place(table, row, column))
                    .found(format!("`{word}`")))
            }
        }
    }

    fn place(&self, table: &Table, row: usize, column: usize) -> String {
        let name = table.names.get(column).map_or("", String::as_str);
        format!(
            "{}, row {} under the header, column {name}",
            self.name,
            row + 1
        )
    }

    fn time(&self, table: &Table, row: usize, column: usize) -> Result<f64, InputError> {
        let place = || self.place(table, row, column);
        let t = self
            .number(table, row, column)?
            .ok_or_else(|| InputError::new("a measurement needs its time").at(place()))?;
        if !(0.0..=self.t_end).contains(&t) {
            return Err(InputError::new("a measurement lies outside of the run")
                .at(place())
                .found(format!("t = {t} s"))
                .allowed(format!("0 to {} s, the scene's time.end", self.t_end)));
        }
        Ok(t)
    }

    fn noise(
        &self,
        table: &Table,
        row: usize,
        column: Option<usize>,
        output: usize,
    ) -> Result<Option<f64>, InputError> {
        let own = match column {
            Some(column) => self.number(table, row, column)?,
            None => None,
        };
        match own {
            Some(noise) if noise <= 0.0 => {
                let error = InputError::new("a standard deviation is positive").found(noise);
                Err(error.at(self.place(table, row, column.unwrap_or(0))))
            }
            own => Ok(own.or(self.outputs[output].noise)),
        }
    }

    fn long(&self, table: &Table) -> Result<Vec<Datum>, InputError> {
        let id = self.column(table, &["observableId"])?;
        let time = self.column(table, &["time"])?;
        let measurement = self.column(table, &["measurement"])?;
        let noise = table
            .names
            .iter()
            .position(|name| name == "noiseParameters");
        self.expect_one_condition(table)?;
        let mut data = Vec::new();
        for row in 0..table.rows.len() {
            self.expect_whole(table, row)?;
            let name = table.rows[row].get(id).map_or("", String::as_str);
            let output = self.output(name, &self.place(table, row, id))?;
            let t = self.time(table, row, time)?;
            if let Some(value) = self.number(table, row, measurement)? {
                let noise = self.noise(table, row, noise, output)?;
                data.push(Datum {
                    t,
                    output,
                    value,
                    noise,
                });
            }
        }
        Ok(data)
    }

    fn plain(&self, table: &Table) -> Result<Vec<Datum>, InputError> {
        let time = self.column(table, &TIME)?;
        let mut columns = Vec::new();
        for (column, name) in table.names.iter().enumerate() {
            if table.names[..column].contains(name) {
                let error = InputError::new("a column is there twice, and would count twice");
                return Err(error.at(&self.name).found(name).next("keep one of them"));
            }
            if column != time && !name.ends_with(NOISE) {
                let output = self.output(name, &format!("{}, column {name}", self.name))?;
                let noise = format!("{name}{NOISE}");
                let noise = table.names.iter().position(|name| *name == noise);
                columns.push((column, output, noise));
            }
        }
        let mut data = Vec::new();
        for row in 0..table.rows.len() {
            self.expect_whole(table, row)?;
            let t = self.time(table, row, time)?;
            for &(column, output, noise) in &columns {
                if let Some(value) = self.number(table, row, column)? {
                    let noise = self.noise(table, row, noise, output)?;
                    data.push(Datum {
                        t,
                        output,
                        value,
                        noise,
                    });
                }
            }
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs() -> Vec<Output> {
        [("tip", Some(0.1)), ("root", Some(0.2))]
            .map(|(name, noise)| Output::of_test(name, noise))
            .into()
    }

    fn read_text(text: &str) -> Result<Vec<Datum>, String> {
        read(Path::new("m.csv"), text, &outputs(), 2.0).map_err(|error| error.to_string())
    }

    #[test]
    fn plain_and_long_tables_say_the_same() {
        let plain = read_text("t,tip,root,tip.noise\n1,3,4,0.5\n0,1,,\n").unwrap();
        let long = read_text(
            "observableId,time,measurement,noiseParameters\ntip,0,1,\ntip,1,3,0.5\nroot,1,4,\n",
        )
        .unwrap();
        assert_eq!(plain, long);
        // PEtab's own files are separated by tabs.
        let tabs = "observableId\ttime\tmeasurement\tnoiseParameters\n\
                    tip\t0\t1\t\ntip\t1\t3\t0.5\nroot\t1\t4\t\n";
        assert_eq!(plain, read_text(tabs).unwrap());
        let noises: Vec<Option<f64>> = plain.iter().map(|datum| datum.noise).collect();
        assert_eq!(noises, [Some(0.1), Some(0.5), Some(0.2)]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_row() {
        for (text, told) in [
            (
                "t,tip\n0,nan\n",
                "m.csv, row 1 under the header, column tip",
            ),
            ("t,tip\n0,1\n0.5,x\n", "found: `x`"),
            ("t,tip\n3,1\n", "a measurement lies outside of the run"),
            ("t,tip\n-1,1\n", "allowed: 0 to 2 s"),
            ("t,tap\n0,1\n", "the scene has no output `tap`"),
            ("x,tip\n0,1\n", "no column `t` or `time`"),
            ("t,tip\n", "the data hold no measurement"),
            ("t,tip,tip\n0,1,1\n", "a column is there twice"),
            ("t,tip\n0,1\n1\n", "the row is cut short"),
            ("t,tip\n0,1,5e-3\n", "found: 3 cells"),
            (
                "observableId,time,measurement,simulationConditionId\ntip,0,1,a\ntip,1,2,b\n",
                "several conditions",
            ),
            ("\n", "the data hold no measurement"),
            (
                "t,tip,tip.noise\n0,1,0\n",
                "a standard deviation is positive",
            ),
            ("observableId,time\ntip,1\n", "no column `measurement`"),
        ] {
            let error = read_text(text).unwrap_err();
            assert!(error.contains(told), "{text:?}: {error}");
        }
    }
}
