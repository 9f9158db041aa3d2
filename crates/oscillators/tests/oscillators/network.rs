//! Tests of the equations of chains and arrays: identities, edge cases and Jacobians.

use crate::common::{distance, jacobian, random, rhs};
use myovib_oscillators::{Array, Chain, Coefficients, Ends, Error, Network, Reach};
use nalgebra_sparse::CscMatrix;

const ALL_TERMS: Coefficients = Coefficients { vdp_mu: 2.0, duffing: 0.7, coupling: 3.0 };

fn chain(omega: &[f64], ends: Ends, reach: Reach) -> Network {
    chains(1, omega, ends, reach)
}

fn chains(places: usize, omega: &[f64], ends: Ends, reach: Reach) -> Network {
    let chain = Chain { omega: omega.to_vec(), coefficients: ALL_TERMS, ends, reach };
    chain.network_at(places).unwrap()
}

fn array(columns: usize, rows: usize, ends: Ends) -> Array {
    let omega = random(3, columns * rows).iter().map(|x| 50.0 + x).collect();
    Array { columns, rows, omega, coefficients: ALL_TERMS, ends, reach: Reach::Boundary }
}

/// Returns chains of all edge-case lengths, arrays, and networks of chains at several places.
fn networks() -> Vec<(String, Network)> {
    let mut all = Vec::new();
    for ends in [Ends::Periodic, Ends::Open] {
        for n in [1, 2, 3, 7] {
            let omega: Vec<f64> = random(n as u32, n).iter().map(|x| 50.0 + x).collect();
            all.push((format!("{ends:?} chain of {n}"), chain(&omega, ends, Reach::All)));
        }
        for (columns, rows) in [(1, 1), (2, 1), (3, 2), (4, 3)] {
            let network = array(columns, rows, ends).network().unwrap();
            all.push((format!("{ends:?} array {columns} × {rows}"), network));
        }
        let omega: Vec<f64> = random(9, 12).iter().map(|x| 50.0 + x).collect();
        let three = chains(3, &omega, ends, Reach::Boundary);
        all.push((format!("{ends:?} chains of 4 at 3 places"), three));
    }
    all
}

/// Evaluates the paper's equation from the printed formula, independently of the crate.
fn printed_acceleration(omega: &[f64], y: &[f64], w: &[f64], c: f64) -> Vec<f64> {
    let n = omega.len();
    (0..n)
        .map(|k| {
            let neighbors = 0.5 * (y[(k + 1) % n] + y[(k + n - 1) % n]);
            -(omega[k] * omega[k] * y[k] - 2.0 * (1.0 - y[k] * y[k]) * w[k]
                + 0.7 * y[k] * y[k] * y[k]
                - 3.0 * omega[k] * neighbors
                + c)
        })
        .collect()
}

#[test]
fn the_periodic_chain_is_the_printed_equation() {
    for n in [1, 2, 3, 20] {
        let omega: Vec<f64> = random(11, n).iter().map(|x| 50.0 + x).collect();
        let s = random(12, 2 * n);
        let s_dot = rhs(&chain(&omega, Ends::Periodic, Reach::All), &s, &[0.3]);
        assert_eq!(s_dot[..n], s[n..]);
        let expected = printed_acceleration(&omega, &s[..n], &s[n..], 0.3);
        // The error is the rounding of a sum of terms up to ω² ≈ 2600.
        assert!(distance(&s_dot[n..], &expected) < 8.0 * 2600.0 * f64::EPSILON, "N = {n}");
    }
}

#[test]
fn identical_oscillators_move_as_one() {
    let one = rhs(&chain(&[50.0], Ends::Periodic, Reach::All), &[0.4, -7.0], &[1.5]);
    for n in [2, 3, 20] {
        let s = [vec![0.4; n], vec![-7.0; n]].concat();
        let all = rhs(&chain(&vec![50.0; n], Ends::Periodic, Reach::All), &s, &[1.5]);
        // In every chain, the two coupling terms are subtracted one after the other.
        assert_eq!(all, [vec![one[0]; n], vec![one[1]; n]].concat(), "N = {n}");
    }
}

#[test]
fn open_ends_have_no_outer_coupling() {
    let (omega, s) = ([50.0; 4], random(5, 8));
    let periodic = rhs(&chain(&omega, Ends::Periodic, Reach::All), &s, &[0.0]);
    let open = rhs(&chain(&omega, Ends::Open, Reach::All), &s, &[0.0]);
    let lost = 0.5 * 3.0 * 50.0;
    let difference: Vec<f64> = periodic.iter().zip(&open).map(|(p, o)| p - o).collect();
    let expected = [0.0, 0.0, 0.0, 0.0, lost * s[3], 0.0, 0.0, lost * s[0]];
    assert!(distance(&difference, &expected) < 4.0 * 2600.0 * f64::EPSILON);
}

#[test]
fn the_forcing_acts_on_the_selected_oscillators() {
    let rows = |network: &Network, channel| network.forced_rows(channel).collect::<Vec<_>>();
    let omega = [50.0; 4];
    assert_eq!(rows(&chain(&omega, Ends::Periodic, Reach::All), 0), [4, 5, 6, 7]);
    assert_eq!(rows(&chain(&omega, Ends::Periodic, Reach::Boundary), 0), [4, 7]);
    assert_eq!(rows(&chain(&[50.0], Ends::Open, Reach::Boundary), 0), [1]);
    let network = array(3, 3, Ends::Open).network().unwrap();
    assert_eq!(rows(&network, 0), [18, 19, 20, 21, 23, 24, 25, 26]);
    assert_eq!(rows(&network, 1), [27, 28, 29, 30, 32, 33, 34, 35]);
}

#[test]
fn the_coupling_column_is_the_derivative_by_the_forcing() {
    for (name, network) in networks() {
        let s = random(8, network.n_states());
        let rest = vec![0.0; network.n_channels()];
        let base = rhs(&network, &s, &rest);
        for channel in 0..network.n_channels() {
            let mut forcing = rest.clone();
            forcing[channel] = 1.0;
            let forced = rhs(&network, &s, &forcing);
            let mut column = vec![0.0; network.n_states()];
            network.forced_rows(channel).for_each(|row| column[row] = 1.0);
            let difference: Vec<f64> = base.iter().zip(&forced).map(|(b, f)| b - f).collect();
            // F is affine in c, so the only error is the rounding of terms up to ω².
            assert!(distance(&difference, &column) < 8.0 * 2700.0 * f64::EPSILON, "{name}");
        }
    }
}

fn entry(matrix: &CscMatrix<f64>, row: usize, column: usize) -> f64 {
    matrix.get_entry(row, column).map_or(0.0, |entry| entry.into_value())
}

#[test]
fn the_jacobian_is_the_derivative_of_the_residual() {
    for (case, (name, network)) in networks().into_iter().enumerate() {
        let n = network.n_states();
        let seed = 100 * case as u32;
        let (s, s_dot) = (random(seed, n), random(seed + 1, n));
        let forcing = random(seed + 2, network.n_channels());
        let (a, b) = (random(seed + 3, 1)[0], 40.0 * random(seed + 4, 1)[0]);
        let jacobian = jacobian(&network, &s, a, b);

        // Central differences along s + a h e, ṡ + b h e. F is cubic, so their truncation error is h² |F'''|/6,
        // where F''' is of order a³ 2μ ≈ 4. The rounding error is ω² ε/h ≈ 6e-13/h. The step h = 1e-4 balances the
        // two errors.
        let h = 1e-4;
        for column in 0..n {
            let at = |sign: f64| {
                let (mut s, mut s_dot) = (s.clone(), s_dot.clone());
                s[column] += sign * a * h;
                s_dot[column] += sign * b * h;
                let mut residual = vec![0.0; n];
                network.residual(&s, &s_dot, &forcing, &mut residual);
                residual
            };
            let (plus, minus) = (at(1.0), at(-1.0));
            for row in 0..n {
                let slope = (plus[row] - minus[row]) / (2.0 * h);
                let entry = entry(&jacobian, row, column);
                assert!(
                    (entry - slope).abs() < 1e-7,
                    "{name}: ({row}, {column}) is {entry}, difference {slope}"
                );
            }
        }
    }
}

#[test]
fn stiffness_and_damping_are_the_jacobian_of_the_momentum_rows() {
    for (case, (name, network)) in networks().into_iter().enumerate() {
        let (n, states) = (network.n_oscillators(), network.n_states());
        let s = random(1000 + case as u32, states);
        let jacobian = jacobian(&network, &s, 1.0, 0.0);
        let pattern = network.stiffness_pattern().clone();
        let (mut stiffness, mut damping) = (vec![f64::NAN; pattern.nnz()], vec![f64::NAN; n]);
        network.linearize(&s, &mut stiffness, &mut damping);
        let diagonal: Vec<f64> = network.stiffness_diagonal().map(|k| stiffness[k]).collect();
        let stiffness = CscMatrix::try_from_pattern_and_values(pattern, stiffness).unwrap();
        for (column, &on_diagonal) in diagonal.iter().enumerate() {
            assert_eq!(on_diagonal, entry(&stiffness, column, column), "{name}");
            for (row, &damping) in damping.iter().enumerate() {
                let expected = entry(&jacobian, n + row, column);
                assert_eq!(entry(&stiffness, row, column), expected, "{name}");
                let of_velocity = if row == column { damping } else { 0.0 };
                let expected = entry(&jacobian, n + row, n + column);
                assert_eq!(of_velocity, expected, "{name}");
            }
        }
    }
}

#[test]
fn each_oscillator_depends_on_one_component_of_the_forcing() {
    for (name, network) in networks() {
        let n = network.n_oscillators();
        let mut all: Vec<usize> = Vec::new();
        for channel in 0..network.n_channels() {
            let own = network.reached(channel);
            let forced: Vec<usize> = network.forced_rows(channel).collect();
            assert!(forced.iter().all(|row| own.contains(&(row - n))), "{name}");
            for column in own.clone() {
                let pulled = network.stiffness_pattern().lane(column);
                assert!(pulled.iter().all(|row| own.contains(row)), "{name}");
            }
            all.extend(own);
        }
        assert_eq!(all, Vec::from_iter(0..n), "{name}");
    }
}

#[test]
fn an_open_single_row_is_the_open_chain_in_each_direction() {
    let n = 5;
    let omega: Vec<f64> = random(21, n).iter().map(|x| 50.0 + x).collect();
    let array = Array {
        columns: n,
        rows: 1,
        omega: omega.clone(),
        coefficients: ALL_TERMS,
        ends: Ends::Open,
        reach: Reach::All,
    };
    let s = random(22, 4 * n);
    let plane = rhs(&array.network().unwrap(), &s, &[0.2, -0.4]);
    let line = chain(&omega, Ends::Open, Reach::All);
    for (direction, c) in [0.2, -0.4].into_iter().enumerate() {
        let y = array.direction(direction);
        let w = y.start + 2 * n..y.end + 2 * n;
        let part = [&s[y.clone()], &s[w.clone()]].concat();
        let expected = rhs(&line, &part, &[c]);
        assert_eq!([&plane[y], &plane[w]].concat(), expected);
    }
}

#[test]
fn an_array_couples_along_both_axes() {
    // Oscillator (1, 1) of a 3 × 3 array, displaced by 1, acts with D_n/2 on its four neighbors.
    let array = Array { omega: vec![50.0; 9], ..array(3, 3, Ends::Open) };
    let network = array.network().unwrap();
    let mut s = vec![0.0; 36];
    s[4] = 1.0;
    let acceleration = &rhs(&network, &s, &[0.0, 0.0])[18..27];
    let pull = 0.5 * 3.0 * 50.0;
    let own = -(2500.0 + 0.7);
    let expected = [0.0, pull, 0.0, pull, own, pull, 0.0, pull, 0.0];
    assert_eq!(acceleration, expected);
}

#[test]
fn a_periodic_array_moves_as_one_under_both_axes() {
    let array = Array { omega: vec![50.0; 12], reach: Reach::All, ..array(4, 3, Ends::Periodic) };
    let (y, w, c) = ([0.4, -0.2], [-7.0, 3.0], [1.5, 0.25]);
    let spread = |x: [f64; 2]| x.map(|x| [x; 12]).concat();
    let moved = rhs(&array.network().unwrap(), &[spread(y), spread(w)].concat(), &c);
    for direction in 0..2 {
        // Each axis has two couplings of D_n/2, which is equivalent to one oscillator with twice the coupling.
        let coefficients = Coefficients { coupling: 6.0, ..ALL_TERMS };
        let (omega, ends, reach) = (vec![50.0], Ends::Periodic, Reach::All);
        let one = Chain { omega, coefficients, ends, reach }.network().unwrap();
        let expected = rhs(&one, &[y[direction], w[direction]], &[c[direction]])[1];
        for oscillator in array.direction(direction) {
            let error = moved[24 + oscillator] - expected;
            assert!(error.abs() < 8.0 * 2600.0 * f64::EPSILON, "{direction} {oscillator}");
        }
    }
}

#[test]
fn invalid_descriptions_are_rejected() {
    let build = |omega: Vec<f64>, coefficients| {
        Chain { omega, coefficients, ends: Ends::Open, reach: Reach::All }.network().unwrap_err()
    };
    assert_eq!(build(vec![], ALL_TERMS), Error::NoOscillators);
    for value in [-1.0, 0.0] {
        let refused = build(vec![50.0, value], ALL_TERMS);
        assert_eq!(refused, Error::Frequency { number: 2, value });
    }
    let infinite = Coefficients { coupling: f64::INFINITY, ..ALL_TERMS };
    let value = f64::INFINITY;
    assert_eq!(build(vec![50.0], infinite), Error::Coefficient { name: "coupling", value });
    let few = Array { omega: vec![50.0; 5], ..array(3, 2, Ends::Open) };
    assert_eq!(
        few.network().unwrap_err(),
        Error::ArrayFrequencies { columns: 3, rows: 2, given: 5 }
    );
}
