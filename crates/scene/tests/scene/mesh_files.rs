//! One block, saved in all the variants that Gmsh, other programs and editors produce. Each file must lead to the same
//! deflection or be rejected with a reason. Binary files are tested in `meshes`.

mod gmsh;
mod remedies;

use std::fs;

use myovib_fem::mesh::{DefectKind, MeshNote};
use myovib_fem::{FemError, Mesh, MshProblem};
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

use gmsh::{Entity, File, block};

/// Returns the scene of a block in a file, clamped at a group and loaded by its weight.
fn scene(group: &str, scale: f64) -> String {
    format!(
        "analysis = \"static\"\n[mesh]\ntype = \"file\"\npath = \"block.msh\"\nscale = {scale:?}\n[solid]\nbulk_modulus = 1e6\n\
         [[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e5\n[[body_force]]\nz = -9.81\n\
         [[fixed]]\ngroup = {group:?}\n[[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.1, 0.0, 0.0]\n"
    )
}

/// Returns the deflection of a block.
fn deflection(content: &str, group: &str, scale: f64) -> Result<f64, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("block.msh"), content).unwrap();
    let text = scene(group, scale);
    let scene = Scene::build("scene.toml", &text, &[], folder.path());
    let scene = scene.map_err(|error| error.to_string())?;
    let out = tempfile::tempdir().unwrap();
    let run = compute(&scene, &RunOptions::into_folder(out.path()));
    let run = run.map_err(|error| error.to_string())?;
    Ok(run.document["results"]["tip"]["u_z"].as_f64().unwrap())
}

#[test]
fn one_block_in_many_files_deflects_alike() {
    let block = block();
    let plain = block.version_4("4.1");
    let exact = deflection(&plain, "fix", 1.0).unwrap();
    let in_4 = |change: &dyn Fn(&mut File)| block.changed(change).version_4("4.1");
    let in_2 = |change: &dyn Fn(&mut File)| block.changed(change).version_2();
    let partitions = |ghosts: bool| {
        move |file: &mut File| {
            let half = file.entities[2].elements.len() / 2;
            let mut second = file.entities[2].clone();
            second.elements.drain(..half);
            second.tag = 12;
            file.entities[2].elements.truncate(half);
            file.entities[2].tag = 11;
            let mut of_ghosts = String::from("0\n");
            if ghosts {
                // The ghost is a copy of an element of the second partition.
                let mut ghost = second.clone();
                ghost.elements.truncate(1);
                (ghost.tag, ghost.groups) = (13, Vec::new());
                file.entities.push(ghost);
                of_ghosts = String::from("1\n13 1\n");
            }
            file.entities.push(second);
            file.sections = format!(
                "$PartitionedEntities\n2\n{of_ghosts}0 0 0 2\n11 3 1 1 1 0 0 0 1 1 1 1 3 0\n12 3 1 1 2 0 0 0 1 1 1 1 3 0\n\
                 $EndPartitionedEntities\n"
            );
        }
    };
    // The file contains elements without groups, as `Mesh.SaveAll` writes them.
    let save_all = |file: &mut File| {
        file.entities.push(Entity::new(0, 1, &[], vec![vec![0]]));
        file.entities.push(Entity::new(1, 1, &[], vec![vec![0, 1]]));
    };
    let files: Vec<(&str, String, &str, f64)> = vec![
        ("2.2", in_2(&|_| ()), "fix", 1.0),
        ("second order", in_4(&File::second_order), "fix", 1.0),
        ("second order, 2.2", in_2(&File::second_order), "fix", 1.0),
        ("all saved", in_4(&save_all), "fix", 1.0),
        ("partitions", in_4(&partitions(false)), "fix", 1.0),
        ("ghosts", in_4(&partitions(true)), "fix", 1.0),
        ("parameters", in_4(&|file| file.parametric = true), "fix", 1.0),
        ("unnamed", in_4(&|file| file.names.clear()), "surface 1", 1.0),
        (
            "names",
            in_4(&|file| file.names[0].2 = "feste Wand \"links\", größer"),
            "feste Wand \"links\", größer",
            1.0,
        ),
        (
            "one name for a surface and the volume",
            in_4(&|file| file.names[2].2 = "fix"),
            "surface fix",
            1.0,
        ),
        ("one name, 2.2", in_2(&|file| file.names[2].2 = "fix"), "surface fix", 1.0),
        (
            "millimeters",
            in_4(&|file| file.points.iter_mut().for_each(|x| *x = x.map(|x| 1e3 * x))),
            "fix",
            1e-3,
        ),
        (
            "groups of points and lines",
            in_4(&|file| {
                file.names.extend([(0, 4, "corner"), (1, 5, "edge")]);
                file.entities.push(Entity::new(0, 1, &[4], vec![vec![0]]));
                file.entities.push(Entity::new(1, 1, &[5], vec![vec![0, 1]]));
            }),
            "fix",
            1.0,
        ),
        (
            "overlapping groups",
            in_4(&|file| {
                file.names.extend([(3, 4, "everything"), (2, 5, "skin")]);
                (0..2).for_each(|i| file.entities[i].groups.push(5));
                file.entities[2].groups.push(4);
            }),
            "fix",
            1.0,
        ),
        (
            "overlapping groups, 2.2",
            in_2(&|file| {
                file.names.push((3, 4, "everything"));
                file.entities[2].groups.push(4);
            }),
            "fix",
            1.0,
        ),
        (
            "periodic",
            in_4(&|file| {
                file.sections = "$Periodic\n1\n2 1 2\nAffine 0\n1\n1 2\n$EndPeriodic\n".into()
            }),
            "fix",
            1.0,
        ),
        ("two volumes", in_4(&File::two_volumes), "fix", 1.0),
        (
            "a volume without group",
            in_4(&|file| {
                file.two_volumes();
                file.entities[3].groups.clear();
            }),
            "fix",
            1.0,
        ),
        ("CRLF", plain.replace('\n', "\r\n"), "fix", 1.0),
        ("blanks at the ends of lines", plain.replace('\n', "  \n"), "fix", 1.0),
        ("byte order mark", format!("\u{feff}{plain}"), "fix", 1.0),
        ("comments", format!("$Comments\nmade by hand\n$EndComments\n{plain}"), "fix", 1.0),
        ("large tags", in_4(&|file| file.tags = [7, 3_000_000_000]), "fix", 1.0),
        (
            "inverted elements",
            in_4(&|file| {
                for entity in &mut file.entities {
                    entity.elements.iter_mut().step_by(2).for_each(|nodes| nodes.swap(0, 1));
                }
            }),
            "fix",
            1.0,
        ),
    ];
    for (name, content, group, scale) in &files {
        let found = deflection(content, group, *scale);
        // The coordinates and the order of sums differ, which causes rounding errors.
        let error = found.as_ref().map_or(f64::NAN, |found| (found / exact - 1.0).abs());
        assert!(error < 1e-8, "{name}: {error:e} {found:?}");
    }
    // The hole and the flat element change the deflection only slightly.
    let hole = in_4(&|file| {
        let i = file.entities[2].elements.len() / 2;
        file.entities[2].elements.remove(i);
    });
    let flat = in_4(&|file| {
        let elements = &mut file.entities[2].elements;
        let own = elements.remove(7);
        let corners: Vec<[f64; 3]> = own.iter().map(|&node| file.points[node]).collect();
        let near = |i: usize| (corners[1][i] + corners[2][i] + corners[3][i]) / 3.0;
        let new = file.points.len();
        file.points.push([0, 1, 2].map(|i| near(i) + 1e-6 * (corners[0][i] - near(i))));
        for i in 0..4 {
            let mut part = own.clone();
            part[i] = new;
            elements.push(part);
        }
    });
    for (name, content) in [("hole", hole), ("flat", flat)] {
        let found = deflection(&content, "fix", 1.0).unwrap();
        assert!((0.9..1.5).contains(&(found / exact)), "{name}: {found} {exact}");
    }
}

/// Checks a surface and a volume with the same name: keys of loads refer to the surface, and keys of materials to the
/// volume.
#[test]
fn a_name_of_two_groups_is_that_of_the_dimension_of_the_key() {
    let named = |names: [&'static str; 2]| {
        block().changed(|file| (file.names[1].2, file.names[2].2) = (names[0], names[1]))
    };
    let pulled = |file: File, load: &str, material: &str| {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("block.msh"), file.version_4("4.1")).unwrap();
        let text = scene("fix", 1.0).replace("density", &format!("group = {material:?}\ndensity"))
            + &format!("[[traction]]\ngroup = {load:?}\nx = 1e3\n");
        let scene = Scene::build("scene.toml", &text, &[], folder.path()).unwrap();
        let out = tempfile::tempdir().unwrap();
        let run = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
        run.document["results"]["tip"]["u_x"].as_f64().unwrap()
    };
    let exact = pulled(named(["tip", "body"]), "tip", "body");
    assert_eq!(pulled(named(["part", "part"]), "part", "part"), exact);
    assert_eq!(pulled(named(["part", "part"]), "surface part", "volume part"), exact);
}

#[test]
fn files_of_other_kinds_are_refused_with_their_reason() {
    let block = block();
    let refused = |content: &str| Mesh::parse_msh(content, "block.msh").unwrap_err();
    let problem = |content: &str| match refused(content) {
        FemError::Msh { problem, .. } => problem,
        error => panic!("{error}"),
    };
    let in_4 = |change: &dyn Fn(&mut File)| block.changed(change).version_4("4.1");
    let version = problem(&block.version_4("4.0"));
    assert_eq!(version, MshProblem::Version("4.0".into()));
    for (dimension, kind) in [(3, 29), (3, 5), (3, 7), (2, 3)] {
        let other = in_4(&|file| {
            let mut own = file.entities.iter_mut();
            own.find(|own| own.dimension == dimension).unwrap().kind = kind;
        });
        assert_eq!(problem(&other), MshProblem::ElementType(kind as i64));
    }
    let surface = in_4(&|file| file.entities[2].elements.clear());
    assert!(matches!(problem(&surface), MshProblem::NotMeshed { .. }));
    let twice = in_4(&|file| file.names[1].2 = "fix");
    assert!(matches!(problem(&twice), MshProblem::Duplicate { .. }));
    let same_node = in_4(&|file| {
        let nodes = &mut file.entities[2].elements[3];
        nodes[3] = nodes[2];
    });
    assert!(matches!(problem(&same_node), MshProblem::DegenerateElement { .. }));
    let plane = |axis: usize, z: f64, slope: f64| {
        let mut file = block.clone();
        file.entities.truncate(1);
        let cross = file.entities[0].elements.clone();
        file.entities = vec![Entity::new(2, 1, &[1], cross)];
        for point in &mut file.points {
            let [_, y, own] = *point;
            *point = [y, own, z + slope * y];
            point.swap(2, axis);
        }
        file.version_4("4.1")
    };
    // The file contains a cross-section in a plane parallel to two axes.
    for (axis, z) in [(2, 0.0), (2, 0.05), (1, 0.0), (0, 0.05)] {
        let mesh = Mesh::parse_msh(plane(axis, z, 0.0), "plane.msh").unwrap();
        assert_eq!(mesh.dimension(), 2);
        let noted = mesh.notes().iter().any(|note| matches!(note, MeshNote::Plane { .. }));
        assert_eq!(noted, axis != 2);
        let area: f64 = (0..mesh.n_elements())
            .map(|i| {
                let [a, b, c] = mesh.corners::<2, 3>(i);
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
            })
            .sum();
        assert!((area - 4e-4).abs() < 1e-15, "{axis}: {area}");
    }
    let found = problem(&plane(1, 0.0, 0.1));
    assert!(matches!(found, MshProblem::NotPlane { .. }), "{found}");
    let defect = |content: &str| match refused(content) {
        FemError::Defect(defect) => defect.kind,
        error => panic!("{error}"),
    };
    let duplicate = in_4(&|file| {
        let first = file.entities[2].elements[0].clone();
        file.entities[2].elements.push(first);
    });
    assert_eq!(defect(&duplicate), DefectKind::Duplicate);
    // The two volumes have separate nodes.
    let unmerged = in_4(&|file| {
        file.two_volumes();
        let n = file.points.len();
        file.points.extend_from_within(..);
        for nodes in &mut file.entities[3].elements {
            nodes.iter_mut().for_each(|node| *node += n);
        }
        for nodes in &mut file.entities[1].elements {
            nodes.iter_mut().for_each(|node| *node += n);
        }
    });
    assert_eq!(defect(&unmerged), DefectKind::Crack);
}
