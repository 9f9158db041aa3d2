"""Scenes: bitwise equality with results of the program, interrupts, sweeps, results."""

import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import myovib
from myovib import Probe, Scene, _native

EXAMPLES = Path(__file__).parent.parent / "examples"
GALLERY = Path(__file__).parent.parent.parent / "examples"
OF_PACKAGE = [sys.executable, "-c", "import sys; from myovib._program import main; sys.exit(main())"]


def program(*arguments, cwd):
    """Run the program named by MYOVIB_PROGRAM, or the program of the package."""
    named = os.environ.get("MYOVIB_PROGRAM")
    command = [named] if named else OF_PACKAGE
    return subprocess.run([*command, *arguments], cwd=cwd, capture_output=True, text=True)


@pytest.fixture(scope="module")
def result():
    return Scene.builtin("init").set("time.end", 0.3).run()


def test_the_bits_are_those_of_the_program(result, tmp_path):
    done = program("run", "init", "--set", "time.end=0.3", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {path.name for path in result.folder.iterdir()}
    for name in names - {"run.json", "report.html", "checkpoint.json", "manifest.jsonl"}:
        assert (tmp_path / "out" / name).read_bytes() == (result.folder / name).read_bytes(), name


def test_a_run_that_its_condition_ended_is_a_success():
    stop = [{"type": "displacement", "at": [0.0, 0.0], "above": 1e-9}]
    result = Scene.builtin("init").set("time.end", 0.05).set("stop", stop).run()
    assert (result.outcome, result.document["reason"]) == ("stopped", "event")
    assert result.success


def test_a_large_body_in_threads_has_the_same_bits():
    shown = """
import os, myovib
def threads(): return len(os.listdir("/proc/self/task"))
alone = threads()
def bits():
    result = myovib.Scene.builtin("muscle3d").set("time.end", 1e-3).run()
    return (result.folder / "state.json").read_bytes()
one = bits()
myovib.use_threads(2)
print(threads() - alone, one == bits())
"""
    if not Path("/proc/self/task").is_dir():
        pytest.skip("the system does not list threads")
    done = subprocess.run([sys.executable, "-c", shown], capture_output=True, text=True)
    assert done.stdout.split() == ["2", "True"], done.stderr
    with pytest.raises(ValueError):
        myovib.use_threads(0)


def test_a_result_has_probes_counters_fields_and_a_report(result):
    assert result.outcome == "finished" and result.success
    origin = result.probes["origin"]
    assert list(origin) == ["t", "u_x", "u_y", "p"]
    assert origin["t"] == pytest.approx(np.arange(31) * 0.01)
    with pytest.raises(KeyError, match="the columns are t, u_x"):
        origin["u_z"]
    assert result.statistics["steps"] == result.document["steps"] > 0
    assert result.fields.times == pytest.approx([0, 0.1, 0.2, 0.3])
    fields = result.fields[3]
    assert fields["points"].shape == fields["u"].shape
    assert fields["cells"].max() == len(fields["points"]) - 1
    assert result.report().startswith("<!doctype html>")
    assert "steps" in result._repr_html_() and "finished" in repr(result)
    copy = pickle.loads(pickle.dumps(result))
    assert (copy.probes["origin"]["u_y"] == origin["u_y"]).all()


def test_a_field_is_that_of_the_nearest_time(result):
    fields = result.fields
    assert (fields.field("u", 0.12) == fields[1]["u"]).all()
    assert (fields.field("u") == fields[3]["u"]).all()
    # The times in the file have thirteen digits.
    assert (fields.field("u", 0.3 * (1 + 1e-12)) == fields[3]["u"]).all()
    with pytest.raises(KeyError, match="von_mises"):
        fields.field("stress")
    # Regression: the last field was returned, or the first field for NaN.
    for t in (99.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError):
            fields.field("u", t)


def test_a_mesh_of_pyvista_has_the_fields(result):
    pyvista = pytest.importorskip("pyvista", exc_type=ImportError)
    mesh = result.fields.mesh(0.2)
    assert isinstance(mesh, pyvista.UnstructuredGrid)
    arrays = result.fields[2]
    assert mesh.n_cells == len(arrays["cells"])
    assert (mesh.points == arrays["points"]).all() and (mesh["u"] == arrays["u"]).all()


def test_probes_are_plotted(result):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    origin = result.probes["origin"]
    axes = origin.plot()
    assert [line.get_label() for line in axes.lines] == ["u_x", "u_y", "p"]
    assert (axes.lines[1].get_ydata() == origin["u_y"]).all()
    assert axes.get_xlabel() == "time, s"
    assert len(origin.plot("p", ax=axes).lines) == 4


def test_a_frame_of_pandas(result):
    pytest.importorskip("pandas")
    frame = result.probes["origin"].frame()
    assert list(frame.columns) == ["u_x", "u_y", "p"] and frame.index.name == "t"


def test_values_are_set_as_they_are(result):
    scene = Scene.builtin("init").set("time.end", 0.02).set("solid.bulk_modulus", float("inf"))
    scene.set("solid.formulation", "velocity").set("solid.rayleigh_stiffness", 0).set("probe[0].quantities", ["u"])
    document = scene.run().document
    assert document["scene"]["solid"]["formulation"] == "velocity"
    assert document["scene"]["probe"][0]["quantities"] == ["u"]
    softer = scene.copy().set("material[0].c10", np.float64(5e3))
    assert "material[0].c10" not in scene.changes and softer.changes["material[0].c10"] == "5000.0"


def test_a_section_set_again_replaces_changes_of_its_entries():
    # Regression: the changes were applied in the wrong order, so the changed entry did not exist.
    scene = myovib.Scene.builtin("init").set("time.end", 0.01)
    scene.set("body_force", [{"y": -1.0}]).set("body_force[0].x", 2.0)
    assert list(scene.changes) == ["time.end", "body_force", "body_force[0].x"]
    scene.set("body_force", [{"y": -3.0}])
    assert list(scene.changes) == ["time.end", "body_force"]
    scene.set("body_force", None)
    assert scene.changes["body_force"] == ""


def test_what_is_wrong_is_told_with_its_place(tmp_path):
    with pytest.raises(myovib.SceneError, match="kapa"):
        Scene.builtin("init").set("solid.kapa", 1).run()
    with pytest.raises(ValueError, match="table2-31"):
        Scene.builtin("nothing")
    with pytest.raises(FileNotFoundError):
        Scene.read(tmp_path / "none.toml")
    scene = Scene.builtin("init").set("time.end", 0.02)
    scene.run(tmp_path / "out")
    with pytest.raises(myovib.SceneError, match="already contains results"):
        scene.run(tmp_path / "out")
    assert scene.run(tmp_path / "out", existing="overwrite").success


def test_check_and_modes():
    scene = Scene.builtin("table2-31")
    found = scene.check()
    assert found["body"]["index"] == 2 and "unknowns" in found["text"]
    modes = scene.modes(3)
    assert len(modes) == 3
    # `check` computes the same modes with different code.
    assert [m["frequency"] for m in modes] == pytest.approx(found["body"]["slow_modes"][:3], rel=1e-6)
    # Along each of the two axes, the sum of the effective masses is at most the mass.
    assert modes.preload_time is None and modes.shape(2).shape == modes.points.shape
    assert all(np.abs(modes.shape(k)).max() > 0.0 for k in range(3))
    assert all(0.0 < sum(m["effective_mass"]) <= 2.0 * modes.mass for m in modes)


def test_a_periodic_state_repeats():
    scene = Scene.builtin("figure3").set("integrator.method", "radau9").set("integrator.max_order", None)
    scene.set("rod.load", {"type": "sine", "amplitude": 1.0, "frequency": 8.0})
    found = scene.set("chain", []).set("probe", [{"name": "end", "type": "rod", "at": 0.05}]).periodic()
    u = found.probes["end"]["u"]
    assert found.document["is_stable"] and abs(u[0] - u[-1]) < 1e-5 * max(abs(u))
    assert found.continuation is None
    curve = scene.periodic(continuation=("rod.load.amplitude", 1, 2)).continuation
    amplitudes = curve["end.u"]
    assert (curve["rod.load.amplitude"][0], curve["rod.load.amplitude"][-1]) == (1.0, 2.0)
    # The rod is linear, and the states have a tolerance of 1e-6.
    assert amplitudes[-1] == pytest.approx(2 * amplitudes[0], rel=1e-5)


def test_response_at_zero_is_the_equilibrium():
    scene = Scene.builtin("init").set("traction[0].response", {"y": 100.0})
    found = scene.response([0.0, 5.0])
    probe = found.probes["origin"]
    assert list(probe["f"]) == [0.0, 5.0] and scene.changes.keys() == {"traction[0].response"}
    amplitude = probe.complex("u_y")
    polar = probe.amplitude("u_y") * np.exp(1j * np.radians(probe.phase("u_y")))
    assert amplitude == pytest.approx(polar) and (probe.amplitude("u_y") >= 0).all()
    still = scene.copy().set("analysis", "static").set("traction[0].y", 1.0).run()
    # The response is linear up to terms of the size of the strain, 1e-5.
    assert amplitude[0].real == pytest.approx(100 * still.probes["origin"]["u_y"][0], rel=1e-4)
    assert amplitude[0].imag == 0.0


@pytest.fixture
def forced():
    return Scene.builtin("init").set("traction[0].response", {"y": 100.0, "phase": 30.0})


def test_amplitudes_are_those_of_the_program_and_of_its_document(forced, tmp_path):
    found = forced.response("2..30:5")
    set_load = "traction[0].response={ y = 100.0, phase = 30.0 }"
    done = program("response", "init", "--frequencies", "2..30:5", "--set", set_load, "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "origin.csv").read_bytes() == (found.folder / "origin.csv").read_bytes()
    document = json.loads((tmp_path / "out" / "run.json").read_text())
    for key in ("frequencies", "probes", "peaks"):
        assert document[key] == found.document[key], key
    [curves] = [curves for curves in document["probes"] if curves["name"] == "origin"]
    probe = found.probes["origin"]
    assert list(probe["f"]) == document["frequencies"] == [2.0, 9.0, 16.0, 23.0, 30.0]
    assert curves["columns"] == ["u_x", "u_y", "p"]
    for k, name in enumerate(curves["columns"]):
        pairs = np.array([row[k] for row in curves["amplitudes"]])
        value = probe.complex(name)
        assert (value == pairs @ [1, 1j]).all() and np.abs(value).min() > 0.0
        # The bounds allow rounding errors of a few units in the last place.
        assert probe.amplitude(name) == pytest.approx(np.abs(value), rel=1e-14)
        assert probe.phase(name) == pytest.approx(np.degrees(np.angle(value)), abs=1e-12)
    # Below resonance, the motion is in phase with the load except for the effect of damping.
    assert 20.0 < forced.response(0.5).probes["origin"].phase("u_y")[0] < 30.0


def test_frequencies_are_a_list_a_range_or_adaptive(forced):
    def frequencies(given):
        return list(forced.response(given).probes["origin"]["f"])

    assert frequencies([9, 2.0, np.float64(5.0), 2]) == [2.0, 5.0, 9.0]
    assert frequencies(np.linspace(1, 9, 3)) == frequencies("1..9:3") == frequencies("9, 1, 5") == [1.0, 5.0, 9.0]
    # The bound allows rounding errors of the powers.
    assert frequencies("1..100:3:log") == pytest.approx([1.0, 10.0, 100.0], rel=1e-14)
    assert list(forced.set("response", {"frequencies": "3..4:2"}).response().probes["origin"]["f"]) == [3.0, 4.0]
    adaptive = forced.response("1..20:adaptive:1e-4")
    f = adaptive.probes["origin"]["f"]
    assert (f[0], f[-1]) == (1.0, 20.0) and (np.diff(f) > 0.0).all()
    assert adaptive.document["interpolation_error"] <= 1e-4
    given = forced.response(f)
    assert given.document["interpolation_error"] is None
    assert (given.probes["origin"].complex("u_y") == adaptive.probes["origin"].complex("u_y")).all()
    # The peaks are interpolated, with errors of 1e-4 for adaptive frequencies and of 1e-2 for given frequencies.
    peaks = [[peak["frequency"] for peak in each.document["peaks"] if peak["column"] == "u_y"] for each in (given, adaptive)]
    assert len(peaks[0]) > 0 and peaks[0] == pytest.approx(peaks[1], rel=1e-2)


def test_invalid_responses_are_rejected_before_any_output(forced, tmp_path):
    for given in [-1.0, [5.0, -1.0], np.nan, np.inf, [], "", "fast", "1..2", "-1..60:5", "60..1:adaptive", "1..60:adaptive:0"]:
        with pytest.raises(myovib.SceneError, match="frequenc"):
            forced.response(given, tmp_path / "out")
    for given in [[None], ["5", "fast"], [1j]]:
        with pytest.raises((TypeError, ValueError)):
            forced.response(given, tmp_path / "out")
    # Cases: no load, a load without a harmonic part, no frequencies, and a rigid motion at 0 Hz.
    unloaded = Scene.builtin("init")
    for scene, given in [
        (unloaded, [5.0]),
        (unloaded.copy().set("traction[0].response", {"y": 0.0}), [5.0]),
        (forced.copy(), None),
        (forced.copy().set("fixed[0].components", ["y"]), [0.0, 5.0]),
    ]:
        with pytest.raises(myovib.SceneError):
            scene.response(given, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_arguments_out_of_range_are_rejected(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = Scene.builtin("init").set("time.end", 0.01)
    key, data = "material[0].c10", {"t": [0.0], "origin.u_y": [0.0]}
    for call, error in [
        (lambda: scene.run(""), ValueError),  # regression: wrote into the current folder
        (lambda: scene.response(b"1"), TypeError),  # regression: computed the response at 49 Hz
        (lambda: scene.sweep({"integrator.rtol": []}), myovib.SceneError),  # regression: used the default
        (lambda: scene.sweep({"integrator.rtol": [1e-4, None]}), myovib.SceneError),
        (lambda: scene.sweep({key: [1e4]}, threads=0), ValueError),
        (lambda: scene.sweep({key: [1e4]}, threads=-1), ValueError),
        (lambda: scene.fit(data, starts=0), ValueError),  # regression: used one starting point
        (lambda: scene.fit(data, starts=1.5), TypeError),
        (lambda: scene.fit(data, max_iterations=0), ValueError),
        (lambda: scene.fit(data, seed=-1), ValueError),
    ]:
        with pytest.raises(error):
            call()
    for name, value in [("tolerance", np.nan), ("tolerance", 1.0), ("starts", 10**6)]:
        with pytest.raises(myovib.SceneError, match=name):
            scene.fit(data, **{name: value})
    assert list(tmp_path.iterdir()) == []


def test_one_frequency_may_be_a_number():
    scene = Scene.builtin("init").set("traction[0].response", {"y": 100.0})
    assert list(scene.response(5.0).probes["origin"]["f"]) == [5.0]
    assert list(scene.response(f for f in (4, 5)).probes["origin"]["f"]) == [4.0, 5.0]


def test_a_sweep_has_a_row_for_each_case():
    scene = Scene.builtin("init").set("time.end", 0.05)
    peak = {"peak": "max(origin.u_y)"}
    sweep = scene.sweep({"material[0].c10": [1e4, 5e3]}, results=peak, threads=2)
    assert [row["outcome"] for row in sweep.rows] == ["finished"] * 2
    assert [row["material[0].c10"] for row in sweep.rows] == [1e4, 5e3]
    alone = scene.copy().set("material[0].c10", 5e3).run()
    origin = alone.probes["origin"]
    assert (sweep.case(2).probes["origin"]["u_y"] == origin["u_y"]).all()
    assert sweep.rows[1]["peak"] == origin["u_y"].max()
    assert repr(sweep) == "SweepResult(2 cases: 2 finished)"
    last = [run.document["scene"]["material"][0]["c10"] for run in [sweep[1], sweep[-1], *sweep[1:], list(sweep)[1]]]
    assert last == [5e3] * 4
    with pytest.raises(IndexError):
        sweep[2]


def test_a_frame_of_a_sweep_has_the_columns_of_its_table():
    pytest.importorskip("pandas")
    sweep = Scene.builtin("init").set("time.end", 0.01).sweep({"material[0].c10": [1e4, 5e3]}, results={"a": "max(origin.u_y)"})
    frame = sweep.frame()
    assert list(frame.columns[:3]) == ["material[0].c10", "a", "outcome"] and frame.columns[-1] == "message"
    assert list(frame.index) == [1, 2] and list(frame["material[0].c10"]) == [1e4, 5e3]


def test_a_dataset_of_xarray_has_a_dimension_for_each_key():
    pytest.importorskip("xarray")
    scene = Scene.builtin("table2-31").set("time.end", 0.01)
    sweep = scene.sweep(
        {"solid.bulk_modulus": [1e5, float("inf")], "material[0].c10": [5e3, 1e4, 2e4]},
        results={"peak": "max(origin.u_y)"},
    )
    peak = sweep.dataset()["peak"]
    assert peak.shape == (2, 3) and peak.dims == tuple(sweep.axes)
    rows = [row for row in sweep.rows if row["solid.bulk_modulus"] == "inf"]
    assert len(rows) == 3
    for row in rows:
        place = {"solid.bulk_modulus": float("inf"), "material[0].c10": row["material[0].c10"]}
        assert float(peak.sel(place)) == row["peak"]


def test_progress_is_told():
    lines = []
    Scene.builtin("init").set("time.end", 1.0).run(progress=lines.append)
    assert lines and all(re.search(r"t = .* of 1 s", line) for line in lines)


@pytest.mark.parametrize("exception", [ZeroDivisionError, KeyboardInterrupt])
def test_exceptions_of_progress_come_through(exception):
    parameters = [{"key": "material[0].c10"}]
    scene = Scene.builtin("init").set("time.end", 1.0).set("parameter", parameters)
    scene.set("traction[0].y.shift", 1)

    def show(line):
        raise exception("mine")

    data = {"t": [0.5, 0.9, 1.0], "origin.u_y": [0.0, 1e-3, 1e-3]}
    for compute in (
        scene.run,
        lambda progress: scene.sweep({"solid.rayleigh_mass": [1.0, 2.0]}, progress=progress),
        scene.sensitivity,
        scene.stiffness_map,
        lambda progress: scene.fit(data, progress=progress),
    ):
        with pytest.raises(exception, match="mine"):
            compute(progress=show)


def test_names_of_columns_may_be_quoted(tmp_path):
    path = tmp_path / "probe.csv"
    path.write_text('t,"factor_a,b","c ""d"""\n0.0,1.0,2.0\n1.0,3.0,4.0\n')
    probe = Probe._read(path)
    assert list(probe) == ["t", "factor_a,b", 'c "d"']
    assert probe["factor_a,b"].tolist() == [1.0, 3.0]


def test_a_stop_condition_is_a_success():
    stop = {"type": "displacement", "at": [0.0, 0.0], "above": 1e-9}
    stopped = Scene.builtin("init").set("time.end", 0.1).set("stop", [stop]).run()
    assert stopped.document["reason"] == "event" and stopped.success
    assert stopped.document["t_reached"] < 0.1


def test_notes_are_warnings(monkeypatch):
    run = _native.run
    monkeypatch.setattr(_native, "run", lambda *arguments: [*run(*arguments), "look at this"])
    with pytest.warns(UserWarning, match="look at this"):
        result = Scene.builtin("init").set("time.end", 0.02).run()
    assert result.notes[-1] == "look at this"


def test_lists_and_texts_with_commas_are_single_values():
    scene = Scene.builtin("cantilever").set("time.end", 0.01)
    sweep = scene.sweep({"mesh.cells": [[2, 1], [4, 2]], "title": ["a,b", "c"]}, threads=1)
    assert [row["outcome"] for row in sweep.rows] == ["finished"] * 4
    scenes = [sweep.case(k + 1).document["scene"] for k in range(4)]
    assert [scene["mesh"]["cells"] for scene in scenes] == [[2, 1], [2, 1], [4, 2], [4, 2]]
    assert [scene["title"] for scene in scenes] == ["a,b", "c"] * 2


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_check_and_modes(seconds_to_an_end):
    scene = Scene.builtin("muscle3d")
    # Signals are checked every 0.05 s. The remainder is a margin for a busy machine.
    assert seconds_to_an_end(scene.check) < 0.5
    assert seconds_to_an_end(lambda: [scene.modes(100) for _ in range(100)]) < 0.5


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("sent", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_signals_end_the_program_of_the_package_and_keep_its_results(tmp_path, sent):
    arguments = ["run", "table2-1", "--quiet", "--set", "time.end=1000.0"]
    program = subprocess.Popen([*OF_PACKAGE, *arguments], cwd=tmp_path, stdout=subprocess.DEVNULL)
    table = tmp_path / "out/origin.csv"
    while program.poll() is None and not (table.exists() and table.stat().st_size > 100):
        time.sleep(0.01)
    program.send_signal(getattr(signal, sent))
    assert program.wait(30) == 130
    assert json.loads((tmp_path / "out/run.json").read_text())["reason"] == "interrupted"


def test_two_threads_run_two_scenes_while_python_goes_on(result):
    found = {}

    def run(end):
        found[end] = Scene.builtin("init").set("time.end", end).run()

    threads = [threading.Thread(target=run, args=(end,)) for end in (0.3, 0.4)]
    for thread in threads:
        thread.start()
    turns = 0
    while any(thread.is_alive() for thread in threads):
        turns += 1
        time.sleep(0.001)
    for thread in threads:
        thread.join()
    assert turns > 3, "Python's lock was free"
    assert (found[0.3].probes["origin"]["u_y"] == result.probes["origin"]["u_y"]).all()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_a_run(seconds_to_an_end):
    late = seconds_to_an_end(Scene.builtin("table2-1").set("time.end", 1000.0).run)
    # Signals are checked every 0.05 s and at the next step, after about 1 ms. The remainder is a margin for a busy machine.
    assert late < 0.5


def test_the_example_goes_from_a_mesh_to_a_figure(tmp_path):
    arguments = ["figure.png"] if has_matplotlib() else []
    done = subprocess.run(
        [sys.executable, EXAMPLES / "mesh_to_figure.py", *arguments],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("finished") == 2
    assert not arguments or (tmp_path / "figure.png").stat().st_size > 1000


def test_the_pendulum_of_the_gallery_has_its_period(tmp_path):
    done = subprocess.run(
        [sys.executable, GALLERY / "pendulum.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def has_matplotlib():
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return False
    return True


def test_each_failure_in_a_process_prints_one_error(capfd):
    # Regression: only the first error of a process was printed.
    for _ in range(2):
        assert _native.program(["myovib", "check", "missing.toml"]) == 2
        assert capfd.readouterr().err.count("error:") == 1
