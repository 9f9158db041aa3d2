"""`solve_dae` in other units, at late times, with short inputs, and with arguments that it rejects."""

import time
import warnings

import numpy as np
import pytest
from scipy.sparse import identity, kron

import myovib
from myovib import solve_dae
from myovib._structure import Structure

RADAU = ["radau5", "radau9", "radau13"]


def pendulum(unit, index):
    """Return a pendulum in a unit of time, in the form of index 2 or 3."""
    scales = np.array([1, 1, unit, unit, unit**2])
    gravity = 9.81 * unit**2

    def residual(t, y, yp):
        constraint = y[:2] @ y[:2] - 1 if index == 3 else y[:2] @ y[2:4]
        return np.r_[yp[:2] - y[2:4], yp[2:4] + y[4] * y[:2] + [0, gravity], constraint]

    return dict(
        residual=residual,
        t_span=(0, 5 / unit),
        y0=[1, 0, 0, 0, 0],
        yp0=[0, 0, 0, -gravity, 0],
        index=[1, 1, 2, 2, 3] if index == 3 else [1, 1, 1, 1, 2],
        rtol=1e-5,
        atol=1e-5 * scales,
    )


@pytest.mark.parametrize("index", [2, 3])
@pytest.mark.parametrize("method", RADAU)
def test_steps_do_not_depend_on_the_unit_of_time(method, index):
    steps = [solve_dae(method=method, **pendulum(unit, index)).nsteps for unit in (1, 1e-6, 1e-3, 1e3, 1e6)]
    # Because of rounding errors, the number of 48 steps of order 13 changes by up to 5.
    assert np.abs(np.array(steps) / steps[0] - 1).max() < 0.15, steps


def rectifier(t, y, yp):
    """Rectifier for 50 Hz with RC = 0.1 s, whose diode conducts for 2 ms of each period of 20 ms."""
    current = 1e-12 * (np.exp(min((10 * np.sin(100 * np.pi * t) - y[0]) / 0.02585, 100)) - 1)
    return [1e-4 * yp[0] - y[1] + y[0] / 1e3, y[1] - current]


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("method", ["bdf", *RADAU])
def test_no_conduction_of_a_rectifier_is_skipped(method, tolerance):
    suppress = [0, 1] if method == "bdf" else None  # the current would cost BDF 77 000 steps at 1e-8
    s = solve_dae(
        rectifier, (0, 0.1), [0, 0], [0, 0], method, rtol=tolerance, atol=[tolerance, tolerance / 100],
        suppress=suppress,
    )  # fmt: skip
    # The reference is from SciPy's Radau at 1e-9. A skipped period would cause an error of 1.5 V. The error of each
    # charging pulse is at most 100 tolerances of 10 V and decays by exp(-0.2) per period.
    assert s.y[0, -1] == pytest.approx(8.108698, abs=1e3 * tolerance + 1e-6)


def test_equations_of_index_5_are_reported():
    def trajectory(t, y, yp):
        spring = 10 * (y[0] - y[1])
        return [yp[0] - y[2], yp[1] - y[3], yp[2] - y[4] + spring, yp[3] - spring, y[1] - np.sin(t)]

    start = ([0, 0, 0.9, 1, 0], [0.9, 1, 0, 0, -1.9])
    with pytest.warns(UserWarning, match="index 5"):
        solve_dae(trajectory, (0, 1e-3), *start, "radau5", index=[3, 1, 3, 2, 3])
    for unit in (1, 1e-6, 1e6):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            solve_dae(method="radau5", **(pendulum(unit, 3) | dict(t_span=(0, 0.1 / unit))))


def test_a_late_start_does_not_shorten_the_first_step_below_rounding():
    late = 1e8
    s = solve_dae(lambda t, y, yp: [yp[0] - np.cos(t - late)], (late, late + 20), [0], [1], "radau9")
    assert s.success, s.message
    # The bound covers local errors of 1e-4 in about 20 steps.
    assert s.y[0, -1] == pytest.approx(np.sin(20), abs=2e-3)


def test_the_kinds_of_many_variables_are_found_in_linear_time():
    n = 100_000
    before = time.perf_counter()
    s = solve_dae(
        lambda t, y, yp: yp + y, (0, 1e-3), np.ones(n), -np.ones(n), sparsity=identity(n), t_eval=[1e-3]
    )
    # A search of all rows for each column takes 20 s.
    assert s.success and time.perf_counter() - before < 8


@pytest.mark.parametrize("method", ["bdf", "radau9"])
def test_the_reason_of_an_end_is_named(method):
    def undefined(t, y, yp):
        return [yp[0] + y[0] + (np.nan if t > 0.5 else 0.0)]

    s = solve_dae(undefined, (0, 1), [1], [-1], method)
    assert not s.success and "nan" in s.message.lower(), s.message

    def refused(t, y, yp):
        if t > 0.5:
            raise myovib.StepFailure
        return [yp[0] + y[0]]

    s = solve_dae(refused, (0, 1), [1], [-1], method)
    assert not s.success and "StepFailure" in s.message, s.message


def test_small_tolerances_of_variables_that_start_at_zero_are_named():
    def driven(t, y, yp):
        return [yp[0] + y[0] - y[1], y[1] - 1e9 * np.sin(t)]

    with pytest.warns(UserWarning, match=r"variables \[1\] .*`atol`"):
        s = solve_dae(driven, (0, 5), [1e9, 0], [-1e9, 0])
    assert s.status == -1 and s.nsteps == 0 and "`atol`" in s.message
    assert solve_dae(driven, (0, 5), [1e9, 0], [-1e9, 0], atol=[1e-8, 1.0]).success


@pytest.mark.parametrize("index", [1, 2])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
@pytest.mark.parametrize("t_eval", [None, [0.06]])
def test_the_first_step_that_a_message_names_passes_the_error_test(index, rtol, t_eval):
    """A source and two coils charge a capacitor through a diode. The voltage between the coils has the index 2."""
    arguments = {"rtol": rtol, "atol": 1e-3 * rtol}

    def charged(t, y, yp):
        source, between, anode, voltage, current, second = y
        of_diode = 1e-12 * np.expm1((anode - voltage) / 0.026) + 1e-6 * (anode - voltage)
        joined = between - source + 1e-3 * current if index == 1 else current - second
        of_coils = [1e-3 * yp[4] - (between - anode if index == 1 else source - between), 1e-3 * yp[5] - (between - anode)]
        return [source - 5 * np.sin(314 * t), joined, second - of_diode, 1e-3 * yp[3] + voltage / 50 - of_diode, *of_coils]

    if index == 1:
        arguments["initial"] = "algebraic"
    else:
        arguments["suppress"] = [0, 1, 0, 0, 0, 0]
    start = (charged, (0, 0.06), np.zeros(6), np.zeros(6))
    with pytest.warns(UserWarning, match="`first_step=") as caught:
        s = solve_dae(*start, **arguments, t_eval=t_eval)
    assert s.nsteps == 0 and len(caught) == 1
    # A remedy is suggested only if the call does not already contain it.
    assert ("initial=" in s.message) == (index == 2)
    assert solve_dae(*start, **arguments, first_step=float(s.message.split("`first_step=")[1].split("`")[0])).success


def test_many_failed_error_tests_by_an_algebraic_variable_are_explained():
    with pytest.warns(UserWarning, match=r"algebraic variables \[1\] .*`suppress`"):
        solve_dae(rectifier, (0, 0.1), [0, 0], [0, 0], rtol=1e-8, atol=1e-8)


def test_many_failed_error_tests_at_coupling_capacitors_are_explained():
    """Integrate the transistor amplifier of Hairer and Wanner (1996)."""
    mass = 1e-6 * np.array([1, 1, 2, 3, 3, 4, 5, 5])

    def residual(t, y, yp):
        diodes = 1e-6 * np.expm1((y[[1, 4]] - y[[2, 5]]) / 0.026)
        pairs = [0, 3, 6]
        charging = mass * yp
        charging[pairs] -= mass[pairs] * yp[[1, 4, 7]]
        charging[[1, 4, 7]] = -charging[pairs]
        driven = 0.4 * np.sin(200 * np.pi * t)
        currents = [(driven - y[0]) / 1e3, (6 - 2 * y[1]) / 9e3 - 0.01 * diodes[0], diodes[0] - y[2] / 9e3]
        currents += [(6 - y[3]) / 9e3 - 0.99 * diodes[0], (6 - 2 * y[4]) / 9e3 - 0.01 * diodes[1]]
        currents += [diodes[1] - y[5] / 9e3, (6 - y[6]) / 9e3 - 0.99 * diodes[1], -y[7] / 9e3]
        return charging - currents

    start = np.array([0, 3, 3, 6, 3, 3, 6, 0.0])
    of_second = -3 / 9e3 / 2e-6, -3 / 9e3 / 4e-6
    of_start = np.array([0, 0, of_second[0], 0, 0, of_second[1], 0, 0])
    with pytest.warns(UserWarning, match="failed .* error tests .*`atol`"):
        solve_dae(residual, (0, 0.1), start, of_start, rtol=1e-5, atol=1e-7)


def test_a_solution_is_not_extrapolated():
    s = solve_dae(lambda t, y, yp: yp + y, (0, 2), [1], [-1], dense_output=True)
    assert s.sol([0, 2]).shape == (1, 2)
    for t in (2.5, -1e-9, [1, np.nan]):
        with pytest.raises(ValueError, match="known from 0.0 to 2.0"):
            s.sol(t)
    for t in ([[1, 2]], [[0.5]]):
        with pytest.raises(ValueError, match="t has shape"):
            s.sol(t)


def test_an_event_that_is_not_a_number_is_named():
    events = [lambda t, y, yp: t - 0.5, lambda t, y, yp: y]
    with pytest.raises(TypeError, match="event 1 .* must be a number"):
        solve_dae(lambda t, y, yp: yp + y, (0, 1), [1, 1], [-1, -1], events=events)


@pytest.mark.parametrize("method", ["radau5", "radau9", "radau13"])
@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e9, 1e15])
def test_the_unit_of_time_does_not_affect_first_steps(method, unit):
    def decay(t, y, yp):
        return [unit * yp[0] + np.sqrt(np.abs(y[1])), y[1] - y[0] ** 2]

    s = solve_dae(decay, (0, 2 * unit), [1, 1], [-1 / unit, 0], method, rtol=1e-6, atol=1e-8)
    assert s.success, s.message
    # Global errors are a few tolerances.
    assert s.y[:, -1] == pytest.approx([np.exp(-2), np.exp(-4)], rel=1e-5)


@pytest.mark.parametrize("mass", [1e-3, 0.1, 1.0, 1e3])
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_indices_are_compared_in_any_units(mass, length):
    gravity = np.array([0, 9.81])

    def residual(t, y, yp):
        p, v, force = y[:2], y[2:4], y[4]
        return np.r_[yp[:2] - v, mass * (yp[2:4] + gravity) + force * p, p @ p - length**2]

    atol = 1e-6 * np.array([length, length, np.sqrt(length), np.sqrt(length), mass / length])
    start = ([length, 0, 0, 0, 0], [0, 0, 0, -9.81, 0])
    arguments = dict(rtol=1e-6, atol=atol, max_steps=2)
    # At this position, the vertical velocity is not constrained.
    with pytest.warns(UserWarning, match=r"variables \[2, 4\] .* the indices \[2, 3\], but `index` states \[1, 2\]"):
        solve_dae(residual, (0, 1), *start, "radau5", index=[1, 1, 1, 1, 2], **arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solve_dae(residual, (0, 1), *start, "radau5", index=[1, 1, 2, 2, 3], **arguments)


@pytest.mark.parametrize("factor", [1e-3, 0.01, 0.1, 1.0, 100.0, 1e3])
def test_an_index_above_3_is_reported_in_any_units(factor):
    def index_4(t, y, yp):
        return [yp[0] - y[1], factor * yp[1] - y[2], factor * yp[2] - y[3], y[0] - np.sin(t)]

    def index_5(t, y, yp):
        spring = 10 * factor * (y[1] - y[0])
        return [yp[0] - y[2], yp[1] - y[3], factor * yp[2] - spring, factor * yp[3] + spring - y[4], y[0] - t**6 / 720]

    for residual, index, start in (
        (index_4, [1, 2, 3, 3], ([0, 1, 0, -(factor**2)], [1, 0, -factor, 0])),
        (index_5, [1, 2, 2, 3, 3], ([0] * 5, [0] * 5)),
    ):
        with pytest.warns(UserWarning, match=f"have index {len(index)}"):
            s = solve_dae(residual, (0, 0.1), *start, "radau9", index=index, rtol=1e-5, atol=1e-6)
        assert s.status == -1 and f"have index {len(index)}" in s.message


def source_at_capacitors(resistance, capacity, rows, unknowns):
    """Return two capacitors in series at a source, with a third beside the source: index 2 without a resistance."""

    def residual(t, y, yp):
        first, second, current = y / unknowns
        of_first, of_second, _ = yp / unknowns
        into_second = capacity * (of_first - of_second)
        return rows * [
            2 * capacity * of_first + into_second - current,
            3 * capacity * of_second - into_second + 100 * capacity * second,
            first + resistance / capacity * current - np.sin(10 * t),
        ]

    of_first, of_second = (10, 2.5) if resistance == 0 else (0, 0)
    current = capacity * (3 * of_first - of_second)
    y0, yp0 = unknowns * [0, 0, current], unknowns * [of_first, of_second, 0]
    return residual, (0, 0.1), y0, yp0, unknowns * [1e-6, 1e-6, 1e-6 * capacity]


@pytest.mark.parametrize("method", ["radau5", "bdf"])
@pytest.mark.parametrize("resistance", [0, 0.01])
def test_an_index_above_1_is_reported_in_any_units(resistance, method):
    generator = np.random.default_rng(1)
    for capacity in (1e-12, 1e-6, 1.0, 1e12):
        for rows, unknowns in [np.ones((2, 3)), *10.0 ** generator.integers(-12, 13, (2, 2, 3))]:
            *problem, atol = source_at_capacitors(resistance, capacity, rows, unknowns)
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                solve_dae(*problem, method, atol=atol, max_steps=3)
            named = any("[2]" in str(warning.message) for warning in caught)
            assert named == (resistance == 0), (capacity, rows, unknowns)


@pytest.mark.parametrize("method", ["radau5", "bdf"])
@pytest.mark.parametrize("conductance", [1e6, 1e8, 1e9])
@pytest.mark.parametrize("n_cells", [1, 80])
def test_widely_different_coefficients_are_not_an_index_above_1(conductance, method, n_cells):
    # Regression: two nodes of an electrode joined by a metal strip had an index above 1 for values of 1e8 and more.
    def electrode(y, yp):
        charge, a, b = y
        strip = conductance * (a - b)
        return [yp[0] - np.sinh(20 * a), strip + np.sinh(20 * a) - 1, np.sinh(20 * b) - strip]

    def residual(t, y, yp):
        return np.array(electrode(y.reshape(3, -1), yp.reshape(3, -1))).ravel()

    mean, half = np.arcsinh(0.5) / 20, 0.25 / conductance
    start = np.repeat([[0, mean + half, mean - half], [0.5, 0, 0]], n_cells, axis=1)
    sparsity = kron(np.ones((3, 3)), identity(n_cells)) if n_cells > 1 else None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve_dae(residual, (0, 1), *start, method, rtol=1e-6, sparsity=sparsity)
    assert s.success


@pytest.mark.parametrize("seed", range(10))
def test_an_index_above_1_is_found_in_combined_equations(seed):
    # No single equation is free of derivatives. The difference quotients of F are not exactly singular.
    mixed = np.linalg.qr(np.random.default_rng(seed).standard_normal((5, 5)))[0]
    structure = Structure.at(
        lambda t, y, yp: mixed @ np.r_[yp[:2] - y[2:4], yp[2:4] + y[4] * y[:2] + [0, 9.81], y[:2] @ y[:2] - 1], 0, np.array([0.6, -0.8, 0.4, 0.3, 8.098]),
        np.array([0.4, 0.3, -4.8588, -3.3316, 0]), np.full(5, 1e-6),
    )  # fmt: skip
    assert structure.of_higher_index == [4]
