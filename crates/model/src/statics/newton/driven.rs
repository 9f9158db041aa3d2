//! Obstacles that follow a force: one unknown displacement each, eliminated from the linear system.

use myovib_sparse::{LinearWork, SparseError, SparseSystem};

use super::Newton;
use crate::muscle::Muscle;

/// Equations F_k(u, s_k) = force of driven obstacles, linearized. With c = ∂F/∂u and the force on the body −c with respect
/// to s, elimination of s subtracts c cᵀ/(∂F/∂s) from the matrix, one obstacle after the other (Sherman and Morrison).
#[derive(Debug, Default)]
pub(super) struct DrivenObstacles {
    obstacles: Vec<Driven>,
}

#[derive(Debug)]
struct Driven {
    /// c for the free displacement components.
    by_nodes: Vec<f64>,
    /// ∂F/∂s; positive.
    by_obstacle: f64,
    /// Solution of the linear system for c, with the earlier obstacles released.
    response: Vec<f64>,
    /// ∂F/∂s minus cᵀ times the response.
    pivot: f64,
}

impl Newton<'_> {
    /// Factorizes the matrix of the last [`tangent`](Self::tangent).
    pub(in crate::statics) fn factorize(&mut self) -> Result<(), SparseError> {
        self.system.renew(&mut self.work)?;
        let n = self.layout.n_unknowns();
        self.driven.factorize((&mut self.system, n), &mut self.work)
    }

    /// Solves with the factors of the last [`factorize`](Self::factorize), with obstacles that follow their forces.
    pub(in crate::statics) fn solve_linear(&mut self, b: &mut [f64]) -> Result<(), SparseError> {
        self.system.solve(b, &mut self.work)?;
        self.driven.correct(b);
        Ok(())
    }
}

impl DrivenObstacles {
    /// Evaluates the derivatives at the displacement `u` of all nodes, under a `part` of the loads at time `t`. Obstacles that
    /// do not press have none.
    pub(super) fn update(&mut self, muscle: &Muscle, (t, part): (f64, f64), u: &[f64]) {
        self.obstacles.clear();
        let free = muscle.solid.dofs().free_to_full();
        for contact in &muscle.contacts {
            let Some((slope, _)) = contact.driven_slope(t, part, u) else {
                continue;
            };
            self.obstacles.push(Driven {
                by_nodes: free.iter().map(|&i| slope.by_nodes[i]).collect(),
                by_obstacle: slope.by_obstacle,
                response: Vec::new(),
                pivot: 0.0,
            });
        }
    }

    /// Prepares [`correct`](Self::correct) after a factorization of `system` of `n` unknowns.
    pub(super) fn factorize(
        &mut self,
        (system, n): (&mut SparseSystem<f64>, usize),
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        for k in 0..self.obstacles.len() {
            let (before, rest) = self.obstacles.split_at_mut(k);
            let own = &mut rest[0];
            own.response = own.by_nodes.clone();
            own.response.resize(n, 0.0);
            system.solve(&mut own.response, work)?;
            before
                .iter()
                .for_each(|other| other.correct(&mut own.response));
            own.pivot = own.by_obstacle - dot(&own.by_nodes, &own.response);
            // The difference is rounding, or NaN.
            if own.pivot.is_nan() || own.pivot.abs() <= 16.0 * f64::EPSILON * own.by_obstacle {
                return Err(SparseError::Singular {
                    n: n + 1,
                    column: None,
                });
            }
        }
        Ok(())
    }

    /// Turns the solution `x` for obstacles at rest into the solution for obstacles that follow their forces.
    pub(super) fn correct(&self, x: &mut [f64]) {
        self.obstacles.iter().for_each(|own| own.correct(x));
    }

    /// Returns the number of negative pivots.
    pub(super) fn negative_pivots(&self) -> usize {
        let pivots = self.obstacles.iter().map(|own| own.pivot);
        pivots.filter(|pivot| *pivot < 0.0).count()
    }
}

/// Adds the derivative of the forces of driven obstacles with respect to the load factor to `change`, whose first entries are
/// the free displacement components, at the displacement `u` of all nodes under a `part` of the loads at time `t`.
pub(super) fn add_load(muscle: &Muscle, (t, part): (f64, f64), u: &[f64], change: &mut [f64]) {
    let free = muscle.solid.dofs().free_to_full();
    for contact in &muscle.contacts {
        let Some((slope, force)) = contact.driven_slope(t, part, u) else {
            continue;
        };
        let moved = force / slope.by_obstacle;
        for (change, &i) in change.iter_mut().zip(free) {
            *change -= moved * slope.by_nodes[i];
        }
    }
}

impl Driven {
    fn correct(&self, x: &mut [f64]) {
        let factor = dot(&self.by_nodes, x) / self.pivot;
        for (x, response) in x.iter_mut().zip(&self.response) {
            *x += factor * response;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
