"""Scenes: what a user of the program writes in TOML."""

from __future__ import annotations

import json
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
from ._run import RunResult, SweepResult

__all__ = ["Scene"]

Progress = bool | Callable[[str], object]


class Scene:
    """A scene and the values that are changed in it.

    Made by `Scene.read` or `Scene.builtin`; picklable.

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
        """The scene of a TOML file.

        Parameters
        ----------
        path : path-like
            The file. Files that it names are relative to its folder.

        Raises
        ------
        FileNotFoundError
        """
        if not Path(path).is_file():
            raise FileNotFoundError(f"no scene file `{path}`")
        return cls(Path(path).absolute())

    @classmethod
    def builtin(cls, name: str) -> Scene:
        """One of the scenes of `Scene.builtins`.

        Raises
        ------
        ValueError
            For another name.
        """
        if name not in _native.builtins():
            names = ", ".join(_native.builtins())
            raise ValueError(f"no built-in scene {name!r}: there are {names}")
        return cls(name)

    @staticmethod
    def builtins() -> list[str]:
        """The names of the built-in scenes."""
        return _native.builtins()

    @property
    def text(self) -> str:
        """The scene as written, without what `set` changed."""
        text = _native.builtin_text(self._source)
        return Path(self._source).read_text(encoding="utf-8") if text is None else text

    @property
    def changes(self) -> dict[str, str]:
        """What `set` changed: keys and values as text."""
        return dict(self._set)

    def set(self, key: str, value: Any) -> Scene:
        """Change a value of this scene, as ``--set key=value`` does.

        A wrong key or value is told by what computes; ``None`` takes it back.

        Parameters
        ----------
        key : str
            As in ``solid.kappa`` or ``material[0].c10``.
        value : float, str, bool, list, dict or None
            The value; ``None`` removes the key, for its default.

        Returns
        -------
        Scene
            This scene.
        """
        self._assign(f"{key}={_toml(value)}")
        return self

    def copy(self) -> Scene:
        """A scene to be changed apart from this one."""
        other = Scene(self._source)
        other._set = dict(self._set)
        return other

    def check(self) -> dict[str, Any]:
        """What can be said before a run: unknowns, index, modes, cost, warnings.

        Returns
        -------
        dict
            The body of the document that ``myovib check --json`` writes, with
            the text for people under ``"text"``.

        Raises
        ------
        SceneError
            What is wrong in the scene, where, and what is allowed.
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

        Ctrl-C ends the run in good order and raises `KeyboardInterrupt`. Other
        threads of Python go on meanwhile.

        Parameters
        ----------
        out : path-like, optional
            Folder for the results, the same files as those of ``myovib run``.
            By default one that is removed together with the result.
        progress : bool or callable
            Whether progress is shown on standard error, or who is told.
        verify : bool
            Whether a second run at looser tolerances says how far off this one is,
            under ``"error_estimate"`` of the document.
        existing : {"refuse", "overwrite", "resume"}
            What is done with a run that the folder holds.

        Returns
        -------
        RunResult
            Also of a run that stopped, and of an equilibrium that was found under a
            part of the load only: `success` tells, and `document["message"]` why.

        Raises
        ------
        SceneError
            What is wrong in the scene; nothing was written then.
        OSError
            Results that cannot be written.
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
        progress: Progress = False,
    ) -> SweepResult:
        """Compute the scene over a grid of values, a case on each core.

        Parameters
        ----------
        vary : mapping
            For each key its values, or a range as text: ``"1e-5..1e-3:5"`` or
            ``"1e-5..1e-3:5:log"``. A value may be a list.
        out : path-like, optional
            Folder for the cases; by default one that is removed with the result.
        results : mapping, optional
            Columns made of the probes, as ``--result name=expression``.
        threads : int, optional
            Cases at a time; all cores by default.
        overwrite : bool
            Whether cases that the folder holds are computed again.
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
                self._source, axes, self._assignments(), columns, out, overwrite, threads, show
            )
        return SweepResult._of(out, temporary)

    def modes(self, count: int | None = None) -> list[dict[str, float]]:
        """The lowest eigenmodes of the body.

        They are about its unloaded state, or, with ``scene.set("modes.loads_at", t)``, about the
        equilibrium under its loads at the time t.

        Parameters
        ----------
        count : int, optional
            How many; by default the scene's number, else 10.

        Returns
        -------
        list of dict
            For each mode ``frequency`` (Hz), ``omega_squared``, ``damping_ratio``
            and ``residual``.
        """
        document = json.loads(_native.modes(self._source, self._assignments(), count))
        return document["muscles"][0]["modes"]

    def sensitivity(
        self,
        out: str | PathLike[str] | None = None,
        *,
        in_error_test: bool = False,
        progress: Progress = False,
    ) -> SensitivityResult:
        """What the outputs of the scene depend on, by one run with its derivatives.

        The parameters are those of the scene's ``[[parameter]]``, the outputs those of
        ``[[output]]``, else all columns of the probes.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib sensitivity``; by default one that is removed
            with the result.
        in_error_test : bool
            Let the errors of the derivatives choose the steps too.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        SensitivityResult

        Raises
        ------
        SceneError
            What is wrong in the scene, as a parameter by which nothing can be differentiated.
        RuntimeError
            A run that did not come to its end.

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
        """Where in the body the outputs of the scene see its stiffness, by the discrete adjoint.

        Parameters
        ----------
        out : path-like, optional
            Folder for the files of ``myovib sensitivity --map``; by default none are kept.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        dict of ndarray, shape (elements,)
            For each output that is a displacement or a velocity the relative change of its root
            mean square over time for a relative change of each element's stiffness; NaN for an
            output that stays zero.

        Raises
        ------
        SceneError
            What is wrong in the scene, or in the way of such derivatives.
        RuntimeError
            A run that did not come to its end.

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
        """The scene's parameters from measurements, by least squares.

        The parameters are those of the scene's ``[[parameter]]``, with their bounds; what was
        measured those of ``[[output]]``, with their noise.

        Parameters
        ----------
        data : experiment or list of experiments
            An experiment is a file, as for ``myovib fit --data``, or a mapping or data frame with the column
            ``"t"`` and one for each output measured (NaN: not measured then); or a pair of
            that and a mapping of what was changed in the scene.
        out : path-like, optional
            Folder for the files of ``myovib fit``; by default one that is removed with the
            result.
        profile : bool
            Whether intervals by profile likelihood are computed: some ten fits for each
            parameter.
        tolerance : float
            The fit has converged when no parameter changes by more than this fraction.
        max_iterations : int
        starts, seed : int
            From how many starts to fit: the scene's own and others by chance; the best is kept.
        existing : {"refuse", "overwrite", "resume"}
            What is done with a fit that `out` holds.
        progress : bool or callable
            As for `run`.

        Returns
        -------
        FitResult
            Also of a fit that did not converge, which says so.

        Raises
        ------
        SceneError
            What is wrong in the scene or the measurements, and where.
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
                max_iterations,
                starts,
                seed,
                existing,
                show,
            )
        return FitResult(out, json.loads(document), self.copy(), temporary)

    def _assign(self, assignment: str) -> None:
        key, _, value = assignment.partition("=")
        self._set.pop(key, None)
        self._set[key] = value

    def _assignments(self) -> list[str]:
        return [f"{key}={value}" for key, value in self._set.items()]

    def __repr__(self) -> str:
        changes = "".join(f".set({key!r}, {value})" for key, value in self._set.items())
        return f"Scene({self._source!r}){changes}"


Temporary = tempfile.TemporaryDirectory[str]


def _folder(out: str | PathLike[str] | None) -> tuple[Path, Temporary | None]:
    """The folder for results, and what removes it."""
    if out is not None:
        return Path(out), None
    temporary = tempfile.TemporaryDirectory(prefix="myovib-")
    return Path(temporary.name) / "out", temporary


def _toml(value: Any) -> str:
    """A value as TOML has it; the program takes inf for a string of that name."""
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
    raise TypeError(f"a scene has no values of type {type(value).__name__}")


def _axis(values: Iterable[Any] | str) -> str:
    if isinstance(values, str):
        return values
    return ",".join(_entry(value) for value in values)


def _entry(value: Any) -> str:
    """Return a value of a list; text with separators is quoted."""
    if not isinstance(value, str):
        return _toml(value)
    if value == value.strip() and not set(value) & set(",'\"[]{}"):
        return value
    return f"'{value}'" if value.isprintable() and "'" not in value else _toml(value)


class _Line:
    """Progress as a line on standard error, which is cleared at the end."""

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
