//! Builds functions of time from their definitions in the scene.

use std::path::Path;

use myovib_model::check::readable;
use myovib_model::{Pchip, Points, Polyline, Signal, Spline};

use super::builder::Builder;
use crate::InputError;
use crate::csv::Table;
use crate::scene_file::function::{Composed, Function, Interpolation, Shape};

/// A note is added if the overshoot of a spline, relative to the range of its values, exceeds this value.
const OVERSHOOT: f64 = 0.02;

impl Builder<'_> {
    /// Returns the function of time defined at `path`.
    pub(super) fn signal(&self, function: &Function, path: &str) -> Result<Signal, InputError> {
        let parts = |of: &[Function]| {
            let parts = of.iter().enumerate();
            parts
                .map(|(i, part)| self.signal(part, &format!("{path}.of[{i}]")))
                .collect::<Result<Vec<_>, _>>()
        };
        Ok(match function {
            Function::Constant(value) => Signal::constant(*value),
            Function::Shape(Shape::Formula(formula)) => {
                let signal = formula.signal();
                if let Some(objection) = signal.objection() {
                    let error = InputError::new(objection.problem)
                        .found(objection.found)
                        .allowed(objection.allowed)
                        .next(objection.next);
                    return Err(self.wrong(&format!("{path}.{}", objection.key), error));
                }
                signal
            }
            Function::Shape(Shape::Composed(composed)) => match composed {
                Composed::Table { file, time, column, interpolation, acceleration } => {
                    let is_displacement = path.starts_with("prescribed_displacement")
                        && !path.contains(".rotation")
                        || path.starts_with("contact") && !path.contains(".force");
                    if *acceleration && !is_displacement {
                        let error = InputError::new(
                            "`acceleration` is only supported for tables of displacements",
                        )
                        .allowed("components of [[prescribed_displacement]] and of obstacles");
                        return Err(self.wrong(&format!("{path}.acceleration"), error));
                    }
                    let points = self.table(file, time, column, path)?;
                    match interpolation {
                        Interpolation::Linear if *acceleration => {
                            Spline::of_acceleration(points).into()
                        }
                        _ if *acceleration => {
                            let error =
                                InputError::new("accelerations are always interpolated linearly")
                                    .next("remove `interpolation`");
                            return Err(self.wrong(&format!("{path}.interpolation"), error));
                        }
                        Interpolation::Linear => Polyline(points).into(),
                        Interpolation::Pchip => Pchip::from(points).into(),
                        Interpolation::Spline => self.spline(points, path).into(),
                    }
                }
                Composed::Sum { of } => Signal::sum(parts(of)?),
                Composed::Product { of } => Signal::product(parts(of)?),
            },
        })
    }

    /// Returns the spline through the points. Adds a note if the spline overshoots them.
    fn spline(&self, points: Points, path: &str) -> Spline {
        let spline = Spline::from(points);
        let overshoot = spline.overshoot();
        if let Some(found) = overshoot.filter(|found| found.excess > OVERSHOOT) {
            let [from, to] = found.between;
            self.notes.borrow_mut().push(format!(
                "{path}: between the rows at {from} s and {to} s the spline reaches {}, beyond both rows by {:.0} % of the \
                 range of the table: use `interpolation = \"pchip\"` or \"linear\" if the data do not overshoot",
                readable(found.value),
                100.0 * found.excess
            ));
        }
        spline
    }

    fn table(
        &self,
        file: &Path,
        time: &str,
        column: &str,
        path: &str,
    ) -> Result<Points, InputError> {
        let place = format!("{path}.file");
        let (text, name) = self.read_text(file, &place)?;
        let table = Table::parse(&text)
            .map_err(|error| self.wrong(&place, InputError::new(format!("{name}: {error}"))))?;
        let position = |wanted: &str, key: &str| {
            let mut found = (0..table.names.len()).filter(|&j| table.names[j] == wanted);
            let problem = match (found.next(), found.next()) {
                (Some(only), None) => return Ok(only),
                (None, _) => format!("{name} has no column `{wanted}`"),
                _ => format!("{name} has several columns `{wanted}`"),
            };
            let error = InputError::new(problem)
                .allowed(table.names.join(", "))
                .next("the first line of the file names the columns, separated by commas or tabs");
            Err(self.wrong(&format!("{path}.{key}"), error))
        };
        let columns = [position(time, "time")?, position(column, "column")?];
        let (mut times, mut values) = (Vec::<f64>::new(), Vec::new());
        for (row, line) in table.rows.iter().zip(&table.lines) {
            let wrong = |problem: &str| {
                let message = format!("{name}, line {line}: the row {problem}");
                self.wrong(&place, InputError::new(message).found(row.join(",")))
            };
            if row.len() > table.names.len() {
                return Err(wrong("has more values than the header has names"));
            }
            let number = |j: usize| {
                let number = row.get(j)?.parse::<f64>();
                number.ok().filter(|x| x.is_finite())
            };
            let [Some(t), Some(value)] = columns.map(number) else {
                return Err(wrong("needs a finite time and a finite value"));
            };
            if times.last().is_some_and(|last| t <= *last) {
                return Err(wrong("is not later than the previous row"));
            }
            times.push(t);
            values.push(value);
        }
        let points = self.at(&place, Points::new(times, values))?;
        let (start, end) = points.range();
        // Because decimals are rounded, a table may end slightly before the run.
        if start > 0.0 || end < self.t_end * (1.0 - 1e-12) {
            let error = InputError::new("the table does not cover the run's time interval")
                .found(format!("{start} s to {end} s"))
                .allowed(format!("0 s to {} s or beyond", self.t_end));
            return Err(self.wrong(&place, error));
        }
        Ok(points)
    }
}
