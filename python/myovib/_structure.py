"""Structure of F(t, y, y') = 0 at a state, determined from difference quotients."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pattern = tuple[NDArray[np.int64], NDArray[np.int64]]

# Number of variables above which the matrices are computed only if they are sparse.
LARGEST = 200

# Singular values below this fraction of the largest count as zero. Difference quotients are accurate to half of the
# digits.
RANK = 1e-7

# Entries of a null vector of length 1 count as zero up to this size.
PART = 1e-3

# Error of an inverse, in units of the rounding error, above which the inverse is not used.
CONDITION = 1e10
# Largest deviation of an exponent of h from an integer at which the index is considered clear.
CLEAR = 0.05

# Relative increments of forward differences, and of differences of order 4.
SMALL, FOURTH_ORDER = float(np.sqrt(np.finfo(float).eps)), 3e-5

# Second difference of F for increments in both directions, relative to its changes, above which F may have a kink.
BEND = 1e-6

# Change of F, in units of its rounding error, above which an increment is large enough, and factor by which smaller
# increments are enlarged.
RESOLVED, ENLARGEMENT = 1e8, 1e4

# Two accurate matrices decide whether a matrix is singular: factors of their increments, random relative change of their
# entries, and largest relative difference between the two solutions. The errors of accurate quotients are about 1e-11 of
# the terms of F, and truncation errors of order 4 differ by a factor of 8 between the increments.
PARTS, PERTURBED, AGREEMENT = (1.0, 0.6), 1e-11, 0.01

# Exponents of the values of c for which the size of the inverse of dF/dy + c dF/dy' is computed.
EXPONENTS = np.arange(12, -9, -1)

# Residual of a combination of equations above which y is considered to violate it, in units of the change of the
# combination if y changes by the tolerances. The limit for single equations is the same.
VIOLATED = 2.0

# Changes of derivatives, in units of 1 plus the size of the derivative, which must not change a combination of equations.
SIZES = (-1e3, -1.0, -1e-3, 1e-3, 1.0, 1e3)

# Entries above this limit occur if a function overflows.
HUGE = 1e100


class Structure:
    """Matrices dF/dy and dF/dy' at (t, y, yp)."""

    df_dy: Any
    df_dyp: Any
    # Variables whose derivatives do not occur in F.
    algebraic: NDArray[np.bool_]
    # Returns a structure with accurate matrices at the same state; the argument is a factor of the increments.
    accurate: Callable[[float], Structure | None]

    def __init__(
        self,
        residual: Callable[[float, Array, Array], Any],
        t: float,
        y: Array,
        yp: Array,
        tolerance: Array,
        is_accurate: bool = False,
        part: float = 1.0,
    ) -> None:
        def column(j: int, size: float, rate: bool) -> Array:
            step = size if rate else size * self.signs[j]

            def moved(factor: float) -> Array:
                state = [y.copy(), yp.copy()]
                state[rate][j] += factor * step
                return self._evaluate(residual, t, *state)

            return self._change(moved, base) / step

        def quotients(sizes: Array, columns: NDArray[np.int64]) -> Array:
            found = np.full((len(y), len(y)), np.nan)
            for j in columns:
                with suppress(Exception):  # outside of the domain of F
                    found[:, j] = column(j, sizes[j], False)
            return found.ravel()

        self._set_state(y, yp, tolerance, is_accurate, part)
        base = self._evaluate(residual, t, y, yp)
        self.quotient = column
        by_y, by_yp = ([column(j, size, rate) for j, size in enumerate(self.sizes[rate])] for rate in (False, True))
        self.df_dy, self.df_dyp = np.column_stack(by_y), np.column_stack(by_yp)
        rows, columns = (indices.ravel() for indices in np.indices(self.df_dy.shape))
        resolved = self._resolved(self.df_dy.ravel(), (rows, columns), quotients)
        self.df_dy = resolved.reshape(self.df_dy.shape)
        self.algebraic = self._is_algebraic()

    def _set_state(self, y: Array, yp: Array, tolerance: Array, is_accurate: bool, part: float) -> None:
        """Set the state, and the increments for all variables and derivatives. All increments are multiplied by `part`."""
        self.state, self.is_accurate = (y.copy(), yp.copy()), is_accurate
        relative = FOURTH_ORDER if is_accurate else SMALL
        of_rates = np.full(len(y), 1e-3 * np.abs(yp).max() or 1.0)
        self.sizes = (part * np.maximum(relative * np.abs(y), tolerance), part * of_rates)
        # At a kink, the derivative in the direction of motion is required.
        self.signs = np.where(is_accurate & (yp < 0.0), -1.0, 1.0)

    def _change(self, moved: Callable[[float], Array], base: Array) -> Array:
        """Return the change of F per increment: a forward difference, or a difference of order 4 for accurate matrices.

        `moved(k)` returns F after k increments. At kinks, the difference is one-sided. At the edge of the domain of F, only
        shorter increments in one direction may be possible.
        """
        if not self.is_accurate:
            return moved(1.0) - base
        with suppress(Exception):
            ahead, behind, twice_ahead, twice_behind = (moved(k) - base for k in (1.0, -1.0, 2.0, -2.0))
            total = 2.0 / 3.0 * (ahead - behind) - 1.0 / 12.0 * (twice_ahead - twice_behind)
            if np.isfinite(total).all():
                # At twice the distance, the second difference is four times as large for a smooth function, and twice as
                # large at a kink.
                bend, wide = np.abs(ahead + behind), np.abs(twice_ahead + twice_behind)
                is_kink = (bend > BEND * (np.abs(ahead) + np.abs(behind))) & (wide < 3.0 * bend)
                return np.where(is_kink, ahead, total)
        for part in (SMALL / FOURTH_ORDER, -SMALL / FOURTH_ORDER):
            with suppress(Exception):
                change = (moved(part) - base) / part
                if np.isfinite(change).all():
                    return np.asarray(change)
        return moved(1.0) - base

    def _resolved(
        self,
        values: Array,
        places: tuple[NDArray[np.int64], NDArray[np.int64]],
        quotients: Callable[[Array, NDArray[np.int64]], Array],
    ) -> Array:
        """Return entries of dF/dy; increments whose effect is lost by rounding are enlarged.

        `places` contains the rows and columns of the entries. `quotients(sizes, columns)` returns the entries for other
        increments; entries of other columns and undefined entries are NaN. Accurate matrices are examined entry by entry, and
        other matrices column by column.
        """
        rows, columns = places
        y, sizes = np.abs(self.state[0]), self.sizes[False]
        largest = (FOURTH_ORDER if self.is_accurate else SMALL) * y.max()
        rounding = RESOLVED * self.rounding(abs(self.df_dy), abs(self.df_dyp))[rows]
        is_lost = np.abs(values) * sizes[columns] <= rounding
        if not self.is_accurate:
            is_used = np.zeros(len(y), dtype=bool)
            is_used[columns[values != 0.0]] = True
            is_lost &= ~(is_used | ~self._is_algebraic())[columns]
        is_lost &= (sizes < largest)[columns]
        factor = 1.0
        while is_lost.any():
            factor *= ENLARGEMENT
            larger = np.minimum(factor * sizes, largest)
            found = quotients(larger, np.unique(columns[is_lost]))
            is_lost &= np.isfinite(found)
            values = np.where(is_lost, found, values)
            is_lost &= (np.abs(values) * larger[columns] <= rounding) & (larger < largest)[columns]
        return values

    def _is_algebraic(self) -> NDArray[np.bool_]:
        return np.asarray(~self.df_dyp.any(axis=0))

    @staticmethod
    def _evaluate(residual: Callable[[float, Array, Array], Any], t: float, y: Array, yp: Array) -> Array:
        values = np.asarray(residual(t, y.copy(), yp.copy())).astype(float, casting="same_kind")
        if values.shape != y.shape:
            raise ValueError  # reported when the integration begins
        return values

    @classmethod
    def at(
        cls,
        residual: Callable[[float, Array, Array], Any],
        t: float,
        y: Array,
        yp: Array,
        tolerance: Array,
        pattern: Pattern | None = None,
        is_accurate: bool = False,
        part: float = 1.0,
    ) -> Structure | None:
        """Return the structure; None if F is undefined near the state, or if a large system has no `pattern`.

        The pattern contains the column offsets and the row of each entry. `tolerance` contains the smallest increments of
        the variables. Accurate matrices require four times as many evaluations of F. All increments are multiplied by
        `part`.
        """
        from ._sparse_structure import SparseStructure

        found: Structure
        try:
            with np.errstate(all="ignore"):
                if len(y) <= LARGEST:
                    found = cls(residual, t, y, yp, tolerance, is_accurate, part)
                elif pattern is not None and SparseStructure.is_possible(len(y)):
                    found = SparseStructure(residual, t, y, yp, tolerance, pattern, is_accurate, part)
                else:
                    return None
        except Exception:
            return None
        sizes = found.sizes[False]
        found.accurate = lambda part: cls.at(residual, t, *found.state, sizes, pattern, is_accurate=True, part=part)
        return found if found.is_finite else None

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite([self.df_dy, self.df_dyp]).all())

    @property
    def without_rates(self) -> NDArray[np.bool_]:
        """Return the equations that contain no derivatives."""
        return np.asarray(~self.df_dyp.any(axis=1))

    @property
    def differential(self) -> Array:
        """Return the variables whose derivatives occur in F. Entries within the rounding errors of quotients are ignored."""
        rows = np.maximum(np.abs(self.df_dy).max(axis=1), np.abs(self.df_dyp).max(axis=1))
        return np.asarray((np.abs(self.df_dyp) > RANK * rows[:, None]).any(axis=0))

    def wrong_entries(self, df_dy: Array, df_dyp: Array) -> set[tuple[str, int, int]]:
        """Return the matrix, row and column of each entry that differs from its difference quotient by more than a quarter.

        Three kinds of entries are not compared: entries that are negligible in their row, entries that differ only by
        rounding errors, and entries whose quotients depend on the size or the sign of the increment, as at kinks.
        """
        found = set()
        pairs = ((df_dy, self.df_dy), (df_dyp, self.df_dyp))
        sizes = [np.maximum(np.abs(given), np.abs(own)) for given, own in pairs]
        rounding = 100.0 * self.rounding(*sizes)
        for rate, ((given, own), largest) in enumerate(zip(pairs, sizes, strict=True)):
            is_wrong = np.abs(given - own) > 0.25 * largest
            is_wrong &= largest > 1e-6 * largest.max(axis=1, keepdims=True)
            is_wrong &= 0.1 * self.sizes[rate] * np.abs(given - own) > rounding[:, None]
            for row, j in np.argwhere(is_wrong):
                size = self.sizes[rate][j]
                others = [self.quotient(j, part * size, bool(rate))[row] for part in (-1.0, 0.1, -0.1)]
                if (np.abs(np.array(others) - own[row, j]) <= 0.1 * np.abs(own[row, j])).all():
                    found.add(("dF/dy'" if rate else "dF/dy", int(row), int(j)))
        return found

    def rounding(self, df_dy: Array, df_dyp: Array) -> Array:
        """Return the rounding error of each equation, computed from the absolute values of the matrices."""
        y, yp = np.abs(self.state)
        return np.finfo(float).eps * (df_dy @ y + df_dyp @ yp)

    def inverse(self, c: float) -> Array | None:
        """Return the inverse of dF/dy + c dF/dy', or None if it is inaccurate."""
        return _inverse(self.df_dy + c * self.df_dyp)

    def is_huge(self) -> bool:
        """Return whether entries are so large that dependencies between equations cannot be determined."""
        return bool(max(abs(self.df_dy).max(), abs(self.df_dyp).max()) > HUGE)

    def index(self) -> int:
        """Return the highest known index of a variable; if it is at least 1, it is the index of the equations."""
        return int(self.variable_indices.max())

    def has_free_rates(self) -> bool:
        """Return whether F = 0 does not determine all derivatives, because dF/dy' is singular."""
        return bool(self._null(self.df_dyp).any())

    def undetermined(self) -> list[int]:
        """Return the differential variables whose derivatives F = 0 does not determine."""
        differential = np.flatnonzero(~self.algebraic)
        parts = self._null(self.df_dyp[:, differential])
        return [int(j) for j, part in zip(differential, parts, strict=True) if part]

    @cached_property
    def singular(self) -> tuple[list[int], list[int]]:
        """Return the variables that F = 0 does not determine, and the equations that are combinations of others.

        Both lists are empty unless dF/dy + c dF/dy' is singular for all c, up to
        rounding errors.
        """
        # A pencil of index 3 is nearly singular for most c.
        if not self.has_free_rates():
            return [], []
        columns = rows = np.ones_like(self.algebraic)
        values = 2.3 * np.logspace(9, -9, 7)
        for c in values:
            matrix = self.df_dy + c * self.df_dyp
            columns = columns & self._null(matrix)
            rows = rows & self._null(matrix.T)
            if not (columns.any() and rows.any()):
                return [], []
        # If a matrix is only badly scaled, its inverse is accurate.
        if all(self._inverse_sizes(c) is not None for c in values):
            return [], []
        return np.flatnonzero(columns).tolist(), np.flatnonzero(rows).tolist()

    def contradictory(self, initial: str) -> list[int]:
        """Return the equations in combinations that do not depend on any value that `initial` corrects."""
        columns = self.df_dy if initial == "states" else self._combined(self)
        return np.flatnonzero(self._null(columns.T)).tolist()

    def contradiction(self, evaluate: Callable[[Array], Array], tolerance: Array) -> tuple[list[int], float, float] | None:
        """Return the combination of equations without derivatives that y violates most.

        ``evaluate(yp)`` returns F at y. The result contains the equations, the residual of their combination, and the
        change of the combination if y changes by the tolerance. It is None if no combination is violated by more than
        the tolerance allows.
        """
        y, yp = self.state
        base = evaluate(yp)
        # The increments are larger than for `df_dyp`, so that rounding errors of the quotients are negligible.
        increments = np.diag(1.0 + np.abs(yp))
        by_yp = np.column_stack([(evaluate(yp + step) - base) / step.max() for step in increments])
        rows = np.flatnonzero(np.abs(by_yp).max(axis=1))
        if not len(rows):
            return None
        scales = np.abs(by_yp[rows]).max(axis=1, keepdims=True)
        by_yp, by_y, base = by_yp[rows] / scales, self.df_dy[rows] / scales, base[rows] / scales[:, 0]
        vectors, values = np.linalg.svd(by_yp)[:2]
        combinations = vectors[:, int((values > RANK * values[0]).sum()) :].T
        changes = np.abs(combinations @ by_y) @ tolerance
        residuals = np.abs(combinations @ base)
        # If a derivative occurs nonlinearly or with a small factor, the combination changes with it and is excluded.
        directions = 1.0 + 0.618 * np.arange(len(yp)) % 1.0
        for size in SIZES:
            step = size * directions * (1.0 + np.abs(yp))
            moved = combinations @ (evaluate(yp + step)[rows] / scales[:, 0] - base)
            terms = np.abs(by_yp) @ (np.abs(step) + np.abs(yp)) + np.abs(by_y) @ np.abs(y)
            residuals[np.abs(moved) > 1e3 * np.finfo(float).eps * np.abs(combinations) @ terms] = 0.0
        excess = residuals - VIOLATED * changes
        worst = int(np.argmax(excess)) if len(excess) else 0
        if not len(excess) or not excess[worst] > 0.0:
            return None
        equations = rows[np.abs(combinations[worst]) > PART].tolist()
        return equations, float(residuals[worst]), float(changes[worst])

    def effect(self, tolerance: Array) -> Array:
        """Return the change of the residual of each equation if y changes by the tolerance."""
        return np.asarray(abs(self.df_dy) @ tolerance)

    @cached_property
    def variable_indices(self) -> Array:
        """Return the index of each variable: 1 for an index of 0 or 1, and 0 if it cannot be determined.

        In steps of size h, an error of the equations changes a variable of index i by the error divided by h^(i-1).
        """
        changes: list[Array] = []
        for c in 2.3 * 10.0**EXPONENTS:
            sizes = self._inverse_sizes(c)
            changes = [] if sizes is None else [*changes, sizes]
            if len(changes) == 4:
                powers = -np.diff(np.log10(changes), axis=0)
                found = np.maximum(np.rint(powers[0]) + 1.0, 1.0)
                is_clear = (np.abs(powers - np.rint(powers[0])) < CLEAR).all(axis=0)
                return found * is_clear
        return np.zeros(len(self.algebraic))

    @cached_property
    def of_higher_index(self) -> list[int]:
        """Return the algebraic variables that F = 0 does not determine, and whose index is therefore above 1."""
        columns = self._combined(self)
        # In the given units, rounding errors of the quotients are small. In balanced units, small entries of null vectors
        # are also detected.
        is_free = (self._null(columns) | self._null(self._balanced(columns))) & self.algebraic
        # A matrix is not necessarily singular if its coefficients differ by more than 1/RANK.
        if is_free.any() and self._has_entries(columns):
            is_free &= ~self._determined()
        return np.flatnonzero(is_free).tolist()

    def _determined(self) -> NDArray[np.bool_]:
        """Return the derivatives and algebraic variables that the linearized F = 0 determines in spite of rounding errors.

        A value is determined if it agrees between solutions with two accurate matrices that have different errors.
        """
        random = np.random.default_rng(0)
        none = np.zeros(len(self.algebraic), dtype=bool)
        right = random.choice([-1.0, 1.0], len(none))
        found = []
        for part in PARTS:
            other = self.accurate(part)
            if other is None:
                return none
            try:
                found.append(self._solve(self._perturbed(self._combined(other), random), right))
            except (np.linalg.LinAlgError, RuntimeError):  # singular
                return none
        return np.asarray(np.abs(found[1] - found[0]) <= AGREEMENT * np.abs(found[0]))

    def _combined(self, of: Structure) -> Any:
        """Return the columns of dF/dy for algebraic variables and of dF/dy' for differential variables."""
        return np.where(self.algebraic, of.df_dy, of.df_dyp)

    def solve(self, right: Array) -> Array | None:
        """Solve the linearized F = 0 for derivatives and algebraic variables; None if they are not determined."""
        matrix = self._combined(self)
        return None if self._null(matrix).any() else self._solve(matrix, right)

    @staticmethod
    def _solve(matrix: Array, right: Array) -> Array:
        return np.asarray(np.linalg.solve(matrix, right))

    def _inverse_sizes(self, c: float) -> Array | None:
        """Return the largest entry in each row of the inverse of dF/dy + c dF/dy', or None if it is inaccurate."""
        inverse = self.inverse(c)
        return None if inverse is None else np.asarray(np.abs(inverse).max(axis=1))

    @staticmethod
    def _null(matrix: Array) -> NDArray[np.bool_]:
        """Return a mask of the columns that have a nonzero entry in some vector of the null space."""
        return _null(matrix)

    @staticmethod
    def _has_entries(matrix: Array) -> bool:
        """Return whether each row and each column has a nonzero entry."""
        return bool(matrix.any(axis=0).all() and matrix.any(axis=1).all())

    @staticmethod
    def _perturbed(matrix: Array, random: np.random.Generator) -> Array:
        """Return the matrix with rows scaled to a largest entry of about 1 and with random relative changes."""
        return np.asarray(matrix / np.abs(matrix).max(axis=1, keepdims=True) * _near_one(random, matrix.shape))

    @staticmethod
    def _balanced(matrix: Array) -> Array:
        """Return the matrix with rows and columns scaled so that its nonzero entries are as close to 1 as possible."""
        return _balanced(matrix)


def _near_one(random: np.random.Generator, shape: Any) -> Array:
    return np.asarray(1.0 + PERTURBED * random.standard_normal(shape))


def _inverse(matrix: Array) -> Array | None:
    """Return the inverse, or None if it is inaccurate."""
    rows, columns = np.ones((len(matrix), 1)), np.ones(len(matrix))
    for _ in range(5):
        sizes = np.abs(rows * matrix * columns)
        if not (sizes.max(axis=0).min() > 0.0 and sizes.max(axis=1).min() > 0.0):
            return None
        rows /= np.sqrt(sizes.max(axis=1, keepdims=True))
        columns /= np.sqrt(sizes.max(axis=0))
    scaled = rows * matrix * columns
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        return None
    # Error of each entry, in units of the rounding error. Unlike the condition number, this error is small for permuted
    # triangular matrices of any scale.
    sizes = np.abs(inverse)
    errors = sizes @ np.abs(scaled) @ sizes
    if not (errors.max(axis=1) < CONDITION * sizes.max(axis=1)).all():
        return None
    return columns[:, None] * inverse * rows.T


def _balanced(matrix: Array) -> Array:
    """Return the matrix with rows and columns scaled so that its nonzero entries are as close to 1 as possible.

    The sum of the squared logarithms of the entries is minimal (Curtis and Reid 1972), so the result does not depend on
    units.
    """
    is_nonzero = matrix != 0.0
    logarithms = np.log(np.abs(matrix), out=np.zeros_like(matrix), where=is_nonzero)
    counts = [np.diag(is_nonzero.sum(axis=axis)) for axis in (1, 0)]
    sums = [logarithms.sum(axis=axis) for axis in (1, 0)]
    normal = np.block([[counts[0], is_nonzero], [is_nonzero.T, counts[1]]]).astype(float)
    rows, columns = np.split(np.linalg.lstsq(normal, -np.concatenate(sums), rcond=None)[0], [len(matrix)])
    scaled = np.where(is_nonzero, logarithms + rows[:, None] + columns, 0.0)
    return np.asarray(np.sign(matrix) * np.exp(scaled))


def _null(matrix: Array) -> NDArray[np.bool_]:
    """Return a mask of the columns that have a nonzero entry in some vector of the null space."""
    if not matrix.size:
        return np.zeros(matrix.shape[1], dtype=bool)
    for axis in (1, 0):
        scale = np.abs(matrix).max(axis=axis, keepdims=True)
        matrix = matrix / np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.svd(matrix)[1:]
    rank = int((values > RANK * values[0]).sum())
    return (np.abs(vectors[rank:]) > PART).any(axis=0)
