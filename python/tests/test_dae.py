"""solve_dae against exact solutions, published values and SciPy."""

import gc
import pickle
import re
import threading
import tracemalloc
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.sparse import csc_matrix, diags

import myovib
from myovib import consistent_start, solve_dae

G = 9.81
METHODS = ["bdf", "radau5", "radau9", "radau13"]


def robertson(t, y, yp):
    a, b, c = y
    rate = 0.04 * a - 1e4 * b * c
    return np.array([yp[0] + rate, yp[1] - rate + 3e7 * b * b, a + b + c - 1])


def robertson_jacobian(t, y, yp):
    a, b, c = y
    df_dy = [
        [0.04, -1e4 * c, -1e4 * b],
        [-0.04, 1e4 * c + 6e7 * b, 1e4 * b],
        [1.0, 1.0, 1.0],
    ]
    return np.array(df_dy), np.diag([1.0, 1.0, 0.0])


ROBERTSON = dict(y0=[1, 0, 0], yp0=[-0.04, 0.04, 0], rtol=1e-6, atol=[1e-10, 1e-14, 1e-10])

# Mazzia & Magherini, Test Set for IVP Solvers 2.4, problem ROBER, at t = 1e11.
ROBERTSON_LATE = np.array([0.2083340149701255e-07, 0.8333360770334713e-13, 0.9999999791665050])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("jacobian", [None, robertson_jacobian])
def test_robertson_has_the_published_values(method, jacobian):
    s = solve_dae(robertson, (0, 1e11), method=method, jacobian=jacobian, **ROBERTSON)
    assert s.success and s.t[-1] == 1e11
    # Local errors of 1e-6 in about 700 steps are damped by the decay to one hundred times the local error.
    atol = np.array([1e-10, 1e-14, 1e-10])
    assert (np.abs(s.y[:, -1] - ROBERTSON_LATE) <= 1e-4 * ROBERTSON_LATE + 1e2 * atol).all()


@pytest.mark.parametrize("method", METHODS)
def test_tolerances_may_be_below_the_rounding_of_other_variables(method):
    # Regression: BDF stopped at the start, because a variable of value 0 was displaced by 1e-16, which rounding loses in
    # the sum with 1 in the last equation.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve_dae(robertson, (0, 1e11), [1, 0, 0], [-0.04, 0.04, 0], method, rtol=1e-6, atol=1e-16)
    assert s.status == 0
    # Errors of BDF accumulate to several tolerances.
    np.testing.assert_allclose(s.y[:, -1], ROBERTSON_LATE, rtol=1e-5)


def test_robertson_agrees_with_scipy():
    def rates(t, y):
        return -robertson(t, np.r_[y, 1 - y.sum()], np.zeros(3))[:2]

    times = np.logspace(-2, 3, 6)
    reference = solve_ivp(
        rates, (0, 1e3), [1, 0], "Radau", t_eval=times, rtol=1e-10, atol=1e-14
    )
    for method in METHODS:
        s = solve_dae(robertson, (0, 1e3), method=method, t_eval=times, **ROBERTSON)
        assert (s.t == times).all()
        # The bound follows as above; the error of the reference is negligible.
        assert np.allclose(s.y[:2], reference.y, rtol=1e-4, atol=1e-12)


def pendulum(t, y, yp):
    p, v, tension = y[:2], y[2:4], y[4]
    return np.r_[yp[:2] - v, yp[2:4] + tension * p + [0, G], p @ p - 1]


PENDULUM = dict(y0=[1, 0, 0, 0, 0], yp0=[0, 0, 0, -G, 0], index=[1, 1, 2, 2, 3])


@pytest.mark.parametrize("method", METHODS[1:])
def test_the_pendulum_of_index_3_is_that_of_the_angle(method):
    exact = solve_ivp(
        lambda t, x: [x[1], -G * np.sin(x[0])],
        (0, 2), [np.pi / 2, 0], "DOP853", rtol=1e-12, atol=1e-12, dense_output=True,
    )  # fmt: skip
    s = solve_dae(
        pendulum, (0, 2), method=method, rtol=1e-8, atol=1e-10, dense_output=True, **PENDULUM
    )
    assert s.success
    angle = exact.sol(s.t)[0]
    # The tolerance limits the local error. The errors of about 100 steps per swing accumulate.
    assert np.allclose(s.y[:2], [np.sin(angle), -np.cos(angle)], atol=1e-5)
    within = np.linspace(0, 2, 101)
    angle = exact.sol(within)[0]
    assert np.allclose(s.sol(within)[:2], [np.sin(angle), -np.cos(angle)], atol=1e-4)


def ball(t, y, yp):
    return [yp[0] - y[1], yp[1] + G]


def height(t, y, yp):
    return y[0]


height.terminal, height.direction = True, -1


def climbing(t, y, yp):
    return y[1]


@pytest.mark.parametrize("method", METHODS)
def test_events_are_found_where_they_are(method):
    s = solve_dae(
        ball, (0, 10), [0, 10], [10, -G], method, events=[height, climbing], rtol=1e-8, atol=1e-10
    )
    assert s.status == 1 and "event 0" in s.message
    # All methods integrate the parabola exactly. The error of the time is 1e-8 of 10 m, divided by 10 m/s.
    assert s.t[-1] == pytest.approx(2 * 10 / G, abs=1e-7)
    assert s.t_events[1] == pytest.approx([10 / G], abs=1e-7)
    assert s.y_events[1][0, 0] == pytest.approx(100 / (2 * G), rel=1e-6)


def test_functions_take_what_args_holds():
    rate, level = 2.0, 0.5
    residual = lambda t, y, yp, rate, level: yp + rate * y
    jacobian = lambda t, y, yp, rate, level: ([[rate]], [[1.0]])

    def falls_below(t, y, yp, rate, level):
        return y[0] - level

    falls_below.terminal = True
    s = solve_dae(
        residual, (0, 10), [1], [-rate], jacobian=jacobian, events=falls_below, args=(rate, level),
        rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    assert s.status == 1
    assert s["t"][-1] == s.t[-1] == pytest.approx(np.log(2) / rate, rel=1e-6)
    assert "y" in s and "times" not in s and set(s) >= {"t", "y", "success"}
    with pytest.raises(KeyError):
        s["times"]


def test_backwards_and_dense_output():
    s = solve_dae(
        lambda t, y, yp: yp + y, (1, 0), [np.exp(-1)], [-np.exp(-1)], rtol=1e-8, atol=1e-10,
        dense_output=True,
    )  # fmt: skip
    assert s.y[0, -1] == pytest.approx(1, rel=1e-6)
    assert (s.sol.t_min, s.sol.t_max) == (0, 1)
    times = np.linspace(0, 1, 23)
    assert s.sol(times)[0] == pytest.approx(np.exp(-times), rel=1e-6)
    # At the ends of the steps, dense output equals the solution up to rounding errors.
    assert s.sol(s.t[1:]) == pytest.approx(s.y[:, 1:], rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_dense_output_is_that_of_the_steps(method):
    times = np.linspace(0, 2, 101)
    oscillate = lambda t, y, yp: [yp[0] - y[1], yp[1] + 100 * y[0]]
    arguments = dict(method=method, rtol=1e-8, atol=1e-10)
    s = solve_dae(oscillate, (0, 2), [1, 0], [0, -100], dense_output=True, **arguments)
    there = solve_dae(oscillate, (0, 2), [1, 0], [0, -100], t_eval=times, **arguments)
    # The bound covers rounding errors for values up to 10 and at most 9 interpolation points.
    assert s.sol(times) == pytest.approx(there.y, rel=0, abs=1e-11)


def test_a_sparse_jacobian_counts_as_a_dense_one():
    n, h = 30, 1 / 31

    def heat(t, y, yp):
        u = np.r_[0, y, 0]
        return yp - (u[2:] - 2 * u[1:-1] + u[:-2]) / h**2

    second = (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1)) / h**2
    y0 = np.sin(np.pi * h * np.arange(1, n + 1))
    runs = {
        "dense": dict(jacobian=lambda t, y, yp: (-second, np.eye(n))),
        "sparse": dict(
            jacobian=lambda t, y, yp: (csc_matrix(-second), csc_matrix(np.eye(n))),
            sparsity=second,
        ),
        "differences": dict(sparsity=csc_matrix(second)),
    }
    found = {k: solve_dae(heat, (0, 0.1), y0, second @ y0, **kw) for k, kw in runs.items()}
    assert found["dense"].nfev == found["sparse"].nfev
    # Each Jacobian requires three evaluations for its three colors, and one of the base residual. Checks of the pattern
    # require fewer evaluations than there are variables.
    differences = found["differences"]
    assert 0 <= differences.nfev - found["dense"].nfev - 4 * differences.njev < n
    with pytest.raises(ValueError, match="row 0, column 2 .*`sparsity`"):
        jacobian = lambda t, y, yp: (np.ones((n, n)), np.eye(n))
        solve_dae(heat, (0, 0.1), y0, second @ y0, jacobian=jacobian, sparsity=second)
    with pytest.raises(ValueError, match="row 7, column 20 .*`sparsity`"):

        def jacobian(t, y, yp):
            later = np.zeros((n, n))
            later[7, 20] = t
            return csc_matrix(later - second), csc_matrix(np.eye(n))

        solve_dae(heat, (0, 0.1), y0, second @ y0, jacobian=jacobian, sparsity=second)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("offsets", [[0], [-1, 1], [-1, 0], [0, 1], [-1, 0, 1]])
def test_a_pattern_that_lacks_entries_is_refused(method, offsets):
    n, h = 50, 1 / 51
    second = diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)) / h**2
    y0 = np.sin(np.pi * h * np.arange(1, n + 1))
    run = lambda: solve_dae(
        lambda t, y, yp: yp - second @ y, (0, 0.1), y0, second @ y0, method,
        sparsity=diags([1.0] * len(offsets), offsets, shape=(n, n)),
    )  # fmt: skip
    if len(offsets) == 3:
        assert run().success
        return
    with pytest.raises(ValueError, match="sparsity: equation .* has no entry in row") as caught:
        run()
    row, column = (int(k) for k in re.findall(r"row (\d+), column (\d+)", str(caught.value))[0])
    assert abs(row - column) <= 1 and column - row not in offsets


@pytest.mark.parametrize("method", METHODS)
def test_the_pattern_of_a_large_sparse_jacobian_is_its_own(method):
    n, calls = 4000, []
    second = diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)).tocsc()

    def jacobian(t, y, yp):  # the nonlinear term vanishes at the start
        calls.append(t)
        return -second + 3.0 * diags([y[:-1] ** 2], [-1]), diags([1.0], [0], shape=(n, n))

    def residual(t, y, yp):
        return yp - second @ y + np.r_[0.0, y[:-1] ** 3] - 1.0

    # Full matrices of 4000 rows would require 0.1 GB each, and the integration would take minutes.
    s = solve_dae(residual, (0, 1e-3), np.zeros(n), np.ones(n), method, jacobian=jacobian)
    assert s.success and calls and s.y[n // 2, -1] == pytest.approx(1e-3, rel=1e-4)


def test_an_input_faster_than_the_steps_is_reported():
    # A heater at 50 Hz with a mean power of 500 W. The steps of IDA end at zeros of the power.
    def heater(t, y, yp):
        return yp - 1000 * np.sin(100 * np.pi * t) ** 2

    run = lambda **kw: solve_dae(heater, (0, 10), [0.0], [0.0], t_eval=[0, 10], **kw)
    # A maximum step size is assumed to resolve all inputs, so shorter inputs are not detected.
    with pytest.warns(UserWarning, match="equation 0 .* `max_step`"):
        run(max_step=10.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Errors accumulate over 500 periods, as in the run with a maximum step size.
        assert run(rtol=1e-6).y[0, -1] == pytest.approx(5e3, rel=1e-3)
        # The manual promises 1000 times the tolerance.
        assert run(max_step=2e-3, rtol=1e-6).y[0, -1] == pytest.approx(5e3, rel=1e-3)


AKZO = [0.444, 0.00123, 0, 0.007, 0, 115.83 * 0.444 * 0.007]

# Mazzia & Magherini, Test Set for IVP Solvers 2.4, problem CHEMAKZO, at t = 180.
AKZO_LATE = np.array(
    [
        0.1150794920661702,
        0.001203831471567715,
        0.1611562887407974,
        0.0003656156421249283,
        0.01708010885264404,
        0.004873531310307455,
    ]
)


def akzo(t, y, yp):
    if y[1] < 0:
        raise myovib.StepFailure("negative")
    root = np.sqrt(y[1])
    r1, r2, r3 = 18.7 * y[0] ** 4 * root, 0.58 * y[2] * y[3], 0.58 / 34.4 * y[0] * y[4]
    r4, r5 = 0.09 * y[0] * y[3] ** 2, 0.42 * y[5] ** 2 * root
    slopes = [
        -2 * r1 + r2 - r3 - r4,
        -0.5 * r1 - r4 - 0.5 * r5 + 3.3 * (0.9 / 737 - y[1]),
        r1 - r2 + r3,
        -r2 + r3 - 2 * r4,
        r2 - r3 + r5,
    ]
    return np.r_[slopes - yp[:5], 115.83 * y[0] * y[3] - y[5]]


@pytest.mark.parametrize("method", METHODS)
def test_differences_stay_in_the_domain(method):
    rates = akzo(0, np.array(AKZO), np.zeros(6))
    rates[5] = 115.83 * (rates[0] * AKZO[3] + AKZO[0] * rates[3])
    s = solve_dae(akzo, (0, 180), AKZO, rates, method, rtol=1e-4, atol=1e-4)
    assert s.success, s.message
    # The bound covers local errors of 1e-4 in about 20 steps.
    assert np.allclose(s.y[:, -1], AKZO_LATE, rtol=0, atol=2e-3)


class OfTheUser(Exception):
    pass


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("where", ["residual", "jacobian", "events"])
def test_exceptions_come_through_as_they_are(method, where):
    raised = OfTheUser("mine")

    def raising(t, y, yp):
        if t > 0 or where == "jacobian":
            raise raised
        return [yp[0] + y[0]] if where == "residual" else 1.0

    functions = dict(residual=lambda t, y, yp: yp + y) | {where: raising}
    with pytest.raises(OfTheUser) as caught:
        solve_dae(t_span=(0, 1), y0=[1], yp0=[-1], method=method, **functions)
    assert caught.value is raised


def test_a_step_that_fails_is_tried_again():
    failures = []

    def residual(t, y, yp):
        if t > 0.5 and not failures:
            failures.append(t)
            raise myovib.StepFailure("once")
        return yp + y

    s = solve_dae(residual, (0, 1), [1], [-1])
    assert s.success and s.ncfn + len(failures) >= 1

    def never(t, y, yp):
        if t > 0.5:
            raise myovib.StepFailure("not beyond a half")
        return yp + y

    s = solve_dae(never, (0, 1), [1], [-1])
    assert s.status == -1 and "not beyond a half" in s.message and 0.4 < s.t[-1] <= 0.5


def test_consistent_initial_values():
    s = solve_dae(robertson, (0, 40), [1, 0, 0.3], [0, 0, 0], rtol=1e-6, atol=1e-12, initial="algebraic")
    assert s.y[:, 0] == pytest.approx([1, 0, 0], abs=1e-9)
    assert s.yp[:2, 0] == pytest.approx([-0.04, 0.04], rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_consistent_initial_values_of_a_long_span(method):
    # A thousandth of the span is a million times as long as the time scale at the start.
    s = solve_dae(
        robertson, (0, 4e10), [1, 0, 0], [0, 0, 0], method, rtol=1e-6, atol=1e-12, initial="algebraic"
    )
    assert s.success and s.yp[:2, 0] == pytest.approx([-0.04, 0.04], rel=1e-6)


def test_consistent_initial_values_backwards():
    # The first step has the direction of the span. Radau methods only support forward integration.
    s = solve_dae(
        lambda t, y, yp: [yp[0] + y[0], y[1] - 2 * y[0]], (1, 0), [np.exp(-1), 0], [0, 0],
        rtol=1e-8, atol=1e-10, first_step=1e-4, initial="algebraic",
    )  # fmt: skip
    assert s.y[1, 0] == pytest.approx(2 * np.exp(-1)) and s.yp[0, 0] == pytest.approx(-np.exp(-1))
    assert s.y[:, -1] == pytest.approx([1, 2], rel=1e-6)


def test_remedies_are_arguments_of_this_function():
    def circle(t, y, yp):
        return [yp[0] - y[1], y[0] ** 2 + y[1] ** 2 - 1]

    message = myovib.solve_dae(circle, (0, 1), [0, 1], [0, 0], rtol=1e-6, atol=1e-9).message
    assert 'initial="algebraic"' in message, message
    # The index is 1.
    assert "index=" not in message, message
    assert "reinit" not in message, message


@pytest.mark.parametrize("method", ["bdf", "radau5", "radau9", "radau13"])
def test_a_start_that_contradicts_an_equation_is_refused(method):
    start = ([1, 0, 0.3], [-0.04, 0.04, 0])
    with pytest.raises(RuntimeError, match='equation 2, .* has residual 3.00e-1 .* request initial="algebraic"'):
        solve_dae(robertson, (0, 40), *start, method=method, rtol=1e-6, atol=1e-12)
    s = solve_dae(robertson, (0, 40), *start, method=method, rtol=1e-6, atol=1e-12, initial="algebraic")
    assert s.success and s.y[2, 0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_exceptions_near_the_start_are_not_those_of_the_solution(method):
    def positive(t, y, yp):
        if y[1] < 0:
            raise ValueError("negative")
        # The initial value has a rounding error.
        return [yp[0] + y[0], y[1] - 0.3 * (1 - y[0]) - 1e-14]

    s = solve_dae(positive, (0, 1), [1, 0], [-1, 0.3], method=method, rtol=1e-6, atol=1e-9)
    assert s.success, s.message


def pendulum(t, q, qp):
    x, y, u, v, force = q
    return [qp[0] - u, qp[1] - v, qp[2] + force * x, qp[3] + force * y + 9.81, x * x + y * y - 1.0]


@pytest.mark.parametrize("angle", [0.3, 1.2])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_velocities_that_violate_a_constraint_are_reported(angle, tolerance):
    x, y = np.sin(angle), -np.cos(angle)

    def run(along, across):
        u, v = across * np.array([-y, x]) + along * np.array([x, y])
        force = across**2 - 9.81 * y
        return solve_dae(
            pendulum, (0, 0.1), [x, y, u, v, force], [u, v, -force * x, -force * y - 9.81, 0], "radau5",
            index=[1, 1, 2, 2, 3], rtol=tolerance, atol=tolerance,
        )

    with pytest.warns(UserWarning, match="equation 4 .*, a constraint on positions, changes at rate 2.00e-01"):
        run(along=0.1, across=2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(along=0.0, across=2.0).success
        assert run(along=0.0, across=0.0).success
        assert run(along=tolerance, across=2.0).success


def test_positions_and_velocities_are_moved_onto_a_constraint():
    def rods(t, q):
        """Return the constraints of a chain of two rods with a moving support."""
        first = q[:2] - [0.1 * np.sin(t), 0.0]
        return [first @ first - 1.0, (q[2:] - q[:2]) @ (q[2:] - q[:2]) - 4.0]

    q, v = consistent_start(rods, [0.9, 0.3, 2.7, 0.5], [0.3, -1.0, 0.5, 2.0], t=0.7)
    assert np.abs(rods(0.7, q)).max() < 1e-14
    h = 1e-5
    rate = (np.array(rods(0.7 + h, q + h * v)) - rods(0.7 - h, q - h * v)) / (2 * h)
    # The error of central differences is h^2 times a third derivative of about 10.
    assert np.abs(rate).max() < 1e-8
    again = consistent_start(rods, q, v, t=0.7)
    assert np.abs(again[0] - q).max() < 1e-14 and np.abs(again[1] - v).max() < 1e-8


def test_constraints_without_a_solution_are_refused():
    with pytest.raises(ValueError, match="no positions near q"):
        consistent_start(lambda t, q: q @ q + 1.0, [1.0, 0.3], [0.0, 0.0])
    with pytest.raises(ValueError, match="v has shape"):
        consistent_start(lambda t, q: q @ q - 1.0, [1.0, 0.3], [0.0])


def test_constraints_that_contradict_each_other_are_refused():
    with pytest.raises(ValueError, match="no positions near q"):
        consistent_start(lambda t, q: [q[0] - 1.0, q[0] - 2.0], [0.0, 0.0], [0.0, 0.0])
    # At this time, the constraints on positions agree, but their derivatives do not.
    with pytest.raises(ValueError, match="no velocities"):
        consistent_start(
            lambda t, q: [q[0] - np.sin(t), q[0] - np.cos(t)], [1.0], [0.0], t=np.pi / 4
        )


def test_redundant_constraints_are_satisfied():
    def circle(t, q):
        square = q @ q
        return [square - 1.0, np.sqrt(square) - 1.0, square**1.5 - 1.0]

    q, v = consistent_start(circle, [0.9, 0.5], [0.3, 2.0])
    # The difference quotients have errors of 1e-10.
    assert abs(q @ q - 1.0) < 1e-14 and abs(q @ v) < 1e-9
    assert q == pytest.approx(np.array([0.9, 0.5]) / np.hypot(0.9, 0.5), abs=1e-9)


def test_constraints_in_different_units_are_satisfied():
    constraint = lambda t, q: [1e6 * (q[0] - 1.0), 1e-6 * (q[0] + q[1] - 3.0)]
    q, v = consistent_start(constraint, [0.0, 0.0], [1.0, 2.0])
    assert q == pytest.approx([1.0, 2.0], rel=1e-12) and v == pytest.approx([0.0, 0.0], abs=1e-9)


def test_displacements_smaller_than_the_body_are_moved():
    def rod(t, q):
        return np.hypot(1.0 + q[0], q[1]) - 1.0

    q, v = consistent_start(rod, [2e-6, 1e-6], [0.0, 0.0])
    assert abs(rod(0.0, q)) < 1e-15 and not v.any()


@pytest.mark.parametrize("speed", [0.0, 1e-8, 1.0, 1e6])
def test_velocities_of_a_moving_support_do_not_depend_on_those_given(speed):
    for t in (0.0, 1e6):
        v = consistent_start(lambda t, q: q[0] - 0.1 * np.sin(t), [0.3], [speed], t)[1]
        # The difference quotients have errors of 1e-10 relative to v.
        assert v[0] == pytest.approx(0.1 * np.cos(t), abs=1e-9 * max(speed, 1.0))
    fast = lambda t, q: q[0] - 0.1 * np.sin(1e6 * t)
    v = consistent_start(fast, [0.3], [speed], time_scale=1e-6)[1]
    assert v[0] == pytest.approx(1e5, rel=1e-9)


@pytest.mark.parametrize(
    "arguments",
    [
        dict(q=[np.nan, 0.0]),
        dict(q=[]),
        dict(q=[[1.0, 0.0]]),
        dict(v=[np.nan, 0.0]),
        dict(v=[1.0]),
        dict(v=0.0),
        dict(t=np.nan),
        dict(time_scale=0.0),
        dict(time_scale=np.inf),
        dict(constraint=lambda t, q: np.nan),
        dict(constraint=lambda t, q: [[q @ q - 1.0]]),
    ],
    ids=str,
)
def test_arguments_of_consistent_start_are_checked(arguments):
    good = dict(constraint=lambda t, q: q @ q - 1.0, q=[1.0, 0.3], v=[0.0, 0.0])
    with pytest.raises(ValueError, match=f"^{next(iter(arguments))}") as raised:
        consistent_start(**(good | arguments))
    assert raised.type is ValueError


def test_velocities_at_zero_positions_are_checked():
    def hung(t, y, yp):  # a mass hung from a point 1 m above it
        x, height, u, v, force = y
        arm = 1.0 - height
        return [
            yp[0] - u, yp[1] - v, yp[2] + force * x, yp[3] - force * arm + G, x * x + arm * arm - 1.0
        ]  # fmt: skip

    def run(climb):
        solve_dae(
            hung, (0, 0.1), [0, 0, 2, climb, G + 4], [2, climb, 0, 4, 0], "radau5", index=[1, 1, 2, 2, 3]
        )

    with pytest.warns(UserWarning, match="equation 4 .*, a constraint on positions") as reported:
        run(climb=0.1)
    assert len(reported) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(climb=0.0)


def square_wave(t):
    return 1.0 if t % 1.0 < 0.5 else -1.0


def charged(t):
    """Return the voltage of a capacitor charged by a square wave through a resistor."""
    y, start = 0.0, 0.0
    for k in range(int(2 * t) + 1):
        end = min(0.5 * (k + 1), t)
        y = (-1) ** k + (y - (-1) ** k) * np.exp(start - end)
        start = end
    return y


def circuit(t, y, yp):
    return [yp[0] - y[1], y[1] - square_wave(t) + y[0]]


BREAKS = np.arange(0.0, 3.1, 0.5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("t_eval", [None, np.linspace(0.1, 3.0, 30)])
def test_square_waves_are_integrated_from_break_to_break(method, t_eval):
    s = solve_dae(
        circuit, (0, 3), [0, 1], [1, 0], method, rtol=1e-8, atol=1e-10, breaks=BREAKS, t_eval=t_eval,
        dense_output=True,
    )
    assert s.status == 0, s.message
    # The manual promises 1000 tolerances.
    assert np.abs(s.y[0] - [charged(t) for t in s.t]).max() < 1e-5
    if t_eval is not None:
        assert (s.t == t_eval).all()
    times = np.linspace(0.01, 2.99, 150)  # does not contain the breaks
    currents = [square_wave(t) - charged(t) for t in times]
    assert np.abs(s.sol(times)[1] - currents).max() < 1e-5


def test_breaks_are_passed_backwards():
    end = [charged(3.0), -1 - charged(3.0)]
    s = solve_dae(circuit, (3, 0), end, [end[1], 0], rtol=1e-8, atol=1e-10, breaks=BREAKS)
    assert s.status == 0, s.message
    # In backward integration, errors grow by a factor of e^3 = 20.
    assert abs(s.y[0, -1]) < 2e-4


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "breaks",
    [[0.3, 0.1 * 3], [1e-17, 0.3], [0.3, 1 - 1e-16], [0.3, 0.3 + 1e-14], [0.0, 0.3, 1.0], [1e-13, 0.3]],
    ids=str,
)
def test_breaks_that_differ_by_rounding_are_one(method, breaks):
    last = max(t for t in breaks if t < 0.5)
    called = []

    def stepped(t, y, yp):
        called.append(t)
        return [yp[0] - y[1], y[1] - (1.0 if t <= last else -1.0)]

    s = solve_dae(stepped, (0, 1), [0, 1], [1, 0], method, breaks=breaks)
    assert s.status == 0 and np.count_nonzero(np.diff(s.t) == 0) == 1, s.message
    # Both sides of the break are integrated exactly, up to rounding errors.
    assert s.y[0, -1] == pytest.approx(0.3 - 0.7, abs=1e-9)
    assert not set(called) & set(breaks)


def test_breaks_that_differ_by_rounding_are_one_backwards():
    called = []

    def stepped(t, y, yp):
        called.append(t)
        return [yp[0] - y[1], y[1] - (1.0 if t <= 0.3 else -1.0)]

    breaks = [1e-17, 0.3, 0.1 * 3, 1 - 1e-16]
    s = solve_dae(stepped, (1, 0), [-0.4, -1], [-1, 0], breaks=breaks)
    assert s.status == 0 and s.y[0, -1] == pytest.approx(0.0, abs=1e-9)
    assert not set(called) & set(breaks)


def test_breaks_of_a_short_span_at_a_late_time_are_not_ignored():
    start = 1e9
    s = solve_dae(lambda t, y, yp: yp - 1.0, (start, start + 2e-3), [0], [1], breaks=start + 1.5e-3)
    assert s.success and (s.t == start + 1.5e-3).sum() == 2
    # The time has a rounding error of 1.2e-7.
    assert s.y[0, -1] == pytest.approx(2e-3, abs=1.2e-7)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("initial", ["given", "algebraic", "states"])
def test_functions_are_not_called_at_a_break_at_the_start(method, initial):
    called = []

    def stepped(t, y, yp):
        called.append(t)
        return [yp[0] + y[0] - 1.0, y[1] - (1.0 if t <= 0.0 else -1.0)]

    s = solve_dae(stepped, (0, 1), [1, -1], [0, 0], method, breaks=[0, 1], initial=initial)
    assert s.status == 0 and s.y[1, 0] == pytest.approx(-1.0)
    assert not {0.0, 1.0} & set(called)


def test_velocities_are_checked_within_the_first_part():
    called = []
    kick = 1e-6

    def carried(t, q, qp):  # a mass on a support that is accelerated suddenly
        called.append(t)
        x, y, u, v, force = q
        x = x - 500.0 * max(t - kick, 0.0) ** 2
        return [qp[0] - u, qp[1] - v, qp[2] + force * x, qp[3] + force * y + G, x * x + y * y - 1.0]

    breaks = [0.0, kick, 0.01]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve_dae(
            carried, (0, 0.01), [1, 0, 0, 0, 0], [0, 1e-3, 0, -G, 0], "radau5", index=[1, 1, 2, 2, 3],
            rtol=1e-8, atol=1e-8, breaks=breaks,
        )  # fmt: skip
    assert s.status == 0 and not set(called) & set(breaks)


def test_multipliers_of_index_2_jump_at_breaks():
    def triangle(t):
        return min(t % 1.0, 1.0 - t % 1.0)

    def follow(t, y, yp):
        return [yp[0] - y[1], y[0] - triangle(t)]

    s = solve_dae(follow, (0, 3), [0, 1], [1, 0], "radau9", index=[1, 2], rtol=1e-6, atol=1e-8, breaks=BREAKS)
    assert s.status == 0, s.message
    assert np.abs(np.abs(s.y[1]) - 1.0).max() < 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_the_part_before_a_break_without_a_solution_is_returned(method):
    def unsolvable_late(t, y, yp):
        return [yp[0] + y[0], y[1] ** 2 - (1 if t < 0.5 else -1)]

    arguments = dict(method=method, breaks=[0.5], rtol=1e-6)
    s = solve_dae(unsolvable_late, (0, 1), [1, 1], [-1, 0], **arguments)
    assert s.status == -1 and not s.success and s.t[-1] == 0.5
    # The global error of BDF is 10 to 100 tolerances.
    assert np.abs(s.y[0] - np.exp(-s.t)).max() < 1e-4
    s = solve_dae(unsolvable_late, (0, 1), [1, 1], [-1, 0], t_eval=[0.2, 0.9], **arguments)
    assert s.status == -1 and s.t.tolist() == [0.2]


def test_exceptions_after_a_break_come_through():
    class OfTheUser(RuntimeError):
        pass

    for kind in (RuntimeError, OfTheUser):

        def fails_late(t, y, yp):
            if t > 0.5:
                raise kind("of the user")
            return yp + y

        with pytest.raises(kind, match="^of the user$"):
            solve_dae(fails_late, (0, 1), [1], [-1], breaks=[0.5])


def test_the_representation_of_a_result_is_short():
    s = solve_dae(robertson, (0, 40), **ROBERTSON)
    assert len(repr(s)) < 300 and "status=0" in repr(s)


def test_events_are_counted_across_breaks():
    def crossing(t, y, yp):
        return y[0]

    crossing.terminal = 3
    s = solve_dae(circuit, (0, 3), [0, 1], [1, 0], "radau9", breaks=BREAKS, events=crossing)
    assert s.status == 1 and len(s.t_events[0]) == 3, s.message
    assert [charged(t) for t in s.t_events[0]] == pytest.approx([0.0] * 3, abs=1e-3)


def test_results_are_pickled_whole():
    s = solve_dae(robertson, (0, 40), dense_output=True, **ROBERTSON)
    copy = pickle.loads(pickle.dumps(s))
    assert (copy.y == s.y).all() and copy.nfev == s.nfev and (copy.sol(3.0) == s.sol(3.0)).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(method="euler"), "must be one of bdf, ida, radau5"),
        (dict(t_span=(0, 0)), "two different finite times"),
        (dict(y0=[1, 2]), "shape"),
        (dict(y0=[np.nan]), "non-finite"),
        (dict(atol=[1, 2, 3]), "must be 1 or 1"),
        (dict(rtol=-1), "rtol = -1: must be at least"),
        (dict(rtol=[1e-4, 1e-4]), "rtol = .* must be a number"),
        (dict(atol=-1), "atol = -1: must be at least 0"),
        (dict(t_eval=[1, 0.5]), "sorted"),
        (dict(t_span=(1, 0), method="radau5"), 'only "bdf" integrates backward'),
        (dict(t_eval=[2]), "t_span"),
        (dict(suppress=True), "algebraic"),
        (dict(index=[4]), "0 to 3"),
        (dict(index=[2]), '"bdf" does not use: .* `suppress`'),
        (dict(sparsity=np.eye(2)), "sparsity"),
        (dict(residual=lambda t, y, yp: [1, 2]), "returned 2 values: must be 1"),
        (dict(residual=lambda t, y, yp: None), "returned nothing: must be 1"),
        (dict(residual=lambda t, y, yp: [yp[0]], y0=[1, 0], yp0=[0, 0]), "returned 1 values: must be 2"),
        (dict(residual=lambda t, y, yp: yp[0]), r"of shape \(\): must be 1"),
        (dict(residual=lambda t, y, yp: [[1]]), r"of shape \(1, 1\): must be 1"),
        (dict(method="Radau"), "SciPy's 'Radau' is 'radau5'"),
        (dict(rtol=0), "rtol = 0: must be at least"),
        (dict(first_step=-1), "first_step = -1: must be above 0"),
        (dict(first_step=0), "first_step = 0: must be above 0"),
        (dict(max_step=0), "max_step = 0: must be above 0"),
        (dict(max_steps=0), "max_steps = 0: must be a whole number of at least 1"),
        (dict(max_steps=1.5), "max_steps = 1.5: must be a whole number of at least 1"),
        (dict(t_eval=[0.5, np.nan]), "non-finite"),
        (dict(max_order=2, method="radau5"), 'max_order = 2: only "bdf"'),
        (dict(index=[2], initial="algebraic", method="radau5"), 'initial = "algebraic" is for index 0 and 1'),
        (dict(breaks=[np.nan]), "breaks has non-finite entries"),
        (dict(index=[2.5], method="radau5"), "index = .* whole numbers from 0 to 3"),
        (dict(suppress=[True]), "suppress excludes all"),
        (dict(suppress=True, algebraic=[True]), "suppress excludes all"),
        (dict(t_eval=0.5), "t_eval has shape"),
        (dict(t_eval=[[0.5]]), "t_eval has shape"),
        (dict(rtol="a"), "rtol: must be real"),
        (dict(sparsity=(np.eye(1), np.eye(1))), "sparsity has shape"),
        (dict(events=lambda t, y, yp: np.nan), "event 0 .* is nan"),
        (dict(max_steps="a"), "max_steps: must be real"),
        (dict(max_step=[1, 2]), r"max_step = \[1, 2\]: must be a number"),
        (dict(rtol=1e-17), "rtol = 1e-17: must be at least 2.22e-14"),
        (dict(args=2.0), r"must be a tuple, as in args=\(2.0,\)"),
    ],
)
def test_arguments_that_make_no_sense_are_named(arguments, words):
    good = dict(residual=lambda t, y, yp: yp + y, t_span=(0, 1), y0=[1], yp0=[-1])
    with pytest.raises(ValueError, match=words):
        solve_dae(**(good | arguments))


@pytest.mark.parametrize("terminal", [-1, 1.5, "a", np.nan, np.inf])
def test_numbers_of_terminal_events_are_checked(terminal):
    def zero(t, y, yp):
        return y[0] - 0.5

    zero.terminal = terminal
    with pytest.raises(ValueError, match="event 0 .* has terminal = "):
        solve_dae(lambda t, y, yp: yp + y, (0, 1), [1], [-1], events=zero)


@pytest.mark.parametrize(
    "arguments", [dict(index=1), dict(t_span=40), dict(t_span=(0, 1, 2)), dict(events=3)], ids=str
)
def test_numbers_in_place_of_sequences_are_named(arguments):
    (name,) = arguments
    good = dict(residual=lambda t, y, yp: yp + y, t_span=(0, 1), y0=[1], yp0=[-1])
    with pytest.raises(TypeError, match=f"^{name} = .*must be a"):
        solve_dae(**(good | arguments))


@pytest.mark.parametrize(
    "arguments",
    [
        dict(y0=[1 + 1j]),
        dict(residual=lambda t, y, yp: yp + y + 1j * t),
        dict(jacobian=lambda t, y, yp: (1j * np.eye(1), np.eye(1))),
        dict(jacobian=lambda t, y, yp: (csc_matrix(1j * np.eye(1)), np.eye(1))),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_complex_values_are_refused(method, arguments):
    (name,) = arguments
    good = dict(residual=lambda t, y, yp: yp + y, t_span=(0, 1), y0=[1], yp0=[-1], method=method)
    with pytest.raises(TypeError, match=f"^{name} has complex values"):
        solve_dae(**(good | arguments))


def test_no_output_times_are_no_error():
    s = solve_dae(lambda t, y, yp: yp + y, (0, 1), [1], [-1], t_eval=[])
    assert s.status == 0 and s.t.shape == (0,) and s.y.shape == s.yp.shape == (1, 0)


def test_derivatives_that_the_equations_do_not_determine_are_named():
    def coupled(t, y, yp):  # a capacitor between two nodes with resistors to a source and to ground
        through = yp[0] - yp[1]
        return [through + y[0] - np.sin(t), -through + y[1], yp[2] + y[2], y[3] - y[2]]

    arguments = (coupled, (0, 1), [0, 0, 1, 0], [0, 0, 0, 0])
    with pytest.warns(UserWarning, match=r"derivatives of the variables \[0, 1\]"):
        s = solve_dae(*arguments, initial="algebraic", rtol=1e-6)
    assert s.success and abs(s.y[0, -1] + s.y[1, -1] - np.sin(1)) < 1e-5


def test_variables_of_index_2_in_the_error_test_of_bdf_are_named():
    w = 20 * np.pi

    def loop(t, y, yp):  # a loop of a source and a capacitor, with a resistor and a second capacitor
        through = (y[0] - y[1]) / 10
        return [1e-3 * yp[0] + through - y[2], 1e-3 * yp[1] - through, y[0] - np.sin(w * t)]

    arguments = (loop, (0, 0.2), [0, 0, 1e-3 * w], [w, 0, 0])
    limits = dict(rtol=1e-9, atol=1e-10, max_steps=3000)
    with pytest.warns(UserWarning, match=r"variables \[2\] .*`suppress`"):
        s = solve_dae(*arguments, **limits)
    assert s.status == -1 and "variables [2]" in s.message and "chattering" not in s.message
    assert solve_dae(*arguments, **limits, suppress=[0, 0, 1]).success


@pytest.mark.parametrize("method", ["bdf", "radau5"])
@pytest.mark.parametrize("initial", ["algebraic", "states"])
def test_a_correction_from_undefined_values_names_the_equation(method, initial):
    def undefined(t, y, yp):
        return [yp[0] + y[0], np.nan]

    with pytest.raises(RuntimeError, match="nan in equation 1") as raised:
        solve_dae(undefined, (0, 1), [1, 0], [-1, 0], method=method, initial=initial)
    assert "IDA" not in str(raised.value)


@pytest.mark.parametrize(
    "name",
    [
        "jac", "jac_sparsity", "fun", "reltol", "mass", "differential_vars", "sensitivities",
        "algebraic_idx", "calc_initcond", "eventsfn", "user_data", "constraints", "constraints_type", "nonnegative",
    ],
)
def test_names_of_other_solvers_are_answered(name):
    with pytest.raises(TypeError, match=f"{name}'.* here"):
        solve_dae(lambda t, y, yp: yp + y, (0, 1), [1], [-1], **{name: None})


def test_output_times_may_be_repeated_and_limits_may_be_floats():
    def decay(t, y, yp):
        return yp + y

    times = [0, 0, 0.5, 0.5, 1]
    s = solve_dae(decay, (0, 1), [1], [-1], t_eval=times, max_steps=1000.0)
    assert s.t.tolist() == times and s.y[0, 2] == s.y[0, 3]
    stopped = solve_dae(decay, (0, 1), [1], [-1], max_steps=3.0, rtol=1e-8)
    assert stopped.status == -1 and stopped.nsteps == 3
    assert solve_dae(decay, (0, 1), [1], [-1], max_steps=np.inf).success


def test_memory_is_checked_before_full_matrices_are_stored():
    n = 50_000
    with pytest.raises(MemoryError, match="sparsity"):
        solve_dae(lambda t, y, yp: yp + y, (0, 1), np.ones(n), -np.ones(n))


@pytest.mark.parametrize("method", METHODS)
def test_an_event_that_stays_at_zero_is_where_it_begins(method):
    def ramp(t, y, yp):
        return [yp[0] - 1]

    for event in (
        lambda t, y, yp: min(t - 1, 0.0),
        lambda t, y, yp: y[0] >= 1,
        lambda t, y, yp: np.bool_(t >= 1),
    ):
        s = solve_dae(ramp, (0, 3), [0], [1], method, events=event)
        assert s.success and s.t[-1] == 3
        # y equals t up to rounding.
        assert s.t_events[0] == pytest.approx([1], abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_derivative_of_a_nonlinear_equation_is_corrected(method):
    s = solve_dae(
        lambda t, y, yp: [yp[0] ** 3 + yp[0] - 2 * y[0]], (0, 1), [1.0], [0.0], method,
        initial="algebraic",
    )  # fmt: skip
    # The error is at most 0.0033 times the tolerance of 1e-4, divided by a thousandth of the span.
    assert s.yp[0, 0] == pytest.approx(1, abs=4e-4)
    # With y' = v: t = 3 (v² - 1)/4 + log(v)/2, y = (v³ + v)/2.
    assert s.y[0, -1] == pytest.approx(2.2310, abs=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_small_coefficients_of_derivatives_are_found(method):
    def node(t, y, yp):
        return [1e-12 * yp[0] + y[0] / 1e3 - 5e-3]

    # The capacitor is charged over its time constant, 1 ns.
    s = solve_dae(node, (0, 1e-9), [0], [0], method, rtol=1e-6, atol=1e-9, initial="algebraic")
    assert s.success and s.y[0, 0] == 0
    assert s.y[0, -1] == pytest.approx(5 * (1 - np.exp(-1)), rel=1e-4)


def test_chattering_is_named():
    def relay(t, y, yp):
        return [yp[0] + np.sign(y[0])]

    s = solve_dae(relay, (0, 2), [1], [-1], "ida", max_steps=2000)
    assert s.status == -1
    assert "max_steps" not in s.message or "chattering" in s.message, s.message


def test_a_wrong_jacobian_is_named():
    def wrong(t, y, yp):
        df_dy, df_dyp = robertson_jacobian(t, y, yp)
        df_dy[1, 0] *= -1
        return df_dy, df_dyp

    with pytest.warns(UserWarning, match=r"row 1, column 0 .* differences"):
        solve_dae(robertson, (0, 1), jacobian=wrong, **ROBERTSON)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("equations", "variables", "dependent"),
    [
        (lambda t, y, yp: [yp[0] - y[1], y[0] - np.sin(t), 2 * (y[0] - np.sin(t))], [2], [1, 2]),
        (lambda t, y, yp: [yp[0] - np.cos(t), y[1] + y[2] - 1, y[1] + y[2] - 1], [1, 2], [1, 2]),
    ],
)
def test_undetermined_variables_and_dependent_equations_are_named(method, equations, variables, dependent):
    with pytest.warns(UserWarning, match=re.escape(f"variables {variables}: the equations {dependent}")):
        s = solve_dae(equations, (0, 1), [0, 1, 0], [1, 0, 0], method)
    assert not s.success and f"variables {variables}" in s.message


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("initial", ["algebraic", "states"])
def test_equations_without_a_solution_are_named(method, initial):
    unsolvable = lambda t, y, yp: [yp[0] + y[0], y[1] ** 2 + 1]
    with pytest.raises(RuntimeError, match=r"equations \[1\]"):
        solve_dae(unsolvable, (0, 1), [1, 1], [-1, 0], method, initial=initial)


@pytest.mark.parametrize("method", METHODS)
def test_equations_without_corrected_values_are_named(method):
    hidden = lambda t, y, yp: [yp[0] - y[1], y[0] - np.sin(t) - 0.1]
    with pytest.raises(RuntimeError, match=r"combination of the equations \[1\]"):
        solve_dae(hidden, (0, 1), [0, 0], [0, 0], method, initial="algebraic")
    start = ([0.1, 1.0], [1.0, 0.0])
    index = {} if method == "bdf" else dict(index=[1, 2])
    suppress = [False, True] if method == "bdf" else None
    # The remedy that the message suggests works.
    assert solve_dae(hidden, (0, 1), *start, method, suppress=suppress, **index).success


@pytest.mark.parametrize("method", METHODS)
def test_variables_of_higher_index_are_named_at_the_start(method):
    with pytest.warns(UserWarning, match=r"variables \[4\] .* `index`"):
        solve_dae(pendulum, (0, 1e-3), PENDULUM["y0"], PENDULUM["yp0"], method)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solve_dae(robertson, (0, 40), method=method, **ROBERTSON).success


@pytest.mark.parametrize("method", METHODS)
def test_a_pole_is_named(method):
    with pytest.warns(UserWarning, match=r"variables \[0\] .* pole"):
        s = solve_dae(lambda t, y, yp: yp - y**2, (0, 2), [1.0], [1.0], method)
    assert not s.success and s.t[-1] == pytest.approx(1.0, abs=1e-2)


def test_masked_arrays_are_refused():
    with pytest.raises(ValueError, match="y0 has masked entries"):
        solve_dae(lambda t, y, yp: yp + y, (0, 1), np.ma.array([1.0, 2.0], mask=[0, 1]), [-1, -1])


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("off", [1e-6, 1e-9, 1e-11, 1e-13])
def test_a_start_typed_with_few_digits_is_harmless_or_has_a_remedy(method, off):
    def run(q, v, tolerance):
        force = v @ v - G * q[1]
        start = [*q, *v, force], [*v, -force * q[0], -force * q[1] - G, 0]
        return solve_dae(pendulum, (0, 0.5), *start, method, index=PENDULUM["index"], rtol=tolerance, atol=tolerance)

    exact = np.array([np.sqrt(3) / 2, -0.5])
    for tolerance in (1e-4, 1e-8):
        arguments = (exact + [off, 0.0], np.array([0.5, np.sqrt(3) / 2]))
        try:
            s = run(*arguments, tolerance)
        except RuntimeError as error:
            assert "consistent_start" in str(error) and off > tolerance
            s = run(*consistent_start(lambda t, q: q @ q - 1, *arguments), tolerance)
        assert s.success, s.message
        reference = run(exact, arguments[1], tolerance)
        # The bound is a thousand tolerances plus the effect of the changed start.
        assert np.abs(s.y[:, -1] - reference.y[:, -1]).max() < 1e3 * tolerance + 100 * off


@pytest.mark.parametrize("calls", [1, 4, 50])
@pytest.mark.parametrize("method", METHODS)
def test_an_interrupt_in_a_function_comes_through_at_once(method, calls):
    count = 0

    def interrupted(t, y, yp):
        nonlocal count
        count += 1
        if count >= calls:
            raise KeyboardInterrupt
        return robertson(t, y, yp)

    with pytest.raises(KeyboardInterrupt):
        solve_dae(interrupted, (0, 1e11), method=method, **ROBERTSON)
    assert count == calls


def test_nothing_is_leaked():
    def solve():
        solve_dae(robertson, (0, 4), jacobian=robertson_jacobian, **ROBERTSON)

    def measure(times):
        for _ in range(times):
            solve()
        gc.collect()
        return tracemalloc.get_traced_memory()[0], len(gc.get_objects())

    tracemalloc.start()
    try:
        measure(20)
        before = measure(20)
        after = measure(100)
    finally:
        tracemalloc.stop()
    # An array of three numbers has 136 bytes; a leak in each of the 100 calls would be 13 kB.
    assert after[0] - before[0] < 5_000 and after[1] - before[1] < 50


def test_two_threads_integrate_at_a_time():
    expected = solve_dae(robertson, (0, 1e6), **ROBERTSON)
    found = []
    integrate = lambda: found.append(solve_dae(robertson, (0, 1e6), **ROBERTSON))
    threads = [threading.Thread(target=integrate) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((s.y == expected.y).all() for s in found) and len(found) == 2
