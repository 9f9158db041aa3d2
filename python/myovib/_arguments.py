"""Checks and conversions of the arguments of `solve_dae`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._solution import Array, Function


class _Calls:
    """Number of calls of a function."""

    count = 0


def _with(function: Callable[..., Any], args: Sequence[Any], name: str, calls: _Calls | None = None) -> Function:
    """Return a function of t, y, yp that calls `function` with copies of y and yp and with the additional arguments.

    `function` may therefore change its arguments. If `calls` is given, it counts the calls.
    """

    def call(t: float, y: Array, yp: Array) -> Any:
        if calls is not None:
            calls.count += 1
        try:
            return function(t, y.copy(), yp.copy(), *args)
        except TypeError as error:
            is_of_call = error.__traceback__ is not None and error.__traceback__.tb_next is None
            if not is_of_call:
                raise
            raise TypeError(f"{error}; called as {name}(t, y, yp{', *args' if args else ''})") from None

    return call


def _in_bytes(function: Function, n: int, name: str = "residual") -> Any:
    """Return the function in the form that the native module requires: arrays are passed as bytes."""

    def call(t: float, y: bytearray, yp: bytearray) -> bytes:
        answer = function(t, np.frombuffer(y), np.frombuffer(yp))
        values = _real(name, answer)
        if values.shape != (n,):
            if answer is None:
                found = "nothing"
            elif values.ndim == 1:
                found = f"{values.size} values"
            else:
                found = f"an array of shape {values.shape}"
            raise ValueError(f"{name} returned {found}: must be {n} values")
        return values.tobytes()

    return call


def _real(name: str, values: Any) -> Array:
    """Return the values as real numbers. NumPy would drop imaginary parts with only a warning, and would drop masks silently."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name} has masked entries: must be real numbers")
    try:
        numbers = np.asarray(values)
        if not np.iscomplexobj(numbers):
            return np.asarray(numbers, dtype=float)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: must be real numbers: {error}") from error
    raise TypeError(f"{name} has complex values: must be real numbers")


def _vector(name: str, values: ArrayLike, n: int | None = None) -> Array:
    vector = _real(name, values)
    if vector.ndim != 1 or not vector.size or (n is not None and len(vector) != n):
        wanted = "a vector" if n is None else f"a vector of {n} entries"
        raise ValueError(f"{name} has shape {vector.shape}: must be {wanted}")
    if not np.isfinite(vector).all():
        raise ValueError(f"{name} has non-finite entries")
    return vector


def _marks(name: str, marks: Any, n: int) -> list[bool] | None:
    if marks is None:
        return None
    vector = np.asarray(marks, dtype=bool)
    if vector.shape != (n,):
        raise ValueError(f"{name} has shape {vector.shape}: must have {n} entries")
    return vector.tolist()


def _output_times(t_eval: ArrayLike | None, t0: float, t_end: float) -> list[float] | None:
    if t_eval is None:
        return None
    times = _real("t_eval", t_eval)
    sign = np.sign(t_end - t0)
    if not np.isfinite(times).all():
        raise ValueError("t_eval has non-finite entries")
    if times.ndim != 1:
        raise ValueError(f"t_eval has shape {times.shape}: must be a sequence of times")
    if (np.diff(times) * sign < 0).any():
        raise ValueError("t_eval must be sorted in the direction of integration")
    if times.size and (sign * (times[0] - t0) < 0 or sign * (times[-1] - t_end) > 0):
        raise ValueError("t_eval must lie in t_span")
    return times.tolist()


def _number(name: str, value: Any) -> float:
    """Return a real number."""
    if np.ndim(value) != 0:
        raise ValueError(f"{name} = {value}: must be a number")
    return float(_real(name, value))


def _count(name: str, value: Any) -> int | None:
    """Return a positive integer, or None for infinity."""
    number = _number(name, value)
    if number == np.inf:
        return None
    if not (number >= 1 and number.is_integer()):
        raise ValueError(f"{name} = {value}: must be a whole number of at least 1, or inf")
    return int(value)


def _pattern(sparsity: Any, n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the column offsets and row indices of a sparsity pattern."""
    if hasattr(sparsity, "tocoo"):
        coordinates = sparsity.tocoo()
        shape, rows, columns = coordinates.shape, coordinates.row, coordinates.col
    else:
        dense = np.asarray(sparsity)
        shape, (rows, columns) = dense.shape, np.nonzero(np.atleast_2d(dense))[:2]
    if shape != (n, n):
        raise ValueError(f"sparsity has shape {shape}: must be ({n}, {n})")
    entries = np.unique(columns.astype(np.int64) * n + rows)
    offsets = np.searchsorted(entries, np.arange(n + 1) * n)
    return offsets, entries % n


# Number of rows above which the pattern of sparse matrices is used. For fewer rows, full matrices are inexpensive.
LARGE = 200


def _pattern_of_jacobian(
    jacobian: Function, t: float, y: Array, yp: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Return the common pattern of the sparse matrices at the start and at a state nearby; None if they are dense."""
    parts = list(jacobian(t, y, yp))
    if not all(hasattr(part, "tocoo") for part in parts):
        return None
    # At the second state, entries that vanish at the start, for example at rest, are also found.
    steps = 1.0 + 0.618 * np.arange(len(y)) % 1.0
    try:
        nearby = jacobian(t, y + steps * (1.0 + np.abs(y)), yp + steps * (1.0 + np.abs(yp)))
        parts += [part for part in nearby if hasattr(part, "tocoo")]
    except Exception:  # outside of the domain of F
        pass
    # Explicitly stored zeros belong to the pattern.
    coordinates = [part.tocoo() for part in parts]
    rows = np.concatenate([part.row for part in coordinates])
    columns = np.concatenate([part.col for part in coordinates])
    n = len(y)
    if any(part.shape != (n, n) for part in coordinates):
        return None
    entries = np.unique(columns.astype(np.int64) * n + rows)
    return np.searchsorted(entries, np.arange(n + 1) * n), entries % n


class _Jacobian:
    """Wrapper of the user's Jacobian that returns the values in the order of the pattern."""

    def __init__(self, function: Function, pattern: Any, n: int) -> None:
        self.function, self.n = function, n
        self.places: tuple[Any, Any] | None = None
        if pattern is not None:
            offsets, rows = pattern
            self.places = (rows, np.repeat(np.arange(n), np.diff(offsets)))

    def __call__(self, t: float, y: bytearray, yp: bytearray) -> tuple[bytes, bytes]:
        pair = self.function(t, np.frombuffer(y), np.frombuffer(yp))
        if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 or any(np.ndim(part) != 2 for part in pair):
            raise ValueError("jacobian: must return the pair dF/dy, dF/dy'")
        df_dy, df_dyp = pair
        return self._values(df_dy).tobytes(), self._values(df_dyp).tobytes()

    def _values(self, matrix: Any) -> Array:
        sparse = hasattr(matrix, "tocsr")
        if np.iscomplexobj(matrix):
            raise TypeError("jacobian has complex values: must be real numbers")
        matrix = matrix.tocsr() if sparse else np.asarray(matrix, dtype=float)
        if matrix.shape != (self.n, self.n):
            raise ValueError(f"jacobian: shape {matrix.shape}, must be ({self.n}, {self.n})")
        if self.places is None:
            return (matrix.toarray() if sparse else matrix).ravel(order="F")
        values = np.asarray(matrix[self.places], dtype=float).ravel()
        # Later matrices may have additional nonzero entries.
        whole = matrix.count_nonzero() if sparse else np.count_nonzero(matrix)
        if whole > np.count_nonzero(values):
            raise ValueError(
                f"jacobian: {self._outside(matrix, sparse)} is not in `sparsity`: give `sparsity` with "
                "all entries that may become nonzero (by default, it is the pattern of sparse matrices at the start)"
            )
        return values

    def _outside(self, matrix: Any, sparse: bool) -> str:
        """Describe the first entry outside the pattern."""
        assert self.places is not None
        rows, columns = (matrix.tocoo() if sparse else np.asarray(matrix)).nonzero()
        within = np.isin(columns * self.n + rows, self.places[1] * self.n + self.places[0])
        first = np.argmin(within)
        return f"an entry in row {rows[first]}, column {columns[first]} (counted from 0)"


class _Events:
    """All events combined into one function, together with their attributes."""

    def __init__(
        self, events: Function | Sequence[Function] | None, args: Sequence[Any]
    ) -> None:
        if events is None:
            events = []
        if not callable(events) and not (np.iterable(events) and all(map(callable, events))):
            raise TypeError(f"events = {events!r}: must be a function or a sequence of functions")
        given = [events] if callable(events) else list(events)
        self.functions = [_with(f, args, "event") for f in given]
        self.directions = [int(np.sign(getattr(f, "direction", 0))) for f in given]
        self.terminal = [_terminal(k, getattr(f, "terminal", None)) for k, f in enumerate(given)]

    def terminal_after(self, crossings: list[Any]) -> list[int]:
        """Return after how many more occurrences each event ends the integration; 0 if the event does not end it."""
        past = [sum(c[0] == k for c in crossings) for k in range(len(self.functions))]
        return [count and count - done for count, done in zip(self.terminal, past)]

    def values(self, t: float, y: Array, yp: Array) -> list[float]:
        values = [_event_value(k, function(t, y, yp)) for k, function in enumerate(self.functions)]
        if np.isnan(values).any():
            raise ValueError(f"events: event {np.argmax(np.isnan(values))} (counted from 0) is nan at t = {t}")
        return values


def _terminal(k: int, value: Any) -> int:
    """Return which occurrence of event k ends the integration, counted from 1; 0 if none does."""
    value = 0 if value is None else value
    if not (isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)) and value >= 0 and value % 1 == 0):
        wanted = "must be a bool or a whole number of at least 0"
        raise ValueError(f"events: event {k} (counted from 0) has terminal = {value!r}: {wanted}")
    return int(value)


def _event_value(k: int, value: Any) -> float:
    """Return the value of event k: 1 or -1 for a bool."""
    if isinstance(value, (bool, np.bool_)):
        return 1.0 if value else -1.0
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise type(error)(f"events: event {k} (counted from 0) returned {value!r}: must be a number") from error
