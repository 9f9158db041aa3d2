"""Consistent initial values of mechanical systems of index 3."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arguments import _vector

__all__ = ["consistent_start"]

Array = NDArray[np.float64]

# Maximum number of steps of Newton's method.
ITERATIONS = 30
# Relative increment of central differences: the cube root of the rounding error.
DIFFERENCE = 6e-6
# Singular values below this fraction of the largest count as zero. The relative errors of gradients are much smaller.
RANK = 1e-7
# Largest residual at which a constraint is considered satisfied, relative to its gradient times the size of the
# positions. Terms of the constraint may be larger than this product, for example if q contains small displacements.
ROUNDING = 1e-8
# Largest relative residual at which the derivative of a constraint is considered satisfied.
RATE = 1e-6


def consistent_start(
    constraint: Callable[[float, Array], Any],
    q: ArrayLike,
    v: ArrayLike,
    t: float = 0.0,
    time_scale: float = 1.0,
) -> tuple[Array, Array]:
    """Move positions and velocities onto a position constraint g(t, q) = 0.

    Both q and v are changed as little as possible: q by Newton's method, and v such that
    dg/dt + (dg/dq) v = 0. Derivatives are computed by central differences, which have a
    relative error of about 1e-10. Constraints may be redundant.

    Parameters
    ----------
    constraint : callable
        ``constraint(t, q)`` returns g, a number or an array.
    q, v : array_like, shape (n,)
        Positions and velocities.
    t : float
        Time.
    time_scale : float
        Time in which g changes appreciably, for example 1/(2 pi f) for a support that
        oscillates with the frequency f. Differences in time have increments of 6e-6
        times this value.

    Returns
    -------
    q, v : ndarray, shape (n,)

    Raises
    ------
    ValueError
        If an argument is invalid, if no positions near `q` satisfy the constraint, or
        if no velocities satisfy its derivative.

    Examples
    --------
    >>> consistent_start(lambda t, q: q @ q - 1.0, [1.1, 0.0], [0.5, 2.0])
    (array([1., 0.]), array([0., 2.]))
    """
    position = _vector("q", q).copy()
    velocity = _vector("v", v, len(position))
    if not np.isfinite(t):
        raise ValueError(f"t = {t}: must be finite")
    if not 0 < time_scale < np.inf:
        raise ValueError(f"time_scale = {time_scale}: must be above 0 and finite")
    size = np.abs(position).max() or 1.0

    def evaluate(t: float, q: Array) -> Array:
        values = np.atleast_1d(np.asarray(constraint(t, q), dtype=float))
        if values.ndim != 1 or not np.isfinite(values).all():
            raise ValueError(f"constraint returned {values} at q = {q}: must be finite numbers")
        return values

    def gradients(q: Array) -> tuple[Array, Array]:
        """Return dg/dq with each row divided by its norm, and these norms."""
        steps = np.eye(len(q)) * DIFFERENCE * size
        columns = [evaluate(t, q + s) - evaluate(t, q - s) for s in steps]
        matrix = np.array(columns).T / (2.0 * DIFFERENCE * size)
        sizes = np.linalg.norm(matrix, axis=1)
        sizes[sizes == 0.0] = 1.0
        return matrix / sizes[:, None], sizes

    last = np.inf
    for _ in range(ITERATIONS):
        matrix, sizes = gradients(position)
        move = np.linalg.lstsq(matrix, evaluate(t, position) / sizes, rcond=RANK)[0]
        position = position - move
        moved = np.abs(move).max()
        # Convergence is fast until rounding errors stop it.
        if moved <= 1e-10 * size and moved >= 0.1 * last or moved == 0.0:
            break
        last = moved
    matrix, sizes = gradients(position)
    errors = np.abs(evaluate(t, position)) / sizes
    if (errors > ROUNDING * max(size, np.abs(position).max())).any():
        raise ValueError(
            f"constraint: no positions near q satisfy it; the error is {errors.max():.1e} in units of q"
        )
    step = max(DIFFERENCE * time_scale, np.spacing(abs(t)))
    after, before = t + step, t - step
    of_time = (evaluate(after, position) - evaluate(before, position)) / (after - before) / sizes
    rate = matrix @ velocity + of_time
    moved_velocity = velocity - np.linalg.lstsq(matrix, rate, rcond=RANK)[0]
    errors = np.abs(matrix @ moved_velocity + of_time)
    if (errors > RATE * (np.abs(of_time) + np.abs(velocity).max() + size / time_scale)).any():
        raise ValueError(
            f"constraint: no velocities satisfy its derivative; the error is {errors.max():.1e} in "
            "units of v. Remove contradictory constraints, or reduce `time_scale`"
        )
    return position, moved_velocity
