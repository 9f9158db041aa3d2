//! JSON document of `check`.

use myovib_model::Field;
use myovib_model::advice::Finding;
use myovib_model::check::{Computed, FactorizationCost, Report, Size};
use myovib_model::start::BlockResidual;
use myovib_scene::run::PeriodTrial;
use myovib_scene::scene_file::solid::BulkModulus;
use myovib_scene::{Body, Scene};
use serde::Serialize;
use serde_json::{Value, json};

use super::cost::Cost;
use super::response::ResponseJson;
use crate::commands::table1::report_json;

#[derive(Default, Serialize)]
pub(super) struct Document {
    pub(super) scene: String,
    /// Null for a scene without a mesh.
    pub(super) size: Option<Value>,
    /// Null for a scene without a body, or without motion.
    pub(super) body: Option<Value>,
    /// Null unless the scene is static.
    pub(super) equilibrium: Option<Value>,
    /// Null unless the scene is quasi-static.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) quasi_static: Option<Value>,
    /// Null unless the scene computes the modes of a body.
    pub(super) modes: Option<Value>,
    /// Null unless the scene computes the response of a body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) response: Option<ResponseJson>,
    /// Null unless the scene computes a periodic state.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) periodic: Option<PeriodTrial>,
}

/// Returns the extents along the axes (m), the volume (m³) and the mass (kg). For a 2D body, the volume is replaced by
/// the area (m²), and the mass is given per meter of depth (kg/m). `volumes` contains the volume of each material.
pub(super) fn size(size: &Size, volumes: &[f64]) -> Value {
    json!({
        "volumes_of_materials": volumes,
        "extents": size.extents,
        "volume": size.volume,
        "mass": size.mass,
        "elements": size.elements,
        "nodes": size.nodes,
    })
}

/// `bytes_before` is the memory in use before the factorization; null if the system does not report it.
pub(super) fn factors(factors: &FactorizationCost) -> Value {
    json!({
        "matrices": factors.matrices,
        "entries": factors.needs.entries,
        "bytes": factors.needs.bytes,
        "bytes_before": factors.in_use,
        "operations": factors.needs.flops,
    })
}

pub(super) fn warnings(findings: &[Finding]) -> Vec<Value> {
    let warning = |finding: &Finding| {
        json!({
            "problem": finding.problem,
            "fields": finding.fields.iter().map(|field| field.name()).collect::<Vec<_>>(),
            "remedies": finding.remedies.iter().map(ToString::to_string).collect::<Vec<_>>(),
        })
    };
    findings.iter().map(warning).collect()
}

pub(super) fn block(body: &Body, field: Field, unknowns: usize, index: u8, better: bool) -> Value {
    json!({
        "field": field.name(),
        "unknowns": unknowns,
        "index": index,
        "excluded": body.settings.suppressed.contains(&field),
        "better_excluded": better,
    })
}

/// Returns the findings for a body and its chains. `inf_sup` and `nullity` are null if there are too many pressures to
/// compute them within seconds. `factors` is null if the full matrix is factorized. `sweeps` contains the lowest and
/// the highest frequency (Hz) of each sweeping load.
pub(super) fn document(scene: &Scene, body: &Body, report: &Report, cost: &Cost) -> Value {
    let parameters = &body.muscle.parameters;
    let to_exclude = report.advice.to_exclude();
    let blocks = report.unknowns.iter().map(|(field, unknowns)| {
        let index = body.formulation.variable_index(*field, parameters);
        block(body, *field, *unknowns, index, to_exclude.contains(field))
    });
    let chains = scene.chains.iter().map(|chain| {
        json!({
            "name": chain.name,
            "unknowns": chain.n_unknowns(),
            "excluded": !scene.file().integrator.oscillators.in_error_test,
        })
    });
    let of_body: usize = report.unknowns.iter().map(|(_, number)| number).sum();
    let of_chains: usize = scene.chains.iter().map(|chain| chain.n_unknowns()).sum();
    let residual = |block: &BlockResidual| {
        json!({
            "field": block.field.name(),
            "largest": block.largest,
            "relative": block.relative,
            "worst": block.worst,
        })
    };
    json!({
        "formulation": body.formulation.name(),
        "kappa": BulkModulus(parameters.kappa()),
        "beta": parameters.beta,
        "unknowns": of_body + of_chains,
        "blocks": blocks.collect::<Vec<_>>(),
        "chains": chains.collect::<Vec<_>>(),
        "index": report.advice.index(),
        "computed": report_json(&report.computed),
        "computed_on": match report.computed_on {
            Computed::Here => "scene",
            Computed::OnCoarseMesh => "coarse-mesh",
        },
        "inf_sup": report.held.map(|held| held.inf_sup),
        "nullity": report.held.map(|held| held.nullity),
        "initial_residual": report.residuals.iter().map(residual).collect::<Vec<_>>(),
        "slow_modes": report.slow_modes,
        "fastest_mode": report.fastest_mode,
        "drive": report.drive,
        "sweeps": report.sweeps,
        "advised_max_order": report.advice.max_order(),
        "factors": report.factors.as_ref().map(factors),
        "cost": cost.json(),
        "warnings": warnings(&report.findings),
    })
}
