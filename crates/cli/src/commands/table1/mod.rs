//! `myovib table1`: the indices in the paper's Table 1, computed from matrices.

mod document;
mod text;

use clap::Args;
use myovib_fem::{Law, generate};
use myovib_model::counterexample::{self, MultiplierSpace};
use myovib_model::index::IndexReport;
use myovib_model::table1::{self, Case, Sample};
use myovib_structure::Verdict;

use crate::args::CommonArgs;
use crate::exit::Exit;

pub(super) use document::report_json;

/// Options of `myovib table1`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib table1\n  \
    myovib table1 --json=t1.json\n\n\
    Every index is computed from the matrices alone, on two meshes and at two random, consistent \
    states of large strain. The exit code is 1 if an index differs from the paper's or is undecided.")]
pub struct Table1Args {
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Case with its samples.
struct RowResult {
    case: Case,
    samples: Vec<Sample>,
}

impl RowResult {
    /// Returns the index if all samples agree.
    fn index(&self) -> Option<usize> {
        let first = self.samples.first()?.report.decided();
        let agree = self.samples.iter().all(|s| s.report.decided() == first);
        first.filter(|_| agree)
    }

    /// Returns the smallest gap among all samples.
    fn gap(&self) -> f64 {
        let gaps = self.samples.iter().map(|sample| sample.report.gap);
        gaps.fold(f64::INFINITY, f64::min)
    }

    /// Returns whether the computed index matches the printed one, or `None` if the paper does not print an index.
    fn agrees(&self) -> Option<bool> {
        let printed = self.case.printed?;
        Some(self.index() == Some(printed))
    }

    /// Returns the index of a block if all samples agree; otherwise, returns `?`.
    fn block(&self, symbol: &str) -> String {
        let mut found = self.samples.iter().map(|s| block(&s.report, symbol));
        let first = found.next().flatten();
        match first {
            None => String::new(),
            Some(text) if found.all(|other| other.as_deref() == Some(&text)) => text,
            Some(_) => "?".into(),
        }
    }
}

/// Returns the index of the block with this name. A question mark follows if the gap between the singular values of the
/// block is not decisive.
fn block(report: &IndexReport, name: &str) -> Option<String> {
    let (_, found) = report.blocks.iter().find(|(f, _)| f.name() == name)?;
    let doubt = if found.verdict == Verdict::Decisive { "" } else { "?" };
    Some(format!("{}{doubt}", found.index))
}

pub fn run(args: &Table1Args) -> anyhow::Result<Exit> {
    let rows = table1::cases()
        .into_iter()
        .map(|case| {
            let samples = case.samples()?;
            Ok(RowResult { case, samples })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let limit = table1::limit()?;
    let mesh = generate::beam(0.1, 0.04, [4, 2])?;
    let matching = counterexample::solve(&mesh, MultiplierSpace::Linear)?;
    let richer = counterexample::solve(&mesh, MultiplierSpace::Quadratic)?;
    let document = document::document(&rows, &limit, [&matching, &richer]);
    let mut text = text::table(&rows, &limit);
    text.push_str(&text::counterexample(&matching, &richer));
    args.common.print_or_write("table1", &text, &document)?;
    let settled = rows.iter().all(|row| row.index().is_some() && row.agrees() != Some(false));
    Ok(if settled { Exit::Done } else { Exit::Differs })
}

fn law_name(law: Law) -> &'static str {
    if law.is_linear() { "small strain" } else { "Mooney–Rivlin" }
}

#[cfg(test)]
mod tests {
    use myovib_model::{Muscle, Signal, paper, table1};
    use myovib_scene::{Scene, mesh_file};

    /// Returns all values that define a muscle, at full precision, as text.
    fn data(muscle: &Muscle) -> String {
        let solid = &muscle.solid;
        let body = (solid.space().mesh(), solid.dofs(), solid.laws(), solid.mass_values());
        format!("{body:?} {:?} {:?}", muscle.parameters, muscle.loads)
    }

    #[test]
    fn the_linear_rows_are_those_of_their_scenes() {
        let (mesh, _) = mesh_file::load(None).unwrap();
        let cases = table1::cases();
        let linear: Vec<_> = cases.iter().filter(|c| c.equation == Some("26")).collect();
        assert_eq!(linear.len(), 4);
        for case in linear {
            let kappa = if case.kappa.is_finite() { "finite" } else { "inf" };
            let beta = if case.beta > 0.0 { "damped" } else { "undamped" };
            let name = format!("table1-26-{kappa}-{beta}");
            let body = Scene::built_in(&name, &[]).unwrap().body.unwrap();
            let load = Signal::paper(paper::LOAD_AMPLITUDE);
            let ours =
                paper::muscle_with_load(&mesh, case.law, case.kappa, case.beta, load).unwrap();
            // The data is too long to be printed in a failure message.
            assert!(data(&body.muscle) == data(&ours), "{name}: the bodies differ");
            // Without damping, (26) equals (28) with the linear law.
            let index = body.formulation.index(&body.muscle.parameters);
            assert_eq!(Some(usize::from(index)), case.printed, "{name}");
        }
    }
}
