"""Kinks of algebraic equations that difference quotients do not resolve."""

import numpy as np
import pytest
from myovib import solve_dae

METHODS = ["bdf", "radau5", "radau9", "radau13"]
# Largest allowed error, in tolerances. The errors of BDF are the largest.
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


def jacobian_of_diode(conductance):
    def jacobian(t, y, yp):
        g = conductance if y[1] > y[0] else 0.0
        return [[0.2, 0, -1], [0, 1, 1], [g, -g, 1]], [[1, 0, 0], [0, 0, 0], [0, 0, 0]]

    return jacobian


@pytest.mark.parametrize(("conductance", "rtol"), [(1e3, 1e-3), (1e4, 1e-4)])
def test_rates_of_convergence_before_a_kink_are_not_used_after_it(conductance, rtol):
    # Regression: errors were 250 and 148 tolerances. F is linear on each side of the kink, so Newton's method requires only
    # one iteration.
    inner = conductance / (1 + conductance)
    s = solve_dae(
        diode(conductance), (0, 10), [0, 0, 0], [0, 5 / (1 + conductance), 5 * inner], "bdf", rtol=rtol,
        atol=0.01 * rtol, jacobian=jacobian_of_diode(conductance),
    )  # fmt: skip
    assert s.success, s.message
    exact = solve_dae(
        lambda t, y, yp: yp - inner * np.maximum(5 * np.sin(t) - y, 0) + 0.2 * y, (0, 10), [0], [0], "radau5",
        rtol=1e-10, atol=1e-12, max_step=0.05,
    )  # fmt: skip
    assert abs(s.y[0, -1] - exact.y[0, -1]) < LIMIT * rtol * 5


@pytest.mark.parametrize("method", ["radau5", "radau9", "radau13"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-5])
def test_remedies_at_kinks_work(method, rtol):
    # With `t_eval`, Radau IIA stops if the exact Jacobian belongs to one side of the kink, but succeeds with difference
    # quotients.
    g = 10.0
    outputs = np.linspace(0, 10, 11)

    def run(residual, **options):
        start = [0, 5 / (1 + g), 5 * g / (1 + g)]
        return solve_dae(
            residual, (0, 10), [0, 0, 0], start, method, rtol=rtol, atol=0.01 * rtol, t_eval=outputs, **options
        )

    s = run(diode(g), jacobian=jacobian_of_diode(g))
    assert s.success or "`jacobian`" in s.message

    width = 10 * rtol

    def smooth(t, y, yp):
        voltage = y[1] - y[0]
        return [*diode(g)(t, y, yp)[:2], y[2] - g * (voltage + np.hypot(voltage, width) - width) / 2]

    def jacobian(t, y, yp):
        voltage = y[1] - y[0]
        slope = g * (1 + voltage / np.hypot(voltage, width)) / 2
        return [[0.2, 0, -1], [0, 1, 1], [slope, -slope, 1]], [[1, 0, 0], [0, 0, 0], [0, 0, 0]]

    inner = g / (1 + g)
    exact = solve_dae(
        lambda t, y, yp: yp - inner * np.maximum(5 * np.sin(t) - y, 0) + 0.2 * y, (0, 10), [0], [0], "radau5",
        rtol=1e-10, atol=1e-12, max_step=0.05,
    ).y[0, -1]  # fmt: skip
    for remedy in (run(diode(g)), run(smooth), run(smooth, jacobian=jacobian)):
        # The smooth function differs from the function with the kink by at most half of the width.
        assert remedy.success and abs(remedy.y[0, -1] - exact) < LIMIT * rtol * 5 + width / 2, remedy.message


def test_quadratic_equations_keep_their_branch():
    # Regression: BDF continued with y' < 0 in 6 of these runs, and errors were up to 5900 tolerances.
    omega, rtol = 30.0, 1e-4
    for t_end in 0.5 + 0.45 * np.arange(20):
        s = solve_dae(
            lambda t, y, yp: [yp[0] ** 2 - (2 + np.sin(omega * t)) ** 2], (0, t_end), [0], [2], "bdf", rtol=rtol,
            atol=rtol, jacobian=lambda t, y, yp: ([[0.0]], [[2 * yp[0]]]),
        )  # fmt: skip
        exact = 2 * t_end + (1 - np.cos(omega * t_end)) / omega
        assert s.success and abs(s.y[0, -1] - exact) < LIMIT * rtol * (1 + exact), t_end


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rate", [[lambda y, yp: yp[0]], []])
def test_kinks_are_passed_while_all_other_variables_rest(method, rate):
    def amplifier(t, y, yp):
        return [*(f(y, yp) for f in rate), y[-1] - 5 * max(t - 1 - y[-1], 0.0)]

    n = len(rate) + 1
    s = solve_dae(amplifier, (0, 2), np.zeros(n), np.zeros(n), method, rtol=1e-7, atol=1e-9)
    assert s.success, s.message
    assert (np.abs(s.y[-1] - 5 / 6 * np.maximum(s.t - 1, 0)) < LIMIT * 1e-7).all()


@pytest.mark.parametrize("threshold", [0.8, 0.9])
def test_no_pulse_after_a_pause_is_skipped_by_bdf(threshold):
    # Regression: step sizes doubled in each pause, and all of these runs missed at least half a pulse. The pulses last 0.20
    # and 0.14 periods.
    half_width = np.arccos(threshold)
    area = 2 * (np.sin(half_width) - threshold * half_width)
    skipped = []
    for periods in range(2, 25):
        for rtol in (1e-4, 1e-6):
            s = solve_dae(
                lambda t, y, yp: [yp[0] - max(np.sin(t) - threshold, 0.0)], (0, 2 * np.pi * periods), [0], [0], "bdf",
                rtol=rtol, atol=rtol * area,
            )  # fmt: skip
            assert s.success, s.message
            # The total error of all pulses is much smaller than half a pulse.
            if abs(periods - s.y[0, -1] / area) > 0.5:
                skipped.append((periods, rtol))
    assert not skipped


@pytest.mark.parametrize("method, rtol", [("radau13", 1e-6), ("radau9", 1e-10)])
def test_kinks_within_steps_are_found_without_dense_output(method, rtol):
    # Regression: for an oscillator with a spring that acts on one side only, errors were 890 and 12 000 tolerances.
    def residual(t, y, yp):
        return [yp[0] - y[1], yp[1] + y[0] + y[2], y[2] - 3.0 * max(0.0, y[0])]

    s = solve_dae(residual, (0, 20), [0, 1, 0], [1, 0, 3], method=method, rtol=rtol, atol=rtol)
    t = s.t % (1.5 * np.pi)
    exact = np.where(t < np.pi / 2, np.sin(2 * t) / 2, -np.sin(t - np.pi / 2))
    assert s.success and abs(s.y[0] - exact).max() < 100 * rtol  # as the guide says


@pytest.mark.parametrize("method", ["radau5", "radau9", "radau13"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-5])
def test_pulses_within_steps_are_found_without_dense_output(method, rtol):
    # Regression: for a rectifier whose capacitor is charged by a pulse of 1 ns in each period of 10 ns, errors were up to
    # 8400 tolerances.
    omega = 2e8 * np.pi

    def residual(t, y, yp):
        c, a, i = y
        diode = 1e-14 * np.expm1(min(a - c, 1.2) / 0.02585)
        return [1e-12 * yp[0] + c / 1e5 - i, (1.5 * np.sin(omega * t) - a) / 50 - i, i - diode]

    def solve(**settings):
        return solve_dae(residual, (0, 50e-9), [0, 0, 0], [0, 0, 0], **settings)

    s = solve(method=method, rtol=rtol)
    reference = solve(method="radau9", rtol=1e-8, atol=1e-12, max_step=2e-10, t_eval=s.t)
    assert s.success and abs(s.y[0] - reference.y[0]).max() < 100 * rtol  # as the guide says, for voltages of 1 V


@pytest.mark.parametrize("has_jacobian", [False, True])
def test_a_kink_far_from_the_last_output_is_named(has_jacobian):
    # An ideal diode carries the current of a coil until the current reaches zero. The stops are 0.05 µs after an output.
    inductance, leak, voltage, resistance = 1e-5, 1e-5, 5.0, 0.05

    def residual(t, y, yp):
        current, node, diode = y
        return [
            inductance * yp[0] - node + voltage,
            diode - leak * node - current,
            min(diode, diode + node / resistance),
        ]

    def jacobian(t, y, yp):
        diode = 1 / resistance if y[1] < 0 else 0
        return np.array([[0, -1, 0], [-1, -leak, 1], [0, diode, 1]]), np.diag([inductance, 0, 0])

    per_current = 1 / (1 / resistance + leak)
    start = [0.5, -0.5 * per_current, 0.5 * per_current / resistance]
    rate = (start[1] - voltage) / inductance
    rates = [rate, -rate * per_current, rate * per_current / resistance]
    stops = 0
    for method in METHODS[1:]:
        for rtol in (1e-3, 1e-5, 1e-7, 1e-9):
            s = solve_dae(
                residual, (0, 2e-6), start, rates, method, rtol=rtol, atol=1e-2 * rtol,
                jacobian=jacobian if has_jacobian else None, t_eval=np.linspace(0, 2e-6, 41),
            )  # fmt: skip
            if s.success:
                continue
            stops += 1
            assert "the equations [2] (counted from 0) have a kink" in s.message
            assert not any(other in s.message for other in ("without bound", "looser", "tighter"))
    assert stops
