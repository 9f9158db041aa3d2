"""Values of y and y' after a break, at which inputs may jump."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._structure import RANK, Structure, _null

Array = NDArray[np.float64]
State = tuple[Array, Array]

# Maximum number of steps of Newton's method, and maximum number of halvings of a step.
ITERATIONS = 100
HALVINGS = 40
# Fraction of the predicted reduction that a step must achieve.
DESCENT = 0.1
# Largest final correction of y and y', in tolerances; IDACalcIC uses the same value.
CONVERGED = 0.0033
# Relative increment of difference quotients.
ROOT = float(np.sqrt(np.finfo(float).eps))
# Largest relative rounding error of values computed from differences in time, and largest relative residual of the
# equations for these values.
ROUNDED = 1e-7
UNSOLVED = 1e-6
# Smallest reported error of an initial value, in tolerances. Global errors are up to 100 tolerances.
FAR = 100.0
# Number of trials with random changes of a state.
TRIALS = 4
# Largest increment of differences in time, as a fraction of the duration of the part between two breaks.
SHORT = 1e-5
# Largest change of a variable within this increment, as a fraction of the size of the variable.
MOTION = 1e-3
# Smallest increment of differences in time, in units of the rounding error of the time.
ROUNDINGS = 1e4


def values_after(
    residual: Callable[[float, Array, Array], Any],
    times: tuple[float, float, float],
    state: State,
    tolerances: tuple[float, Array],
    span: float,
    free_rates: tuple[bool, bool],
) -> State | None:
    """Return y and y' at the first time after a break.

    `times` contains the last time before the break, the first time after it, and the last time before the next break. The
    state from before the break is kept if changes of y and y' within the tolerances change F at least as much as the jump.
    Otherwise, y changes within the null space of dF/dy', and y' changes in the complement of this space. The combinations of
    y whose derivatives F contains are therefore continuous. Derivatives that F does not contain are computed from the
    derivative of F = 0 if the method uses them and dF/dy' is singular. `free_rates` contains these two conditions, of which
    the second refers to the start of the integration; after a jump, dF/dy' is examined again. Returns None if no solution
    is found, for example if the index is above 1.
    """
    (before, after, _), (y, yp), (rtol, atol) = times, state, tolerances

    def evaluate(t: float, y: Array, yp: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(residual(t, y.copy(), yp.copy()), dtype=float)

    try:
        left = evaluate(after, y, yp)
        tolerance = rtol * np.abs(y) + atol
        effect = np.zeros(len(y))
        for signs in np.random.default_rng(0).choice([-1.0, 1.0], (TRIALS, len(y))):
            moved = evaluate(after, y + signs * tolerance, yp + signs * tolerance / span)
            effect = np.maximum(effect, np.abs(moved - left))
        are_used, is_singular = free_rates
        structure = None
        if (np.abs(left - evaluate(before, y, yp)) > effect).any():
            found = _solve(lambda y, yp: evaluate(after, y, yp), state, tolerances, (span, effect))
            if found is None:
                return None
            state, structure = found
            is_singular = structure.has_free_rates()
    except Exception:  # outside of the domain of F
        return None
    if are_used and is_singular:
        structure = structure or Structure.at(evaluate, after, *state, rtol * np.abs(state[0]) + atol)
        if structure:
            return state[0], _with_free_rates(evaluate, times[1:], state, tolerances, structure)
    return state


def _with_free_rates(
    residual: Callable[[float, Array, Array], Array],
    times: tuple[float, float],
    state: State,
    tolerances: tuple[float, Array],
    structure: Structure,
) -> Array:
    """Return y' with the components that F does not contain, computed from the derivative of F = 0 at `times[0]`.

    BDF predicts the first step with these derivatives, and the error test fails if they are wrong. Returns y' unchanged if
    the derivative of F = 0 does not determine this part, or if F has a kink at y.
    """
    (y, yp), (rtol, atol) = state, tolerances
    correct = _correction(structure)
    if correct is None:
        return yp
    corrections: list[Array] = []
    for _ in range(2):
        rates = yp - sum(corrections, np.zeros(len(y)))
        try:
            change = _derivative(residual, times, (y, rates), tolerances)
        except Exception:  # outside of the domain of F
            return yp
        # F_t + F_y y' + F_y' y'' = 0
        corrections.append(correct(change)[0])
    with np.errstate(all="ignore"):
        first, second = [(np.abs(values) / (np.abs(y) + atol / rtol)).max() for values in corrections]
    # Except at kinks, the second correction is small.
    return yp - corrections[0] if second <= DESCENT * first else yp


def _derivative(
    residual: Callable[[float, Array, Array], Array],
    times: tuple[float, float],
    state: State,
    tolerances: tuple[float, Array],
) -> Array:
    """Return the derivative of F along the direction (1, y', 0) at `times[0]`, computed by forward differences."""
    (t, end), (y, yp), (rtol, atol) = times, state, tolerances
    size = np.abs(y) + atol / rtol
    motion = MOTION * np.divide(size, np.abs(yp), out=np.full(len(y), np.inf), where=yp != 0.0).min()
    step = max(min(SHORT * abs(end - t), motion), ROUNDINGS * np.spacing(abs(t)))
    step = min(step, 0.25 * abs(end - t)) * np.sign(end - t)
    return slope(lambda s: residual(t + s, y + s * yp, yp), step)


def slope(function: Callable[[float], Array], step: float) -> Array:
    """Return the derivative of a function at 0, computed by forward differences of order 3."""
    at = [function(k * step) for k in range(4)]
    return (-11.0 * at[0] + 18.0 * at[1] - 9.0 * at[2] + 2.0 * at[3]) / (6.0 * step)


def _solve(
    residual: Callable[[Array, Array], Array],
    state: State,
    tolerances: tuple[float, Array],
    scales: tuple[float, Array],
) -> tuple[State, Structure] | None:
    """Apply the damped Newton method with a new matrix in each step. Return y and y', and the last matrices.

    `scales` contains the duration of the integration, and the change of F if y and y' change by the tolerances.
    """
    (y, yp), (rtol, atol), (span, effect) = state, tolerances, scales
    last = np.inf
    for _ in range(ITERATIONS):
        # F may be nonlinear within a tolerance, so smaller increments are used.
        increments = min(1.0, ROOT / rtol) * (rtol * np.abs(y) + atol)
        structure = Structure.at(lambda t, y, yp: residual(y, yp), 0.0, y, yp, increments)
        if structure is None:
            return None
        value = residual(y, yp)
        correct = _correction(structure)
        if correct is None:
            return None
        move, change = correct(value)
        scale = np.abs(structure.df_dy).max(axis=1) + np.abs(structure.df_dyp).max(axis=1)
        size, length = np.abs(value / scale).max(), 1.0
        for _ in range(HALVINGS):
            trial = np.abs(residual(y - length * move, yp - length * change) / scale).max()
            if trial <= (1.0 - DESCENT * length) * size:
                break
            length *= 0.5
        tolerance = rtol * np.abs(y) + atol
        of_rates = np.abs(change).max() / (rtol * np.abs(yp - change).max() + (atol / span).min())
        is_small = (np.abs(move) <= CONVERGED * tolerance).all()
        # If F = 0 is satisfied within the tolerances, the correction of y' may consist of rounding errors.
        is_rounding = of_rates > 0.5 * last and (np.abs(value) <= effect).all()
        if is_small and (of_rates <= CONVERGED or is_rounding):
            return (y - move, yp - change), structure
        if trial > (1.0 - DESCENT * length) * size:
            return None
        y, yp, last = y - length * move, yp - length * change, of_rates
    return None


def _correction(structure: Structure) -> Callable[[Array], State] | None:
    """Return a function that computes corrections of y and y' from F; None if F = 0 does not determine them."""
    rows = np.abs(structure.df_dyp).max(axis=1, keepdims=True)
    _, basis, rank = _ranges(structure.df_dyp / np.where(rows > 0.0, rows, 1.0))
    combined = np.hstack([structure.df_dyp @ basis[:, :rank], structure.df_dy @ basis[:, rank:]])
    heights = np.abs(combined).max(axis=1)
    if not heights.all():
        return None
    combined /= heights[:, None]
    sizes = np.abs(combined).max(axis=0)
    if not sizes.all():
        return None
    combined /= sizes
    if not np.linalg.cond(combined) * np.finfo(float).eps < RANK:
        return None

    def correct(left: Array) -> State:
        found = np.linalg.solve(combined, left / heights) / sizes
        return basis[:, rank:] @ found[rank:], basis[:, :rank] @ found[:rank]

    return correct


def _ranges(matrix: Array) -> tuple[Array, Array, int]:
    """Return left singular vectors, a basis, and the rank r. The basis vectors after the first r span the null space."""
    columns = np.abs(matrix).max(axis=0)
    columns = 1.0 / np.where(columns > 0.0, columns, 1.0)
    lefts, values, rights = np.linalg.svd(matrix * columns)
    return lefts, columns[:, None] * rights.T, int((values > RANK * values[0]).sum())


def values_of_index_2(
    residual: Callable[[float, Array, Array], Any],
    times: tuple[float, float],
    state: State,
    tolerances: tuple[float, Array],
) -> State | None:
    """Return y and y' at `times[0]` for index 2, where F = 0 and its derivative determine a part of y.

    Differences in time do not extend beyond `times[1]`. Returns None if no solution is found, for example if the index
    is above 2.
    """

    def evaluate(t: float, y: Array, yp: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(residual(t, y.copy(), yp.copy()), dtype=float)

    (y, yp), (rtol, atol), last = state, tolerances, np.inf
    try:
        for _ in range(ITERATIONS):
            tolerance = rtol * np.abs(y) + atol
            structure = Structure.at(evaluate, times[0], y, yp, tolerance)
            if structure is None:
                return None
            change = _derivative(evaluate, times, (y, yp), tolerances)
            rates = UNSOLVED * np.abs(yp) + tolerance / abs(times[1] - times[0])
            correction = _correction_of_index_2(structure, (evaluate(times[0], y, yp), change), (tolerance, rates))
            if correction is None:
                return None
            y, yp = y - correction[0], yp - correction[1]
            moved = (np.abs(correction[0]) / (np.abs(y) + atol / rtol)).max()
            if moved <= CONVERGED * rtol or 0.5 * last < moved <= ROUNDED:
                return y, yp
            last = moved
    except Exception:  # outside of the domain of F
        pass
    return None


def _correction_of_index_2(structure: Structure, left: State, tolerances: State) -> State | None:
    """Return corrections of y and y' from F and its derivative along y'; None if F and this derivative do not determine y.

    y changes within the null space of F_y'. The projection of the derivative F_t + F_y y' + F_y' y'' onto the left null
    space of F_y' does not contain y''. F and its projected derivative may differ from 0 by as much as the tolerances of y
    and y' allow.
    """
    rows = np.maximum(np.abs(structure.df_dyp).max(axis=1), np.abs(structure.df_dy).max(axis=1))
    if not rows.all():
        return None
    of_y, of_yp = structure.df_dy / rows[:, None], structure.df_dyp / rows[:, None]
    lefts, basis, rank = _ranges(of_yp)
    free = len(rows) - rank
    kernel, projection = basis[:, rank:], lefts[:, rank:].T
    combined = np.block([[of_y @ kernel, of_yp], [np.zeros((free, free)), projection @ of_y]])
    wanted = np.r_[left[0] / rows, projection @ (left[1] / rows)]
    allowed = np.r_[np.abs(of_y) @ tolerances[0], np.abs(projection @ of_y) @ tolerances[1]]
    sizes = np.abs(combined).max(axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    scaled = combined / sizes
    heights = np.abs(scaled).max(axis=1)
    heights = np.where(heights > 0.0, heights, 1.0)
    scaled /= heights[:, None]
    if _null(scaled)[:free].any():
        return None
    found = np.linalg.lstsq(scaled, wanted / heights, rcond=RANK)[0] / sizes
    if (np.abs(combined @ found - wanted) > allowed + UNSOLVED * np.abs(combined) @ np.abs(found)).any():
        return None
    return kernel @ found[:free], found[free:]


def jumping_from_start(
    residual: Callable[[float, Array, Array], Any],
    limits: tuple[float, float],
    start: State,
    tolerances: tuple[float, Array],
) -> Array:
    """Return whether each variable is far from the value that F = 0 and its derivative determine for index 2."""
    (t, end), (y, yp), (rtol, atol) = limits, start, tolerances
    # The values must not depend on the length of the increment in time, which they do if inputs change faster.
    found = [values_of_index_2(residual, (t, t + part * (end - t)), (y, yp), tolerances) for part in (1.0, 1e-2)]
    if found[0] is None or found[1] is None:
        return np.zeros(len(y), dtype=bool)
    jump = np.abs(found[0][0] - y)
    return np.asarray((jump > FAR * (rtol * np.abs(y) + atol)) & (np.abs(found[1][0] - found[0][0]) < 0.5 * jump))
