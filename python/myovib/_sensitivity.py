"""Forward sensitivities of `solve_dae`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arguments import _Calls, _in_bytes, _real, _vector, _with
from ._breaks import _derivative
from ._native import StepFailure
from ._parts import _within
from ._solution import Array, Function
from ._structure import RANK, Structure

# Relative increment of central differences.
INCREMENT = float(np.cbrt(np.finfo(float).eps))

# Trial sizes of a parameter whose value is 0, in the order of the search, and largest relative differences between quotients
# for three successive sizes at which neither rounding nor nonlinearity matters. The second limit is for equations with large
# terms that do not depend on the parameter.
TRIALS = 10.0 ** np.array(sorted(range(-30, 31, 2), key=abs))
AGREEMENTS = (1e-6, 1e-3)

# Relative difference of quotients above which increments proportional to a small parameter are considered too small.
RESOLVED = 1e-2

# Residual of a linearized equation, relative to its largest possible terms, above which the equation is considered
# violated.
VIOLATED = 0.05

# Relative difference between an entry of `df_dp` and all quotients above which the entry is considered wrong, and largest
# relative difference between quotients for two successive increments at which they are considered reliable. The first
# limit is larger than errors of y', from which the entry may be computed.
WRONG, AGREEMENT = 0.1, 0.05

# Factors of the increments. The largest increment is 6 % of the parameter.
GROWTHS = (1.0, 1e2, 1e4)

# Factors of the increments for derivatives of constraints, and largest variation of these derivatives, relative to their
# median, at which they are considered reliable.
FACTORS, VARIATION = (0.5, 1.0, 2.0, 4.0), 0.2

# Negligible change of the rate of a constraint if a parameter changes by its size, relative to the terms of this rate.
NEGLIGIBLE = 1e-5

# Number of sign patterns from which the largest possible terms of a hidden constraint are estimated.
SIGNS = 16


class Sensitivities:
    """Parameters p of F(t, y, y', p) = 0, and the initial values of dy/dp."""

    def __init__(
        self,
        parameters: ArrayLike,
        functions: tuple[Callable[..., Any], Callable[..., Any] | None],
        args: Sequence[Any],
        dy0_dp: ArrayLike | None,
        n: int,
        calls: _Calls,
    ) -> None:
        """Check the arguments of `solve_dae`. `functions` is the pair (`residual`, `df_dp`), and `calls` counts the calls of `residual`."""
        if np.size(parameters) == 0:
            raise ValueError("parameters is empty: must have at least one value")
        self.parameters = _vector("parameters", parameters).copy()
        self.parameters.flags.writeable = False
        (self._residual, self._df_dp), self._args, self.n, self._calls = functions, tuple(args), n, calls
        shape = (n, len(self.parameters))
        start = np.zeros(shape) if dy0_dp is None else _real("dy0_dp", dy0_dp)
        if start.shape != shape:
            raise ValueError(f"dy0_dp has shape {start.shape}: must be {shape}, a column for each parameter")
        if not np.isfinite(start).all():
            raise ValueError("dy0_dp has non-finite entries")
        self.start = start
        # Typical sizes of the parameters, for difference quotients and for the error test; NaN until they are known.
        self._sizes = np.where(self.parameters == 0.0, np.nan, np.abs(self.parameters))
        self._scales = self._sizes.copy()

    def derivatives(self, t: float, y: Array, yp: Array) -> Array:
        """Return dF/dp, row by row."""
        n_parameters = len(self.parameters)
        if self._df_dp is not None:
            function = _with(self._df_dp, (self.parameters, *self._args), "df_dp")
            matrix = _real("df_dp", function(t, y, yp))
            if matrix.shape != (self.n, n_parameters):
                raise ValueError(f"df_dp returned shape {matrix.shape}: must be {(self.n, n_parameters)}")
            return matrix.ravel()
        return np.column_stack([self._quotient(j, t, y, yp) for j in range(n_parameters)]).ravel()

    def _quotient(self, j: int, t: float, y: Array, yp: Array) -> Array:
        """Return the difference quotient of F for parameter j. It is one-sided if F is defined on one side only."""
        size = INCREMENT * self._sizes[j]
        found: list[tuple[float, Array]] = []
        for step in (size, -size, 0.0):
            if len(found) == 2:
                break
            changed = self.parameters.copy()
            changed[j] += step
            with suppress(StepFailure), np.errstate(all="ignore"):
                values = self._value(changed, (t, y, yp))
                if np.isfinite(values).all():
                    found.append((changed[j], values))
        if len(found) < 2:
            raise StepFailure(f"F is not defined on either side of parameters[{j}] = {self.parameters[j]}: give `df_dp`")
        (p, values), (q, others) = found
        return np.asarray((values - others) / (p - q))

    def wrong_derivative(self, states: Sequence[tuple[float, Array, Array]]) -> str | None:
        """Describe an entry of `df_dp` that differs from difference quotients at one of the states, which must satisfy F = 0."""
        if self._df_dp is None:
            return None
        for at in states:
            for j in range(len(self.parameters)):
                # The user's functions may be undefined for other parameter values.
                with suppress(Exception), np.errstate(all="ignore"):
                    if wrong := self._wrong_entry(j, at):
                        row, stated, quotient = wrong
                        return (
                            f"df_dp looks wrong: row {row}, column {j} (counted from 0) is {stated:.6e} at t = {at[0]:.6g}, but "
                            f"finite differences of the residual give {quotient:.6e}"
                        )
        return None

    def _wrong_entry(self, j: int, at: tuple[float, Array, Array]) -> tuple[int, float, float] | None:
        """Return an entry of column j of `df_dp` that differs from all difference quotients.

        The result is the row, the entry and a quotient. Several increments are used, because small increments may be lost by
        rounding, and large increments are inaccurate. Functions with kinks have different quotients on the two sides.
        """
        stated = self.derivatives(*at).reshape(self.n, -1)[:, j]
        middle = self._value(self.parameters, at)
        is_wrong = np.ones(self.n, dtype=bool)
        reliable, last = np.zeros(self.n), np.zeros(self.n)
        for growth in GROWTHS:
            step = growth * INCREMENT * self._sizes[j]
            sides = []
            for sign in (1.0, -1.0):
                changed = self.parameters.copy()
                changed[j] += sign * step
                sides.append((self._value(changed, at) - middle) / (changed[j] - self.parameters[j]))
            mean = 0.5 * (sides[0] + sides[1])
            for quotient in (*sides, mean):
                is_wrong &= np.abs(quotient - stated) > WRONG * np.maximum(np.abs(stated), np.abs(quotient))
            is_reliable = (np.abs(mean - last) <= AGREEMENT * np.abs(mean)) & (mean != 0.0)
            reliable, last = np.where(is_reliable, mean, reliable), mean
        is_wrong &= reliable != 0.0
        if not is_wrong.any():
            return None
        row = int(np.flatnonzero(is_wrong)[0])
        return row, float(stated[row]), float(reliable[row])

    def _value(self, parameters: Array, at: tuple[float, Array, Array]) -> Array:
        """Return F at a state for the given parameters."""
        return _real("residual", self._residual_at(parameters)(*at))

    def _residual_at(self, parameters: Array) -> Function:
        return _with(self._residual, (parameters, *self._args), "residual", self._calls)

    def request(
        self,
        values: Array,
        times: tuple[tuple[float, float], float],
        state: tuple[Array, Array],
        request: dict[str, Any],
        is_first: bool,
    ) -> dict[str, Any]:
        """Return the entries of a request to the native module for a part that starts with these `values` of dy/dp.

        `times` contains the first and the last time of the part, and the origin from which times are counted. At the start of
        the first part, the values must satisfy the derivatives of the equations without y'.
        """
        (limits, origin), (y, yp) = times, state
        residual = self._residual_at(self.parameters)
        atol = np.resize(request["atol"], self.n)
        pattern = request["pattern"] and tuple(np.array(part) for part in request["pattern"])
        structure = Structure.at(residual, limits[0], y, yp, atol, pattern=pattern, is_accurate=True)
        if is_first:
            self._set_scales(structure, (limits[0], y, yp))
        both = self._consistent(structure, (limits[0], y, yp), values)
        if is_first and structure is not None:
            self._expect_consistent(structure, (limits[0], y, yp), both[0])
            if max(request["index"] or [0]) == 3:
                is_hidden = np.array(request["index"]) > 1
                tolerances = (request["rtol"], np.array(request["atol"]))
                self._expect_rates(structure, limits, (y, yp), both[0], is_hidden, tolerances)
        return {
            "parameters": list(zip(self.parameters.tolist(), self._scales.tolist(), strict=True)),
            "df_dp": _in_bytes(_within(self.derivatives, limits, origin), values.size, "df_dp"),
            "dy0_dp": [[s.tolist() for s in pair] for pair in zip(*(part.T for part in both), strict=True)],
        }

    def _set_scales(self, structure: Structure | None, at: tuple[float, Array, Array]) -> None:
        """Estimate the sizes of parameters that are 0, or so small that increments relative to them are lost by rounding.

        The size for increments is chosen so that difference quotients are accurate. It is 1 if a parameter of 0 has no effect
        at the start. A change by the scale for the error test changes some equation by the size of its terms.
        """
        for j, p in enumerate(np.abs(self.parameters).tolist()):
            if p and self._df_dp is not None:
                continue
            small = None
            if p:
                with suppress(StepFailure):  # reported at the start of the integration
                    small = self._quotient(j, *at)
            found = self._resolved(j, at)
            if p:
                self._sizes[j] = p
                if small is not None and found and found[0] > p and not np.allclose(small, found[1], rtol=RESOLVED, atol=0.0):
                    self._sizes[j] = found[0] if self._is_smooth(j, found, at) else p
                continue
            self._sizes[j] = self._scales[j] = 1.0 if found is None else found[0]
            if found is None or structure is None:
                continue
            y, yp = np.abs(structure.state)
            terms = abs(structure.df_dy) @ y + abs(structure.df_dyp) @ yp
            with np.errstate(all="ignore"):
                sizes = terms / np.abs(found[1])
            sizes = sizes[np.isfinite(sizes) & (sizes > 0.0)]
            if sizes.size:
                self._scales[j] = sizes.min()

    def _is_smooth(self, j: int, found: tuple[float, Array], at: tuple[float, Array, Array]) -> bool:
        """Return whether the quotients on both sides of parameter j agree with their mean. At a kink of F, they do not."""
        size, quotient = found
        with suppress(Exception), np.errstate(all="ignore"):
            changes = []
            for sign in (1.0, -1.0):
                changed = self.parameters.copy()
                changed[j] += sign * INCREMENT * size
                change = self._value(changed, at) - self._value(self.parameters, at)
                changes.append(change / (changed[j] - self.parameters[j]))
            return bool(np.allclose(changes, quotient, rtol=RESOLVED, atol=0.0))
        return False

    def _resolved(self, j: int, at: tuple[float, Array, Array]) -> tuple[float, Array] | None:
        """Return the size of parameter j closest to 1 for which difference quotients are accurate, and the quotient."""
        if self._df_dp is not None:
            quotient = self.derivatives(*at).reshape(self.n, -1)[:, j]
            return (1.0, quotient) if quotient.any() else None
        quotients: dict[float, Array] = {}

        def at_size(size: float) -> Array:
            if size not in quotients:
                self._sizes[j] = size
                quotients[size] = np.full(self.n, np.nan)
                # The changed parameter may be outside of the domain of F, or the increment may be lost by rounding.
                with suppress(Exception), np.errstate(all="ignore"):
                    quotients[size] = self._quotient(j, *at)
            return quotients[size]

        for size, agreement in ((size, agreement) for agreement in AGREEMENTS for size in TRIALS):
            near = np.array([at_size(factor * size) for factor in (0.01, 1.0, 100.0)])
            largest = np.abs(near).max(axis=0)
            if (largest > 0.0).any() and (np.ptp(near, axis=0) <= agreement * largest).all():
                return float(size), near[1]
        return None

    def _expect_consistent(self, structure: Structure, at: tuple[float, Array, Array], values: Array) -> None:
        """Reject values that do not satisfy the derivatives of the equations without y'."""
        df_dp = self.derivatives(*at).reshape(values.shape)
        # The errors of zero entries of df_dy are as large as the increments.
        rows = abs(structure.df_dy) @ np.ones(self.n)
        size = rows[:, None] * np.abs(values).max(axis=0) + np.abs(df_dp)
        is_violated = np.abs(structure.df_dy @ values + df_dp) > VIOLATED * size
        is_violated &= structure.without_rates[:, None]
        for equation, j in np.argwhere(is_violated):
            raise ValueError(
                f"dy0_dp violates the derivative of equation {equation} with respect to parameters[{j}] (counted from 0): give "
                "the derivative of a y0 that satisfies this equation for all values of the parameter"
            )

    def _expect_rates(
        self,
        structure: Structure,
        limits: tuple[float, float],
        state: tuple[Array, Array],
        values: Array,
        is_hidden: NDArray[np.bool_],
        tolerances: tuple[float, Array],
    ) -> None:
        """Reject values that do not satisfy the derivatives of the hidden constraints on velocities at index 3.

        Hidden constraints are the time derivatives of constraints on positions, that is, of equations without derivatives,
        algebraic variables and variables of an index above 1, which `is_hidden` marks. Large sparse systems are not examined.
        """
        if not isinstance(structure.df_dyp, np.ndarray):
            return
        is_position = structure.without_rates & ~structure.df_dy[:, is_hidden | structure.algebraic].any(axis=1)
        constraints = np.flatnonzero(is_position)
        if not constraints.size:
            return
        (y, yp), t = state, limits[0]
        df_dp = self.derivatives(t, y, yp).reshape(values.shape)
        rates = np.linalg.lstsq(structure.df_dyp, -(structure.df_dy @ values + df_dp), rcond=RANK)[0]
        # The given y' need not satisfy F = 0, so it is corrected.
        left = _real("residual", self._residual_at(self.parameters)(t, y, yp))
        yp = yp - np.linalg.lstsq(structure.df_dyp, left, rcond=RANK)[0]
        size = np.abs(y).max() + np.abs(yp).max() * abs(limits[1] - t)
        random = np.random.default_rng(0)
        for j in range(len(self.parameters)):
            unit = np.arange(len(self.parameters)) == j
            largest = np.abs(values[:, j]).max()
            # The positions move by less than their size.
            step = INCREMENT * min(self._scales[j], size / largest if largest else np.inf)
            if step == 0.0:
                continue

            def change(s: Array, s_dot: Array, weight: float, step: float = step) -> Array:
                sides = []
                for sign in (1.0, -1.0):
                    function = self._residual_at(self.parameters + sign * step * weight * unit)
                    moved = (y + sign * step * s, yp + sign * step * s_dot)
                    sides.append(
                        _derivative(lambda *at: _real("residual", function(*at)), limits, moved, tolerances)
                    )
                return (sides[0] - sides[1])[constraints] / (2.0 * step)

            zero = np.zeros(self.n)
            # The user's functions may be undefined nearby.
            is_violated = np.zeros(constraints.size, dtype=bool)
            with suppress(Exception), np.errstate(all="ignore"):
                # Rounding errors depend on the increment, but a violation does not.
                totals = np.array([change(values[:, j], rates[:, j], 1.0, factor * step) for factor in FACTORS])
                total = np.median(totals, axis=0)
                is_reliable = np.ptp(totals, axis=0) <= VARIATION * np.abs(total)
                smallest = NEGLIGIBLE * (abs(structure.df_dy) @ np.abs(yp))[constraints] / self._scales[j]
                terms = np.maximum(np.abs(change(zero, zero, 1.0)), smallest)
                for signs in random.choice([-1.0, 1.0], (SIGNS, self.n)):
                    terms = np.maximum(terms, np.abs(change(signs * values[:, j], zero, 0.0)))
                    terms = np.maximum(terms, np.abs(change(zero, signs * rates[:, j], 0.0)))
                is_violated = is_reliable & (np.abs(total) > VIOLATED * terms)
            for equation in constraints[is_violated]:
                raise ValueError(
                    f"dy0_dp violates the derivative of equation {equation} with respect to time and parameters[{j}] (counted "
                    "from 0): give velocities whose derivatives satisfy this equation for all values of the parameter, for "
                    "example difference quotients of results of `consistent_start`"
                )

    def _consistent(self, structure: Structure | None, at: tuple[float, Array, Array], values: Array) -> tuple[Array, Array]:
        """Return dy/dp and its derivative with respect to time at the start of a part, each of shape (n, parameters).

        At index 0 and 1, the rows of algebraic variables are computed from the other rows. Otherwise, `values` is returned
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
