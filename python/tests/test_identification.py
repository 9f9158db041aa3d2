"""Sensitivities and fits, compared with difference quotients and known values, and their files."""

import pickle
import os

import numpy as np
import pytest

import myovib
from myovib import Scene
from myovib._identification import experiments


def scene(**changes):
    """Return a scene of 0.1 s with the muscle under a load that rises immediately, and with a specified method."""
    it = Scene.builtin("init").set("time.end", 0.1).set("traction[0].y.shift", 1)
    it.set("integrator", {"method": "radau9", "rtol": 1e-7})
    return it.set("probe[0].quantities", ["u"])


def short():
    """Return the scene with half of the duration and a looser tolerance."""
    return scene().set("time.end", 0.05).set("integrator.rtol", 1e-5)


@pytest.fixture(scope="module")
def sensitivity():
    parameters = [{"key": "material[0].c10"}, {"key": "solid.bulk_modulus"}]
    return scene().set("parameter", parameters).sensitivity()


def test_sensitivities_are_those_of_two_runs(sensitivity):
    assert sensitivity.outputs == ["origin.u_x", "origin.u_y"]
    assert sensitivity.parameters == ["material[0].c10", "1/solid.bulk_modulus"]
    ends = {
        c10: scene().set("material[0].c10", c10).run().probes["origin"] for c10 in (0.99e4, 1.01e4)
    }
    assert (ends[0.99e4]["t"] == sensitivity.t).all()
    difference = (ends[1.01e4]["u_y"] - ends[0.99e4]["u_y"]) / 200
    # Central differences over 2 % have a truncation error of about 1e-4 of the maximum. The integration adds 1e-7 / 1e-2.
    largest = np.abs(difference).max()
    assert sensitivity.derivatives[:, 1, 0] == pytest.approx(difference, abs=1e-3 * largest)
    u_y = sensitivity.values[:, 1]
    share = np.sqrt(np.mean(sensitivity.derivatives[:, 1] ** 2, axis=0) / np.mean(u_y**2))
    assert sensitivity.importance[1] == pytest.approx(share * sensitivity.scales, rel=1e-12)


def test_a_result_is_shown_kept_and_written(sensitivity):
    copy = pickle.loads(pickle.dumps(sensitivity))
    assert (copy.derivatives == sensitivity.derivatives).all()
    assert "origin.u_y" in sensitivity._repr_html_() and "by material[0].c10" in repr(sensitivity)
    names = {path.name for path in sensitivity.folder.iterdir()}
    assert names >= {"sensitivity.csv", "sensitivity.json", "sensitivity.svg"}


def test_the_elements_of_a_map_add_up_to_the_stiffness_of_all(tmp_path):
    elements = short().stiffness_map(tmp_path)
    assert set(elements) == {"origin.u_x", "origin.u_y"}
    whole = short().set("parameter", [{"key": "material[0].stress_scale"}]).sensitivity()
    for k, name in enumerate(whole.outputs):
        u, by_stiffness = whole.values[:, k], whole.derivatives[:, k, 0]
        total = (u * by_stiffness).sum() / (u * u).sum()
        # Forward sensitivities are computed to a third of the tolerance, 1e-4.
        assert elements[name].sum() == pytest.approx(total, rel=1e-3)
    assert {path.name for path in tmp_path.iterdir()} == {
        "stiffness.vtu",
        "stiffness.svg",
        "stiffness.json",
        "manifest.jsonl",
        ".lock",
    }


def test_what_cannot_be_identified_is_told_with_its_place():
    with pytest.raises(myovib.SceneError, match="defines no parameters"):
        scene().sensitivity()
    wanted = scene().set("parameter", [{"key": "solid.kapa"}])
    with pytest.raises(myovib.SceneError, match="solid.kapa"):
        wanted.sensitivity()
    wanted.set("parameter", [{"key": "material[0].c10"}])
    with pytest.raises(ValueError, match=r"must have equal lengths: t \(2,\), origin.u_y \(1,\)"):
        wanted.fit({"t": [0.0, 0.1], "origin.u_y": [0.0]})
    with pytest.raises(myovib.SceneError, match="`tip`"):
        wanted.fit({"t": [0.05, 0.1], "tip": [0.0, 0.0]})


def test_a_data_frame_is_as_good_as_a_mapping(tmp_path):
    class Frame:  # the required part of a data frame
        def keys(self):
            return ["t", "tip"]

        def __getitem__(self, name):
            return {"t": [0.1, 0.2], "tip": [1.0, np.nan]}[name]

    [(path, changes)] = experiments(Frame(), tmp_path)
    assert path.read_text() == "t,tip\n0.1,1.0\n0.2,\n" and not changes


def test_masked_measurements_were_not_made(tmp_path):
    masked = np.ma.array([1.0, 2.0], mask=[False, True])
    [(path, _)] = experiments({"t": [0.1, 0.2], 'a "b", c': masked}, tmp_path)
    assert path.read_text() == 't,"a ""b"", c"\n0.1,1.0\n0.2,\n'


@pytest.mark.parametrize(
    "column",
    [
        [1 + 1j],
        np.array([1j]),
        np.array(["2026-01-01"], dtype="M8[D]"),
        np.array([1 + 1j], dtype=object),
        np.array(["one"], dtype=object),
    ],
)
def test_measurements_that_are_not_real_numbers_are_refused(column, tmp_path):
    with pytest.raises(ValueError, match="column 'tip'"):
        experiments({"t": [0.1], "tip": column}, tmp_path)


def test_a_fit_of_arrays_and_a_file_finds_what_made_them(tmp_path):
    truth = {"material[0].c10": 1.3e4, "solid.bulk_modulus": 5e4}
    wanted = short().set("parameter", [{"key": key} for key in truth])
    experiments = []
    for amplitude in (100.0, 200.0):
        made = short().set("traction[0].y.amplitude", amplitude)
        for key, value in truth.items():
            made.set(key, value)
        origin = made.run().probes["origin"]
        u_y = origin["u_y"].copy()
        u_y[3] = np.nan  # not measured
        data = {"t": origin["t"], "origin.u_y": u_y, "origin.u_x": origin["u_x"]}
        experiments.append((data, {"traction[0].y.amplitude": amplitude}))
    table = np.column_stack(list(experiments[1][0].values()))[1:]
    np.savetxt(tmp_path / "2.csv", table, "%.17g", ",", header="t,origin.u_y,origin.u_x", comments="")
    (tmp_path / "2.csv").write_text((tmp_path / "2.csv").read_text().replace("nan", ""))
    experiments[1] = (tmp_path / "2.csv", experiments[1][1])
    reported = []
    fit = wanted.fit(experiments, progress=reported.append)
    assert fit.converged and fit.message == "converged" and reported
    # The data have no noise, but the steps of the runs differ, so the outputs differ by about rtol = 1e-5. A relative change
    # of c10 changes the output by half as much, and a relative change of 1/bulk_modulus by a tenth as much.
    assert fit.values["material[0].c10"] == pytest.approx(1.3e4, rel=1e-4)
    assert fit.values["1/solid.bulk_modulus"] == pytest.approx(1 / 5e4, rel=1e-3)
    low, high = fit.intervals["material[0].c10"]
    assert low < fit.values["material[0].c10"] < high
    assert len(fit.residuals) == (2 * 6 - 1) + (2 * 5 - 1)
    assert fit.history["cost"][-1] < 1e-6 * fit.history["cost"][0]
    found = fit.scene().changes
    assert float(found["solid.bulk_modulus"]) == 1 / fit.values["1/solid.bulk_modulus"]
    assert "material[0].c10" not in wanted.changes
    copy = pickle.loads(pickle.dumps(fit))
    assert copy.values == fit.values and "1/solid.bulk_modulus" in copy._repr_html_()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_a_fit(seconds_to_an_end):
    wanted = scene().set("time.end", 100.0).set("parameter", [{"key": "material[0].c10"}])
    data = {"t": [1.0, 2.0, 100.0], "origin.u_y": [0.0, 0.0, 1e-3]}
    late = seconds_to_an_end(lambda: wanted.fit(data))
    # As in a run, signals are checked every 0.05 s and at the next step. The remainder is a margin for a busy machine.
    assert late < 0.5
