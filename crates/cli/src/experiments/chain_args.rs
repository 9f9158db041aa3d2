//! What a user may change of a chain, with the paper's values as default.

use clap::Args;
use myovib_oscillators::{Chain, Coefficients, Detuning, Drive, Ends, Generator, Network, Reach};
use serde::Serialize;

use crate::error::InputError;

/// Options of a chain of oscillators.
#[derive(Debug, Clone, Args)]
pub struct ChainArgs {
    /// Number of oscillators [default: 20 on the rod, 5 on the muscle].
    #[arg(long, value_name = "N", help_heading = "Chain")]
    pub oscillators: Option<usize>,

    /// Half width of the interval of natural frequencies in rad/s, around 16π [default: 0.05 on
    /// the rod, 0.5 on the muscle].
    #[arg(
        long,
        value_name = "W",
        help_heading = "Chain",
        allow_negative_numbers = true
    )]
    pub width: Option<f64>,

    /// Generator of the frequencies: matlab, chacha8.
    #[arg(long, value_name = "NAME", help_heading = "Chain", default_value_t)]
    pub generator: GeneratorName,

    /// Seed of the generator.
    #[arg(long, value_name = "S", help_heading = "Chain", default_value_t = Detuning::DEFAULT_SEED)]
    pub seed: u32,

    /// Gain γ of the forcing.
    #[arg(
        long,
        value_name = "G",
        help_heading = "Chain",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub gamma: f64,

    /// Coupling D of neighbours.
    #[arg(
        long,
        value_name = "D",
        help_heading = "Chain",
        default_value_t = 3.0,
        allow_negative_numbers = true
    )]
    pub coupling: f64,

    /// Ends of the chain.
    #[arg(long, help_heading = "Chain", value_enum, default_value_t = EndsName::Periodic)]
    pub ends: EndsName,

    /// Oscillators that the forcing reaches.
    #[arg(long, help_heading = "Chain", value_enum, default_value_t = ReachName::All)]
    pub reach: ReachName,
}

/// A generator by name; unknown names are told from wrong syntax by the library's message.
#[derive(Debug, Clone, Copy, Default)]
pub struct GeneratorName(pub Generator);

impl std::fmt::Display for GeneratorName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::str::FromStr for GeneratorName {
    type Err = myovib_oscillators::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        name.parse().map(Self)
    }
}

/// Ends of a chain, as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EndsName {
    /// The last oscillator is the first one's neighbour.
    Periodic,
    /// Nothing beyond the ends.
    Open,
}

/// Reach of the forcing, as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReachName {
    /// All oscillators.
    All,
    /// The first and the last.
    Boundary,
}

/// A chain with its drive, and the origin of its frequencies.
#[derive(Debug, Clone, Serialize)]
pub struct ChainSetup {
    /// Number of oscillators.
    pub oscillators: usize,
    /// Half width of the frequency interval, rad/s.
    pub width: f64,
    /// Name of the generator.
    pub generator: &'static str,
    /// Its seed.
    pub seed: u32,
    /// γ.
    pub gamma: f64,
    /// D.
    pub coupling: f64,
    /// μ of Van der Pol's damping, 1/s.
    pub van_der_pol: f64,
    /// a of Duffing's stiffening, 1/s².
    pub duffing: f64,
    /// Ends of the chain.
    pub ends: EndsName,
    /// Oscillators that the forcing reaches.
    pub reach: ReachName,
    /// Natural frequencies ω_n, rad/s.
    pub frequencies: Vec<f64>,
}

impl ChainArgs {
    /// The chain, with the body's own number of oscillators and width where none are given.
    ///
    /// # Errors
    /// No oscillators, a negative width, a value that is not finite.
    pub fn setup(&self, oscillators: usize, width: f64) -> Result<ChainSetup, InputError> {
        for (option, value) in [("--gamma", self.gamma), ("--coupling", self.coupling)] {
            if !value.is_finite() {
                let error = InputError::new("value out of range").at(option);
                return Err(error.found(value).allowed("a finite number"));
            }
        }
        let detuning = Detuning {
            half_width: self.width.unwrap_or(width),
            generator: self.generator.0,
            seed: self.seed,
            ..Detuning::default()
        };
        let oscillators = self.oscillators.unwrap_or(oscillators);
        let frequencies = detuning
            .frequencies(oscillators)
            .map_err(|error| InputError::new(error).at("--oscillators, --width"))?;
        let Coefficients {
            vdp_mu: van_der_pol,
            duffing,
            ..
        } = Coefficients::default();
        let setup = ChainSetup {
            oscillators,
            width: detuning.half_width,
            generator: detuning.generator.name(),
            seed: detuning.seed,
            gamma: self.gamma,
            coupling: self.coupling,
            van_der_pol,
            duffing,
            ends: self.ends,
            reach: self.reach,
            frequencies,
        };
        match setup.network() {
            Ok(_) => Ok(setup),
            Err(error) => Err(InputError::new(error).at("--width")),
        }
    }
}

impl ChainSetup {
    /// The equations of the chain.
    ///
    /// # Errors
    /// Frequencies or coefficients that make no sense.
    pub fn network(&self) -> Result<Network, myovib_oscillators::Error> {
        Chain {
            omega: self.frequencies.clone(),
            coefficients: Coefficients {
                vdp_mu: self.van_der_pol,
                duffing: self.duffing,
                coupling: self.coupling,
            },
            ends: match self.ends {
                EndsName::Periodic => Ends::Periodic,
                EndsName::Open => Ends::Open,
            },
            reach: self.reach(),
        }
        .network()
    }

    /// The drive.
    pub fn drive(&self) -> Drive {
        Drive {
            gain: self.gamma,
            reach: self.reach(),
        }
    }

    fn reach(&self) -> Reach {
        match self.reach {
            ReachName::All => Reach::All,
            ReachName::Boundary => Reach::Boundary,
        }
    }
}
