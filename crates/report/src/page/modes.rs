//! Table and drawings of the lowest eigenfrequencies and modes.

use myovib_scene::Scene;
use myovib_scene::modes::Modes;

use crate::modes::{figure, frequency};
use crate::table::{Align, Table};

pub(super) fn section(scene: &Scene, found: &Modes) -> String {
    let bodies = scene.body.iter().zip(&found.muscles);
    let sections = bodies.map(|(body, modes)| {
        let names = ["mode", "frequency, Hz", "damping ratio"];
        let mut table = Table::new(&names.map(|name| (name, Align::Right)));
        for (n, mode) in modes.modes.iter().enumerate() {
            let ratio = mode.damping_ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.4}"));
            table.row([(n + 1).to_string(), frequency(mode), ratio].map(Into::into));
        }
        format!(
            "<h2>Modes</h2>\n{}<figure>\n{}</figure>\n",
            table.html(),
            figure(&body.muscle, modes).render()
        )
    });
    sections.collect()
}
