"""From a mesh to a figure: a strip of tissue that is pushed at its top, for two stiffnesses.

    python mesh_to_figure.py [figure.png]

The mesh is written here in the format of Gmsh. A file from Gmsh can be used instead.
"""

# %% A mesh: 12 x 3 squares of 5 mm, each cut in two triangles
import sys
import tempfile
from pathlib import Path

import numpy as np

import myovib

nx, ny, size = 12, 3, 0.005
number = lambda i, j: 1 + i + (nx + 1) * j
nodes = [(i * size, j * size) for j in range(ny + 1) for i in range(nx + 1)]
wall = [(number(0, j), number(0, j + 1)) for j in range(ny)]
top = [(number(i + 1, ny), number(i, ny)) for i in range(nx)]
triangles = []
for j in range(ny):
    for i in range(nx):
        a, b = number(i, j), number(i + 1, j)
        c, d = number(i + 1, j + 1), number(i, j + 1)
        triangles += [(a, b, c), (a, c, d)]


def gmsh(nodes, groups):
    """Return the text of a mesh; `groups` maps each name to the dimension and the elements of a group."""
    names, entities, blocks = [], {1: [], 2: []}, []
    element = 0
    for tag, (name, (dimension, cells)) in enumerate(groups.items(), start=1):
        names.append(f'{dimension} {tag} "{name}"')
        entities[dimension].append(f"{tag} 0 0 0 1 1 0 1 {tag} 0")
        lines = []
        for cell in cells:
            element += 1
            lines.append(" ".join(map(str, (element, *cell))))
        blocks.append(f"{dimension} {tag} {dimension} {len(cells)}\n" + "\n".join(lines))
    n = len(nodes)
    tags = "\n".join(map(str, range(1, n + 1)))
    points = "\n".join(f"{x!r} {y!r} 0" for x, y in nodes)
    surface = len(groups)
    sections = {
        "MeshFormat": "4.1 0 8",
        "PhysicalNames": f"{len(names)}\n" + "\n".join(names),
        "Entities": f"0 {len(entities[1])} {len(entities[2])} 0\n"
        + "\n".join(entities[1] + entities[2]),
        "Nodes": f"1 {n} 1 {n}\n2 {surface} 0 {n}\n{tags}\n{points}",
        "Elements": f"{len(groups)} {element} 1 {element}\n" + "\n".join(blocks),
    }
    return "".join(f"${name}\n{body}\n$End{name}\n" for name, body in sections.items())


folder = Path(tempfile.mkdtemp())
mesh = gmsh(nodes, {"wall": (1, wall), "top": (1, top), "tissue": (2, triangles)})
(folder / "strip.msh").write_text(mesh)

# %% A scene
(folder / "strip.toml").write_text("""
title = "A strip of tissue, pushed on its top"

[time]
end = 0.5

[mesh]
type = "file"
path = "strip.msh"

[solid]
bulk_modulus = 1e5
rayleigh_stiffness = 1e-4

[[material]]
group = "tissue"
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2

[[fixed]]
group = "wall"

[[traction]]
group = "top"
y = { type = "ramped-sine", amplitude = 2.0, frequency = 2.0 }

[[probe]]
name = "tip"
type = "point"
at = [0.06, 0.0075]
quantities = ["u"]
interval = 0.005
""")
scene = myovib.Scene.read(folder / "strip.toml")
print(scene.check()["text"])

# %% Two materials
results = {}
for c10 in (1e4, 5e3):
    results[c10] = scene.set("material[0].c10", c10).run()
    print(f"c10 = {c10:g} Pa: {results[c10]}")
largest = {c10: np.abs(result.probes["tip"]["u_y"]).max() for c10, result in results.items()}
assert largest[5e3] > 1.5 * largest[1e4], "slowly pushed, a softer strip moves more"

# %% A figure
if len(sys.argv) > 1:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for c10, result in results.items():
        tip = result.probes["tip"]
        plt.plot(tip["t"], 1e3 * tip["u_y"], label=f"c10 = {c10:g} Pa")
    plt.xlabel("t, s")
    plt.ylabel("tip, mm")
    plt.legend()
    plt.savefig(sys.argv[1])
