//! Generated DAEs with closed-form solutions in random units, integrated by all methods. The tests check the errors at
//! the ends of steps and between them, and the times of events.

use myovib_dae::{
    Direction, Integrator, Outcome, Problem, StepError, Suppressed, Tolerances, VariableKind,
};
use myovib_radau::{RadauOptions, RadauSolver};
use sundials_wrap::{IdaOptions, IdaSolver};

use VariableKind::{Algebraic, Differential};

type Residual = Box<dyn Fn(f64, &[f64], &[f64], &mut [f64])>;
type Solution = Box<dyn Fn(f64) -> [Vec<f64>; 2]>;

/// A DAE with dimensionless variables x as functions of the time τ.
struct Plain {
    kinds: Vec<VariableKind>,
    indices: Vec<u8>,
    residual: Residual,
    /// x and its derivative, which is set to 0 for algebraic variables.
    exact: Solution,
    end: f64,
}

/// Pseudorandom parameters between 0 and 1, determined by a seed.
struct Draw(u64);

impl Draw {
    /// Returns number k of an additive recurrence.
    fn get(&self, k: u64) -> f64 {
        (self.0 as f64 * 0.618_033_988_749_894_9 + k as f64 * 0.414_213_562_373_095_1).fract()
    }

    fn between(&self, k: u64, low: f64, high: f64) -> f64 {
        low + (high - low) * self.get(k)
    }
}

/// The equations (ẋ³ + ẋ) + λ (x − g) = ġ³ + ġ and z + z³ = cos x + cos³ x with g = a + b sin ωτ.
fn fully_implicit(draw: &Draw) -> Plain {
    let (a, b) = (draw.between(0, -1.0, 1.0), draw.between(1, 0.3, 1.0));
    let (omega, lambda) = (draw.between(2, 1.0, 4.0), draw.between(3, 0.0, 3.0));
    let g = move |t: f64| [a + b * (omega * t).sin(), b * omega * (omega * t).cos()];
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |t, x, v, r| {
            let [at, rate] = g(t);
            let cos = x[0].cos();
            r[0] = v[0].powi(3) + v[0] - rate.powi(3) - rate + lambda * (x[0] - at);
            r[1] = x[1] + x[1].powi(3) - cos - cos.powi(3);
        }),
        exact: Box::new(move |t| {
            let [at, rate] = g(t);
            [vec![at, at.cos()], vec![rate, 0.0]]
        }),
        end: 3.0,
    }
}

/// The equations ẋ = −k z and z² = x of a tank that is nearly empty at the end.
fn tank(draw: &Draw) -> Plain {
    let (k, level) = (draw.between(0, 0.5, 2.0), draw.between(1, 0.5, 2.0));
    let root = move |t: f64| level.sqrt() - 0.5 * k * t;
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |_, x, v, r| {
            r[0] = v[0] + k * x[1];
            r[1] = x[1] - x[0].max(0.0).sqrt();
        }),
        exact: Box::new(move |t| [vec![root(t).powi(2), root(t)], vec![-k * root(t), 0.0]]),
        end: 0.9 * 2.0 * level.sqrt() / k,
    }
}

/// The equation 2 x ẋ + x² = 1, in which ẋ is large for small x.
fn steep(draw: &Draw) -> Plain {
    let start = 10.0_f64.powf(draw.between(0, -3.0, -1.0));
    let x = move |t: f64| (1.0 - (1.0 - start * start) * (-t).exp()).sqrt();
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |_, x, v, r| {
            r[0] = 2.0 * x[0] * v[0] + x[0] * x[0] - 1.0;
            r[1] = x[1] - x[0] * x[0];
        }),
        exact: Box::new(move |t| {
            let x = x(t);
            [vec![x, x * x], vec![(1.0 - x * x) / (2.0 * x), 0.0]]
        }),
        end: 2.0,
    }
}

/// The equation ẋ = s − x − z with the current z = k max(0, x − c) of a diode. The initial charge is zero.
fn diode(draw: &Draw) -> Plain {
    let (s, k) = (draw.between(0, 1.5, 4.0), draw.between(1, 1.0, 50.0));
    let c = 0.7;
    let crossing = (s / (s - c)).ln();
    let (rate, limit) = (1.0 + k, (s + k * c) / (1.0 + k));
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |_, x, v, r| {
            r[0] = v[0] - s + x[0] + x[1];
            r[1] = x[1] - k * (x[0] - c).max(0.0);
        }),
        exact: Box::new(move |t| {
            let x = match t < crossing {
                true => s * (1.0 - (-t).exp()),
                false => limit + (c - limit) * (-rate * (t - crossing)).exp(),
            };
            let z = k * (x - c).max(0.0);
            [vec![x, z], vec![s - x - z, 0.0]]
        }),
        end: 3.0,
    }
}

/// The equations ẋ + x = v(τ) and z = v − x, in which the voltage v rises from 0 to 1 between two times.
fn ramp(draw: &Draw) -> Plain {
    let (from, time) = (draw.between(0, 0.5, 1.5), draw.between(1, 0.1, 1.0));
    let to = from + time;
    let v = move |t: f64| ((t - from) / time).clamp(0.0, 1.0);
    // Response to the ramp τ/time from x = 0.
    let response = move |t: f64| (t.max(0.0) - (1.0 - (-t.max(0.0)).exp())) / time;
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |t, x, x_dot, r| {
            r[0] = x_dot[0] - x[1];
            r[1] = x[1] - v(t) + x[0];
        }),
        exact: Box::new(move |t| {
            let x = response(t - from) - response(t - to);
            [vec![x, v(t) - x], vec![v(t) - x, 0.0]]
        }),
        end: 3.0,
    }
}

/// The stiff equation ẋ = −λ (x − cos ωτ) − ω sin ωτ with a large λ, and z = x².
fn stiff(draw: &Draw) -> Plain {
    let lambda = 10.0_f64.powf(draw.between(0, 2.0, 8.0));
    let omega = draw.between(1, 0.5, 3.0);
    Plain {
        kinds: vec![Differential, Algebraic],
        indices: vec![1, 1],
        residual: Box::new(move |t, x, v, r| {
            let (sin, cos) = (omega * t).sin_cos();
            r[0] = (v[0] + omega * sin) / lambda + x[0] - cos;
            r[1] = x[1] - x[0] * x[0];
        }),
        exact: Box::new(move |t| {
            let (sin, cos) = (omega * t).sin_cos();
            [vec![cos, cos * cos], vec![-omega * sin, 0.0]]
        }),
        end: 5.0,
    }
}

/// The equations ẋ = z − x and ẏ = x − k y with the constraint x = g of index 2, where g = 2 + sin ωτ.
fn servo(draw: &Draw) -> Plain {
    let (omega, k) = (draw.between(0, 1.0, 4.0), draw.between(1, 0.5, 3.0));
    let size = k * k + omega * omega;
    Plain {
        kinds: vec![Differential, Differential, Algebraic],
        indices: vec![1, 1, 2],
        residual: Box::new(move |t, x, v, r| {
            r[0] = v[0] - x[2] + x[0];
            r[1] = v[1] - x[0] + k * x[1];
            r[2] = x[0] - 2.0 - (omega * t).sin();
        }),
        exact: Box::new(move |t| {
            let (sin, cos) = (omega * t).sin_cos();
            let (x, rate) = (2.0 + sin, omega * cos);
            let y = 2.0 / k + (k * sin - omega * cos) / size;
            [vec![x, y, x + rate], vec![rate, x - k * y, 0.0]]
        }),
        end: 3.0,
    }
}

/// The equations q̇ = v, v̇ = λ − q with the constraint q = sin ωτ of index 3.
fn guided(draw: &Draw) -> Plain {
    let omega = draw.between(0, 1.0, 4.0);
    Plain {
        kinds: vec![Differential, Differential, Algebraic],
        indices: vec![1, 2, 3],
        residual: Box::new(move |t, x, v, r| {
            r[0] = v[0] - x[1];
            r[1] = v[1] - x[2] + x[0];
            r[2] = x[0] - (omega * t).sin();
        }),
        exact: Box::new(move |t| {
            let (sin, cos) = (omega * t).sin_cos();
            let (v, a) = (omega * cos, -omega * omega * sin);
            [vec![sin, v, a + sin], vec![v, a, 0.0]]
        }),
        end: 2.0,
    }
}

type Family = fn(&Draw) -> Plain;

const FAMILIES: [(&str, Family); 8] = [
    ("fully implicit", fully_implicit),
    ("tank", tank),
    ("steep", steep),
    ("diode", diode),
    ("ramp", ramp),
    ("stiff", stiff),
    ("servo", servo),
    ("guided", guided),
];

/// A DAE converted to random units of time, variables and equations.
struct Generated {
    plain: Plain,
    time: f64,
    units: Vec<f64>,
    rows: Vec<f64>,
}

impl Generated {
    fn new(family: Family, seed: u64) -> Self {
        let draw = Draw(seed);
        let plain = family(&draw);
        let n = plain.kinds.len() as u64;
        let unit = |k| 10.0_f64.powi(draw.between(k, -12.0, 12.0).round() as i32);
        Self {
            plain,
            time: unit(10),
            units: (0..n).map(|k| unit(20 + k)).collect(),
            rows: (0..n).map(|k| unit(30 + k)).collect(),
        }
    }

    fn end(&self) -> f64 {
        self.plain.end * self.time
    }

    /// Returns y and ẏ at t.
    fn exact(&self, t: f64) -> [Vec<f64>; 2] {
        let [x, rate] = (self.plain.exact)(t / self.time);
        let scaled = |x: Vec<f64>, unit: f64| -> Vec<f64> {
            x.iter().zip(&self.units).map(|(x, u)| x * u / unit).collect()
        };
        [scaled(x, 1.0), scaled(rate, self.time)]
    }

    fn tolerances(&self, tolerance: f64) -> Tolerances {
        Tolerances::Vector {
            relative: tolerance,
            absolute: self.units.iter().map(|unit| unit * tolerance).collect(),
        }
    }

    /// Event function that remains at zero after 0.6 of the end time.
    fn event(&self, t: f64, y: &[f64]) -> f64 {
        let x = y[0] / self.units[0];
        (0.6 * self.end() - t).max(0.0) / self.time * (1.0 + x * x)
    }
}

impl Problem for Generated {
    fn n_unknowns(&self) -> usize {
        self.units.len()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let plain: Vec<f64> = y.iter().zip(&self.units).map(|(y, u)| y / u).collect();
        let rates = v.iter().zip(&self.units).map(|(v, u)| v / u * self.time);
        let rates: Vec<f64> = rates.collect();
        (self.plain.residual)(t / self.time, &plain, &rates, r);
        r.iter_mut().zip(&self.rows).for_each(|(r, row)| *r *= row);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(self.plain.kinds.clone())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(self.plain.indices.clone())
    }
}

/// Returns the largest error of a variable at and between the ends of steps, in units of the tolerance, or the message
/// of a stop. Variables with an index above `highest` are not compared. Multipliers of index 3 are compared only at the
/// ends of steps, because the error of their dense output is not controlled.
fn largest_error<I: Integrator<Generated>>(
    mut solver: I,
    exact: &Generated,
    (tolerance, highest): (f64, u8),
) -> Result<f64, String> {
    let n = exact.units.len();
    let (mut y, mut largest) = (vec![0.0; n], 0.0_f64);
    solver.set_stop_time(exact.end()).map_err(|e| e.to_string())?;
    let mut events = 0;
    for _ in 0..20_000 {
        let outcome = solver.step(exact.end()).map_err(|e| e.to_string())?;
        if let Outcome::Stopped(stop) = outcome {
            return Err(stop.to_string());
        }
        if let Outcome::Root { t, .. } = outcome {
            events += 1;
            // The search for roots ends at a few hundred rounding errors of the time.
            if (t / exact.end() - 0.6).abs() > 1e-12 {
                return Err(format!("event at {t:e} instead of {:e}", 0.6 * exact.end()));
            }
            continue;
        }
        let [from, to] = solver.last_step_interval();
        for theta in [0.05, 0.4, 0.83, 1.0] {
            let t = if theta == 1.0 { to } else { from + theta * (to - from) };
            solver.dense_output(t, 0, &mut y).map_err(|e| e.to_string())?;
            let [solution, _] = exact.exact(t);
            let highest = if theta < 1.0 { highest.min(2) } else { highest };
            for i in (0..n).filter(|&i| exact.plain.indices[i] <= highest) {
                // Constraints amplify rounding errors by a power of the ratio of the time scale to the step size.
                let amplified =
                    (exact.time / (to - from)).powi(i32::from(exact.plain.indices[i]) - 1);
                let relative = tolerance + f64::EPSILON * amplified.max(1.0);
                let allowed = relative * (exact.units[i] + solution[i].abs());
                let error = (y[i] - solution[i]).abs() / allowed;
                // A NaN is treated as larger than every bound.
                largest = if error > largest || error.is_nan() { error } else { largest };
            }
        }
        if matches!(outcome, Outcome::StopTime { .. }) {
            return match events {
                1 => Ok(largest),
                _ => Err(format!("{events} events")),
            };
        }
    }
    Err("20000 steps".to_owned())
}

/// Numbers of stages of Radau IIA; 0 denotes BDF.
const METHODS: [usize; 4] = [0, 3, 5, 7];

fn run(make: impl Fn() -> Generated, stages: usize, tolerance: f64) -> Result<f64, String> {
    let exact = make();
    let [y, y_dot] = exact.exact(0.0);
    let tolerances = exact.tolerances(tolerance);
    if stages == 0 {
        let options = IdaOptions {
            tolerances,
            suppressed: Suppressed::Components(
                exact.plain.indices.iter().map(|&k| k > 1).collect(),
            ),
            max_steps: None,
            ..IdaOptions::default()
        };
        let builder = IdaSolver::builder(make()).options(options);
        let builder = builder.roots([Direction::Both], |p: &mut Generated, t, y, _, g| {
            g[0] = p.event(t, y);
            Ok(())
        });
        let solver = builder.build(0.0, &y, &y_dot).map_err(|e| e.to_string())?;
        return largest_error(solver, &exact, (tolerance, 1));
    }
    let options =
        RadauOptions { stages, tolerances, dense_output: true, ..RadauOptions::default() };
    let builder = RadauSolver::builder(make()).options(options);
    let builder = builder.roots([Direction::Both], |p: &mut Generated, t, y, _, g| {
        g[0] = p.event(t, y);
        Ok(())
    });
    let solver = builder.build(0.0, &y, &y_dot).map_err(|e| e.to_string())?;
    largest_error(solver, &exact, (tolerance, 3))
}

/// Maximum error of a successful run, in units of the error stated in the manual.
const EXCESS: f64 = 20.0;

/// Returns the error stated in the manual for the given number of stages, in units of the tolerance.
fn promised(stages: usize) -> f64 {
    if stages == 0 { 1000.0 } else { 100.0 }
}

/// Checks the errors of successful runs. At most one run in 20 may stop. Two reasons for stops are known: Newton's
/// method does not converge for index 2 with a time unit of 1e12, and for the cubic equation, Radau IIA of order 13
/// attributes the change of ẏ to another root.
#[test]
fn generated_equations_are_solved_accurately() {
    let (mut wrong, mut stops, mut runs) = (Vec::new(), Vec::new(), 0);
    for (name, family) in FAMILIES {
        for seed in 0..6 {
            let make = || Generated::new(family, seed);
            let is_of_index_3 = make().plain.indices.contains(&3);
            for stages in METHODS {
                if stages == 0 && is_of_index_3 {
                    // In this case, the manual recommends Radau IIA.
                    continue;
                }
                for tolerance in [1e-4, 1e-6, 1e-8] {
                    let id = format!("{name} {seed}, {stages} stages, {tolerance:e}");
                    runs += 1;
                    match run(make, stages, tolerance) {
                        Ok(error) if error <= EXCESS * promised(stages) => {}
                        Ok(error) => wrong.push(format!("{id}: {error:.1e}")),
                        Err(stop) => stops.push(format!("{id}: {stop}")),
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(20 * stops.len() <= runs, "{} of {runs}: {stops:#?}", stops.len());
}
