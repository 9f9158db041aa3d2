"""Structure of large systems that have a sparsity pattern. Requires the sparse factorizations of SciPy."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._structure import PART, RANK, Array, Pattern, Structure, _near_one

try:
    import scipy.sparse as sparse
    from scipy.sparse.linalg import splu
except ImportError:
    sparse = None

Indices = NDArray[np.int64]

# Largest number of variables, and largest number of residuals per matrix. Checks of 8000 variables in 3D take 6 s.
LARGEST = 5000
MOST_GROUPS = 100

# Number of random vectors from which null spaces and the sizes of inverses are estimated.
SAMPLES = 4

# Number of iterations after which the components for singular values above 3 RANK are negligible.
REPEATS = 3

# Relative change of a matrix, and largest relative change of the inverse that it may cause.
PERTURBATION, CHANGE = 1e-13, 1e-3

# Number of sweeps that scale rows and columns in turn.
SWEEPS = 50


class SparseStructure(Structure):
    """Sparse matrices dF/dy and dF/dy' at (t, y, yp).

    Null spaces and the sizes of inverses are estimated from random vectors, which are the same in
    every call.
    """

    @classmethod
    def is_possible(cls, n: int) -> bool:
        return sparse is not None and n <= LARGEST

    def __init__(
        self,
        residual: Callable[[float, Array, Array], Any],
        t: float,
        y: Array,
        yp: Array,
        tolerance: Array,
        pattern: Pattern,
        is_accurate: bool = False,
        part: float = 1.0,
    ) -> None:
        n = len(y)
        offsets, rows = pattern
        columns = np.repeat(np.arange(n), np.diff(offsets))
        groups = _independent_columns(offsets, rows)
        if groups.max() >= MOST_GROUPS:
            raise ValueError
        self._set_state(y, yp, tolerance, is_accurate, part)
        base = self._evaluate(residual, t, y, yp)

        def quotients(sizes: Array, wanted: Indices, rate: bool = False) -> Array:
            values = np.full(len(rows), np.nan)
            steps = sizes if rate else sizes * self.signs
            for group in np.unique(groups[wanted]):
                increments = np.where(groups == group, steps, 0.0)

                def moved(factor: float, increments: Array = increments) -> Array:
                    state = [y.copy(), yp.copy()]
                    state[rate] += factor * increments
                    return self._evaluate(residual, t, *state)

                change = self._change(moved, base)
                own = groups[columns] == group
                values[own] = change[rows[own]] / steps[columns[own]]
            return values

        def enlarged(sizes: Array, wanted: Indices) -> Array:
            with suppress(Exception):  # outside of the domain of F
                return quotients(np.where(np.isin(np.arange(n), wanted), sizes, self.sizes[False]), wanted)
            return np.full(len(rows), np.nan)

        def matrix(values: Array) -> Any:
            found = sparse.csc_matrix((values, rows, offsets), shape=(n, n), copy=True)
            found.eliminate_zeros()
            return found

        by_y, by_yp = (quotients(self.sizes[rate], np.arange(n), rate) for rate in (False, True))
        self.df_dy, self.df_dyp = matrix(by_y), matrix(by_yp)
        self.df_dy = matrix(self._resolved(by_y, (rows, columns), enlarged))
        self.algebraic = self._is_algebraic()

    def _is_algebraic(self) -> NDArray[np.bool_]:
        return np.asarray(np.diff(self.df_dyp.indptr) == 0)

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite(self.df_dy.data).all() and np.isfinite(self.df_dyp.data).all())

    @property
    def without_rates(self) -> NDArray[np.bool_]:
        return np.asarray(self.df_dyp.getnnz(axis=1) == 0)

    @property
    def differential(self) -> Array:
        rows = np.maximum(*(abs(part).max(axis=1).toarray().ravel() for part in (self.df_dy, self.df_dyp)))
        entries = abs(self.df_dyp).tocoo()
        found = np.zeros(self.df_dyp.shape[1], dtype=bool)
        found[entries.col[entries.data > RANK * rows[entries.row]]] = True
        return found

    def inverse(self, c: float) -> None:
        """Return None: the inverse of a large matrix is not computed."""

    def contradiction(self, evaluate: Callable[[Array], Array], tolerance: Array) -> None:
        """Return None: combinations of equations are examined only in small systems."""

    def _combined(self, of: Structure) -> Any:
        is_algebraic = self.algebraic.astype(float)
        return (of.df_dy @ sparse.diags(is_algebraic) + of.df_dyp @ sparse.diags(1.0 - is_algebraic)).tocsc()

    @staticmethod
    def _has_entries(matrix: Any) -> bool:
        return bool(matrix.getnnz(axis=0).all() and matrix.getnnz(axis=1).all())

    @staticmethod
    def _perturbed(matrix: Any, random: np.random.Generator) -> Any:
        found = (sparse.diags(1.0 / abs(matrix).max(axis=1).toarray().ravel()) @ matrix).tocsc()
        found.data *= _near_one(random, found.data.shape)
        return found

    @staticmethod
    def _solve(matrix: Any, right: Array) -> Array:
        return np.asarray(splu(matrix).solve(right))

    def _inverse_sizes(self, c: float) -> Array | None:
        matrix = (self.df_dy + c * self.df_dyp).tocsc()
        scales = _scales(matrix, lambda sizes, groups, n: _largest(sizes, groups, n) ** 0.5, 5)
        if scales is None:
            return None
        rows, columns = scales
        scaled = (sparse.diags(rows) @ matrix @ sparse.diags(columns)).tocsc()
        random = np.random.default_rng(0)
        right = rows[:, None] * random.choice([-1.0, 1.0], (len(rows), SAMPLES))
        found = []
        for _ in range(2):
            try:
                found.append(splu(scaled).solve(right))
            except RuntimeError:  # singular
                return None
            scaled = scaled.copy()
            scaled.data *= 1.0 + PERTURBATION * random.standard_normal(len(scaled.data))
        sizes = np.abs(found).max(axis=2)
        if not (np.abs(found[1] - found[0]).max(axis=1) <= CHANGE * sizes[0]).all():
            return None
        return np.asarray(columns * sizes[0])

    @staticmethod
    def _null(matrix: Any) -> NDArray[np.bool_]:
        n_rows, n_columns = matrix.shape
        if not (n_rows and n_columns):
            return np.zeros(n_columns, dtype=bool)
        rows = abs(matrix).max(axis=1).toarray().ravel()
        matrix = sparse.diags(1.0 / np.where(rows > 0.0, rows, 1.0)) @ matrix
        # The columns are scaled to length 1, so that ε² below is not lost in the rounding errors of AᵀA.
        columns = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=0)).ravel())
        matrix = matrix @ sparse.diags(1.0 / np.where(columns > 0.0, columns, 1.0))
        # The iteration x ← ε² (AᵀA + ε²)⁻¹ x removes the components of random vectors outside of the null space of A.
        regular = RANK**2 * sparse.identity(n_columns)
        extended = sparse.bmat([[sparse.identity(n_rows), matrix], [matrix.T, -regular]], format="csc")
        try:
            factors = splu(extended)
        except RuntimeError:  # singular by rounding
            return np.zeros(n_columns, dtype=bool)
        vectors = np.random.default_rng(0).standard_normal((n_columns, SAMPLES))
        for _ in range(REPEATS):
            right = np.vstack([np.zeros((n_rows, SAMPLES)), -(RANK**2) * vectors])
            vectors = factors.solve(right)[n_rows:]
        return np.asarray((np.abs(vectors) > PART / np.sqrt(n_columns)).any(axis=1))

    @staticmethod
    def _balanced(matrix: Any) -> Any:
        scales = _scales(matrix, _geometric_mean, SWEEPS)
        if scales is None:
            return matrix
        return sparse.diags(scales[0]) @ matrix @ sparse.diags(scales[1])


def _scales(matrix: Any, size: Callable[[Array, Indices, int], Array], sweeps: int) -> tuple[Array, Array] | None:
    """Return factors that scale the `size` of each row and column to 1, or None if a row or column has no entries."""
    entries = matrix.tocoo()
    entries.eliminate_zeros()
    factors = [np.ones(n) for n in entries.shape]
    places = (entries.row, entries.col)
    if any(len(np.unique(place)) < n for place, n in zip(places, entries.shape, strict=True)):
        return None
    for _ in range(sweeps):
        for axis in (0, 1):
            sizes = np.abs(entries.data) * factors[0][entries.row] * factors[1][entries.col]
            factors[axis] /= size(sizes, places[axis], entries.shape[axis])
    return factors[0], factors[1]


def _largest(sizes: Array, groups: Indices, n: int) -> Array:
    found = np.zeros(n)
    np.maximum.at(found, groups, sizes)
    return found


def _geometric_mean(sizes: Array, groups: Indices, n: int) -> Array:
    return np.asarray(np.exp(np.bincount(groups, np.log(sizes), n) / np.bincount(groups, minlength=n)))


def _independent_columns(offsets: Indices, rows: Indices) -> Indices:
    """Return a group for each column, such that no two columns of a group have a row in common."""
    n = len(offsets) - 1
    used: list[set[int]] = [set() for _ in range(n)]
    groups = np.zeros(n, dtype=np.int64)
    for column in range(n):
        own = rows[offsets[column] : offsets[column + 1]]
        taken = set().union(*(used[row] for row in own))
        group = next(k for k in range(len(taken) + 1) if k not in taken)
        groups[column] = group
        for row in own:
            used[row].add(group)
    return groups
