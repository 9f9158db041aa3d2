"""Results of runs and sweeps, read from their folders."""

from __future__ import annotations

import base64
import csv
import html
import json
import tempfile
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

__all__ = ["Fields", "Probe", "RunResult", "SweepResult"]

Array = NDArray[np.float64]


class Probe(Mapping[str, Array]):
    """Table of a probe with named columns. The first is the time ``t``, or the frequency ``f`` for a response."""

    def __init__(self, names: list[str], rows: Array) -> None:
        self._names, self._rows = names, rows

    @classmethod
    def _read(cls, path: Path) -> Probe:
        with path.open(encoding="utf-8", newline="") as file:
            lines = csv.reader(file)
            names = next(lines)
            rows = [[float(word) for word in line] for line in lines]
        return cls(names, np.array(rows).reshape(-1, len(names)))

    def __getitem__(self, name: str) -> Array:
        try:
            return self._rows[:, self._names.index(name)]
        except ValueError:
            raise KeyError(f"{name!r}: the columns are {', '.join(self._names)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def amplitude(self, name: str) -> Array:
        """Return the amplitude of a value of a response, such as ``"u_y"``."""
        return self[f"{name}_amplitude"]

    def phase(self, name: str) -> Array:
        """Return the phase of a value of a response, in degrees. A value with a positive phase leads the load."""
        return self[f"{name}_phase"]

    def complex(self, name: str) -> NDArray[np.complex128]:
        """Return the complex amplitude of a value of a response."""
        return self[f"{name}_re"] + 1j * self[f"{name}_im"]

    def frame(self) -> Any:
        """Return the table as a `pandas.DataFrame`, with the time or the frequency as the index."""
        import pandas

        return pandas.DataFrame(self._rows, columns=self._names).set_index(self._names[0])

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Plot columns (by default all) against time or frequency, and return Matplotlib's axes."""
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure().subplots()
        for name in names or self._names[1:]:
            ax.plot(self._rows[:, 0], self[name], label=name)
        ax.set_xlabel(LABELS.get(self._names[0], self._names[0]))
        ax.legend()
        return ax

    def __repr__(self) -> str:
        return f"Probe({', '.join(self._names)}; {len(self._rows)} rows)"


#: Labels of the first columns of probes.
LABELS = {"t": "time, s", "f": "frequency, Hz"}


class Fields:
    """Fields on the mesh, stored as files for ParaView.

    ``fields[k]`` returns the arrays at the stored time with the index `k`. `field` and `mesh`
    return the fields at the stored time nearest to a given time.

    Attributes
    ----------
    times : ndarray, shape (m,)
    files : list of Path
    """

    def __init__(self, times: Array, files: list[Path]) -> None:
        self.times, self.files = times, files

    @classmethod
    def _of(cls, folder: Path) -> Fields | None:
        path = folder / "fields.pvd"
        if not path.exists():
            return None
        entries = ElementTree.parse(path).getroot().iter("DataSet")
        pairs = [(float(e.attrib["timestep"]), folder / e.attrib["file"]) for e in entries]
        return cls(np.array([t for t, _ in pairs]), [file for _, file in pairs])

    def __len__(self) -> int:
        return len(self.files)

    def __repr__(self) -> str:
        return f"Fields({len(self)} times from {self.times[0]:g} to {self.times[-1]:g} s)"

    def field(self, name: str, t: float | None = None) -> NDArray[Any]:
        """Return a field at the stored time nearest to `t` (by default the last), with one row per point.

        Raises
        ------
        KeyError
            If the field is unknown.
        ValueError
            If `t` is before the first or after the last stored time by more than the largest interval
            between stored times.
        """
        arrays = self[self._nearest(t)]
        if name not in arrays:
            raise KeyError(f"{name!r}: the fields are {', '.join(sorted(arrays))}")
        return arrays[name]

    def mesh(self, t: float | None = None) -> Any:
        """Return the mesh and the fields at the stored time nearest to `t` (by default the last).

        Returns
        -------
        pyvista.UnstructuredGrid
            ``mesh.warp_by_vector("u").plot(scalars="p")`` draws the deformed body. Requires PyVista.
        """
        import pyvista

        return pyvista.read(self.files[self._nearest(t)])

    def _nearest(self, t: float | None) -> int:
        if t is None:
            return -1
        first, last = self.times[0], self.times[-1]
        # The margin is at least the rounding error of the times in the file.
        margin = np.diff(self.times).max(initial=1e-9 * abs(last))
        if not first - margin <= t <= last + margin:
            raise ValueError(f"t = {t}: the stored times are from {first} to {last}")
        return int(np.abs(self.times - t).argmin())

    def __getitem__(self, k: int) -> dict[str, NDArray[Any]]:
        """Return the fields at the stored time with the index `k`.

        Returns
        -------
        dict of ndarray
            ``points`` (n, 3), ``cells`` (m, nodes of a cell), and each field that the
            scene requests, with one row per point.
        """
        arrays = {}
        for array in ElementTree.parse(self.files[k]).getroot().iter("DataArray"):
            # The values are preceded by their length, in eight bytes.
            content = base64.b64decode(array.text or "")[8:]
            values = np.frombuffer(content, dtype=KINDS[array.attrib["type"]])
            width = int(array.attrib.get("NumberOfComponents", 1))
            arrays[array.attrib["Name"]] = values if width == 1 else values.reshape(-1, width)
        n_cells = len(arrays.pop("offsets"))
        arrays.pop("types")
        arrays["cells"] = arrays.pop("connectivity").reshape(n_cells, -1)
        return arrays


class Modes(list[dict[str, Any]]):
    """Lowest modes of a body, one dict per mode.

    ``participation`` contains the participation factors φᵀ M r, in √kg (in the plane √(kg/m)). Here, r
    is a unit translation along an axis, and the shapes φ satisfy φᵀ M φ = 1. ``effective_mass``
    contains the squares of these factors.

    Attributes
    ----------
    points : ndarray
        Coordinates of the nodes (m), one row per node.
    mass : float
        Mass of the body (kg; in the plane kg/m).
    preload_time : float or None
        Time (s) at which the loads are evaluated for the equilibrium about which the body vibrates;
        None if it vibrates about rest.
    """

    def __init__(self, document: dict[str, Any], arrays: bytes) -> None:
        body = document["muscles"][0]
        super().__init__(body["modes"])
        self.mass, self.preload_time = body["mass"], document["preload_time"]
        values = np.frombuffer(arrays)
        dimension = len(self[0]["participation"])
        values = values.reshape(len(self) + 1, -1, dimension)
        self.points, self._shapes = values[0], values[1:]

    def shape(self, k: int) -> NDArray[Any]:
        """Return the displacement of the nodes in the mode ``self[k]``, one row per node, scaled so that φᵀ M φ = 1."""
        return self._shapes[k]


#: NumPy types of the little-endian numbers in VTU files.
KINDS = {"Float64": "<f8", "Int64": "<i8"}

COUNTS = (
    "steps",
    "error_test_failures",
    "step_solve_failures",
    "newton_iterations",
    "residual_evaluations",
    "jacobian_evaluations",
    "linear_setups",
    "t_reached",
    "constraint_drift",
    "cpu_seconds",
)


class _Stored:
    """Result in a folder. Its temporary folder, if any, is not pickled."""

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_temporary": None}


class RunResult(_Stored):
    """Result of a run. It can be pickled, but the files of its fields are not included.

    Attributes
    ----------
    outcome : str
        ``"finished"`` or ``"stopped"``; ``document["reason"]`` is the reason for a stop.
    document : dict
        Content of ``run.json``.
    probes : dict of Probe
        Tables of the probes, by name.
    notes : list of str
        Warnings and corrections of the run.
    folder : Path
        Folder of the files.
    """

    def __init__(
        self,
        folder: Path,
        document: dict[str, Any],
        probes: dict[str, Probe],
        notes: list[str],
        temporary: tempfile.TemporaryDirectory[str] | None,
    ) -> None:
        self.folder, self.document, self.probes = folder, document, probes
        self.notes, self._temporary = notes, temporary

    @classmethod
    def _of(cls, folder: Path, notes: list[str], temporary: Any) -> RunResult:
        document = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        is_response = document["analysis"] == "response"
        probes_of = document["probes"] if is_response else document["scene"].get("probe", [])
        names = [probe["name"] for probe in probes_of if document["analysis"] != "modes"]
        probes = {name: Probe._read(folder / f"{name}.csv") for name in names}
        return cls(folder, document, probes, notes, temporary)

    @property
    def outcome(self) -> str:
        return self.document["outcome"]

    @property
    def success(self) -> bool:
        """Whether the run reached its end time or a ``[[stop]]`` condition of the scene."""
        return self.outcome == "finished" or self.document.get("reason") == "event"

    @property
    def statistics(self) -> dict[str, Any]:
        """Counters and final values of the integration."""
        return {name: self.document[name] for name in COUNTS if self.document.get(name) is not None}

    @property
    def fields(self) -> Fields | None:
        """Fields, or None if the scene requests no fields or the folder does not exist."""
        return Fields._of(self.folder)

    @property
    def continuation(self) -> Probe | None:
        """Table of a curve of periodic states, with the parameter in the first column; None if the folder does not contain it."""
        path = self.folder / "continuation.csv"
        return Probe._read(path) if path.exists() else None

    def report(self) -> str:
        """Return the report of the run as a self-contained HTML page."""
        return (self.folder / "report.html").read_text(encoding="utf-8")

    def __repr__(self) -> str:
        steps = self.statistics.get("steps")
        return f"RunResult({self.outcome}, {steps} steps, probes: {', '.join(self.probes) or 'none'})"

    def _repr_html_(self) -> str:
        rows = {"outcome": self.outcome} | self.statistics
        cells = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(str(value))}</td></tr>"
            for name, value in rows.items()
        )
        title = html.escape(self.document["scene"].get("title") or "A run")
        return f"<b>{title}</b><table>{cells}</table>"


class SweepResult(_Stored):
    """Result of a sweep.

    Attributes
    ----------
    rows : list of dict
        For each case: its number, the varied values (with ``inf`` as text), the outcome, the
        counters, and the last row of each probe in ``probes``.
    axes : list of str
        Keys that are varied.
    folder : Path
        Folder that contains the folders of the cases.
    """

    def __init__(self, folder: Path, rows: list[dict[str, Any]], axes: list[str], temporary: Any) -> None:
        self.folder, self.rows, self.axes, self._temporary = folder, rows, axes, temporary

    @classmethod
    def _of(cls, folder: Path, axes: list[str], temporary: Any) -> SweepResult:
        document = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
        return cls(folder, document["rows"], axes, temporary)

    def case(self, number: int) -> RunResult:
        """Return the run of a case, counted from 1.

        Raises
        ------
        FileNotFoundError
            If the case is unknown, or if it failed before its run started.
        """
        return RunResult._of(self.folder / f"case-{number:04}", [], self._temporary)

    @overload
    def __getitem__(self, index: int) -> RunResult: ...

    @overload
    def __getitem__(self, index: slice) -> list[RunResult]: ...

    def __getitem__(self, index: int | slice) -> RunResult | list[RunResult]:
        """Return the run of a row, counted from 0, or the runs of several rows."""
        if isinstance(index, slice):
            return [self.case(row["case"]) for row in self.rows[index]]
        return self.case(self.rows[index]["case"])

    def frame(self) -> Any:
        """Return the rows as a `pandas.DataFrame` with the columns of sweep.csv and the column of messages."""
        import pandas

        with (self.folder / "sweep.csv").open(encoding="utf-8", newline="") as table:
            columns = [*next(csv.reader(table)), "message"]
        return pandas.DataFrame(self.rows, columns=columns).set_index("case")

    def dataset(self) -> Any:
        """Return the rows without the probes as an `xarray.Dataset` that has a dimension for each varied key."""
        rows = self.frame().reset_index()
        for axis in self.axes:
            rows[axis] = [float(v) if v in ("inf", "-inf") else v for v in rows[axis]]
        return rows.set_index(self.axes).to_xarray()

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        ends = Counter(row["outcome"] for row in self.rows)
        counts = ", ".join(f"{number} {outcome}" for outcome, number in ends.items())
        return f"SweepResult({len(self)} cases: {counts})"
