"""Notes on wrong or missing entries of Jacobians, and on sparse Jacobians."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._arguments import LARGE
from ._solution import Array, DaeSolution, Function
from ._stops import FREQUENT, STOPPED, fails_to_converge
from ._structure import Pattern, Structure

# Fraction of nonzero entries below which `sparsity` is recommended, and number of columns used to estimate this fraction.
SPARSE = 0.1
SAMPLED = 8


def share_of_entries(residual: Function, t: float, y: Array, yp: Array) -> float | None:
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


# Distance, in tolerances, between the two states near the stop at which a Jacobian is compared with difference quotients.
MOVED = 10.0

def wrong_entry(
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
    is_stopped = not solution.success and fails_to_converge(solution.message)
    if jacobian is None or not (is_stopped or is_slow and FREQUENT * solution.ncfn > solution.nsteps):
        return None
    within = np.flatnonzero((solution.t >= min(limits)) & (solution.t <= max(limits)))
    counts: dict[tuple[str, int, int], int] = {}
    examined: Any = np.unique(within[np.linspace(0, len(within) - 1, 9).astype(int)]) if len(within) else []
    states = [(solution.t[i], solution.y[:, i].copy(), solution.yp[:, i].copy()) for i in examined]
    stopped = STOPPED.match(solution.message)
    if is_stopped and stopped and solution.t.size:
        y, yp = solution.y[:, -1].copy(), solution.yp[:, -1].copy()
        # A kink of F does not affect the same entry at both states.
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


def missing_entry(
    solution: DaeSolution, residual: Function, pattern: Pattern, rtol: float, atol: Array
) -> str | None:
    """Return a note on an entry of the Jacobian that is nonzero at the last state but missing in the pattern."""
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
