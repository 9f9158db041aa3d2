"""Outputs of `solve_dae` that violate equations without derivatives."""

from types import SimpleNamespace

import numpy as np
import pytest
from myovib._outputs import violated

from test_dae_diagnosis import solved

METHODS = ["bdf", "radau5", "radau9", "radau13"]
RESISTANCE, OMEGA = 50.0, 2e3 * np.pi


def source(t):
    return 5.0 * np.sin(OMEGA * t)


def rectifier(diode):
    """Return F of a rectifier for a voltage and a current in A. `diode` is min or a smooth function."""

    def residual(t, y, yp):
        voltage, current = y
        return [1e-6 * yp[0] - current + voltage / 1e4, diode(current, current + (voltage - source(t)) / RESISTANCE)]

    return residual


def warnings_of_outputs(texts):
    return [text for text in texts if "violate equation 1 " in text]


def test_outputs_that_violate_equations_are_reported():
    # In some of these runs, a step misses a pulse of the current. Voltages are about 5, and currents are about 0.1.
    reported = 0
    for method in ("bdf", "radau5"):
        for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
            s, texts = solved(
                rectifier(min), (0, 5e-3), [0, 0], [0, 5 * OMEGA / RESISTANCE], method, rtol=rtol,
                atol=[rtol * 1e-2, rtol * 1e-4], t_eval=np.linspace(0, 5e-3, 132),
            )  # fmt: skip
            violation = max(abs(rectifier(min)(t, y, [0, 0])[1]) for t, y in zip(s.t[1:], s.y.T[1:], strict=True))
            is_wrong = violation > 1e3 * rtol * 0.1
            assert s.success and len(warnings_of_outputs(texts)) <= is_wrong
            reported += len(warnings_of_outputs(texts))
    assert reported


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_accurate_outputs_are_not_reported(method, rtol):
    width = 30 * rtol * 0.1

    def smooth(a, b):
        return (a + b - np.hypot(a - b, width)) / 2

    s, texts = solved(
        rectifier(smooth), (0, 5e-3), [0, 0], [0, 5 * OMEGA / RESISTANCE], method, rtol=rtol,
        atol=[rtol * 1e-2, rtol * 1e-4], t_eval=np.linspace(0, 5e-3, 132), initial="algebraic", max_step=1e-5,
    )  # fmt: skip
    assert s.success and not texts


@pytest.mark.parametrize("method", METHODS)
def test_outputs_at_jumps_are_not_reported(method):
    s, texts = solved(
        lambda t, y, yp: [yp[0] - y[1], y[1] - (1 if t < 1 else 2)], (0, 2), [0, 1], [1, 0], method,
        t_eval=np.linspace(0, 2, 21), breaks=[1.0],
    )  # fmt: skip
    assert s.success and not texts


@pytest.mark.parametrize("has_rates", [False, True])
def test_equations_are_reported_only_where_they_contain_no_derivatives(has_rates):
    t = np.linspace(0, 2, 21)
    s = SimpleNamespace(t=t, y=np.array([t, np.ones(21)]), yp=np.zeros((2, 21)))
    text = violated(
        s, 100, lambda t, y, yp: np.array([yp[0] - y[1], y[1] - (1 if t < 1 else 2 - has_rates * yp[0])]),
        np.array([False, True]), (1e-6, np.array([1e-8])), [], False,
    )  # fmt: skip
    assert (text is None) == has_rates
