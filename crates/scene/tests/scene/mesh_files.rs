//! One block, saved in the ways in which Gmsh, other programs and editors save it. Each file is read to the same deflection, or
//! refused with its reason. Binary files are tested with the meshes of other versions.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use myovib_fem::mesh::DefectKind;
use myovib_fem::{FemError, Mesh, MshProblem};
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

/// Cells of the block along x.
const CELLS: usize = 4;

/// Parts of a Gmsh file.
#[derive(Clone)]
struct File {
    points: Vec<[f64; 3]>,
    /// Dimension, tag and name of physical groups.
    names: Vec<(usize, usize, &'static str)>,
    /// Elements of each entity.
    entities: Vec<Entity>,
    /// Sections before the nodes.
    sections: String,
    /// Number words after the coordinates of a node.
    parametric: bool,
    /// Distance of the tags of nodes, and of the first from 1.
    tags: [usize; 2],
}

#[derive(Clone)]
struct Entity {
    dimension: usize,
    tag: usize,
    /// Physical groups.
    groups: Vec<usize>,
    /// Element type.
    kind: usize,
    /// Numbers of nodes from 0.
    elements: Vec<Vec<usize>>,
}

impl Entity {
    fn new(dimension: usize, tag: usize, groups: &[usize], elements: Vec<Vec<usize>>) -> Self {
        Self {
            dimension,
            tag,
            groups: groups.to_vec(),
            kind: [15, 1, 2, 4][dimension],
            elements,
        }
    }
}

/// The block of 0.1 by 0.02 by 0.02 m with the groups `fix` and `tip` at its ends and `body`.
fn block() -> File {
    let number = |[i, j, k]: [usize; 3]| i + (CELLS + 1) * (j + 2 * k);
    let step = 0.1 / CELLS as f64;
    let mut points = vec![[0.0; 3]; 4 * (CELLS + 1)];
    for (i, j, k) in (0..4 * (CELLS + 1)).map(|n| (n / 4, n / 2 % 2, n % 2)) {
        points[number([i, j, k])] = [step * i as f64, 0.02 * j as f64, 0.02 * k as f64];
    }
    let mut tetrahedra = Vec::new();
    let mut ends = [Vec::new(), Vec::new()];
    for i in 0..CELLS {
        for order in [
            [0, 1, 2],
            [1, 2, 0],
            [2, 0, 1],
            [0, 2, 1],
            [2, 1, 0],
            [1, 0, 2],
        ] {
            let mut corners = vec![[i, 0, 0]];
            for axis in order {
                let mut next = corners[corners.len() - 1];
                next[axis] += 1;
                corners.push(next);
            }
            if (order[1] + 3 - order[0]) % 3 == 2 {
                corners.swap(0, 1);
            }
            for (end, x) in ends.iter_mut().zip([0, CELLS]) {
                let face = corners.iter().filter(|corner| corner[0] == x);
                let face: Vec<usize> = face.map(|&corner| number(corner)).collect();
                if face.len() == 3 {
                    end.push(face);
                }
            }
            tetrahedra.push(corners.into_iter().map(number).collect());
        }
    }
    let [fix, tip] = ends;
    File {
        points,
        names: vec![(2, 1, "fix"), (2, 2, "tip"), (3, 3, "body")],
        entities: vec![
            Entity::new(2, 1, &[1], fix),
            Entity::new(2, 2, &[2], tip),
            Entity::new(3, 1, &[3], tetrahedra),
        ],
        sections: String::new(),
        parametric: false,
        tags: [1, 0],
    }
}

impl File {
    fn changed(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut file = self.clone();
        change(&mut file);
        file
    }

    fn tag(&self, node: usize) -> usize {
        self.tags[0] * (node + 1) + self.tags[1]
    }

    fn head(&self, version: &str) -> String {
        let mut text = format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n");
        if !self.names.is_empty() {
            writeln!(text, "$PhysicalNames\n{}", self.names.len()).unwrap();
            for (dimension, tag, name) in &self.names {
                writeln!(text, "{dimension} {tag} \"{name}\"").unwrap();
            }
            text += "$EndPhysicalNames\n";
        }
        text
    }

    fn coordinates(&self, node: usize) -> String {
        let [x, y, z] = self.points[node];
        let parameter = if self.parametric { " 0.5" } else { "" };
        format!("{x:?} {y:?} {z:?}{parameter}\n")
    }

    /// Formats the file in version 4.1, or under another `version`.
    fn version_4(&self, version: &str) -> String {
        let mut text = self.head(version) + "$Entities\n";
        let of = |dimension| {
            self.entities
                .iter()
                .filter(move |e| e.dimension == dimension)
        };
        let counts: Vec<String> = (0..4).map(|d| of(d).count().to_string()).collect();
        writeln!(text, "{}", counts.join(" ")).unwrap();
        for entity in (0..4).flat_map(of) {
            let place = ["0 0 0", "0 0 0 1 1 1"][entity.dimension.min(1)];
            let groups: Vec<String> = entity.groups.iter().map(usize::to_string).collect();
            let end = if entity.dimension == 0 { "" } else { " 0" };
            let (tag, n) = (entity.tag, groups.len());
            writeln!(text, "{tag} {place} {n} {}{end}", groups.join(" ")).unwrap();
        }
        text += "$EndEntities\n";
        text += &self.sections;
        let n = self.points.len();
        let parametric = u8::from(self.parametric);
        writeln!(
            text,
            "$Nodes\n1 {n} {} {}\n3 1 {parametric} {n}",
            self.tag(0),
            self.tag(n - 1)
        )
        .unwrap();
        for node in 0..n {
            writeln!(text, "{}", self.tag(node)).unwrap();
        }
        (0..n).for_each(|node| text += &self.coordinates(node));
        let n: usize = self.entities.iter().map(|e| e.elements.len()).sum();
        writeln!(
            text,
            "$EndNodes\n$Elements\n{} {n} 1 {n}",
            self.entities.len()
        )
        .unwrap();
        let mut number = 0;
        for Entity {
            dimension,
            tag,
            kind,
            elements,
            ..
        } in &self.entities
        {
            writeln!(text, "{dimension} {tag} {kind} {}", elements.len()).unwrap();
            for nodes in elements {
                number += 1;
                writeln!(text, "{number} {}", self.words(nodes)).unwrap();
            }
        }
        text + "$EndElements\n"
    }

    fn version_2(&self) -> String {
        let mut text = self.head("2.2");
        writeln!(text, "$Nodes\n{}", self.points.len()).unwrap();
        for node in 0..self.points.len() {
            write!(text, "{} {}", self.tag(node), self.coordinates(node)).unwrap();
        }
        let n: usize = self
            .entities
            .iter()
            .map(|e| e.elements.len() * e.groups.len())
            .sum();
        writeln!(text, "$EndNodes\n$Elements\n{n}").unwrap();
        let mut number = 0;
        for entity in &self.entities {
            for (nodes, group) in entity
                .elements
                .iter()
                .flat_map(|e| entity.groups.iter().map(move |g| (e, g)))
            {
                number += 1;
                let (kind, tag) = (entity.kind, entity.tag);
                writeln!(
                    text,
                    "{number} {kind} 2 {group} {tag} {}",
                    self.words(nodes)
                )
                .unwrap();
            }
        }
        text + "$EndElements\n"
    }

    fn words(&self, nodes: &[usize]) -> String {
        let tags: Vec<String> = nodes
            .iter()
            .map(|&node| self.tag(node).to_string())
            .collect();
        tags.join(" ")
    }

    /// Adds midside nodes.
    fn second_order(&mut self) {
        let mut middles = BTreeMap::new();
        for entity in &mut self.entities {
            let edges: &[[usize; 2]] = match entity.dimension {
                2 => &[[0, 1], [1, 2], [2, 0]],
                _ => &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
            };
            entity.kind = if entity.dimension == 2 { 9 } else { 11 };
            for nodes in &mut entity.elements {
                for [a, b] in edges {
                    let mut ends = [nodes[*a], nodes[*b]];
                    ends.sort_unstable();
                    let points = &mut self.points;
                    let middle = *middles.entry(ends).or_insert_with(|| {
                        let [a, b] = ends.map(|end| points[end]);
                        points.push([0, 1, 2].map(|i| 0.5 * (a[i] + b[i])));
                        points.len() - 1
                    });
                    nodes.push(middle);
                }
            }
        }
    }

    /// Moves the second half of the block to a volume of its own.
    fn two_volumes(&mut self) {
        let half = self.entities[2].elements.len() / 2;
        let second = self.entities[2].elements.split_off(half);
        self.entities.push(Entity::new(3, 2, &[3], second));
    }
}

/// Scene of a block in a file, clamped at a group and loaded by its weight.
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
                // A copy of an element of the second partition.
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
    // Elements without groups, as `Mesh.SaveAll` writes them.
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
        (
            "parameters",
            in_4(&|file| file.parametric = true),
            "fix",
            1.0,
        ),
        (
            "unnamed",
            in_4(&|file| file.names.clear()),
            "surface 1",
            1.0,
        ),
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
        (
            "one name, 2.2",
            in_2(&|file| file.names[2].2 = "fix"),
            "surface fix",
            1.0,
        ),
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
                file.entities
                    .push(Entity::new(1, 1, &[5], vec![vec![0, 1]]));
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
        (
            "blanks at the ends of lines",
            plain.replace('\n', "  \n"),
            "fix",
            1.0,
        ),
        ("byte order mark", format!("\u{feff}{plain}"), "fix", 1.0),
        (
            "comments",
            format!("$Comments\nmade by hand\n$EndComments\n{plain}"),
            "fix",
            1.0,
        ),
        (
            "large tags",
            in_4(&|file| file.tags = [7, 3_000_000_000]),
            "fix",
            1.0,
        ),
        (
            "inverted elements",
            in_4(&|file| {
                for entity in &mut file.entities {
                    entity
                        .elements
                        .iter_mut()
                        .step_by(2)
                        .for_each(|nodes| nodes.swap(0, 1));
                }
            }),
            "fix",
            1.0,
        ),
    ];
    for (name, content, group, scale) in &files {
        let found = deflection(content, group, *scale);
        // Coordinates, and the order of sums, differ by rounding.
        let error = found
            .as_ref()
            .map_or(f64::NAN, |found| (found / exact - 1.0).abs());
        assert!(error < 1e-8, "{name}: {error:e} {found:?}");
    }
    // A hole and a flat element change the deflection, but not much.
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
        file.points
            .push([0, 1, 2].map(|i| near(i) + 1e-6 * (corners[0][i] - near(i))));
        for i in 0..4 {
            let mut part = own.clone();
            part[i] = new;
            elements.push(part);
        }
    });
    for (name, content) in [("hole", hole), ("flat", flat)] {
        let found = deflection(&content, "fix", 1.0).unwrap();
        assert!(
            (0.9..1.5).contains(&(found / exact)),
            "{name}: {found} {exact}"
        );
    }
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
    assert!(matches!(
        problem(&same_node),
        MshProblem::DegenerateElement { .. }
    ));
    let plane = |axis: usize, z: f64| {
        let mut file = block.clone();
        file.entities.truncate(1);
        let cross = file.entities[0].elements.clone();
        file.entities = vec![Entity::new(2, 1, &[1], cross)];
        for point in &mut file.points {
            let [_, y, own] = *point;
            *point = [y, own, z];
            point.swap(2, axis);
        }
        file.version_4("4.1")
    };
    assert!(Mesh::parse_msh(plane(2, 0.0), "plane.msh").is_ok());
    for (axis, z) in [(2, 0.05), (1, 0.0)] {
        let found = problem(&plane(axis, z));
        assert!(matches!(found, MshProblem::NotPlane { .. }), "{found}");
    }
    let defect = |content: &str| match refused(content) {
        FemError::Defect(defect) => defect.kind,
        error => panic!("{error}"),
    };
    let duplicate = in_4(&|file| {
        let first = file.entities[2].elements[0].clone();
        file.entities[2].elements.push(first);
    });
    assert_eq!(defect(&duplicate), DefectKind::Duplicate);
    // Two volumes with separate nodes.
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
