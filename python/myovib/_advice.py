"""Reasons why integrations fail or need many steps, and remedies."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress as ignoring
from typing import Any, NamedTuple

import numpy as np

from ._arguments import LARGE
from ._index import index_note, listed
from ._parts import _is_counted_from_start
from ._solution import Array, DaeSolution, Function
from ._structure import LARGEST, Pattern, Structure

# Remedy for initial values that violate constraints.
START = (
    "positions and velocities must satisfy the constraints and their derivatives: `consistent_start` computes "
    "them for position constraints"
)

# Fraction of nonzero entries below which `sparsity` is recommended, and number of columns from which it is estimated.
SPARSE = 0.1
SAMPLED = 8


def _share_of_entries(residual: Function, t: float, y: Array, yp: Array) -> float | None:
    """Estimate the fraction of nonzero entries of a large Jacobian from a few columns; None if it is not small."""
    n = len(y)
    if n <= LARGE:
        return None
    try:
        base = np.array(residual(t, y, yp), dtype=float)
        count: Any = 0
        for j in range(n // (2 * SAMPLED), n, n // SAMPLED):
            moved = [values + 1e-3 * (1.0 + np.abs(values)) * (np.arange(n) == j) for values in (y, yp)]
            count += np.count_nonzero(np.asarray(residual(t, *moved)) != base)
    except Exception:  # outside of the domain of F
        return None
    share = count / n / len(range(n // (2 * SAMPLED), n, n // SAMPLED))
    return share if share < SPARSE else None


class Facts(NamedTuple):
    """Facts about an integration, from which the reasons for a failure are derived."""

    # Variables excluded from the error test.
    suppress: list[bool] | None
    # Whether any index is above 1.
    is_hidden: bool
    # Whether the velocities at the start violate constraints.
    has_wrong_velocities: bool
    has_jacobian: bool
    has_sensitivities: bool
    # Description of missing, wrong or excessive indices; empty if all are right.
    index_note: str
    span: float
    # Whether `t_eval` replaces the steps in the results.
    has_outputs: bool
    initial: str
    # Start of the span, all breaks, and end of the span.
    ends: list[float]
    pattern: Pattern | None
    # Index of each variable, if given.
    indices: list[int] | None
    # Returns the solution up to the time of the stop; with `t_eval`, the last output may be far from it.
    up_to_stop: Callable[[], DaeSolution | None] = lambda: None


# Message of IDAS if all attempts at the first step fail the error test. The group is the step size of the last attempt.
FAILED_AT_START = re.compile(r"after 0 steps .*error_test_failures.* h = -?([-+.\de]+), the error test")

# Beginning of the message if no consistent values are found after a break.
VALUELESS = "no consistent initial values"

# Part of the message if steps become too short.
TOO_SMALL = "step_too_small"

# Beginning of messages that contain the time of the last step. This time may be after the last output time.
STOPPED = re.compile(r"(?:stopped|the limit .* was reached) at t = ([-+.\de]+)")

# If the first 100 steps cover less than this fraction of the span, the steps are too short from the start.
SLOW = 1e-3

# Ratio of failed error tests to steps of BDF above which advice is given. The ratio is at most 0.14 for standard
# problems that are stiff or oscillate, and 0.2 to 0.5 for a transistor amplifier with coupling capacitors.
FAILED = 1.0 / 6.0


def _is_slow_from_the_start(solution: DaeSolution, span: float) -> bool:
    return len(solution.t) > 1000 and abs(solution.t[100] - solution.t[0]) < SLOW * span


def _advice(solution: DaeSolution, residual: Function, rtol: float, atol: Array, facts: Facts) -> str | None:
    """Return advice, if any, for an integration that ended early, failed many error tests or is limited by rounding of t.

    If the solution ended early, the advice is also added to its message. It replaces the remedies that the integrator
    suggests there, unless the advice is a guess.
    """
    suppress, span, has_jacobian = facts.suppress, facts.span, facts.has_jacobian
    is_bdf = solution.method == "bdf"
    many = is_bdf and solution.nsteps > 1000 and solution.netf > FAILED * solution.nsteps
    if not solution.t.size:
        return None
    # An integration that counts times from its start does not fail because times are rounded.
    has_rounded_times = solution.success or not _is_counted_from_start(solution.method, float(solution.t[0]), span)
    is_late = has_rounded_times and _is_late(solution, rtol, atol)
    if not (many or is_late or solution.status < 0):
        return None
    y, yp = solution.y[:, -1], solution.yp[:, -1]
    structure = Structure.at(residual, solution.t[-1], y, yp, rtol * np.abs(y) + atol, pattern=facts.pattern)
    earlier = [] if solution.success else _earlier(solution, residual, rtol, atol, facts.pattern)
    # A state that Newton's method or the error test does not accept may be far from the solution.
    singular = _singular(structure) if all(_singular(other) for _, other in earlier) else ""
    steep = [] if solution.success else _growing(solution, facts.indices)
    hidden = structure.of_higher_index if structure and is_bdf else []
    if (singular or hidden) and steep:
        # Close to a pole, the largest terms hide the others.
        start = (float(solution.t[0]), solution.y[:, 0], solution.yp[:, 0])
        at_start = Structure.at(residual, *start, rtol * np.abs(start[1]) + atol, pattern=facts.pattern)
        singular = singular if _singular(at_start) else ""
        hidden = [j for j in hidden if at_start is None or j in at_start.of_higher_index]
    tested = [j for j in hidden if suppress is None or not suppress[j]]
    stopped = STOPPED.match(solution.message)
    stop = float(stopped[1] if stopped else solution.t[-1])
    is_guess = False
    jumping = None if solution.success else _jumping(residual, solution, rtol, atol, stop)
    has_other_cause = solution.success or jumping or "max_steps" in solution.message
    nonlinear = [] if has_other_cause else _nonlinear(residual, solution, earlier, facts)
    if nonlinear:
        advice = _advice_for_nonlinear(nonlinear, is_bdf, facts)
    elif facts.index_note and not solution.success:
        advice = facts.index_note
    elif singular and not solution.success:
        advice = singular
    elif facts.has_wrong_velocities and not solution.success and "after 0 steps" in solution.message:
        advice = START
    elif structure and tested:
        advice = index_note(structure, "bdf", None, suppress)[0]
    elif not solution.nsteps and (failed := FAILED_AT_START.search(solution.message)) and not jumping:
        # IDAS reduces the step size by a factor of 4^10 before it stops.
        is_guess = facts.initial == "given"
        advice = (
            f"the error test fails in a first step of {failed[1]}: give `first_step={failed[1]}`, or `yp0` with the derivatives "
            "of all variables, including the algebraic ones"
        )
        if facts.has_sensitivities and not has_jacobian:
            advice = f"the error test fails in a first step of {failed[1]}: give the exact `jacobian`, which sensitivities also use"
        small = np.flatnonzero(rtol * np.abs(y) < atol)
        if 0 < len(small) < len(y):
            near = f"the variables {listed(small.tolist())} (counted from 0) start at or near 0"
            advice += f"; {near}: a larger `atol` may help"
    elif is_bdf and len(y) > LARGEST and FAILED_AT_START.search(solution.message):
        advice = (
            "the first step of BDF after a break uses the derivatives of algebraic variables, which are computed only for "
            f"systems of at most {LARGEST} variables: use a larger `rtol`, or a Radau method"
        )
    elif solution.nsteps and ("after 0 steps" in solution.message if facts.is_hidden else hidden and VALUELESS in solution.message):
        advice = (
            "a constraint or its derivative jumps at the break: end there, and start again with consistent values"
        )
    elif hidden and not solution.success:
        described = f"the variables {listed(hidden)} (counted from 0) have an index above 1"
        advice = (
            f"{described}, and Newton's iteration must find them: give them a larger `atol`, give the exact `jacobian`, or use "
            "a Radau method with `index`"
        )
    elif jumping:
        equations, variable = jumping
        advice = f"the equations {listed(equations)} (counted from 0) jump "
        if variable is None and abs(facts.ends[-1] - stop) < INSTANTS[-1] * np.spacing(max(abs(facts.ends[-1]), span)):
            advice += f"at the end of the span: also list {facts.ends[-1]} in `breaks`"
        elif variable is None:
            advice += "at this time: list in `breaks` the times at which inputs jump"
            nearest = min(facts.ends[1:-1], key=lambda t: abs(t - stop), default=np.inf)
            if abs(nearest - stop) < NEAR * span:
                advice += f", with all digits: the listed time {nearest} differs by {abs(nearest - stop):.1e}"
        else:
            advice += (
                f"near this value of variable {variable}, and F may switch at every step (chattering), as dry friction and "
                f"relays do: replace the jump by a smooth function, such as tanh, over {WIDTH:.0f} tolerances of this "
                "variable, or use the equations of one side until an event, and then the equations of the next state"
            )
    elif not solution.success and any(value in solution.message for value in ("= NaN", "= inf", "= -inf")):
        advice = (
            "the domain of F may end near this state; otherwise limit the arguments of exponentials, or use tighter "
            "tolerances"
        )
    elif facts.is_hidden and not (solution.success or facts.has_outputs) and _is_slow_from_the_start(solution, span):
        exact = "" if has_jacobian else "the exact `jacobian`, tighter tolerances or "
        advice = (
            f"steps are very short from the start: use {exact}a `first_step` of about 1/1000 of the time within which "
            "the solution changes"
        )
    elif (
        not solution.success
        and (_fails_to_converge(solution.message) or TOO_SMALL in solution.message)
        and (kinked := _kinked(residual, solution, rtol, atol) or _kinked(residual, facts.up_to_stop(), rtol, atol))
    ):
        advice = (
            f"the equations {kinked} (counted from 0) have a kink near this time, as `max`, `abs` and `if` do: replace it "
            f"by a smooth function over {SMOOTH}, or change the equations at one of the `events`"
        )
        # With outputs, an exact Jacobian stops Radau IIA at most kinks.
        if has_jacobian or is_bdf or not facts.has_outputs:
            advice += ", or call without `jacobian`" if has_jacobian else ", or give the exact `jacobian`"
    elif steep:
        advice = (
            f"the derivatives of the variables {steep} (counted from 0) grow without bound near this time: "
            "the solution may have a pole, a square root or the end of the domain of F there"
        )
    elif is_late:
        advice = (
            f"t_span: times near {solution.t[-1]:.3g} are rounded to {np.spacing(abs(solution.t[-1])):.1e}, within which "
            "the solution changes by more than the tolerances: measure time from a closer origin"
        )
    elif is_bdf and not solution.success and _is_nonlinear_in_rates(residual, solution):
        is_guess = True
        advice = "F is nonlinear in y', for which BDF may need very short steps or stop: use a Radau method"
        advice += "" if has_jacobian else "; the exact `jacobian` or tighter tolerances may also help"
    elif many:
        # This occurs, for example, if a variable amplifies the errors of others. The error estimate of BDF is small
        # while the step size is constant. Each longer step then fails, and the order remains 1.
        excluded = np.array(suppress or np.zeros(len(y), bool))
        algebraic = np.flatnonzero(structure.algebraic & ~excluded).tolist() if structure else []
        other = f"excluding the algebraic variables {listed(algebraic)} (counted from 0) with `suppress` or " if algebraic else ""
        advice = (
            f"BDF failed {solution.netf} error tests in {solution.nsteps} steps: {other}a Radau method may "
            "need far fewer steps"
        )
        if structure and structure.undetermined():
            advice += (
                "; a larger `atol` may also help, or new variables for the combinations of derivatives in F, such as "
                "voltages across coupling capacitors"
            )
    elif not (solution.success or has_jacobian) and (
        _fails_to_converge(solution.message) or "max_steps" in solution.message and FREQUENT * solution.ncfn > solution.nsteps
    ):
        is_guess = True
        other = " or tighter tolerances" if rtol >= LOOSE else ""
        other = " or a `first_step`" if "after 0 steps" in solution.message else other
        advice = f"difference quotients may be inaccurate: give the exact `jacobian`{other}"
        advice += f"; replace a kink of F, such as `max`, by a smooth function over {SMOOTH}"
    elif not (solution.success or facts.is_hidden) and _fails_to_converge(solution.message):
        # With `t_eval`, the last known state may be far from the kink.
        is_guess = True
        advice = (
            f"F may have a kink near this time, as `max` and `abs` do: replace it by a smooth function over {SMOOTH}, or "
            "call without `jacobian`"
        )
    else:
        return None
    if not solution.success:
        reason, remedies, others = solution.message.partition(": the last half")[0].partition("; suggested remed")
        solution.message = f"{reason}; {advice}" + (remedies + others if is_guess else "")
    return advice


def _earlier(
    solution: DaeSolution, residual: Function, rtol: float, atol: Array, pattern: Pattern | None
) -> list[tuple[int, Structure]]:
    """Return the structures at some states before the last one, with their numbers."""
    found = []
    for k in sorted({(len(solution.t) - 1) // 2, len(solution.t) - 4, len(solution.t) - 2}):
        if k >= 0:
            y, yp = solution.y[:, k], solution.yp[:, k]
            structure = Structure.at(residual, solution.t[k], y, yp, rtol * np.abs(y) + atol, pattern=pattern)
            found += [(k, structure)] if structure else []
    return found


# A variable acts on F weakly at some states and strongly at others if a change by its size changes F by more than this factor
# times the change that the derivative predicts. The factor is 1 for linear functions, about 2 for a sum of a variable and
# its cube, and e^x/x for diodes at x thermal voltages. The derivative is computed with increments of the given fraction of
# the size.
STRONGER = 10.0
FRACTION = 0.01


def _nonlinear(
    residual: Function, solution: DaeSolution, earlier: list[tuple[int, Structure]], facts: Facts
) -> list[int]:
    """Return the algebraic variables that count as variables of index 2 in equations that vary by orders of magnitude.

    Their index is 1 where F depends on them strongly, as on the voltage of a conducting diode. Error tests for index 2 then
    allow errors that F magnifies.
    """
    n = len(solution.y)
    if n > LARGE:
        return []
    found = set()
    sizes = np.median(np.abs(solution.y), axis=1)
    for k, structure in earlier:
        t, y, yp = solution.t[k], solution.y[:, k], solution.yp[:, k]
        stated = structure.algebraic & (np.array(facts.indices or [0] * n) == 2)
        if facts.suppress is not None and solution.method == "bdf":
            stated |= structure.algebraic & np.array(facts.suppress)
        rounding = 1e3 * structure.rounding(np.abs(structure.df_dy), np.abs(structure.df_dyp))
        acting = np.zeros((n, n), dtype=bool)
        varying = np.zeros(n, dtype=bool)
        with ignoring(Exception), np.errstate(all="ignore"):  # outside of the domain of F
            base = np.array(residual(t, y, yp), dtype=float)
            for j in {*np.flatnonzero(stated).tolist(), *structure.of_higher_index}:
                unit = sizes[j] * (np.arange(n) == j)
                factors = (1.0, -1.0, FRACTION, -FRACTION)
                changes = np.abs([np.array(residual(t, y + c * unit, yp), dtype=float) - base for c in factors])
                largest, predicted = changes[:2].max(axis=0), np.maximum(changes[2:].max(axis=0), rounding) / FRACTION
                acting[:, j] = largest > rounding
                varying |= largest > STRONGER * predicted
        found |= set(np.flatnonzero(acting[varying].any(axis=0)).tolist())
    return sorted(found)


def _advice_for_nonlinear(variables: list[int], is_bdf: bool, facts: Facts) -> str:
    described = (
        f"the effect of the variables {listed(variables)} (counted from 0) on F, and so their index, varies with the state, as "
        "for voltages at diodes: "
    )
    anyway = " (a warning about their index may then appear)"
    if is_bdf and facts.suppress is not None and any(facts.suppress[j] for j in variables):
        return f"{described}do not exclude them by `suppress`{anyway}"
    if not is_bdf and any(facts.indices[j] > 1 for j in variables if facts.indices):
        return f"{described}state 1 for them in `index`{anyway}"
    return f"{described}use tighter tolerances"


def _wrong_entry(
    solution: DaeSolution,
    residual: Function,
    jacobian: Function | None,
    limits: tuple[float, float],
    rtol: float,
    atol: Array,
) -> str | None:
    """If Newton's method fails often, return a note on an entry of the Jacobian that differs from difference quotients.

    If a failure of Newton's method ended the integration, the last state is also examined, because the Jacobian may
    be wrong only there.
    """
    is_slow = not solution.success or solution.nsteps > 10
    is_stopped = not solution.success and _fails_to_converge(solution.message)
    if jacobian is None or not (is_stopped or is_slow and FREQUENT * solution.ncfn > solution.nsteps):
        return None
    within = np.flatnonzero((solution.t >= min(limits)) & (solution.t <= max(limits)))
    counts: dict[tuple[str, int, int], int] = {}
    examined: Any = np.unique(within[np.linspace(0, len(within) - 1, 9).astype(int)]) if len(within) else []
    states = [(solution.t[i], solution.y[:, i].copy(), solution.yp[:, i].copy()) for i in examined]
    stopped = STOPPED.match(solution.message)
    if is_stopped and stopped and solution.t.size:
        y, yp = solution.y[:, -1].copy(), solution.yp[:, -1].copy()
        # A kink of F does not affect the same entry in both states.
        states += [(float(stopped[1]), y + c * (rtol * np.abs(y) + atol), yp) for c in (0.0, MOVED)]
    for t, y, yp in states:
        # F may be nonlinear within a tolerance, so smaller increments are used.
        structure = Structure.at(residual, t, y, yp, 1e-3 * (rtol * np.abs(y) + atol))
        if structure is None:
            continue
        try:
            given = [m.toarray() if hasattr(m, "toarray") else np.array(m, float) for m in jacobian(t, y.copy(), yp.copy())]
            wrong = structure.wrong_entries(*given)
        except Exception:
            continue
        for entry in wrong:
            counts[entry] = counts.get(entry, 0) + 1
    # A difference at a single state may be caused by a kink.
    if not counts or max(counts.values()) < min(2, len(states)):
        return None
    matrix, row, column = max(counts, key=lambda entry: counts[entry])
    return (
        f"Newton's iteration failed {solution.ncfn} times in {solution.nsteps} steps, and in row {row}, column {column} "
        f"(counted from 0) the `jacobian` differs from difference quotients for {matrix}: the results may be wrong. "
        "Correct it, or call without `jacobian`"
    )


def _missing_entry(
    solution: DaeSolution, residual: Function, pattern: Pattern, rtol: float, atol: Array
) -> str | None:
    """Return a note on an entry of the Jacobian, nonzero at the last state, that the pattern omits."""
    if not solution.t.size:
        return None
    y, yp = solution.y[:, -1], solution.yp[:, -1]
    structure = Structure.at(residual, solution.t[-1], y, yp, rtol * np.abs(y) + atol)
    if structure is None:
        return None
    offsets, rows = pattern
    is_missing = np.ones((len(y), len(y)), dtype=bool)
    is_missing[rows, np.repeat(np.arange(len(y)), np.diff(offsets))] = False
    sizes = [np.abs(structure.df_dy), np.abs(structure.df_dyp)]
    rounding = 100.0 * structure.rounding(*sizes)[:, None]
    is_missing &= np.any([part * moved > rounding for part, moved in zip(sizes, structure.sizes, strict=True)], axis=0)
    for row, column in np.argwhere(is_missing):
        return f"equation {row} depends on variable {column} (counted from 0): add this entry to `sparsity`"
    return None


def _is_late(solution: DaeSolution, rtol: float, atol: Array) -> bool:
    """Return whether a variable usually changes by more than its tolerance within the rounding error of t."""
    changes = np.spacing(np.abs(solution.t)) * np.abs(solution.yp)
    tolerances = rtol * np.abs(solution.y) + atol[:, None]
    return bool((np.median(changes - tolerances, axis=1) > 0.0).any())


# Distance, in tolerances, between the two states at which a Jacobian is compared with differences after the last step.
MOVED = 10.0

# Number of steps per failure of Newton's iteration below which an exact Jacobian is compared with differences.
FREQUENT = 5

# Relative tolerance from which on tighter tolerances improve difference quotients.
LOOSE = 1e-5

# Growth factor of a derivative that indicates a singularity of the solution.
GROWTH = 1e4


def _growing(solution: DaeSolution, indices: list[int] | None) -> list[int]:
    """Return the variables of index 0 and 1 whose derivatives are much larger at the end than before."""
    sizes = np.abs(solution.yp)
    if indices is not None:
        sizes[np.array(indices) > 1] = 0.0
    if sizes.shape[1] < 10:
        return []
    # Most steps may be close to a pole, or within the second half of the time.
    is_before = np.abs(solution.t - solution.t[0]) <= 0.5 * abs(solution.t[-1] - solution.t[0])
    is_before[:5] = True
    before = np.median(sizes[:, is_before], axis=1)
    # The derivative of a variable at rest is zero and cannot be compared.
    return np.flatnonzero((before > 0) & (sizes[:, -1] > GROWTH * before)).tolist()


# Relative change of derivatives, and relative second difference of F from which on F is considered nonlinear in y'. The latter
# is 0.05 for a square.
CHANGED, CURVED = 0.1, 1e-3


def _is_nonlinear_in_rates(residual: Function, solution: DaeSolution) -> bool:
    """Return whether F is nonlinear in y' at the last state."""
    t, y, yp = float(solution.t[-1]), solution.y[:, -1], solution.yp[:, -1]
    try:
        low, middle, high = (np.array(residual(t, y, (1.0 + c * CHANGED) * yp), dtype=float) for c in (-1, 0, 1))
    except Exception:  # outside of the domain of F
        return False
    return bool((np.abs(high - 2.0 * middle + low) > CURVED * np.abs(high - low)).any())


# Distances, in tolerances, within which kinks of F are searched for, and smallest relative change of slope at a kink.
DISTANCES = (0.01, 0.1, 1.0, 10.0, 100.0)
BEND = 0.1
# Further distances for variables that are small at the last state, and their limit, relative to the largest value. A kink is
# found within 1/16 of two successive distances.
FURTHER, NEARBY = (1e3, 1e4, 1e5), 0.1


def _fails_to_converge(message: str) -> bool:
    """Return whether the message reports that Newton's method failed or that derivatives changed abruptly."""
    return "converge" in message or "abruptly" in message


def _kinked(residual: Function, solution: DaeSolution | None, rtol: float, atol: Array) -> list[int]:
    """Return the equations with a kink near the last state, if any."""
    if solution is None or not solution.t.size:
        return []
    t, y, yp = solution.t[-1], solution.y[:, -1], solution.yp[:, -1]
    if len(y) > LARGE:
        return []
    tolerances = rtol * np.abs(y) + atol
    nearby = NEARBY * np.abs(solution.y).max(axis=1)
    found = np.zeros(len(y), dtype=bool)
    try:
        base = np.array(residual(t, y, yp), dtype=float)
        for j in range(len(y)):
            was_bent = np.zeros(len(y), dtype=bool)
            for distance in (*DISTANCES, *(d for d in FURTHER if d * tolerances[j] <= nearby[j])):
                unit = distance * tolerances[j] * (np.arange(len(y)) == j)
                moved = [np.array(residual(t, y + c * unit, yp), dtype=float) for c in (1, -1, 0.25, -0.25)]
                changes = np.array(moved) - base
                bend, near = np.abs(changes[0] + changes[1]), np.abs(changes[2] + changes[3])
                # At a quarter of the distance, the bend of a smooth function is 1/16 as large, and that of a kink is
                # 1/4 as large.
                is_bent = bend > BEND * (np.abs(changes[0]) + np.abs(changes[1]))
                is_bent &= (near > 0.2 * bend) & (near < 0.3 * bend)
                # Bends caused by rounding errors differ between distances.
                found |= is_bent & was_bent
                was_bent = is_bent
    except Exception:  # outside of the domain of F
        return []
    return np.flatnonzero(found).tolist()


# Recommended width, in tolerances, of smooth functions that replace jumps. All methods can integrate such functions.
WIDTH = 100.0

# Recommended width of smooth functions that replace kinks. Of 36 runs of a rectifier, 9 stopped if the width was 1
# tolerance, and one stopped if it was 10 or 100 tolerances.
SMOOTH = "10 to 100 tolerances"

# Distances from the last time, in units of its rounding error, within which jumps are searched for.
INSTANTS = (1e3, 1e4, 1e5, 1e6)
# If a listed break is closer to a jump than this fraction of the span, the break is considered to be meant for this
# jump.
NEAR = 1e-6
# Number of bisections that locate a jump.
BISECTIONS = 20
# Smallest size of a jump, relative to the changes of F that the tolerances cause.
VISIBLE = 1e-3


def _jumping(
    residual: Function, solution: DaeSolution, rtol: float, atol: Array, stop: float
) -> tuple[list[int], int | None] | None:
    """Return the equations that jump near the last state or the last time, and the variable with which they jump.

    The variable is None if the equations jump with time.
    """
    t, y, yp = solution.t[-1], solution.y[:, -1], solution.yp[:, -1]
    n = len(y)
    if n > LARGE:
        return None
    state = np.r_[y, yp]

    def along(j: int) -> Callable[[float], Array]:
        unit = np.arange(2 * n) == j
        unit = (rtol * np.abs(state) + np.resize(atol, 2 * n)) * unit
        return lambda x: np.array(residual(t, *np.split(state + x * unit, 2)), dtype=float)

    rounding = np.spacing(max(np.abs(solution.t).max(), abs(stop)))
    searches: list[tuple[int | None, Callable[[float], Array]]] = [(j % n, along(j)) for j in range(2 * n)]
    searches.append((None, lambda x: np.array(residual(stop + x * rounding, y, yp), dtype=float)))
    smallest = np.zeros(n)
    with np.errstate(all="ignore"):
        for _, function in searches[:-1]:
            with ignoring(Exception):  # outside of the domain of F
                smallest = np.fmax(smallest, VISIBLE * np.abs(function(1.0) - function(-1.0)))
        for variable, function in searches:
            was_found = np.zeros(n, dtype=bool)
            for distance in INSTANTS if variable is None else DISTANCES:
                try:
                    is_found = _jumps(function, distance) > smallest
                except Exception:
                    break
                # Rounding errors change F once within a short distance, but more often within a longer distance.
                if (was_found & is_found).any():
                    return np.flatnonzero(was_found & is_found).tolist(), variable
                was_found = is_found
    return None


def _jumps(function: Callable[[float], Array], distance: float) -> Array:
    """Return the jump of each component within this distance of 0, or 0 if the component changes as much elsewhere."""
    # The interval is not symmetric, so that its bisection avoids the value at 0, which functions such as sign define
    # separately.
    a, b = -distance, 1.3 * distance
    left, right = function(a), function(b)
    total, rest = np.abs(right - left), np.zeros(len(left))
    for _ in range(BISECTIONS):
        middle = 0.5 * (a + b)
        value = function(middle)
        first, second = np.abs(value - left), np.abs(right - value)
        # Continue with the half in which almost the whole change of a component occurs.
        if ((first > 0.5 * total) & (rest + second < 0.5 * first)).any():
            b, right, rest = middle, value, rest + second
        elif ((second > 0.5 * total) & (rest + first < 0.5 * second)).any():
            a, left, rest = middle, value, rest + first
        else:
            return np.zeros(len(left))
    change = np.abs(right - left)
    return np.where((change > 0.5 * total) & (rest < 0.5 * change), change, 0.0)


def _singular(structure: Structure | None) -> str:
    """Describe the equations if they do not determine all variables; otherwise, return an empty string."""
    variables, equations = structure.singular if structure and not structure.is_huge() else ([], [])
    if not variables:
        return ""
    return (
        f"the equations do not determine the variables {listed(variables)}: the equations {listed(equations)} "
        "(counted from 0) depend on each other or contain no variable. Replace a dependent equation by the missing equation; "
        "if only differences of a pressure occur, fix one of its values"
    )


def _explain(
    initial: str, residual: Function, t: float, y: Array, yp: Array, tolerance: Array, pattern: Pattern | None
) -> str:
    """Explain why no consistent initial values are found; empty if the reason is unknown."""
    structure = Structure.at(residual, t, y, yp, tolerance, pattern=pattern)
    if structure is None:
        return ""
    singular = _singular(structure)
    if singular:
        return f"; {singular}"
    equations = structure.contradictory(initial)
    if equations:
        return (
            f"; a combination of the equations {listed(equations)} (counted from 0) does not contain the corrected values, so "
            'y0 must satisfy it; for index 2 and 3 use initial="given" and consistent values'
        )
    left = np.asarray(residual(t, y, yp), dtype=float)
    violated = np.flatnonzero(np.abs(left) > structure.effect(tolerance)).tolist()
    if not violated:
        return ""
    return (
        f"; y0 and yp0 violate the equations {listed(violated)} (counted from 0): check that they have a solution, and "
        "start closer to it"
    )
