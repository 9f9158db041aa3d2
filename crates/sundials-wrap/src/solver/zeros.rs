//! The side on which exact zeros of root functions count.

/// Number of stored evaluations: more than a search for a root takes.
const KEPT: usize = 512;

/// Assigns a sign to zeros of root functions.
///
/// IDAS stops permanently if a function stays at zero after a root. Here a zero counts as the side
/// opposite to where the function came from: reaching zero is a crossing, and staying there is not.
/// Leaving zero is not a crossing, in either direction.
#[derive(Debug, Default)]
pub(super) struct ZeroSides {
    /// Sign of the direction of integration.
    pub(super) direction: f64,
    /// The evaluations so far in the order of time, up to the last one.
    known: Vec<Evaluation>,
}

#[derive(Debug)]
struct Evaluation {
    t: f64,
    /// Values that were returned: a zero with a side is not zero.
    values: Vec<f64>,
    are_zero: Vec<bool>,
}

impl ZeroSides {
    /// Forgets all evaluations, at a start.
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
        if self.known.len() == KEPT {
            self.known.remove(0);
        }
        self.known.push(Evaluation {
            t,
            values: values.to_vec(),
            are_zero,
        });
    }

    /// Removes crossings at `t` of functions that only leave zero there.
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
