//! Explanation of the results of a run.

use serde_json::Value;

use super::is_in_space;
use crate::table::counted;

/// Describes the volume ratios at vertices, which the volume constraint does not control.
fn volumes(document: &Value) -> String {
    let [smallest, largest] = [0, 1].map(|i| document["volume_ratios"][i].as_f64());
    match (smallest, largest) {
        (Some(smallest), Some(largest)) => {
            format!(" At element vertices, det F ranged from {smallest:.3} to {largest:.3}.")
        }
        _ => String::new(),
    }
}

/// Explains the results of a run and quotes the main numbers of its document.
pub(super) fn meaning(document: &Value) -> String {
    match document["analysis"].as_str() {
        Some("static") => meaning_of_equilibrium(document),
        Some("modes") => MODES.to_owned(),
        Some("response") => RESPONSE.to_owned(),
        Some("periodic") => PERIODIC.to_owned(),
        _ => meaning_of_motion(document),
    }
}

const MODES: &str = "<p>Small free vibrations; Prony terms are treated as relaxed. The damping ratio includes α, β, \
                     viscosity and elastic foundations, but not Prony terms; 1 is critical.</p>\n";
const RESPONSE: &str = "<p>Small harmonic motions Re(û e<sup>iωt</sup>) of the linearized body. A positive phase leads \
                        the drive. Damping ratios are computed from half-power widths, Δf/(2f), which is valid for light \
                        damping and separate peaks.</p>\n";
const PERIODIC: &str = "<p>The motion that repeats with the period of the loads, found without computing the \
                        transient. A Floquet multiplier is the factor by which a small deviation grows over a period: \
                        the motion is stable if all are inside the unit circle. Curves show one period.</p>\n";

/// Explains how the equilibrium was found, and describes the critical points of its path.
fn meaning_of_equilibrium(document: &Value) -> String {
    let part = document["load_reached"].as_f64().filter(|part| *part < 1.0);
    let under =
        part.map_or(String::new(), |part| format!(" under {:.1} % of the load", 100.0 * part));
    let points = document["critical_points"].as_array().into_iter().flatten();
    let points = points.map(|point| {
        let [from, to] = [0, 1].map(|i| point["loads"][i].as_f64().unwrap_or(f64::NAN));
        match point["type"] == "limit" {
            true => format!("<li>limit point at load factor {from:.6}</li>\n"),
            false => {
                format!("<li>bifurcation between load factors {from:.6} and {to:.6}</li>\n")
            }
        }
    });
    let points: String = points.collect();
    let points = match points.is_empty() {
        true => points,
        false => format!("<p>On the path of equilibria:</p>\n<ul>\n{points}</ul>\n"),
    };
    format!(
        "<p>Newton's method found the equilibrium{under} in {} over {}.{}</p>\n{points}",
        counted(&document["newton_iterations"], "iteration"),
        counted(&document["load_steps"], "load step"),
        volumes(document)
    )
}

/// Explains the index, the drift and the energy.
fn meaning_of_motion(document: &Value) -> String {
    let index = document["index"].as_u64().unwrap_or(0);
    let mut text = format!(
        "<p>The system has index {index}: {}.</p>\n",
        meaning_of_index(index, document["integrator"] == "bdf")
    );
    if let Some(drift) = document["constraint_drift"].as_f64() {
        text += &format!(
            "<p>The volume constraint was violated by at most {drift:.1e} \
             (projected onto the pressure functions)."
        );
        if document["formulation"] == "velocity" {
            text += " This formulation enforces its derivative, so errors accumulate over time.";
        }
        text += &format!("{}</p>\n", volumes(document));
    }
    let excluded = document["suppressed"].as_array().into_iter().flatten();
    let excluded: Vec<&str> = excluded.filter_map(Value::as_str).collect();
    if !excluded.is_empty() {
        let names = excluded.join(", ");
        text += &format!("<p>Excluded from the error test: {names}.</p>\n");
    }
    if let Some([kinetic, elastic, work, dissipated, imbalance]) = energies(document) {
        text += &format!(
            "<p>Energy{} at the end: {kinetic:.3e} J kinetic and {elastic:.3e} J \
             elastic; the work of the loads is {work:.3e} J, and damping dissipated {dissipated:.3e} J. The \
             error of the balance is {imbalance:.1e} J: {}.</p>\n",
            match is_in_space(document) {
                true => "",
                false => " per meter of depth",
            },
            match has_feedback(document) {
                true =>
                    "the energy that the feedback of chains adds, and the error of time integration",
                false => "the error of time integration with this tolerance",
            }
        );
    }
    text
}

/// Returns whether chains of oscillators act back on the body.
fn has_feedback(document: &Value) -> bool {
    let feedbacks = document["scene"]["feedback"].as_array();
    feedbacks.is_some_and(|feedbacks| !feedbacks.is_empty())
}

/// Explains what the index means for the integrator.
fn meaning_of_index(index: u64, is_bdf: bool) -> &'static str {
    match (index, is_bdf) {
        (0, _) => {
            "an ordinary differential equation; the error test treats all variables in the same way"
        }
        (1, _) => {
            "the pressure follows from the displacement without differentiation, and the error \
             test may include it"
        }
        (_, false) => {
            "the multipliers are determined only after differentiation. Radau IIA multiplies their errors by a \
             power of the step in the error test, according to their effect on the motion"
        }
        (2, true) => {
            "the multipliers are determined after one differentiation. Their estimated errors do not \
             shrink with the step as those of the other variables do, so they are best excluded from the error test"
        }
        (_, true) => {
            "the multipliers are determined only after two differentiations. BDF can barely integrate them: with them in the error test it tends to stop, and a formulation of lower index is the better choice"
        }
    }
}

/// Returns the last row recorded by an energy probe.
fn energies(document: &Value) -> Option<[f64; 5]> {
    let row = document["energy"].as_array()?;
    let numbers: Vec<f64> = row.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}
