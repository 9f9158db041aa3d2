"""Comparison of outputs with the equations without derivatives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._solution import Array, DaeSolution, Function

# Smallest number of outputs to examine. More outputs are examined if this takes at most SHARE of all evaluations of F.
FEWEST, SHARE = 20, 0.1

# Number of random changes of y within the tolerances.
CHANGES = 3

# Residuals above which an output is considered wrong, at index 0 and 1 and at index 2 and 3, in units of the change of F if y
# changes by the tolerances. These limits are the largest errors that the guide states. The residuals of accurate runs of 60
# other problems are at most 51 and 118.
WRONG, WRONG_OF_HIGHER_INDEX = 1e3, 2e4


def violated(
    solution: DaeSolution,
    n_evaluations: int,
    residual: Function,
    without_rates: NDArray[np.bool_],
    tolerances: tuple[float, Array],
    jumps: list[float],
    is_of_higher_index: bool,
) -> str | None:
    """Describe the equation without derivatives that the outputs violate most; None if they violate none.

    Outputs at times of jumps are not examined.
    """
    inner = np.flatnonzero(~np.isin(solution.t, jumps))
    if not (inner.size and without_rates.any()):
        return None
    n_outputs = min(inner.size, max(FEWEST, int(SHARE * n_evaluations) // (1 + CHANGES)))
    rtol, atol = tolerances
    tolerance = rtol * np.abs(solution.y).max(axis=1) + atol
    random, shape = np.random.default_rng(0), (CHANGES, len(tolerance))
    # The sizes differ, so that the changes of two variables do not cancel in an equation.
    factors = random.choice([-1.0, 1.0], shape) * random.uniform(0.5, 1.0, shape)
    worst, found = WRONG_OF_HIGHER_INDEX if is_of_higher_index else WRONG, None
    try:
        with np.errstate(all="ignore"):
            for k in inner[np.linspace(0, inner.size - 1, n_outputs).astype(int)]:
                t, y, yp = float(solution.t[k]), solution.y[:, k], solution.yp[:, k]

                def evaluate(y: Array, yp: Array, t: float = t) -> Array:
                    return np.array(residual(t, y.copy(), yp.copy()), dtype=float)

                base = evaluate(y, yp)
                changes = np.max([np.abs(evaluate(y + factor * tolerance, yp) - base) for factor in factors], axis=0)
                ratios = np.where(without_rates & (changes > 0.0), np.abs(base) / changes, 0.0)
                if ratios.max() > worst:
                    # Derivatives may occur in the equation at this time although they do not occur at the start.
                    ratios[evaluate(y, yp + 1.0 + np.abs(yp)) != base] = 0.0
                if ratios.max() > worst:
                    worst, found = ratios.max(), (int(ratios.argmax()), t)
    except Exception:  # outside of the domain of F
        return None
    if found is None:
        return None
    return (
        f"values at t = {found[1]:.6g} violate equation {found[0]} (counted from 0) by {worst:.0e} times the change that the "
        "tolerances allow: an input or a kink of F may act within a step; list its time in `breaks`, or limit `max_step`"
    )
