"""Results of `solve_dae`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Function = Callable[[float, Array, Array], Any]


@dataclass
class DenseOutput:
    """Solution as a continuous function, with one polynomial per step.

    Attributes
    ----------
    t_min, t_max : float
        Interval covered by the steps.
    """

    _ends: Array  # (steps, 2)
    _samples: Array  # (steps, nodes, n)
    _nodes: Array  # common to all steps, in [-1, 1]

    @property
    def t_min(self) -> float:
        return float(self._ends.min())

    @property
    def t_max(self) -> float:
        return float(self._ends.max())

    def __call__(self, t: ArrayLike) -> Array:
        """Evaluate the solution.

        Parameters
        ----------
        t : float or array_like, shape (m,)
            Times within [t_min, t_max], up to rounding.

        Returns
        -------
        ndarray, shape (n,) or (n, m)

        Raises
        ------
        ValueError
            If a time is outside of the interval, or if `t` has more than one dimension.
        """
        if np.ndim(t) > 1:
            raise ValueError(f"t has shape {np.shape(t)}: must be a time or a vector of times")
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rounding = 4.0 * np.spacing(np.abs(self._ends).max())
        outside = ~((times >= self.t_min - rounding) & (times <= self.t_max + rounding))
        if outside.any():
            raise ValueError(
                f"t = {times[outside][0]}: the solution is only known from {self.t_min} to {self.t_max}"
            )
        sign = 1.0 if self._ends[-1, 1] >= self._ends[0, 0] else -1.0
        step = np.searchsorted(sign * self._ends[:, 1], sign * times)
        step = np.minimum(step, len(self._ends) - 1)
        a, b = self._ends[step].T
        x = (2.0 * times - a - b) / (b - a)
        # The barycentric weights of Chebyshev nodes alternate in sign and are halved at the ends.
        weights = (-1.0) ** np.arange(len(self._nodes))
        weights[[0, -1]] *= 0.5
        distance = x[:, None] - self._nodes
        at_a_node = distance == 0.0
        shares = weights / np.where(at_a_node, 1.0, distance)
        shares[at_a_node.any(axis=1)] = 0.0
        shares[at_a_node] = 1.0
        values = np.einsum("mk,mkn->nm", shares, self._samples[step]) / shares.sum(axis=1)
        return values[:, 0] if np.ndim(t) == 0 else values


@dataclass(repr=False)
class DaeSolution:
    """Result of `solve_dae`, with the same names as in `scipy.integrate.solve_ivp`.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Times: the ends of the steps, or `t_eval`.
    y, yp : ndarray, shape (n, m)
        Solution and its derivative at these times. At index 2 and 3, `yp` is less
        accurate than `y`; therefore, compute accelerations from y and F.
    sol : DenseOutput or None
        Solution as a function of time, if `dense_output` is set and a step was taken.
    t_events : list of ndarray or None
        Times of each event.
    y_events : list of ndarray or None
        Solutions at these times, one per row.
    dy_dp : ndarray, shape (n, parameters, m), or None
        Derivatives of `y` with respect to `parameters`.
    nfev, njev, nlu : int
        Number of evaluations of the residual (including finite differences and checks),
        of evaluations of the Jacobian, and of setups of the linear solver.
    nsteps, nni, netf, ncfn, ngev : int
        Numbers of steps, Newton iterations, error test failures, nonlinear solver
        failures, and event evaluations.
    status : int
        0 if the end of the span was reached; 1 if an event ended the integration; -1 if
        the integrator failed or reached `max_steps`, or if the results may be wrong
        because the equations are singular or have an index above 3.
    message : str
        Description of the status.
    """

    t: Array
    y: Array
    yp: Array
    sol: DenseOutput | None
    t_events: list[Array] | None
    y_events: list[Array] | None
    nfev: int
    njev: int
    nlu: int
    nsteps: int
    nni: int
    netf: int
    ncfn: int
    ngev: int
    status: int
    message: str
    method: str = field(default="bdf")
    dy_dp: Array | None = None

    def __repr__(self) -> str:
        return (
            f"DaeSolution(method={self.method!r}, status={self.status}, message={self.message!r}, "
            f"{self.y.shape[0]} variables at {self.t.size} times, nsteps={self.nsteps})"
        )

    def __getitem__(self, name: str) -> Any:
        """Return an attribute: ``s["t"]`` is ``s.t``, as in SciPy's results."""
        if name not in self.keys():
            raise KeyError(name)
        return getattr(self, name)

    def keys(self) -> list[str]:
        """Return the names of all attributes."""
        return [*self.__dataclass_fields__, "success"]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    @property
    def success(self) -> bool:
        """Whether the end of the span or a terminal event was reached."""
        return self.status >= 0
