"""Kinks of algebraic equations, which difference quotients do not resolve."""

import warnings

import numpy as np
import pytest
from myovib import solve_dae

METHODS = ["bdf", "radau5", "radau9", "radau13"]
# Errors may be several tolerances, and BDF's are larger than those of Radau methods.
LIMIT = 20


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
@pytest.mark.parametrize("gain", [0.5, 5.0, 200.0])
@pytest.mark.parametrize("breaks", [[], [1.0]])
def test_kinked_algebraic_equations_are_solved_on_both_sides(method, rtol, gain, breaks):
    def amplifier(t, y, yp):
        return [yp[0] + y[0], y[1] - gain * max(t - 1 - y[1], 0.0)]

    s = solve_dae(amplifier, (0, 2), [1, 0], [-1, 0], method, rtol=rtol, atol=0.01 * rtol, breaks=breaks)
    assert s.success, s.message
    exact = np.array([np.exp(-s.t), gain / (1 + gain) * np.maximum(s.t - 1, 0)])
    assert (np.abs(s.y - exact) < LIMIT * rtol).all()


def diode(conductance):
    def residual(t, y, yp):
        capacitor, node, current = y
        return [
            yp[0] - current + 0.2 * capacitor,
            current - (5 * np.sin(t) - node),
            current - conductance * max(node - capacitor, 0.0),
        ]

    return residual


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
@pytest.mark.parametrize("conductance", [1.0, 10.0])
def test_ideal_diodes_switch_with_difference_quotients(method, rtol, conductance):
    inner = conductance / (1 + conductance)

    def explicit(t, y, yp):
        return yp - inner * np.maximum(5 * np.sin(t) - y, 0) + 0.2 * y

    start = [0, 5 / (1 + conductance), 5 * inner]
    s = solve_dae(diode(conductance), (0, 10), [0, 0, 0], start, method, rtol=rtol, atol=0.01 * rtol)
    assert s.success, s.message
    exact = solve_dae(explicit, (0, 10), [0], [0], "radau5", rtol=1e-10, atol=1e-12, max_step=0.05)
    # Capacitor voltages are of order 1.
    assert abs(s.y[0, -1] - exact.y[0, -1]) < LIMIT * rtol * 5
    is_open = s.y[1] < s.y[0]
    assert is_open.any() and not is_open.all()


def bridge(t, y, yp):
    """Return a bridge of four diodes, which all switch when the source changes its sign."""
    capacitor, a, b = y
    diode = lambda u: 50.0 * max(u, 0.0)
    source = (5 * np.sin(t) - (a - b)) / 0.5
    return [
        yp[0] - diode(a - capacitor) - diode(b - capacitor) + 0.3 * capacitor,
        source - diode(a - capacitor) + diode(-a) - 1e-3 * a,
        -source - diode(b - capacitor) + diode(-b) - 1e-3 * b,
    ]


def slopes_of_bridge(t, y, yp):
    capacitor, a, b = y
    slope = lambda u: 50.0 * (u > 0)
    of_a, of_b = slope(a - capacitor), slope(b - capacitor)
    of_y = [
        [of_a + of_b + 0.3, -of_a, -of_b],
        [of_a, -2 - of_a - slope(-a) - 1e-3, 2],
        [of_b, 2, -2 - of_b - slope(-b) - 1e-3],
    ]
    return np.array(of_y), np.diag([1.0, 0, 0])


@pytest.mark.parametrize("method", METHODS[1:3])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_the_remedy_of_a_stop_at_a_kink_works(method, rtol):
    arguments = {"method": method, "rtol": rtol, "atol": 0.01 * rtol, "initial": "algebraic"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(bridge, (0, 20), [0, 0, 0], [0, 0, 0], **arguments)
    assert s.success or "`jacobian`" in s.message
    s = solve_dae(bridge, (0, 20), [0, 0, 0], [0, 0, 0], jacobian=slopes_of_bridge, **arguments)
    assert s.success, s.message
