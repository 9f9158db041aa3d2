//! Comparison of solvers on one matrix.

use std::fmt;
use std::time::Instant;

use anyhow::Result;
use cpu_time::ProcessTime;
use myovib_sparse::{Kind, Precision, Scalar};
use serde::Serialize;

#[cfg(feature = "mumps")]
use crate::ffi::{Mumps, Rival};
use crate::memory::Count;
use crate::solid::Solid;
use crate::solver::{Ours, Solver};
#[cfg(not(feature = "mumps"))]
use myovib_sparse::Scalar as Rival;

/// Number of solves per factorization, a typical number for a step of Radau IIA. Our solver checks the first solution,
/// and refines solutions if the factors are in single precision.
const SOLVES: usize = 5;

/// Matrix on which solvers are compared.
pub struct Contest<'a> {
    pub name: &'static str,
    pub solid: &'a Solid,
    pub kind: Kind,
    pub repeats: usize,
}

/// Measurements for one matrix.
#[derive(Serialize)]
pub struct Outcome {
    case: &'static str,
    unknowns: usize,
    matrix: &'static str,
    ours: Cost,
    ours_in_two_threads: Cost,
    /// Cost of our solver with factors in single precision.
    ours_mixed: Cost,
    /// Speedup: wall-clock time with one thread divided by wall-clock time with two threads.
    speed_up: f64,
    mumps: Option<Cost>,
    /// Our cost relative to the cost of MUMPS, in double and in mixed precision.
    ratio: Option<Ratio>,
    mixed_ratio: Option<Ratio>,
}

/// Cost of one solver. Times (s) are the minimum over several runs.
#[derive(Serialize)]
struct Cost {
    factor: Time,
    /// First solve after a factorization.
    first_solve: Time,
    /// Further solves.
    solve: Time,
    /// Peak memory (bytes) of the process from the start of the analysis to the end of a solve, excluding the input
    /// matrix.
    peak_bytes: usize,
    peak_megabytes: f64,
    /// Memory (bytes) that the solver itself reports.
    own_bytes: usize,
    /// Number of entries of the factors.
    entries: usize,
    backward_error: f64,
}

#[derive(Serialize)]
struct Ratio {
    factor: f64,
    first_solve: f64,
    solve: f64,
    memory: f64,
}

impl Cost {
    /// Returns the ratios of this cost to another cost.
    fn relative_to(&self, other: &Self) -> Ratio {
        Ratio {
            factor: self.factor.cpu / other.factor.cpu,
            first_solve: self.first_solve.cpu / other.first_solve.cpu,
            solve: self.solve.cpu / other.solve.cpu,
            memory: self.peak_bytes as f64 / other.peak_bytes as f64,
        }
    }
}

#[derive(Clone, Copy, Serialize)]
struct Time {
    cpu: f64,
    wall: f64,
}

impl Time {
    const NONE: Self = Self { cpu: f64::INFINITY, wall: f64::INFINITY };

    /// Runs `work` and keeps the minimum times.
    fn least(&mut self, work: impl FnOnce() -> Result<()>) -> Result<()> {
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        work()?;
        self.cpu = self.cpu.min(cpu.elapsed().as_secs_f64());
        self.wall = self.wall.min(wall.elapsed().as_secs_f64());
        Ok(())
    }
}

/// Solver in the comparison.
struct Entrant<'a, T> {
    solver: Box<dyn Solver<T> + 'a>,
    cost: Cost,
}

impl<'a, T: Scalar> Entrant<'a, T> {
    /// Measures the memory of a first factorization and solve. Checks the solution.
    fn new<S: Solver<T> + 'a>(
        solid: &Solid,
        values: &[T],
        solver: impl FnOnce() -> Result<S>,
    ) -> Result<Self> {
        let b = rhs::<T>(solid);
        let mut x = b.clone();
        let count = Count::begin()?;
        let mut solver = solver()?;
        solver.factor()?;
        solver.solve(&mut x)?;
        let peak_bytes = count.peak()?;
        let cost = Cost {
            factor: Time::NONE,
            first_solve: Time::NONE,
            solve: Time::NONE,
            peak_bytes,
            peak_megabytes: peak_bytes as f64 / 1e6,
            own_bytes: solver.n_bytes(),
            entries: solver.n_entries(),
            backward_error: backward_error(solid, values, &b, &x),
        };
        let solver = Box::new(solver);
        Ok(Self { solver, cost })
    }

    fn factor(&mut self) -> Result<()> {
        self.cost.factor.least(|| self.solver.factor())
    }

    /// Solves for the `k`th time after a factorization.
    fn solve(&mut self, solid: &Solid, k: usize) -> Result<()> {
        let mut x = rhs::<T>(solid);
        let time = if k == 0 { &mut self.cost.first_solve } else { &mut self.cost.solve };
        time.least(|| self.solver.solve(&mut x))
    }
}

impl Contest<'_> {
    /// Measures all solvers on the matrix c² M + K.
    pub fn run<T: Rival>(&self, c: T) -> Result<Outcome> {
        let Self { solid, kind, .. } = *self;
        let values = &solid.values(c)[..];
        let ours = |precision, threads| {
            Entrant::new(solid, values, || Ours::new(solid, values, kind, (precision, threads)))
        };
        let mut entrants = vec![
            ours(Precision::Double, 1)?,
            ours(Precision::Double, 2)?,
            ours(Precision::Mixed, 1)?,
        ];
        #[cfg(feature = "mumps")]
        entrants
            .push(Entrant::new(solid, values, || Ok(Mumps::new(&solid.pattern, values, kind)))?);
        for _ in 0..self.repeats {
            for entrant in &mut entrants {
                entrant.factor()?;
            }
            for k in 0..SOLVES {
                for entrant in &mut entrants {
                    entrant.solve(solid, k)?;
                }
            }
        }
        let mut costs = entrants.into_iter().map(|entrant| entrant.cost);
        let mut next = || costs.next();
        let (Some(ours), Some(ours_in_two_threads), Some(ours_mixed), mumps) =
            (next(), next(), next(), next())
        else {
            unreachable!("three entrants are ours");
        };
        Ok(Outcome {
            case: self.name,
            unknowns: solid.pattern.major_dim(),
            matrix: match (kind, size_of::<T>() == size_of::<f64>()) {
                (Kind::Symmetric, true) => "real, symmetric",
                (Kind::Symmetric, false) => "complex, symmetric",
                (Kind::General, true) => "real",
                (Kind::General, false) => "complex",
            },
            speed_up: ours.factor.wall / ours_in_two_threads.factor.wall,
            ratio: mumps.as_ref().map(|mumps| ours.relative_to(mumps)),
            mixed_ratio: mumps.as_ref().map(|mumps| ours_mixed.relative_to(mumps)),
            ours,
            ours_in_two_threads,
            ours_mixed,
            mumps,
        })
    }
}

/// Returns a right-hand side whose entries have magnitude 1 in the unit of each equation.
fn rhs<T: Scalar>(solid: &Solid) -> Vec<T> {
    let n = solid.pattern.major_dim();
    (0..n).map(|i| T::one() * (i as f64).sin()).collect()
}

/// Returns max_i |b − A x|_i / (|A||x| + |b|)_i.
fn backward_error<T: Scalar>(solid: &Solid, values: &[T], b: &[T], x: &[T]) -> f64 {
    let mut residual = b.to_vec();
    let mut scale: Vec<f64> = b.iter().map(|b| b.abs()).collect();
    for ((column, row), &a) in solid.pattern.entries().zip(values) {
        residual[row] -= a * x[column];
        scale[row] += a.abs() * x[column].abs();
    }
    let ratios = residual.iter().zip(&scale).map(|(r, s)| r.abs() / s);
    ratios.fold(0.0, |max, ratio| if ratio.is_nan() { f64::INFINITY } else { f64::max(max, ratio) })
}

/// Heading of the printed table.
pub const HEAD: &str = "case  matrix              who      factor CPU s   wall s  first solve  solve CPU s   peak MB    own MB  10⁶ entries  backward error";

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = [
            ("ours", Some(&self.ours)),
            ("ours x 2", Some(&self.ours_in_two_threads)),
            ("mixed", Some(&self.ours_mixed)),
            ("MUMPS", self.mumps.as_ref()),
        ];
        for (who, cost) in all {
            let Some(cost) = cost else { continue };
            writeln!(
                f,
                "{:5} {:19} {who:8} {:12.3} {:8.3} {:12.4} {:12.4} {:9.0} {:9.0} {:12.2} {:15.1e}",
                self.case,
                self.matrix,
                cost.factor.cpu,
                cost.factor.wall,
                cost.first_solve.cpu,
                cost.solve.cpu,
                cost.peak_megabytes,
                cost.own_bytes as f64 / 1e6,
                cost.entries as f64 / 1e6,
                cost.backward_error,
            )?;
        }
        write!(f, "      in two threads {:.2} times as fast", self.speed_up)?;
        for (precision, ratio) in [("double", &self.ratio), ("mixed", &self.mixed_ratio)] {
            let Some(ratio) = ratio else { continue };
            write!(
                f,
                "; {precision} by MUMPS': factor {:.2}, first solve {:.2}, solve {:.2}, memory {:.2}",
                ratio.factor, ratio.first_solve, ratio.solve, ratio.memory
            )?;
        }
        Ok(())
    }
}
