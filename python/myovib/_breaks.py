"""Values after a break, at which inputs may jump."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._structure import RANK, Structure

Array = NDArray[np.float64]
State = tuple[Array, Array]

# Steps of Newton's method, halvings of a step, and part of the predicted reduction that a step must reach.
ITERATIONS = 100
HALVINGS = 40
DESCENT = 0.1
# Last correction of y and y', in tolerances; the value of IDACalcIC.
CONVERGED = 0.0033
# Relative increment of difference quotients.
ROOT = float(np.sqrt(np.finfo(float).eps))
# Number of trial changes of a state.
TRIALS = 4
# Largest increments of differences in time, relative to the length of a part and to the size of a variable, and the
# smallest one in roundings of the time.
SHORT = 1e-5
MOTION = 1e-3
ROUNDINGS = 1e4


def values_after(
    residual: Callable[[float, Array, Array], Any],
    times: tuple[float, float, float],
    state: State,
    tolerances: tuple[float, Array],
    span: float,
) -> State | None:
    """Return y and y' at the second time. Only a break is between the first two times, and none until the third.

    The state from before the break is kept if F does not jump there by more than changes of y and y' within
    the tolerances. Otherwise y changes within the null space of dF/dy' and y' in its complement: the
    combinations of which F contains the derivatives are continuous. The derivatives of algebraic variables satisfy the
    derivative of F = 0. Returns None without a solution, for example if the index is above 1.
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
        found: State | None = state
        if (np.abs(left - evaluate(before, y, yp)) > effect).any():
            found = _solve(lambda y, yp: evaluate(after, y, yp), state, tolerances, (span, effect))
    except Exception:  # outside of the domain of F
        return None
    return found and (found[0], _with_free_rates(evaluate, times[1:], found, tolerances))


def _with_free_rates(
    residual: Callable[[float, Array, Array], Array],
    times: tuple[float, float],
    state: State,
    tolerances: tuple[float, Array],
) -> Array:
    """Return y' with the part that F does not contain, from the derivative of F = 0 at the first time.

    BDF predicts the first step by these derivatives, and fails its error test if they are wrong. Returns y' itself if F = 0
    does not determine this part.
    """
    (t, _), (y, yp), (rtol, atol) = times, state, tolerances
    structure = Structure.at(residual, t, y, yp, rtol * np.abs(y) + atol)
    if structure is None:
        return yp
    try:
        change = _derivative(residual, times, state, tolerances)
    except Exception:  # outside of the domain of F
        return yp
    # F_t + F_y y' + F_y' y'' = 0
    correction = _correction(structure, change)
    return yp if correction is None else yp - correction[0]


def _derivative(
    residual: Callable[[float, Array, Array], Array],
    times: tuple[float, float],
    state: State,
    tolerances: tuple[float, Array],
) -> Array:
    """Return the derivative of F at the first time along the direction (1, y', 0), from differences forward."""
    (t, end), (y, yp), (rtol, atol) = times, state, tolerances
    size = np.abs(y) + atol / rtol
    motion = MOTION * np.divide(size, np.abs(yp), out=np.full(len(y), np.inf), where=yp != 0.0).min()
    step = max(min(SHORT * abs(end - t), motion), ROUNDINGS * np.spacing(abs(t)))
    step = min(step, 0.25 * abs(end - t)) * np.sign(end - t)
    at = [residual(t + k * step, y + k * step * yp, yp) for k in range(4)]
    return (-11.0 * at[0] + 18.0 * at[1] - 9.0 * at[2] + 2.0 * at[3]) / (6.0 * step)


def _solve(
    residual: Callable[[Array, Array], Array],
    state: State,
    tolerances: tuple[float, Array],
    scales: tuple[float, Array],
) -> State | None:
    """Apply the damped Newton method with a new matrix in each step.

    The scales are the length of the integration, and the changes of F by changes within the tolerances.
    """
    (y, yp), (rtol, atol), (span, effect) = state, tolerances, scales
    last = np.inf
    for _ in range(ITERATIONS):
        # Functions may bend within a tolerance.
        increments = min(1.0, ROOT / rtol) * (rtol * np.abs(y) + atol)
        structure = Structure.at(lambda t, y, yp: residual(y, yp), 0.0, y, yp, increments)
        if structure is None:
            return None
        value = residual(y, yp)
        correction = _correction(structure, value)
        if correction is None:
            return None
        move, change = correction
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
        # If F = 0 within the tolerances, the correction of y' may consist of rounding errors.
        is_rounding = of_rates > 0.5 * last and (np.abs(value) <= effect).all()
        if is_small and (of_rates <= CONVERGED or is_rounding):
            return y - move, yp - change
        if trial > (1.0 - DESCENT * length) * size:
            return None
        y, yp, last = y - length * move, yp - length * change, of_rates
    return None


def _correction(structure: Structure, left: Array) -> State | None:
    """Return the corrections of y and y', or None if F = 0 does not determine them."""
    matrix = structure.df_dyp
    rows = np.abs(matrix).max(axis=1, keepdims=True)
    scaled = matrix / np.where(rows > 0.0, rows, 1.0)
    columns = np.abs(scaled).max(axis=0)
    columns = 1.0 / np.where(columns > 0.0, columns, 1.0)
    values, vectors = np.linalg.svd(scaled * columns)[1:]
    rank = int((values > RANK * values[0]).sum())
    basis = columns[:, None] * vectors.T
    combined = np.hstack([matrix @ basis[:, :rank], structure.df_dy @ basis[:, rank:]])
    rows = np.abs(combined).max(axis=1, keepdims=True)
    if not rows.all():
        return None
    combined, left = combined / rows, left / rows[:, 0]
    sizes = np.abs(combined).max(axis=0)
    if not sizes.all():
        return None
    combined /= sizes
    if not np.linalg.cond(combined) * np.finfo(float).eps < RANK:
        return None
    found = np.linalg.solve(combined, left) / sizes
    return basis[:, rank:] @ found[rank:], basis[:, :rank] @ found[:rank]
