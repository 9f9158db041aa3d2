//! Signs for exact zeros of root functions.

/// Number of stored evaluations, larger than the number of evaluations in a search for a root.
const KEPT: usize = 512;

/// Replaces zeros of root functions by values with a sign.
///
/// IDAS stops permanently if a function stays at zero after a root. Here a zero has the sign opposite to the last
/// nonzero value. Therefore a function has a crossing when it reaches zero, but not while it stays at zero or when it
/// leaves zero. A function with a zero at the start has the sign of its first nonzero value.
#[derive(Debug, Default)]
pub(super) struct ZeroSides {
    /// Sign of the direction of integration.
    pub(super) direction: f64,
    /// The evaluations so far, ordered by time.
    known: Vec<Evaluation>,
}

#[derive(Debug)]
struct Evaluation {
    t: f64,
    /// Returned values, in which zeros have been replaced.
    values: Vec<f64>,
    are_zero: Vec<bool>,
}

impl ZeroSides {
    /// Discards all evaluations, at a new start.
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
        // IDAS evaluates the functions just after a zero at the start, and later between these times.
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

    /// Removes crossings at `t` if the function only leaves zero there.
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
