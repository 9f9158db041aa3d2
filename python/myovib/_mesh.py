"""Conversion of arrays, and of meshes from other programs, to files that scenes can read."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np

#: Dimension, number of vertices and number of nodes of each supported type of cells.
_TYPES = {
    "vertex": (0, 1, 1),
    "line": (1, 2, 2),
    "line3": (1, 2, 2),
    "triangle": (2, 3, 3),
    "triangle6": (2, 3, 6),
    "tetra": (3, 4, 4),
    "tetra10": (3, 4, 10),
}
#: Dimension, number of vertices and Gmsh's element type for each number of nodes.
_GMSH = {1: (0, 1, 15), 2: (1, 2, 1), 3: (2, 3, 2), 4: (3, 4, 4), 6: (2, 3, 9), 10: (3, 4, 11)}
_KINDS = ("point", "curve", "surface", "volume")
#: Cell arrays in which programs store groups.
_ARRAYS = (
    "gmsh:physical",
    "medit:ref",
    "nastran:ref",
    "tetgen:ref",
    "su2:tag",
    "avsucd:material",
    "ugrid:ref",
    "netgen:index",
    "CellEntityIds",
)

Groups = dict[str, np.ndarray]
Fields = dict[str, np.ndarray]


def read_mesh(
    path: str | PathLike[str], group: str | None = None
) -> tuple[np.ndarray, Groups, Fields]:
    """Read a mesh of another program (VTU, VTK, XDMF, Abaqus, Medit, Nastran, ...) with meshio.

    Parameters
    ----------
    path
        File. meshio selects the format by the extension.
    group
        Name of an integer cell array whose values are groups. By default, it is the array in which Gmsh, Medit,
        Nastran, TetGen, SU2, AVS-UCD, UGRID, Netgen or VTK's Exodus reader stores groups.

    Returns
    -------
    points
        Coordinates, one row per point.
    groups
        Connectivity of the cells of each group, in VTK's order of nodes. For example, the group of the cells with the
        value 3 is ``surface 3`` or ``volume 3`` unless the file names it. Sets of cells and points keep their names.
        Cells of the body without a group form the group ``ungrouped``.
    fields
        Arrays of values at the points. Cell arrays other than `group` are excluded. A warning lists them, except
        arrays with a colon in their names, such as meshio's own arrays.

    Example
    -------
    >>> myovib.write_mesh("limb.msh", *myovib.read_mesh("limb.vtu", group="tissue"))
    """
    try:
        import meshio
    except ImportError as error:
        raise ImportError("read_mesh requires meshio: pip install meshio") from error
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            mesh = meshio.read(path)
    except OSError:
        raise
    # Readers raise errors of any type for damaged files. If no reader accepts the file, meshio calls `sys.exit`.
    except (Exception, SystemExit) as error:
        reason = "" if isinstance(error, SystemExit) else f": {error}"
        raise ValueError(f"meshio cannot read {path}{reason}") from error
    array = group or next((name for name in _ARRAYS if name in mesh.cell_data), None)
    possible = [name for name, parts in mesh.cell_data.items() if all(p.ndim == 1 and p.dtype.kind in "iu" for p in parts)]
    if array is None and possible:
        warnings.warn(
            f"{path} has the integer cell arrays {', '.join(possible)}: set `group` to the array that defines the groups",
            stacklevel=2,
        )
    excluded = [
        name
        for name in mesh.cell_data
        if name != array and ":" not in name and (array is not None or name not in possible)
    ]
    if excluded:
        warnings.warn(
            f"{path} has the cell arrays {', '.join(excluded)}, which are excluded: convert them to point arrays first, "
            "for example with PyVista's cell_data_to_point_data",
            stacklevel=2,
        )
    if array is not None and array not in mesh.cell_data:
        found = ", ".join(mesh.cell_data) or "none"
        raise ValueError(f"{path} has no cell array {array!r}; found: {found}")
    others = {block.type for block in mesh.cells} - set(_TYPES)
    if others:
        raise ValueError(
            f"{path} has cells of type {', '.join(sorted(others))}; allowed: {', '.join(_TYPES)}"
        )
    sets = {name: cells for name, cells in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    for name, cells in sets.items():
        if len(cells) != len(mesh.cells):  # a set of sets, in Abaqus files
            raise ValueError(f"meshio cannot read the set {name!r} of {path}: list its elements")
    # Gmsh stores the names of groups here. Other programs store data about the file, such as its time.
    named = mesh.field_data.items() if array == "gmsh:physical" else ()
    names = {(int(value[1]), int(value[0])): name for name, value in named if np.size(value) == 2}
    body = max((_TYPES[block.type][0] for block in mesh.cells), default=0)
    parts: dict[tuple[str, int], list[np.ndarray]] = {}
    for i, block in enumerate(mesh.cells):
        dimension, n_vertices, n_nodes = _TYPES[block.type]
        cells = block.data[:, : n_nodes if dimension == body else n_vertices]
        is_free = np.full(len(cells), dimension == body)
        members = {name: cells_of[i] for name, cells_of in sets.items() if cells_of[i] is not None}
        if array is not None:
            tags = np.asarray(mesh.cell_data[array][i]).ravel()
            if len(tags) != len(cells) or (tags != np.round(tags)).any():
                raise ValueError(f"array {array!r} of {path} must have one integer per cell")
            for tag in np.unique(tags):
                name = names.get((dimension, int(tag)), f"{_KINDS[dimension]} {int(tag)}")
                members.setdefault(name, np.flatnonzero(tags == tag))
        for name, own in members.items():
            own = np.asarray(own, dtype=int)
            is_free[own] = False
            if len(own):
                parts.setdefault((name, dimension), []).append(cells[own])
        if is_free.any():
            parts.setdefault(("ungrouped", dimension), []).append(cells[is_free])
    for name, points in mesh.point_sets.items():
        parts[name, 0] = [np.asarray(points, dtype=int)[:, None]]
    groups = {}
    for (name, dimension), blocks in parts.items():
        if sum(other == name for other, _ in parts) > 1:
            name = f"{_KINDS[dimension]} {name}"
        groups[name] = np.concatenate(blocks)
    # The arrays of meshio itself have a colon in their names.
    fields = {
        name: values
        for name, values in mesh.point_data.items()
        if ":" not in name and np.issubdtype(values.dtype, np.number)
    }
    return mesh.points, groups, fields


def write_mesh(
    path: str | PathLike[str],
    points: Any,
    groups: Mapping[str, Any],
    fields: Mapping[str, Any] | None = None,
) -> None:
    """Write a mesh in Gmsh's format, for ``[mesh] type = "file"``.

    Parameters
    ----------
    path
        File. An existing file is replaced.
    points
        Coordinates in two or three columns.
    groups
        Indices of the points of each cell in VTK's order of nodes, one row per cell: 3 or 6 columns for triangles, 4 or
        10 for tetrahedra, 2 for lines, and 1 for points. Cells of the highest dimension form the body. Groups may
        overlap.
    fields
        Values at the points, such as fiber directions (three columns) or a factor of the
        stress (one column).
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"points must have two or three columns, found shape {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("points must be finite")
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    names: list[str] = []
    elements: list[np.ndarray] = []
    vertices: dict[int, list[np.ndarray]] = {}
    for tag, (name, cells) in enumerate(groups.items(), start=1):
        if '"' in name or not name.isprintable():
            raise ValueError(f"group name {name!r} has quotes or control characters")
        cells = np.asarray(cells)
        if cells.ndim != 2 or cells.shape[1] not in _GMSH or cells.dtype.kind not in "iu":
            raise ValueError(
                f"group {name!r} must have integers in 1, 2, 3, 4, 6 or 10 columns, "
                f"found {cells.dtype} in shape {cells.shape}"
            )
        if cells.size and not 0 <= cells.min() <= cells.max() < len(points):
            raise ValueError(f"group {name!r} has indices outside 0 to {len(points) - 1}")
        cells = cells.astype(np.int64)
        dimension, n_vertices, kind = _GMSH[cells.shape[1]]
        names.append(f'{dimension} {tag} "{name}"\n')
        if cells.shape[1] == 10:  # Gmsh and VTK order the last two edges differently.
            cells = cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
        head = np.tile([kind, 2, tag, tag], (len(cells), 1))
        elements.append(np.hstack([head, cells + 1]))
        vertices.setdefault(dimension, []).append(cells[:, :n_vertices].ravel())
    data = {name: _values(name, values, len(points)) for name, values in (fields or {}).items()}
    # Values at midside nodes are not used.
    used = np.unique(np.concatenate(vertices[max(vertices)])) if vertices else np.empty(0, int)
    with open(path, "w", encoding="utf-8") as file:
        file.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n")
        file.write(f"$PhysicalNames\n{len(names)}\n{''.join(names)}$EndPhysicalNames\n")
        file.write(f"$Nodes\n{len(points)}\n")
        for number, point in enumerate(points.tolist(), start=1):
            file.write(f"{number} {point[0]!r} {point[1]!r} {point[2]!r}\n")
        file.write(f"$EndNodes\n$Elements\n{sum(map(len, elements))}\n")
        rows = (row for block in elements for row in block.tolist())
        for number, row in enumerate(rows, start=1):
            file.write(f"{number} {' '.join(map(str, row))}\n")
        file.write("$EndElements\n")
        for name, values in data.items():
            known = used[np.isfinite(values[used]).all(axis=1)]
            file.write(f'$NodeData\n1\n"{name}"\n1\n0\n3\n0\n{values.shape[1]}\n{len(known)}\n')
            for node, row in zip(known.tolist(), values[known].tolist()):
                file.write(f"{node + 1} {' '.join(map(repr, row))}\n")
            file.write("$EndNodeData\n")


def _values(name: str, values: Any, n_points: int) -> np.ndarray:
    """Return a field with one row per point. A vector field has three columns."""
    values = np.asarray(values, dtype=float)
    if values.ndim not in (1, 2) or len(values) != n_points:
        raise ValueError(
            f"field {name!r} must have one row per point ({n_points}), found shape {values.shape}"
        )
    values = values.reshape(n_points, -1)
    return np.pad(values, ((0, 0), (0, 1))) if values.shape[1] == 2 else values
