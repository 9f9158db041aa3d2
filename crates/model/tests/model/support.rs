//! Checks that parts that can move without strain are named in messages. Regression: with both supports fixed only in
//! x, `check` and `modes` did not finish, and statics reported a limit load.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use myovib_fem::{DofMap, Group, Law, Mesh, Solid, Space, generate};
use myovib_model::{
    Formulation, InitialValues, Muscle, MuscleDae, Parameters, Prescribed, Settings, Signal, check,
    spectrum, statics, support,
};

/// Creates a body on `mesh` in which the components `axes` of the nodes of the groups are fixed.
fn body(mesh: &Mesh, groups: &[&str], axes: &[usize], kappa: f64) -> Muscle {
    let space = Arc::new(Space::taylor_hood(mesh));
    let mut held = Vec::new();
    for group in groups {
        let nodes = space.nodes_of(group).expect("a valid body");
        held.extend(nodes.iter().flat_map(|&n| axes.iter().map(move |&a| (n, a))));
    }
    let dofs = DofMap::new(&space, &held).expect("a valid body");
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = Solid::uniform(space, dofs, law, 1.1e3).expect("a valid body");
    Muscle::unloaded(solid, Parameters::new(1.0, 1e-4, kappa).expect("a valid body"))
}

fn block() -> Mesh {
    generate::rectangle([0.0, 0.0], [0.2, 0.04], [10, 2]).expect("a valid body")
}

#[test]
fn supports_of_one_component_leave_a_slide() {
    for kappa in [1e5, f64::INFINITY] {
        let muscle = body(&block(), &["left", "right"], &[0], kappa);
        assert_eq!(
            statics::equilibrium(&muscle, Formulation::Position, 0.0).unwrap_err().to_string(),
            "the supports do not fix the body: the body can slide in y; \
             fix more components or more nodes of each part"
        );
        let found = spectrum::lowest(&muscle, &statics::Equilibrium::unloaded(&muscle), 4).unwrap();
        let frequencies: Vec<f64> = found.iter().map(|m| m.frequency().unwrap()).collect();
        assert_eq!(frequencies[0], 0.0);
        assert!(frequencies[1] > 1.0, "{frequencies:?}");
        let report = check::check(
            &muscle,
            Formulation::ImplicitRate,
            &Settings::paper(Formulation::ImplicitRate),
            None,
        )
        .unwrap();
        let words: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
        assert!(
            words.iter().any(|w| w.starts_with(
                "1 rigid motion is not constrained: the body can slide in y. Remedy:"
            )),
            "{words:?}"
        );
    }
}

/// Checks that a body without supports has three plane motions without strain, and that the next
/// modes are those of a free–free beam.
#[test]
fn a_body_without_supports_has_three() {
    let muscle = body(&block(), &[], &[], 1e5);
    let found = spectrum::lowest(&muscle, &statics::Equilibrium::unloaded(&muscle), 4).unwrap();
    let squares: Vec<f64> = found.iter().map(|m| m.omega_squared).collect();
    assert_eq!(&squares[..3], [0.0; 3]);
    assert!(squares[3] > 1.0, "{squares:?}");
    let free = support::free_parts(&muscle).unwrap();
    assert_eq!((free.count, free.parts.len()), (3, 1));
}

/// Returns two adjacent blocks that share no node or one node.
fn two_blocks(joined: bool) -> Mesh {
    let (one, cells) = (block(), 40);
    let mut points = one.points::<2>().to_vec();
    let mut triangles = one.connectivity::<3>().to_vec();
    let shift = points.len();
    let gap = if joined { 0.2 } else { 0.3 };
    // The upper left corner of the second block coincides with the upper right corner of the first.
    points.extend(one.points::<2>().iter().map(|[x, y]| [x + gap, y + 0.04]));
    triangles.extend(one.connectivity::<3>().iter().map(|t| t.map(|v| v + shift)));
    if joined {
        let at = |points: &[[f64; 2]], v: usize, place: [f64; 2]| {
            (points[v][0] - place[0]).hypot(points[v][1] - place[1]) < 1e-12
        };
        let corner = |range: std::ops::Range<usize>| {
            range.into_iter().find(|&v| at(&points, v, [0.2, 0.04])).expect("a valid mesh")
        };
        let (kept, merged) = (corner(0..shift), corner(shift..points.len()));
        points.remove(merged);
        for v in triangles.iter_mut().flatten() {
            *v = match *v {
                v if v == merged => kept,
                v if v > merged => v - 1,
                v => v,
            };
        }
    }
    assert_eq!(triangles.len(), 2 * cells);
    let left = one.group("left").expect("a valid mesh").clone();
    Mesh::new(points, triangles, BTreeMap::from([("left".to_owned(), left)])).expect("a valid mesh")
}

#[test]
fn parts_are_counted_and_named() {
    let held = |joined| support::free_parts(&body(&two_blocks(joined), &["left"], &[0, 1], 1e5));
    let apart = held(false).unwrap();
    assert_eq!(apart.count, 3);
    assert_eq!(
        apart.to_string(),
        "a part of 40 elements near (0.400, 0.060) can slide in x and slide in y \
         and turn about (0.4, 0.06)"
    );
    let hinged = held(true).unwrap();
    assert_eq!(hinged.count, 1);
    assert_eq!(
        hinged.to_string(),
        "a part of 40 elements near (0.300, 0.060) can turn about (0.2, 0.04)"
    );
    assert_eq!(support::free_parts(&body(&block(), &["left"], &[0, 1], 1e5)), None);
}

#[test]
fn a_group_of_one_pin_leaves_a_turn() {
    let mut groups = block().groups().clone();
    groups.insert("pin".to_owned(), Group::Points(vec![0]));
    let mesh = block().with_groups(groups).unwrap();
    let free = support::free_parts(&body(&mesh, &["pin"], &[0, 1], 1e5)).unwrap();
    assert_eq!(free.to_string(), "the body can turn about (0, 0)");
}

/// Regression: for a body whose entire boundary is fixed, the message named elements as the cause, and `check` printed
/// modes at "NaN Hz".
#[test]
fn a_fixed_boundary_leaves_the_pressure_level_undetermined() {
    let printed = |groups: &[&str], kappa: f64| {
        let muscle = body(&block(), groups, &[0, 1], kappa);
        let report = check::check_static(&muscle, Formulation::Position, 0.0).unwrap();
        let quick = check::static_warnings(&muscle, Formulation::Position);
        assert_eq!(quick, report.findings);
        quick.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let all = ["left", "right", "top", "bottom"];
    let level = printed(&all, f64::INFINITY);
    assert!(level.len() == 1 && level[0].contains("pressure"), "{level:?}");
    assert_eq!(printed(&all[..3], f64::INFINITY), Vec::<String>::new());
    assert_eq!(printed(&all, 1e5), Vec::<String>::new());
}

#[test]
fn a_body_has_the_size_of_its_mesh() {
    let size = check::Size::of(&body(&block(), &["left"], &[0, 1], 1e5));
    let found = [size.extents[0], size.extents[1], size.volume, size.mass];
    let expected = [0.2, 0.04, 8e-3, 1.1e3 * 8e-3];
    for (found, expected) in found.iter().zip(expected) {
        // Rounding of sums over forty elements.
        assert!((found / expected - 1.0).abs() < 1e-13, "{size:?}");
    }
}

/// Regression: `check` evaluated the undeformed body with displaced supports, which inverts the elements beside them if the
/// displacement, 0.06 m, exceeds their size, 0.05 m.
#[test]
fn a_body_whose_support_is_displaced_by_more_than_an_element_is_checked() {
    let formulation = Formulation::ImplicitRate;
    let coarse = generate::rectangle([0.0, 0.0], [0.2, 0.1], [4, 2]).expect("a valid body");
    let mut muscle = body(&coarse, &["left", "right"], &[0, 1], f64::INFINITY);
    let right = muscle.solid.space().nodes_of("right").unwrap();
    let moved = |node: &usize| Prescribed { component: 2 * node, signal: Signal::constant(-0.06) };
    muscle.prescribed = right.iter().map(moved).collect();
    let mut dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
    let start =
        InitialValues::equilibrium(&mut dae, 0.0, &mut |_| ControlFlow::Continue(())).unwrap();
    let settings = Settings::paper(formulation);
    let report =
        check::check(&muscle, formulation, &settings, Some([start.y, start.y_dot])).unwrap();
    assert_eq!(report.computed_on, check::Computed::Here);
}
