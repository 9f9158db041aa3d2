"""Differential-algebraic equations and constrained soft-tissue mechanics.

`solve_dae` integrates user-defined systems F(t, y, y') = 0 of index up to 3, with the BDF
method of SUNDIALS' IDAS or with Radau IIA of order 5, 9 or 13. `Scene` simulates the
mechanics of soft tissue with meshes, materials, loads and chains of oscillators. The
program `myovib` computes bitwise equal results.
"""

try:
    from . import _native
except ImportError as error:
    raise ImportError(
        "the compiled module of myovib is missing or was built for another system: install the wheel "
        "(`scripts/wheel` builds it from source)"
    ) from error
from ._consistent import consistent_start
from ._dae import DaeSolution, DenseOutput, solve_dae
from ._identification import FitResult, SensitivityResult
from ._mesh import read_mesh, write_mesh
from ._native import SceneError, StepFailure, use_threads, versions
from ._run import Fields, Modes, Probe, RunResult, SweepResult
from ._scene import Scene

__all__ = [
    "DaeSolution",
    "DenseOutput",
    "Fields",
    "FitResult",
    "Modes",
    "Probe",
    "RunResult",
    "Scene",
    "SceneError",
    "SensitivityResult",
    "StepFailure",
    "SweepResult",
    "consistent_start",
    "read_mesh",
    "solve_dae",
    "use_threads",
    "versions",
    "write_mesh",
]
__version__ = versions()[0]
