//! Materials defined outside the crates, used in moving bodies.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::material::three::{Invariants, Isotropic};
use myovib_fem::material::{MooneyRivlin, Real};
use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate, inlined, load};
use myovib_model::{
    Formulation, Load, Muscle, MuscleDae, Parameters, Settings, Signal, run, start_at_rest,
};

const C10: f64 = 1e4;
const C01: f64 = 2e2;
const BUILT_IN: Law = Law::MooneyRivlin { c10: C10, c01: C01 };

/// The Mooney–Rivlin law, defined only by its energy.
struct Rubber {
    c10: f64,
    c01: f64,
}

inlined! {
    impl Isotropic for Rubber {
        fn energy<R: Real>(&self, at: Invariants<R>) -> R {
            let (first, _) = at.isochoric_first();
            let (second, _) = at.isochoric_second();
            first * self.c10 + second * self.c01
        }
    }
}

static BY_REFERENCE: MooneyRivlin = MooneyRivlin { c10: C10, c01: C01 };
static RUBBER: Rubber = Rubber { c10: C10, c01: C01 };

/// Returns y at t = 30 ms and the number of steps, for a clamped body pulled by a sine pulse.
fn motion(mesh: &Mesh, formulation: Formulation, law: Law) -> (Vec<f64>, u64) {
    let space = Arc::new(Space::taylor_hood(mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let pull = match mesh.dimension() {
        2 => load::traction(&space, "right", [0.0, 1.0]),
        _ => load::traction(&space, "right", [0.0, 1.0, 0.0]),
    };
    let solid = Solid::uniform(space, dofs, law, 1.1e3).unwrap();
    let signal =
        Signal::from(myovib_model::formula::Sine { amplitude: 400.0, frequency: 8.0, phase: 0.0 });
    let muscle = Muscle {
        loads: vec![Load::new(&pull.unwrap(), signal)],
        ..Muscle::unloaded(solid, Parameters::new(1.0, 1e-3, 1e5).unwrap())
    };
    let settings = Settings { t_end: 0.03, ..Settings::paper(formulation) };
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let mut y = vec![0.0; dae.n_unknowns()];
    let mut integrator = start_at_rest(dae, &settings).unwrap();
    let statistics = run(&mut *integrator, &mut []).unwrap();
    integrator.dense_output(settings.t_end, 0, &mut y).unwrap();
    (y, statistics.counts.steps)
}

fn largest(x: impl Iterator<Item = f64>) -> f64 {
    x.fold(0.0, |largest, x| largest.max(x.abs()))
}

/// A block with more elements than SIMD lanes, and a partial last batch.
fn block() -> Mesh {
    generate::block([0.0; 3], [0.04, 0.02, 0.02], [2, 1, 1]).unwrap()
}

/// Formulations with damping, so that stress, tangent and the rates of both are evaluated.
const FORMULATIONS: [Formulation; 2] = [Formulation::Displacement, Formulation::ImplicitRate];

#[test]
fn a_law_by_reference_moves_a_body_in_space_as_that_of_the_list_bit_by_bit() {
    for formulation in FORMULATIONS {
        let of_list = motion(&block(), formulation, BUILT_IN);
        let own = motion(&block(), formulation, Law::custom("rubber", &BY_REFERENCE));
        assert!(largest(of_list.0.iter().copied()) > 1e-3, "it moves");
        assert!(of_list == own, "{formulation}: {} steps, {}", of_list.1, own.1);
    }
}

#[test]
fn a_law_by_its_energy_moves_a_body_as_that_of_the_list() {
    let sheet = generate::rectangle([0.0, 0.0], [0.04, 0.02], [4, 2]).unwrap();
    for mesh in [block(), sheet] {
        for formulation in FORMULATIONS {
            let (y, _) = motion(&mesh, formulation, BUILT_IN);
            let (own, _) = motion(&mesh, formulation, Law::custom("rubber", &RUBBER));
            let dimension = mesh.dimension();
            let difference = largest(y.iter().zip(&own).map(|(a, b)| a - b));
            let size = largest(y.iter().copied());
            // The stresses agree to rounding. If rounding changes a decision of the step size control, results differ
            // by a fraction of the tolerance of 1e-3.
            assert!(
                difference < 1e-4 * size,
                "{dimension} {formulation}: {difference:e} of {size:e}"
            );
        }
    }
}
