"""Starts, breaks and late times of `solve_dae`."""

import warnings

import numpy as np
import pytest

from myovib import consistent_start, solve_dae
from myovib._dae import _with_kinematic_rates

METHODS = ("bdf", "radau5", "radau9", "radau13")
G = 9.81


def pendulum_and_heat(t, y, yp):
    """Return F of a pendulum of length 1, and of a temperature with its algebraic heating power."""
    x, z, u, v, force, heat, power = y
    return [
        yp[0] - u, yp[1] - v, yp[2] + force * x, yp[3] + force * z + G, x * x + z * z - 1.0,
        yp[5] + heat - power, power - 2.0,
    ]  # fmt: skip


INDEX = [1, 1, 2, 2, 3, 1, 1]
START = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
RATES = np.array([0.0, 0.0, 0.0, -G, 0.0, 2.0, 0.0])


@pytest.mark.parametrize(("variable", "is_of_constraint"), [(0, True), (6, False)])
def test_consistent_start_is_named_for_positions_alone(variable, is_of_constraint):
    y = START.copy()
    y[variable] += 0.1
    with pytest.raises(RuntimeError) as raised:
        solve_dae(pendulum_and_heat, (0, 0.1), y, RATES, "radau5", index=INDEX)
    assert ("consistent_start" in str(raised.value)) == is_of_constraint
    if is_of_constraint:
        y[:2], y[2:4] = consistent_start(lambda t, q: q @ q - 1.0, y[:2], y[2:4])
    else:
        y[variable] = 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solve_dae(pendulum_and_heat, (0, 0.1), y, RATES, "radau5", index=INDEX).success


def test_consistent_start_is_not_named_for_functions_that_fail():
    def fails(t, y, yp):
        return np.array(pendulum_and_heat(t, y, yp)) + (np.nan if t > 0.0 else 0.0)

    s = solve_dae(fails, (0, 0.1), START, RATES, "radau5", index=INDEX)
    assert not s.success and "consistent_start" not in s.message


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("terminal", [0, 1])
@pytest.mark.parametrize("t_eval", [None, [0.25, 0.5, 0.75]])
@pytest.mark.parametrize("direction", [-1, 0, 1])
def test_events_at_breaks_occur_once(method, terminal, t_eval, direction):
    def late(t, y, yp):
        return t - 0.5

    def full(t, y, yp):
        return y[0] > 0.5 - 1e-9

    full.terminal, full.direction, late.direction = terminal, direction, direction
    # dy/dt changes from 1 to 3 at t = 0.5, where y = 0.5. The bool changes just before this break.
    s = solve_dae(
        lambda t, y, yp: yp - (1.0 if t < 0.5 else 3.0), (0, 1), [0], [1], method, breaks=[0.5],
        events=[late, full], t_eval=t_eval,
    )  # fmt: skip
    occurs = direction >= 0
    assert [len(times) for times in s.t_events][1] == occurs
    ends = bool(terminal and occurs)
    assert s.status == int(ends)
    if not ends:
        assert s.t_events[0].tolist() == ([0.5] if occurs else [])
        assert s.y[0, -1] == pytest.approx(0.5 + 3.0 * (s.t[-1] - 0.5), abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_terminal_event_at_a_break_ends_the_integration(method):
    def late(t, y, yp):
        return t - 0.5

    late.terminal = 1
    s = solve_dae(lambda t, y, yp: yp - 1.0, (0, 1), [0], [1], method, breaks=[0.5], events=late)
    assert s.status == 1 and s.t[-1] == 0.5 and s.y_events[0] == pytest.approx(0.5)


def oscillator(t, y, yp):
    return [yp[0] - y[1], yp[1] + y[0]]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [0.0, 1e12, 1e14])
def test_times_without_digits_are_reported(method, start):
    # The rounding error of 1e12 is 1.2e-4.
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        s = solve_dae(oscillator, (start, start + 10.0), [0, 1], [1, 0], method, rtol=1e-6, atol=1e-6)
    is_named = any("t_span" in str(warning.message) for warning in caught)
    assert is_named == (start > 0.0)
    assert s.success or "t_span" in s.message


def prescribed(jump):
    """Return F of a position that moves at speed 1 and jumps at t = 1, and of an oscillation. The velocity has the index 2."""
    return lambda t, y, yp: [yp[0] - y[1], y[0] - min(t, 1.0) - 0.5 * np.sin(t) - (jump if t > 1 else 0.0)]


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_bdf_at_index_2_has_the_multiplier_after_a_kink_of_a_constraint(rtol):
    s = solve_dae(
        prescribed(0.0), (0, 2.5), [0, 1.5], [1.5, 0], suppress=[False, True], rtol=rtol, atol=rtol, breaks=[1.0],
        dense_output=True,
    )  # fmt: skip
    assert s.success, s.message
    after = np.flatnonzero(s.t == 1.0)[-1]
    # Rounding errors divided by the increments of 1e-5 are 1e-10.
    assert s.y[1, after] == pytest.approx(0.5 * np.cos(1), abs=1e-8)
    # The first step has the order 1, and the velocity is excluded from the error test.
    step = s.t[after + 1] - 1.0
    times = 1.0 + step * np.linspace(0.05, 1.0, 20)
    assert s.sol(times)[1] == pytest.approx(0.5 * np.cos(times), abs=step)
    assert step < 0.1


@pytest.mark.parametrize("arguments", [dict(suppress=[False, True]), dict(method="radau9", index=[1, 2])])
def test_a_constraint_that_jumps_at_a_break_is_named(arguments):
    s = solve_dae(prescribed(0.1), (0, 2.5), [0, 1.5], [1.5, 0], rtol=1e-9, atol=1e-9, breaks=[1.0], **arguments)
    assert not s.success and s.t[-1] == 1.0 and "break" in s.message and "`index`" not in s.message


@pytest.mark.parametrize("multiplier", [1e-3, 1.0])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_wrong_multipliers_at_the_start_of_bdf_are_reported(multiplier, rtol):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        s = solve_dae(
            lambda t, y, yp: [1e-3 * yp[0] - y[1], y[0] - np.sin(t)], (0, 2), [0, multiplier], [1, 0],
            suppress=[False, True], rtol=rtol, atol=[0.01 * rtol, 1e-5 * rtol],
        )  # fmt: skip
    assert s.success, s.message
    expected = ["[1]"] if multiplier == 1.0 else []
    assert [("[1]" if "[1]" in str(w.message) else "") for w in caught] == expected


@pytest.mark.parametrize("rate", [0.0, 0.1])
def test_inconsistent_velocities_are_reported_for_any_rate(rate):
    """The rates of positions are computed from the velocities, independently of yp0."""
    y, yp = START.copy(), RATES.copy()
    y[2], yp[0] = 0.1, rate
    # Equation 4 changes at the rate 2 x u = 0.2.
    with pytest.warns(UserWarning, match=r"\b4\b.*\b2\.00e-01\b"):
        solve_dae(pendulum_and_heat, (0, 0.1), y, yp, method="radau5", index=INDEX)


def test_wrong_rates_of_positions_have_no_effect():
    wrong = RATES.copy()
    wrong[0] = 0.1
    found = [
        solve_dae(pendulum_and_heat, (0, 0.1), START, yp, method="radau5", index=INDEX).y
        for yp in (RATES, wrong)
    ]
    assert (found[0] == found[1]).all()


def test_rates_of_nonlinear_kinematic_equations_are_kept():
    """The distance d = hypot(x', y')³ is not linear in the rates."""

    def residual(t, y, yp):
        x, z, u, v, force, distance = y
        return [
            distance - np.hypot(yp[0], yp[1]) ** 3, yp[1] - v, yp[2] + force * x, yp[3] + force * z,
            x * x + z * z - 1.0, x * u + z * v,
        ]  # fmt: skip

    start, rates = np.array([1.0, 0.0, 0.0, 2.0, 4.0, 8.0]), np.array([0.0, 1.9, -4.0, 0.0, 0.0, 0.0])
    positions = np.array([True, True, False, False, False, False])
    kept = _with_kinematic_rates(lambda yp: np.array(residual(0.0, start, yp)), rates, positions)
    assert (kept == rates).all()


@pytest.mark.parametrize("angle", np.linspace(0.0, 1.5, 16))
def test_rounding_of_positions_is_no_violation(angle):
    """A wrong power stops the start; `consistent_start` would not help."""
    start, rates = START.copy(), RATES.copy()
    start[:2] = np.cos(angle), np.sin(angle)
    start[4] = -G * start[1]
    rates[2:4] = -start[4] * start[:2] - [0.0, G]
    start[6] = 3.0
    with pytest.raises(RuntimeError) as raised:
        solve_dae(pendulum_and_heat, (0, 0.1), start, rates, method="radau5", index=INDEX)
    assert "`consistent_start`" not in str(raised.value)


@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_first_steps_of_bdf_at_index_2_resolve_multipliers(rtol):
    # In the first step that IDAS itself selects, the rounding error of x divided by the step size exceeds the tolerance of
    # the force.
    def prescribed(t, y, yp):
        x, fast, force = y
        return [yp[0] - np.cos(t) - force + fast - np.exp(-t), 1e-3 * yp[1] + fast - 0.999 * np.exp(-t), x - 1 - np.sin(t)]

    s = solve_dae(
        prescribed, (0, 20), [1, 1, 0], [1, -1, 0], suppress=[False, False, True], rtol=rtol,
        atol=0.01 * rtol, max_steps=5000,
    )  # fmt: skip
    assert s.success, s.message


@pytest.mark.parametrize("method", ["radau5", "radau9"])
def test_multipliers_that_are_not_determined_are_reported(method):
    # Both constraints are x = sin t.
    def twice(t, y, yp):
        x, force, other = y
        return [yp[0] - force - other, x - np.sin(t), 2 * x - 2 * np.sin(t)]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(twice, (0, 1), [0, 0.5, 0.5], [1, 0, 0], method, index=[1, 2, 2])
    assert not s.success and "[1, 2]" in s.message


def test_sparsity_is_recommended_for_large_sparse_matrices():
    n = 300

    def chain(t, y, yp):
        return yp + 2 * y - np.roll(y, 1)

    start = np.linspace(0, 1, n)
    for arguments, is_recommended in [({}, True), ({"sparsity": np.eye(n) + np.roll(np.eye(n), 1, axis=0)}, False)]:
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            solve_dae(chain, (0, 0.1), start, np.roll(start, 1) - 2 * start, **arguments)
        assert any("`sparsity`" in str(warning.message) for warning in found) == is_recommended


# Orders 9 and 13 begin with longer steps, from which the multiplier is extrapolated less accurately.
@pytest.mark.parametrize("method, error", [
    ("radau5", 0.0), ("radau9", 0.0), ("radau13", 0.0), ("radau5", 1e-2), ("radau9", 1.0), ("radau13", 1.0),
])  # fmt: skip
def test_rounding_over_the_square_of_the_step_is_not_reported_as_a_jump(method, error):
    """Check a horizontal chain at rest of 30 links, whose multipliers start at 0."""
    n, mass, gravity = 30, 0.1, 9.81

    def residual(t, y, yp):
        q, v, force = np.split(y, [2 * n, 4 * n])
        links = np.diff(q.reshape(n, 2), axis=0, prepend=0.0)
        pull = 2.0 * links * force[:, None]
        pull[:-1] -= pull[1:]
        balance = mass * yp[2 * n : 4 * n].reshape(n, 2) + pull + [0.0, mass * gravity]
        return np.r_[yp[: 2 * n] - v, balance.ravel(), (links**2).sum(axis=1) - 1.0 / n**2]

    y0, yp0 = np.zeros(5 * n), np.zeros(5 * n)
    y0[: 2 * n : 2] = np.arange(1, n + 1) / n
    y0[4 * n + 10] = error
    yp0[2 * n + 1 : 4 * n : 2] = -gravity
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        solve_dae(
            residual, (0, 0.5), y0, yp0, method, index=[1] * 2 * n + [2] * 2 * n + [3] * n, rtol=1e-9, atol=1e-10,
            max_steps=8,
        )  # fmt: skip
    assert any("jump in the first step" in str(warning.message) for warning in found) == (error > 0.0)
