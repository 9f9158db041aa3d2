//! Key figures and statistics of a run.

use myovib_scene::escape;
use serde_json::Value;

/// Returns the cards with the key figures.
pub(super) fn cards(document: &Value) -> String {
    let number = |key: &str| document[key].as_f64();
    let finished = document["outcome"] == "finished";
    let mut cards = vec![match finished {
        true => card("good", "finished", "outcome"),
        false => card("bad", "stopped", "outcome"),
    }];
    let mut add = |value: Option<String>, what: &str| {
        cards.extend(value.map(|value| card("", &value, what)));
    };
    add(number("t_reached").map(|t| format!("{} s", short(t))), "time reached");
    let steps = document["steps"].as_u64();
    let rejected = document["error_test_failures"].as_u64().unwrap_or(0);
    add(steps.map(|steps| steps.to_string()), &format!("steps; {rejected} more rejected"));
    add(document["newton_iterations"].as_u64().map(|n| n.to_string()), "Newton iterations");
    add(document["unknowns"].as_u64().map(|n| n.to_string()), "unknowns");
    add(number("cpu_seconds").map(|s| format!("{s:.2} s")), "CPU time");
    add(
        number("constraint_drift").map(|d| format!("{d:.1e}")),
        "maximum error of the volume constraint",
    );
    add(
        worst_error(document).map(|e| format!("{:.2} %", 100.0 * e)),
        "estimated time error of u, relative to its maximum",
    );
    format!("<div class=\"cards\">\n{}</div>\n", cards.concat())
}

/// Formats a time. Numbers with more than six characters are rounded to four decimals, or to five digits below 1e-3.
fn short(t: f64) -> String {
    match t.to_string() {
        long if long.len() > 6 && t < 1e-3 => format!("{t:.4e}"),
        long if long.len() > 6 => format!("{t:.4}"),
        text => text,
    }
}

fn card(class: &str, value: &str, what: &str) -> String {
    format!("<div class=\"card {class}\"><b>{value}</b><span>{what}</span></div>\n")
}

/// Returns the largest estimated relative error of displacements.
fn worst_error(document: &Value) -> Option<f64> {
    let probes = document["error_estimate"]["probes"].as_object()?;
    let columns = probes.values().filter_map(Value::as_object).flatten();
    let displacements = columns.filter(|(name, _)| name.starts_with("u_"));
    let errors = displacements.filter_map(|(_, column)| column["relative"].as_f64());
    errors.reduce(f64::max)
}

/// Returns the reason why a run stopped, or nothing if it did not stop.
pub(super) fn outcome(document: &Value) -> String {
    match document["message"].as_str() {
        Some(message) => format!("<p class=\"bad\">{}</p>\n", escape(message)),
        None => String::new(),
    }
}

/// Returns all scalar entries of the document.
pub(super) fn statistics(document: &Value) -> String {
    let Some(object) = document.as_object() else {
        return String::new();
    };
    let is_plain = |value: &&Value| !value.is_object() && !value.is_array() && !value.is_null();
    let rows: String = object
        .iter()
        .filter(|(_, value)| is_plain(value))
        .map(|(key, value)| {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            format!("<tr><td>{}</td><td>{}</td></tr>\n", escape(key), escape(&value))
        })
        .collect();
    format!("<table>{rows}</table>\n")
}

#[cfg(test)]
mod tests {
    use super::short;

    /// Regression: a time with 17 digits did not fit into its card.
    #[test]
    fn long_times_are_shortened() {
        let times = [2.0, 0.01, 1.1049304527731967, 6.249496353913669e-7].map(short);
        assert_eq!(times, ["2", "0.01", "1.1049", "6.2495e-7"]);
    }
}
