"""From a mesh to a figure: a strip of tissue is pushed at its top, for two stiffnesses.

    python mesh_to_figure.py [figure.png]

The mesh is created from arrays. A mesh file from Gmsh can be used instead.
"""

# %% A mesh: 12 x 3 squares of 5 mm, each cut into two triangles
import sys
import tempfile
from pathlib import Path

import numpy as np

import myovib

nx, ny, size = 12, 3, 0.005
points = [(i * size, j * size) for j in range(ny + 1) for i in range(nx + 1)]
number = np.arange(len(points)).reshape(ny + 1, nx + 1)
a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
groups = {
    "wall": np.stack([number[:-1, 0], number[1:, 0]], axis=-1),
    "top": np.stack([number[-1, 1:], number[-1, :-1]], axis=-1),
    "tissue": np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3),
}
folder = Path(tempfile.mkdtemp())
myovib.write_mesh(folder / "strip.msh", points, groups)

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
