"""Forward sensitivities of `solve_dae`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arguments import _in_bytes, _real, _vector, _with
from ._parts import _within
from ._solution import Array
from ._structure import Structure

# Relative increment of central differences.
INCREMENT = float(np.cbrt(np.finfo(float).eps))


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
        self.parameters = _vector("parameters", parameters)
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
            function = _with(self._df_dp, (self.parameters.copy(), *self._args), "df_dp")
            matrix = _real("df_dp", function(t, y, yp))
            if matrix.shape != (self.n, n_parameters):
                raise ValueError(f"df_dp returned the shape {matrix.shape}: must be {(self.n, n_parameters)}")
            return matrix.ravel()
        columns = []
        for j, p in enumerate(self.parameters):
            size = INCREMENT * (abs(p) or 1.0)
            at = self.parameters.copy(), self.parameters.copy()
            at[0][j], at[1][j] = p + size, p - size
            values = [_real("residual", _with(self._residual, (q, *self._args), "residual")(t, y, yp)) for q in at]
            columns.append((values[0] - values[1]) / (at[0][j] - at[1][j]))
        return np.column_stack(columns).ravel()

    def request(
        self,
        values: Array,
        times: tuple[tuple[float, float], float],
        state: tuple[Array, Array],
        request: dict[str, Any],
    ) -> dict[str, Any]:
        """Return the entries of a request of the native module for a part that starts with these `values` of dy/dp.

        `times` are the first and the last time of the part, and the origin from which times are counted.
        """
        (limits, origin), (y, yp) = times, state
        residual = _with(self._residual, (self.parameters.copy(), *self._args), "residual")
        weights = request["rtol"] * np.abs(y) + np.array(request["atol"])
        pattern = request["pattern"] and tuple(np.array(part) for part in request["pattern"])
        structure = Structure.at(residual, limits[0], y, yp, weights, pattern=pattern)
        both = self.at(structure, (limits[0], y, yp), values)
        return {
            "df_dp": _in_bytes(_within(self.derivatives, limits, origin), values.size, "df_dp"),
            "dy0_dp": [[s.tolist() for s in pair] for pair in zip(*(part.T for part in both), strict=True)],
        }

    def at(self, structure: Structure | None, at: tuple[float, Array, Array], values: Array) -> tuple[Array, Array]:
        """Return dy/dp and its derivative with respect to time at the start of a part, each (n, parameters).

        At index 0 and 1, the rows of algebraic variables follow from the others. Otherwise `values` are returned, with
        derivatives of zero.
        """
        if structure is None:
            return values, np.zeros_like(values)
        is_algebraic = structure.algebraic[:, None]
        given = np.where(is_algebraic, 0.0, values)
        found = structure.solve(-(structure.df_dy @ given + self.derivatives(*at).reshape(values.shape)))
        if found is None:
            return values, np.zeros_like(values)
        return np.where(is_algebraic, found, given), np.where(is_algebraic, 0.0, found)
