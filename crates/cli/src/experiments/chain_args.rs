//! What a user may change of a chain, with the paper's values as default.

use clap::Args;
use myovib_oscillators::{Chain, Coefficients, Detuning, Drive, Generator, Network};
use serde::Serialize;

use crate::values;

use myovib_scene::InputError;
use myovib_scene::scene_file::chain::{EndsName, ReachName};

/// Options of a chain of oscillators.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Chain")]
pub struct ChainArgs {
    /// Number of oscillators [default: 20 on the rod, 5 on the muscle].
    #[arg(long, value_name = "N")]
    pub oscillators: Option<usize>,

    /// Half width of the interval of natural frequencies in rad/s, around 16π [default: 0.05 on
    /// the rod, 0.5 on the muscle].
    #[arg(long, value_name = "W", allow_negative_numbers = true)]
    pub width: Option<f64>,

    /// Generator of the frequencies: matlab, chacha8 [default: matlab].
    #[arg(long, value_name = "NAME")]
    pub generator: Option<GeneratorName>,

    /// Seed of the generator [default: 5489].
    #[arg(long, value_name = "S")]
    pub seed: Option<u32>,

    /// Gain γ of the forcing [default: 1].
    #[arg(long, value_name = "G", allow_negative_numbers = true)]
    pub gamma: Option<f64>,

    /// Coupling D of neighbours [default: 3].
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    pub coupling: Option<f64>,

    /// μ of Van der Pol's damping, 1/s [default: 2].
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    pub mu: Option<f64>,

    /// a of Duffing's stiffening, 1/s² [default: 0].
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pub duffing: Option<f64>,

    /// Ends of the chain: periodic, open [default: periodic].
    #[arg(long, value_name = "NAME", value_parser = values::named::<EndsName>)]
    pub ends: Option<EndsName>,

    /// Oscillators that the forcing reaches: all, boundary [default: all].
    #[arg(long, value_name = "NAME", value_parser = values::named::<ReachName>)]
    pub reach: Option<ReachName>,
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
    /// The first option that was given, for a command whose run has no chain.
    pub fn given(&self) -> Option<&'static str> {
        let options = [
            ("--oscillators", self.oscillators.is_some()),
            ("--width", self.width.is_some()),
            ("--generator", self.generator.is_some()),
            ("--seed", self.seed.is_some()),
            ("--gamma", self.gamma.is_some()),
            ("--coupling", self.coupling.is_some()),
            ("--mu", self.mu.is_some()),
            ("--duffing", self.duffing.is_some()),
            ("--ends", self.ends.is_some()),
            ("--reach", self.reach.is_some()),
        ];
        let given = options.into_iter().find(|(_, given)| *given);
        given.map(|(option, _)| option)
    }

    /// The chain, with the body's own number of oscillators and width where none are given.
    ///
    /// # Errors
    /// No oscillators, a negative width, a value that is not finite.
    pub fn setup(&self, oscillators: usize, width: f64) -> Result<ChainSetup, InputError> {
        let paper = Coefficients::default();
        let finite = |option: &str, value: Option<f64>, default: f64| {
            let value = value.unwrap_or(default);
            if value.is_finite() {
                return Ok(value);
            }
            let error = InputError::new("value out of range").at(option);
            Err(error.found(value).allowed("a finite number"))
        };
        let default = Detuning::default();
        let detuning = Detuning {
            half_width: self.width.unwrap_or(width),
            generator: self.generator.map_or(default.generator, |name| name.0),
            seed: self.seed.unwrap_or(default.seed),
            ..default
        };
        let oscillators = self.oscillators.unwrap_or(oscillators);
        let frequencies = detuning
            .frequencies(oscillators)
            .map_err(|error| InputError::new(error).at("--oscillators, --width"))?;
        let setup = ChainSetup {
            oscillators,
            width: detuning.half_width,
            generator: detuning.generator.name(),
            seed: detuning.seed,
            gamma: finite("--gamma", self.gamma, 1.0)?,
            coupling: finite("--coupling", self.coupling, paper.coupling)?,
            van_der_pol: finite("--mu", self.mu, paper.vdp_mu)?,
            duffing: finite("--duffing", self.duffing, paper.duffing)?,
            ends: self.ends.unwrap_or(EndsName::Periodic),
            reach: self.reach.unwrap_or(ReachName::All),
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
            ends: self.ends.into(),
            reach: self.reach.into(),
        }
        .network()
    }

    /// The drive.
    pub fn drive(&self) -> Drive {
        Drive {
            gain: self.gamma,
            reach: self.reach.into(),
        }
    }
}
