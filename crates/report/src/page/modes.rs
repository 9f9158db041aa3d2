//! Table and drawings of the lowest eigenfrequencies and modes.

use myovib_scene::Scene;
use myovib_scene::modes::Modes;

use crate::modes::{figure, frequency};

pub(super) fn section(scene: &Scene, found: &Modes) -> String {
    let bodies = scene.body.iter().zip(&found.muscles);
    let sections = bodies.map(|(body, modes)| {
        let numbered = modes.modes.iter().enumerate();
        let rows = numbered.map(|(n, mode)| {
            let ratio = mode.damping_ratio;
            format!(
                "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>\n",
                n + 1,
                frequency(mode),
                ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.4}")),
            )
        });
        format!(
            "<h2>Modes</h2>\n<table><tr><th class=\"n\">mode</th><th class=\"n\">frequency, Hz</th>\
             <th class=\"n\">damping ratio</th></tr>\n{}</table>\n<figure>\n{}</figure>\n",
            rows.collect::<String>(),
            figure(&body.muscle, modes).render()
        )
    });
    sections.collect()
}
