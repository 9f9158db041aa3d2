"""Reasons why integrations fail or need many steps, and remedies."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress as ignoring
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ._arguments import LARGE
from ._index import index_note, listed
from ._kinks import INSTANTS, growing, is_late, is_nonlinear_in_rates, jumping, kinked
from ._parts import _is_counted_from_start
from ._solution import Array, DaeSolution, Function
from ._stops import FAILED_AT_START, FREQUENT, NO_STEPS, STOPPED, TOO_SMALL, VALUELESS, fails_to_converge
from ._structure import LARGEST, Pattern, Structure

# Remedy for initial values that violate constraints.
START = (
    "positions and velocities must satisfy the constraints and their derivatives: `consistent_start` computes "
    "them for position constraints"
)

# Recommended width, in tolerances, of smooth functions that replace jumps. All methods can integrate such functions.
WIDTH = 100.0

# Recommended width of smooth functions that replace kinks. Of 36 runs of a rectifier, 9 stopped at a width of 1
# tolerance, but only one stopped at a width of 10 or 100 tolerances.
SMOOTH = "10 to 100 tolerances"

# Distance, as a fraction of the span, below which a listed break is considered to be meant for a jump.
NEAR = 1e-6
# Relative tolerance at or above which tighter tolerances are suggested to improve difference quotients.
LOOSE = 1e-5

# If the first 100 steps cover less than this fraction of the span, the steps are too short from the start.
SLOW = 1e-3

# Ratio of failed error tests to steps of BDF above which advice is given. The ratio is at most 0.14 for standard
# stiff or oscillating problems, and 0.2 to 0.5 for a transistor amplifier with coupling capacitors.
FAILED = 1.0 / 6.0


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
    # Description of missing, wrong or too high indices; empty if all are right.
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
    # Returns the solution up to the time of the stop; with `t_eval`, the last output may be far from this time.
    up_to_stop: Callable[[], DaeSolution | None] = lambda: None


class Ending:
    """End of an integration, with properties of F and of the solution there, which are computed when they are needed."""

    def __init__(self, solution: DaeSolution, residual: Function, rtol: float, atol: Array, facts: Facts) -> None:
        self.solution, self.residual, self.rtol, self.atol, self.facts = solution, residual, rtol, atol, facts
        self.is_bdf = solution.method == "bdf"
        self.has_failed = not solution.success
        self.message = solution.message
        self.n = len(solution.y)

    @cached_property
    def stop(self) -> float:
        """Time of the stop, which may be after the last output."""
        stopped = STOPPED.match(self.message)
        return float(stopped[1] if stopped else self.solution.t[-1])

    def structure_at(self, k: int) -> Structure | None:
        """Return the structure of the equations at state number k."""
        t, y, yp = self.solution.t[k], self.solution.y[:, k], self.solution.yp[:, k]
        return Structure.at(self.residual, t, y, yp, self.rtol * np.abs(y) + self.atol, pattern=self.facts.pattern)

    @cached_property
    def structure(self) -> Structure | None:
        return self.structure_at(-1)

    @cached_property
    def at_start(self) -> Structure | None:
        return self.structure_at(0)

    @cached_property
    def earlier(self) -> list[tuple[int, Structure]]:
        """Numbers of some states before the last one and the structures there, if the integration failed."""
        if not self.has_failed:
            return []
        last = len(self.solution.t)
        states = sorted(k for k in {(last - 1) // 2, last - 4, last - 2} if k >= 0)
        return [(k, structure) for k in states if (structure := self.structure_at(k))]

    @cached_property
    def singular(self) -> str:
        """Description of equations that do not determine all variables; empty if they determine all variables."""
        # A state that Newton's method or the error test does not accept may be far from the solution.
        described = describe_singular(self.structure) if all(describe_singular(other) for _, other in self.earlier) else ""
        # Close to a pole, the largest terms hide the other terms, so the description must also hold at the start.
        return described if not (described and self.steep) or describe_singular(self.at_start) else ""

    @cached_property
    def hidden(self) -> list[int]:
        """Variables whose index is above 1, for BDF."""
        found = self.structure.of_higher_index if self.structure and self.is_bdf else []
        if found and self.steep and self.at_start:
            return [j for j in found if j in self.at_start.of_higher_index]
        return found

    @cached_property
    def steep(self) -> list[int]:
        """Variables whose derivatives grow without bound, if the integration failed."""
        return growing(self.solution, self.facts.indices) if self.has_failed else []

    @cached_property
    def jump(self) -> tuple[list[int], int | None] | None:
        """Equations that jump at the end, and the variable with which they jump, if the integration failed."""
        return jumping(self.residual, self.solution, self.rtol, self.atol, self.stop) if self.has_failed else None

    @cached_property
    def kink(self) -> list[int]:
        """Equations with a kink near the last state or the stop."""
        found = kinked(self.residual, self.solution, self.rtol, self.atol)
        return found or kinked(self.residual, self.facts.up_to_stop(), self.rtol, self.atol)

    @cached_property
    def fails_many_error_tests(self) -> bool:
        solution = self.solution
        return self.is_bdf and solution.nsteps > 1000 and solution.netf > FAILED * solution.nsteps

    @cached_property
    def is_late(self) -> bool:
        """Whether the solution changes by more than the tolerances within the rounding of t."""
        start = float(self.solution.t[0])
        # An integration that counts times from its start does not fail because times are rounded.
        if self.has_failed and _is_counted_from_start(self.solution.method, start, self.facts.span):
            return False
        return is_late(self.solution, self.rtol, self.atol)


class Advice(NamedTuple):
    """Reason for a failure, with remedies."""

    text: str
    # Whether to keep the integrator's own remedies in the message.
    is_guess: bool = False


def advise(ending: Ending) -> str | None:
    """Return advice, if any, for an integration that ended early, failed many error tests or is limited by rounding of t.

    If the integration ended early, the advice is also added to the message of the solution. There, it replaces the
    remedies that the integrator suggests, unless the advice is a guess.
    """
    solution = ending.solution
    if not solution.t.size or not (ending.has_failed or ending.fails_many_error_tests or ending.is_late):
        return None
    reasons = FAILURES if ending.has_failed else SLOWNESS
    advice = next((advice for reason in reasons if (advice := reason(ending))), None)
    if advice is None:
        return None
    if ending.has_failed:
        reason, remedies, others = solution.message.partition(": the last half")[0].partition("; suggested remed")
        solution.message = f"{reason}; {advice.text}" + (remedies + others if advice.is_guess else "")
    return advice.text


def _varying_effects(ending: Ending) -> Advice | None:
    facts = ending.facts
    if ending.jump or "max_steps" in ending.message or not (variables := _nonlinear(ending)):
        return None
    described = (
        f"the effect of the variables {listed(variables)} (counted from 0) on F, and so their index, varies with the state, as "
        "for voltages at diodes: "
    )
    anyway = " (a warning about their index may then appear)"
    if ending.is_bdf and facts.suppress is not None and any(facts.suppress[j] for j in variables):
        return Advice(f"{described}do not exclude them by `suppress`{anyway}")
    if not ending.is_bdf and any(facts.indices[j] > 1 for j in variables if facts.indices):
        return Advice(f"{described}state 1 for them in `index`{anyway}")
    return Advice(f"{described}use tighter tolerances")


def _wrong_index(ending: Ending) -> Advice | None:
    return Advice(ending.facts.index_note) if ending.facts.index_note else None


def _undetermined(ending: Ending) -> Advice | None:
    return Advice(ending.singular) if ending.singular else None


def _wrong_velocities(ending: Ending) -> Advice | None:
    return Advice(START) if ending.facts.has_wrong_velocities and NO_STEPS in ending.message else None


def _hidden_in_error_test(ending: Ending) -> Advice | None:
    suppress = ending.facts.suppress
    tested = [j for j in ending.hidden if suppress is None or not suppress[j]]
    if not (ending.structure and tested):
        return None
    return Advice(index_note(ending.structure, "bdf", None, suppress)[0])


def _first_step(ending: Ending) -> Advice | None:
    failed = FAILED_AT_START.search(ending.message)
    if ending.solution.nsteps or not failed or ending.jump:
        return None
    # IDAS reduces the step size by a factor of 4^10 before it stops.
    text = (
        f"the error test fails in a first step of {failed[1]}: give `first_step={failed[1]}`, or `yp0` with the derivatives "
        "of all variables, including the algebraic ones"
    )
    if ending.facts.has_sensitivities and not ending.facts.has_jacobian:
        text = f"the error test fails in a first step of {failed[1]}: give the exact `jacobian`, which sensitivities also use"
    small = np.flatnonzero(ending.rtol * np.abs(ending.solution.y[:, -1]) < ending.atol)
    if 0 < len(small) < ending.n:
        near = f"the variables {listed(small.tolist())} (counted from 0) start at or near 0"
        text += f"; {near}: a larger `atol` may help"
    return Advice(text, is_guess=ending.facts.initial == "given")


def _first_step_after_a_break(ending: Ending) -> Advice | None:
    if not (ending.is_bdf and ending.n > LARGEST and FAILED_AT_START.search(ending.message)):
        return None
    return Advice(
        "the first step of BDF after a break uses the derivatives of algebraic variables, which are computed only for "
        f"systems of at most {LARGEST} variables: use a larger `rtol`, or a Radau method"
    )


def _jump_of_a_constraint(ending: Ending) -> Advice | None:
    is_at_break = NO_STEPS in ending.message if ending.facts.is_hidden else ending.hidden and VALUELESS in ending.message
    if not (ending.solution.nsteps and is_at_break):
        return None
    return Advice("a constraint or its derivative jumps at the break: end there, and start again with consistent values")


def _hidden_excluded(ending: Ending) -> Advice | None:
    if not ending.hidden:
        return None
    return Advice(
        f"the variables {listed(ending.hidden)} (counted from 0) have an index above 1, and Newton's iteration must find them: "
        "give them a larger `atol`, give the exact `jacobian`, or use a Radau method with `index`"
    )


def _jump(ending: Ending) -> Advice | None:
    if not ending.jump:
        return None
    (equations, variable), ends, stop, span = ending.jump, ending.facts.ends, ending.stop, ending.facts.span
    text = f"the equations {listed(equations)} (counted from 0) jump "
    if variable is not None:
        return Advice(
            f"{text}near this value of variable {variable}, and F may switch at every step (chattering), as dry friction and "
            f"relays do: replace the jump by a smooth function, such as tanh, over {WIDTH:.0f} tolerances of this "
            "variable, or use the equations of one side until an event, and then the equations of the next state"
        )
    if abs(ends[-1] - stop) < INSTANTS[-1] * np.spacing(max(abs(ends[-1]), span)):
        return Advice(f"{text}at the end of the span: also list {ends[-1]} in `breaks`")
    text += "at this time: list in `breaks` the times at which inputs jump"
    nearest = min(ends[1:-1], key=lambda t: abs(t - stop), default=np.inf)
    if abs(nearest - stop) < NEAR * span:
        text += f", with all digits: the listed time {nearest} differs by {abs(nearest - stop):.1e}"
    return Advice(text)


def _not_finite(ending: Ending) -> Advice | None:
    if not any(value in ending.message for value in ("= NaN", "= inf", "= -inf")):
        return None
    return Advice(
        "the domain of F may end near this state; otherwise limit the arguments of exponentials, or use tighter tolerances"
    )


def _short_steps_from_the_start(ending: Ending) -> Advice | None:
    facts, t = ending.facts, ending.solution.t
    is_slow = len(t) > 1000 and abs(t[100] - t[0]) < SLOW * facts.span
    if not facts.is_hidden or facts.has_outputs or not is_slow:
        return None
    exact = "" if facts.has_jacobian else "the exact `jacobian`, tighter tolerances or "
    return Advice(
        f"steps are very short from the start: use {exact}a `first_step` of about 1/1000 of the time within which "
        "the solution changes"
    )


def _kink(ending: Ending) -> Advice | None:
    if not (fails_to_converge(ending.message) or TOO_SMALL in ending.message) or not ending.kink:
        return None
    text = (
        f"the equations {ending.kink} (counted from 0) have a kink near this time, as `max`, `abs` and `if` do: replace it "
        f"by a smooth function over {SMOOTH}, or change the equations at one of the `events`"
    )
    has_jacobian = ending.facts.has_jacobian
    # With `t_eval`, Radau IIA with an exact Jacobian stops at most kinks.
    if has_jacobian or ending.is_bdf or not ending.facts.has_outputs:
        text += ", or call without `jacobian`" if has_jacobian else ", or give the exact `jacobian`"
    return Advice(text)


def _pole(ending: Ending) -> Advice | None:
    if not ending.steep:
        return None
    return Advice(
        f"the derivatives of the variables {ending.steep} (counted from 0) grow without bound near this time: "
        "the solution may have a pole, a square root or the end of the domain of F there"
    )


def _late_times(ending: Ending) -> Advice | None:
    if not ending.is_late:
        return None
    last = ending.solution.t[-1]
    return Advice(
        f"t_span: times near {last:.3g} are rounded to {np.spacing(abs(last)):.1e}, within which "
        "the solution changes by more than the tolerances: measure time from a closer origin"
    )


def _nonlinear_rates(ending: Ending) -> Advice | None:
    if not (ending.is_bdf and is_nonlinear_in_rates(ending.residual, ending.solution)):
        return None
    text = "F is nonlinear in y', for which BDF may need very short steps or stop: use a Radau method"
    text += "" if ending.facts.has_jacobian else "; the exact `jacobian` or tighter tolerances may also help"
    return Advice(text, is_guess=True)


def _failed_error_tests(ending: Ending) -> Advice | None:
    if not ending.fails_many_error_tests:
        return None
    # This occurs, for example, if a variable amplifies the errors of other variables: the error estimate of BDF is
    # small while the step size is constant, but each longer step fails, and the order remains 1.
    solution, structure = ending.solution, ending.structure
    excluded = np.array(ending.facts.suppress or np.zeros(ending.n, bool))
    algebraic = np.flatnonzero(structure.algebraic & ~excluded).tolist() if structure else []
    other = f"excluding the algebraic variables {listed(algebraic)} (counted from 0) with `suppress` or " if algebraic else ""
    text = (
        f"BDF failed {solution.netf} error tests in {solution.nsteps} steps: {other}a Radau method may "
        "need far fewer steps"
    )
    if len(ending.facts.ends) == 2:
        text += "; if inputs jump, list the times of the jumps in `breaks`"
    if structure and structure.undetermined():
        text += (
            "; a larger `atol` may also help, or new variables for the combinations of derivatives in F, such as "
            "voltages across coupling capacitors"
        )
    return Advice(text)


def _inaccurate_quotients(ending: Ending) -> Advice | None:
    solution, message = ending.solution, ending.message
    is_limited = "max_steps" in message and FREQUENT * solution.ncfn > solution.nsteps
    if ending.facts.has_jacobian or not (fails_to_converge(message) or is_limited):
        return None
    other = " or tighter tolerances" if ending.rtol >= LOOSE else ""
    other = " or a `first_step`" if NO_STEPS in message else other
    text = f"difference quotients may be inaccurate: give the exact `jacobian`{other}"
    return Advice(f"{text}; replace a kink of F, such as `max`, by a smooth function over {SMOOTH}", is_guess=True)


def _possible_kink(ending: Ending) -> Advice | None:
    # With `t_eval`, the last known state may be far from the kink.
    if ending.facts.is_hidden or not fails_to_converge(ending.message):
        return None
    text = f"F may have a kink near this time, as `max` and `abs` do: replace it by a smooth function over {SMOOTH}, or "
    return Advice(text + "call without `jacobian`", is_guess=True)


# Functions that return advice if they recognize the reason for a failure. The first reason that applies is reported, so
# certain and specific reasons precede guesses.
FAILURES = (
    _varying_effects,
    _wrong_index,
    _undetermined,
    _wrong_velocities,
    _hidden_in_error_test,
    _first_step,
    _first_step_after_a_break,
    _jump_of_a_constraint,
    _hidden_excluded,
    _jump,
    _not_finite,
    _short_steps_from_the_start,
    _kink,
    _pole,
    _late_times,
    _nonlinear_rates,
    _failed_error_tests,
    _inaccurate_quotients,
    _possible_kink,
)

# Functions that return advice if they recognize why an integration that reached its end took many steps.
SLOWNESS = (_hidden_in_error_test, _late_times, _failed_error_tests)


# Ratio above which the effect of a variable on F is considered to vary strongly: the change of F if the variable changes by
# its typical size, divided by the change that the derivative predicts. The ratio is 1 for linear functions, about 2 for the
# sum of a variable and its cube, and e^x/x for diodes at x thermal voltages. The derivative is computed with increments of
# FRACTION times the size.
STRONGER = 10.0
FRACTION = 0.01


def _nonlinear(ending: Ending) -> list[int]:
    """Return the algebraic variables of index 2 whose effect on F varies by orders of magnitude.

    An example is the voltage of a diode, which conducts only at some times. Where F depends strongly on such a variable,
    the index of the variable is 1, and error tests for index 2 allow errors that F magnifies.
    """
    solution, residual, facts, n = ending.solution, ending.residual, ending.facts, ending.n
    if n > LARGE:
        return []
    found = set()
    sizes = np.median(np.abs(solution.y), axis=1)
    for k, structure in ending.earlier:
        t, y, yp = solution.t[k], solution.y[:, k], solution.yp[:, k]
        stated = structure.algebraic & (np.array(facts.indices or [0] * n) == 2)
        if facts.suppress is not None and ending.is_bdf:
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


def describe_singular(structure: Structure | None) -> str:
    """Describe the equations if they do not determine all variables; otherwise, return an empty string."""
    variables, equations = structure.singular if structure and not structure.is_huge() else ([], [])
    if not variables:
        return ""
    return (
        f"the equations do not determine the variables {listed(variables)}: the equations {listed(equations)} "
        "(counted from 0) depend on each other or contain no variable. Replace a dependent equation by the missing equation; "
        "if only differences of a pressure occur, fix one of its values"
    )


def explain(
    initial: str, residual: Function, t: float, y: Array, yp: Array, tolerance: Array, pattern: Pattern | None
) -> str:
    """Explain why no consistent initial values are found; return an empty string if the reason is unknown."""
    structure = Structure.at(residual, t, y, yp, tolerance, pattern=pattern)
    if structure is None:
        return ""
    singular = describe_singular(structure)
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
