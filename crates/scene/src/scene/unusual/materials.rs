//! Unusual constants of materials.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use myovib_fem::Law;
use myovib_model::check::readable;

use super::Unusual;
use crate::scene_file::material::Material;
use crate::scene_file::solid::Solid;
use crate::scene_file::{Analysis, SceneFile};

/// Range of densities (kg/m³), from a tenth of the density of water to the density of heavy metals.
const DENSITIES: RangeInclusive<f64> = 100.0..=2e4;
/// Range of shear wave speeds (m/s) in tissue. Bodies outside this range probably use other units.
const SHEAR_WAVES: RangeInclusive<f64> = 0.1..=20.0;
/// Minimum shear modulus (Pa). The softest solid tissues, embryos and brain, have about 100 Pa.
const SOFTEST: f64 = 50.0;
/// Maximum ratio of viscous to elastic stress at the driving frequency. In tissue, this ratio is from 0.05 to 1. A
/// material with a ratio above 5 would flow.
const MOST_LOSS: f64 = 5.0;

/// Largest jump of the fiber stiffness at the stretch 1, relative to the shear modulus, that is not reported. The jump
/// of a published tendon, for which Newton's method failed, is 2500.
const LARGEST_JUMP: f64 = 100.0;

pub(super) struct Part {
    pub(super) law: Law,
    pub(super) density: f64,
    kappa: f64,
    beta: f64,
    /// Bulk modulus (Pa) at small strains, including κ.
    bulk: f64,
    /// Shear modulus (Pa) at small strains.
    pub(super) shear: f64,
    /// Highest frequency (Hz) at which the body is driven, if any.
    drive: Option<f64>,
}

/// Condition under which a scene is checked, and the check of each of its materials.
pub(super) type Check = (fn(&SceneFile) -> bool, fn(&Part) -> Option<Unusual>);

pub(super) const CHECKS: [Check; 4] = [
    (|_| true, volume),
    (|_| true, softness),
    (has_mass, mass),
    (|file| file.analysis == Analysis::Dynamic, damping),
];

impl Part {
    pub(super) fn new(material: &Material, factor: f64, solid: &Solid, drive: Option<f64>) -> Self {
        let law = material.stiffened();
        let law = law.expect("the body was made of this law").scaled(factor);
        let kappa = material.bulk_modulus.unwrap_or(solid.bulk_modulus).0;
        let [own, shear] = law.moduli();
        Self {
            law,
            density: material.density,
            kappa,
            beta: material.rayleigh_stiffness.unwrap_or(solid.rayleigh_stiffness),
            // The energy of a complete law contains the volumetric part.
            bulk: if law.description().complete { own } else { own + kappa },
            shear,
            drive,
        }
    }
}

/// Checks for a negative Poisson's ratio (3 K − 2 G)/(2 (3 K + G)), which means K < 2/3 G.
fn volume(part: &Part) -> Option<Unusual> {
    let Part { kappa, bulk, shear, .. } = *part;
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    (poisson < 0.0).then(|| {
        let problem = format!(
            "bulk_modulus = {} Pa with a shear modulus of {} Pa: Poisson's ratio is {}, so the body thickens when pulled",
            readable(kappa),
            readable(shear),
            two_digits(poisson)
        );
        (problem, "use a bulk_modulus far above the shear modulus (in tissue at least a hundred times as large), or `inf`")
    })
}

/// Checks that a body with a density in SI units is not softer than tissue.
fn softness(part: &Part) -> Option<Unusual> {
    (DENSITIES.contains(&part.density) && part.shear < SOFTEST).then(|| {
        let problem = format!("the shear modulus at rest is {} Pa", readable(part.shear));
        (problem, "give moduli in Pa: 5 kPa is 5e3; tissue has 1e2 to 1e6")
    })
}

/// Formats a nonzero number between -1 and 1 with two significant digits.
fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().log10().floor()) as usize;
    format!("{value:.decimals$}")
}

/// Returns whether the density has an effect in the scene.
fn has_mass(file: &SceneFile) -> bool {
    let has_inertia = !matches!(file.analysis, Analysis::Static | Analysis::QuasiStatic);
    has_inertia || !file.body_force.is_empty()
}

/// Checks that the density, or the shear wave speed √(G/ρ), is in the range of tissue.
fn mass(part: &Part) -> Option<Unusual> {
    let speed = (part.shear / part.density).sqrt();
    let is_usual = DENSITIES.contains(&part.density) || SHEAR_WAVES.contains(&speed);
    (!is_usual).then(|| {
        let problem = format!(
            "a density of {} kg/m³: shear waves travel at {} m/s",
            readable(part.density),
            readable(speed)
        );
        (
            problem,
            "give it in kg/m³: tissue has about 1000, which is 1 g/cm³, and waves of 1 to 10 m/s",
        )
    })
}

/// Checks the viscous stress, which is ωβ times the elastic stress at the angular frequency ω. Without a driving
/// frequency, the rate of deformation is unknown and nothing is checked.
fn damping(part: &Part) -> Option<Unusual> {
    let Part { beta, drive, .. } = *part;
    let frequency = drive?;
    let loss = TAU * frequency * beta;
    (loss > MOST_LOSS).then(|| {
        let problem = format!(
            "rayleigh_stiffness = {beta:e} s makes the viscous stress {loss:.1} times the elastic stress at {} Hz",
            readable(frequency)
        );
        (problem, "use a smaller rayleigh_stiffness, in s: in tissue the viscous stress is 0.05 to 1 times the elastic stress")
    })
}

/// Checks the jump of the fiber stiffness where fibers begin to stretch, if another material is softer.
pub(super) fn kink(parts: &[Part]) -> Option<Unusual> {
    let softest = parts.iter().map(|part| part.shear).fold(f64::INFINITY, f64::min);
    parts.iter().enumerate().find_map(|(i, part)| {
        let Law::TransverseMooneyRivlin { c10, c01, c3, c4, .. } = part.law else {
            return None;
        };
        let (shear, jump) = (2.0 * (c10 + c01), c3 * c4);
        (softest < shear && jump > LARGEST_JUMP * shear).then(|| {
            let problem = format!(
                "material[{i}]: the fibers have no stiffness in compression and {jump:.1e} Pa in tension: next to a \
                 softer material, Newton's method may fail where they are nearly unloaded"
            );
            (
                problem,
                "if it fails, use holzapfel-ogden with a = 2 (c10 + c01), a_f = c3 c4/2, b = b_f = 0.01, a_s = a_fs = 0 and \
                 k = 1e-6, whose fibers have the same stiffness in tension and compression",
            )
        })
    })
}
