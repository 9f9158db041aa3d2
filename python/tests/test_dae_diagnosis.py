"""Reasons for failures of `solve_dae`, and remedies."""

import itertools
import math
import re
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from myovib import StepFailure, solve_dae
from myovib._advice import WIDTH
from myovib._kinks import jumping, kinked
from myovib._structure import Structure

G = 9.81
RADAU = ("radau5", "radau9", "radau13")


def pendulum(t, y, yp):
    p, v, force = y[:2], y[2:4], y[4]
    return np.r_[yp[:2] - v, yp[2:4] + force * p + [0, G], p @ p - 1]


PENDULUM = ([1, 0, 0, 0, 0], [0, 0, 0, -G, 0])


def servo(t, y, yp):
    return [yp[0] - y[1], yp[1] + 4 * y[0] - y[2], y[0] - (1 - np.cos(t))]


def flexible_joint(t, y, yp):
    """Return F of two masses of index 5: a force on the first mass moves the second mass as prescribed."""
    return [yp[0] - y[1], yp[1] - y[2] + y[0] - y[4], yp[2] - y[3], yp[3] - y[0] + y[2], y[2] - np.sin(t)]


JOINT = ([0, 0, 0, 1, 0], [0, 0, 1, 0, -1])


def solved(*arguments, **options):
    """Return the solution and the text of each warning."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        s = solve_dae(*arguments, **options)
    return s, [str(warning.message) for warning in caught]


@pytest.mark.parametrize(
    ("index", "is_wrong"), [([1, 1, 1, 1, 1], True), ([1, 1, 1, 1, 2], True), ([1, 1, 2, 2, 3], False)]
)
def test_stated_indices_are_compared_with_the_equations(index, is_wrong):
    s, texts = solved(pendulum, (0, 0.2), *PENDULUM, "radau5", index=index, rtol=1e-8, atol=1e-10)
    assert any("`index` states" in text for text in texts) == is_wrong
    assert len(texts) == is_wrong
    assert s.success or "`index` states" in s.message and "tolerances" not in s.message.rpartition(";")[2]


@pytest.mark.parametrize(
    ("index", "wrong"),
    [
        ([2, 2, 1, 1, 3], [2, 3]),
        ([1, 1, 3, 2, 2], [4]),
        ([1, 1, 2, 1, 3], [3]),
        ([2, 2, 3, 3, 3], []),
        ([0, 0, 2, 2, 3], []),
    ],
)
@pytest.mark.parametrize("unit", [1.0, 1e3, 1e-3])
def test_variables_with_too_low_an_index_are_named(index, wrong, unit):
    position, velocity = np.array([0.6, -0.8]), np.array([0.4, 0.3])
    force = velocity @ velocity - G * position[1]
    y0 = np.r_[position, velocity / unit, force / unit**2]

    def scaled(t, y, yp):
        scales = np.array([1, 1, unit, unit, unit**2])
        return pendulum(t, scales * y, unit * scales * yp)

    rates = [*velocity / unit, *(-force * position - [0, G]) / unit**2, 0]
    s, texts = solved(scaled, (0, 1e-3 * unit), y0, rates, "radau5", index=index, max_steps=2)
    named = [text for text in texts if "`index` states" in text]
    assert len(named) == bool(wrong)
    assert not wrong or f"the variables {wrong} " in named[0]


def relay(switch):
    return lambda t, y, yp: [yp[0] + switch(y[0] - 0.3 * np.sin(t))]


def friction(switch):
    """Return an oscillator with dry friction that comes to rest."""
    return lambda t, y, yp: [yp[0] - y[1], yp[1] + y[0] + 0.3 * switch(y[1]) - 0.2 * np.cos(0.7 * t)]


def brake(switch):
    """Return a driven velocity with an algebraic friction force."""
    return lambda t, y, yp: [yp[0] - np.sin(t) + y[1], y[1] - 0.8 * switch(y[0])]


# Equations, end time, start at which the sign is 1, variable with which F jumps, and argument of the sign.
SWITCHED = [
    (relay, 5, ([1], [-1]), 0, lambda t, y, yp: y[0] - 0.3 * np.sin(t)),
    (friction, 20, ([0, 1], [1, -0.1]), 1, lambda t, y, yp: y[1]),
    (brake, 10, ([0.5, 0.8], [-0.8, 0]), 0, lambda t, y, yp: y[0]),
]


@pytest.mark.parametrize(("equations", "end", "start", "variable", "argument"), SWITCHED)
@pytest.mark.parametrize("method", ["bdf", *RADAU])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_remedies_for_jumps_that_hold_the_solution_work(equations, end, start, variable, argument, method, rtol):
    arguments = {"method": method, "rtol": rtol, "atol": rtol, "max_steps": 5000}
    s, _ = solved(equations(np.sign), (0, end), *start, **arguments)
    assert not s.success
    assert jumping(equations(np.sign), s, rtol, np.array([rtol]), s.t[-1])[1] == variable
    # No argument of `solve_dae` helps, so the message does not suggest any.
    assert not re.findall("`|=|tolerances;", s.message.partition("; the equations")[2])
    width = WIDTH * rtol
    s, _ = solved(equations(lambda x: np.tanh(x / width)), (0, end), *start, **arguments)
    assert s.status == 0, s.message

    def event(t, y, yp):
        return argument(t, y, yp)

    event.terminal = True
    s, _ = solved(equations(lambda x: 1.0), (0, end), *start, events=event, **arguments)
    assert s.status == 1, s.message


@pytest.mark.parametrize("method", ["bdf", *RADAU])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_jumps_of_inputs_name_breaks_first(method, rtol):
    def battery(t, y, yp):
        current = 1.0 if t > 1.3 else 0.0
        return [yp[0] - y[2], y[2] - 0.4 * np.sinh(y[1] / 0.0514), y[2] - current]

    arguments = {"method": method, "rtol": rtol, "atol": 0.01 * rtol}
    s, _ = solved(battery, (0, 3), [0, 0, 0], [0, 0, 0], **arguments)
    assert not s.success and re.findall("`([a-z_]+)`", s.message) == ["breaks"]
    assert jumping(battery, s, rtol, np.array([0.01 * rtol]), s.t[-1]) == ([2], None)
    s, _ = solved(battery, (0, 3), [0, 0, 0], [0, 0, 0], breaks=[1.3], **arguments)
    # The charge is linear in time.
    assert s.success and s.y[0, -1] == pytest.approx(1.7, rel=rtol)


@pytest.mark.parametrize("method", RADAU)
@pytest.mark.parametrize("jump", [0.55, 1.0])
def test_jumps_of_inputs_after_the_last_output_and_at_the_end_are_named(method, jump):
    def charged(t, y, yp):
        return [yp[0] - y[1], y[0] + 10 * y[1] - (1.0 if t < jump else -1.0)]

    arguments = {"rtol": 1e-6, "t_eval": [0.5, 1.0]}
    s, _ = solved(charged, (0, 1), [0, 0.1], [0.1, 0], method, **arguments)
    assert not s.success and re.findall("`([a-z_]+)`", s.message) == ["breaks"]
    assert (" 1.0 in `breaks`" in s.message) == (jump == 1.0)
    assert solved(charged, (0, 1), [0, 0.1], [0.1, 0], method, breaks=[jump], **arguments)[0].success


@pytest.mark.parametrize("size", [1.0, 1e6])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-12])
@pytest.mark.parametrize("start", [1.0, 0.0])
def test_steep_functions_and_rounding_are_no_jumps(size, rtol, start):
    def smooth(t, y, yp):
        steep = np.tanh((y[0] - start) / (0.01 * rtol)) + np.sin(1e3 * t)
        terms = steep + size * (y[0] - 1) - size * (y[0] - 2) - size
        return [terms, abs(y[0] - start) / rtol, np.sqrt(y[1])]

    state = SimpleNamespace(t=np.ones(1), y=np.array([[start], [0.0], [0.0]]), yp=np.zeros((3, 1)))
    assert jumping(smooth, state, rtol, np.array([0.01 * rtol]), 1.0) is None


def test_looser_tolerances_are_suggested_for_tight_tolerances_only():
    # Jumps are not searched for in large systems.
    n = 201
    for rtol, suggested, other in ((1e-3, "tighter", "looser"), (1e-9, "looser", "tighter")):
        s, _ = solved(
            lambda t, y, yp: yp + np.sign(y - 0.3 * np.sin(t)), (0, 5), np.ones(n), -np.ones(n), "radau5", rtol=rtol,
            atol=rtol, max_steps=2000, sparsity=np.eye(n),
        )  # fmt: skip
        assert not s.success and suggested in s.message and other not in s.message
        # Names of the Rust library are replaced.
        assert "`breaks`" in s.message and "reinit" not in s.message


@pytest.mark.parametrize("method", RADAU)
def test_a_wrong_index_is_not_reported_as_a_pole(method):
    s, texts = solved(pendulum, (0, 2), *PENDULUM, method, index=[1] * 5, rtol=1e-4, atol=1e-6)
    assert len(texts) == 1 and "[4]" in texts[0]
    assert s.success or s.message.endswith(texts[0])


def test_bdf_at_index_3_does_not_recommend_suppress():
    s, texts = solved(pendulum, (0, 0.1), *PENDULUM, max_steps=2000)
    assert not s.success and "Radau" in s.message and texts
    assert not any("`suppress`" in text for text in [s.message, *texts])


@pytest.mark.parametrize("t_eval", [None, [1, 2]])
def test_bdf_at_index_3_warns_if_velocities_and_multiplier_are_excluded(t_eval):
    """The errors of the positions are 16 times the tolerances. There is no warning for the GGL form of index 2."""
    arguments = {"rtol": 1e-4, "atol": 1e-4, "t_eval": t_eval}
    s, texts = solved(pendulum, (0, 2), *PENDULUM, suppress=[0, 0, 1, 1, 1], **arguments)
    assert s.success and len(texts) == 1 and "[4]" in texts[0] and "index 3" in texts[0]

    def stabilized(t, y, yp):
        p, v = y[:2], y[2:4]
        return np.r_[pendulum(t, y[:5], yp[:5]) + y[5] * np.r_[p, 0, 0, 0], p @ v]

    start = [np.append(values, 0) for values in PENDULUM]
    s, texts = solved(stabilized, (0, 2), *start, suppress=[0, 0, 0, 0, 1, 1], **arguments)
    assert s.success and not texts


@pytest.mark.parametrize(("match", "arguments"), [
    ("index above 1", {"suppress": [0, 0, 1, 1, 1]}),
    ("Jacobian looks wrong", {"method": "radau5", "index": [1, 1, 2, 2, 3], "jacobian": lambda t, y, yp: [np.eye(5)] * 2}),
])  # fmt: skip
def test_warnings_of_the_start_come_before_the_integration(match, arguments):
    times = set()

    def residual(t, y, yp):
        times.add(t)
        return pendulum(t, y, yp)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match=match):
            solve_dae(residual, (0, 2), *PENDULUM, rtol=1e-4, atol=1e-4, **arguments)
    # Constraints on positions are checked before the integration, over 3e-4 of the span.
    assert max(times) < 1e-3
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solve_dae(residual, (0, 0.01), *PENDULUM, rtol=1e-4, atol=1e-4, max_steps=100, **arguments)
    assert [warning.filename for warning in caught if re.search(match, str(warning.message))] == [__file__]


# The last of these runs reaches the end of the span.
@pytest.mark.parametrize(
    "arguments", [{"method": "bdf"}, {"method": "radau5"}, {"method": "radau9", "index": [2, 3, 1, 2, 3]}]
)
def test_index_5_is_no_success(arguments):
    s, texts = solved(flexible_joint, (0, 0.1), *JOINT, rtol=1e-4, atol=1e-6, max_steps=3000, **arguments)
    assert s.status == -1 and "index 5" in s.message
    assert len(texts) == 1 and "index 5" in texts[0]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("index", [2, 3])
@pytest.mark.parametrize("method", RADAU)
def test_multipliers_with_wrong_initial_values_are_named(method, index, rtol):
    """Check a slider-crank mechanism with a crank of 0.15 m and unit masses at 12 rad/s."""

    def gradient(q):
        a, b = 0.15 * np.exp(1j * q[0]), 0.4 * np.exp(1j * q[1])
        return np.array([[a.real, b.real, 0], [-a.imag, -b.imag, -1]])

    def bend(q, v):
        """Return the time derivative of the gradient, multiplied by v."""
        z = 0.15 * np.exp(1j * q[0]) * v[0] ** 2 + 0.4 * np.exp(1j * q[1]) * v[1] ** 2
        return np.array([-z.imag, -z.real])

    def residual(t, y, yp):
        q, v, force = np.split(y, [3, 6])
        z = 0.15 * np.exp(1j * q[0]) + 0.4 * np.exp(1j * q[1])
        constraint = [z.imag, z.real - q[2]] if index == 3 else gradient(q) @ v
        return np.r_[yp[:3] - v, yp[3:6] + gradient(q).T @ force, constraint]

    second = np.arcsin(-0.15 / 0.4 * np.sin(0.7))
    q = np.array([0.7, second, 0.15 * np.cos(0.7) + 0.4 * np.cos(second)])
    v = np.array([12, -0.15 * np.cos(0.7) * 12 / (0.4 * np.cos(second)), 0])
    v[2] = gradient(q)[1] @ v
    force = np.linalg.solve(gradient(q) @ gradient(q).T, bend(q, v))
    indices = [1, 1, 1, 2, 2, 2, 3, 3] if index == 3 else [1] * 6 + [2, 2]
    outputs = [{}, {"t_eval": [0.1, 0.3]}, {"t_eval": [0.0, 0.3], "dense_output": True}]
    for factor, output in itertools.product((1, 0), outputs):
        s, texts = solved(
            residual, (0, 0.3), np.r_[q, v, factor * force], [*v, *(-gradient(q).T @ force), 0, 0], method,
            index=indices, rtol=rtol, atol=0.1 * rtol, **output,
        )  # fmt: skip
        assert s.success
        assert ["jump in the first step" in text for text in texts] == ([] if factor else [True])


# Runs in which the multiplier after the first step has a large rounding error, or in which the motion in this step is fast.
@pytest.mark.parametrize("method, angle, rtol, first_step", [
    ("radau5", 0.3, 1e-10, 1e-4), ("radau9", 0.0, 1e-7, 1e-4), ("radau13", 0.0, 1e-9, 1e-3),
])  # fmt: skip
def test_consistent_multipliers_are_not_reported(method, angle, rtol, first_step):
    """Check a pendulum of unit length that starts at rest."""
    p = np.array([np.cos(angle), -np.sin(angle)])
    tension = -9.81 * p[1]
    for error, t_eval in itertools.product((0.0, 0.1), (None, [1.0])):
        _, texts = solved(
            lambda t, y, yp: np.r_[yp[:2] - y[2:4], yp[2:4] + y[4] * y[:2] + [0.0, 9.81], y[:2] @ y[:2] - 1.0],
            (0, 1), [*p, 0, 0, tension + error], [0, 0, *(-tension * p - [0.0, 9.81]), 0], method, index=[1, 1, 2, 2, 3],
            rtol=rtol, atol=0.01 * rtol, first_step=first_step, t_eval=t_eval,
        )  # fmt: skip
        assert ["jump in the first step" in text for text in texts] == ([True] if error else [])


def test_short_steps_from_the_start_on_name_a_first_step_that_works():
    arguments = {"method": "radau9", "index": [1, 2, 3], "rtol": 1e-6, "atol": 1e-8, "max_steps": 2000}
    s, _ = solved(servo, (0, 10), [0, 0, 1], [0, 1, 0], **arguments)
    assert not s.success and "`first_step`" in s.message
    # The time scale of the solution is 1.
    s, _ = solved(servo, (0, 10), [0, 0, 1], [0, 1, 0], first_step=1e-3, **arguments)
    # Global errors of Radau IIA are at most 100 tolerances.
    assert s.success and abs(s.y[0, -1] - (1 - np.cos(10))) < 100 * 2e-6


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_values_that_are_not_finite_get_no_looser_tolerances(method):
    def root(t, y, yp):
        return [yp[0] + (np.sqrt(y[0]) if y[0] >= 0 else np.nan)]

    s, _ = solved(root, (0, 5), [1], [-1], method)
    assert not s.success and "looser" not in s.message and "breaks" not in s.message


def test_poles_get_no_other_remedies():
    s, _ = solved(lambda t, y, yp: [yp[0] + 1, y[1] ** 2 - y[0]], (0, 2), [1, 1], [-1, -0.5], "radau5")
    assert not s.success and "looser" not in s.message and "breaks" not in s.message


def test_a_constraint_that_jumps_at_a_break_is_named():
    s, _ = solved(
        lambda t, y, yp: [yp[0] - y[1], y[0] - 0.5 * (t >= 1)], (0, 2), [0, 0], [0, 0], "radau5", index=[1, 2],
        breaks=[1.0],
    )  # fmt: skip
    assert not s.success and "jumps at the break" in s.message and "`atol`" not in s.message


def test_redundant_constraints_get_no_other_initial_values():
    s, _ = solved(
        lambda t, y, yp: [yp[0] + y[1] + y[2], y[0] - np.exp(-t), 2 * y[0] - 2 * np.exp(-t)],
        (0, 1), [1, 0.5, 0.5], [-1, 0, 0], "radau5", index=[1, 2, 2],
    )  # fmt: skip
    assert not s.success and "initial values" not in s.message and "[1, 2]" in s.message


@pytest.mark.parametrize(("size", "is_huge"), [(1e12, False), (1e200, True)])
def test_overflowing_entries_are_no_dependence(size, is_huge):
    at = Structure.at(
        lambda t, y, yp: np.array([yp[0] + y[1], size * y[1]]), 0.0, np.ones(2), np.ones(2), np.full(2, 1e-6)
    )
    assert at.is_huge() == is_huge


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_rounding_is_no_kink(size, rtol):
    def smooth(t, y, yp):
        return [np.sin(y[0]) + size * (y[0] - 1) - size * (y[0] - 2) - size]

    def bent(t, y, yp):
        return [max(y[0] - 1, 0.0)]

    state = SimpleNamespace(t=np.zeros(1), y=np.ones((1, 1)), yp=np.zeros((1, 1)))
    assert kinked(smooth, state, rtol, np.array([0.01 * rtol])) == []
    assert kinked(bent, state, rtol, np.array([0.01 * rtol])) == [0]


def test_times_of_late_starts_have_their_origin():
    def decay(t, y, yp):
        return [yp[0] + y[0], y[1] - y[0]]

    with pytest.raises(RuntimeError, match="1700000000"):
        solve_dae(decay, (1.7e9, 1.7e9 + 3), [1, 5], [-1, 0], "bdf")
    s = solve_dae(lambda t, y, yp: decay(t, y, yp) if t < 1.7e9 + 2 else [np.nan] * 2, (1.7e9, 1.7e9 + 3), [1, 1], [-1, 0], "bdf")
    assert s.status < 0
    assert "1700000000" in s.message


def test_inaccurate_difference_quotients_name_arguments_that_work():
    def relativistic(t, y, yp):
        if abs(yp[0]) >= 1:
            raise StepFailure
        return [yp[0] / np.sqrt(1 - yp[0] ** 2) - y[1], yp[1] + y[0]]

    def jacobian(t, y, yp):
        return [[0, -1], [1, 0]], np.diag([(1 - yp[0] ** 2) ** -1.5, 1])

    arguments = ((0, 1), [3, 0], [0, -3], "bdf")
    s, _ = solved(relativistic, *arguments, rtol=1e-7, atol=1e-8)
    assert not s.success and "`jacobian`" in s.message and "`first_step`" in s.message
    for remedy in ({"jacobian": jacobian}, {"first_step": 1e-3}):
        s, _ = solved(relativistic, *arguments, rtol=1e-7, atol=1e-8, **remedy)
        assert s.success
        # The energy sqrt(1 + p^2) + x^2/2 is 5.5. The errors of BDF are up to 1000 tolerances, relative to 5.5.
        assert np.sqrt(1 + s.y[1, -1] ** 2) + s.y[0, -1] ** 2 / 2 == pytest.approx(5.5, rel=1e-4)


@pytest.mark.parametrize("method", ["bdf", *RADAU])
def test_functions_may_change_their_arguments(method):
    def oscillator(t, y, yp):
        y *= 2
        yp *= 2
        return [yp[0] - y[1], yp[1] + y[0]]

    def event(t, y, yp):
        y -= 0.5
        return y[0]

    start = np.array([1.0, 0.0])
    s = solve_dae(oscillator, (0, 2), start, [0, -1], method, rtol=1e-6, atol=1e-8, events=event)
    assert (start == [1, 0]).all()
    # The errors of BDF are up to 100 tolerances here.
    assert s.y[:, -1] == pytest.approx([np.cos(2), -np.sin(2)], abs=1e-4)
    assert s.t_events[0] == pytest.approx([np.pi / 3], abs=1e-4)


@pytest.mark.parametrize("method", ["bdf", "radau5", "radau9"])
def test_an_entry_of_the_jacobian_that_is_wrong_after_the_start_is_named(method):
    def residual(t, y, yp):
        return [(1 + 100 * y[0] ** 2) * yp[0] - 10 * np.cos(t)]

    def jacobian(factor):
        return lambda t, y, yp: ([[200 * y[0] * yp[0]]], [[1 + factor * y[0] ** 2]])

    arguments = (residual, (0, 1.5), [0], [10])
    s, notes = solved(*arguments, method=method, rtol=1e-6, jacobian=jacobian(3000))
    assert any("row 0, column 0" in note and "dF/dy'" in note for note in notes)
    s, notes = solved(*arguments, method=method, rtol=1e-6, jacobian=jacobian(100))
    assert s.success and not notes


@pytest.mark.parametrize("method", ["bdf", "radau5", "radau9"])
@pytest.mark.parametrize("t_eval", [None, [0, 5]])
def test_an_entry_of_the_jacobian_that_is_wrong_near_the_end_is_named(method, t_eval):
    def residual(t, y, yp):
        return [yp[0] + y[0] - y[2], yp[1] + 2 * y[1] * y[2] - y[0], y[2] ** 2 + 3 * y[2] - y[0] - 4 - np.sin(5 * t)]

    def jacobian(t, y, yp):
        factor = 10 if t > 2 else 1
        return [[1, 0, -1], [-1, 2 * y[2], 2 * y[1]], [-1, 0, factor * (2 * y[2] + 3)]], np.diag([1, 1, 0])

    s, notes = solved(
        residual, (0, 5), [0, 0, 1], [1, 0, 0], method, jacobian=jacobian, initial="algebraic", rtol=1e-6, t_eval=t_eval
    )
    assert not s.success and "row 2, column 2" in s.message
    assert len(notes) == 1 and "row 2, column 2" in notes[0]


@pytest.mark.parametrize("method", ["bdf", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_a_turning_point_is_no_dependence_of_equations(method, rtol):
    """The equations of a line have no solution for loads above a limit."""
    reactance, ratio = 0.5, 0.3

    def residual(t, y, yp):
        load, angle, voltage = y
        return [
            yp[0] - 0.2, voltage * np.sin(angle) / reactance - load,
            (voltage * np.cos(angle) - voltage**2) / reactance - ratio * load,
        ]  # fmt: skip

    s, notes = solved(
        residual, (0, 10), [0, 0, 1], [0.2, 0, 0], method, rtol=rtol, atol=0.01 * rtol, initial="algebraic"
    )
    limit = (np.sqrt(1 + ratio**2) - ratio) / (2 * reactance)
    # The solution, a square root, ends at the limit, and the load is linear in time.
    assert not s.success and 0.2 * s.t[-1] == pytest.approx(limit, rel=rtol)
    assert not any("do not determine" in text for text in [s.message, *notes])


def test_quotients_at_kinks_and_rounding_do_not_refute_a_jacobian():
    def kinked(t, y, yp):
        return np.r_[yp[0] + yp[1] - yp[1] + abs(y[0]), y[1] - 1e5 - np.exp(y[0] / 1e-9)]

    structure = Structure(kinked, 0.0, np.zeros(2), np.zeros(2), np.full(2, 1e-6))
    df_dy = np.array([[0.0, 0.0], [-1e9, 1.0]])
    assert not structure.wrong_entries(df_dy, np.array([[1.0, 0.0], [0.0, 0.0]]))
    assert structure.wrong_entries(df_dy, np.array([[2.5, 0.0], [0.0, 0.0]])) == {("dF/dy'", 0, 0)}
    assert structure.differential.tolist() == [True, False]


@pytest.mark.parametrize("rtol", [1e-3, 1e-4])
def test_both_remedies_for_inaccurate_quotients_work(rtol):
    # BDF displaces y' by the tolerance of y divided by the step size. As the cube of y' is not linear over this distance,
    # Newton's method fails in every second step.
    def coupled(t, y, yp):
        a, b, da, db = np.sin(t), np.cos(2 * t), np.cos(t), -2 * np.sin(2 * t)
        first = yp[0] + 0.2 * yp[1] ** 3 - da - 0.2 * db**3 + 0.5 * (y[1] - b)
        return [first, yp[1] - 0.1 * yp[0] ** 2 * yp[1] - db + 0.1 * da**2 * db + y[0] * y[1] - a * b]

    def jacobian(t, y, yp):
        return [[0, 0.5], [y[1], y[0]]], [[1, 0.6 * yp[1] ** 2], [-0.2 * yp[0] * yp[1], 1 - 0.1 * yp[0] ** 2]]

    def run(**options):
        return solve_dae(coupled, (0, 6), [0, 1], [1, 0], "bdf", max_steps=2000, atol=1e-8, **options)

    s = run(rtol=rtol)
    assert s.status < 0 and "jacobian" in s.message and "tolerances" in s.message
    for options in ({"rtol": rtol, "jacobian": jacobian}, {"rtol": 1e-6}):
        s = run(**options)
        # According to the documentation, errors of BDF are at most 1000 tolerances.
        assert s.success and abs(s.y[0, -1] - np.sin(6)) < 1000 * options["rtol"], s.message


@pytest.mark.parametrize("method", RADAU)
def test_a_variable_whose_derivative_occurs_is_not_algebraic(method):
    with pytest.raises(ValueError, match=r"variables \[0\]"):
        solve_dae(pendulum, (0, 1), *PENDULUM, method=method, index=[1, 1, 2, 2, 3], algebraic=[1, 0, 0, 0, 0])
    with pytest.raises(ValueError, match=r"variables \[2, 3\]"):
        solve_dae(pendulum, (0, 1), *PENDULUM, method=method, index=[1, 1, 2, 2, 3], algebraic=[0, 0, 1, 1, 1])


@pytest.mark.parametrize("method", ["bdf", *RADAU])
def test_variables_that_start_at_zero_need_an_absolute_tolerance(method):
    with pytest.raises(ValueError, match="atol.*1"):
        solve_dae(lambda t, y, yp: yp - y[::-1], (0, 1), [1, 0], [0, 1], method=method, atol=[0, 0])


@pytest.mark.parametrize("method", ["radau5", "radau9", "radau13"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_entries_with_half_their_value_that_are_0_at_the_start_are_named(method, rtol):
    def pendulum(t, z, zp):
        x, y, u, v, force = z
        return [zp[0] - u, zp[1] - v, zp[2] + force * x, zp[3] + force * y + 9.81, x * x + y * y - 1.0]

    def of_pendulum(t, z, zp):
        x, y, _, _, force = z
        df_dy = np.zeros((5, 5))
        df_dy[0, 2] = df_dy[1, 3] = -1.0
        df_dy[2, 0] = df_dy[3, 1] = force
        df_dy[2:4, 4] = x, y
        df_dy[4, :2] = 2 * x, y
        return df_dy, np.diag([1.0, 1, 1, 1, 0])

    with pytest.warns(UserWarning, match="row 4, column 1 .*`jacobian`"):
        s = solve_dae(
            pendulum, (0, 2), [1, 0, 0, 0, 0], [0, 0, 0, -9.81, 0], method, index=[1, 1, 2, 2, 3], rtol=rtol,
            jacobian=of_pendulum,
        )  # fmt: skip
    assert not s.success and "row 4, column 1" in s.message


@pytest.mark.parametrize("method", ["radau5", "radau9", "radau13"])
@pytest.mark.parametrize("factor", [1.0, 0.5])
def test_a_wrong_entry_of_a_slow_integration_is_named(method, factor):
    def robertson(t, y, yp):
        a, b, c = y
        return [-0.04 * a + 1e4 * b * c - yp[0], 0.04 * a - 1e4 * b * c - 3e7 * b * b - yp[1], a + b + c - 1.0]

    def jacobian(t, y, yp):
        _, b, c = y
        rows = [[-0.04, 1e4 * c, 1e4 * b], [0.04, -1e4 * c - factor * 6e7 * b, -1e4 * b], [1, 1, 1]]
        return np.array(rows), np.diag([-1.0, -1, 0])

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        s = solve_dae(
            robertson, (0, 1e4), [1, 0, 0], [-0.04, 0.04, 0], method, jacobian=jacobian, rtol=1e-4,
            atol=[1e-8, 1e-12, 1e-8],
        )  # fmt: skip
    assert s.success
    assert any("row 1, column 1" in str(warning.message) for warning in found) == (factor == 0.5)


def test_errors_of_functions_name_the_call_and_the_required_values():
    def decay(t, y, yp):
        return yp + y

    with pytest.raises(TypeError, match=r"called as residual\(t, y, yp\)"):
        solve_dae(lambda t, y: y, (0, 1), [1.0], [-1.0])
    with pytest.raises(TypeError, match=r"called as jacobian\(t, y, yp\)"):
        solve_dae(decay, (0, 1), [1.0], [-1.0], jacobian=lambda t: None)
    for matrices in [np.eye(2), (np.eye(2),), None]:
        with pytest.raises(ValueError, match="pair dF/dy, dF/dy'"):
            solve_dae(decay, (0, 1), [1.0, 1.0], [-1.0, -1.0], jacobian=lambda t, y, yp: matrices)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_entries_that_sparsity_lacks_after_the_start_are_named(method):
    def turning(t, y, yp):
        c = min(t, 1.0)
        return [yp[0] - 1, y[1] * (1 - c) + (y[2] - 1) * c, y[2] * (1 - c) - y[1] * c]

    with pytest.warns(UserWarning, match="`sparsity`"):
        s = solve_dae(turning, (0, 3), [0, 0, 0], [1, 0, 0], method, sparsity=np.eye(3))
    assert not s.success and "equation 1 depends on variable 2" in s.message


def test_dry_friction_from_rest_is_named_for_the_first_step_of_bdf():
    """Regression: the message requested ever smaller first steps."""

    def friction(t, y, yp):
        return [yp[0] - y[1], yp[1] + y[0] - y[2], y[2] + 0.3 * np.sign(y[1])]

    start = [2.05, 0, 0], [0, -2.05, 0]
    s = solve_dae(friction, (0, 3), *start)
    assert s.status == -1 and "[2]" in s.message and "variable 1" in s.message, s.message
    s = solve_dae(lambda t, y, yp: [*friction(t, y, yp)[:2], y[2] + 0.3 * np.tanh(y[1] / 1e-5)], (0, 3), *start)
    assert s.success


@pytest.mark.parametrize("tol", [1e-6, 1e-3])
def test_a_pole_at_index_2_is_named(tol):
    """Regression: the messages suggested looser and tighter tolerances."""

    def equations(t, y, yp):
        v = y[2:4]
        return np.r_[yp[:2] - v, yp[2:4] + y[4] * y[:2] - (v @ v) * v, y[:2] @ v]

    start = [1, 0, 0, 1, 1], [0, 1, -1, 1, 0]
    s = solve_dae(equations, (0, 3), *start, method="radau9", index=[1, 1, 1, 1, 2], rtol=tol, atol=1e-2 * tol)
    # |v|' = |v|³ ends at t = 1/2.
    assert s.status == -1 and abs(s.t[-1] - 0.5) < 1e-3
    assert "[0, 1, 2, 3]" in s.message and "tolerances" not in s.message.partition("; ")[2], s.message


@pytest.mark.parametrize("rtol", [1e-4, 1e-5, 1e-6])
def test_an_explosion_is_not_taken_for_dependent_equations(rtol):
    """Regression: the message of BDF said that the equations depend on each other.

    The problem is Chemical Akzo Nobel (Test Set for IVP Solvers) with a wrong sign.
    """
    mass = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])

    def rates(y):
        root = np.sqrt(y[1])
        r1, r2, r3 = 18.7 * y[0] ** 4 * root, 0.58 * y[2] * y[3], 0.58 / 34.4 * y[0] * y[4]
        r4, r5, inflow = 0.09 * y[0] * y[3] ** 2, 0.42 * y[5] ** 2 * root, 3.3 * (0.9 / 737.0 - y[1])
        return np.array(
            [
                -2 * r1 + r2 - r3 - r4,
                -0.5 * r1 - r4 - 0.5 * r5 + inflow,
                r1 - r2 + r3,
                -r2 + r3 - 2 * r4,
                r2 - r3 + r5,
                115.83 * y[0] * y[3] - y[5],
            ]
        )

    y0 = np.array([0.444, 0.00123, 0.0, 0.007, 0.0, 115.83 * 0.444 * 0.007])
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(lambda t, y, yp: mass * yp + rates(y), (0, 180), y0, -mass * rates(y0), rtol=rtol, atol=0.01 * rtol)
    assert s.status == -1 and "grow without bound" in s.message and "depend on" not in s.message, s.message


@pytest.mark.parametrize("options", [dict(method="radau5", index=[1, 2, 1]), dict(method="bdf", suppress=[0, 1, 0])])
@pytest.mark.parametrize("cause", ["jump", "pole", "max_steps"])
def test_a_nonlinear_multiplier_of_index_2_is_not_taken_for_the_cause(cause, options):
    def equations(t, y, yp):
        position = 1.0 + t + (cause == "jump") * (t > 0.5)
        return [yp[0] - y[1] - y[1] ** 3, y[0] - position, yp[2] - (cause == "pole") * y[2] ** 2]

    # The root of λ + λ³ = 1.
    multiplier = 0.6823278038280193
    most = 5 if cause == "max_steps" else None
    s = solve_dae(equations, (0, 2), [1, multiplier, 2], [1, 0, 4.0 * (cause == "pole")], max_steps=most, **options)
    assert s.status == -1 and "depend" not in s.message and "the effect of the variables" not in s.message, s.message


@pytest.mark.parametrize("method", ["bdf", "radau9"])
def test_a_break_beside_the_jump_is_named(method):
    def equations(t, y, yp):
        return [yp[0] + y[0] - y[1], y[1] - np.floor(t / 0.01 + 1e-9)]

    breaks = [0.01 * k for k in range(1, 10)]
    s = solve_dae(equations, (0, 0.1), [0, 0], [0, 0], method, breaks=breaks)
    assert s.status == -1 and "0.01 differs by 1.0e-11" in s.message, s.message


def ring_modulator(t, y, yp):
    """Ring modulator without capacitors at its diodes (Mazzia, Magherini: Test Set for IVP Solvers, 2008, problem ring).

    The voltages y[2:6] have the index 2 while the diodes block.
    """
    u1, u2 = 0.5 * math.sin(2e3 * math.pi * t), 2.0 * math.sin(2e4 * math.pi * t)
    at_diodes = [y[2] - y[4] - y[6] - u2, -y[3] + y[5] - y[6] - u2, y[3] + y[4] + y[6] + u2, -y[2] - y[5] + y[6] + u2]
    with np.errstate(over="ignore", invalid="ignore"):
        q1, q2, q3, q4 = 40.67286402e-9 * (np.exp(17.7493332 * np.array(at_diodes)) - 1.0)
        right = [
            (y[7] - 0.5 * y[9] + 0.5 * y[10] + y[13] - y[0] / 25e3) / 1.6e-8,
            (y[8] - 0.5 * y[11] + 0.5 * y[12] + y[14] - y[1] / 25e3) / 1.6e-8,
            y[9] - q1 + q4,
            -y[10] + q2 - q3,
            y[11] + q1 - q3,
            -y[12] - q2 + q4,
            (-y[6] / 50.0 + q1 + q2 - q3 - q4) / 1e-8,
            -y[0] / 4.45,
            -y[1] / 4.45,
            (0.5 * y[0] - y[2] - 36.3 * y[9]) / 2e-3,
            (-0.5 * y[0] + y[3] - 17.3 * y[10]) / 5e-4,
            (0.5 * y[1] - y[4] - 36.3 * y[11]) / 2e-3,
            (-0.5 * y[1] + y[5] - 17.3 * y[12]) / 5e-4,
            (-y[0] + u1 - 86.3 * y[13]) / 2e-3,
            (-y[1] - 636.3 * y[14]) / 2e-3,
        ]
        return np.where(AT_DIODES, 0.0, yp) - right


AT_DIODES = np.array([2 <= j < 6 for j in range(15)])


def ring_modulator_matrices(t, y, yp):
    """Return central differences, which are accurate to six digits for exponents up to 1e3."""
    steps = 1e-6 * np.eye(15)
    columns = [ring_modulator(t, y + step, yp) - ring_modulator(t, y - step, yp) for step in steps]
    return np.array(columns).T / 2e-6, np.diag(~AT_DIODES).astype(float)


@pytest.mark.parametrize(
    ("method", "rtol", "jacobian"),
    [
        ("radau5", 1e-4, ring_modulator_matrices),
        ("radau9", 1e-4, ring_modulator_matrices),
        ("bdf", 1e-3, None),
    ],
)
def test_the_remedy_works_where_the_index_varies(method, rtol, jacobian):
    """Regression: the message stated that the equations do not determine the voltages at the diodes."""
    yp0 = -ring_modulator(0.0, np.zeros(15), np.zeros(15))
    span = (0, 1.1e-4 if method == "bdf" else 6e-5)
    common = dict(t_span=span, y0=np.zeros(15), yp0=yp0, method=method, rtol=rtol, atol=rtol, jacobian=jacobian)
    stated = dict(suppress=AT_DIODES) if method == "bdf" else dict(index=np.where(AT_DIODES, 2, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(ring_modulator, **common, **stated)
        remedy = {} if method == "bdf" else dict(index=np.ones(15, int))
        again = solve_dae(ring_modulator, **common, **remedy)
        accurate = dict(method="radau5", rtol=1e-5, atol=1e-5, jacobian=ring_modulator_matrices)
        exact = solve_dae(ring_modulator, **{**common, **accurate, "index": np.ones(15, int)})
    assert not s.success and again.success and exact.success, [s.message, again.message, exact.message]
    assert "do not determine" not in s.message
    assert "[2, 3, 4, 5" in s.message and ("`suppress`" if method == "bdf" else "`index`") in s.message
    # The bound is one hundred tolerances, as stated in the guide.
    np.testing.assert_allclose(again.y[:2, -1], exact.y[:2, -1], rtol=0, atol=100 * rtol)


@pytest.mark.parametrize("has_jacobian", [False, True])
def test_bdf_names_radau_methods_for_equations_that_are_nonlinear_in_derivatives(has_jacobian):
    def residual(t, y, yp):
        return [yp[0] ** 3 + yp[0] + 2 * y[0] - np.sin(3 * t) - t, y[1] - yp[0] ** 2]

    def jacobian(t, y, yp):
        return np.diag([2.0, 1.0]), np.array([[3 * yp[0] ** 2 + 1, 0], [-2 * yp[0], 0]])

    rate = -0.618
    start = ([-(rate**3 + rate) / 2, rate**2], [rate, 2 * rate * (4 - 2 * rate) / (3 * rate**2 + 1)])
    arguments = {"rtol": 1e-4, "atol": 1e-6, "jacobian": jacobian if has_jacobian else None}
    s = solve_dae(residual, (0, 6), *start, "bdf", max_steps=1000, **arguments)
    assert not s.success and "; F is nonlinear in y'" in s.message and "Radau method" in s.message
    assert solve_dae(residual, (0, 6), *start, "radau9", **arguments).success


def test_bdf_names_the_jacobian_if_a_first_step_with_sensitivities_fails():
    def residual(t, y, yp, p):
        return [yp[0] + y[0], y[0] - p[0] * np.exp(40 * (y[1] - 3.7))]

    def jacobian(t, y, yp, p):
        return np.array([[1, 0], [1, -40 * p[0] * np.exp(40 * (y[1] - 3.7))]]), np.diag([1, 0])

    problem = (residual, (0, 1), [1, 3.7], [-1, -1 / 40], "bdf")
    tolerances = {"rtol": 1e-10, "atol": 1e-12, "parameters": [1.0]}
    s = solve_dae(*problem, **tolerances)
    assert not s.success and "exact `jacobian`" in s.message and "first_step=" not in s.message
    assert solve_dae(*problem, jacobian=jacobian, **tolerances).success


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_poles_are_named_if_most_steps_are_close_to_them(rtol):
    # Regression: tolerances or `suppress` were suggested, because the derivatives grew only in the last of 1500 steps.
    with pytest.warns(UserWarning, match=r"variables \[1\] .* grow without bound"):
        s = solve_dae(
            lambda t, y, yp: [yp[0] - 1, np.cos(y[0]) * y[1] - 1], (0, 4), [0, 1], [1, 0], "bdf", rtol=rtol, atol=rtol
        )
    assert s.status == -1 and abs(s.t[-1] - np.pi / 2) < 1e-6
