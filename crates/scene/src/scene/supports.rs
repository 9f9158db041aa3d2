//! Supports of a body: fixed or moved displacement components of nodes.

use std::collections::BTreeMap;

use myovib_fem::Space;
use myovib_model::Signal;
use num_complex::Complex64;

use super::builder::Builder;
use super::places::written;
use crate::InputError;
use crate::scene_file::Analysis;
use crate::scene_file::function::Function;
use crate::scene_file::response::Amplitudes;
use crate::scene_file::solid::{PrescribedDisplacement, Rotation};

pub(crate) const NAMES: [&str; 3] = ["x", "y", "z"];

/// Tolerance within which factors of a distribution count as equal or zero, relative to the largest factor of the
/// group. It covers rounding of node coordinates in mesh files, and rounding of expressions of these coordinates.
const EQUAL_FACTORS: f64 = 1e-10;

/// Constrained components (node, axis).
pub(super) type Supports = BTreeMap<(usize, usize), Support>;

/// Motion of a constrained component.
pub(super) struct Support {
    /// Function of time; `None` for a fixed component.
    pub(super) signal: Option<Signal>,
    /// Amplitude (m) of the harmonic motion in a response.
    pub(super) amplitude: Complex64,
}

/// A prescribed component of a load or displacement.
pub(super) struct Component<'f> {
    pub(super) axis: usize,
    pub(super) path: String,
    pub(super) function: Option<&'f Function>,
    /// Amplitude of the harmonic part in a response.
    pub(super) amplitude: Complex64,
}

/// Motions that groups require of the components (node, axis). Each group contributes its name and the terms of its
/// motion. A fixed group has no terms, and its name is not stored.
type Requirements<'f> = BTreeMap<(usize, usize), Vec<(Option<&'f str>, Terms)>>;
/// Terms whose sum is a required motion. Each term contains the index of a displacement in the list of [`Move`]s, and a
/// factor.
type Terms = Vec<(usize, f64)>;

struct Move<'f> {
    component: Component<'f>,
    signal: Signal,
    /// Part of the rotation if the displacement is a rotation.
    turn: Option<Turn>,
    /// Largest |factor| at the nodes of the group. For a rotation, this includes all components.
    largest_factor: f64,
}

/// Part of a rotation by θ: sin θ times the velocity of a unit rotation, or cos θ − 1 times the vector from the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    Sine,
    CosineLessOne,
}

impl<'a> Builder<'a> {
    pub(super) fn supports(&self, space: &Space) -> Result<Supports, InputError> {
        let mut required = Requirements::new();
        self.require_fixed(space, &mut required)?;
        let moves = self.require_motions(space, &mut required)?;
        let mut constrained = Supports::new();
        for ((node, axis), groups) in required {
            let terms = &groups[0].1;
            let other = groups.iter().find(|(_, other)| !alike(&moves, terms, other));
            if let Some((_, other)) = other {
                let last = terms.iter().chain(other).map(|term| term.0).max();
                let error = InputError::new(format!(
                    "the {} component at ({}) has two different prescribed motions",
                    NAMES[axis],
                    written(space.node_point(node))
                ))
                .next("remove one group, or use separate nodes or the same motion");
                let path = last.map_or("", |last| &moves[last].component.path);
                return Err(self.wrong(path, error));
            }
            constrained.insert((node, axis), support(&moves, terms));
        }
        Ok(constrained)
    }

    /// Adds the motions that fixed groups require.
    fn require_fixed(
        &self,
        space: &Space,
        required: &mut Requirements<'_>,
    ) -> Result<(), InputError> {
        let dimension = space.dimension();
        for (i, fixed) in self.file.fixed.iter().enumerate() {
            let path = format!("fixed[{i}]");
            let nodes = self.at(&format!("{path}.group"), space.nodes_of(&fixed.group))?;
            let axes: Vec<usize> = match &fixed.components {
                None => (0..dimension).collect(),
                Some(axes) => axes.iter().map(|&axis| axis as usize).collect(),
            };
            for &axis in &axes {
                self.component(axis, dimension, &format!("{path}.components"))?;
                for &node in &nodes {
                    let groups = required.entry((node, axis)).or_default();
                    groups.push((None, vec![]));
                }
            }
        }
        Ok(())
    }

    /// Adds the motions that prescribed displacements require. Returns the list of displacements to which the terms
    /// refer.
    fn require_motions(
        &self,
        space: &Space,
        required: &mut Requirements<'a>,
    ) -> Result<Vec<Move<'a>>, InputError> {
        let dimension = space.dimension();
        let mut moves: Vec<Move<'a>> = Vec::new();
        for (i, moving) in self.file.prescribed_displacement.iter().enumerate() {
            let entry = format!("prescribed_displacement[{i}]");
            let nodes = self.at(&format!("{entry}.group"), space.nodes_of(&moving.group))?;
            let given = [&moving.x, &moving.y, &moving.z];
            let harmonic = moving.response.as_ref();
            let mut add = |mut own: Move<'a>, factors: Vec<f64>| {
                let largest = own.largest_factor;
                own.largest_factor = factors.iter().fold(largest, |m, f| m.max(f.abs()));
                for (&node, factor) in nodes.iter().zip(factors) {
                    let groups = required.entry((node, own.component.axis)).or_default();
                    let moves_here = factor.abs() > EQUAL_FACTORS * own.largest_factor;
                    let term = moves_here.then_some((moves.len(), factor));
                    let group = Some(&*moving.group);
                    match groups.iter_mut().find(|(other, _)| *other == group) {
                        Some((_, terms)) => terms.extend(term),
                        None => groups.push((group, term.into_iter().collect())),
                    }
                }
                moves.push(own);
            };
            if let Some(rotation) = &moving.rotation {
                for (own, factors) in self.turns(rotation, space, &nodes, &entry)? {
                    add(own, factors);
                }
                if given == [&None; 3] && harmonic.is_none() {
                    if moving.spatial_factor.is_some() {
                        let error = InputError::new("a rotation cannot have a spatial factor")
                            .next("remove it, or add x, y or z");
                        return Err(self.wrong(&format!("{entry}.spatial_factor"), error));
                    }
                    continue;
                }
            }
            for component in self.components(given, harmonic, dimension, &entry)? {
                let axis = component.axis;
                let factors = self.factors(moving, space, &nodes, axis, &entry)?;
                let signal = match component.function {
                    Some(function) => self.motion(function, &component.path)?,
                    None => Signal::constant(0.0),
                };
                let own = Move { component, signal, turn: None, largest_factor: 0.0 };
                add(own, factors);
            }
        }
        Ok(moves)
    }

    /// Returns the parts of a rotation, each with its factors at the nodes.
    fn turns<'f>(
        &self,
        rotation: &'f Rotation,
        space: &Space,
        nodes: &[usize],
        entry: &str,
    ) -> Result<Vec<(Move<'f>, Vec<f64>)>, InputError> {
        let (dimension, path) = (space.dimension(), format!("{entry}.rotation"));
        let point = self.coordinates(&rotation.point, dimension, &format!("{path}.point"))?;
        let axis = match (&rotation.axis, dimension) {
            (Some(axis), 3) => self.unit_vector(axis, 3, &format!("{path}.axis"))?,
            (None, 2) => [0.0, 0.0, 1.0],
            (Some(_), _) => {
                let error = InputError::new("a plane body rotates about the z axis");
                return Err(self.wrong(&format!("{path}.axis"), error.next("remove `axis`")));
            }
            (None, _) => {
                let error = InputError::new("a rotation in space needs an axis");
                return Err(
                    self.wrong(&path, error.next("add `axis`, for example [0.0, 0.0, 1.0]"))
                );
            }
        };
        let of_angle = format!("{path}.angle");
        let angle = self.motion(&rotation.angle, &of_angle)?;
        let arms = nodes.iter().map(|&node| {
            let x = space.node_point(node);
            let arm = [0, 1, 2].map(|i| x.get(i).map_or(0.0, |x| x - point[i]));
            let along: f64 = arm.iter().zip(axis).map(|(r, e)| r * e).sum();
            [0, 1, 2].map(|i| arm[i] - along * axis[i])
        });
        let arms: Vec<[f64; 3]> = arms.collect();
        let squares = arms.iter().map(|r| r.iter().map(|x| x * x).sum::<f64>());
        let longest = squares.fold(0.0, f64::max).sqrt();
        let mut turns = Vec::new();
        for i in 0..dimension {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let sines = arms.iter().map(|r| axis[j] * r[k] - axis[k] * r[j]);
            let cosines = arms.iter().map(|r| r[i]);
            for (turn, signal, factors) in [
                (Turn::Sine, Signal::sine(angle.clone()), sines.collect()),
                (Turn::CosineLessOne, Signal::cosine_less_one(angle.clone()), cosines.collect()),
            ] {
                let component = Component {
                    axis: i,
                    path: of_angle.clone(),
                    function: Some(&rotation.angle),
                    amplitude: Complex64::ZERO,
                };
                let own = Move { component, signal, turn: Some(turn), largest_factor: longest };
                turns.push((own, factors));
            }
        }
        Ok(turns)
    }

    /// Returns the factors of one component of a displacement at the nodes.
    fn factors(
        &self,
        moving: &PrescribedDisplacement,
        space: &Space,
        nodes: &[usize],
        axis: usize,
        path: &str,
    ) -> Result<Vec<f64>, InputError> {
        let factor = self.factor(moving.spatial_factor.as_ref(), space.mesh(), axis, path)?;
        let ends = space.node_ends();
        let at = |&node: &usize| factor.at(&ends[node], &[0.5, 0.5], space.node_point(node));
        let factors = nodes.iter().map(at).collect();
        self.finite(factor)?;
        Ok(factors)
    }

    /// Returns a function of time after checking that a displacement can follow it from rest. Without inertia, the
    /// slope of the function may jump. A static analysis accepts any function, because it uses only values.
    fn motion(&self, function: &Function, path: &str) -> Result<Signal, InputError> {
        let signal = self.signal(function, path)?;
        let unfit = match self.file.analysis {
            Analysis::Static => None,
            Analysis::QuasiStatic if signal.lowest_jump() > 0 => None,
            _ => signal.unfit_for_motion(),
        };
        match unfit {
            Some(objection) => {
                let error = InputError::new(format!(
                    "the displacement cannot follow this function of time: {objection}"
                ));
                Err(self.wrong(path, error))
            }
            None => Ok(signal),
        }
    }

    /// Returns the components for which a function of time or a harmonic part is given. At least one component is
    /// required.
    pub(super) fn components<'f>(
        &self,
        given: [&'f Option<Function>; 3],
        harmonic: Option<&Amplitudes>,
        dimension: usize,
        path: &str,
    ) -> Result<Vec<Component<'f>>, InputError> {
        let harmonic = harmonic.map_or([None; 3], Amplitudes::complex);
        let mut components = Vec::new();
        for (axis, (function, amplitude)) in given.into_iter().zip(harmonic).enumerate() {
            let path = match (function, amplitude) {
                (None, None) => continue,
                (Some(_), _) => format!("{path}.{}", NAMES[axis]),
                (None, Some(_)) => format!("{path}.response.{}", NAMES[axis]),
            };
            self.component(axis, dimension, &path)?;
            components.push(Component {
                axis,
                path,
                function: function.as_ref(),
                amplitude: amplitude.unwrap_or_default(),
            });
        }
        if components.is_empty() {
            let error = InputError::new("no component is given")
                .next(format!("set at least one: {}", NAMES[..dimension].join(", ")));
            return Err(self.wrong(path, error));
        }
        Ok(components)
    }

    /// Rejects a third component in 2D.
    pub(super) fn component(
        &self,
        axis: usize,
        dimension: usize,
        path: &str,
    ) -> Result<(), InputError> {
        if axis < dimension {
            return Ok(());
        }
        let error =
            InputError::new("a plane body has no z component: its mesh consists of triangles")
                .allowed("x, y");
        Err(self.wrong(path, error))
    }
}

impl Move<'_> {
    /// Returns whether the motion is nonzero.
    fn moves(&self) -> bool {
        let Component { function, amplitude, .. } = self.component;
        let rests = function.is_none_or(|function| *function == Function::Constant(0.0));
        !rests || amplitude != Complex64::ZERO
    }

    /// Returns whether two components have the same function of time, harmonic part, and part of a rotation.
    fn is_like(&self, other: &Self) -> bool {
        let same_turn = self.turn == other.turn;
        let (own, other) = (&self.component, &other.component);
        own.function == other.function && own.amplitude == other.amplitude && same_turn
    }
}

/// Returns whether two groups prescribe the same motion of a component. A motion that is always zero is equivalent to a
/// fixed component.
fn alike(moves: &[Move<'_>], terms: &Terms, other: &Terms) -> bool {
    let moving = |terms: &Terms| {
        let terms = terms.iter().map(|&(i, factor)| (&moves[i], factor));
        let moving = terms.filter(|(own, _)| own.moves());
        moving.collect::<Vec<_>>()
    };
    let (terms, other) = (moving(terms), moving(other));
    let same = |((a, f), (b, g)): (&(&Move<'_>, f64), &(&Move<'_>, f64))| {
        let largest = a.largest_factor.max(b.largest_factor);
        a.is_like(b) && (f - g).abs() <= EQUAL_FACTORS * largest
    };
    terms.len() == other.len() && terms.iter().zip(&other).all(same)
}

/// Returns the support whose displacement is the sum of the prescribed displacements, each multiplied by its factor.
fn support(moves: &[Move<'_>], terms: &Terms) -> Support {
    let scaled = |&(i, factor): &(usize, f64)| {
        let signal = moves[i].signal.clone();
        match factor == 1.0 {
            true => signal,
            false => Signal::product(vec![Signal::constant(factor), signal]),
        }
    };
    let mut parts: Vec<Signal> = terms.iter().map(scaled).collect();
    let amplitudes = terms.iter();
    Support {
        amplitude: amplitudes.map(|&(i, factor)| factor * moves[i].component.amplitude).sum(),
        signal: match parts.len() {
            0 | 1 => parts.pop(),
            _ => Some(Signal::sum(parts)),
        },
    }
}
