//! The coupled system as a [`Problem`].

use std::ops::Range;

use myovib_dae::{Problem, StepError, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::oscillators::{Oscillators, Source};
use crate::blocks::{Block, Blocks};
use crate::error::ModelError;
use crate::start::Consistent;

/// F(t, Y, Ẏ) = 0 for a body and the oscillators it drives, Y = (y, s_1, s_2, …).
#[derive(Debug, Clone)]
pub struct CoupledDae<B> {
    body: B,
    parts: Vec<Part>,
    blocks: Blocks,
    body_values: Vec<f64>,
    n_body: usize,
    n_unknowns: usize,
}

/// Oscillators and their range in Y.
#[derive(Debug, Clone)]
struct Part {
    oscillators: Oscillators,
    range: Range<usize>,
    forcing: Vec<f64>,
    jacobian: Vec<f64>,
    coupling: Coupling,
}

/// ∂F_o/∂y for all directions: γ w in each row on which the forcing acts.
#[derive(Debug, Clone)]
struct Coupling {
    pattern: SparsityPattern,
    values: Vec<f64>,
}

impl Coupling {
    fn new(oscillators: &Oscillators, n_body: usize) -> Self {
        let network = oscillators.network();
        let mut entries = CooMatrix::new(network.n_states(), n_body);
        for (channel, source) in oscillators.sources().iter().enumerate() {
            for &(column, weight) in source.unknowns() {
                // ∂c/∂y_i = γ w_i for the forcing c = γ u, which has a positive sign in its rows.
                let slope = oscillators.drive().forcing(weight);
                let rows = network.forced_rows(channel);
                rows.for_each(|row| entries.push(row, column, slope));
            }
        }
        let (pattern, values) = CscMatrix::from(&entries).into_pattern_and_values();
        Self { pattern, values }
    }
}

impl<B: Problem> CoupledDae<B> {
    /// Combines `body` and `oscillators`. The points of [`Source::Body`] must belong to this body.
    ///
    /// # Panics
    /// Panics if a source refers to an unknown that the body does not have.
    pub fn new(body: B, oscillators: Vec<Oscillators>) -> Self {
        let n_body = body.n_unknowns();
        let mut end = n_body;
        let parts: Vec<Part> = oscillators
            .into_iter()
            .map(|oscillators| {
                let start = end;
                end += oscillators.network().n_states();
                let mut unknowns = oscillators.sources().iter().flat_map(Source::unknowns);
                let known = unknowns.all(|(i, _)| *i < n_body);
                assert!(known, "the source is a point of this body");
                Part {
                    forcing: vec![0.0; oscillators.network().n_channels()],
                    jacobian: vec![0.0; oscillators.network().jacobian_pattern().nnz()],
                    range: start..end,
                    coupling: Coupling::new(&oscillators, n_body),
                    oscillators,
                }
            })
            .collect();
        let body_pattern = body.jacobian_pattern();
        let mut placed = vec![Block::at(0, 0, &body_pattern)];
        for part in &parts {
            let start = part.range.start;
            let own = part.oscillators.network().jacobian_pattern();
            placed.push(Block::at(start, start, own));
            placed.push(Block::at(start, 0, &part.coupling.pattern));
        }
        Self {
            blocks: Blocks::new((end, end), &placed),
            body_values: vec![0.0; body_pattern.nnz()],
            n_unknowns: end,
            n_body,
            body,
            parts,
        }
    }

    /// Returns the body.
    pub fn body(&self) -> &B {
        &self.body
    }

    /// Returns the body for evaluations outside the time integration.
    pub fn body_mut(&mut self) -> &mut B {
        &mut self.body
    }

    /// Returns the range of the body's unknowns in Y.
    pub fn body_range(&self) -> Range<usize> {
        0..self.n_body
    }

    /// Returns the number of oscillator networks.
    pub fn n_networks(&self) -> usize {
        self.parts.len()
    }

    /// Returns the oscillators of network `k`.
    pub fn oscillators(&self, k: usize) -> &Oscillators {
        &self.parts[k].oscillators
    }

    /// Returns the range of the states of network `k` in Y.
    pub fn range(&self, k: usize) -> Range<usize> {
        self.parts[k].range.clone()
    }

    /// Swaps the oscillators of network `k` with `other`, which must have the same number of states and the same
    /// sources.
    pub(crate) fn exchange(&mut self, k: usize, other: &mut Oscillators) {
        std::mem::swap(&mut self.parts[k].oscillators, other);
    }

    /// Evaluates the residual of network `k`. If `other` is given, its oscillators replace those of the network.
    ///
    /// # Shapes
    /// `y`, `y_dot`: all unknowns; `residual`: states of the network.
    ///
    /// # Errors
    /// Returns an error if a recording does not cover `t`.
    pub(crate) fn residual_of(
        &mut self,
        (k, other): (usize, Option<&Oscillators>),
        t: f64,
        [y, y_dot]: [&[f64]; 2],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let Part { range, forcing, oscillators, .. } = &mut self.parts[k];
        let other = other.unwrap_or(oscillators);
        force(other, forcing, t, &y[..self.n_body])?;
        let (s, s_dot) = (&y[range.clone()], &y_dot[range.clone()]);
        other.network().residual(s, s_dot, forcing, residual);
        Ok(())
    }

    /// Returns ÿ of the oscillators of network `k` from their equations.
    ///
    /// # Errors
    /// Returns an error if a recording does not cover `t`.
    pub fn accelerations(&mut self, k: usize, t: f64, y: &[f64]) -> Result<Vec<f64>, StepError> {
        let part = &mut self.parts[k];
        part.force(t, &y[..self.n_body])?;
        let network = part.oscillators.network();
        let n = network.n_states();
        let mut residual = vec![0.0; n];
        network.residual(&y[part.range.clone()], &vec![0.0; n], &part.forcing, &mut residual);
        Ok(residual[n / 2..].iter().map(|r| -r).collect())
    }

    /// Returns Ẏ and the largest residual of the body at zero derivatives. Ẏ contains the derivatives of the
    /// oscillators from F = 0, and zeros for the body. The residual is 0 if the body starts at rest without load.
    ///
    /// # Errors
    /// Returns the errors of the body's residual, and an error if a recording does not cover `t`.
    pub fn derivatives_at(&mut self, t: f64, y: &[f64]) -> Result<(Vec<f64>, f64), StepError> {
        let zero = vec![0.0; self.n_unknowns];
        let mut y_dot = vec![0.0; self.n_unknowns];
        self.residual(t, y, &zero, &mut y_dot)?;
        let (body, oscillators) = y_dot.split_at_mut(self.n_body);
        let imbalance = body.iter().fold(0.0, |max: f64, r| max.max(r.abs()));
        body.fill(0.0);
        oscillators.iter_mut().for_each(|r| *r = -*r);
        Ok((y_dot, imbalance))
    }
}

impl<B: Consistent> Consistent for CoupledDae<B> {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        let mut y = y.to_vec();
        let (mut y_dot, imbalance) = self.derivatives_at(t, &y)?;
        // A body at rest without load has zero derivatives already.
        if imbalance > 0.0 {
            let own = self.body_range();
            let [values, rates] = self.body.consistent(t, &y[own.clone()])?;
            y[own.clone()].copy_from_slice(&values);
            (y_dot, _) = self.derivatives_at(t, &y)?;
            y_dot[own].copy_from_slice(&rates);
        }
        Ok([y, y_dot])
    }
}

impl Part {
    /// Sets `forcing` to γ u for each direction.
    fn force(&mut self, t: f64, y: &[f64]) -> Result<(), StepError> {
        force(&self.oscillators, &mut self.forcing, t, y)
    }
}

/// Sets `forcing` to γ u for each direction of `oscillators`; `y` are the body's unknowns.
fn force(
    oscillators: &Oscillators,
    forcing: &mut [f64],
    t: f64,
    y: &[f64],
) -> Result<(), StepError> {
    let drive = oscillators.drive();
    for (c, source) in forcing.iter_mut().zip(oscillators.sources()) {
        let u = source
            .displacement(t, y)
            .ok_or_else(|| format!("the recorded motion does not cover t = {t} s"))
            .map_err(|message| StepError::Fatal(message.into()))?;
        *c = drive.forcing(u);
    }
    Ok(())
}

impl<B: Problem> Problem for CoupledDae<B> {
    fn n_unknowns(&self) -> usize {
        self.n_unknowns
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let n = self.n_body;
        let body = &y[..n];
        self.body.residual(t, body, &y_dot[..n], &mut residual[..n])?;
        for part in &mut self.parts {
            part.force(t, body)?;
            let own = part.range.clone();
            part.oscillators.network().residual(
                &y[own.clone()],
                &y_dot[own.clone()],
                &part.forcing,
                &mut residual[own],
            );
        }
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.blocks.pattern().clone()
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
        let n = self.n_body;
        self.body.jacobian(t, &y[..n], &y_dot[..n], a, b, &mut self.body_values)?;
        values.fill(0.0);
        self.blocks.add(0, 1.0, &self.body_values, values);
        for (k, part) in self.parts.iter_mut().enumerate() {
            let block = 1 + 2 * k;
            let network = part.oscillators.network();
            network.jacobian(&y[part.range.clone()], a, b, &mut part.jacobian);
            self.blocks.add(block, 1.0, &part.jacobian, values);
            self.blocks.add(block + 1, a, &part.coupling.values, values);
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = self.body.kinds()?;
        kinds.resize(self.n_unknowns, VariableKind::Differential);
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        let mut indices = self.body.indices()?;
        indices.resize(self.n_unknowns, 0);
        Some(indices)
    }

    fn component_name(&self, i: usize) -> String {
        let of_part = |(k, part): (usize, &Part)| {
            let within = i.checked_sub(part.range.start)?;
            let n = part.oscillators.network().n_oscillators();
            let name = if within < n { "y" } else { "dy/dt" };
            let number = within % n + 1;
            (within < 2 * n).then(|| format!("{name} of oscillator {number} in network {}", k + 1))
        };
        self.parts
            .iter()
            .enumerate()
            .find_map(of_part)
            .unwrap_or_else(|| self.body.component_name(i))
    }
}
