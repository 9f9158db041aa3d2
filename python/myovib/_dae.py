"""Fully implicit differential-algebraic equations F(t, y, y') = 0."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress as ignoring
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._breaks import values_after
from ._index import index_note, jumping_multipliers, listed
from ._structure import Structure

__all__ = ["DaeSolution", "DenseOutput", "solve_dae"]

Array = NDArray[np.float64]
Function = Callable[[float, Array, Array], Any]
METHODS = ("bdf", "ida", "radau5", "radau9", "radau13")

# Default step limit: more steps than a typical integration needs; they take about a minute.
MAX_STEPS = 200_000

# SciPy's names of these methods.
SCIPY_METHODS = {"Radau": "radau5", "BDF": "bdf"}

# Arguments of other solvers with a different name or form here.
OTHER_NAMES = {
    "fun": "it is `residual` here, F(t, y, y'), not y' = f(t, y)",
    "jac": "it is `jacobian` here, and returns the pair dF/dy, dF/dy' at (t, y, yp)",
    "jac_sparsity": "it is `sparsity` here, the pattern of dF/dy and dF/dy' together",
    "lband": "give the pattern by `sparsity`",
    "uband": "give the pattern by `sparsity`",
    "min_step": "a minimum step cannot be set; limit the number of steps by `max_steps`",
    "vectorized": "the residual is called for one state at a time",
    "reltol": "it is `rtol` here",
    "abstol": "it is `atol` here",
    "mass": "the `residual` is M y' - f(t, y) here",
    "differential_vars": "it is `algebraic` here, with the opposite values",
    "algebraic_idx": "it is `algebraic` here, a bool for each variable",
    "calc_initcond": 'it is `initial` here: "algebraic" for "yp0", "states" for "y0"',
    "eventsfn": "it is `events` here, a function or a list of functions that return a number",
    "user_data": "it is `args` here, a tuple",
    "sensitivities": "sensitivities are not computed here: add the equations of dy/dp to the `residual`, or use "
    "differences of runs with tight tolerances",
}


@dataclass
class DenseOutput:
    """Solution as a continuous function, given by the polynomials of the steps.

    Attributes
    ----------
    t_min, t_max : float
        Interval covered by the steps.
    """

    _ends: Array  # (steps, 2)
    _samples: Array  # (steps, nodes, n)
    _nodes: Array  # common to all steps, in [-1, 1]

    @property
    def t_min(self) -> float:
        return float(self._ends.min())

    @property
    def t_max(self) -> float:
        return float(self._ends.max())

    def __call__(self, t: ArrayLike) -> Array:
        """Evaluate the solution.

        Parameters
        ----------
        t : float or array_like, shape (m,)
            Times within [t_min, t_max], up to rounding.

        Returns
        -------
        ndarray, shape (n,) or (n, m)

        Raises
        ------
        ValueError
            A time is outside of the interval.
        """
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rounding = 4.0 * np.spacing(np.abs(self._ends).max())
        outside = ~((times >= self.t_min - rounding) & (times <= self.t_max + rounding))
        if outside.any():
            raise ValueError(
                f"t = {times[outside][0]}: the solution is known from {self.t_min} to {self.t_max} only"
            )
        sign = 1.0 if self._ends[-1, 1] >= self._ends[0, 0] else -1.0
        step = np.searchsorted(sign * self._ends[:, 1], sign * times)
        step = np.minimum(step, len(self._ends) - 1)
        a, b = self._ends[step].T
        x = (2.0 * times - a - b) / (b - a)
        # Barycentric interpolation: Chebyshev nodes have alternating weights, halved at the ends.
        weights = (-1.0) ** np.arange(len(self._nodes))
        weights[[0, -1]] *= 0.5
        distance = x[:, None] - self._nodes
        at_a_node = distance == 0.0
        shares = weights / np.where(at_a_node, 1.0, distance)
        shares[at_a_node.any(axis=1)] = 0.0
        shares[at_a_node] = 1.0
        values = np.einsum("mk,mkn->nm", shares, self._samples[step]) / shares.sum(axis=1)
        return values[:, 0] if np.ndim(t) == 0 else values


@dataclass(repr=False)
class DaeSolution:
    """Result of `solve_dae`, with the names of `scipy.integrate.solve_ivp`.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Times: the ends of the steps, or `t_eval`.
    y, yp : ndarray, shape (n, m)
        Solution and its derivative at these times.
    sol : DenseOutput or None
        Solution as a function of time, if `dense_output` is set and a step was taken.
    t_events : list of ndarray or None
        Times of each event.
    y_events : list of ndarray or None
        Solutions at these times, one per row.
    nfev, njev, nlu : int
        Evaluations of the residual (including finite differences) and of the
        Jacobian; setups of the linear solver.
    nsteps, nni, netf, ncfn, ngev : int
        Steps, Newton iterations, error test failures, nonlinear solver failures,
        event evaluations.
    status : int
        0: the end of the span was reached; 1: an event ended the integration;
        -1: the integrator failed, or the equations seem to have an index above 3.
    message : str
        Description of the status.
    """

    t: Array
    y: Array
    yp: Array
    sol: DenseOutput | None
    t_events: list[Array] | None
    y_events: list[Array] | None
    nfev: int
    njev: int
    nlu: int
    nsteps: int
    nni: int
    netf: int
    ncfn: int
    ngev: int
    status: int
    message: str
    method: str = field(default="bdf")

    def __repr__(self) -> str:
        return (
            f"DaeSolution(method={self.method!r}, status={self.status}, message={self.message!r}, "
            f"{self.y.shape[0]} variables at {self.t.size} times, nsteps={self.nsteps})"
        )

    def __getitem__(self, name: str) -> Any:
        """Return an attribute: ``s["t"]`` is ``s.t``, as in SciPy's results."""
        if name not in self.keys():
            raise KeyError(name)
        return getattr(self, name)

    def keys(self) -> list[str]:
        """Return the names of all attributes."""
        return [*self.__dataclass_fields__, "success"]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    @property
    def success(self) -> bool:
        """Whether the end of the span or an event was reached."""
        return self.status >= 0


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
    **unknown: Any,
) -> DaeSolution:
    """Integrate F(t, y, y') = 0.

    Parameters
    ----------
    residual : callable
        ``residual(t, y, yp)`` returns F, an array of the length of `y0`. It may
        raise `StepFailure` if F is undefined; the integrator then tries a smaller
        step. Any other exception ends the integration and is raised unchanged.
    t_span : (float, float)
        Start and end; with "bdf" the end may be before the start.
    y0, yp0 : array_like, shape (n,)
        Solution and derivative at the start. They must be consistent unless
        `initial` requests a correction. Radau methods with `index` move values that
        violate constraints by less than the tolerances onto these. Equations that
        contain derivatives are not checked: a wrong `yp0` is the first column of `yp`.
    method : {"bdf", "radau5", "radau9", "radau13"}
        BDF of order 1 to 5, for index 0 and 1 (and index 2 with the algebraic
        components excluded from the error test, see `suppress`), or Radau IIA of
        order 5, 9 or 13, for index 0 to 3. "ida", SUNDIALS' name, means "bdf".
    jacobian : callable, optional
        ``jacobian(t, y, yp)`` returns the pair dF/dy, dF/dy': matrices, dense or
        of `scipy.sparse`. By default finite differences are used. The Jacobian is
        compared with finite differences at the start; a warning names an entry that
        seems wrong.
    sparsity : array_like or sparse matrix, shape (n, n), optional
        Common pattern of dF/dy and dF/dy': nonzero for each entry that may be
        nonzero at any time, including the diagonal if equation i contains y_i or
        y'_i. By default the pattern of a sparse `jacobian` with more than 200 rows at
        the start, otherwise full. Without `jacobian`, the pattern is compared with the
        residual at the start, and a `ValueError` names a missing entry.
    index : sequence of int, optional
        Index of each variable, 0 to 3. Radau's error test needs it for systems of
        index 2 and 3: in mechanics, 1 (or 0) for positions, 2 for velocities, 3 for
        multipliers of the position constraint. "bdf" does not use it: exclude
        components of index 2 by `suppress`. For index 3 use Radau.
    algebraic : array_like of bool, optional
        True if y'_i does not occur in F. By default determined from the Jacobian
        at the start.
    suppress : bool or array_like of bool, optional
        Components excluded from the error test. ``True`` excludes the components
        in `algebraic`, which is then required.
    events : callable or list of callables, optional
        ``event(t, y, yp)`` returns a number, whose zeros are events, or a bool,
        whose changes are events (True counts as positive). If a number stays at
        zero, the event is the start of this interval. The attributes are the same
        as in `solve_ivp`: ``terminal`` (bool, or the number of the occurrence that
        ends the integration) and ``direction`` (its sign). A zero at the start of
        the integration is not reported, and a zero at its end only if rounding does
        not keep the number from reaching it. A change of sign at a break is an event
        at the break.
    rtol, atol : float; float or array_like, shape (n,)
        Tolerances: the local error may be ``rtol |y_i| + atol_i``. `rtol` is a
        scalar.
    t_eval : array_like, optional
        Output times, finite and in the direction of integration; a time may be
        repeated. By default the ends of all steps.
    dense_output : bool
        Whether the result has `sol`.
    first_step, max_step : float, optional
        First and maximum step. The step size is controlled by errors at the times
        at which F is evaluated: an input that acts or oscillates between them is
        missed. Limit the step to a fraction of its duration or period. A warning
        names an equation that is not satisfied within one of the first steps.
    max_order : int, optional
        Maximum order of "bdf"; 5 by default.
    max_steps : int or inf, optional
        Maximum number of steps, up to each break; 200 000 by default.
    breaks : array_like, optional
        Times at which an input jumps or has a kink. The integration stops there
        and starts again. The functions are not called within a few rounding errors of these
        times, so that each step sees one side of the jump. At index 0 and 1, `y` and `yp`
        are kept if F does not jump there by more than the tolerances allow; otherwise
        algebraic variables and derivatives are computed again. A break occurs twice
        in `t` if `t_eval` is not given. Times outside `t_span` are ignored; times that differ by less than
        1e-12 of the largest time are one break.
    initial : {"given", "algebraic", "states"}
        Values to correct at the start so that F = 0: none; the algebraic
        components and the derivatives of the others (index 1); all of y.
    args : sequence, optional
        Additional arguments of `residual`, `jacobian` and `events`, after
        ``t, y, yp``.

    Returns
    -------
    DaeSolution

    Raises
    ------
    ValueError
        Invalid arguments.
    RuntimeError
        The initial values violate an equation without derivatives by more than the
        tolerances, and `initial` does not correct them; no consistent initial
        values are found; the integrator rejects a setting. After the first break
        the result up to the break is returned, with `status` -1.

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
    if not 0 < rtol < 1:
        raise ValueError(f"rtol = {rtol}: must be above 0 and below 1")
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
        raise ValueError(f't_span = ({t0}, {t_end}): only "bdf" goes backward')
    for name, step in (("first_step", first_step), ("max_step", max_step)):
        if step is not None and not step > 0:
            raise ValueError(f"{name} = {step}: must be above 0")
    limit = _count("max_steps", MAX_STEPS if max_steps is None else max_steps)
    marks = _marks("algebraic", algebraic, n)
    if suppress is True and marks is None:
        raise ValueError("suppress = True excludes the algebraic components: specify them in `algebraic`")
    excluded = marks if suppress is True else _marks("suppress", None if suppress is False else suppress, n)
    if excluded is not None and all(excluded):
        raise ValueError("suppress excludes all variables: the error test must have at least one")
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
            f'index has a {max(indices)}, which "bdf" makes no use of: use a Radau method, or, for '
            "index 2, exclude these components from the error test by `suppress`"
        )
    highest = max(indices or [0])
    is_hidden = highest > 1
    if initial == "algebraic" and is_hidden:
        raise ValueError(
            f'initial = "algebraic" is for index 0 and 1, and index has a {highest}: give initial '
            "values that satisfy the constraints and their derivatives"
        )
    if not isinstance(args, Sequence) or isinstance(args, str):
        raise ValueError(f"args = {args!r}: must be a tuple, as in args=({args!r},)")
    residual = _with(residual, args, "residual")
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
        # Any time that follows the unit of time makes the steps independent of it.
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
    if marks is not None and any(marks):
        at_start = Structure.at(residual, first_limits[0], start, rates, rtol * np.abs(start) + tolerances)
        if at_start and (occurring := np.flatnonzero(np.array(marks) & at_start.differential).tolist()):
            raise ValueError(
                f"algebraic: the derivatives of the variables {listed(occurring)} (counted from 0) occur in F, so "
                "these variables are not algebraic: set False for them"
            )
    structure = None
    # The indices of all variables are known, or the variables of index 2 are excluded from the error test.
    is_index_known = excluded is not None if family == "bdf" else indices is not None
    if initial == "algebraic" or not is_index_known or family != "bdf":
        structure = Structure.at(residual, first_limits[0], start, rates, rtol * np.abs(start) + tolerances)
    constraints = None
    if indices is not None and highest == 3 and initial == "given":
        weights = (rtol * np.abs(start) + tolerances, rtol * np.abs(rates) + tolerances)
        positions = np.array(indices) <= 1
        positions &= ~structure.algebraic if structure else True
        constraints = _PositionConstraints.at(residual, first_limits, (start, rates), positions, weights)
    if constraints is not None:
        rates = constraints.yp
        for equation in constraints.changing:
            warnings.warn(
                f"equation {equation} (counted from 0), a constraint on positions, changes at the rate "
                f"{constraints.rates[equation]:.2e}: the velocities are not consistent and will jump in the "
                "first step. `consistent_start` computes consistent ones",
                stacklevel=2,
            )
    note, is_of_index_4 = "", False
    if structure:
        note, is_of_index_4 = index_note(structure, family, indices, excluded)
        notes += [note] if note else []
    if structure and initial == "algebraic" and (free := structure.undetermined()):
        notes.append(
            f"F = 0 does not determine the derivatives of the variables {free} (counted from 0), "
            "because dF/dy' is singular: `yp` may be wrong at the start. Introduce a variable for the "
            "combination whose derivative occurs"
        )
    if matrices is None and pattern is None and (share := _share_of_entries(residual, first_limits[0], start, rates)):
        notes.append(
            f"about {share:.1%} of the entries of the Jacobian are nonzero, and full matrices with {n} differences each "
            "are computed: `sparsity` makes them much cheaper"
        )
    may_have_higher_index = family != "bdf" and not is_index_known
    if may_have_higher_index and structure:
        may_have_higher_index = any(structure.singular) or bool(structure.of_higher_index)
    request["may_have_higher_index"] = may_have_higher_index
    try:
        found, last_limits = _integrate_parts(
            request, ends, (residual, matrices, watched), (start, rates), outputs
        )
    except _Failed as failed:
        is_violated = "not consistent" in str(failed) and constraints is not None and constraints.are_violated
        explained = f"; {START}" if is_violated else ""
        if initial != "given":
            tolerance = rtol * np.abs(start) + tolerances
            explained = _explain(initial, residual, first_limits[0], start, rates, tolerance)
        raise RuntimeError(f"{failed}{explained}") from None
    of_functions = found.pop("warnings")
    solution = _solution(found, n, len(watched.functions), family)
    has_wrong_velocities = constraints is not None and bool(constraints.changing)
    known = _Facts(excluded, is_hidden, has_wrong_velocities, jacobian is not None, note, abs(t_end - t0), outputs is not None)
    wrong = next((text for subject, text in of_functions if subject == "jacobian"), None)
    if pattern is not None and jacobian is None and not solution.success:
        wrong = _missing_entry(solution, _within(residual, last_limits), pattern, rtol, tolerances)
    if wrong or (wrong := _wrong_entry(solution, _within(residual, last_limits), jacobian, last_limits, rtol, tolerances)):
        notes.append(wrong)
        if not solution.success:
            solution.message = f"{solution.message.partition('; suggested remed')[0]}; {wrong}"
    elif advice := _advice(solution, _within(residual, last_limits), rtol, tolerances, known):
        notes.append(advice)
    elif solution.success and solution.t.size and is_index_known and structure and _singular(structure):
        # Constraints may also depend on each other at the start alone.
        end = (solution.t[-1], solution.y[:, -1], solution.yp[:, -1])
        at_end = Structure.at(_within(residual, last_limits), *end, rtol * np.abs(end[1]) + tolerances)
        if singular := _singular(at_end):
            notes.append(singular)
    if is_of_index_4 and solution.success and solution.t.size:
        # The index of the linearized equations may be too high at a single state.
        end = (solution.t[-1], solution.y[:, -1], solution.yp[:, -1])
        at_end = Structure.at(_within(residual, last_limits), *end, rtol * np.abs(end[1]) + tolerances)
        if at_end and index_note(at_end, family, indices, excluded)[1]:
            solution.status, solution.message = -1, f"{solution.message}, but the results may be wrong: {note}"
    # The differences of a higher index look like an input that acts between the stages.
    notes += [] if is_of_index_4 and not solution.success else [text for _, text in of_functions]
    jumping = []
    if is_hidden and family != "bdf" and indices is not None and outputs is None and not has_wrong_velocities:

        def repeated(h: float) -> DaeSolution | None:
            """Return the solution in the first steps, if the first one has the size h."""
            few = {**request, "first_step": h, "max_steps": 6, "dense": False}
            try:
                first, _ = _integrate_parts(few, ends[:2], (residual, matrices, _Events(None, ())), (start, rates), None)
            except Exception:  # F may be undefined there
                return None
            first.pop("warnings")
            return _solution(first, n, 0, family)

        jumping = jumping_multipliers(solution, family, indices, (rtol, tolerances), structure, repeated)
    if jumping:
        notes.append(
            f"the variables {listed(jumping)} (counted from 0) jump in the first step: their y0 is not consistent, "
            f"and the first column of `y` {'and `sol` within the first step are' if highest == 3 else 'is'} wrong"
        )
    for warning in dict.fromkeys(notes):
        warnings.warn(warning, stacklevel=2)
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
        raise ValueError(f"method = {method!r}: allowed: {', '.join(METHODS)}{known}")
    method = "bdf" if method == "ida" else method
    if initial not in ("given", "algebraic", "states"):
        raise ValueError(f"initial = {initial!r}: must be given, algebraic or states")
    if max_order is not None and method != "bdf":
        raise ValueError(f'max_order = {max_order}: only "bdf" has a variable order, not {method!r}')
    max_order = 5 if max_order is None else max_order
    if not 1 <= max_order <= 5:
        raise ValueError(f"max_order = {max_order}: must be 1 to 5")
    return method, max_order


# Remedy for initial values that violate constraints.
START = (
    "positions and velocities must satisfy the constraints and their derivatives: `consistent_start` computes "
    "them for position constraints"
)


class _Failed(Exception):
    """The integrator has found no consistent initial values or rejected a setting."""


def _integrate_parts(
    request: dict[str, Any],
    ends: list[_End],
    functions: tuple[Function, _Jacobian | None, _Events],
    start: tuple[Array, Array],
    outputs: list[float] | None,
) -> tuple[dict[str, Any], tuple[float, float]]:
    """Integrate the parts between breaks one after the other.

    Returns the joined results, and the first and the last time at which the functions may
    be evaluated in the last part.
    """
    residual, matrices, watched = functions
    y, yp = start
    n = len(y)
    is_hidden = max(request["index"] or [0]) > 1
    found: dict[str, Any] = {}
    before = None
    is_late = _is_counted_from_start(request["method"], ends[0].t, request["time_scale"])
    origin = ends[0].t if is_late else 0.0
    for part, (end_from, end_to) in enumerate(zip(ends, ends[1:])):
        is_first, is_last = part == 0, part == len(ends) - 2
        part_limits = (end_from.after, end_to.before)
        initial = request["initial"] if is_first else "given"
        if not (is_first or is_hidden):
            tolerances = (request["rtol"], np.array(request["atol"]))
            times = (end_from.before, end_from.after)
            after = values_after(residual, times, (y, yp), tolerances, request["time_scale"])
            y, yp = after or (y, yp)
            initial = "given" if after else "algebraic"
        due = None if outputs is None else _in_part(outputs, end_from.t, end_to.t, is_first)
        if due is not None and not is_last:
            due.append(end_to.t)
        events = None
        if watched.functions:
            events = _within(watched.values, part_limits, origin)
            events = _in_bytes(events, len(watched.functions), "events")
        try:
            solved = _native.solve(
                {
                    **request,
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
        except RuntimeError as error:
            # The traceback of an exception from a user's function contains the frames of that function.
            is_of_user = error.__traceback__ is not None and error.__traceback__.tb_next is not None
            if is_of_user:
                raise
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
            _cut(solved, n, slice(1, None))
        if solved["status"] == 0 and not is_last:
            y, yp = (np.frombuffer(solved[name])[-n:] for name in ("y", "yp"))
            before = watched.values(part_limits[1], y, yp) if watched.functions else None
            if due is not None:
                _cut(solved, n, slice(-1))
        found = _joined(found, solved) if found else solved
        if found["status"] != 0:
            break
    return found, limits


# Part of the entries of a full matrix below which `sparsity` is recommended, and number of compared columns.
SPARSE = 0.1
SAMPLED = 8


def _share_of_entries(residual: Function, t: float, y: Array, yp: Array) -> float | None:
    """Return the part of nonzero entries of the Jacobian in some columns, if it is small and the matrix large."""
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


class _Facts(NamedTuple):
    """Context of an integration, from which reasons of failures are derived."""

    # Variables excluded from the error test.
    suppress: list[bool] | None
    # Whether an index is above 1.
    is_hidden: bool
    # Whether the velocities at the start violate constraints.
    has_wrong_velocities: bool
    has_jacobian: bool
    # Description of missing, wrong or too high indices; may be empty.
    index_note: str
    span: float
    # Whether `t_eval` replaces the steps in the results.
    has_outputs: bool


# Part of the span, in 100 steps, below which steps are too short from the start on.
SLOW = 1e-3


# Part of failed error tests from which BDF warns. It is 0.14 at most in runs of stiff and oscillating standard problems,
# and 0.2 to 0.5 of the steps of a transistor amplifier with coupling capacitors.
FAILED = 1.0 / 6.0


def _is_slow_from_the_start(solution: DaeSolution, span: float) -> bool:
    return len(solution.t) > 1000 and abs(solution.t[100] - solution.t[0]) < SLOW * span


def _advice(solution: DaeSolution, residual: Function, rtol: float, atol: Array, known: _Facts) -> str | None:
    """Return advice if the integrator gave up, failed many error tests or lacks digits, for a reason that has a remedy.

    The message of a solution that ends early then contains it instead of the library's remedies, unless it is a guess.
    """
    suppress, is_hidden, has_wrong_velocities, has_jacobian, note, span, has_outputs = known
    is_bdf = solution.method == "bdf"
    many = is_bdf and solution.nsteps > 1000 and solution.netf > FAILED * solution.nsteps
    if not solution.t.size:
        return None
    # An integration that counts times from its start does not fail because of their rounding.
    has_rounded_times = solution.success or not _is_counted_from_start(solution.method, float(solution.t[0]), span)
    is_late = has_rounded_times and _is_late(solution, rtol, atol)
    if not (many or is_late or solution.status < 0):
        return None
    y, yp = solution.y[:, -1], solution.yp[:, -1]
    structure = Structure.at(residual, solution.t[-1], y, yp, rtol * np.abs(y) + atol)
    singular = _singular(structure)
    hidden = structure.of_higher_index if structure and is_bdf else []
    tested = [j for j in hidden if suppress is None or not suppress[j]]
    is_guess = False
    if note and not solution.success:
        advice = note
    elif singular and not solution.success:
        advice = singular
    elif has_wrong_velocities and not solution.success and "after 0 steps" in solution.message:
        advice = START
    elif structure and tested:
        advice = index_note(structure, "bdf", None, suppress)[0]
    elif hidden and not solution.success:
        described = f"the variables {listed(hidden)} (counted from 0) have an index above 1"
        advice = f"{described}: use a Radau method with `index`"
    elif is_hidden and solution.nsteps and "after 0 steps" in solution.message:
        advice = (
            "a constraint or its derivative jumps at the break: end there, and start again with consistent values"
        )
    elif not solution.success and (jumping := _jumping(residual, solution, rtol, atol)):
        equations, variable = jumping
        advice = f"the equations {equations} (counted from 0) jump "
        if variable is None:
            advice += "at this time: give the times at which inputs jump in `breaks`"
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
    elif is_hidden and not (solution.success or has_outputs) and _is_slow_from_the_start(solution, span):
        exact = "" if has_jacobian else "the exact `jacobian`, tighter tolerances or "
        advice = (
            f"steps are very short from the start on: give {exact}a `first_step` of about 1/1000 of the time within which "
            "the solution changes"
        )
    elif (
        not solution.success
        and _fails_to_converge(solution.message)
        and (kinked := _kinked(residual, solution, rtol, atol))
    ):
        other = "call without `jacobian`" if has_jacobian else "give the exact `jacobian`"
        advice = (
            f"the equations {kinked} (counted from 0) have a kink near this time, as `max` and `abs` do: replace it by a "
            f"smooth function over {SMOOTH}, or {other}"
        )
    elif not (solution.success or is_hidden) and (steep := _growing(solution)):
        advice = (
            f"the derivatives of the variables {steep} (counted from 0) grow without bound near this time: "
            "the solution may have a pole, a square root or the end of the domain of F there"
        )
    elif is_late:
        advice = (
            f"t_span: times near {solution.t[-1]:.3g} are rounded to {np.spacing(abs(solution.t[-1])):.1e}, within which "
            "the solution changes by more than the tolerances: measure time from a closer origin"
        )
    elif many:
        # For example, a variable amplifies the errors of others. BDF's estimate is small while steps are
        # constant, and then each longer step fails and the order remains 1.
        excluded = np.array(suppress or np.zeros(len(y), bool))
        algebraic = np.flatnonzero(structure.algebraic & ~excluded).tolist() if structure else []
        other = f"excluding the algebraic variables {algebraic} (counted from 0) by `suppress` or " if algebraic else ""
        advice = (
            f"BDF failed {solution.netf} error tests in {solution.nsteps} steps: {other}a Radau method may "
            "need far fewer steps"
        )
        if structure and structure.undetermined():
            advice += (
                ", and so may a larger `atol` or new variables for the combinations of derivatives in F, as of voltages "
                "at coupling capacitors"
            )
    elif "after 0 steps" in solution.message and "error_test_failures" in solution.message and (rtol * np.abs(y) < atol).any():
        is_guess = True
        advice = (
            f"the variables {np.flatnonzero(rtol * np.abs(y) < atol).tolist()} (counted from 0) start at or near 0: "
            "if they grow far beyond `atol` in the first step, raise their `atol` or give their `yp0`"
        )
    elif not (solution.success or has_jacobian) and (
        _fails_to_converge(solution.message) or FREQUENT * solution.ncfn > solution.nsteps > 0
    ):
        is_guess = True
        other = " or tighter tolerances" if rtol >= LOOSE else ""
        other = " or a `first_step`" if "after 0 steps" in solution.message else other
        advice = f"difference quotients may be inaccurate: give the exact `jacobian`{other}"
        advice += f"; replace a kink of F, as of `max`, by a smooth function over {SMOOTH}"
    elif not (solution.success or is_hidden) and _fails_to_converge(solution.message):
        # With `t_eval`, the last state may be far from the kink.
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


def _wrong_entry(
    solution: DaeSolution,
    residual: Function,
    jacobian: Function | None,
    limits: tuple[float, float],
    rtol: float,
    atol: Array,
) -> str | None:
    """Return a note on an entry of the Jacobian that differs from difference quotients, if Newton's method fails often."""
    is_slow = not solution.success or solution.nsteps > 10
    if jacobian is None or not is_slow or not FREQUENT * solution.ncfn > solution.nsteps:
        return None
    within = np.flatnonzero((solution.t >= min(limits)) & (solution.t <= max(limits)))
    counts: dict[tuple[str, int, int], int] = {}
    examined: Any = np.unique(within[np.linspace(0, len(within) - 1, 9).astype(int)]) if len(within) else []
    for i in examined:
        t, y, yp = solution.t[i], solution.y[:, i].copy(), solution.yp[:, i].copy()
        # Functions may bend within a tolerance.
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
    # A difference at a single state may come from a kink.
    if not counts or max(counts.values()) < min(2, len(examined)):
        return None
    matrix, row, column = max(counts, key=lambda entry: counts[entry])
    return (
        f"Newton's iteration failed {solution.ncfn} times in {solution.nsteps} steps, and in row {row}, column {column} "
        f"(counted from 0) the `jacobian` differs from {matrix} by difference quotients: the results may be wrong. "
        "Correct it, or call without `jacobian`"
    )


def _missing_entry(
    solution: DaeSolution, residual: Function, pattern: tuple[NDArray[np.int64], NDArray[np.int64]], rtol: float, atol: Array
) -> str | None:
    """Return a note on an entry of the Jacobian at the last state that the pattern lacks."""
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
        return f"equation {row} changes with variable {column} (counted from 0): add this entry to `sparsity`"
    return None


def _is_late(solution: DaeSolution, rtol: float, atol: Array) -> bool:
    """Return whether a variable usually changes by more than its tolerance within the rounding of t."""
    changes = np.spacing(np.abs(solution.t)) * np.abs(solution.yp)
    tolerances = rtol * np.abs(solution.y) + atol[:, None]
    return bool((np.median(changes - tolerances, axis=1) > 0.0).any())


# Number of steps per failure of Newton's iteration below which an exact Jacobian is compared with differences.
FREQUENT = 5

# Relative tolerance from which on tighter tolerances improve difference quotients.
LOOSE = 1e-5

# Growth of a derivative that indicates a singularity of the solution.
GROWTH = 1e4


def _growing(solution: DaeSolution) -> list[int]:
    """Return the variables whose derivatives at the end are much larger than before."""
    sizes = np.abs(solution.yp)
    if sizes.shape[1] < 10:
        return []
    before = np.median(sizes[:, : -len(solution.t) // 2], axis=1)
    # Derivatives of variables at rest have no size.
    return np.flatnonzero((before > 0) & (sizes[:, -1] > GROWTH * before)).tolist()


# Displacements, in tolerances, within which kinks of F are searched, and the relative change of slope of a kink.
DISTANCES = (0.01, 0.1, 1.0, 10.0, 100.0)
BEND = 0.1


def _fails_to_converge(message: str) -> bool:
    """Return whether Newton's method has failed, or found derivatives far from those before."""
    return "converge" in message or "abruptly" in message


def _kinked(residual: Function, solution: DaeSolution, rtol: float, atol: Array) -> list[int]:
    """Return the equations with a kink near the last state."""
    t, y, yp = solution.t[-1], solution.y[:, -1], solution.yp[:, -1]
    if len(y) > LARGE:
        return []
    tolerances = rtol * np.abs(y) + atol
    found = np.zeros(len(y), dtype=bool)
    try:
        base = np.array(residual(t, y, yp), dtype=float)
        for j in range(len(y)):
            was_bent = np.zeros(len(y), dtype=bool)
            for distance in DISTANCES:
                unit = distance * tolerances[j] * (np.arange(len(y)) == j)
                moved = [np.array(residual(t, y + c * unit, yp), dtype=float) for c in (1, -1, 0.25, -0.25)]
                changes = np.array(moved) - base
                bend, near = np.abs(changes[0] + changes[1]), np.abs(changes[2] + changes[3])
                # At a quarter of the distance, the bend of a smooth function is 1/16 and the bend of a kink 1/4 as large.
                is_bent = bend > BEND * (np.abs(changes[0]) + np.abs(changes[1]))
                is_bent &= (near > 0.2 * bend) & (near < 0.3 * bend)
                # Bends by rounding differ between distances.
                found |= is_bent & was_bent
                was_bent = is_bent
    except Exception:  # outside of the domain of F
        return []
    return np.flatnonzero(found).tolist()


# Width, in tolerances, of smooth functions instead of jumps: all methods integrate them.
WIDTH = 100.0

# Recommended width of smooth functions instead of kinks. Over 1 tolerance, 9 of 36 runs of a rectifier stopped; over 10 and
# 100 tolerances, one.
SMOOTH = "10 to 100 tolerances"

# Distances of jumps from the last time, in roundings of it, bisections that locate a jump, and its smallest size,
# relative to changes of F within the tolerances.
INSTANTS = (1e3, 1e4, 1e5, 1e6)
BISECTIONS = 20
VISIBLE = 1e-3


def _jumping(residual: Function, solution: DaeSolution, rtol: float, atol: Array) -> tuple[list[int], int | None] | None:
    """Return the equations that jump near the last state, and the variable with which they jump; None for the time."""
    t, y, yp = solution.t[-1], solution.y[:, -1], solution.yp[:, -1]
    n = len(y)
    if n > LARGE:
        return None
    state = np.r_[y, yp]

    def along(j: int) -> Callable[[float], Array]:
        unit = np.arange(2 * n) == j
        unit = (rtol * np.abs(state) + np.resize(atol, 2 * n)) * unit
        return lambda x: np.array(residual(t, *np.split(state + x * unit, 2)), dtype=float)

    rounding = np.spacing(np.abs(solution.t).max())
    searches: list[tuple[int | None, Callable[[float], Array]]] = [(j % n, along(j)) for j in range(2 * n)]
    searches.append((None, lambda x: np.array(residual(t + x * rounding, y, yp), dtype=float)))
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
                # Rounding changes F once within a short distance, but more often within a longer one.
                if (was_found & is_found).any():
                    return np.flatnonzero(was_found & is_found).tolist(), variable
                was_found = is_found
    return None


def _jumps(function: Callable[[float], Array], distance: float) -> Array:
    """Return the jump of each component within this distance of 0, or 0 if the rest of the interval changes it as much."""
    a, b, left, right = -distance, distance, function(-distance), function(distance)
    total, rest = np.abs(right - left), np.zeros(len(left))
    for _ in range(BISECTIONS):
        middle = 0.5 * (a + b)
        value = function(middle)
        first, second = np.abs(value - left), np.abs(right - value)
        # Take the half in which almost the whole change of a component occurs.
        if ((first > 0.5 * total) & (rest + second < 0.5 * first)).any():
            b, right, rest = middle, value, rest + second
        elif ((second > 0.5 * total) & (rest + first < 0.5 * second)).any():
            a, left, rest = middle, value, rest + first
        else:
            return np.zeros(len(left))
    change = np.abs(right - left)
    return np.where((change > 0.5 * total) & (rest < 0.5 * change), change, 0.0)


def _singular(structure: Structure | None) -> str:
    """Describe equations that do not determine all variables, or return an empty string."""
    variables, equations = structure.singular if structure and not structure.is_huge() else ([], [])
    if not variables:
        return ""
    return (
        f"the equations do not determine the variables {listed(variables)}: the equations {listed(equations)} "
        "(counted from 0) depend on each other or contain no variable. Replace a dependent equation by the missing equation; "
        "fix one value of a pressure of which only differences occur"
    )


def _explain(initial: str, residual: Function, t: float, y: Array, yp: Array, tolerance: Array) -> str:
    """Explain why no consistent initial values are found; may be empty."""
    structure = Structure.at(residual, t, y, yp, tolerance)
    if structure is None:
        return ""
    singular = _singular(structure)
    if singular:
        return f"; {singular}"
    equations = structure.contradictory(initial)
    if equations:
        return (
            f"; the corrected values do not occur in a combination of the equations {equations} (counted from "
            '0), so that y0 must satisfy it; for index 2 and 3 use initial="given" and consistent values'
        )
    left = np.asarray(residual(t, y, yp), dtype=float)
    violated = np.flatnonzero(np.abs(left) > structure.effect(tolerance)).tolist()
    if not violated:
        return ""
    return (
        f"; y0 and yp0 violate the equations {violated} (counted from 0): check that they have a solution, and "
        "start nearer to it"
    )


def _expect_finite(residual: Any, t: float, y: Array, yp: Array) -> None:
    """Reject initial values at which F is not finite, because they cannot be corrected."""
    try:
        values = np.frombuffer(residual(t, bytearray(y), bytearray(yp)))
    except _native.StepFailure:
        return
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise RuntimeError(
            f"the residual has {values[wrong[0]]} in equation {wrong[0]} (counted from 0) at the "
            f"start, t = {t}: these values cannot be corrected"
        )


# Rate of a position constraint, in units of its change by velocities within the tolerances, above
# which the velocities are reported as inconsistent.
FAR = 10.0


class _PositionConstraints(NamedTuple):
    """Constraints on positions at the start."""

    # Whether the positions violate one.
    are_violated: bool
    # Equations whose derivative along the velocities is not zero, and the derivatives of all equations.
    changing: list[int]
    rates: Array
    # yp0 with the rates of positions that follow from the velocities.
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
        """Return the constraints on these variables, or None if F cannot be evaluated near the start.

        The limits are the first and the last time before the next break. The tolerances are those of y and of yp.
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
        step = 1e-4 * (min(size / largest, t_end - t0) if size > 0.0 and largest > 0.0 else t_end - t0)

        def derivative(rates: Array) -> Array:
            # Forward differences, because F may be undefined before the start.
            at = [evaluate(t0 + k * step, y + k * step * rates, yp) for k in range(4)]
            return (-11.0 * at[0] + 18.0 * at[1] - 9.0 * at[2] + 2.0 * at[3]) / (6.0 * step)

        try:
            given = evaluate(t0, y, yp)
            # Different displacements do not cancel in an equation.
            golden = (np.sqrt(5.0) - 1.0) / 2.0
            sizes = 1.0 + golden * np.arange(2 * len(y)).reshape(2, -1) % 1.0
            others = np.where(positions, y, y + sizes[0] * (1.0 + np.abs(y)))
            moved = evaluate(t0, others, yp + sizes[1] * (1.0 + np.abs(yp)))
            rate = derivative(rates)
            alternating = (-1.0) ** np.arange(len(y))
            signs = [positions * sign for sign in (1.0, alternating)]
            within = [np.abs(evaluate(t0, y + sign * tolerances[0], yp) - given) for sign in signs]
            changes = [np.abs(derivative(rates + sign * tolerances[1]) - rate) for sign in signs]
            terms = np.abs(derivative(rates * alternating))
        except Exception:  # the integration reports it
            return None
        # Differences are accurate to about 1e-10 of the terms.
        explained = np.max(changes, axis=0) + 1e-8 * terms
        is_constraint = (given == moved) & (explained > 0.0)
        changing = is_constraint & (np.abs(rate) > FAR * explained) & (largest > 0.0)
        is_violated = is_constraint & (np.abs(given) > np.max(within, axis=0))
        return cls(bool(is_violated.any()), np.flatnonzero(changing).tolist(), rate, yp)


def _with_kinematic_rates(residual: Callable[[Array], Array], yp: Array, positions: NDArray[np.bool_]) -> Array:
    """Return yp with the rates of positions that follow from the linear equations without other derivatives.

    Returns yp itself if these do not determine all rates, or for more than LARGE positions.
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


class _End(NamedTuple):
    """Break between two parts of an integration, or an end of the span."""

    t: float
    # Last time before the break and first time after it, in the direction of integration.
    before: float
    after: float


# Distance of breaks, relative to the largest time, below which they only differ by rounding.
CLOSE = 1e-12

# Rounding of a break, relative to the larger of its time and the span, for example of k P/2 and of t/P: the functions are
# not evaluated within this distance.
ROUNDING = 4 * np.finfo(float).eps


def _ends_of_parts(breaks: ArrayLike, t0: float, t_end: float) -> list[_End]:
    """Return the ends of the parts between breaks, in the direction of integration.

    Breaks that only differ by rounding are treated as one break: the functions are evaluated
    before the first and after the last of them. A break close to an end of the span is moved
    to this end.
    """
    times = np.unique(np.asarray(breaks, dtype=float))
    if not np.isfinite(times).all():
        raise ValueError("breaks has non-finite entries")
    times = times[(times >= min(t0, t_end)) & (times <= max(t0, t_end))]
    if t_end < t0:
        times = times[::-1]
    span = abs(t_end - t0)
    # The second limit is for spans shorter than CLOSE times a late start: no break is ignored there.
    close = min(CLOSE * max(abs(t0), abs(t_end), span), 1e-6 * span)
    groups = np.split(times, np.flatnonzero(np.abs(np.diff(times)) > close) + 1)
    first, last = _End(t0, t0, t0), _End(t_end, t_end, t_end)
    inner = []
    for group in groups if times.size else []:
        rounding = min(ROUNDING * max(abs(group[0]), span), 0.25 * close) * np.sign(t_end - t0)
        before = float(np.nextafter(group[0] - rounding, t0))
        after = float(np.nextafter(group[-1] + rounding, t_end))
        if abs(group[0] - t0) <= close:
            first = _End(t0, t0, after)
        elif abs(group[-1] - t_end) <= close:
            last = _End(t_end, before, t_end)
        else:
            inner.append(_End(float(group[0]), before, after))
    return [first, *inner, last]


def _in_part(outputs: list[float], t_from: float, t_to: float, is_first: bool) -> list[float]:
    """Return the output times after `t_from` up to `t_to`; in the first part, `t_from` is included."""
    sign = 1.0 if t_from < t_to else -1.0
    return [
        t
        for t in outputs
        if sign * (t - t_from) > 0 and sign * (t - t_to) <= 0 or is_first and t == t_from
    ]


def _within(function: Any, limits: tuple[float, float], origin: float = 0.0) -> Any:
    """Return the function of times counted from the origin, with times clamped to the limits."""
    low, high = min(limits), max(limits)
    return lambda t, y, yp: function(min(max(origin + t, low), high), y, yp)


# Ratio of the start to the span above which BDF counts times from the start, because it rounds each time but not its
# steps.
LATE = 1e4


def _is_counted_from_start(family: str, t0: float, span: float) -> bool:
    return family == "bdf" and abs(t0) > LATE * span


def _delay(found: dict[str, Any], origin: float) -> None:
    """Add the origin to all times, and remove steps below the rounding of these times."""
    found["t"] = (origin + np.frombuffer(found["t"])).tobytes()
    ends = (origin + np.frombuffer(found["segments"])).reshape(-1, 2)
    if len(ends):
        is_longer = ends[:, 0] != ends[:, 1]
        samples = np.frombuffer(found["samples"]).reshape(len(ends), -1)
        found["segments"], found["samples"] = ends[is_longer].tobytes(), samples[is_longer].tobytes()
    found["events"] = [(k, origin + t, y) for k, t, y in found["events"]]
    if found["status"] != 0:
        found["message"] = _counted_from(origin, found["message"])


def _counted_from(origin: float, message: str) -> str:
    """Return the message with a note on its times."""
    return f"with times counted from t = {origin}: {message}"


def _cut(found: dict[str, Any], n: int, rows: slice) -> None:
    """Keep these rows of the results."""
    for name, width in (("t", 1), ("y", n), ("yp", n)):
        found[name] = np.frombuffer(found[name]).reshape(-1, width)[rows].tobytes()


def _joined(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Join the results of two successive parts of an integration."""
    last = ("nodes", "status", "message")
    return {name: second[name] if name in last else first[name] + second[name] for name in first}


def _with(function: Callable[..., Any], args: Sequence[Any], name: str) -> Function:
    """Return a function of t, y, yp that passes copies, which `function` may change, and the additional arguments."""

    def call(t: float, y: Array, yp: Array) -> Any:
        try:
            return function(t, y.copy(), yp.copy(), *args)
        except TypeError as error:
            is_of_call = error.__traceback__ is not None and error.__traceback__.tb_next is None
            if not is_of_call:
                raise
            raise TypeError(f"{error}; called as {name}(t, y, yp{', *args' if args else ''})") from None

    return call


def _in_bytes(function: Function, n: int, name: str = "residual") -> Any:
    """Return the function in the form for the native module, which passes arrays as bytes."""

    def call(t: float, y: bytearray, yp: bytearray) -> bytes:
        answer = function(t, np.frombuffer(y), np.frombuffer(yp))
        values = _real(name, answer)
        if values.shape != (n,):
            if answer is None:
                found = "nothing"
            elif values.ndim == 1:
                found = f"{values.size} values"
            else:
                found = f"an array of the shape {values.shape}"
            raise ValueError(f"{name} returned {found}: must be {n} values")
        return values.tobytes()

    return call


def _solution(found: dict[str, Any], n: int, n_events: int, method: str) -> DaeSolution:
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
    return DaeSolution(
        t=t, y=y, yp=yp, sol=sol, t_events=t_events, y_events=y_events, method=method, **found
    )


def _real(name: str, values: Any) -> Array:
    """Return real numbers; NumPy would drop imaginary parts with a warning only, and masks silently."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name} has masked entries: must be real numbers")
    try:
        numbers = np.asarray(values)
        if not np.iscomplexobj(numbers):
            return np.asarray(numbers, dtype=float)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: must be real numbers: {error}") from error
    raise TypeError(f"{name} has complex values: must be real numbers")


def _vector(name: str, values: ArrayLike, n: int | None = None) -> Array:
    vector = _real(name, values)
    if vector.ndim != 1 or not vector.size or (n is not None and len(vector) != n):
        wanted = "a vector" if n is None else f"a vector of {n} entries"
        raise ValueError(f"{name} has the shape {vector.shape}: must be {wanted}")
    if not np.isfinite(vector).all():
        raise ValueError(f"{name} has non-finite entries")
    return vector


def _marks(name: str, marks: Any, n: int) -> list[bool] | None:
    if marks is None:
        return None
    vector = np.asarray(marks, dtype=bool)
    if vector.shape != (n,):
        raise ValueError(f"{name} has the shape {vector.shape}: must have {n} entries")
    return vector.tolist()


def _output_times(t_eval: ArrayLike | None, t0: float, t_end: float) -> list[float] | None:
    if t_eval is None:
        return None
    times = _real("t_eval", t_eval)
    sign = np.sign(t_end - t0)
    if not np.isfinite(times).all():
        raise ValueError("t_eval has non-finite entries")
    if times.ndim != 1:
        raise ValueError(f"t_eval has the shape {times.shape}: must be a sequence of times")
    if (np.diff(times) * sign < 0).any():
        raise ValueError("t_eval must be sorted in the direction of integration")
    if times.size and (sign * (times[0] - t0) < 0 or sign * (times[-1] - t_end) > 0):
        raise ValueError("t_eval must lie in t_span")
    return times.tolist()


def _count(name: str, value: Any) -> int | None:
    """Return a positive integer, or None for infinity."""
    if value == np.inf:
        return None
    if not (np.ndim(value) == 0 and value >= 1 and value == int(value)):
        raise ValueError(f"{name} = {value}: must be a whole number of at least 1, or inf")
    return int(value)


def _pattern(sparsity: Any, n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the column offsets and row indices of a sparsity pattern."""
    if hasattr(sparsity, "tocoo"):
        coordinates = sparsity.tocoo()
        shape, rows, columns = coordinates.shape, coordinates.row, coordinates.col
    else:
        dense = np.asarray(sparsity)
        shape, (rows, columns) = dense.shape, np.nonzero(np.atleast_2d(dense))[:2]
    if shape != (n, n):
        raise ValueError(f"sparsity has the shape {shape}: must be ({n}, {n})")
    entries = np.unique(columns.astype(np.int64) * n + rows)
    offsets = np.searchsorted(entries, np.arange(n + 1) * n)
    return offsets, entries % n


# Number of rows above which the pattern of sparse matrices is used; with fewer rows full matrices cost little.
LARGE = 200


def _pattern_of_jacobian(
    jacobian: Function, t: float, y: Array, yp: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Return the common pattern of sparse matrices at the start and at a state nearby; None if they are dense."""
    parts = list(jacobian(t, y, yp))
    if not all(hasattr(part, "tocoo") for part in parts):
        return None
    # Entries that vanish at the start, for example at rest.
    steps = 1.0 + 0.618 * np.arange(len(y)) % 1.0
    try:
        nearby = jacobian(t, y + steps * (1.0 + np.abs(y)), yp + steps * (1.0 + np.abs(yp)))
        parts += [part for part in nearby if hasattr(part, "tocoo")]
    except Exception:  # outside of the domain of F
        pass
    # Stored zeros belong to the pattern.
    coordinates = [part.tocoo() for part in parts]
    rows = np.concatenate([part.row for part in coordinates])
    columns = np.concatenate([part.col for part in coordinates])
    n = len(y)
    if any(part.shape != (n, n) for part in coordinates):
        return None
    entries = np.unique(columns.astype(np.int64) * n + rows)
    return np.searchsorted(entries, np.arange(n + 1) * n), entries % n


class _Jacobian:
    """The user's Jacobian function, which returns values in the order of the pattern."""

    def __init__(self, function: Function, pattern: Any, n: int) -> None:
        self.function, self.n = function, n
        self.places: tuple[Any, Any] | None = None
        if pattern is not None:
            offsets, rows = pattern
            self.places = (rows, np.repeat(np.arange(n), np.diff(offsets)))

    def __call__(self, t: float, y: bytearray, yp: bytearray) -> tuple[bytes, bytes]:
        pair = self.function(t, np.frombuffer(y), np.frombuffer(yp))
        if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 or any(np.ndim(part) != 2 for part in pair):
            raise ValueError("jacobian: must return the pair dF/dy, dF/dy'")
        df_dy, df_dyp = pair
        return self._values(df_dy).tobytes(), self._values(df_dyp).tobytes()

    def _values(self, matrix: Any) -> Array:
        sparse = hasattr(matrix, "tocsr")
        if np.iscomplexobj(matrix):
            raise TypeError("jacobian has complex values: must be real numbers")
        matrix = matrix.tocsr() if sparse else np.asarray(matrix, dtype=float)
        if matrix.shape != (self.n, self.n):
            raise ValueError(f"jacobian: shape {matrix.shape}, must be ({self.n}, {self.n})")
        if self.places is None:
            return (matrix.toarray() if sparse else matrix).ravel(order="F")
        values = np.asarray(matrix[self.places], dtype=float).ravel()
        # Later matrices may have additional nonzero entries.
        whole = matrix.count_nonzero() if sparse else np.count_nonzero(matrix)
        if whole > np.count_nonzero(values):
            raise ValueError(
                f"jacobian: {self._outside(matrix, sparse)} is not in `sparsity`: give `sparsity` with "
                "all entries that may become nonzero (by default, it is the pattern of sparse matrices at the start)"
            )
        return values

    def _outside(self, matrix: Any, sparse: bool) -> str:
        """Describe the first entry outside the pattern."""
        assert self.places is not None
        rows, columns = (matrix.tocoo() if sparse else np.asarray(matrix)).nonzero()
        within = np.isin(columns * self.n + rows, self.places[1] * self.n + self.places[0])
        first = np.argmin(within)
        return f"an entry in row {rows[first]}, column {columns[first]} (counted from 0)"


class _Events:
    """All events, combined into one function, and their attributes."""

    def __init__(
        self, events: Function | Sequence[Function] | None, args: Sequence[Any]
    ) -> None:
        if events is None:
            events = []
        if not callable(events) and not (np.iterable(events) and all(map(callable, events))):
            raise TypeError(f"events = {events!r}: must be a function or a sequence of functions")
        given = [events] if callable(events) else list(events)
        self.functions = [_with(f, args, "event") for f in given]
        self.directions = [int(np.sign(getattr(f, "direction", 0))) for f in given]
        self.terminal = [int(getattr(f, "terminal", 0) or 0) for f in given]

    def terminal_after(self, crossings: list[Any]) -> list[int]:
        """Return for each event how many more occurrences end the integration."""
        past = [sum(c[0] == k for c in crossings) for k in range(len(self.functions))]
        return [count and count - done for count, done in zip(self.terminal, past)]

    def values(self, t: float, y: Array, yp: Array) -> list[float]:
        values = [_number(k, function(t, y, yp)) for k, function in enumerate(self.functions)]
        if np.isnan(values).any():
            raise ValueError(f"events: event {np.argmax(np.isnan(values))} (counted from 0) is nan at t = {t}")
        return values


def _number(k: int, value: Any) -> float:
    """Return the value of event k: 1 or -1 for a bool."""
    if isinstance(value, (bool, np.bool_)):
        return 1.0 if value else -1.0
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise type(error)(f"events: event {k} (counted from 0) returned {value!r}: must be a number") from error
