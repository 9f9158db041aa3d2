//! Fits of the NIST Statistical Reference Datasets for nonlinear regression, 27 data sets with certified values. The
//! files are in the public domain (US government).
#![allow(clippy::unwrap_used)] // a test may panic

mod dual;
mod file;
mod models;

use myovib_fit::{Failed, Fit, Model, Options, Parameter, fit};
use nalgebra::DMatrix;

use dual::Dual;
use file::DataSet;
use models::{Formula, SETS};

struct Regression<'a> {
    data: &'a DataSet,
    formula: Formula,
    /// Whether the model describes the logarithm of the response, as in Nelson's model.
    of_logarithm: bool,
}

impl Regression<'_> {
    fn rows(&self, p: &[f64]) -> impl Iterator<Item = (Dual, f64)> {
        let b: Vec<_> = p.iter().enumerate().map(|(j, &p)| Dual::parameter(j, p)).collect();
        self.data.rows.iter().map(move |row| {
            let response = if self.of_logarithm { row[0].ln() } else { row[0] };
            ((self.formula)(&b, &row[1..]), response)
        })
    }
}

impl Model for Regression<'_> {
    fn n_residuals(&self) -> usize {
        self.data.rows.len()
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        for (out, (value, response)) in out.iter_mut().zip(self.rows(p)) {
            *out = value.value - response;
        }
        Ok(())
    }

    fn jacobian(&mut self, p: &[f64], _: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        for (i, (value, _)) in self.rows(p).enumerate() {
            for j in 0..p.len() {
                out[(i, j)] = value.slopes[j];
            }
        }
        Ok(())
    }
}

/// Returns the number of correct digits. It is at most 11, the number of certified digits.
fn digits(found: f64, certified: f64) -> f64 {
    let error = ((found - certified) / certified).abs();
    (-error.max(1e-11).log10()).max(0.0)
}

fn least(found: &[f64], certified: &[f64]) -> f64 {
    let all = found.iter().zip(certified).map(|(f, c)| digits(*f, *c));
    all.fold(f64::INFINITY, f64::min)
}

fn solve(data: &DataSet, name: &str, formula: Formula, start: &[f64]) -> Option<Fit> {
    let names = (1..).map(|k| format!("b{k}"));
    let parameters: Vec<_> =
        names.zip(start).map(|(name, &start)| Parameter::new(name, start)).collect();
    let mut model = Regression { data, formula, of_logarithm: name == "Nelson" };
    let options = Options { tolerance: 1e-11, max_iterations: 2000, ..Options::default() };
    fit(&mut model, &parameters, &options).ok()
}

#[test]
fn all_sets_from_the_second_start_have_eight_digits_and_six_of_the_standard_errors() {
    let mut failures = Vec::new();
    println!("set        start  evaluations  digits of parameters  of standard errors");
    for (name, formula) in SETS {
        let data = file::read(name);
        assert_eq!(data.certified.len(), data.starts[0].len(), "{name}");
        for (k, start) in data.starts.iter().enumerate() {
            let Some(fitted) = solve(&data, name, formula, start) else {
                println!("{name:10} {:5}  the model fails there", k + 1);
                assert!(k == 0, "{name}: start 2 fails");
                continue;
            };
            let values = least(&fitted.values, &data.certified);
            let uncertainty = fitted.uncertainty().unwrap();
            let errors = least(&uncertainty.standard_errors, &data.standard_errors);
            println!(
                "{name:10} {:5}  {:11}  {values:20.1}  {errors:18.1}",
                k + 1,
                fitted.evaluations
            );
            // Lanczos1 was generated without noise. Its standard errors are therefore only rounding errors and are not
            // compared.
            let enough = if name == "Lanczos1" { 0.0 } else { 6.0 };
            if k == 1 && (values < 8.0 || errors < enough) {
                failures.push(format!("{name}: {values:.1}, {errors:.1}, {:?}", fitted.ended));
            }
            if name != "Lanczos1" && values > 6.0 {
                // The residual sum of squares is certified to eleven digits.
                let sum = digits(2.0 * fitted.cost, data.sum_of_squares);
                assert!(sum > 8.0, "{name}: {sum}");
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
