//! Checks of the initial state: the loads and supports at t = 0 must match the state of the body.

use myovib_dae::Problem;
use myovib_model::{Contact, InitialValues, ModelError, MuscleDae, Prescribed, Signal, support};

use crate::scene::{Body, NAMES, Start};
use crate::state::State;
use crate::{Error, InputError, spacing};

/// Tolerance for the difference between the supports and the initial state, relative to the largest displacement of the
/// initial state. It allows for rounding errors, which occur because the previous run evaluated the signals at another
/// time.
const SUPPORTS_AGREE: f64 = 1e-9;
/// Penetrations of an obstacle into a body at rest below this fraction of the facet size are attributed to rounding
/// errors.
const TOUCHING: f64 = 1e-6;
/// Support motions below this fraction of their maximum count as zero at t = 0. This value allows for rounding errors
/// and for the slope of a spline through rows of zeros.
const ZERO_AT_START: f64 = 1e-9;
/// Nodal forces below this fraction of their maximum may act suddenly at t = 0. They change the motion by approximately
/// the same fraction.
const NEGLIGIBLE_FORCE: f64 = 1e-5;
/// Number of equal time intervals. At their ends, loads and motions are sampled to find the maximum.
const SIZE_TIMES: u32 = 61;

/// Rejects an initial state that contradicts the loads or the supports at t = 0, without searching for an equilibrium.
///
/// # Errors
/// Fails if loads act at t = 0 on a body that starts at rest, if the supports do not match the initial state, or if the
/// supports do not fix a body without inertia.
pub(in crate::run) fn expect_start(body: &Body, dae: &mut MuscleDae) -> Result<(), Error> {
    let muscle = &body.muscle;
    if !muscle.solid.has_inertia()
        && let Some(free) = support::free_parts(muscle)
    {
        return Err(ModelError::NotHeld(free).into());
    }
    match &body.start {
        Start::Rest => {
            expect_supports_at_rest(body, body.settings.t_end, false)?;
            refuse_sudden_loads(body, dae)
        }
        Start::Equilibrium => Ok(expect_supports_at_rest(body, body.settings.t_end, true)?),
        Start::State(state) => {
            let y = state.unknowns(dae);
            Ok(expect_supports(state, dae, &y)?)
        }
    }
}

/// Rejects supports that do not match the initial state at t = 0. `y` contains the unknowns of this state.
pub(super) fn expect_supports(
    state: &State,
    dae: &mut MuscleDae,
    y: &[f64],
) -> Result<(), InputError> {
    let moved = state.moved_by_supports(dae, y);
    if moved > SUPPORTS_AGREE * state.largest_displacement() {
        let error = InputError::new("the supports do not match the initial state at t = 0");
        return Err(error.found(format!("{moved:.3e} m apart")).next(
            "start [[fixed]] and [[prescribed_displacement]] at the displacements of the initial state",
        ));
    }
    Ok(())
}

/// Rejects a body that starts at rest if nodal forces act on it at t = 0, for example due to loads or accelerated
/// supports.
fn refuse_sudden_loads(body: &Body, dae: &mut MuscleDae) -> Result<(), Error> {
    let t_end = body.settings.t_end;
    let InitialValues { y, .. } = InitialValues::at_rest(dae)?;
    let rest = vec![0.0; dae.n_unknowns()];
    let mut largest_force = |t: f64, y: &[f64]| -> Result<f64, ModelError> {
        let force = dae.unbalanced_force(t, y, &rest)?;
        let free = dae.muscle().solid.dofs().free_to_full();
        Ok(free.iter().map(|&i| force[i].abs()).fold(0.0, f64::max))
    };
    let largest = largest_force(0.0, &y)?;
    if largest == 0.0 {
        return Ok(());
    }
    // If supports move far while the body is at rest, elements may be inverted. Times at which this happens count as
    // unloaded.
    let later = times(t_end).map(|t| largest_force(t, &rest).unwrap_or(0.0));
    if largest > NEGLIGIBLE_FORCE * later.fold(0.0, f64::max) {
        let (loads, others) = sudden_loads(body);
        let keys: Vec<&str> = loads.iter().chain(&others).copied().collect();
        let error = InputError::new(
            "the loads do not start from zero, but the body starts at rest (tensions count as loads)",
        )
        .found(format!(
            "a nodal force of {largest:.3e} {} at t = 0{}{}",
            unit_of_force(dae),
            if keys.is_empty() { "" } else { ", by " },
            keys.join(", ")
        ))
        .next(
            "start them gradually: y = { type = \"step\", value = ..., rise = 0.1 }, or multiply them by a step: \
             y = { type = \"product\", of = [{ type = \"step\", value = 1, rise = 0.1 }, ...] }",
        );
        let error = match loads.is_empty() && !others.is_empty() {
            // Prescribed displacements must not jump.
            true => error,
            false => error.next("or apply them suddenly after t = 0, with a step of rise = 0"),
        };
        let next = "or start in equilibrium with them: [initial_state] with type = \"equilibrium\"";
        return Err(error.next(next).into());
    }
    Ok(())
}

/// Returns the keys of loads with nonzero values at t = 0, and descriptions of other causes of forces at t = 0.
fn sudden_loads(body: &Body) -> (Vec<&str>, Vec<&str>) {
    let is_sudden = |signal: &Signal| {
        let values = times(body.settings.t_end).map(|t| signal.at(t).value.abs());
        signal.at(0.0).value.abs() > NEGLIGIBLE_FORCE * values.fold(0.0, f64::max)
    };
    let sudden = body.keyed_loads().filter(|(_, signal)| is_sudden(signal));
    let loads = sudden.map(|(key, _)| key).collect();
    let mut others = Vec::new();
    let accelerates = |signal: &Signal| {
        let values = times(body.settings.t_end).map(|t| signal.at(t).d2.abs());
        signal.at(0.0).d2.abs() > NEGLIGIBLE_FORCE * values.fold(0.0, f64::max)
    };
    let moving = |prescribed: &Prescribed| accelerates(&prescribed.signal);
    if body.muscle.prescribed.iter().any(moving) {
        others.push("the acceleration of a [[prescribed_displacement]]");
    }
    let rest = vec![0.0; body.muscle.solid.space().n_components()];
    let enters = |contact: &Contact| {
        contact.sums(0.0, 1.0, &rest).penetration > TOUCHING * contact.facet_size()
    };
    if body.muscle.contacts.iter().any(enters) {
        others.push("a [[contact]] whose obstacle enters the body: start it outside");
    }
    (loads, others)
}

/// Rejects a support with a nonzero velocity at t = 0. Unless `displaced` is true, also rejects a support with a
/// nonzero displacement at t = 0.
pub(super) fn expect_supports_at_rest(
    body: &Body,
    t_end: f64,
    displaced: bool,
) -> Result<(), InputError> {
    let muscle = &body.muscle;
    let (space, has_inertia) = (muscle.solid.space(), muscle.solid.has_inertia());
    for prescribed in &muscle.prescribed {
        let now = prescribed.signal.at(0.0);
        let sizes = times(t_end).map(|t| prescribed.signal.at(t));
        let [u, v] = sizes
            .fold([0.0_f64; 2], |[u, v], size| [u.max(size.value.abs()), v.max(size.d1.abs())]);
        let found = match () {
            () if !displaced && now.value.abs() > ZERO_AT_START * u => {
                format!("{:.3e} m", now.value)
            }
            // Without inertia, velocities may jump.
            () if has_inertia && now.d1.abs() > ZERO_AT_START * v => format!("{:.3e} m/s", now.d1),
            () => continue,
        };
        let (node, axis) =
            (prescribed.component / space.dimension(), prescribed.component % space.dimension());
        let place: Vec<String> = space.node_point(node).iter().map(|x| format!("{x:.4}")).collect();
        let mut error = InputError::new(format!(
            "a support moves at t = 0, but the body starts at rest: the {} component at ({})",
            NAMES[axis],
            place.join(", ")
        ));
        if has_inertia && !displaced && now.d1 == 0.0 {
            error = error
                .next("start in equilibrium with it: [initial_state] with type = \"equilibrium\"");
        }
        return Err(error.found(found).next(
            format!(
                "start the motion of its [[prescribed_displacement]] gradually: multiply it by a step, \
                 {} = {{ type = \"product\", of = [{{ type = \"step\", value = 1, rise = 0.1 }}, ...] }}",
                NAMES[axis]
            ),
        ));
    }
    Ok(())
}

fn times(t_end: f64) -> impl Iterator<Item = f64> {
    spacing::times(0.0, t_end, SIZE_TIMES)
}

/// Returns the unit of force: N, or N/m (per meter of depth) in 2D.
fn unit_of_force(dae: &MuscleDae) -> &'static str {
    match dae.muscle().solid.space().dimension() {
        2 => "N/m",
        _ => "N",
    }
}
