//! Slurm job script of a sweep.

use std::path::{Path, PathBuf};

use myovib_scene::sweep::rehearse;
use serde::Serialize;

use super::SweepArgs;
use crate::output::{self, JOB_SCRIPT};

/// Job script that was written.
#[derive(Debug, Serialize)]
pub(super) struct Jobs {
    script: PathBuf,
    cases: usize,
    tasks: usize,
}

impl Jobs {
    pub(super) fn text(&self) -> String {
        let Self { script, cases, tasks } = self;
        let script = script.display();
        format!("{cases} cases in {tasks} tasks. Submit them: sbatch {script}\n")
    }
}

/// Writes the script to `file` and returns its description.
pub(super) fn write(args: &SweepArgs, file: &Path) -> anyhow::Result<Jobs> {
    // An invalid scene is reported now instead of later by the task that runs it.
    let n = rehearse(&args.scene, &args.set, &args.vary, args.common.n_threads())?;
    let per_task = args.per_task.get();
    let program = std::env::current_exe()?;
    let sweep = command(args, &program.display().to_string());
    let out = quoted(&args.out.display().to_string());
    let script = format!(
        "{JOB_SCRIPT}\
         # {n} cases, {per_task} per task. Submit it with sbatch.\n\
         # Submit it again if tasks were killed or failed: completed cases are not computed again.\n\
         # When all tasks have ended, run this script with --collect to write the table.\n\
         #SBATCH --job-name=myovib\n\
         #SBATCH --array=1-{n_tasks}\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --output=%x-%A_%a.txt\n\
         set -eu\n\
         if [ \"${{1-}}\" = --collect ]; then exec {sweep} --collect; fi\n\
         mkdir -p -- {out}\n\
         first=$(( (SLURM_ARRAY_TASK_ID - 1) * {per_task} + 1 ))\n\
         last=$(( first + {per_task} - 1 ))\n\
         if (( last > {n} )); then last={n}; fi\n\
         exec {sweep} --threads 1 --quiet --case \"$first-$last/{n}\"\n",
        n_tasks = n.div_ceil(per_task),
    );
    output::save(file, script)?;
    Ok(Jobs { script: file.to_owned(), cases: n, tasks: n.div_ceil(per_task) })
}

/// Returns the command line of the sweep, without the options that select cases.
fn command(args: &SweepArgs, program: &str) -> String {
    let mut words = vec![quoted(program), "sweep".to_owned()];
    words.push(quoted(&args.scene.display().to_string()));
    for (option, values) in
        [("--vary", &args.vary), ("--set", &args.set), ("--result", &args.result)]
    {
        words.extend(values.iter().flat_map(|v| [option.to_owned(), quoted(v)]));
    }
    words.push(format!("--out {}", quoted(&args.out.display().to_string())));
    words.join(" ")
}

/// Quotes a word for the shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/=:,+@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}
