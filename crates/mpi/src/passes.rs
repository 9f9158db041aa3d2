//! Distribution of passes over the elements.

use myovib_fem::{Barycentric, Inverted, ParallelAssembler, Pass, Solid};

use crate::call;
use crate::leader::Leader;

/// Outcome of one rank's share of a pass over the elements, encoded as numbers: the inverted element, det F, and the
/// number and values of the barycentric coordinates of the point where it is inverted. The element is −1 if the share
/// succeeded.
pub(crate) type Ending = [f64; 7];

/// Encodes the outcome of a share.
pub(crate) fn ending(own: Result<(), Inverted>) -> Ending {
    let mut numbers = [-1.0; 7];
    if let Err(at) = own {
        numbers[0] = at.element as f64;
        numbers[1] = at.jacobian;
        numbers[2] = at.barycentric.len() as f64;
        for (number, lambda) in numbers[3..].iter_mut().zip(at.barycentric.iter()) {
            *number = *lambda;
        }
    }
    numbers
}

fn first_failure(endings: &[Ending]) -> Result<(), Inverted> {
    match endings.iter().find(|ending| ending[0] >= 0.0) {
        None => Ok(()),
        Some([element, jacobian, count, lambda @ ..]) => Err(Inverted {
            element: *element as usize,
            barycentric: Barycentric::new(&lambda[..*count as usize]),
            jacobian: *jacobian,
        }),
    }
}

impl ParallelAssembler for Leader {
    fn begin(&self, pass: &Pass<'_>) {
        self.with_world(|world| call::send_pass(world, pass));
    }

    fn end(&self, results: &mut [&mut [f64]], own: Result<(), Inverted>) -> Result<(), Inverted> {
        let endings = self.with_world(|world| {
            let endings = world.gather(ending(own));
            results.iter_mut().for_each(|result| world.sum(result));
            endings
        });
        first_failure(&endings)
    }
}

/// Returns numbers from which the ranks verify that they have the same body: counts, the sum of all coordinates, and
/// the sum of all pressure weights.
pub(crate) fn fingerprint(solid: &Solid) -> [f64; 6] {
    let space = solid.space();
    [
        space.n_elements() as f64,
        space.n_components() as f64,
        space.n_pressures() as f64,
        solid.dofs().n_free() as f64,
        space.coordinates().iter().sum(),
        solid.pressure_weights().iter().sum(),
    ]
}
