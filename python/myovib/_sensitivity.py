"""Forward sensitivities of `solve_dae`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arguments import _in_bytes, _real, _vector, _with
from ._native import StepFailure
from ._parts import _within
from ._solution import Array, Function
from ._structure import Structure

# Relative increment of central differences.
INCREMENT = float(np.cbrt(np.finfo(float).eps))

# Residual of a linearized equation, relative to its largest possible terms, above which the equation is considered
# violated.
VIOLATED = 0.05


class Sensitivities:
    """Parameters p of F(t, y, y', p) = 0, and the initial values of dy/dp."""

    def __init__(
        self,
        parameters: ArrayLike,
        functions: tuple[Callable[..., Any], Callable[..., Any] | None],
        args: Sequence[Any],
        dy0_dp: ArrayLike | None,
        n: int,
    ) -> None:
        """Check the arguments of `solve_dae`; `functions` are `residual` and `df_dp`."""
        if np.size(parameters) == 0:
            raise ValueError("parameters is empty: must have at least one value")
        self.parameters = _vector("parameters", parameters).copy()
        self.parameters.flags.writeable = False
        (self._residual, self._df_dp), self._args, self.n = functions, tuple(args), n
        shape = (n, len(self.parameters))
        start = np.zeros(shape) if dy0_dp is None else _real("dy0_dp", dy0_dp)
        if start.shape != shape:
            raise ValueError(f"dy0_dp has the shape {start.shape}: must be {shape}, a column for each parameter")
        if not np.isfinite(start).all():
            raise ValueError("dy0_dp has non-finite entries")
        self.start = start

    def derivatives(self, t: float, y: Array, yp: Array) -> Array:
        """Return dF/dp, row by row."""
        n_parameters = len(self.parameters)
        if self._df_dp is not None:
            function = _with(self._df_dp, (self.parameters, *self._args), "df_dp")
            matrix = _real("df_dp", function(t, y, yp))
            if matrix.shape != (self.n, n_parameters):
                raise ValueError(f"df_dp returned the shape {matrix.shape}: must be {(self.n, n_parameters)}")
            return matrix.ravel()
        return np.column_stack([self._quotient(j, t, y, yp) for j in range(n_parameters)]).ravel()

    def _quotient(self, j: int, t: float, y: Array, yp: Array) -> Array:
        """Return the difference quotient of F for parameter j. It is one-sided if F is defined on one side only."""
        size = INCREMENT * (abs(self.parameters[j]) or 1.0)
        found: list[tuple[float, Array]] = []
        for step in (size, -size, 0.0):
            if len(found) == 2:
                break
            changed = self.parameters.copy()
            changed[j] += step
            with suppress(StepFailure), np.errstate(all="ignore"):
                values = _real("residual", self._residual_at(changed)(t, y, yp))
                if np.isfinite(values).all():
                    found.append((changed[j], values))
        if len(found) < 2:
            raise StepFailure(f"F is not defined on either side of parameters[{j}] = {self.parameters[j]}: give `df_dp`")
        (p, values), (q, others) = found
        return np.asarray((values - others) / (p - q))

    def _residual_at(self, parameters: Array) -> Function:
        return _with(self._residual, (parameters, *self._args), "residual")

    def request(
        self,
        values: Array,
        times: tuple[tuple[float, float], float],
        state: tuple[Array, Array],
        request: dict[str, Any],
        is_first: bool,
    ) -> dict[str, Any]:
        """Return the entries of a request to the native module for a part that starts with these `values` of dy/dp.

        `times` are the first and the last time of the part, and the origin from which times are counted. At the start of the
        first part, the values must satisfy the derivatives of the equations without y'.
        """
        (limits, origin), (y, yp) = times, state
        residual = self._residual_at(self.parameters)
        weights = request["rtol"] * np.abs(y) + np.array(request["atol"])
        pattern = request["pattern"] and tuple(np.array(part) for part in request["pattern"])
        structure = Structure.at(residual, limits[0], y, yp, weights, pattern=pattern)
        both = self._consistent(structure, (limits[0], y, yp), values)
        if is_first and structure is not None:
            self._expect_consistent(structure, (limits[0], y, yp), both[0])
        return {
            "df_dp": _in_bytes(_within(self.derivatives, limits, origin), values.size, "df_dp"),
            "dy0_dp": [[s.tolist() for s in pair] for pair in zip(*(part.T for part in both), strict=True)],
        }

    def _expect_consistent(self, structure: Structure, at: tuple[float, Array, Array], values: Array) -> None:
        """Reject values that do not satisfy the derivatives of the equations without y'."""
        df_dp = self.derivatives(*at).reshape(values.shape)
        # The errors of entries that are zero are as large as the increments.
        rows = abs(structure.df_dy) @ np.ones(self.n)
        size = rows[:, None] * np.abs(values).max(axis=0) + np.abs(df_dp)
        is_violated = np.abs(structure.df_dy @ values + df_dp) > VIOLATED * size
        is_violated &= structure.without_rates[:, None]
        for equation, j in np.argwhere(is_violated):
            raise ValueError(
                f"dy0_dp violates the derivative of equation {equation} with respect to parameters[{j}] (counted from 0): give "
                "the derivative of a y0 that satisfies this equation for all values of the parameter"
            )

    def _consistent(self, structure: Structure | None, at: tuple[float, Array, Array], values: Array) -> tuple[Array, Array]:
        """Return dy/dp and its derivative with respect to time at the start of a part, each (n, parameters).

        At index 0 and 1, the rows of algebraic variables follow from the other rows. Otherwise, `values` are returned
        unchanged, and the derivatives are zero.
        """
        if structure is None:
            return values, np.zeros_like(values)
        is_algebraic = structure.algebraic[:, None]
        given = np.where(is_algebraic, 0.0, values)
        found = structure.solve(-(structure.df_dy @ given + self.derivatives(*at).reshape(values.shape)))
        if found is None:
            return values, np.zeros_like(values)
        return np.where(is_algebraic, found, given), np.where(is_algebraic, 0.0, found)
