"""Comparison of the stated indices of variables with the equations."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._structure import Structure

Array = NDArray[np.float64]

# Highest index that Radau methods support.
HIGHEST = 3

# Positions of the first stages, relative to the step size. Rounding errors are divided by the squares of these numbers.
FIRST_STAGES = {"radau5": 0.155, "radau9": 0.0571, "radau13": 0.0293}

# Ratio above which the initial value of a multiplier is considered wrong: distance of the initial value from an
# extrapolated value, divided by the change of the extrapolated value between degrees 3 and 4.
JUMP = 20.0

# Factors by which the first step is shortened when the first steps are repeated. With HALF, rounding errors change; with
# SHORT, the steps resolve a fast motion.
HALF, SHORT = 0.5, 1e-3


def listed(numbers: list[int]) -> str:
    """Return a list as text. If the list is long, only the first numbers are shown."""
    return str(numbers) if len(numbers) < 10 else f"{str(numbers[:6])[:-1]}, … ({len(numbers)} in total)]"


def index_note(
    structure: Structure, method: str, indices: list[int] | None, suppress: Sequence[bool] | None
) -> tuple[str, bool]:
    """Describe indices that are missing, wrong or too high. Return the description, and whether the index is too high.

    The description may be empty.
    """
    hidden = [] if any(structure.singular) else structure.of_higher_index
    if not hidden:
        return "", False
    index = structure.index()
    if index > HIGHEST:
        return (
            f"the equations seem to have index {index}, but Radau methods support at most {HIGHEST}: replace "
            "constraints by their derivatives"
        ), True
    tested = [j for j in hidden if suppress is None or not suppress[j]]
    if method == "bdf":
        if index == HIGHEST:
            # This also holds if all of these variables are excluded from the error test.
            return (
                f"{_above_1(hidden)}, and the equations have index 3, for which BDF is inaccurate or stops: use a Radau "
                "method with `index`, or the GGL form, of index 2"
            ), False
        remedy = "exclude them from the error test with `suppress`, or use a Radau method with `index`"
        return (f"{_above_1(tested)}: {remedy}" if tested else ""), False
    if indices is None:
        return f"{_above_1(hidden)}: give the index of each variable in `index`", False
    wrong = [j for j in tested if indices[j] <= 1]
    if wrong:
        return f"{_above_1(wrong)}, but `index` states {max(indices[j] for j in wrong)}", False
    found = structure.variable_indices
    wrong = [j for j, stated in enumerate(indices) if max(stated, 1) < found[j] and not (suppress and suppress[j])]
    if wrong:
        needed = listed([int(found[j]) for j in wrong])
        return (
            f"the variables {listed(wrong)} (counted from 0) have the indices {needed}, but "
            f"`index` states {listed([indices[j] for j in wrong])}"
        ), False
    return "", False


def _above_1(variables: list[int]) -> str:
    return f"the variables {listed(variables)} (counted from 0) have an index above 1"


def jumping_multipliers(
    solution: Any,
    method: str,
    indices: list[int],
    tolerances: tuple[float, Array],
    structure: Structure | None,
    repeated: Callable[[float], Any],
) -> list[int]:
    """Return the variables of the highest index whose initial values are far from an extrapolation of the first steps.

    ``repeated(h)`` returns the solution with a first step of size h. The first values may contain rounding errors,
    which change with the steps, or belong to a fast motion, which shorter steps resolve. A jump, however, remains if
    the step size changes.
    """
    if not _has_first_steps(solution):
        return []
    second, third, fourth = _extrapolated(solution)
    (rtol, atol), size = tolerances, np.abs(solution.y[:, :6]).max(axis=1)
    tolerance = rtol * size + atol
    # Global errors are up to 100 tolerances, and up to 3000 for multipliers of index 3 at tight tolerances.
    largest = np.minimum(3000.0 * tolerance, 0.1 * size) if max(indices) == 3 else 0.0
    limit = np.maximum(np.maximum(100.0 * tolerance, largest), _rounding(structure, solution, FIRST_STAGES[method]))
    jump = np.abs(solution.y[:, 0] - fourth)
    is_jump = (jump > np.maximum(JUMP * np.abs(fourth - third), limit)) & (jump > np.abs(third - second))
    is_jump &= np.array(indices) == max(indices)
    for factor in (HALF, SHORT):
        again = repeated(factor * (solution.t[1] - solution.t[0])) if is_jump.any() else None
        if again is None or not _has_first_steps(again):
            continue
        change = np.min([np.abs(values - fourth) for values in _extrapolated(again)], axis=0)
        if factor == HALF:
            is_jump &= change < jump / JUMP
        else:
            is_rounded = 10.0 * _rounding(structure, again, FIRST_STAGES[method]) > jump
            is_jump &= (change < 0.5 * jump) | is_rounded
    return np.flatnonzero(is_jump).tolist()


def _has_first_steps(solution: Any) -> bool:
    return len(solution.t) >= 6 and bool(np.diff(solution.t[:6]).all())


def _extrapolated(solution: Any) -> list[Array]:
    """Extrapolate the ends of the first steps to the start by polynomials of degree 2, 3 and 4."""
    times, y = solution.t[1:6] - solution.t[0], solution.y[:, 1:6].T
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # times may be close to each other
        return [np.polyfit(times[: d + 1] / times[d], y[: d + 1], d)[-1] for d in (2, 3, 4)]


def _rounding(structure: Structure | None, solution: Any, stage: float) -> Array | float:
    """Return the errors of variables that rounding errors of the equations cause: at index 3, rounding errors divided by h²."""
    inverse = structure.inverse(1.0 / np.abs(np.diff(solution.t[:6])).min()) if structure else None
    if structure is None or inverse is None:
        return 0.0
    return stage**-2 * np.asarray(np.abs(inverse) @ structure.rounding(np.abs(structure.df_dy), np.abs(structure.df_dyp)))
