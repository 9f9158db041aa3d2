//! Sums over the points and terms of internal variables, in blocks that fit in the cache.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::form::{Form, N_DRIVING};

/// Number of points per block.
const AT_A_TIME: usize = 256;

/// Internal variables of the terms of one group, and their driving quantities.
#[derive(Clone, Copy)]
pub(super) struct Driven<'a> {
    /// Range of the group among all points.
    pub(super) slots: &'a Range<usize>,
    /// Internal variables of the group, term by term.
    pub(super) states: &'a [f64],
    pub(super) driving: &'a [Vec<f64>],
}

impl Driven<'_> {
    /// Evaluates `forms`, one per term, and adds their sum over the terms to the points of the group in `out`.
    pub(super) fn add_sum(self, forms: &[Form], out: &mut [f64]) {
        let out = &mut out[self.slots.clone()];
        let mut total = [0.0; N_DRIVING];
        for form in forms {
            for (total, own) in total.iter_mut().zip(form.of_driving) {
                *total += own;
            }
        }
        self.in_pieces(|piece, place| {
            let out = &mut out[piece.clone()];
            self.add_driving(&total, &place, out);
            for (k, form) in forms.iter().enumerate() {
                add(out, form.of_state, self.state(k, &piece));
            }
        });
    }

    /// Evaluates each of the `forms` and writes the result to the position of its term in `out`.
    pub(super) fn write(self, forms: &[Form], out: &mut [f64]) {
        let width = self.slots.len();
        self.in_pieces(|piece, place| {
            for (k, form) in forms.iter().enumerate() {
                let out = &mut out[k * width + piece.start..k * width + piece.end];
                out.fill(0.0);
                self.add_form(form, k, (&piece, &place), out);
            }
        });
    }

    /// Returns Σ (x/(`relative` |q| + `absolute`))², where x denotes the values of `forms`.
    pub(super) fn square(self, forms: &[Form], relative: f64, absolute: f64) -> f64 {
        let (mut sum, mut buffer) = (0.0, [0.0; AT_A_TIME]);
        self.in_pieces(|piece, place| {
            for (k, form) in forms.iter().enumerate() {
                let errors = &mut buffer[..piece.len()];
                errors.fill(0.0);
                self.add_form(form, k, (&piece, &place), errors);
                for (error, q) in errors.iter().zip(self.state(k, &piece)) {
                    sum += (error / (relative * q.abs() + absolute)).powi(2);
                }
            }
        });
        sum
    }

    #[inline(always)]
    fn add_driving(&self, factors: &[f64; N_DRIVING], place: &Range<usize>, out: &mut [f64]) {
        for (factor, driving) in factors.iter().zip(self.driving) {
            if *factor != 0.0 {
                add(out, *factor, &driving[place.clone()]);
            }
        }
    }

    #[inline(always)]
    fn add_form(
        &self,
        form: &Form,
        k: usize,
        (piece, place): (&Range<usize>, &Range<usize>),
        out: &mut [f64],
    ) {
        add(out, form.of_state, self.state(k, piece));
        self.add_driving(&form.of_driving, place, out);
    }

    #[inline(always)]
    fn state(&self, k: usize, piece: &Range<usize>) -> &[f64] {
        let first = k * self.slots.len();
        &self.states[first + piece.start..first + piece.end]
    }

    /// Calls the function for each block of the group with vector instructions enabled. The arguments are the range of
    /// the block within the group and its range among all points.
    fn in_pieces(&self, function: impl FnMut(Range<usize>, Range<usize>)) {
        Arch::new().dispatch(Pieces { slots: self.slots, function });
    }
}

struct Pieces<'a, F> {
    slots: &'a Range<usize>,
    function: F,
}

impl<F: FnMut(Range<usize>, Range<usize>)> WithSimd for Pieces<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        for start in (0..self.slots.len()).step_by(AT_A_TIME) {
            let end = self.slots.len().min(start + AT_A_TIME);
            let first = self.slots.start;
            (self.function)(start..end, first + start..first + end);
        }
    }
}

/// Computes y ← y + a x; does nothing for a = 0.
#[inline(always)]
fn add(y: &mut [f64], a: f64, x: &[f64]) {
    if a != 0.0 {
        crate::dense::add_scaled(y, a, x);
    }
}
