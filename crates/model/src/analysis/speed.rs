//! Speed of factorizations and solves on this machine, measured on a small body.

use std::sync::Arc;

use myovib_sparse::SparseOptions;
use myovib_sparse::{Elimination, Kind, LinearWork, Scalar, SparseError, SparseSystem, Structure};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::cpu::CpuClock;

/// Number of nodes per edge of the cube whose matrix is factorized. It is large enough for fronts as wide as in real
/// bodies, and small enough to factorize the matrix in a few tenths of a second.
const SIDE: usize = 13;
/// Unknowns per node.
const COMPONENTS: usize = 3;
const SOLVES: u32 = 4;

/// Work completed per second of CPU time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speed {
    /// Operations of a factorization, counted as in
    /// [`Prediction::flops`](myovib_sparse::Prediction::flops).
    pub(super) operations: f64,
    /// Number of factor entries that the solves process.
    pub(super) entries: f64,
}

impl Speed {
    /// Measures the speed for a real matrix, and also for a complex matrix if `with_complex` is set.
    pub(super) fn measure(with_complex: bool) -> Result<Self, SparseError> {
        let pattern = cube();
        let structure = Structure { kind: Kind::Symmetric, ..Structure::default() };
        let elimination = Elimination::new(&pattern, structure, SparseOptions::default())?;
        let elimination = Arc::new(elimination);
        let real = Timing::of::<f64>(&elimination, &pattern)?;
        let all = match with_complex {
            true => real.with(Timing::of::<Complex64>(&elimination, &pattern)?),
            false => real,
        };
        Ok(Self {
            operations: all.operations / all.factorizing,
            entries: all.entries / all.solving,
        })
    }
}

/// Amounts of work and the CPU times (s) that they take.
struct Timing {
    operations: f64,
    factorizing: f64,
    entries: f64,
    solving: f64,
}

impl Timing {
    fn of<T: Scalar>(
        elimination: &Arc<Elimination>,
        pattern: &SparsityPattern,
    ) -> Result<Self, SparseError> {
        let needs = elimination.prediction::<T>();
        let (operations, entries) =
            needs.map_or((f64::NAN, f64::NAN), |needs| (needs.flops, needs.entries as f64));
        let mut system = SparseSystem::<T>::new(elimination.clone());
        // The rows are diagonally dominant.
        let values = pattern.entries().map(|(column, row)| match column == row {
            true => T::one() * 100.0,
            false => -T::one(),
        });
        let values: Vec<T> = values.collect();
        system.values_mut().copy_from_slice(&values);
        let mut work = LinearWork::default();
        let mut x = vec![T::one(); pattern.major_dim()];
        // The first factorization allocates memory and checks its first solution, so it is not
        // timed.
        system.renew(&mut work)?;
        system.solve(&mut x, &mut work)?;
        let clock = CpuClock::start();
        for _ in 0..SOLVES {
            system.solve(&mut x, &mut work)?;
        }
        let solving = clock.elapsed().as_secs_f64() / f64::from(SOLVES);
        let clock = CpuClock::start();
        system.renew(&mut work)?;
        Ok(Self { operations, factorizing: clock.elapsed().as_secs_f64(), entries, solving })
    }

    fn with(self, other: Self) -> Self {
        Self {
            operations: self.operations + other.operations,
            factorizing: self.factorizing + other.factorizing,
            entries: self.entries + other.entries,
            solving: self.solving + other.solving,
        }
    }
}

/// Returns the pattern of a cube of nodes, each coupled to its 26 neighbors.
fn cube() -> SparsityPattern {
    let node = |[x, y, z]: [usize; 3]| (z * SIDE + y) * SIDE + x;
    let near = |k: usize| k.saturating_sub(1)..(k + 2).min(SIDE);
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for k in 0..SIDE.pow(3) {
        let [x, y, z] = [k % SIDE, k / SIDE % SIDE, k / SIDE.pow(2)];
        let plane = |z| near(y).flat_map(move |y| near(x).map(move |x| [x, y, z]));
        let neighbors: Vec<usize> = near(z).flat_map(plane).map(node).collect();
        for _ in 0..COMPONENTS {
            let own = neighbors.iter();
            rows.extend(own.flat_map(|n| (0..COMPONENTS).map(move |c| COMPONENTS * n + c)));
            offsets.push(rows.len());
        }
    }
    let n = offsets.len() - 1;
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
        .expect("neighbors are in order")
}
