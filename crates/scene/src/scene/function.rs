//! Functions of time from their text.

use std::path::Path;
use std::sync::Arc;

use myovib_model::{Signal, Spline};

use super::builder::Builder;
use crate::InputError;
use crate::csv::Table;
use crate::scene_file::function::{Function, Shape};

impl Builder<'_> {
    /// The function of time at `path`.
    pub(super) fn signal(&self, function: &Function, path: &str) -> Result<Signal, InputError> {
        let shape = match function {
            Function::Constant(value) => return Ok(Signal::Constant(*value)),
            Function::Shape(shape) => shape,
        };
        let parts = |of: &[Function]| {
            of.iter()
                .enumerate()
                .map(|(i, part)| self.signal(part, &format!("{path}.of[{i}]")))
                .collect::<Result<Vec<_>, _>>()
        };
        Ok(match shape {
            &Shape::Sine {
                amplitude,
                frequency,
                phase,
            } => Signal::Sine {
                amplitude,
                frequency,
                phase,
            },
            &Shape::RampedSine {
                amplitude,
                frequency,
                steepness,
                shift,
            } => Signal::RampedSine {
                amplitude,
                frequency,
                steepness,
                shift,
            },
            &Shape::Step { value, start, rise } => Signal::Step { value, start, rise },
            &Shape::Ramp { value, start, end } if end > start => Signal::Ramp { value, start, end },
            Shape::Ramp { start, end, .. } => {
                let error = InputError::new("the ramp ends before it starts")
                    .found(format!("start = {start}, end = {end}"))
                    .allowed("an end after the start, s")
                    .next("what jumps is a step: { type = \"step\", value = ..., start = ..., rise = 0 }");
                return Err(self.wrong(&format!("{path}.end"), error));
            }
            Shape::Table { file, time, column } => {
                Signal::Table(Arc::new(self.table(file, time, column, path)?))
            }
            Shape::Sum { of } => Signal::Sum(parts(of)?),
            Shape::Product { of } => Signal::Product(parts(of)?),
        })
    }

    fn table(
        &self,
        file: &Path,
        time: &str,
        column: &str,
        path: &str,
    ) -> Result<Spline, InputError> {
        let place = format!("{path}.file");
        let (text, name) = self.read(file, &place)?;
        let table = Table::parse(&text)
            .map_err(|error| self.wrong(&place, InputError::new(format!("{name}: {error}"))))?;
        let position = |wanted: &str, key: &str| {
            let found = table.names.iter().position(|known| known == wanted);
            found.ok_or_else(|| {
                let error = InputError::new(format!("{name} has no column `{wanted}`"))
                    .allowed(table.names.join(", "));
                self.wrong(&format!("{path}.{key}"), error)
            })
        };
        let columns = [position(time, "time")?, position(column, "column")?];
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for (i, row) in table.rows.iter().enumerate() {
            let numbers = columns.map(|j| row.get(j).and_then(|word| word.parse::<f64>().ok()));
            let [Some(t), Some(value)] = numbers else {
                let error = InputError::new(format!("row {} is not made of numbers", i + 1))
                    .found(row.join(","));
                return Err(self.wrong(&place, error));
            };
            times.push(t);
            values.push(value);
        }
        let spline = self.at(&place, Spline::new(times, values))?;
        let (start, end) = spline.range();
        // A table that ends at the run's end up to the rounding of its decimals is long enough.
        if start > 0.0 || end < self.t_end * (1.0 - 1e-12) {
            let error = InputError::new("the table does not cover the run's time interval")
                .found(format!("{start} s to {end} s"))
                .allowed(format!("0 s to {} s or beyond", self.t_end));
            return Err(self.wrong(&place, error));
        }
        Ok(spline)
    }
}
