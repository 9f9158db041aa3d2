"""Parts of an integration between breaks, and times counted from the start."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class _End(NamedTuple):
    """Break between two parts of an integration, or an end of the span."""

    t: float
    # Last time before the break and first time after it, in the direction of integration.
    before: float
    after: float


# Distance between two breaks, relative to the largest time, below which the breaks are considered to differ only by
# rounding errors.
CLOSE = 1e-12

# Rounding error of a break, relative to its time or to the span, whichever is larger. It is caused, for example, by
# expressions such as k P/2 and t/P. The functions are not evaluated within this distance of a break.
ROUNDING = 4 * np.finfo(float).eps


def _ends_of_parts(breaks: ArrayLike, t0: float, t_end: float) -> list[_End]:
    """Return the ends of the parts between breaks, in the direction of integration.

    Breaks that differ only by rounding errors are treated as one break: the functions are
    evaluated only before the first and after the last of them. A break close to an end of
    the span is moved to this end.
    """
    times = np.unique(np.asarray(breaks, dtype=float))
    if not np.isfinite(times).all():
        raise ValueError("breaks has non-finite entries")
    times = times[(times >= min(t0, t_end)) & (times <= max(t0, t_end))]
    if t_end < t0:
        times = times[::-1]
    span = abs(t_end - t0)
    # The second limit applies to spans much shorter than the start time. Without it, breaks would be ignored.
    close = min(CLOSE * max(abs(t0), abs(t_end), span), 1e-6 * span)
    groups = np.split(times, np.flatnonzero(np.abs(np.diff(times)) > close) + 1)
    first, last = _End(t0, t0, t0), _End(t_end, t_end, t_end)
    inner = []
    for group in groups if times.size else []:
        rounding = min(ROUNDING * max(abs(group[0]), span), 0.25 * close) * np.sign(t_end - t0)
        before = float(np.nextafter(group[0] - rounding, t0))
        after = float(np.nextafter(group[-1] + rounding, t_end))
        if abs(group[0] - t0) <= close:
            first = _End(t0, t0, after)
        elif abs(group[-1] - t_end) <= close:
            last = _End(t_end, before, t_end)
        else:
            inner.append(_End(float(group[0]), before, after))
    return [first, *inner, last]


def _in_part(outputs: list[float], t_from: float, t_to: float, is_first: bool) -> list[float]:
    """Return the output times after `t_from` and up to `t_to`. In the first part, `t_from` is included."""
    sign = 1.0 if t_from < t_to else -1.0
    return [
        t
        for t in outputs
        if sign * (t - t_from) > 0 and sign * (t - t_to) <= 0 or is_first and t == t_from
    ]


def _within(function: Any, limits: tuple[float, float], origin: float = 0.0) -> Any:
    """Return the function for times counted from the origin. These times are clamped to the limits."""
    low, high = min(limits), max(limits)
    return lambda t, y, yp: function(min(max(origin + t, low), high), y, yp)


# Ratio of the start time to the span above which BDF counts times from the start, because BDF rounds the times but not the
# step sizes.
LATE = 1e4


def _is_counted_from_start(family: str, t0: float, span: float) -> bool:
    return family == "bdf" and abs(t0) > LATE * span


def _delay(found: dict[str, Any], origin: float) -> None:
    """Add the origin to all times, and remove steps shorter than the rounding error of these times."""
    found["t"] = (origin + np.frombuffer(found["t"])).tobytes()
    ends = (origin + np.frombuffer(found["segments"])).reshape(-1, 2)
    if len(ends):
        is_longer = ends[:, 0] != ends[:, 1]
        samples = np.frombuffer(found["samples"]).reshape(len(ends), -1)
        found["segments"], found["samples"] = ends[is_longer].tobytes(), samples[is_longer].tobytes()
    found["events"] = [(k, origin + t, y) for k, t, y in found["events"]]
    if found["status"] != 0:
        found["message"] = _counted_from(origin, found["message"])


def _counted_from(origin: float, message: str) -> str:
    """Return the message with a note on the origin of its times."""
    return f"with times counted from t = {origin}: {message}"


def _cut(found: dict[str, Any], rows: slice) -> None:
    """Keep only these rows of the results."""
    n_times = np.frombuffer(found["t"]).size
    for name in ("t", "y", "yp", "dy_dp") if n_times else ():
        found[name] = np.frombuffer(found[name]).reshape(n_times, -1)[rows].tobytes()


def _joined(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Join the results of two successive parts of an integration."""
    last = ("nodes", "status", "message")
    return {name: second[name] if name in last else first[name] + second[name] for name in first}
