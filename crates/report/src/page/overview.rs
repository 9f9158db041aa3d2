//! Short description of the scene.

use myovib_model::IntegratorKind;
use myovib_scene::Scene;
use serde_json::Value;

use crate::modes;

/// Describes the body, the equations, the method and the time interval in a sentence.
pub(super) fn sentence(scene: &Scene, document: &Value) -> String {
    let mut parts = Vec::new();
    if let Some(body) = &scene.body {
        let space = body.muscle.solid.space();
        let cells = match space.dimension() {
            2 => "triangles, plane strain",
            _ => "tetrahedra",
        };
        parts.push(format!("{} {cells}", space.n_elements()));
        let parameters = &body.muscle.parameters;
        // These values are maxima if materials differ.
        let is = if body.muscle.solid.has_element_scales() { "≤" } else { "=" };
        parts.push(match parameters.is_incompressible() {
            true => "incompressible".to_owned(),
            false => format!("κ {is} {:e} Pa", parameters.kappa()),
        });
        let damping = [("α", parameters.alpha, "1/s"), ("β", parameters.beta, "s")];
        let given = damping.iter().filter(|(_, value, _)| *value > 0.0);
        parts.extend(given.map(|(name, value, unit)| format!("{name} {is} {value} {unit}")));
        if !body.muscle.activations.is_empty() {
            parts.push("contracting".to_owned());
        }
    }
    if let Some(rod) = &scene.file().rod {
        parts.push(format!("a rod of {} elements", rod.elements));
    }
    let oscillators: usize = scene.file().chain.iter().map(|chain| chain.oscillators).sum();
    if oscillators > 0 {
        parts.push(format!("{oscillators} oscillators"));
    }
    let mut text = format!("{}.", parts.join(", "));
    if document["analysis"] == "static" {
        return text + " Equilibrium under the loads.";
    }
    if document["analysis"] == "modes" {
        let about = modes::about(document["preload_time"].as_f64());
        return format!("{text} The lowest eigenfrequencies and modes {about}.");
    }
    if document["analysis"] == "response" {
        let about = modes::about(document["preload_time"].as_f64());
        return format!("{text} Harmonic response {about}.");
    }
    if document["analysis"] == "periodic" {
        return format!("{text} Periodic state at {} Hz.", document["frequency"]);
    }
    if let Some(formulation) = document["formulation"].as_str() {
        let index = &document["index"];
        text += &format!(" Formulation {formulation}, index {index}.");
    }
    let integrator = &scene.file().integrator;
    text += &format!(
        " {} at rtol = {:e}, from 0 to {} s.",
        method(integrator.method),
        integrator.rtol,
        scene.t_end
    );
    text
}

fn method(kind: IntegratorKind) -> &'static str {
    match kind {
        IntegratorKind::Bdf => "BDF (SUNDIALS IDAS)",
        IntegratorKind::Radau5 => "Radau IIA of order 5",
        IntegratorKind::Radau9 => "Radau IIA of order 9",
        IntegratorKind::Radau13 => "Radau IIA of order 13",
    }
}
