//! Work of a response, counted by an engine that factorizes all matrices of this process.
#![allow(clippy::unwrap_used)] // a test may panic

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use myovib_scene::Scene;
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;
use myovib_sparse::engine::{self, Engine};
use myovib_sparse::pivoting::{Factors, Symbolic};
use myovib_sparse::{Factorization, Kind, Scalar, SparseError, SparseOptions};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

/// Numbers of symbolic analyses, factorizations and solves.
#[derive(Debug, Default)]
struct Counts([AtomicUsize; 3]);

impl Counts {
    fn add(&self, k: usize) {
        self.0[k].fetch_add(1, SeqCst);
    }

    fn take(&self) -> [usize; 3] {
        self.0.each_ref().map(|count| count.swap(0, SeqCst))
    }
}

/// Counts of real and of complex matrices.
#[derive(Debug, Default)]
struct Counting {
    real: Arc<Counts>,
    complex: Arc<Counts>,
}

#[derive(Debug)]
struct Counted<T: Scalar> {
    factors: Factors<T>,
    counts: Arc<Counts>,
}

impl<T: Scalar> Counted<T> {
    fn boxed(pattern: &SparsityPattern, counts: &Arc<Counts>) -> Box<dyn Factorization<T>>
    where
        Self: 'static,
    {
        counts.add(0);
        let symbolic = Symbolic::analyze(pattern, SparseOptions::default()).unwrap();
        Box::new(Self { factors: Factors::new(symbolic), counts: counts.clone() })
    }
}

impl<T: Scalar> Factorization<T> for Counted<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.counts.add(1);
        Factorization::renew(&mut self.factors, values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.counts.add(2);
        Factorization::solve(&mut self.factors, x)
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.counts.add(2);
        Factorization::solve_transposed(&mut self.factors, x)
    }

    fn n_entries(&self) -> Option<usize> {
        Factorization::n_entries(&self.factors)
    }
}

impl Engine for Counting {
    fn real(&self, pattern: &Arc<SparsityPattern>, _: Kind) -> Box<dyn Factorization<f64>> {
        Counted::boxed(pattern, &self.real)
    }

    fn complex(
        &self,
        pattern: &Arc<SparsityPattern>,
        _: Kind,
    ) -> Box<dyn Factorization<Complex64>> {
        Counted::boxed(pattern, &self.complex)
    }
}

/// A beam with peaks, with a ratio and a reaction as additional values.
const BEAM: &str = r#"analysis = "response"
[mesh]
type = "beam"
length = 0.1
height = 0.02
cells = [6, 2]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 5.0
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]
[[prescribed_displacement]]
group = "fixed"
x = 0.0
response = { y = 1e-4 }
[[traction]]
group = "load"
response = { y = 1.0 }
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.0]
quantities = ["u"]
[[probe]]
name = "clamp"
type = "reaction"
group = "fixed"
[[response.ratio]]
name = "impedance"
numerator = "clamp.R_y"
denominator = "tip.v_y"
[response]
frequencies = "1..60:adaptive"
"#;

/// Checks that the pattern is analyzed once for all frequencies, and that each frequency costs one factorization and one
/// solve. The modes of the peaks cost the same number of real factorizations and solves for any number of frequencies and
/// peaks.
#[test]
fn a_response_analyzes_once_and_factorizes_once_for_each_frequency() {
    let counting = Counting::default();
    let (real, complex) = (counting.real.clone(), counting.complex.clone());
    engine::install(Arc::new(counting));
    for kappa in ["1e5", "inf"] {
        for preload in ["", "0.0"] {
            let of_modes = ["1..60:2", "1..60:120", "1..60:adaptive"].map(|frequencies| {
                let set = [
                    format!("response.frequencies={frequencies}"),
                    format!("solid.bulk_modulus={kappa}"),
                    format!("response.preload_time={preload}"),
                ];
                let scene = Scene::build("scene.toml", BEAM, &set, Path::new("")).unwrap();
                let found = Response::of_scene(&scene, Watcher::NOBODY).unwrap();
                let n = found.frequencies.len();
                assert_eq!(complex.take(), [1, n, n], "{frequencies} {kappa} {preload}");
                let assigned = found.peaks.iter().filter(|peak| peak.mode.is_some()).count();
                assert_eq!(assigned > 0, n > 2, "{:?}", found.peaks);
                real.take()
            });
            assert_eq!(of_modes, [of_modes[0]; 3], "{kappa} {preload}");
        }
    }
}
