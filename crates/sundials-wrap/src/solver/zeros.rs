//! Signs for root functions that are exactly zero.

/// Number of stored evaluations. It is larger than the number of evaluations in a search for a root.
const KEPT: usize = 512;

/// Replaces zeros of root functions by values with a sign.
///
/// IDAS stops permanently if a function remains zero after a root. Here, a zero is replaced by a value with the
/// opposite sign of the last nonzero value. Therefore, a crossing is reported when a function reaches zero, but not
/// while it remains zero or when it leaves zero. If a function is zero at the start, the zero has the sign of the first
/// nonzero value.
#[derive(Debug, Default)]
pub(super) struct ZeroSides {
    /// Sign that represents the direction of integration.
    pub(super) direction: f64,
    /// Evaluations so far, in the order of time.
    known: Vec<Evaluation>,
}

#[derive(Debug)]
struct Evaluation {
    t: f64,
    /// Returned values, with zeros replaced.
    values: Vec<f64>,
    are_zero: Vec<bool>,
}

impl ZeroSides {
    /// Discards all evaluations. Called at a new start.
    pub(super) fn clear(&mut self) {
        self.known.clear();
    }

    /// Replaces zeros among the values of root functions at `t`.
    pub(super) fn resolve(&mut self, t: f64, values: &mut [f64]) {
        let is_later = |known: &Evaluation| (known.t - t) * self.direction >= 0.0;
        while self.known.last().is_some_and(is_later) {
            self.known.pop();
        }
        let are_zero: Vec<bool> = values.iter().map(|value| *value == 0.0).collect();
        if let Some(before) = self.known.last() {
            for (i, value) in values.iter_mut().enumerate().filter(|(i, _)| are_zero[*i]) {
                let side = if before.are_zero[i] { 1.0 } else { -1.0 };
                *value = side * before.values[i];
            }
        }
        // If a function is zero at the start, IDAS evaluates it just after the start, and later at times in between.
        for known in &mut self.known {
            for (before, value) in known.values.iter_mut().zip(&*values) {
                if *before == 0.0 {
                    *before = *value;
                }
            }
        }
        if self.known.len() == KEPT {
            self.known.remove(0);
        }
        self.known.push(Evaluation { t, values: values.to_vec(), are_zero });
    }

    /// Removes crossings at `t` where the function only leaves zero.
    pub(super) fn keep_arrivals(&self, t: f64, crossings: &mut [i32]) {
        let is_before = |known: &&Evaluation| (known.t - t) * self.direction < 0.0;
        if let Some(before) = self.known.iter().rev().find(is_before) {
            for (crossing, was_zero) in crossings.iter_mut().zip(&before.are_zero) {
                if *was_zero {
                    *crossing = 0;
                }
            }
        }
    }
}
