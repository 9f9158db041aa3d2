"""Sensitivities of a scene's outputs, and fits of its parameters to measurements."""

from __future__ import annotations

import csv
import html
import io
import json
from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._run import Probe, _Stored

__all__ = ["Experiment", "FitResult", "SensitivityResult"]

Array = NDArray[np.float64]
#: Measurements of one experiment: a file, or columns by name.
Data = str | PathLike[str] | Mapping[str, ArrayLike]
#: Measurements, optionally with changed values of the scene.
Experiment = Data | tuple[Data, Mapping[str, Any]]


class SensitivityResult(_Stored):
    """Outputs of a scene and their derivatives with respect to its parameters. It can be pickled.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Times, or load factors of a static analysis.
    outputs, parameters : list of str
    values : ndarray, shape (m, outputs)
    derivatives : ndarray, shape (m, outputs, parameters)
        For the bulk modulus κ, the derivatives are with respect to 1/κ.
    scales : ndarray, shape (parameters,)
        Typical sizes of the parameters.
    importance : ndarray, shape (outputs, parameters)
        For each output and parameter: the RMS over time of scale × derivative, divided by the RMS of
        the output. NaN for an output that is always zero.
    cost : dict
        Numbers of steps, factorizations and solves in the run.
    folder : Path
        Folder of the files.
    """

    def __init__(self, folder: Path, document: dict[str, Any], temporary: Any) -> None:
        self.folder, self._temporary = folder, temporary
        self.outputs: list[str] = document["outputs"]
        self.parameters: list[str] = document["parameters"]
        self.scales = _numbers(document["scales"])
        self.importance = _numbers(document["importance"])
        self.cost: dict[str, int] = document["cost"]
        n = len(self.outputs)
        rows = _numbers(document["rows"]).reshape(-1, len(document["columns"]))
        self.t, self.values = rows[:, 0], rows[:, 1 : n + 1]
        self.derivatives: Array = rows[:, n + 1 :].reshape(-1, n, len(self.parameters))

    def __repr__(self) -> str:
        outputs, parameters = ", ".join(self.outputs), ", ".join(self.parameters)
        return f"SensitivityResult({outputs} by {parameters}; {len(self.t)} times)"

    def _repr_html_(self) -> str:
        rows = [
            [output, *(f"{share:.3e}" for share in shares)]
            for output, shares in zip(self.outputs, self.importance)
        ]
        return _table(["p · du/dp relative to u (rms)", *self.parameters], rows)


def by_element(document: dict[str, Any]) -> dict[str, Array]:
    """Return the sensitivities of each output to the stiffness of each element, from the document of a stiffness map."""
    return {output["name"]: _numbers(output["elements"]) for output in document["outputs"]}


class FitResult(_Stored):
    """Result of a fit. It can be pickled.

    Attributes
    ----------
    document : dict
        Content of ``fit.json``.
    converged : bool
        Whether the search converged and the residuals are compatible with the noise; see
        ``document["outcome"]``.
    message : str
        Reason why the fit ended.
    values, standard_errors : dict of float
        Values and standard errors by parameter name; for the bulk modulus κ, they are those of 1/κ. The
        error is None for a parameter that does not affect any measurement.
    intervals : dict of tuple
        95 % intervals. They are computed from the profile likelihood if it was requested, otherwise from
        the standard errors. An open end is None.
    correlation : ndarray, shape (n, n)
    deviation : float
        Standard deviation of the residuals. It is about 1 if the noise was given and the model
        fits the data.
    unknown : list of str
        Combinations of parameters that the measurements do not determine.
    residuals : list of dict
        For each measurement: ``experiment`` (counted from 1), ``output``, ``t`` (or ``f``,
        ``load``), ``measured``, ``fitted`` and ``residual``.
    history : Mapping
        Table of the iterations with the columns ``iteration``, ``runs``, ``part``, ``cost`` and
        the parameters.
    folder : Path
        Folder of the files.
    """

    def __init__(
        self, folder: Path, document: dict[str, Any], scene: Any, temporary: Any
    ) -> None:
        self.folder, self.document, self._temporary = folder, document, temporary
        self._scene = scene
        self.history = Probe._read(folder / "history.csv")
        parameters = document["parameters"]
        for parameter in parameters:
            scene._assign(parameter["set"])

        def each(key: str) -> dict[str, Any]:
            return {parameter["name"]: parameter[key] for parameter in parameters}

        self.converged: bool = document["converged"]
        self.message: str = document["ended"]
        self.values: dict[str, float] = each("value")
        self.standard_errors: dict[str, float] = each("standard_error")
        profiles = {name: interval for name, interval in each("profile_interval").items() if interval}
        self.intervals = {
            name: tuple(interval) for name, interval in (each("interval") | profiles).items()
        }
        self.correlation = _numbers(document["correlation"])
        self.deviation: float = document["deviation"]
        self.unknown: list[str] = document["unknown"]
        self.residuals: list[dict[str, Any]] = document["residuals"]

    def scene(self) -> Any:
        """Return the scene with the fitted values."""
        return self._scene.copy()

    def __repr__(self) -> str:
        found = ", ".join(f"{name} = {value:.6g}" for name, value in self.values.items())
        return f"FitResult({self.message}: {found})"

    def _repr_html_(self) -> str:
        rows = [
            [name, f"{value:.6e}", _shown(self.standard_errors[name]), *map(_shown, self.intervals[name])]
            for name, value in self.values.items()
        ]
        heads = ["parameter", "value", "standard error", "95 % from", "to"]
        return f"<b>{html.escape(self.message)}</b>" + _table(heads, rows)


def experiments(
    data: Experiment | list[Experiment], folder: Path
) -> list[tuple[Path, Mapping[str, Any]]]:
    """Return the file and the changed values of each experiment. Data in memory are first written to files in `folder`."""
    files = []
    for k, one in enumerate(data if isinstance(data, list) else [data], start=1):
        measured, changes = one if isinstance(one, tuple) else (one, {})
        if isinstance(measured, (str, PathLike)):
            path = Path(measured)
        else:  # a mapping or a `pandas.DataFrame`
            columns = {str(name): measured[name] for name in measured.keys()}
            path = folder / f"experiment-{k}.csv"
            path.write_text(_csv(columns), encoding="utf-8")
        files.append((path, changes))
    return files


def _csv(columns: Mapping[str, ArrayLike]) -> str:
    """Return a table as text, with empty cells for NaN and masked entries."""
    arrays = [_measured(name, column) for name, column in columns.items()]
    for name, array in zip(columns, arrays):
        if array.shape != arrays[0].shape or array.ndim != 1:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(columns, arrays))
            raise ValueError(f"the columns of the data must have equal lengths: {shapes}")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(["" if np.isnan(x) else repr(float(x)) for x in row] for row in zip(*arrays))
    return text.getvalue()


def _measured(name: str, column: ArrayLike) -> Array:
    """Return a column as real numbers, with NaN for masked and missing entries."""
    kind = np.asarray(column).dtype.kind
    if kind not in "biufO":
        kinds = {"c": "complex numbers", "M": "dates", "m": "time differences"}
        found = kinds.get(kind, "text")
        raise ValueError(f"column {name!r} of the data must have real numbers, not {found}")
    try:
        if hasattr(column, "to_numpy"):  # a pandas column, which may contain pandas' missing values
            return column.to_numpy(dtype=float, na_value=np.nan)
        return np.ma.filled(np.ma.asarray(column).astype(float), np.nan)
    except (TypeError, ValueError) as error:  # from an entry of an array of objects
        raise ValueError(f"column {name!r} of the data must have real numbers: {error}") from None


def _numbers(values: Iterable[Any]) -> Array:
    """Return the numbers of a document as an array, with NaN for null."""
    return np.array(values, dtype=float)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.4e}"


def _table(heads: list[str], rows: list[list[str]]) -> str:
    def row(tag: str, words: list[str]) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(word)}</{tag}>" for word in words) + "</tr>"

    return "<table>" + row("th", heads) + "".join(row("td", words) for words in rows) + "</table>"
