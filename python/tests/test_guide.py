"""Checks that the Python examples of the guide run."""

import math
import re
import shutil
from pathlib import Path

import pytest

import myovib

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "src"


@pytest.mark.parametrize("page", ["dae.md", "python.md"])
def test_python_blocks_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", (GUIDE / page).read_text(), re.S | re.M)
    assert blocks
    names = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)
    if page == "dae.md":
        # The pendulum falls by 1 m within a quarter of its period, about 0.6 s.
        assert names["s"].t_events[0][0] == pytest.approx(0.59, abs=0.02)
        # The bound is ten times the default tolerance of 1e-4.
        assert names["decayed"].dy_dp[0, 0, -1] == pytest.approx(-2 * math.exp(-1.4), abs=1e-3)


def test_the_fibers_of_the_guide_converge(tmp_path, monkeypatch):
    pytest.importorskip("meshio")
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "crates/scene/tests/data/organs/limb.msh", tmp_path)
    (block,) = re.findall(r"^```python\n(.*?)^```", (GUIDE / "materials.md").read_text(), re.S | re.M)
    exec(block)
    Path("limb.toml").write_text("""
analysis = "static"
[mesh]
type = "file"
path = "limb-fibers.msh"
[solid]
bulk_modulus = inf
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 5e3
fiber = "f0"
active = { type = "given", tension = 1e3 }
[[fixed]]
group = "held"
[[probe]]
name = "free"
type = "average"
group = "free"
""")
    scene = myovib.Scene.read("limb.toml")
    converging = scene.run().probes["free"]["u_z"][-1]
    parallel = scene.set("material[0].fiber", [0.0, 0.0, 1.0]).run().probes["free"]["u_z"][-1]
    # Fibers inclined by up to 5 degrees pull toward the apex.
    assert converging > 1.2 * parallel > 0
