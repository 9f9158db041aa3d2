//! A command that computes one analysis of a scene and writes its folder.

use std::path::Path;

use myovib_report::page;
use myovib_scene::run::{Existing, RunOptions, RunResult, compute};
use myovib_scene::sensitivity::SceneParameter;
use myovib_scene::{Scene, plain};

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::output;
use crate::progress::Progress;

/// The arguments common to all these commands.
pub(crate) struct AnalysisCommand<'a> {
    /// Name of the command and of the analysis.
    pub(crate) name: &'static str,
    pub(crate) scene: &'a Path,
    /// Changes of the scene, except for its analysis.
    pub(crate) set: Vec<String>,
    pub(crate) out: &'a Path,
    pub(crate) overwrite: bool,
    pub(crate) common: &'a CommonArgs,
}

impl AnalysisCommand<'_> {
    /// Computes the analysis, writes the folder with its report, and prints its `table`.
    ///
    /// # Errors
    /// Returns an error if the scene is invalid (before any file is written), if the analysis fails, or if an
    /// output cannot be written.
    pub(crate) fn run(self, table: impl Fn(&RunResult) -> Option<String>) -> anyhow::Result<Exit> {
        let mut set = self.set;
        set.push(format!("analysis={}", self.name));
        let scene = Scene::load(self.scene, &set)?;
        SceneParameter::all(&scene)?;
        for note in scene.notes() {
            output::note(&note);
        }
        for finding in scene.unusual() {
            output::warn(&finding.to_string());
        }
        let progress = Progress::new(self.common.quiet);
        let result = compute(
            &scene,
            &RunOptions {
                out: self.out.to_owned(),
                existing: Existing::of(false, self.overwrite),
                interrupt: Some(interrupt::flag()),
                progress: &progress,
                neighbor: None,
                verify: false,
            },
        )?;
        drop(progress);
        for note in &result.notes {
            output::note(note);
        }
        page::write(self.out, &scene, &result)?;
        let table = table(&result).unwrap_or_default();
        let page = self.out.join(page::NAME);
        let text = format!("{table}\nFull report: {}\n", plain(&page.display().to_string()));
        self.common.print_or_write(self.name, &text, &result.document)?;
        Ok(Exit::of(&result.outcome))
    }
}
