"""The native module; use the functions of `myovib` instead."""

from collections.abc import Callable
from os import PathLike
from typing import Any

class StepFailure(Exception): ...
class SceneError(ValueError): ...

def solve(request: dict[str, Any]) -> dict[str, Any]: ...
def run(
    scene: str | PathLike[str],
    set: list[str],
    out: str | PathLike[str],
    existing: str,
    lasting: bool,
    verify: bool,
    progress: Callable[[str], object] | None,
) -> list[str]: ...
def sweep(
    scene: str | PathLike[str],
    vary: list[str],
    set: list[str],
    results: list[str],
    out: str | PathLike[str],
    overwrite: bool,
    from_neighbor: bool,
    threads: int | None,
    progress: Callable[[str], object] | None,
) -> None: ...
def check(scene: str | PathLike[str], set: list[str]) -> tuple[str, str]: ...
def modes(scene: str | PathLike[str], set: list[str]) -> tuple[str, bytes]: ...
def sensitivity(
    scene: str | PathLike[str],
    set: list[str],
    out: str | PathLike[str],
    in_error_test: bool,
    progress: Callable[[str], object] | None,
) -> str: ...
def stiffness_map(
    scene: str | PathLike[str],
    set: list[str],
    out: str | PathLike[str],
    progress: Callable[[str], object] | None,
) -> str: ...
def fit(
    scene: str | PathLike[str],
    set: list[str],
    experiments: list[tuple[str | PathLike[str], list[str]]],
    out: str | PathLike[str],
    profile: bool,
    tolerance: float,
    max_iterations: int,
    starts: int,
    seed: int,
    existing: str,
    progress: Callable[[str], object] | None,
) -> str: ...
def use_threads(threads: int) -> None:
    """Set the number of threads for the assembly and factorization of large bodies.

    All runs of this process share the threads. The results do not depend on the number of threads.
    After a call with a number above 1, further calls have no effect.
    """

def builtins() -> list[str]: ...
def builtin_text(name: str) -> str | None: ...
def versions() -> tuple[str, str, str]: ...
def program(arguments: list[str]) -> int: ...
