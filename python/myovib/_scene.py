"""Scenes in TOML whose values can be changed."""

from __future__ import annotations

import json
import operator
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from . import _native
from ._identification import (
    Array,
    Experiment,
    FitResult,
    SensitivityResult,
    by_element,
    experiments,
)
from ._run import Modes, RunResult, SweepResult

__all__ = ["Scene"]

Progress = bool | Callable[[str], object]


class Scene:
    """A scene whose values can be changed. It can be pickled.

    Use `Scene.read` or `Scene.builtin` to create a scene.

    Examples
    --------
    >>> scene = Scene.builtin("table2-31").set("time.end", 0.05)
    >>> result = scene.run()
    >>> result.outcome
    'finished'
    """

    def __init__(self, source: str | PathLike[str]) -> None:
        self._source = str(source)
        self._set: dict[str, str] = {}

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Scene:
        """Read a TOML file.

        Parameters
        ----------
        path : path-like
            The file. Paths in this file are relative to its folder.

        Raises
        ------
        FileNotFoundError
        """
        if not Path(path).is_file():
            raise FileNotFoundError(f"no scene file `{path}`")
        return cls(Path(path).absolute())

    @classmethod
    def builtin(cls, name: str) -> Scene:
        """Return a built-in scene.

        Raises
        ------
        ValueError
            If the name is not in `Scene.builtins`.
        """
        if name not in _native.builtins():
            names = ", ".join(_native.builtins())
            raise ValueError(f"no built-in scene {name!r}: choose one of {names}")
        return cls(name)

    @staticmethod
    def builtins() -> list[str]:
        """Return the names of the built-in scenes."""
        return _native.builtins()

    @property
    def text(self) -> str:
        """Text of the scene, without the changes made by `set`."""
        text = _native.builtin_text(self._source)
        return Path(self._source).read_text(encoding="utf-8") if text is None else text

    @property
    def changes(self) -> dict[str, str]:
        """Keys and values changed by `set`, as text."""
        return dict(self._set)

    def set(self, key: str, value: Any) -> Scene:
        """Change a value of this scene, as ``--set key=value`` does.

        Keys and values are validated when the scene is computed.

        Parameters
        ----------
        key : str
            A key such as ``solid.bulk_modulus`` or ``material[0].c10``.
        value : float, str, bool, list, dict or None
            The value. ``None`` removes the key, so that its default applies.

        Returns
        -------
        Scene
            This scene.
        """
        self._assign(f"{key}={_toml(value)}")
        return self

    def copy(self) -> Scene:
        """Return an independent copy."""
        other = Scene(self._source)
        other._set = dict(self._set)
        return other

    def check(self) -> dict[str, Any]:
        """Inspect the scene before a run: unknowns, index, modes, estimated cost, warnings.

        Ctrl-C raises `KeyboardInterrupt` immediately, while the inspection continues in the background.

        Returns
        -------
        dict
            The document of ``myovib check --json``. Its entry ``"text"`` is the text of ``myovib
            check``.

        Raises
        ------
        SceneError
            If the scene is invalid. The message describes the mistake, its location, and what is
            allowed.
        """
        text, document = _native.check(self._source, self._assignments())
        return json.loads(document) | {"text": text}

    def run(
        self,
        out: str | PathLike[str] | None = None,
        *,
        progress: Progress = False,
        verify: bool = False,
        existing: Literal["refuse", "overwrite", "resume"] = "refuse",
    ) -> RunResult:
        """Compute the scene.

        Other Python threads continue during the run. Ctrl-C or an exception raised by `progress` ends
        the run; the files of the run are kept, and the exception is raised again. Notes on the run are
        issued as warnings.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib run``. By default a temporary folder, removed
            together with the result.
        progress : bool or callable
            Whether to show progress on standard error, or a function that is called with each line.
        verify : bool
            Whether to estimate the error by a second run at looser tolerances. The estimate is
            the entry ``"error_estimate"`` of the document.
        existing : {"refuse", "overwrite", "resume"}
            Policy for an earlier run in the folder.

        Returns
        -------
        RunResult
            The result, even if the run stopped or an equilibrium was found only for a part of
            the load: see `success` and `document["message"]`.

        Raises
        ------
        SceneError
            If the scene is invalid. In this case, nothing is written.
        OSError
            If results cannot be written.
        """
        out, temporary = _folder(out)
        with _Line(progress) as show:
            lasting = temporary is None
            notes = _native.run(
                self._source, self._assignments(), out, existing, lasting, verify, show
            )
        for note in notes:
            warnings.warn(note, stacklevel=2)
        return RunResult._of(out, notes, temporary)

    def sweep(
        self,
        vary: Mapping[str, Iterable[Any] | str],
        out: str | PathLike[str] | None = None,
        *,
        results: Mapping[str, str] | None = None,
        threads: int | None = None,
        overwrite: bool = False,
        from_neighbor: bool = False,
        progress: Progress = False,
    ) -> SweepResult:
        """Compute the scene for all combinations of values, in parallel with one case per core.

        Parameters
        ----------
        vary : mapping
            For each key, its values, or a range as text: ``"1e-5..1e-3:5"`` or
            ``"1e-5..1e-3:5:log"``. A value may be a list.
        out : path-like, optional
            Folder for the cases. By default a temporary folder, removed with the result.
        results : mapping, optional
            Additional columns that are computed from the probes, as ``--result name=expression``
            does.
        threads : int, optional
            Number of cases that run in parallel. By default, all cores are used.
        overwrite : bool
            Whether to compute finished cases again.
        from_neighbor : bool
            Whether the search for an equilibrium starts from the result for the preceding value of the
            last key, instead of from the unloaded body.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        SweepResult
        """
        out, temporary = _folder(out)
        axes = [f"{key}={_axis(values)}" for key, values in vary.items()]
        columns = [f"{name}={expression}" for name, expression in (results or {}).items()]
        with _Line(progress) as show:
            _native.sweep(
                self._source,
                axes,
                self._assignments(),
                columns,
                out,
                overwrite,
                from_neighbor,
                None if threads is None else _whole("threads", threads, 1),
                show,
            )
        return SweepResult._of(out, list(vary), temporary)

    def modes(self, count: int | None = None) -> Modes:
        """Compute the lowest eigenmodes of the body.

        The modes are linearized about the unloaded state or, with ``scene.set("modes.preload_time", t)``,
        about the equilibrium under the loads at the time t. Ctrl-C raises `KeyboardInterrupt`
        immediately, while the computation continues in the background.

        Parameters
        ----------
        count : int, optional
            Number of modes. By default, it is the number in the scene, or 10 if the
            scene has none.

        Returns
        -------
        Modes
            For each mode: ``frequency`` (Hz), ``omega_squared``, ``damping_ratio``,
            ``participation``, ``effective_mass`` and ``residual``. The method ``shape`` returns the
            shapes.
        """
        scene = self if count is None else self.copy().set("modes.count", count)
        text, arrays = _native.modes(self._source, scene._assignments())
        return Modes(json.loads(text), arrays)

    def response(
        self,
        frequencies: float | Iterable[float] | str | None = None,
        out: str | PathLike[str] | None = None,
        *,
        progress: Progress = False,
        existing: Literal["refuse", "overwrite"] = "refuse",
    ) -> RunResult:
        """Compute the harmonic response to the loads that have a ``response`` in the scene.

        The body vibrates about rest or, with ``scene.set("response.preload_time", t)``, about the
        equilibrium under the loads at the time t.

        Parameters
        ----------
        frequencies : float, iterable of float or str, optional
            Frequencies in Hz, or a range as text: ``"1..60:120"`` or ``"1..60:120:log"``. By
            default, the frequencies in the scene are used.
        out : path-like, optional
            Folder for the files of ``myovib response``. By default a temporary folder, removed
            together with the result.
        progress : bool or callable
            As for `run`.
        existing : {"refuse", "overwrite"}
            Policy for earlier results in the folder.

        Returns
        -------
        RunResult
            Its probes contain the frequency as ``"f"``, and the values as ``probe.amplitude("u_y")``,
            ``probe.phase("u_y")`` (in degrees), and ``probe.complex("u_y")``. Its document contains the
            ``"peaks"``.
        """
        scene = self.copy().set("analysis", "response")
        if frequencies is not None:
            scene.set("response.frequencies", _frequencies(frequencies))
        return scene.run(out, progress=progress, existing=existing)

    def periodic(
        self,
        out: str | PathLike[str] | None = None,
        *,
        continuation: tuple[str, float, float] | None = None,
        progress: Progress = False,
        existing: Literal["refuse", "overwrite"] = "refuse",
    ) -> RunResult:
        """Find the motion that repeats with the period of the loads, and its stability.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib periodic``. By default a temporary folder, removed
            together with the result.
        continuation : tuple of str, float and float, optional
            Key of a number in the scene, and two values of this number. The curve of periodic states is
            followed from the first to the second value, through folds, as ``--continue KEY=FROM..TO`` does.
        progress : bool or callable
            As for `run`.
        existing : {"refuse", "overwrite"}
            Policy for earlier results in the folder.

        Returns
        -------
        RunResult
            Its probes cover one period. Its document contains ``"multipliers"``, ``"is_stable"``
            and the harmonics of the ``"probes"``. `continuation` is the table of the curve.
        """
        scene = self.copy().set("analysis", "periodic")
        if continuation is not None:
            key, start, end = continuation
            scene.set(key, float(start)).set("periodic.continuation.parameter", key)
            scene.set("periodic.continuation.to", float(end))
        return scene.run(out, progress=progress, existing=existing)

    def sensitivity(
        self,
        out: str | PathLike[str] | None = None,
        *,
        in_error_test: bool = False,
        progress: Progress = False,
    ) -> SensitivityResult:
        """Compute the derivatives of the outputs with respect to the parameters, by forward sensitivities.

        The scene lists its parameters in ``[[parameter]]`` and its outputs in ``[[output]]``. Without
        ``[[output]]``, all columns of the probes are outputs.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib sensitivity``. By default a temporary folder, removed
            with the result.
        in_error_test : bool
            Whether the error test includes the derivatives.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        SensitivityResult

        Raises
        ------
        SceneError
            If the scene is invalid, or if derivatives with respect to a parameter are
            not available.
        RuntimeError
            If the run does not reach its end.

        Examples
        --------
        >>> scene = Scene.builtin("init").set("time.end", 0.1)
        >>> scene.set("parameter", [{"key": "material[0].c10"}]).sensitivity().parameters
        ['material[0].c10']
        """
        out, temporary = _folder(out)
        with _Line(progress) as show:
            document = _native.sensitivity(
                self._source, self._assignments(), out, in_error_test, show
            )
        return SensitivityResult(out, json.loads(document), temporary)

    def stiffness_map(
        self,
        out: str | PathLike[str] | None = None,
        *,
        progress: Progress = False,
    ) -> dict[str, Array]:
        """Compute the sensitivity of each output to the stiffness of each element, by the discrete adjoint.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib sensitivity --map``. By default no files are kept.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        dict of ndarray, shape (elements,)
            For each displacement or velocity among the outputs: the relative change of its RMS over
            time per relative change of the stiffness of each element. NaN for an output that is always
            zero.

        Raises
        ------
        SceneError
            If the scene is invalid, or if these derivatives are not available for the
            scene.
        RuntimeError
            If the run does not reach its end.

        Examples
        --------
        >>> seen = Scene.builtin("init").set("time.end", 0.1).stiffness_map()
        >>> sorted(seen), len(seen["origin.u_y"])
        (['origin.u_x', 'origin.u_y'], 311)
        """
        folder, _temporary = _folder(out)
        with _Line(progress) as show:
            document = _native.stiffness_map(self._source, self._assignments(), folder, show)
        return by_element(json.loads(document))

    def fit(
        self,
        data: Experiment | list[Experiment],
        out: str | PathLike[str] | None = None,
        *,
        profile: bool = False,
        tolerance: float = 1e-5,
        max_iterations: int = 50,
        starts: int = 1,
        seed: int = 0,
        existing: Literal["refuse", "overwrite", "resume"] = "refuse",
        progress: Progress = False,
    ) -> FitResult:
        """Fit the scene's parameters to measurements by least squares.

        The scene lists its parameters in ``[[parameter]]`` with their bounds, and the measured
        quantities in ``[[output]]`` with their noise. A fit that does not converge issues a warning.

        Parameters
        ----------
        data : experiment or list of experiments
            An experiment is a file, as for ``myovib fit --data``, or a mapping or data frame. A mapping
            has the column ``"t"`` (``"f"`` for a response, ``"load"`` for a static analysis) and a column
            for each measured output, with NaN or masked entries where the output was not measured. If an
            experiment requires different values in the scene, give a pair of the measurements and a
            mapping of these values.
        out : path-like, optional
            Folder for the files of ``myovib fit``. By default a temporary folder, removed with the
            result.
        profile : bool
            Whether to compute intervals by profile likelihood, which takes about ten fits
            per parameter.
        tolerance : float
            The fit has converged when no parameter changes by more than this fraction of its value.
        max_iterations : int
            Maximum number of iterations per phase, starting point and profile point.
        starts, seed : int
            Number of starting points, and the seed. The first starting point consists of the values in
            the scene; the others are random. The best fit is kept.
        existing : {"refuse", "overwrite", "resume"}
            Policy for an earlier fit in `out`.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        FitResult
            The result, even if the fit did not converge: see ``converged`` and ``message``.

        Raises
        ------
        SceneError
            If the scene or the measurements are invalid.
        """
        out, temporary = _folder(out)
        with tempfile.TemporaryDirectory(prefix="myovib-") as tables, _Line(progress) as show:
            document = _native.fit(
                self._source,
                self._assignments(),
                [
                    (file, [f"{key}={_toml(value)}" for key, value in changes.items()])
                    for file, changes in experiments(data, Path(tables))
                ],
                out,
                profile,
                tolerance,
                _whole("max_iterations", max_iterations, 1),
                _whole("starts", starts, 1),
                _whole("seed", seed, 0),
                existing,
                show,
            )
        fit = FitResult(out, json.loads(document), self.copy(), temporary)
        if not fit.converged:
            warnings.warn(f"the fit did not converge: {fit.message}", stacklevel=2)
        return fit

    def _assign(self, assignment: str) -> None:
        key, _, value = assignment.partition("=")
        # A new value of a section or list replaces its entries, including earlier changes.
        entries = (f"{key}.", f"{key}[")
        self._set = {other: text for other, text in self._set.items() if other != key and not other.startswith(entries)}
        self._set[key] = value

    def _assignments(self) -> list[str]:
        return [f"{key}={value}" for key, value in self._set.items()]

    def __repr__(self) -> str:
        changes = "".join(f".set({key!r}, {value})" for key, value in self._set.items())
        return f"Scene({self._source!r}){changes}"


Temporary = tempfile.TemporaryDirectory[str]


def _folder(out: str | PathLike[str] | None) -> tuple[Path, Temporary | None]:
    """Return the folder for results, and the temporary folder that contains it, or None."""
    if out is not None:
        if out == "":
            raise ValueError("out is empty: name a folder; '.' is the current folder")
        return Path(out), None
    temporary = tempfile.TemporaryDirectory(prefix="myovib-")
    return Path(temporary.name) / "out", temporary


def _whole(name: str, value: int, least: int) -> int:
    """Return the value as an integer of at least `least`."""
    value = operator.index(value)
    if value < least:
        raise ValueError(f"{name} = {value}: must be {least} or more")
    return value


def _frequencies(frequencies: float | Iterable[float] | str) -> str | list[float]:
    if isinstance(frequencies, str):
        return frequencies
    if isinstance(frequencies, (bytes, bytearray)):
        raise TypeError("frequencies must be numbers or a str, not bytes")
    if isinstance(frequencies, Iterable):
        return [float(f) for f in frequencies]
    return [float(frequencies)]


def _toml(value: Any) -> str:
    """Return a value as TOML; the program accepts both inf and "inf"."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, Iterable):
        return "[" + ", ".join(_toml(entry) for entry in value) + "]"
    if hasattr(value, "item"):  # NumPy's numbers
        value = value.item()
    if isinstance(value, (int, float)):
        return repr(value)
    raise TypeError(f"a scene cannot have values of type {type(value).__name__}")


def _axis(values: Iterable[Any] | str) -> str:
    if isinstance(values, str):
        return values
    return ",".join(_entry(value) for value in values)


def _entry(value: Any) -> str:
    """Format an item of a list. Text that contains separators is quoted."""
    if not isinstance(value, str):
        return _toml(value)
    if value == value.strip() and not set(value) & set(",'\"[]{}"):
        return value
    return f"'{value}'" if value.isprintable() and "'" not in value else _toml(value)


class _Line:
    """Progress shown as a line on standard error, which is cleared at the end."""

    def __init__(self, progress: Progress) -> None:
        self._shown = 0
        self._show = progress if callable(progress) else self._write if progress else None

    def _write(self, line: str) -> None:
        sys.stderr.write("\r" + line.ljust(self._shown))
        sys.stderr.flush()
        self._shown = len(line)

    def __enter__(self) -> Callable[[str], object] | None:
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._shown:
            sys.stderr.write("\r" + " " * self._shown + "\r")
