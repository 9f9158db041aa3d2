//! Table 1 of the paper by computation, and the index under perturbations of a formulation.

use myovib_dae::Problem;
use myovib_fem::{Mesh, generate};
use myovib_model::index::IndexReport;
use myovib_model::table1::{self, Case};
use myovib_model::{Field, Formulation, MuscleDae, Parameters, paper};
use myovib_structure::{Index, Pencil, PencilStructure, Verdict};

/// Width of the gap, in decades, that makes a rank decision decisive; a requirement for the table.
const DECISIVE_DECADES: f64 = 3.0;

/// Checks every row on two meshes at two states: the printed index and, block by block, the rule of `Formulation`.
#[test]
fn the_table_and_our_formulations() {
    let cases = table1::cases();
    assert_eq!(cases.iter().filter(|case| case.printed.is_some()).count(), 9);
    for case in cases {
        let parameters = Parameters::new(paper::ALPHA, case.beta, case.kappa).unwrap();
        let rule = case.formulation.index(&parameters);
        for sample in case.samples().unwrap() {
            let report = &sample.report;
            assert_eq!(report.decided(), Some(usize::from(rule)), "{case:?}");
            assert_eq!(report.decided(), case.printed.or(report.decided()), "{case:?}");
            assert!(report.gap >= DECISIVE_DECADES, "{case:?}: {}", report.gap);
            for (field, found) in &report.blocks {
                let rule = case.formulation.variable_index(*field, &parameters);
                assert_eq!(
                    (found.index, found.verdict),
                    (rule, Verdict::Decisive),
                    "{case:?} {field}"
                );
            }
        }
    }
}

/// The paper's remark: (29) has index 4 in the limit κ → ∞, β → 0. Before the limit it has index 2,
/// with a decreasing gap.
#[test]
fn the_limit_of_29() {
    let reports = table1::limit().unwrap();
    let (toward_limit, limit) = reports.split_at(reports.len() - 1);
    assert_eq!(limit[0].1.decided(), Some(4));
    for pair in toward_limit.windows(2) {
        let [(_, before), (case, after)] = pair else { unreachable!("windows of two") };
        assert!(after.gap < before.gap - 1.0, "{} at kappa = {}", after.gap, case.kappa);
        assert_eq!(before.decided(), Some(2));
    }
}

fn mesh() -> Mesh {
    generate::beam(0.1, 0.04, [3, 2]).unwrap()
}

fn index_of(formulation: Formulation, kappa: f64, beta: f64) -> IndexReport {
    let case = Case { equation: None, law: paper::LAW, formulation, kappa, beta, printed: None };
    case.at_random_state(&mesh(), 7).unwrap()
}

/// Checks, block by block, the rows of (29) with finite κ, which are not in the table.
#[test]
fn the_blocks_of_29_with_a_finite_bulk_modulus() {
    let report = index_of(Formulation::Rate, 1e5, 1e-4);
    let parameters = Parameters::new(paper::ALPHA, 1e-4, 1e5).unwrap();
    for (field, found) in &report.blocks {
        let rule = Formulation::Rate.variable_index(*field, &parameters);
        assert_eq!((found.index, found.verdict), (rule, Verdict::Decisive), "{field}");
    }
}

/// Dropping β or adding 1/κ is detected.
#[test]
fn other_parameters_give_another_index() {
    let infinite = f64::INFINITY;
    for (formulation, before, after, indices) in [
        (Formulation::Position, (infinite, 0.0), (1e5, 0.0), (3, 1)),
        (Formulation::Rate, (infinite, 1e-4), (infinite, 0.0), (3, 4)),
        (Formulation::Rate, (infinite, 1e-4), (1e5, 1e-4), (3, 2)),
        (Formulation::ImplicitRate, (infinite, 1e-4), (infinite, 0.0), (2, 3)),
        (Formulation::Velocity, (infinite, 0.0), (1e5, 0.0), (2, 0)),
    ] {
        let found =
            [before, after].map(|(kappa, beta)| index_of(formulation, kappa, beta).decided());
        assert_eq!(found, [Some(indices.0), Some(indices.1)], "{formulation}");
    }
}

/// The method uses only the matrices: an entry added by hand to the matrices of (28) with κ = ∞
/// changes the index. The index is 1 if the entry fixes all pressures, and stays 3 if one is
/// excluded; a duplicated constraint makes the index undefined.
#[test]
fn a_formulation_perturbed_by_hand() {
    let muscle = paper::muscle(&mesh(), f64::INFINITY, 0.0).unwrap();
    let mut dae = MuscleDae::new(muscle, Formulation::Position).unwrap();
    let rest = vec![0.0; dae.n_unknowns()];
    let pencil = Pencil::linearize(&mut dae, 0.0, &rest, &rest).unwrap();
    let pressures = dae.layout().range(Field::Pressure).unwrap();
    let index = |a| PencilStructure::of(&Pencil::new(pencil.e().clone(), a).unwrap()).index;
    // The size of M_p/κ for κ = 1e5 Pa on this mesh.
    let compliance = 1e-5 * 1e-3;

    assert_eq!(index(pencil.a().clone()), Index::Decided(3));
    let mut held = pencil.a().clone();
    for i in pressures.clone() {
        held[(i, i)] = compliance;
    }
    assert_eq!(index(held.clone()), Index::Decided(1));
    held[(pressures.start, pressures.start)] = 0.0;
    assert_eq!(index(held), Index::Decided(3));

    let mut twice = pencil.a().clone();
    let row = twice.row(pressures.start).into_owned();
    twice.set_row(pressures.start + 1, &row);
    assert_eq!(index(twice), Index::Singular { nullity: 1 });
}
