//! Checks for a harmonic response.

use super::Body;
use super::builder::Builder;
use crate::InputError;
use crate::scene_file::Analysis;

impl Builder<'_> {
    /// Rejects a response without valid frequencies.
    pub(super) fn response(&self) -> Result<(), InputError> {
        let Some(response) = &self.file.response else {
            let error = InputError::new("a response requires frequencies").next(
                "add a [response] table with `frequencies` in Hz, or use --frequencies 1..60:120",
            );
            return Err(self.wrong("analysis", error));
        };
        let path = "response.frequencies";
        let allowed = "0 Hz or more: a list, or a range such as \"1..60:120\", \"1..60:120:log\" or \"1..60:adaptive\"";
        let grid = response.frequencies.grid();
        grid.map_err(|problem| self.wrong(path, InputError::new(problem).allowed(allowed)))?;
        let is_valid = |frequency: &f64| (0.0..f64::INFINITY).contains(frequency);
        if !response.fields.iter().all(is_valid) {
            let error = InputError::new("a frequency is out of range").allowed("0 Hz or more");
            return Err(self.wrong("response.fields", error));
        }
        if let (Some(_), [_, ..]) = (&self.file.rod, &response.fields[..]) {
            let error = InputError::new("a rod has no fields");
            return Err(self.wrong("response.fields", error.next("remove the key, or use probes")));
        }
        Ok(())
    }

    /// Rejects a preload if a material has a law for small strains and viscous stresses.
    pub(super) fn expect_rest(&self, path: &str) -> Result<(), InputError> {
        let preload = self.file.response.as_ref().and_then(|own| own.preload_time);
        if self.file.analysis != Analysis::Response || preload.is_none() {
            return Ok(());
        }
        let error =
            InputError::new("viscous stresses of small-strain laws require a response about rest");
        let error = error.next(
            "remove response.preload_time, which has no effect on a linear law, or use neo-hooke",
        );
        Err(self.wrong(path, error))
    }

    /// Rejects a response without a harmonic load.
    pub(super) fn driven(&self, body: Option<&Body>) -> Result<(), InputError> {
        let rod = self.file.rod.as_ref().and_then(|rod| rod.response);
        let is_driven = body.is_some_and(|body| !body.excitation.is_zero())
            || rod.is_some_and(|amplitude| amplitude.value != 0.0);
        if self.file.analysis != Analysis::Response || is_driven {
            return Ok(());
        }
        let error = InputError::new("no load or displacement has a harmonic part");
        let error = error.next(
            "add a `response` to one of them, for example response = { y = 100.0 } in a [[traction]], or \
             response = { value = 1.0 } for a rod or a pressure",
        );
        Err(self.wrong("analysis", error))
    }
}
