"""Fully implicit differential-algebraic equations F(t, y, y') = 0."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._advice import START, Ending, Facts, advise, describe_singular, explain
from ._arguments import (
    LARGE,
    _Calls,
    _Events,
    _Jacobian,
    _count,
    _in_bytes,
    _marks,
    _number,
    _output_times,
    _pattern,
    _pattern_of_jacobian,
    _real,
    _vector,
    _with,
)
from ._breaks import jumping_from_start, slope, values_after, values_of_index_2
from ._entries import missing_entry, share_of_entries, wrong_entry
from ._index import index_note, jumping_multipliers, listed
from ._outputs import violated
from ._parts import (
    _End,
    _counted_from,
    _cut,
    _delay,
    _ends_of_parts,
    _in_part,
    _is_counted_from_start,
    _joined,
    _within,
)
from ._sensitivity import Sensitivities
from ._solution import Array, DaeSolution, DenseOutput, Function
from ._stops import STOPPED
from ._structure import Structure

__all__ = ["DaeSolution", "DenseOutput", "solve_dae"]

METHODS = ("bdf", "ida", "radau5", "radau9", "radau13")

# Default step limit. Typical integrations need fewer steps, and this many steps take about a minute.
MAX_STEPS = 200_000

# Step limit when a failed integration is repeated from its last output.
MOST_AGAIN = 1000

# Smallest relative tolerance. SciPy raises smaller tolerances to the same value.
SMALLEST_RTOL = float(100 * np.finfo(float).eps)

# SciPy's names of these methods.
SCIPY_METHODS = {"Radau": "radau5", "BDF": "bdf"}

# Arguments of other solvers that have a different name or form here.
OTHER_NAMES = {
    "fun": "it is `residual` here, F(t, y, y'), not y' = f(t, y)",
    "jac": "it is `jacobian` here, and returns the pair dF/dy, dF/dy' at (t, y, yp)",
    "jac_sparsity": "it is `sparsity` here, the pattern of dF/dy and dF/dy' together",
    "lband": "give the pattern as `sparsity`",
    "uband": "give the pattern as `sparsity`",
    "min_step": "a minimum step cannot be set; limit the number of steps with `max_steps`",
    "vectorized": "the residual is called for one state at a time",
    "reltol": "it is `rtol` here",
    "abstol": "it is `atol` here",
    "mass": "the `residual` is M y' - f(t, y) here",
    "differential_vars": "it is `algebraic` here, with the opposite values",
    "algebraic_idx": "it is `algebraic` here, a bool for each variable",
    "calc_initcond": 'it is `initial` here: "algebraic" for "yp0", "states" for "y0"',
    "eventsfn": "it is `events` here, a function or a list of functions that return a number",
    "user_data": "it is `args` here, a tuple",
    **dict.fromkeys(
        ("constraints", "constraints_idx", "constraints_type", "nonnegative", "non_negative"),
        "signs cannot be prescribed here: the `residual` may raise `myovib.StepFailure` at values for which F is undefined",
    ),
    **dict.fromkeys(("p", "sensitivities"), "sensitivities are computed for the values of `parameters` here"),
}


def solve_dae(
    residual: Function,
    t_span: tuple[float, float],
    y0: ArrayLike,
    yp0: ArrayLike,
    method: Literal["bdf", "ida", "radau5", "radau9", "radau13"] = "bdf",
    *,
    jacobian: Function | None = None,
    sparsity: Any = None,
    index: Sequence[int] | None = None,
    algebraic: ArrayLike | None = None,
    suppress: ArrayLike | bool | None = None,
    events: Function | Sequence[Function] | None = None,
    rtol: float = 1e-4,
    atol: ArrayLike = 1e-8,
    t_eval: ArrayLike | None = None,
    dense_output: bool = False,
    first_step: float | None = None,
    max_step: float | None = None,
    max_order: int | None = None,
    max_steps: int | None = None,
    breaks: ArrayLike = (),
    initial: Literal["given", "algebraic", "states"] = "given",
    args: Sequence[Any] = (),
    parameters: ArrayLike | None = None,
    df_dp: Callable[..., Any] | None = None,
    dy0_dp: ArrayLike | None = None,
    **unknown: Any,
) -> DaeSolution:
    """Integrate F(t, y, y') = 0.

    Parameters
    ----------
    residual : callable
        ``residual(t, y, yp)`` returns F, an array as long as `y0`. It may raise
        `StepFailure` if F is undefined; the integrator then tries a smaller step. Any
        other exception ends the integration and is raised unchanged.
    t_span : (float, float)
        Start and end of the integration. With "bdf", the end may be before the start.
    y0, yp0 : array_like, shape (n,)
        Solution and derivative at the start. They must be consistent unless `initial`
        requests a correction. If values violate constraints by less than the tolerances,
        Radau methods with `index` move them onto the constraints. Equations that contain
        derivatives are not checked, so a wrong `yp0` appears in the first column of `yp`.
        A warning names multipliers of index 2 and 3 that jump in the first step (for
        "bdf", only in systems of at most 200 variables).
    method : {"bdf", "radau5", "radau9", "radau13"}
        BDF of order 1 to 5, for index 0 and 1 (and index 2 with the algebraic
        components excluded from the error test, see `suppress`), or Radau IIA of
        order 5, 9 or 13, for index 0 to 3. "ida", SUNDIALS' name, means "bdf".
    jacobian : callable, optional
        ``jacobian(t, y, yp)`` returns the pair dF/dy, dF/dy': dense matrices or
        matrices of `scipy.sparse`. By default, finite differences are used. The
        Jacobian is compared with finite differences at the start; a warning names an
        entry that seems wrong.
    sparsity : array_like or sparse matrix, shape (n, n), optional
        Common pattern of dF/dy and dF/dy'. It is nonzero for each entry that may be
        nonzero at any time, also on the diagonal if equation i contains y_i or y'_i.
        By default, it is the pattern at the start of a sparse `jacobian` with more than
        200 rows; otherwise, matrices are full. Without `jacobian`, the pattern is
        compared with the residual only at the start, and a `ValueError` names an entry
        that is nonzero there but missing. If the integration fails, the pattern is also
        compared at the last state.
    index : sequence of int, optional
        Index of each variable, 0 to 3. The error test of Radau methods needs it for
        systems of index 2 and 3. In mechanics, the index is 1 (or 0) for positions, 2
        for velocities, and 3 for multipliers of position constraints. In the GGL form,
        it is 1 for positions and velocities, and 2 for all multipliers. "bdf" does not
        use it: exclude components of index 2 with `suppress`. For index 3, use a Radau
        method.
    algebraic : array_like of bool, optional
        True if y'_i does not occur in F. By default, it is determined from the Jacobian
        at the start.
    suppress : bool or array_like of bool, optional
        Components excluded from the error test. ``True`` excludes the components
        in `algebraic`, which is then required.
    events : callable or list of callables, optional
        ``event(t, y, yp)`` returns either a number, whose zeros are events, or a bool,
        whose changes are events (True counts as positive). If a number stays at zero
        for an interval, the event is at the start of the interval. The attributes are
        the same as in `solve_ivp`: ``terminal`` (a bool, or the number of the
        occurrence that ends the integration) and ``direction`` (the sign of the
        change). A zero at the start of the integration is not reported. A zero at the
        end is reported unless rounding errors keep the number from reaching zero. A
        change of sign at a break is an event at the break.
    rtol, atol : float; float or array_like, shape (n,)
        Tolerances: the local error may be ``rtol |y_i| + atol_i``. `rtol` is a
        scalar.
    t_eval : array_like, optional
        Output times, which must be finite and sorted in the direction of integration. A
        time may be repeated. By default, the outputs are at the ends of all steps. The
        output at a break has the values before it. A warning names an equation without
        derivatives if the outputs violate it by more than 1000 tolerances (20 000 at index
        2 and 3).
    dense_output : bool
        Whether the result contains `sol`.
    first_step, max_step : float, optional
        Size of the first step and maximum step size. The step size is controlled by
        errors at the times at which F is evaluated. An input that acts or oscillates
        only between these times is missed: limit the step size to a fraction of the
        duration or period of the input. A warning names an equation that is not satisfied
        within one of the first steps.
    max_order : int, optional
        Maximum order of "bdf"; 5 by default.
    max_steps : int or inf, optional
        Maximum number of steps between breaks; 200 000 by default.
    breaks : array_like, optional
        Times at which an input jumps or has a kink. The integration stops there and starts
        again. The functions are not called within a few rounding errors of these times, so
        each step covers only one side of the jump. At index 0 and 1, `y` and `yp` are
        kept if F does not jump there by more than the tolerances allow; otherwise algebraic
        variables and derivatives are computed again. The derivatives of algebraic
        variables, which "bdf" uses in the first step, are always computed again if there
        are at most 200 variables. If `t_eval` is not given, a break occurs twice in `t`,
        with the values before and after it. For Radau methods with an `index` above 1, it
        occurs once, with the values before it. Times outside `t_span` are ignored. Times
        that differ by less than 1e-12 of the largest time count as one break.
    initial : {"given", "algebraic", "states"}
        Values that are corrected at the start so that F = 0. "given": none;
        "algebraic": the algebraic components and the derivatives of the other
        components (index 1); "states": all components of y.
    args : sequence, optional
        Additional arguments that are passed to `residual`, `jacobian` and `events`
        after ``t, y, yp``.
    parameters : array_like, shape (k,), optional
        Values of the parameters p for which the derivatives dy/dp are computed. All
        functions then receive the array p as an additional argument after ``t, y, yp``.
        The steps of Radau methods remain the same; "bdf" (index 0 and 1) also tests the
        error of dy/dp. Derivatives of variables of index 2 and 3 are less accurate than
        the variables.
    df_dp : callable, optional
        ``df_dp(t, y, yp, p)`` returns dF/dp, with the shape (n, k). It is compared with
        differences in the middle and at the end of the solution; `status` is -1 if it
        looks wrong. By default, central differences with increments of 6e-6 ``|p_j|`` are
        used. If p_j is 0, or this increment would be lost by rounding, an increment for
        which the quotient is accurate is chosen at the start, in any unit of p_j. If F
        does not depend on p_j = 0 there, the increment is 6e-6.
    dy0_dp : array_like, shape (n, k), optional
        Derivatives of `y0` with respect to the parameters; zero by default. At index 0
        and 1, rows of algebraic variables are computed if n is at most 200, or `sparsity`
        is given. A `ValueError` is raised if the values contradict an equation without
        derivatives or, at index 3 with n at most 200, the time derivative of a position
        constraint. Rows of multipliers of index 2 and 3 are not checked.

    Returns
    -------
    DaeSolution

    Raises
    ------
    ValueError
        If an argument is invalid.
    RuntimeError
        If the initial values violate an equation without derivatives by more than the
        tolerances, and `initial` does not correct them; if no consistent initial values
        are found; or if the integrator rejects a setting. If one of these errors occurs
        after a break, the result up to the break is returned instead, with `status` -1.

    Examples
    --------
    Robertson's kinetics, whose third equation is algebraic:

    >>> def robertson(t, y, yp):
    ...     a, b, c = y
    ...     rate = 0.04 * a - 1e4 * b * c
    ...     return [yp[0] + rate, yp[1] - rate + 3e7 * b * b, a + b + c - 1]
    >>> s = solve_dae(robertson, (0, 40), [1, 0, 0], [-0.04, 0.04, 0], rtol=1e-6,
    ...               atol=[1e-10, 1e-12, 1e-10])
    >>> round(float(s.y[0, -1]), 4)
    0.7158
    """
    family, max_order = _checked_choices(method, initial, max_order, unknown)
    if np.ndim(rtol) != 0:
        raise ValueError(f"rtol = {rtol}: must be a number (only `atol` may be a vector)")
    _real("rtol", rtol)
    if not SMALLEST_RTOL <= rtol < 1:
        raise ValueError(f"rtol = {rtol}: must be at least {SMALLEST_RTOL:.2e} (100 rounding errors) and below 1")
    start = _vector("y0", y0)
    n = len(start)
    rates = _vector("yp0", yp0, n)
    tolerances = _vector("atol", np.atleast_1d(_real("atol", atol)))
    if len(tolerances) not in (1, n):
        raise ValueError(f"atol has {len(tolerances)} entries: must be 1 or {n}")
    if (tolerances < 0).any():
        raise ValueError(f"atol = {atol!r}: must be at least 0")
    if np.ndim(t_span) != 1 or len(t_span) != 2:
        raise TypeError(f"t_span = {t_span!r}: must be a pair (start, end)")
    t0, t_end = (float(t) for t in t_span)
    if t0 == t_end or not np.isfinite([t0, t_end]).all():
        raise ValueError(f"t_span = ({t0}, {t_end}): must be two different finite times")
    if t_end < t0 and family != "bdf":
        raise ValueError(f't_span = ({t0}, {t_end}): only "bdf" integrates backward')
    for name, step in (("first_step", first_step), ("max_step", max_step)):
        if step is not None and not _number(name, step) > 0:
            raise ValueError(f"{name} = {step}: must be above 0")
    limit = _count("max_steps", MAX_STEPS if max_steps is None else max_steps)
    marks = _marks("algebraic", algebraic, n)
    if suppress is True and marks is None:
        raise ValueError("suppress = True excludes the algebraic components: specify them in `algebraic`")
    excluded = marks if suppress is True else _marks("suppress", None if suppress is False else suppress, n)
    if excluded is not None and all(excluded):
        raise ValueError("suppress excludes all variables: the error test must include at least one")
    is_tested = np.ones(n, bool) if excluded is None else ~np.array(excluded)
    if without := np.flatnonzero(is_tested & (tolerances == 0.0) & (start == 0.0)).tolist():
        raise ValueError(f"atol is 0 for the variables {listed(without)} (counted from 0), which start at 0: it must be above 0")
    if index is not None and np.ndim(index) != 1:
        raise TypeError(f"index = {index!r}: must be a sequence of {n} numbers from 0 to 3")
    given = None if index is None else _real("index", index)
    if given is not None and (len(given) != n or not np.isin(given, range(4)).all()):
        raise ValueError(f"index = {index}: must have {n} entries, whole numbers from 0 to 3")
    indices = None if given is None else [int(i) for i in given]
    if family == "bdf" and excluded is None and indices is not None and max(indices) > 1:
        raise ValueError(
            f'index contains {max(indices)}, which "bdf" does not use: use a Radau method, or, for '
            "index 2, exclude these components from the error test with `suppress`"
        )
    highest = max(indices or [0])
    is_hidden = highest > 1
    if initial == "algebraic" and is_hidden:
        raise ValueError(
            f'initial = "algebraic" is for index 0 and 1, but index contains {highest}: give initial '
            "values that satisfy the constraints and their derivatives"
        )
    if not isinstance(args, Sequence) or isinstance(args, str):
        raise ValueError(f"args = {args!r}: must be a tuple, as in args=({args!r},)")
    sensitivities, calls = None, _Calls()
    if parameters is not None:
        if initial != "given":
            raise ValueError(
                f'initial = "{initial}" is not possible with `parameters`: first correct the values in an integration without '
                "`parameters` and with max_steps=1, and give its y[:, 0] and yp[:, 0] as y0 and yp0"
            )
        sensitivities = Sensitivities(parameters, (residual, df_dp), args, dy0_dp, n, calls)
        args = (sensitivities.parameters, *args)
    elif df_dp is not None or dy0_dp is not None:
        raise ValueError("df_dp and dy0_dp need `parameters`")
    residual = _with(residual, args, "residual", calls)
    jacobian = None if jacobian is None else _with(jacobian, args, "jacobian")
    ends = _ends_of_parts(breaks, t0, t_end)
    first_limits = (ends[0].after, ends[1].before)
    watched = _Events(events, args)
    pattern = None if sparsity is None else _pattern(sparsity, n)
    if pattern is None and jacobian is not None and n > LARGE:
        pattern = _pattern_of_jacobian(jacobian, first_limits[0], start, rates)
    matrices = None if jacobian is None else _Jacobian(jacobian, pattern, n)
    request = {
        "pattern": None if pattern is None else (pattern[0].tolist(), pattern[1].tolist()),
        "directions": watched.directions,
        "algebraic": marks,
        "index": indices,
        "suppress": excluded,
        "method": family,
        "rtol": float(rtol),
        "atol": tolerances.tolist(),
        "first_step": None if first_step is None else float(first_step),
        "max_step": None if max_step is None or np.isinf(max_step) else float(max_step),
        "max_order": int(max_order),
        # With a value proportional to the duration, the steps do not depend on the unit of time.
        "time_scale": abs(t_end - t0),
        "max_steps": limit,
        "has_default_limit": max_steps is None,
        "dense": bool(dense_output),
        "initial": initial,
    }
    outputs = _output_times(t_eval, t0, t_end)
    notes: list[str] = []
    if initial != "given":
        _expect_finite(_in_bytes(residual, n), first_limits[0], start, rates)
    weights = rtol * np.abs(start) + tolerances
    structure = Structure.at(residual, first_limits[0], start, rates, weights, pattern=pattern)
    if structure and marks is not None and (occurring := np.flatnonzero(np.array(marks) & structure.differential).tolist()):
        raise ValueError(
            f"algebraic: the derivatives of the variables {listed(occurring)} (counted from 0) occur in F, so "
            "these variables are not algebraic: set False for them"
        )
    # The index is known if the indices of all variables are given or, for BDF, if variables are excluded from the error
    # test.
    is_index_known = excluded is not None if family == "bdf" else indices is not None
    constraints, positions = None, None
    if indices is not None and highest == 3 and initial == "given":
        of_rates = rtol * np.abs(rates) + tolerances
        positions = np.array(indices) <= 1
        positions &= ~structure.algebraic if structure else True
        constraints = _PositionConstraints.at(residual, first_limits, (start, rates), positions, (weights, of_rates))
    if constraints is not None:
        rates = constraints.yp
        for equation in constraints.changing:
            warnings.warn(
                f"equation {equation} (counted from 0), a constraint on positions, changes at rate "
                f"{constraints.rates[equation]:.2e}: the velocities are not consistent and will jump in the "
                "first step. `consistent_start` computes consistent ones",
                stacklevel=2,
            )
    if structure and initial == "given":
        _expect_consistent(structure, residual, first_limits[0], weights)
    note, is_of_index_4 = "", False
    if structure:
        note, is_of_index_4 = index_note(structure, family, indices, excluded)
        notes += [note] if note else []
    if structure and initial == "algebraic" and (free := structure.undetermined()):
        notes.append(
            f"F = 0 does not determine the derivatives of the variables {listed(free)} (counted from 0), "
            "because dF/dy' is singular: `yp` may be wrong at the start. Introduce a variable for the "
            "combination whose derivative occurs"
        )
    if matrices is None and pattern is None and (share := share_of_entries(residual, first_limits[0], start, rates)):
        notes.append(
            f"only about {share:.1%} of the entries of the Jacobian are nonzero, but full matrices are computed, with {n} "
            "differences each: `sparsity` makes them much cheaper"
        )
    shown: set[str] = set()

    def warn(text: str, stacklevel: int) -> None:
        if text not in shown:
            shown.add(text)
            warnings.warn(text, stacklevel=stacklevel + 1)

    # Warnings are issued before the integration, which may take a long time.
    for text in notes:
        warn(text, 2)
    notes.clear()
    request["on_warning"] = partial(warn, stacklevel=3)
    may_have_higher_index = family != "bdf" and not is_index_known
    if may_have_higher_index and structure:
        may_have_higher_index = any(structure.singular) or bool(structure.of_higher_index)
    request["may_have_higher_index"] = may_have_higher_index
    request["has_free_rates"] = structure is None or structure.has_free_rates()
    try:
        found, last_limits = _integrate_parts(
            request, ends, (residual, matrices, watched, sensitivities), (start, rates), outputs, positions
        )
    except _Failed as failed:
        is_violated = "not consistent" in str(failed) and constraints is not None and constraints.are_violated
        explained = f"; {START}" if is_violated else ""
        if initial != "given":
            tolerance = rtol * np.abs(start) + tolerances
            explained = explain(initial, residual, first_limits[0], start, rates, tolerance, pattern)
        raise RuntimeError(f"{failed}{explained}") from None
    of_functions = found.pop("warnings")
    n_parameters = 0 if sensitivities is None else len(sensitivities.parameters)
    solution = _solution(found, n, len(watched.functions), n_parameters, family)
    # Before the first output time, only the initial state is known.
    last = solution
    if not (solution.t.size or solution.success):
        last = replace(solution, t=np.array([t0]), y=start[:, None], yp=rates[:, None])

    def steps_with(settings: dict[str, Any], parts: list[_End], state: tuple[Array, Array]) -> DaeSolution | None:
        """Return the steps with changed settings, without events and sensitivities; None if no step succeeds."""
        functions = (_recoverable(residual), matrices and _recoverable(matrices), _Events(None, ()), None)
        try:
            steps, _ = _integrate_parts({**request, **settings}, parts, functions, state, None)
        except _Failed:
            return None
        steps.pop("warnings")
        return _solution(steps, n, 0, 0, family)

    def up_to_stop() -> DaeSolution | None:
        """Return the steps from the last output to the time at which the integration stopped."""
        stopped = STOPPED.match(solution.message)
        if outputs is None or not stopped or float(stopped[1]) == last.t[-1]:
            return None
        few: dict[str, Any] = {"first_step": None, "max_steps": MOST_AGAIN, "on_warning": lambda _: None}
        few["initial"] = "given" if is_hidden else "algebraic"
        parts = _ends_of_parts(breaks, float(last.t[-1]), float(stopped[1]))
        return steps_with(few, parts, (last.y[:, -1], last.yp[:, -1]))

    facts = Facts(
        suppress=excluded,
        is_hidden=is_hidden,
        has_wrong_velocities=constraints is not None and bool(constraints.changing),
        has_jacobian=jacobian is not None,
        has_sensitivities=sensitivities is not None,
        index_note=note,
        span=abs(t_end - t0),
        has_outputs=outputs is not None,
        initial=initial,
        ends=[end.t for end in ends],
        pattern=pattern,
        indices=indices,
        up_to_stop=up_to_stop,
    )
    wrong = next((text for subject, text in of_functions if subject == "jacobian"), None)
    if pattern is not None and jacobian is None and not solution.success:
        wrong = missing_entry(solution, _within(residual, last_limits), pattern, rtol, tolerances)
    if wrong or (wrong := wrong_entry(solution, _within(residual, last_limits), jacobian, last_limits, rtol, tolerances)):
        notes.append(wrong)
        if not solution.success:
            solution.message = f"{solution.message.partition('; suggested remed')[0]}; {wrong}"
    elif advice := advise(Ending(last, _within(residual, last_limits), rtol, tolerances, facts)):
        notes.append(advice)
        solution.message = last.message
    may_be_singular = structure is not None and bool(describe_singular(structure))
    if (is_of_index_4 or may_be_singular) and solution.success and solution.t.size:
        # The linearized equations may be singular only at the start, or their index may be too high only there.
        end = (solution.t[-1], solution.y[:, -1], solution.yp[:, -1])
        weights = rtol * np.abs(end[1]) + tolerances
        at_end = Structure.at(_within(residual, last_limits), *end, weights, pattern=pattern)
        reason = describe_singular(at_end) if may_be_singular else ""
        if is_of_index_4 and at_end and index_note(at_end, family, indices, excluded)[1]:
            reason = note
        if reason:
            notes += [reason] if may_be_singular else []
            solution.status, solution.message = -1, f"{solution.message}, but the results may be wrong: {reason}"
    if outputs is not None and solution.success and structure:
        # F may jump at these times.
        jumps = [t0, *(end.t for end in ends[1:] if end.before != end.t)]
        is_higher = is_hidden or excluded is not None
        wrong = violated(solution, calls.count, residual, structure.without_rates, (rtol, tolerances), jumps, is_higher)
        notes += [wrong] if wrong else []
    if sensitivities is not None and solution.t.size:
        states = [(float(solution.t[k]), solution.y[:, k], solution.yp[:, k]) for k in {solution.t.size // 2, solution.t.size - 1}]
        if wrong := sensitivities.wrong_derivative(states):
            notes.append(wrong)
            if solution.success:
                solution.status, solution.message = -1, f"{solution.message}, but `dy_dp` may be wrong: {wrong}"
    # An index above 3 and an input that acts between the stages cause similar errors.
    notes += [] if is_of_index_4 and not solution.success else [text for _, text in of_functions]
    jumping = []
    if family == "bdf" and excluded is not None and initial == "given" and structure and structure.of_higher_index:
        is_jump = jumping_from_start(residual, first_limits, (start, rates), (rtol, tolerances))
        jumping = [j for j in structure.of_higher_index if is_jump[j]]
    if is_hidden and family != "bdf" and indices is not None and not facts.has_wrong_velocities:

        def repeated(h: float | None) -> DaeSolution | None:
            """Return the solution in the first steps, with a first step of size h."""
            return steps_with({"first_step": h, "max_steps": 6, "dense": False}, ends[:2], (start, rates))

        # With output times, the result does not contain the steps.
        first_steps = solution if outputs is None else repeated(request["first_step"])
        if first_steps:
            jumping = jumping_multipliers(first_steps, family, indices, (rtol, tolerances), structure, repeated)
    if jumping:
        notes.append(
            f"the variables {listed(jumping)} (counted from 0) jump in the first step: their y0 is not consistent, and their "
            f"values {'within the first step' if highest == 3 else 'at the start'} are wrong"
        )
    for text in notes:
        warn(text, 2)
    solution.nfev = calls.count
    return solution


def _checked_choices(
    method: Any, initial: Any, max_order: int | None, unknown: dict[str, Any]
) -> tuple[str, int]:
    """Return the method and its maximum order."""
    for name in unknown:
        known = f": {OTHER_NAMES[name]}" if name in OTHER_NAMES else ""
        raise TypeError(f"solve_dae() got an unexpected keyword argument {name!r}{known}")
    if method not in METHODS:
        other = SCIPY_METHODS.get(method) if isinstance(method, str) else None
        known = f"; SciPy's {method!r} is {other!r} here" if other else ""
        raise ValueError(f"method = {method!r}: must be one of {', '.join(METHODS)}{known}")
    method = "bdf" if method == "ida" else method
    if initial not in ("given", "algebraic", "states"):
        raise ValueError(f"initial = {initial!r}: must be given, algebraic or states")
    if max_order is not None and method != "bdf":
        raise ValueError(f'max_order = {max_order}: only "bdf" has a variable order, not {method!r}')
    max_order = 5 if max_order is None else max_order
    if not 1 <= max_order <= 5:
        raise ValueError(f"max_order = {max_order}: must be 1 to 5")
    return method, max_order


def _recoverable(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that raises `StepFailure` instead of other exceptions, for states that may be outside of its domain."""

    def call(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            raise _native.StepFailure(str(error)) from error

    return call


class _Failed(Exception):
    """The integrator found no consistent initial values or rejected a setting."""


def _integrate_parts(
    request: dict[str, Any],
    ends: list[_End],
    functions: tuple[Function, Any, _Events, Sensitivities | None],
    start: tuple[Array, Array],
    outputs: list[float] | None,
    positions: NDArray[np.bool_] | None = None,
) -> tuple[dict[str, Any], tuple[float, float]]:
    """Integrate the parts between breaks one after the other.

    If `positions` marks variables, a warning is added for velocities that must jump at a break to satisfy the constraints
    on these variables. Returns the joined results, and the first and the last time at which the functions may be
    evaluated in the last part.
    """
    residual, matrices, watched, sensitivities = functions
    y, yp = start
    dy_dp = sensitivities.start if sensitivities else None
    n = len(y)
    is_hidden = max(request["index"] or [0]) > 1
    found: dict[str, Any] = {}
    before = None
    limits = (ends[0].after, ends[1].before)
    is_late = _is_counted_from_start(request["method"], ends[0].t, request["time_scale"])
    origin = ends[0].t if is_late else 0.0
    for part, (end_from, end_to) in enumerate(zip(ends, ends[1:])):
        is_first, is_last = part == 0, part == len(ends) - 2
        part_limits = (end_from.after, end_to.before)
        initial = request["initial"] if is_first else "given"
        if not (is_first or is_hidden):
            tolerances = (request["rtol"], np.array(request["atol"]))
            times = (end_from.before, *part_limits)
            is_bdf_of_index_2 = request["method"] == "bdf" and request["suppress"] is not None
            free_rates = (request["method"] == "bdf", request["has_free_rates"])
            after = is_bdf_of_index_2 and values_of_index_2(residual, part_limits, (y, yp), tolerances)
            after = after or values_after(residual, times, (y, yp), tolerances, request["time_scale"], free_rates)
            y, yp = after or (y, yp)
            initial = "given" if after else "algebraic"
        if not (is_first or positions is None):
            found["warnings"] += _changing_after(residual, (limits, part_limits), (y, yp), positions, request)
        due = None if outputs is None else _in_part(outputs, end_from.t, end_to.t, is_first)
        if due is not None and not is_last:
            due.append(end_to.t)
        events = None
        if watched.functions:
            events = _within(watched.values, part_limits, origin)
            events = _in_bytes(events, len(watched.functions), "events")
        of_parameters: dict[str, Any] = {"parameters": [], "df_dp": None, "dy0_dp": []}
        try:
            if sensitivities and dy_dp is not None:
                of_parameters = sensitivities.request(dy_dp, (part_limits, origin), (y, yp), request, is_first)
            solved = _native.solve(
                {
                    **request,
                    **of_parameters,
                    "residual": _in_bytes(_within(residual, part_limits, origin), n),
                    "jacobian": None if matrices is None else _within(matrices, part_limits, origin),
                    "events": events,
                    "terminal": watched.terminal_after(found.get("events", [])),
                    "events_before": before,
                    "t_span": (end_from.t - origin, end_to.t - origin),
                    "y0": y.tolist(),
                    "yp0": yp.tolist(),
                    "t_eval": None if due is None else [t - origin for t in due],
                    "after_break": is_hidden and not is_first,
                    "initial": initial,
                }
            )
        except (_native.StepFailure, RuntimeError) as error:
            # If a user's function raised the exception, the traceback contains the frame of that function.
            is_of_user = error.__traceback__ is not None and error.__traceback__.tb_next is not None
            if isinstance(error, _native.StepFailure):
                # The derivative with respect to a parameter raised this exception, outside of the integration.
                message = f"dF/dp is not defined at t = {end_from.t}: {error}"
            elif is_of_user:
                raise
            else:
                message = _counted_from(origin, str(error)) if is_late else str(error)
            if is_first:
                raise _Failed(message) from None
            found.update(status=-1, message=message)
            break
        if is_late:
            _delay(solved, origin)
        limits = part_limits
        if not is_first and is_hidden and outputs is None:
            # At the start of this part, the multipliers still have their values from before the break.
            _cut(solved, slice(1, None))
        if solved["status"] == 0 and not is_last:
            y, yp = (np.frombuffer(solved[name])[-n:] for name in ("y", "yp"))
            if dy_dp is not None:
                dy_dp = np.frombuffer(solved["dy_dp"])[-dy_dp.size :].reshape(dy_dp.shape[::-1]).T
            before = watched.values(part_limits[1], y, yp) if watched.functions else None
            if due is not None:
                _cut(solved, slice(-1))
        found = _joined(found, solved) if found else solved
        if found["status"] != 0:
            break
    return found, limits


def _expect_finite(residual: Any, t: float, y: Array, yp: Array) -> None:
    """Reject initial values at which F is not finite, because they cannot be corrected."""
    try:
        values = np.frombuffer(residual(t, bytearray(y), bytearray(yp)))
    except _native.StepFailure:
        return
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise RuntimeError(
            f"the residual is {values[wrong[0]]} in equation {wrong[0]} (counted from 0) at the "
            f"start, t = {t}: these values cannot be corrected"
        )


def _expect_consistent(structure: Structure, residual: Function, t: float, tolerance: Array) -> None:
    """Reject initial values that violate a combination of equations without derivatives.

    The integrators themselves examine only single equations.
    """
    y = structure.state[0]
    try:
        with np.errstate(all="ignore"):
            found = structure.contradiction(lambda yp: np.array(residual(t, y.copy(), yp.copy()), dtype=float), tolerance)
    except Exception:  # outside of the domain of F
        return
    if found:
        equations, value, change = found
        raise RuntimeError(
            f"the initial values are not consistent at t = {t}: a combination of the equations {listed(equations)} (counted "
            f"from 0), which contains no derivatives, has residual {value:.2e}, but changing y within the tolerances "
            f"changes it only by {change:.2e}: give a y0 that satisfies it"
        )


# Rate of a position constraint above which the velocities are reported as inconsistent, in units of the change of the
# rate if the velocities change by the tolerances.
FAR = 10.0


class _PositionConstraints(NamedTuple):
    """Result of the check of the position constraints at the start."""

    # Whether the positions violate a constraint.
    are_violated: bool
    # Constraints whose derivative along the velocities is not zero within the tolerances, and this derivative for all
    # equations.
    changing: list[int]
    rates: Array
    # yp0, with the rates of positions computed from the velocities.
    yp: Array

    @classmethod
    def at(
        cls,
        residual: Function,
        limits: tuple[float, float],
        start: tuple[Array, Array],
        positions: NDArray[np.bool_],
        tolerances: tuple[Array, Array],
    ) -> _PositionConstraints | None:
        """Check the constraints on the variables that `positions` marks; return None if F cannot be evaluated near the start.

        `limits` contains the start and the end of the part between breaks, and `tolerances` the tolerances of y and yp.
        """
        (t0, t_end), (y, yp) = limits, start

        def evaluate(t: float, y: Array, yp: Array) -> Array:
            return np.array(residual(t, y, yp), dtype=float)

        try:
            yp = _with_kinematic_rates(lambda yp: evaluate(t0, y, yp), yp, positions)
        except Exception:  # the integration reports it
            return None
        rates = np.where(positions, yp, 0.0)
        largest = np.abs(rates).max()
        size = np.abs(y[positions]).max(initial=0.0)
        span = abs(t_end - t0)
        # Time in which positions change by their size.
        time = min(size / largest, span) if size > 0.0 and largest > 0.0 else span
        increment = 1e-4 * time * np.sign(t_end - t0)

        def derivative(rates: Array, step: float = increment) -> Array:
            # F may be undefined before the start.
            return slope(lambda s: evaluate(t0 + s, y + s * rates, yp), step)

        try:
            given = evaluate(t0, y, yp)
            # The changes differ between variables, so that they do not cancel in an equation.
            golden = (np.sqrt(5.0) - 1.0) / 2.0
            sizes = 1.0 + golden * np.arange(2 * len(y)).reshape(2, -1) % 1.0
            others = np.where(positions, y, y + sizes[0] * (1.0 + np.abs(y)))
            moved = evaluate(t0, others, yp + sizes[1] * (1.0 + np.abs(yp)))
            rate = derivative(rates)
            alternating = (-1.0) ** np.arange(len(y))
            signs = [positions * sign for sign in (1.0, alternating)]
            within = [np.abs(evaluate(t0, y + sign * tolerances[0], yp) - given) for sign in signs]
            changes = [np.abs(derivative(rates + sign * tolerances[1]) - rate) for sign in signs]
            terms = np.abs(derivative((np.abs(rates) + positions * np.abs(y) / time) * alternating))
            # Inputs may change within the increment.
            unresolved = np.abs(derivative(rates, 0.1 * increment) - rate)
        except Exception:  # the integration reports it
            return None
        # Difference quotients are accurate to about 1e-10 of the terms.
        explained = np.max(changes, axis=0) + 1e-8 * terms
        is_constraint = (given == moved) & (explained > 0.0)
        changing = is_constraint & (np.abs(rate) > FAR * (explained + unresolved))
        is_violated = is_constraint & (np.abs(given) > np.max(within, axis=0))
        return cls(bool(is_violated.any()), np.flatnonzero(changing).tolist(), rate, yp)


def _changing_after(
    residual: Function,
    limits: tuple[tuple[float, float], tuple[float, float]],
    state: tuple[Array, Array],
    positions: NDArray[np.bool_],
    request: dict[str, Any],
) -> list[tuple[str, str]]:
    """Describe the constraints that the velocities satisfy before a break and violate after it.

    `limits` contains the first and the last time of the part before the break and of the part after it.
    """
    (y, yp), (of_part_before, of_part) = state, limits
    rtol, atol = request["rtol"], np.array(request["atol"])
    weights = (rtol * np.abs(y) + atol, rtol * np.abs(yp) + atol)
    after = _PositionConstraints.at(residual, of_part, state, positions, weights)
    before = after and after.changing and _PositionConstraints.at(residual, of_part_before[::-1], state, positions, weights)
    if not (after and before):
        return []
    # Velocities have errors of many tolerances.
    changing = [i for i in after.changing if abs(after.rates[i]) > FAR * abs(before.rates[i])]
    return [
        (
            "break",
            f"equation {i} (counted from 0), a constraint on positions, changes at rate {after.rates[i]:.2e} after the "
            f"break at t = {of_part[0]:.6g}: the velocities jump there, and the multipliers are impulses within the first "
            "step. End there, and start again with velocities from `consistent_start`",
        )
        for i in changing
    ]


def _with_kinematic_rates(residual: Callable[[Array], Array], yp: Array, positions: NDArray[np.bool_]) -> Array:
    """Return yp with the rates of positions computed from the linear equations that contain no other derivatives.

    Returns yp unchanged if these equations do not determine all rates, or if there are more than LARGE positions.
    """
    where = np.flatnonzero(positions)
    if len(where) > LARGE:
        return yp
    given = residual(yp)
    others = residual(np.where(positions, yp, yp + 1.0 + np.abs(yp)))
    matrix = np.zeros((len(yp), len(where)))
    for k, j in enumerate(where):
        changed = yp.copy()
        changed[j] += 1.0
        matrix[:, k] = residual(changed) - given
    kinematic = (others == given) & matrix.any(axis=1)
    if np.linalg.matrix_rank(matrix[kinematic]) < len(where):
        return yp
    found = yp.copy()
    found[where] -= np.linalg.lstsq(matrix[kinematic], given[kinematic], rcond=None)[0]
    terms = np.abs(matrix) @ np.abs(found[where]) + np.abs(given)
    is_solved = np.abs(residual(found)) <= 1e-8 * terms
    return found if is_solved[kinematic].all() else yp


def _solution(found: dict[str, Any], n: int, n_events: int, n_parameters: int, method: str) -> DaeSolution:
    sol = None
    samples, nodes, ends = (np.frombuffer(found.pop(k)) for k in ("samples", "nodes", "segments"))
    ends = ends.reshape(-1, 2)
    if len(ends):
        sol = DenseOutput(ends, samples.reshape(len(ends), len(nodes), n), nodes)
    crossings = found.pop("events")
    t_events = y_events = None
    if n_events:
        of = [[c for c in crossings if c[0] == k] for k in range(n_events)]
        t_events = [np.array([c[1] for c in event]) for event in of]
        y_events = [np.array([np.frombuffer(c[2]) for c in event]).reshape(-1, n) for event in of]
    t, y, yp = (np.frombuffer(found.pop(name)) for name in ("t", "y", "yp"))
    y, yp = (rows.reshape(-1, n).T for rows in (y, yp))
    dy_dp = np.frombuffer(found.pop("dy_dp"))
    if n_parameters:
        dy_dp = dy_dp.reshape(-1, n_parameters, n).T
    return DaeSolution(
        t=t,
        y=y,
        yp=yp,
        sol=sol,
        t_events=t_events,
        y_events=y_events,
        method=method,
        dy_dp=dy_dp if n_parameters else None,
        **found,
    )
