"""Kinks, jumps, poles and effects of rounded times near the end of an integration, found by evaluations of F."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress as ignoring

import numpy as np

from ._arguments import LARGE
from ._solution import Array, DaeSolution, Function

def is_late(solution: DaeSolution, rtol: float, atol: Array) -> bool:
    """Return whether a variable usually changes by more than its tolerance within the rounding error of t."""
    changes = np.spacing(np.abs(solution.t)) * np.abs(solution.yp)
    tolerances = rtol * np.abs(solution.y) + atol[:, None]
    return bool((np.median(changes - tolerances, axis=1) > 0.0).any())


# Growth factor of a derivative that indicates a singularity of the solution.
GROWTH = 1e4


def growing(solution: DaeSolution, indices: list[int] | None) -> list[int]:
    """Return the variables of index 0 and 1 whose derivatives are much larger at the end than before."""
    sizes = np.abs(solution.yp)
    if indices is not None:
        sizes[np.array(indices) > 1] = 0.0
    if sizes.shape[1] < 10:
        return []
    # Most steps may be close to a pole, so only the first half of the time is used. If it contains few steps, the first
    # five states are used.
    is_before = np.abs(solution.t - solution.t[0]) <= 0.5 * abs(solution.t[-1] - solution.t[0])
    is_before[:5] = True
    before = np.median(sizes[:, is_before], axis=1)
    # The derivative of a variable at rest is zero and cannot be compared.
    return np.flatnonzero((before > 0) & (sizes[:, -1] > GROWTH * before)).tolist()


# Relative change of derivatives, and relative second difference of F above which F is considered nonlinear in y'. The
# relative second difference of a square is 0.05.
CHANGED, CURVED = 0.1, 1e-3


def is_nonlinear_in_rates(residual: Function, solution: DaeSolution) -> bool:
    """Return whether F is nonlinear in y' at the last state."""
    t, y, yp = float(solution.t[-1]), solution.y[:, -1], solution.yp[:, -1]
    try:
        low, middle, high = (np.array(residual(t, y, (1.0 + c * CHANGED) * yp), dtype=float) for c in (-1, 0, 1))
    except Exception:  # outside of the domain of F
        return False
    return bool((np.abs(high - 2.0 * middle + low) > CURVED * np.abs(high - low)).any())


# Distances, in tolerances, within which to search for kinks of F, and smallest relative change of slope at a kink.
DISTANCES = (0.01, 0.1, 1.0, 10.0, 100.0)
BEND = 0.1
# Further distances for variables that are small at the last state, and the limit of these distances, relative to the largest
# value of the variable. A kink is found if it is within 1/16 of two successive distances.
FURTHER, NEARBY = (1e3, 1e4, 1e5), 0.1


def kinked(residual: Function, solution: DaeSolution | None, rtol: float, atol: Array) -> list[int]:
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
                # At a quarter of the distance, the bend of a smooth function is 1/16 as large, and the bend of a kink
                # is 1/4 as large.
                is_bent = bend > BEND * (np.abs(changes[0]) + np.abs(changes[1]))
                is_bent &= (near > 0.2 * bend) & (near < 0.3 * bend)
                # Bends caused by rounding errors differ between distances.
                found |= is_bent & was_bent
                was_bent = is_bent
    except Exception:  # outside of the domain of F
        return []
    return np.flatnonzero(found).tolist()


# Distances from the last time, in units of its rounding error, within which to search for jumps.
INSTANTS = (1e3, 1e4, 1e5, 1e6)
# Number of bisections that locate a jump.
BISECTIONS = 20
# Smallest size of a jump, relative to the changes of F that the tolerances cause.
VISIBLE = 1e-3


def jumping(
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
                # Within a short distance, rounding errors may change F only once, as a jump does. Within the next
                # distance, they change F several times.
                if (was_found & is_found).any():
                    return np.flatnonzero(was_found & is_found).tolist(), variable
                was_found = is_found
    return None


def _jumps(function: Callable[[float], Array], distance: float) -> Array:
    """Return the jump of each component within this distance of 0, or 0 if the component changes as much elsewhere."""
    # The interval is not symmetric, so bisection never evaluates the function at 0, where functions such as sign have
    # a separate value.
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
