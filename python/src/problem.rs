//! DAE defined by Python functions.

use std::sync::{Arc, Mutex, PoisonError};

use myovib_dae::{Problem, StepError, VariableKind, full_pattern};
use nalgebra_sparse::pattern::SparsityPattern;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};

use crate::error::StepFailure;

/// Exception raised by a function of the problem, if any.
pub(crate) type Raised = Arc<Mutex<Option<PyErr>>>;

/// DAE defined by Python functions.
pub(crate) struct PythonDae {
    pub(crate) n: usize,
    pub(crate) residual: Py<PyAny>,
    pub(crate) jacobian: Option<Py<PyAny>>,
    pub(crate) events: Option<Py<PyAny>>,
    /// Function that returns ∂F/∂p, row by row.
    pub(crate) df_dp: Option<Py<PyAny>>,
    pub(crate) pattern: Option<SparsityPattern>,
    pub(crate) kinds: Option<Vec<VariableKind>>,
    pub(crate) indices: Option<Vec<u8>>,
    /// The two matrices from the last call of [`Problem::jacobian`].
    pub(crate) parts: [Vec<f64>; 2],
    pub(crate) raised: Raised,
}

impl PythonDae {
    /// Calls a Python function with (t, y, ẏ) and reads its result.
    fn call<T>(
        &self,
        function: &Py<PyAny>,
        t: f64,
        [y, y_dot]: [&[f64]; 2],
        read: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<T>,
    ) -> Result<T, StepError> {
        Python::attach(|py| {
            let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
            // After Ctrl-C, functions are no longer called, not even for a trial evaluation.
            if let Some(error) = &*raised
                && !error.is_instance_of::<PyException>(py)
            {
                return Err(StepError::Fatal(error.to_string().into()));
            }
            drop(raised);
            let answer = function.bind(py).call1((t, array(py, y), array(py, y_dot)));
            answer.and_then(|answer| read(&answer)).map_err(|error| {
                if error.is_instance_of::<StepFailure>(py) {
                    let text = error.value(py).to_string();
                    return StepError::Recoverable(match text.is_empty() {
                        true => format!("StepFailure was raised at t = {t}"),
                        false => text,
                    });
                }
                let text = error.to_string();
                *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                StepError::Fatal(text.into())
            })
        })
    }

    /// Evaluates ∂F/∂p row by row.
    pub(crate) fn df_dp(
        &self,
        t: f64,
        state: [&[f64]; 2],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        match &self.df_dp {
            Some(function) => self.call(function, t, state, |answer| copy(answer, out)),
            None => Ok(()),
        }
    }
}

/// Returns the values as bytes, which NumPy can view as an array without a copy.
pub(crate) fn array<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyByteArray> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
    PyByteArray::new(py, &bytes)
}

/// Copies a result into `out`, which has the same length.
fn copy(answer: &Bound<'_, PyAny>, out: &mut [f64]) -> PyResult<()> {
    let bytes = answer.downcast::<PyBytes>()?.as_bytes();
    assert_eq!(bytes.len(), size_of_val(out), "the Python code checks the length");
    for (value, bytes) in out.iter_mut().zip(bytes.chunks_exact(size_of::<f64>())) {
        *value = f64::from_ne_bytes(bytes.try_into().expect("chunks of that size"));
    }
    Ok(())
}

impl Problem for PythonDae {
    fn n_unknowns(&self) -> usize {
        self.n
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.call(&self.residual, t, [y, v], |answer| copy(answer, r))
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone().unwrap_or_else(|| full_pattern(self.n))
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        if self.jacobian.is_none() {
            return Err(StepError::NoJacobian);
        }
        let mut parts = std::mem::take(&mut self.parts);
        for part in &mut parts {
            part.resize(values.len(), 0.0);
        }
        let [df_dy, df_dyp] = &mut parts;
        let evaluated = self.jacobian_parts(t, y, y_dot, [df_dy, df_dyp]);
        for (value, (j, m)) in values.iter_mut().zip(parts[0].iter().zip(&parts[1])) {
            *value = a * j + b * m;
        }
        self.parts = parts;
        evaluated
    }

    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        [df_dy, df_dyp]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        let Some(jacobian) = &self.jacobian else {
            return Err(StepError::NoJacobian);
        };
        self.call(jacobian, t, [y, y_dot], |answer| {
            let (values, rates): (Bound<'_, PyAny>, Bound<'_, PyAny>) = answer.extract()?;
            copy(&values, df_dy)?;
            copy(&rates, df_dyp)
        })
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        self.kinds.clone()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.indices.clone()
    }
}

/// Evaluates the event functions.
pub(crate) fn events(
    problem: &mut PythonDae,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
    values: &mut [f64],
) -> Result<(), StepError> {
    match &problem.events {
        Some(events) => problem.call(events, t, [y, y_dot], |answer| copy(answer, values)),
        None => Ok(()),
    }
}
