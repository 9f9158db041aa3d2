//! Test problems from the literature, with initial values and exact solutions.
//!
//! Each problem is a [`Sample`]: a [`Problem`] with consistent initial values and, if it is known in closed form, the
//! exact solution. For the other problems, `data/references/` in the repository contains reference values and their
//! origin.
//!
//! | problem | index | unknowns | kind |
//! |---|---|---|---|
//! | [`Robertson`] | 1 | 3 | very stiff kinetics, KLU example of SUNDIALS |
//! | [`Akzo`] | 1 | 6 | chemical kinetics, mildly stiff |
//! | [`Heat2d`] | 1 | m² | parabolic equation with algebraic boundary, sparse |
//! | [`LinearIndex1`] | 1 | 2 | linear, varying in time, exact |
//! | [`JayIndex2`] | 2 | 3 | nonlinear, exact |
//! | [`Oscillator`] | 0 | 2 | linear, with a parameter, exact |
//! | [`ScaledLinear`] | 1 | 2 | linear, with two parameters, exact |
//! | [`ScaledJay`] | 2 | 3 | Jay's system with two parameters, exact |
//! | [`Pendulum`] | 1 to 3 | 5 or 6 | constrained mechanics, exact |
//! | [`CarAxis`] | 1 to 3 | 10 or 12 | constrained mechanics, stiff springs |
//! | [`VanDerPol`] | 0 | 2 | relaxation oscillation, an ordinary differential equation |

mod akzo;
mod altered;
mod car_axis;
mod circuits;
mod driven;
mod dual;
mod equations;
mod exact;
mod heat2d;
mod mechanism;
mod parametric;
mod pendulum;
mod pipes;
mod planar;
mod robertson;
mod spatial;
mod switching;
mod van_der_pol;

pub use akzo::Akzo;
pub use altered::Altered;
pub use car_axis::CarAxis;
pub use circuits::{Amplifier, CapacitorLoop, Doubler, TwoStageAmplifier};
pub use driven::{Pulses, TimeScales};
pub use dual::{Differentiable, Dual};
pub use equations::{Differentiated, Equations};
pub use exact::{JayIndex2, LinearIndex1};
pub use heat2d::Heat2d;
pub use mechanism::{Constrained, Mechanism};
pub use parametric::{Oscillator, ScaledJay, ScaledLinear};
pub use pendulum::Pendulum;
pub use pipes::Pipes;
pub use planar::{FourBar, Press, SliderCrank};
pub use robertson::Robertson;
pub use spatial::{Charges, Skate, SphericalPendulums};
pub use switching::{Bridge, Inverters, Pump};
pub use van_der_pol::VanDerPol;

use myovib_dae::Problem;
use myovib_dae::{Differenced, Parameter};

/// Consistent initial values.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Initial time.
    pub t: f64,
    /// Initial values y(t).
    pub y: Vec<f64>,
    /// Initial derivatives ẏ(t).
    pub y_dot: Vec<f64>,
}

/// Problem with consistent initial values and, optionally, an exact solution.
pub trait Sample: Problem {
    /// Returns consistent initial values.
    fn start(&self) -> Start;

    /// Returns the exact solution y(t), if it is known in closed form.
    fn exact(&self, _t: f64) -> Option<Vec<f64>> {
        None
    }
}

/// Sample that depends on parameters and whose sensitivities are known in closed form.
pub trait ParametricSample: Sample {
    /// Returns the parameters.
    fn parameters(&self) -> Vec<Parameter>;

    /// Sets parameter j.
    fn set(&mut self, j: usize, value: f64);

    /// Returns ∂y/∂p_j at time t. At the start, this is the sensitivity of the initial values.
    fn exact_sensitivity(&self, j: usize, t: f64) -> Vec<f64>;

    /// Returns the parameters, with ∂F/∂p computed by difference quotients.
    fn differenced(&self) -> Differenced<Self>
    where
        Self: Sized + 'static,
    {
        let get = |sample: &Self, j: usize| sample.parameters()[j].value;
        Differenced::new(self.parameters(), get, Self::set)
    }
}

/// Form in which the constraints of a mechanical system are stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MechanicalForm {
    /// The constraint g(p, t) = 0 itself. The index is 3.
    Index3,
    /// The first derivative G v + g_t = 0 instead of g = 0. The index is 2, and positions drift.
    Index2,
    /// The second derivative instead of g = 0. The index is 1, and positions and velocities drift.
    Index1,
    /// Both g = 0 and G v + g_t = 0, with multipliers μ in ṗ = v + Gᵀμ (Gear, Gupta, Leimkuhler 1985). The index is 2.
    Stabilized,
}

impl MechanicalForm {
    /// Returns the perturbation indices of n_p positions, n_p velocities and n_c multipliers (2 n_c multipliers in the
    /// stabilized form).
    fn indices(self, n_p: usize, n_c: usize) -> Vec<u8> {
        let (velocity, multiplier) = match self {
            Self::Index3 => (2, 3),
            Self::Index1 => (1, 1),
            Self::Index2 | Self::Stabilized => (1, 2),
        };
        let n_multipliers = if self == Self::Stabilized { 2 * n_c } else { n_c };
        let mut indices = vec![1; n_p];
        indices.extend(std::iter::repeat_n(velocity, n_p));
        indices.extend(std::iter::repeat_n(multiplier, n_multipliers));
        indices
    }
}

/// Values of a full n × n matrix a ∂F/∂y + b ∂F/∂ẏ. The matrix is initially zero, and entries are added to it.
struct FullMatrix<'a> {
    n: usize,
    values: &'a mut [f64],
}

impl<'a> FullMatrix<'a> {
    fn zeroed(n: usize, values: &'a mut [f64]) -> Self {
        values.fill(0.0);
        Self { n, values }
    }

    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.values[column * self.n + row] += value;
    }
}
