//! JSON document of `check`.

use myovib_model::advice::Finding;
use myovib_model::check::{Computed, FactorizationCost, Report, Size};
use myovib_scene::{Body, Scene, json};
use serde::Serialize;

use super::cost::{Cost, CostJson};
use super::response::ResponseJson;
use crate::commands::table1::{ReportJson, report_json};

#[derive(Serialize)]
pub(super) struct Document {
    pub(super) scene: String,
    /// Null for a scene without a mesh.
    pub(super) size: Option<BodySizeJson>,
    /// Null for a scene without a body, or without motion.
    pub(super) body: Option<BodyJson>,
    /// Null unless the scene is static.
    pub(super) equilibrium: Option<EquilibriumJson>,
    /// Null unless the scene is quasi-static.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) quasi_static: Option<QuasiStaticJson>,
    /// Null unless the scene computes the modes of a body.
    pub(super) modes: Option<ModesJson>,
    /// Null unless the scene computes the response of a body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) response: Option<ResponseJson>,
}

#[derive(Serialize)]
pub(super) struct ModesJson {
    warnings: Vec<WarningJson>,
}

impl ModesJson {
    /// Collects the findings for modes, which are only warnings.
    pub(super) fn of(findings: &[Finding]) -> Self {
        Self { warnings: findings.iter().map(WarningJson::from).collect() }
    }
}

#[derive(Serialize)]
pub(super) struct BodySizeJson {
    /// Extents along the axes, m.
    extents: Vec<f64>,
    /// Volume, m³; in the plane the area, m².
    volume: f64,
    /// Mass, kg; in the plane per meter of depth.
    mass: f64,
    elements: usize,
    nodes: usize,
}

impl From<Size> for BodySizeJson {
    fn from(size: Size) -> Self {
        Self {
            extents: size.extents,
            volume: size.volume,
            mass: size.mass,
            elements: size.elements,
            nodes: size.nodes,
        }
    }
}

#[derive(Serialize)]
pub(super) struct EquilibriumJson {
    pub(super) unknowns: usize,
    pub(super) blocks: Vec<SizeJson>,
    /// Inf–sup constant. This value and `nullity` are null if there are too many pressures to compute them within
    /// seconds.
    pub(super) inf_sup: Option<f64>,
    pub(super) nullity: Option<usize>,
    /// Null if not known before the run.
    pub(super) factors: Option<FactorsJson>,
    /// Maximum displacement under the full load by linear elasticity, m; null for a body that is
    /// too large for this computation or not sufficiently supported.
    pub(super) linear_displacement: Option<f64>,
    /// CPU time, s: predicted for a body that is too large for a trial; null for a body that is not
    /// sufficiently supported.
    pub(super) seconds_per_iteration: Option<f64>,
    pub(super) warnings: Vec<WarningJson>,
}

#[derive(Serialize)]
pub(super) struct QuasiStaticJson {
    pub(super) formulation: &'static str,
    pub(super) unknowns: usize,
    pub(super) blocks: Vec<BlockJson>,
    /// Inf–sup constant. This value and `nullity` are null without pressures, or if there are too many to compute them
    /// within seconds.
    pub(super) inf_sup: Option<f64>,
    pub(super) nullity: Option<usize>,
    /// Null if not known before the run.
    pub(super) factors: Option<FactorsJson>,
    pub(super) cost: CostJson,
    pub(super) warnings: Vec<WarningJson>,
}

#[derive(Serialize)]
pub(super) struct SizeJson {
    pub(super) field: &'static str,
    pub(super) unknowns: usize,
}

#[derive(Serialize)]
pub(super) struct BodyJson {
    formulation: &'static str,
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    beta: f64,
    unknowns: usize,
    blocks: Vec<BlockJson>,
    chains: Vec<ChainJson>,
    /// Index according to the rule for the formulation.
    index: u8,
    computed: ReportJson,
    computed_on: &'static str,
    /// Inf–sup constant. This value and `nullity` are null if there are too many pressures to compute them within
    /// seconds.
    inf_sup: Option<f64>,
    nullity: Option<usize>,
    initial_residual: Vec<ResidualJson>,
    slow_modes: Vec<f64>,
    fastest_mode: f64,
    drive: Option<f64>,
    /// Lowest and highest frequency of each sweeping load, Hz.
    sweeps: Vec<[f64; 2]>,
    advised_max_order: u8,
    /// Null if the full matrix is factorized.
    factors: Option<FactorsJson>,
    cost: CostJson,
    warnings: Vec<WarningJson>,
}

#[derive(Serialize)]
pub(super) struct FactorsJson {
    matrices: usize,
    entries: usize,
    bytes: usize,
    /// Memory in use before the factorization; null if the system does not report it.
    bytes_before: Option<usize>,
    operations: f64,
}

#[derive(Serialize)]
pub(super) struct BlockJson {
    pub(super) field: &'static str,
    pub(super) unknowns: usize,
    pub(super) index: u8,
    pub(super) left_out: bool,
    pub(super) better_left_out: bool,
}

#[derive(Serialize)]
struct ChainJson {
    name: String,
    unknowns: usize,
    left_out: bool,
}

#[derive(Serialize)]
struct ResidualJson {
    field: &'static str,
    largest: f64,
    relative: f64,
    worst: String,
}

#[derive(Serialize)]
pub(super) struct WarningJson {
    problem: String,
    fields: Vec<&'static str>,
    remedies: Vec<String>,
}

impl From<FactorizationCost> for FactorsJson {
    fn from(factors: FactorizationCost) -> Self {
        Self {
            matrices: factors.matrices,
            entries: factors.needs.entries,
            bytes: factors.needs.bytes,
            bytes_before: factors.in_use,
            operations: factors.needs.flops,
        }
    }
}

impl From<&Finding> for WarningJson {
    fn from(finding: &Finding) -> Self {
        Self {
            problem: finding.problem.clone(),
            fields: finding.fields.iter().map(|field| field.name()).collect(),
            remedies: finding.remedies.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Returns the findings for a body and its chains.
pub(super) fn document(scene: &Scene, body: &Body, report: &Report, cost: &Cost) -> BodyJson {
    let parameters = &body.muscle.parameters;
    let to_exclude = report.advice.to_exclude();
    let blocks = report.unknowns.iter().map(|(field, unknowns)| BlockJson {
        field: field.name(),
        unknowns: *unknowns,
        index: body.formulation.variable_index(*field, parameters),
        left_out: body.settings.suppressed.contains(field),
        better_left_out: to_exclude.contains(field),
    });
    let chains = scene.chains.iter().map(|chain| ChainJson {
        name: chain.name.clone(),
        unknowns: chain.n_unknowns(),
        left_out: !scene.file.integrator.oscillators.in_error_test,
    });
    let chains: Vec<ChainJson> = chains.collect();
    let of_body: usize = report.unknowns.iter().map(|(_, number)| number).sum();
    let of_chains: usize = chains.iter().map(|chain| chain.unknowns).sum();
    let residual = |block: &myovib_model::start::BlockResidual| ResidualJson {
        field: block.field.name(),
        largest: block.largest,
        relative: block.relative,
        worst: block.worst.clone(),
    };
    BodyJson {
        formulation: body.formulation.name(),
        kappa: parameters.kappa(),
        beta: parameters.beta,
        unknowns: of_body + of_chains,
        blocks: blocks.collect(),
        chains,
        index: report.advice.index(),
        computed: report_json(&report.computed),
        computed_on: match report.computed_on {
            Computed::Here => "scene",
            Computed::OnCoarseMesh => "coarse-mesh",
        },
        inf_sup: report.held.map(|held| held.inf_sup),
        nullity: report.held.map(|held| held.nullity),
        initial_residual: report.residuals.iter().map(residual).collect(),
        slow_modes: report.slow_modes.clone(),
        fastest_mode: report.fastest_mode,
        drive: report.drive,
        sweeps: report.sweeps.clone(),
        advised_max_order: report.advice.max_order(),
        factors: report.factors.map(FactorsJson::from),
        cost: cost.json(),
        warnings: report.findings.iter().map(WarningJson::from).collect(),
    }
}
