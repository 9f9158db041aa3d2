"""Solutions in the first step after a break or after a wrong start, and at late times."""

import warnings

import numpy as np
import pytest
from myovib import solve_dae

METHODS = ["radau5", "radau9", "radau13"]
BREAK = np.arcsin(0.3)


def rectified(t, y, yp):
    return [yp[0] - y[1], y[0] - max(np.sin(t) - 0.3, 0.0), y[2] - (1.0 if t > BREAK else 0.0)]


def of_rectified(t):
    return np.array([np.sin(t) - 0.3, np.cos(t), 1.0 + 0 * t])


def bead(index):
    """Return a bead on a circle under forces along and across it, which jump at `BREAK`."""

    def residual(t, z, zp):
        x, y, u, v, force = z
        along, across = forces(t)
        left = x * x + y * y - 1.0 if index == 3 else x * u + y * v
        return [
            zp[0] - u,
            zp[1] - v,
            zp[2] + (force - across) * x + along * y,
            zp[3] + (force - across) * y - along * x,
            left,
        ]

    return residual


def forces(t):
    return (5.0, 3.0) if t > BREAK else (0.0, 0.0)


def of_bead(t):
    along, across = 5.0, 3.0
    after = np.maximum(t - BREAK, 0.0)
    angle, rate = t + 0.5 * along * after**2, 1.0 + along * after
    force = rate**2 + across
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c, s, -rate * s, rate * c, force + 0 * t])


def errors_of_first_step(s, start, exact, rtol):
    """Return the largest error of each variable within the first step after `start`, in tolerances."""
    end = s.t[s.t > start + 1e-12][0]
    times = start + (end - start) * np.linspace(0.01, 1.0, 10)
    expected = exact(times)
    return (np.abs(s.sol(times) - expected) / (rtol * np.abs(expected) + 0.01 * rtol)).max(axis=1)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_values_from_before_a_break_do_not_enter_the_first_step_after_it(method, rtol):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve_dae(
            rectified, (0, 2), [0, 0, 0], [0, 0, 0], method, index=[1, 2, 1], rtol=rtol, atol=0.01 * rtol,
            breaks=[BREAK], dense_output=True,
        )  # fmt: skip
    assert s.success, s.message
    # The error test keeps the root mean square of the three errors, in tolerances, below 1.
    errors = errors_of_first_step(s, BREAK, of_rectified, rtol)
    assert errors.max() < np.sqrt(3)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("index", [2, 3])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_forces_that_jump_at_a_break_do_not_disturb_velocities(method, index, rtol):
    # In the second run, the force and the derivatives are wrong at the start. Index 3 requires correct derivatives.
    for start in [0.0, BREAK] if index == 2 else [0.0]:
        z0 = of_bead(start)
        zp0 = [z0[2], z0[3], -z0[0], -z0[1], 0]
        z0[4] = 1.0
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            s = solve_dae(
                bead(index), (start, 2), z0, zp0, method, index=[1, 1, index - 1, index - 1, index],
                rtol=rtol, atol=0.01 * rtol, breaks=[BREAK], dense_output=True,
            )  # fmt: skip
        assert s.success, s.message
        assert ["jump in the first step" in str(w.message) for w in caught] == ([True] if start else [])
        errors = errors_of_first_step(s, BREAK, of_bead, rtol)
        # As above, the error test allows √5 tolerances. The error of the force is at most the error that the guide states,
        # or twice the error at the end of the step. The force before the break is wrong by 3, at least 7500 tolerances.
        end = s.t[s.t > BREAK + 1e-12][0]
        at_end = abs(s.sol(end)[4] - of_bead(end)[4]) / (rtol * of_bead(end)[4])
        assert errors[:4].max() < np.sqrt(5) and errors[4] < max(100, 2 * at_end)


@pytest.mark.parametrize("method", ["bdf", *METHODS])
@pytest.mark.parametrize("start", [1.7e9, 1e12])
def test_rounding_of_late_times_does_not_change_autonomous_solutions(method, start):
    def oscillator(t, y, yp):
        return [yp[0] - y[1], yp[1] + y[0]]

    s = solve_dae(oscillator, (start, start + 10), [0, 1], [1, 0], method, rtol=1e-10, atol=1e-12)
    # Global errors are a few tolerances, or up to 100 for BDF. The times have rounding errors of 1e-7 and 1e-4.
    limit = 100e-10 if method == "bdf" else 20e-10
    assert s.success and abs(s.y[0, -1] - np.sin(10)) < limit
    assert s.t[0] == start and s.t[-1] == start + 10


def test_late_events_breaks_and_outputs_have_late_times():
    start = 2.0**31

    def oscillator(t, y, yp):
        return [yp[0] - y[1], yp[1] + y[0] - (1.0 if t > start + 1 else 0.0)]

    s = solve_dae(
        oscillator, (start, start + 4), [0, 1], [1, 0], rtol=1e-8, atol=1e-10, breaks=start + 1,
        t_eval=[start, start + 0.5, start + 4], events=lambda t, y, yp: y[0] - 1, dense_output=True,
    )  # fmt: skip
    assert s.success and s.t.tolist() == [start, start + 0.5, start + 4]
    assert s.sol.t_min == start and s.sol.t_max == start + 4
    # The first steps are shorter than the rounding error of the time, 5e-7.
    assert s.sol(np.linspace(start, start + 1, 50))[0] == pytest.approx(np.sin(np.linspace(0, 1, 50)), abs=1e-6)
    assert s.y[0, 1] == pytest.approx(np.sin(0.5), abs=1e-6)
    # At s seconds after the break, y = 1 + (sin 1 − 1) cos s + cos 1 sin s.
    crossing = start + 1 + np.arctan((1 - np.sin(1)) / np.cos(1))
    assert s.t_events[0] == pytest.approx([crossing], abs=1e-5, rel=0)


@pytest.mark.parametrize("method", ["bdf", "radau5", "radau9", "radau13"])
def test_breaks_are_a_few_roundings_from_the_jump(method):
    # For most k, k P/2 is not exactly the time at which the integer part of the rounded t/P jumps.
    for period in np.round(np.arange(0.1, 1.03, 0.03), 2):

        def square(t):
            return 3.0 if (t / period) % 1 < 0.5 else -3.0

        breaks = np.arange(1, int(6 / period) + 1) * period / 2
        s = solve_dae(
            lambda t, y, yp: [yp[0] + y[0] - y[1], y[1] - square(t)], (0, 3), [0, 3], [3, 0], method, rtol=1e-4,
            atol=1e-6, breaks=breaks, t_eval=[3],
        )  # fmt: skip
        assert s.success, s.message
        ends = np.r_[0, breaks[breaks < 3], 3]
        levels = [square(t) for t in (ends[1:] + ends[:-1]) / 2]
        exact = 0.0
        for level, step in zip(levels, np.diff(ends)):
            exact = level + (exact - level) * np.exp(-step)
        # Errors of earlier parts decay. The error of a part is at most 10 tolerances, relative to 3.
        assert s.y[0, -1] == pytest.approx(exact, abs=10 * 3e-4)


def coupled(diode, source):
    """Return a source that a capacitor couples to a resistor, with a diode in parallel."""

    def residual(t, y, yp):
        i = 1e-6 * (yp[0] - yp[1])
        of_diode = diode * 1e-6 * (np.exp(min(y[1], 2.0) / 0.026) - 1.0)
        return [i + (y[0] - source(t)) / 1e3, -i + of_diode + y[1] / 9e3]

    return residual


@pytest.mark.parametrize("method", ["bdf", *METHODS])
@pytest.mark.parametrize("diode", [0.0, 1.0])
def test_breaks_at_smooth_times_of_a_coupling_capacitor_do_not_stop(method, diode):
    residual = coupled(diode, lambda t: 2.0 * np.sin(200 * np.pi * t))
    # The current of the capacitor is 0 at the start, so both potentials have the same rate.
    rate = 400 * np.pi * 1e-3 / (1e-3 + diode * 1e-6 / 0.026 + 1 / 9e3)
    for rtol in [1e-3, 1e-4, 1e-6, 1e-8]:
        for time in [0.001, 0.004, 0.007, 0.013, 0.018]:
            s = solve_dae(
                residual, (0, 0.02), [0, 0], [rate, rate], method, rtol=rtol, atol=rtol / 10,
                breaks=[time], t_eval=[0.02],
            )  # fmt: skip
            assert s.success, (rtol, time, s.message)


@pytest.mark.parametrize("method", ["bdf", *METHODS])
def test_a_capacitor_keeps_its_voltage_at_a_jump_of_the_source(method):
    jump, end, rtol = 0.005, 0.02, 1e-6
    s = solve_dae(
        coupled(0.0, lambda t: 2.0 if t > jump else 0.0), (0, end), [0, 0], [0, 0], method, rtol=rtol, atol=rtol / 10,
        breaks=[jump],
    )  # fmt: skip
    assert s.success, s.message
    for k in [np.flatnonzero(s.t == jump)[-1], -1]:
        current = 2.0 / 1e4 * np.exp(-(s.t[k] - jump) / (1e4 * 1e-6))
        # Errors of the steps accumulate, but the jump itself is exact up to the tolerance of Newton's method.
        bound = rtol if k == -1 else 0.01 * rtol
        np.testing.assert_allclose(s.y[:, k], [2.0 - 1e3 * current, 9e3 * current], rtol=100 * bound, atol=bound)


@pytest.mark.parametrize("method", ["bdf", *METHODS])
@pytest.mark.parametrize("current", [1.0, -20.0, 40.0, -100.0])
def test_an_overpotential_follows_a_jump_of_the_current(method, current):
    def battery(t, y, yp):
        return [yp[0] - y[2], y[2] - 0.4 * np.sinh(y[1] / 0.0514), y[2] - (current if t > 1 else 0.0)]

    s = solve_dae(battery, (0, 2), [0, 0, 0], [0, 0, 0], method, rtol=1e-4, breaks=[1.0])
    assert s.success, s.message
    after = np.flatnonzero(s.t == 1.0)[-1]
    # The last correction is at most 0.0033 times the tolerance.
    expected = 0.0514 * np.arcsinh(current / 0.4)
    np.testing.assert_allclose(s.y[1:, after], [expected, current], rtol=1e-4)
    np.testing.assert_allclose(s.y[0, -1], current, rtol=1e-3)


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5, 1e-6, 1e-8])
def test_breaks_at_smooth_times_of_a_pendulum_of_index_2_do_not_stop(rtol):
    def pendulum(t, z, zp):
        x, y, u, v, force = z
        return [zp[0] - u, zp[1] - v, zp[2] + force * x, zp[3] + force * y + 9.81, x * u + y * v]

    for time in [0.1, 0.5, 0.9]:
        s = solve_dae(
            pendulum, (0, 1), [1, 0, 0, 0, 0], [0, 0, 0, -9.81, 0], "bdf", rtol=rtol,
            suppress=[False] * 4 + [True], breaks=[time],
        )  # fmt: skip
        assert s.success, (time, s.message)


@pytest.mark.parametrize("function, inverse", [
    (lambda v: v**5, lambda c: c**0.2),
    (lambda v: v / (1.0 + abs(v)), lambda c: c / (1.0 - c)),
    (np.tanh, np.arctanh),
])  # fmt: skip
@pytest.mark.parametrize("value", [0.9, 0.99])
def test_rates_after_a_jump_satisfy_nonlinear_equations(function, inverse, value):
    s = solve_dae(
        lambda t, y, yp: [function(yp[0]) - (value if t > 1 else 0.1)], (0, 2), [0], [inverse(0.1)], "radau5",
        rtol=1e-6, breaks=[1.0],
    )  # fmt: skip
    assert s.success, s.message
    # Each part is linear in time, and its rate is correct up to the last correction of Newton's method.
    assert s.y[0, -1] == pytest.approx(inverse(0.1) + inverse(value), rel=1e-5)


def test_rates_without_a_solution_are_not_invented():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(
            lambda t, y, yp: [np.arctan(yp[0]) - (2.0 if t > 1 else 0.1)], (0, 2), [0], [np.tan(0.1)], breaks=[1.0]
        )
    assert not s.success and s.t[-1] < 1.01


@pytest.mark.parametrize("rate", [1.0, 1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-8])
@pytest.mark.parametrize("varies", [False, True])
def test_derivatives_of_algebraic_variables_jump_at_kinks_of_an_input(rate, rtol, varies):
    """Check a charge in series with a resistance that may depend on the charge; the current is algebraic."""
    times, levels = [0.0, 0.1, 0.15, 0.4, 1.0], [0.0, 1.0, 1.0, -2.0, 0.5]

    def residual(t, y, yp):
        resistance = 1.0 + varies * y[0] ** 2
        return [rate * yp[0] - y[1], resistance * y[1] - (np.interp(t, times, levels) - y[0])]

    s = solve_dae(residual, (0, 1), [0, 0], [0, 10], rtol=rtol, atol=0.01 * rtol, breaks=times)
    assert s.success, s.message
    # The derivative of the second equation, with dy0/dt = y1 / rate.
    for time, slope in zip(times[1:-1], np.diff(levels)[1:] / np.diff(times)[1:], strict=True):
        y, yp = (values[:, np.flatnonzero(s.t == time)[-1]] for values in (s.y, s.yp))
        resistance, of_charge = 1.0 + varies * y[0] ** 2, 1.0 + varies * 2.0 * y[0] * y[1]
        # The increments are 1e-5 of a part. The rounding error of F, 2e-16, is divided by them.
        assert yp[1] == pytest.approx((slope - of_charge * yp[0]) / resistance, rel=1e-6, abs=1e-8)


def crank(angle):
    """Return a crank of radius 0.3 with a prescribed angle that drives a slider by a rod of length 1."""

    def residual(t, y, yp):
        (a, b, x), v, force = np.split(y, 3)
        gradient = np.array([
            [-0.3 * np.sin(a), -np.sin(b), -1.0], [0.3 * np.cos(a), np.cos(b), 0.0], [1.0, 0.0, 0.0],
        ])  # fmt: skip
        left = [0.3 * np.cos(a) + np.cos(b) - x, 0.3 * np.sin(a) + np.sin(b), a - angle(t)]
        return np.r_[yp[:3] - v, [0.03, 0.1, 2.0] * yp[3:6] + gradient.T @ force, left]

    return residual


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("jump, expected", [(0.0, 0), (1e-2, 1), (-0.5, 1)])
def test_velocities_that_jump_at_a_break_are_reported(method, rtol, jump, expected):
    """The speed of a crank jumps at the second break, and its acceleration at the first one."""

    def angle(t):
        return t + 0.5 * max(t - 0.3, 0.0) ** 2 + jump * max(t - 0.6, 0.0)

    y0 = [0, 0, 1.3, 1, -0.3, 0, 0, 0, 0]
    # For a = b = 0, the second derivatives of the constraints give x'' = -0.3 - 0.09 and b'' = 0.
    y0[6] = -2.0 * 0.39
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        s = solve_dae(
            crank(angle), (0, 0.7), y0, [1, -0.3, 0, 0, 0, -0.39, 0, 0, 0], method, index=[1] * 3 + [2] * 3 + [3] * 3,
            rtol=rtol, atol=0.01 * rtol, breaks=[0.3, 0.45, 0.6],
        )  # fmt: skip
    assert s.success, s.message
    texts = [str(w.message) for w in caught]
    assert len(texts) == expected and all("equation 8" in text and "t = 0.6" in text for text in texts), texts


def reported_rates(motion, start, method="radau5", **options):
    """Return the warnings on the velocity of a prescribed position at rest until the start of the motion."""

    def residual(t, y, yp):
        return [yp[0] - y[1], yp[1] - y[2], y[0] - 1.0 - motion(max(t - start, 0.0))]

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solve_dae(
            residual, (0, 0.7), [1, 0, 0], [0, 0, 0], method, index=[1, 2, 3], breaks=[start], t_eval=[0.7], **options
        )
    return [str(w.message) for w in caught if "equation 2 " in str(w.message)]


@pytest.mark.parametrize("start", [0.0, 0.5])
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("motion, expected", [
    (lambda t: 0.3 * t, 1), (lambda t: -1e-3 * t, 1), (lambda t: t**2, 0), (lambda t: 0.1 - 0.1 * np.cos(200.0 * t), 0),
])  # fmt: skip
def test_velocities_that_jump_at_rest_are_reported(motion, expected, rtol, start):
    assert len(reported_rates(motion, start, rtol=rtol, atol=0.01 * rtol)) == expected


def test_velocities_that_jump_are_reported_if_the_next_part_does_not_start():
    # BDF rejects the values after a jump of the position.
    assert len(reported_rates(lambda t: 0.3 * t + 0.1 * (t > 0.0), 0.5, "bdf", suppress=[False, True, True])) == 1


@pytest.mark.parametrize("method, algebraic", [("bdf", 0), ("radau5", 0), ("radau5", 1)])
def test_a_smooth_break_requires_no_differences_with_all_variables(method, algebraic):
    n, calls = 100, 0
    rates = np.diag(np.arange(n) >= algebraic).astype(float)

    def residual(t, y, yp):
        nonlocal calls
        calls += 1
        return rates @ yp + y - np.sin(t)

    def run(span, y, yp, breaks=()):
        nonlocal calls
        calls = 0
        s = solve_dae(
            residual, span, y, yp, method, jacobian=lambda t, y, yp: (np.eye(n), rates), first_step=1e-3, breaks=breaks
        )
        assert s.success, s.message
        return calls, s.y[:, -1], s.yp[:, -1]

    of_first, *state = run((0, 1), np.zeros(n), np.zeros(n))
    of_second = run((1, 2), *state)[0]
    # At the start of an integration, the structure requires 2 n differences. A break requires only a few evaluations.
    assert run((0, 2), np.zeros(n), np.zeros(n), [1.0])[0] < of_first + of_second - n


def test_a_stop_at_a_kink_in_a_large_system_names_remedies_that_work():
    m, rate = 101, 1e-3
    one, zero = np.eye(m), np.zeros((m, m))
    matrices = np.block([[zero, -one], [one, one]]), np.block([[rate * one, zero], [zero, zero]])

    def residual(t, y, yp):
        charge, current = y[:m], y[m:]
        source = min(10.0 * t, 1.0) - 12.0 * max(t - 0.15, 0.0)
        return np.r_[rate * yp[:m] - current, current + charge - source]

    def run(method, rtol):
        return solve_dae(
            residual, (0, 0.4), np.zeros(2 * m), np.repeat([0.0, 10.0], m), method, jacobian=lambda *_: matrices, rtol=rtol,
            atol=0.01 * rtol, breaks=[0.1, 0.15],
        )  # fmt: skip

    with pytest.warns(UserWarning):
        s = run("bdf", 1e-8)
    assert not s.success and all(text in s.message for text in ["200", "rtol", "Radau"])
    assert run("bdf", 1e-5).success and run("radau5", 1e-8).success
