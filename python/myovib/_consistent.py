"""Consistent initial values of mechanical systems of index 3."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["consistent_start"]

Array = NDArray[np.float64]

# Steps of Newton's method.
ITERATIONS = 30
# Relative size of central differences: the cube root of rounding.
DIFFERENCE = 6e-6


def consistent_start(
    constraint: Callable[[float, Array], Any], q: ArrayLike, v: ArrayLike, t: float = 0.0
) -> tuple[Array, Array]:
    """Move positions and velocities onto a position constraint g(t, q) = 0.

    The change of each is the smallest possible: q by Newton's method, v so that
    dg/dt + (dg/dq) v = 0. Derivatives are computed by central differences, which have
    a relative error of about 1e-10.

    Parameters
    ----------
    constraint : callable
        ``constraint(t, q)`` returns g, a number or an array.
    q, v : array_like, shape (n,)
        Positions and velocities.
    t : float
        Time.

    Returns
    -------
    q, v : ndarray, shape (n,)

    Raises
    ------
    ValueError
        No positions near `q` satisfy the constraint.

    Examples
    --------
    >>> consistent_start(lambda t, q: q @ q - 1.0, [1.1, 0.0], [0.5, 2.0])
    (array([1., 0.]), array([0., 2.]))
    """
    position, velocity = np.array(q, dtype=float), np.array(v, dtype=float)
    if position.ndim != 1 or velocity.shape != position.shape:
        raise ValueError(
            f"q and v have the shapes {position.shape} and {velocity.shape}: must be equal vectors"
        )
    size = np.abs(position).max() or 1.0

    def evaluate(t: float, q: Array) -> Array:
        return np.atleast_1d(np.asarray(constraint(t, q), dtype=float))

    def gradients(q: Array) -> Array:
        steps = np.eye(len(q)) * DIFFERENCE * size
        columns = [evaluate(t, q + s) - evaluate(t, q - s) for s in steps]
        return np.array(columns).T / (2.0 * DIFFERENCE * size)

    last = np.inf
    for _ in range(ITERATIONS):
        move = np.linalg.lstsq(gradients(position), evaluate(t, position))[0]
        position = position - move
        moved = np.abs(move).max()
        # The convergence is fast until rounding ends it.
        if moved <= 1e-10 * size and moved >= 0.1 * last or moved == 0.0:
            break
        last = moved
    else:
        raise ValueError(f"constraint: no positions near q satisfy it; the last change was {last:.1e}")
    dt = DIFFERENCE * size / (np.abs(velocity).max() or 1.0)
    of_time = (evaluate(t + dt, position) - evaluate(t - dt, position)) / (2.0 * dt)
    matrix = gradients(position)
    return position, velocity - np.linalg.lstsq(matrix, matrix @ velocity + of_time)[0]
