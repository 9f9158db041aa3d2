"""Checks that the Python examples of the guide run."""

import re
from pathlib import Path

import pytest

GUIDE = Path(__file__).parent.parent.parent / "docs" / "src"


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
