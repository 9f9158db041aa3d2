"""Meshes from other programs and from arrays give the same deflection as files from Gmsh."""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import myovib

ORGANS = Path(__file__).parents[2] / "crates/scene/tests/data/organs"
#: Edges with midside nodes, in VTK's order (VTK User's Guide, quadratic cells).
TRIANGLE = [(0, 1), (1, 2), (2, 0)]
TETRAHEDRON = [*TRIANGLE, (0, 3), (1, 3), (2, 3)]


def deflection(path, held="held", free="free", material=""):
    """Return the mean displacement of the group `free` of a body under its weight."""
    scene = path.with_suffix(".toml")
    scene.write_text(f"""
analysis = "static"
[mesh]
type = "file"
path = "{path.name}"
[solid]
bulk_modulus = 1e6
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e5
{material}
[[body_force]]
x = 4.0
y = -9.0
[[fixed]]
group = "{held}"
[[probe]]
name = "mean"
type = "average"
group = "{free}"
""")
    mean = myovib.Scene.read(scene).run().probes["mean"]
    return np.array([mean[name][-1] for name in ("u_x", "u_y")])


# The coordinates are equal, but the order of the elements, and therefore of the sums, differs.
def equal(exact):
    assert np.abs(exact).max() > 1e-6
    return pytest.approx(exact, rel=1e-9)


def box():
    """Return the points, tetrahedra and faces at both ends of a block."""
    axes = [np.linspace(0.0, 0.02 * n, n + 1) for n in (4, 1, 1)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(5, 2, 2)
    paths = [np.cumsum([(0, 0, 0), *steps], axis=0) for steps in permutations(np.eye(3, dtype=int))]
    cells = np.array([number[tuple((p + [i, 0, 0]).T)] for i in range(4) for p in paths])
    ends = [[c[points[c, 0] == x] for c in cells] for x in (0.0, axes[0][-1])]
    return points, cells, *(np.array([f for f in end if len(f) == 3]) for end in ends)


def strip():
    """Return the points, triangles and edges at both ends of a strip."""
    points = np.array([[0.02 * i, 0.02 * j] for i in range(5) for j in range(2)])
    cells = [c for i in range(0, 8, 2) for c in ([i, i + 2, i + 3], [i, i + 3, i + 1])]
    return points, np.array(cells), np.array([[0, 1]]), np.array([[8, 9]])


def quadratic(points, cells, edges):
    """Return points and cells with midside nodes in VTK's order."""
    ends = np.sort(np.concatenate([cells[:, list(edge)] for edge in edges]), axis=1)
    ends, own = np.unique(ends, axis=0, return_inverse=True)
    middles = len(points) + own.reshape(len(edges), -1).T
    return np.vstack([points, points[ends].mean(axis=1)]), np.hstack([cells, middles])


@pytest.mark.parametrize(("body", "edges"), [(box, TETRAHEDRON), (strip, TRIANGLE)])
def test_straight_quadratic_cells_deflect_as_linear_ones(tmp_path, body, edges):
    points, cells, held, free = body()
    groups = {"held": held, "free": free}
    path = tmp_path / "body.msh"
    myovib.write_mesh(path, points, {**groups, "tissue": cells})
    exact = deflection(path)
    points, cells = quadratic(points, cells, edges)
    myovib.write_mesh(path, points, {**groups, "tissue": cells, "half": cells[:4]})
    assert deflection(path) == equal(exact)


@pytest.mark.parametrize("organ", ["limb", "tongue"])
@pytest.mark.parametrize("extension", ["msh", "vtu", "vtk", "inp"])
def test_a_file_of_meshio_deflects_as_that_of_gmsh(tmp_path, organ, extension):
    meshio = pytest.importorskip("meshio")
    source = ORGANS / f"{organ}.msh"
    own = tmp_path / source.name
    own.write_bytes(source.read_bytes())
    mesh = meshio.read(source)
    names = ["held", "free"]
    if extension != "msh":
        source = tmp_path / f"other.{extension}"
    if extension == "inp":
        # Sets of several blocks are not written correctly.
        kinds = dict.fromkeys(block.type for block in mesh.cells)
        cells = {kind: mesh.get_cells_type(kind) for kind in kinds}
        tags = {kind: mesh.get_cell_data("gmsh:physical", kind) for kind in kinds}
        own_tags = {name: mesh.field_data[name][0] for name in names}
        of = lambda tag: [np.flatnonzero(tags[k] == tag) if "tri" in k else [] for k in kinds]
        sets = {name: of(tag) for name, tag in own_tags.items()}
        meshio.Mesh(mesh.points, cells, cell_sets=sets).write(source)
    elif extension != "msh":
        # The format stores only the values of an array, not the names of groups.
        names = [f"surface {mesh.field_data[name][0]}" for name in names]
        array = {"gmsh:physical": mesh.cell_data["gmsh:physical"]}
        meshio.Mesh(mesh.points, mesh.cells, cell_data=array).write(source)
    other = tmp_path / "other.msh"
    myovib.write_mesh(other, *myovib.read_mesh(source))
    assert deflection(other, *names) == equal(deflection(own))


def test_a_file_of_vtk_has_groups_fields_and_sets(tmp_path):
    pytest.importorskip("meshio")
    pyvista = pytest.importorskip("pyvista", exc_type=ImportError)
    points, cells, held, free = box()
    kind = pyvista.CellType
    both = {kind.TETRA: cells, kind.TRIANGLE: np.vstack([held, free])}
    grid = pyvista.UnstructuredGrid(both, points)
    is_cell = grid.celltypes == kind.TETRA
    grid.cell_data["part"] = np.where(is_cell, grid.cell_centers().points[:, 0] > 0.04, 7)
    last = np.flatnonzero(~is_cell)[-len(free) :]
    grid.cell_data["part"][last] = 8
    stiff = 1.0 + points[:, 0] / 0.08
    grid.point_data["stiff"] = stiff
    # Regression: data about the file were interpreted as names of groups.
    grid.field_data["TimeValue"] = [0.5]
    grid.save(tmp_path / "grid.vtu")
    read, groups, fields = myovib.read_mesh(tmp_path / "grid.vtu", group="part")
    assert (read == points).all() and (fields["stiff"] == stiff).all()
    assert {name: len(own) for name, own in groups.items()} == {
        "volume 0": 12,
        "volume 1": 12,
        "surface 7": 2,
        "surface 8": 2,
    }
    path = tmp_path / "grid.msh"
    myovib.write_mesh(path, read, groups, fields)
    found = deflection(path, "surface 7", "surface 8", 'spatial_factor = { field = "stiff" }')
    myovib.write_mesh(path, points, {"held": held, "free": free, "tissue": cells})
    exact = deflection(path, material='spatial_factor = "1 + x / 0.08"')
    assert found == equal(exact)


ABAQUS = """*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 0., 1., 0.
4, 0., 0., 1.
5, 1., 1., 1.
*ELEMENT, TYPE=C3D4
1, 1, 2, 3, 4
2, 2, 5, 3, 4
*ELEMENT, TYPE=CPS3
3, 1, 3, 2
*ELSET, ELSET=part
1, 3
*NSET, NSET=corner
4
"""


def test_sets_keep_their_names(tmp_path):
    pytest.importorskip("meshio")
    path = tmp_path / "sets.inp"
    path.write_text(ABAQUS)
    groups = {name: own.tolist() for name, own in myovib.read_mesh(path)[1].items()}
    assert groups == {
        "volume part": [[0, 1, 2, 3]],
        "surface part": [[0, 2, 1]],
        "ungrouped": [[1, 4, 2, 3]],
        "corner": [[3]],
    }
    # meshio does not read sets of sets.
    path.write_text(ABAQUS + "*ELSET, ELSET=whole\npart\n")
    with pytest.raises(ValueError, match="whole"):
        myovib.read_mesh(path)


def test_a_mesh_that_cannot_be_read_or_written_is_refused(tmp_path):
    points, cells, held, free = box()
    path = tmp_path / "body.msh"
    for change, word in [
        ({"points": points[:, :1]}, "shape"),
        ({"groups": {"quads": cells[:, [0, 1, 2, 3, 3]]}}, "quads"),
        ({"groups": {"outside": cells + 1}}, "outside"),
        ({"groups": {"real": cells + 0.5}}, "real"),
        ({"groups": {'a"b': cells}}, "quotes"),
        ({"points": points * np.nan}, "finite"),
        ({"fields": {"short": points[1:]}}, "short"),
        ({"fields": {"single": 1.0}}, "single"),
    ]:
        arguments = {"points": points, "groups": {"tissue": cells}, "fields": {}, **change}
        with pytest.raises(ValueError, match=word):
            myovib.write_mesh(path, **arguments)
        assert not path.exists()
    meshio = pytest.importorskip("meshio")
    meshio.Mesh(points, [("quad", cells)]).write(tmp_path / "quads.vtu")
    with pytest.raises(ValueError, match="quad"):
        myovib.read_mesh(tmp_path / "quads.vtu")
    meshio.Mesh(points, [("tetra", cells)]).write(tmp_path / "plain.vtu")
    with pytest.raises(ValueError, match="region"):
        myovib.read_mesh(tmp_path / "plain.vtu", group="region")
    for values in (np.linspace(0.0, 1.0, len(cells)), np.ones((len(cells), 3))):
        mesh = meshio.Mesh(points, [("tetra", cells)], cell_data={"part": [values]})
        mesh.write(tmp_path / "real.vtu")
        with pytest.raises(ValueError, match="part"):
            myovib.read_mesh(tmp_path / "real.vtu", group="part")
    for name, text in (("wrong.vtu", "no mesh"), ("wrong.inp", "*NODE\n1, abc, 0., 0.\n")):
        (tmp_path / name).write_text(text)
        with pytest.raises(ValueError, match=name):
            myovib.read_mesh(tmp_path / name)


@pytest.mark.parametrize("dtype", ["uint8", "uint64", "int32"])
def test_indices_of_any_integer_type_are_written(tmp_path, dtype):
    points = np.random.default_rng(1).random((256, 3))
    cells = np.array([[252, 253, 254, 255]])
    texts = []
    for kind in (dtype, "int64"):
        myovib.write_mesh(tmp_path / "body.msh", points, {"tissue": cells.astype(kind)})
        texts.append((tmp_path / "body.msh").read_text())
    assert texts[0] == texts[1]


def test_vectors_of_cells_are_excluded_with_a_warning(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, cells, _, _ = box()
    data = {"fiber": [np.tile([1.0, 0.0, 0.0], (len(cells), 1))]}
    meshio.Mesh(points, [("tetra", cells)], cell_data=data).write(tmp_path / "grid.vtu")
    with pytest.warns(UserWarning, match="fiber"):
        assert myovib.read_mesh(tmp_path / "grid.vtu")[2] == {}


def test_arrays_of_known_programs_are_groups(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, cells, held, _ = box()
    blocks = [("tetra", cells), ("triangle", held)]
    for array, found in (("nastran:ref", {"volume 1", "surface 9"}), ("part", {"ungrouped"})):
        data = {array: [np.full(len(cells), 1), np.full(len(held), 9)]}
        meshio.Mesh(points, blocks, cell_data=data).write(tmp_path / "grid.vtu")
        if array == "part":
            with pytest.warns(UserWarning, match="part"):
                groups = myovib.read_mesh(tmp_path / "grid.vtu")[1]
        else:
            groups = myovib.read_mesh(tmp_path / "grid.vtu")[1]
        assert set(groups) == found
