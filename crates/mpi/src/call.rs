//! Messages from rank 0 to the other ranks, encoded as numbers.

use myovib_fem::{AddedMotion, Fields, Pass, Pressure};

use crate::ffi::World;

/// Commands that the other ranks execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Command {
    /// End the session.
    End,
    /// Load the body and keep only this rank's share of its elements.
    Body,
    /// Compute this rank's share of a pass over the elements.
    Pass,
    /// Create a real matrix. The arguments are its number and whether it is symmetric.
    Real,
    /// Create a complex matrix.
    Complex,
    /// Analyze the pattern of the matrix with the given number.
    Analyze,
    /// Factorize the matrix with the given number.
    Factor,
    /// Solve with the factors of the matrix.
    Solve,
    /// Drop the matrix.
    Forget,
}

impl Command {
    const ALL: [Self; 9] = [
        Self::End,
        Self::Body,
        Self::Pass,
        Self::Real,
        Self::Complex,
        Self::Analyze,
        Self::Factor,
        Self::Solve,
        Self::Forget,
    ];
}

/// Numeric arguments of a command.
pub(crate) type Words = [f64; 4];

const VECTORS: usize = 6;

/// Command, followed by its numeric arguments and the length of each vector (−1 if the vector is missing).
type Head = [f64; 1 + 4 + VECTORS];

/// Sends a command to all other ranks.
pub(crate) fn send(
    world: &World,
    command: Command,
    words: Words,
    vectors: [Option<&[f64]>; VECTORS],
) {
    let mut head: Head = [0.0; 1 + 4 + VECTORS];
    head[0] = f64::from(command as u8);
    head[1..5].copy_from_slice(&words);
    for (length, vector) in head[5..].iter_mut().zip(vectors) {
        *length = vector.map_or(-1.0, |vector| vector.len() as f64);
    }
    world.send(&head);
    vectors.into_iter().flatten().for_each(|vector| world.send(vector));
}

/// Command as received, with its arguments.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) command: Command,
    pub(crate) words: Words,
    vectors: [Option<Vec<f64>>; VECTORS],
}

impl Call {
    /// Waits for the next command.
    pub(crate) fn receive(world: &World) -> Self {
        let mut head: Head = [0.0; 1 + 4 + VECTORS];
        world.receive(&mut head);
        let [command, words @ .., _, _, _, _, _, _] = head;
        let vectors = std::array::from_fn(|k| {
            let length = head[5 + k];
            (length >= 0.0).then(|| {
                let mut vector = vec![0.0; length as usize];
                world.receive(&mut vector);
                vector
            })
        });
        Self { command: Command::ALL[command as usize], words, vectors }
    }

    pub(crate) fn pass(&self) -> Pass<'_> {
        let [kind, wanted, kappa, _] = self.words;
        let [u, v, scalar, p_rate, mu, factors] = self.vectors.each_ref().map(|v| v.as_deref());
        let fields = || Fields {
            u: u.unwrap_or_default(),
            pressure: scalar.map_or(Pressure::Penalty { kappa }, Pressure::Nodal),
            v,
            p_rate,
            mu,
            factors,
        };
        let motion = || AddedMotion {
            u: u.unwrap_or_default(),
            v: v.unwrap_or_default(),
            tensions: scalar.unwrap_or_default(),
        };
        match kind as u8 {
            VECTORS_OF => Pass::Vectors(fields(), unpacked(wanted)),
            TANGENTS_OF => Pass::Tangents(fields(), unpacked(wanted)),
            ADDED_FORCE => Pass::AddedForce(motion()),
            ACTIVE_FORCE => Pass::ActiveForce(motion()),
            _ => Pass::AddedTangents(motion(), unpacked(wanted)),
        }
    }
}

const VECTORS_OF: u8 = 0;
const TANGENTS_OF: u8 = 1;
const ADDED_FORCE: u8 = 2;
const ACTIVE_FORCE: u8 = 3;
const ADDED_TANGENTS: u8 = 4;

pub(crate) fn send_pass(world: &World, pass: &Pass<'_>) {
    let of_fields = |kind: u8, fields: &Fields<'_>, wanted: f64| {
        let (p, kappa) = match fields.pressure {
            Pressure::Nodal(p) => (Some(p), 0.0),
            Pressure::Penalty { kappa } => (None, kappa),
        };
        let Fields { u, v, p_rate, mu, factors, .. } = *fields;
        let vectors = [Some(u), v, p, p_rate, mu, factors];
        send(world, Command::Pass, [kind.into(), wanted, kappa, 0.0], vectors);
    };
    let of_motion = |kind: u8, motion: &AddedMotion<'_>, wanted: f64| {
        let AddedMotion { u, v, tensions } = *motion;
        let vectors = [Some(u), Some(v), Some(tensions), None, None, None];
        let words = [kind.into(), wanted, 0.0, 0.0];
        send(world, Command::Pass, words, vectors);
    };
    match pass {
        Pass::Vectors(fields, wanted) => of_fields(VECTORS_OF, fields, packed(wanted)),
        Pass::Tangents(fields, wanted) => of_fields(TANGENTS_OF, fields, packed(wanted)),
        Pass::AddedForce(motion) => of_motion(ADDED_FORCE, motion, 0.0),
        Pass::ActiveForce(motion) => of_motion(ACTIVE_FORCE, motion, 0.0),
        Pass::AddedTangents(motion, wanted) => {
            of_motion(ADDED_TANGENTS, motion, packed(wanted));
        }
    }
}

/// Packs flags into the bits of a number.
fn packed(wanted: &[bool]) -> f64 {
    let bits = wanted.iter().rev();
    f64::from(bits.fold(0u8, |bits, &wanted| 2 * bits + u8::from(wanted)))
}

fn unpacked<const K: usize>(bits: f64) -> [bool; K] {
    std::array::from_fn(|k| bits as u8 >> k & 1 == 1)
}
