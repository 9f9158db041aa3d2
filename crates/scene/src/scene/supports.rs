//! The supports of a body: components of nodes that are held or moved.

use std::collections::BTreeMap;

use myovib_fem::Space;
use myovib_model::Signal;

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::SceneFile;
use crate::scene_file::function::Function;
use crate::scene_file::solid::Axis;

/// The names of the components.
pub(super) const NAMES: [&str; 3] = ["x", "y", "z"];

/// The constrained components (node, axis); those that move have their function of time.
pub(super) type Supports = BTreeMap<(usize, usize), Option<Signal>>;

impl Builder<'_> {
    /// What holds or moves the body.
    pub(super) fn supports(&self, file: &SceneFile, space: &Space) -> Result<Supports, InputError> {
        let dimension = space.dimension();
        let mut constrained = Supports::new();
        let mut functions: BTreeMap<(usize, usize), &Function> = BTreeMap::new();
        for (i, fixed) in file.fixed.iter().enumerate() {
            let path = format!("fixed[{i}]");
            let nodes = self.at(&format!("{path}.group"), space.nodes_of(&fixed.group))?;
            let axes: Vec<usize> = match &fixed.components {
                None => (0..dimension).collect(),
                Some(axes) => axes.iter().map(|&axis| index(axis)).collect(),
            };
            for &axis in &axes {
                self.component(axis, dimension, &format!("{path}.components"))?;
            }
            for &node in &nodes {
                constrained.extend(axes.iter().map(|&axis| ((node, axis), None)));
            }
        }
        for (i, moving) in file.displacement.iter().enumerate() {
            let path = format!("displacement[{i}]");
            let nodes = self.at(&format!("{path}.group"), space.nodes_of(&moving.group))?;
            for (axis, path, function) in
                self.components([&moving.x, &moving.y, &moving.z], dimension, &path)?
            {
                let signal = self.motion(function, &path)?;
                let rests = *function == Function::Constant(0.0);
                for &node in &nodes {
                    let component = (node, axis);
                    match constrained.get(&component) {
                        None => {
                            constrained.insert(component, Some(signal.clone()));
                            functions.insert(component, function);
                        }
                        // Two groups that say the same share nodes.
                        Some(None) if rests => {}
                        Some(_) if functions.get(&component) == Some(&function) => {}
                        Some(_) => {
                            let place = space.node_point(node).iter().map(|x| format!("{x:.6}"));
                            let error = InputError::new(format!(
                                "the {} component at ({}) is held or moved twice",
                                NAMES[axis],
                                place.collect::<Vec<_>>().join(", ")
                            ))
                            .next("take one of the two groups, or give them other nodes");
                            return Err(self.wrong(&path, error));
                        }
                    }
                }
            }
        }
        if constrained.is_empty() && file.bed.iter().all(|bed| bed.stiffness == 0.0) {
            let error = InputError::new("nothing holds the body")
                .next("add a [[fixed]] with the group of the nodes that do not move, or a [[bed]]");
            return Err(self.wrong("", error));
        }
        Ok(constrained)
    }

    /// A function of time that a displacement can follow from rest.
    fn motion(&self, function: &Function, path: &str) -> Result<Signal, InputError> {
        let signal = self.signal(function, path)?;
        match signal.unfit_for_motion() {
            Some(objection) => {
                let error =
                    InputError::new(format!("no displacement can follow this: {objection}"));
                Err(self.wrong(path, error))
            }
            None => Ok(signal),
        }
    }

    /// The components that are given, one at least, with their axis and path.
    pub(super) fn components<'f>(
        &self,
        given: [&'f Option<Function>; 3],
        dimension: usize,
        path: &str,
    ) -> Result<Vec<(usize, String, &'f Function)>, InputError> {
        if given.iter().all(|function| function.is_none()) {
            let error = InputError::new("none of its components is given").next(format!(
                "give one at least: {}",
                NAMES[..dimension].join(", ")
            ));
            return Err(self.wrong(path, error));
        }
        let given = given.into_iter().enumerate();
        let given = given.filter_map(|(axis, function)| Some((axis, function.as_ref()?)));
        given
            .map(|(axis, function)| {
                let path = format!("{path}.{}", NAMES[axis]);
                self.component(axis, dimension, &path)?;
                Ok((axis, path, function))
            })
            .collect()
    }

    /// Refuses a third component in the plane.
    pub(super) fn component(
        &self,
        axis: usize,
        dimension: usize,
        path: &str,
    ) -> Result<(), InputError> {
        if axis < dimension {
            return Ok(());
        }
        let error = InputError::new("a plane body has no z component: its mesh is of triangles")
            .allowed("x, y");
        Err(self.wrong(path, error))
    }
}

/// The number of a component.
pub(super) fn index(axis: Axis) -> usize {
    match axis {
        Axis::X => 0,
        Axis::Y => 1,
        Axis::Z => 2,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::Scene;

    /// What is said of a square that is held on its left and moved as told.
    fn refusal(moved: &str) -> Option<String> {
        let text = format!(
            "[time]\nend = 0.1\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [1, 1]\n\
             [solid]\nkappa = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
             [[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n{moved}"
        );
        let built = Scene::build("scene.toml", &text, &[], Path::new(""));
        built.err().map(|error| error.to_string())
    }

    /// Regression: 0 and 0 were taken for two motions of one node.
    #[test]
    fn a_node_that_is_told_the_same_twice_is_no_conflict() {
        let moved = |group: &str, axis: &str, function: &str| {
            format!("[[displacement]]\ngroup = \"{group}\"\n{axis} = {function}\n")
        };
        let step = "{ type = \"step\", value = 0.1, rise = 0.1 }";
        let both = |y: &str| moved("left", "y", y) + &moved("bottom", "y", y);
        assert_eq!(refusal(&moved("left", "x", "0.0")), None);
        assert_eq!(refusal(&both("0.0")), None);
        assert_eq!(refusal(&both(step)), None);
        for two in [
            moved("left", "x", step),
            moved("left", "y", "0.0") + &moved("bottom", "y", step),
        ] {
            let said = refusal(&two).expect("two motions");
            assert!(said.contains("is held or moved twice"), "{said}");
        }
    }
}
