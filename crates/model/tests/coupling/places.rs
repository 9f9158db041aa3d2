//! Chains at many places as one network: results and linear solver.

use myovib_dae::Problem;
use myovib_model::coupling::{CoupledDae, Oscillators, Source, StateTolerances};
use myovib_model::{Advance, Integrator, RodDae, paper};
use myovib_oscillators::{Chain, Coefficients, Detuning, Drive, Ends, Reach};

use crate::common::{rod_and_chain, start};

const GAIN: f64 = 4e3;

/// Returns the chain of five oscillators, repeated at this number of places.
fn chain(places: usize, omega: &[f64]) -> Chain {
    Chain {
        omega: omega.repeat(places),
        coefficients: Coefficients::default(),
        ends: Ends::Periodic,
        reach: Reach::All,
    }
}

fn omega() -> Vec<f64> {
    let detuning = Detuning { half_width: 0.5, ..Detuning::default() };
    detuning.frequencies(5).unwrap()
}

/// Returns the paper's rod with a chain at each of `points`.
fn at_points(points: &[f64]) -> CoupledDae<RodDae> {
    let rod = paper::rod().unwrap();
    let chain = chain(points.len(), &omega());
    let drive = Drive { gain: GAIN, reach: chain.reach };
    let sources = points.iter().map(|x| Source::Body(rod.displacement_at(*x).unwrap()));
    let network = chain.network_at(points.len()).unwrap();
    let oscillators = Oscillators::new(network, drive, sources.collect()).unwrap();
    CoupledDae::new(rod, vec![oscillators])
}

/// Extracts the positions and velocities of `place` from the states of `places` chains with `n` oscillators each.
fn of_place(states: &[f64], places: usize, place: usize) -> Vec<f64> {
    let half = states.len() / 2;
    let n = half / places;
    let own = place * n..(place + 1) * n;
    [&states[..half][own.clone()], &states[half..][own]].concat()
}

/// Returns the states of a single chain repeated at each of `places`.
fn repeated(states: &[f64], places: usize) -> Vec<f64> {
    let (y, w) = states.split_at(states.len() / 2);
    [y.repeat(places), w.repeat(places)].concat()
}

#[test]
fn places_with_the_same_drive_are_the_single_chain_bit_by_bit() {
    let places = 7;
    let mut many = at_points(&[paper::ROD_POINT; 7]);
    let mut single = rod_and_chain(&chain(1, &omega()), GAIN);
    let n = single.n_unknowns();
    let body = single.body_range().len();
    let wave = |size: f64| -> Vec<f64> { (0..n).map(|i| size * (1.7 * i as f64).sin()).collect() };
    let (y, y_dot) = (wave(0.3), wave(20.0));
    let mut residual = vec![0.0; n];
    single.residual(0.4, &y, &y_dot, &mut residual).unwrap();
    let repeat = |v: &[f64]| [&v[..body], &repeated(&v[body..], places)].concat();
    let mut of_many = vec![0.0; many.n_unknowns()];
    many.residual(0.4, &repeat(&y), &repeat(&y_dot), &mut of_many).unwrap();
    assert!(of_many == repeat(&residual));
    // Checks the derivative, too: the image of a repeated direction is repeated.
    let image = |dae: &mut CoupledDae<RodDae>, y: &[f64], y_dot: &[f64], x: &[f64]| {
        let pattern = dae.jacobian_pattern();
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.4, y, y_dot, 1.0, 300.0, &mut values).unwrap();
        let mut image = vec![0.0; x.len()];
        for ((column, row), value) in pattern.entries().zip(values) {
            image[row] += value * x[column];
        }
        image
    };
    let x = wave(1.0);
    let of_single = image(&mut single, &y, &y_dot, &x);
    let of_many = image(&mut many, &repeat(&y), &repeat(&y_dot), &repeat(&x));
    let scale = of_single.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for (many, single) in of_many.iter().zip(repeat(&of_single)) {
        // Rounding of sums in a different order.
        assert!((many - single).abs() < 1e-14 * scale, "{many} {single}");
    }
}

fn end_state(dae: CoupledDae<RodDae>, t_end: f64) -> (Vec<f64>, CoupledDae<RodDae>) {
    let y = vec![0.0; dae.n_unknowns()];
    let mut integrator = start(dae, StateTolerances::default(), t_end, &y);
    while !matches!(integrator.advance().unwrap(), Advance::Finished) {}
    let mut y = y;
    integrator.dense_output(t_end, 0, &mut y).unwrap();
    (y, integrator.problem().clone())
}

#[test]
fn each_location_moves_as_in_a_separate_run() {
    let points = [0.02, paper::ROD_POINT, 0.1, paper::ROD_POINT];
    let (y, dae) = end_state(at_points(&points), 2.0);
    let all = &y[dae.range(0)];
    let places: Vec<Vec<f64>> = (0..4).map(|place| of_place(all, 4, place)).collect();
    let distance = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b);
        pairs.fold(0.0, |max: f64, (a, b)| max.max((a - b).abs()))
    };
    // With the same drive, motions agree up to rounding, which the chains do not amplify in 2 s.
    assert!(distance(&places[1], &places[3]) < 1e-9);
    assert!(distance(&places[0], &places[2]) > 1e-3);
    for (place, x) in points.iter().enumerate() {
        let (y, dae) = end_state(at_points(&[*x]), 2.0);
        let own = &y[dae.range(0)];
        let largest = own.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        let error = distance(&places[place], own) / largest;
        // A hundred times the tolerance: the error that BDF accumulates in two runs over sixteen
        // turns.
        assert!(error < 1e-5, "{place}: {error:e}");
    }
}
