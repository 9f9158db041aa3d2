"""Forward sensitivities of `solve_dae`, compared with exact derivatives and with difference quotients of runs."""

import math
import warnings

import numpy as np
import pytest
import myovib
from myovib import solve_dae
from scipy.sparse import coo_array

METHODS = ["bdf", "radau5", "radau9", "radau13"]


def decay(t, y, yp, p):
    """Return F of y' = −p₀ y with the algebraic variable z = p₁ y²."""
    return [yp[0] + p[0] * y[0], y[1] - p[1] * y[0] ** 2]


def exact_decay(t, p):
    """Return dy/dp and dz/dp for y(0) = 1, with the shape (2, 2, m)."""
    y = np.exp(-p[0] * t)
    return np.array([[-t * y, 0.0 * t], [-2.0 * t * p[1] * y**2, y**2]])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
@pytest.mark.parametrize("t_eval", [None, [0.0, 0.3, 1.1, 2.0]])
def test_derivatives_of_an_exponential_and_of_an_algebraic_variable(method, rtol, t_eval):
    p = np.array([0.7, 3.0])
    s = solve_dae(decay, (0, 2), [1, 3], [-0.7, -4.2], method, parameters=p, rtol=rtol, atol=rtol, t_eval=t_eval)
    assert s.success and s.dy_dp.shape == (2, 2, s.t.size)
    # The guide states errors of up to 100 tolerances for Radau IIA and 1000 for BDF.
    bound = (1000 if method == "bdf" else 100) * rtol
    np.testing.assert_allclose(s.dy_dp, exact_decay(s.t, p), rtol=0, atol=bound)


@pytest.mark.parametrize("method", METHODS)
def test_given_and_differenced_parameter_derivatives_agree(method):
    def df_dp(t, y, yp, p):
        return [[y[0], 0.0], [0.0, -(y[0] ** 2)]]

    common = dict(t_span=(0, 2), y0=[1, 3], yp0=[-0.7, -4.2], method=method, parameters=[0.7, 3.0], rtol=1e-6)
    given, differenced = (solve_dae(decay, df_dp=own, **common) for own in (df_dp, None))
    # Central differences have relative errors of eps^(2/3) = 4e-11, and the steps may differ because of rounding.
    np.testing.assert_allclose(given.dy_dp[:, :, -1], differenced.dy_dp[:, :, -1], rtol=0, atol=1e-6)


def test_radau_takes_the_same_steps_with_sensitivities():
    common = dict(t_span=(0, 2), y0=[1, 3], yp0=[-0.7, -4.2], method="radau5")
    alone = solve_dae(decay, args=([0.7, 3.0],), **common)
    both = solve_dae(decay, parameters=[0.7, 3.0], **common)
    np.testing.assert_array_equal(alone.t, both.t)
    np.testing.assert_array_equal(alone.y, both.y)
    assert alone.dy_dp is None


def pendulum(t, y, yp, p):
    """Return F of a pendulum of length p₀ under gravity p₁, in Cartesian coordinates."""
    x, z, u, w, tension = y
    return [yp[0] - u, yp[1] - w, yp[2] + tension * x, yp[3] + tension * z + p[1], x * x + z * z - p[0] ** 2]


def pendulum_at(length, gravity, rtol, t_end=1.0, **options):
    y0, yp0 = [length, 0, 0, 0, 0], [0, 0, 0, -gravity, 0]
    return solve_dae(
        pendulum, (0, t_end), y0, yp0, "radau9", index=[1, 1, 2, 2, 3], rtol=rtol, atol=rtol, **options
    )


def test_sensitivities_of_index_3_agree_with_differences():
    p = np.array([1.0, 9.81])
    # The initial position depends on the length. At rest, the acceleration depends only on gravity.
    start = np.zeros((5, 2))
    start[0, 0] = 1.0
    s = pendulum_at(*p, 1e-8, parameters=p, dy0_dp=start)
    step = 1e-4
    for j in range(2):
        changed = [p.copy(), p.copy()]
        changed[0][j] += step
        changed[1][j] -= step
        ends = [pendulum_at(*q, 1e-11, args=(q,)).y[:, -1] for q in changed]
        reference = (ends[0] - ends[1]) / (2.0 * step)
        # The difference quotients have errors of about step² = 1e-8, and errors of the runs, 1e-11, divided by the step.
        np.testing.assert_allclose(s.dy_dp[:4, j, -1], reference[:4], rtol=1e-5, atol=1e-5)
        # The order of multipliers is lower by one.
        np.testing.assert_allclose(s.dy_dp[4, j, -1], reference[4], rtol=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_sensitivities_continue_after_a_break(method):
    """Integrate y' = −p y + b(t) and z = p b(t) + y, where b jumps from 0 to 1 at t = 1."""

    def driven(t, y, yp, p):
        b = float(t > 1.0)
        return [yp[0] + p[0] * y[0] - b, y[1] - p[0] * b - y[0]]

    p, times = 0.5, np.array([0.5, 1.0, 1.5, 2.5])
    s = solve_dae(driven, (0, 3), [1, 1], [-p, -p], method, parameters=[p], breaks=[1.0], t_eval=times, rtol=1e-7, atol=1e-9)
    since = np.maximum(times - 1.0, 0.0)
    y = -times * np.exp(-p * times)
    y = y + (since * np.exp(-p * since) * p - (1.0 - np.exp(-p * since))) / p**2
    # The bounds are one hundred tolerances, as above.
    np.testing.assert_allclose(s.dy_dp[0, 0], y, rtol=0, atol=1e-5)
    np.testing.assert_allclose(s.dy_dp[1, 0], y + (times > 1.0), rtol=0, atol=1e-5)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_a_run_ends_at_an_event_with_its_sensitivities(method):
    def half(t, y, yp, p):
        return y[0] - 0.5

    half.terminal = True
    s = solve_dae(decay, (0, 5), [1, 3], [-0.7, -4.2], method, parameters=[0.7, 3.0], events=half, rtol=1e-7, atol=1e-9)
    assert s.status == 1
    exact = exact_decay(s.t[-1:], [0.7, 3.0])
    # The bound is one hundred tolerances, as above.
    np.testing.assert_allclose(s.dy_dp[:, :, -1:], exact, rtol=0, atol=1e-5)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_large_sparse_systems_have_sensitivities(method):
    """Integrate 201 copies of the decay, without the algebraic rows of dy0_dp."""
    n = 201

    def copies(t, y, yp, p):
        return np.r_[yp[:n] + p[0] * y[:n], y[n:] - p[1] * y[:n] ** 2]

    pattern = np.block([[np.eye(n), np.zeros((n, n))], [np.eye(n), np.eye(n)]])
    y0, yp0 = np.r_[np.ones(n), np.full(n, 3.0)], np.r_[np.full(n, -0.7), np.full(n, -4.2)]
    s = solve_dae(copies, (0, 2), y0, yp0, method, parameters=[0.7, 3.0], sparsity=pattern, rtol=1e-6, atol=1e-6)
    exact = exact_decay(s.t, [0.7, 3.0])
    # The bound is 100 tolerances for Radau IIA and 1000 for BDF, as above.
    np.testing.assert_allclose(s.dy_dp[[0, n]], exact, rtol=0, atol=1e-3 if method == "bdf" else 1e-4)


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (dict(parameters=[[0.7, 3.0]]), "parameters"),
        (dict(parameters=[0.7, np.nan]), "parameters"),
        (dict(parameters=[0.7, 3.0], dy0_dp=np.zeros((2, 1))), "dy0_dp"),
        (dict(parameters=[0.7, 3.0], dy0_dp=np.full((2, 2), np.inf)), "dy0_dp"),
        (dict(parameters=[0.7, 3.0], df_dp=lambda t, y, yp, p: np.zeros(2)), "df_dp"),
        (dict(parameters=[0.7, 3.0], initial="algebraic"), "initial"),
        (dict(df_dp=lambda t, y, yp, p: np.zeros((2, 2))), "df_dp"),
        (dict(dy0_dp=np.zeros((2, 2))), "dy0_dp"),
    ],
)
def test_bad_arguments_of_sensitivities_are_named(options, found):
    with pytest.raises(ValueError, match=found):
        solve_dae(decay, (0, 1), [1, 3], [-0.7, -4.2], **options)


def test_a_failure_in_the_derivative_ends_the_run():
    def df_dp(t, y, yp, p):
        if t > 0.5:
            raise myovib.StepFailure("undefined")
        return [[y[0], 0.0], [0.0, -y[0] ** 2]]

    s = solve_dae(decay, (0, 2), [1, 3], [-0.7, -4.2], "radau5", parameters=[0.7, 3.0], df_dp=df_dp)
    assert s.status == -1 and s.dy_dp.shape == (2, 2, s.t.size)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("time", [1e-9, 1e6])
def test_sensitivities_are_independent_of_the_unit_of_time(method, time):
    """Regression: with BDF, the derivatives had errors of 17 % if the span was 2e-9."""

    def cubic(t, y, yp, p):
        return time * yp + p * y**3

    s = solve_dae(cubic, (0, 2 * time), [1], [-1 / time], method, parameters=[1.0], rtol=1e-5, atol=1e-8)
    # y = (1 + 2 p t/T)^(-1/2).
    exact = -(s.t / time) * (1 + 2 * s.t / time) ** -1.5
    # The bound is one hundred tolerances, as above.
    np.testing.assert_allclose(s.dy_dp[0, 0], exact, rtol=0, atol=1e-3)


@pytest.mark.parametrize("breaks", [(), (0.5,)])
def test_results_up_to_an_undefined_derivative_are_kept(breaks):
    """Regression: `solve_dae` raised an exception if the derivative failed at the start of the second part."""

    def df_dp(t, y, yp, p):
        if t > 0.5:
            raise myovib.StepFailure("undefined")
        return [[y[0], 0.0], [0.0, -(y[0] ** 2)]]

    s = solve_dae(decay, (0, 2), [1, 3], [-0.7, -4.2], "radau5", parameters=[0.7, 3.0], df_dp=df_dp, breaks=breaks)
    assert s.status == -1 and 0 < s.t[-1] <= 0.5
    # The bound is one hundred times the default tolerance of 1e-4.
    np.testing.assert_allclose(s.dy_dp, exact_decay(s.t, [0.7, 3.0]), rtol=0, atol=1e-2)


@pytest.mark.parametrize("method", METHODS)
def test_parameters_at_the_edge_of_their_domain(method):
    def limited(t, y, yp, p):
        if p[0] > 0.7:
            raise myovib.StepFailure("above the limit")
        return [yp[0] + p[0] * y[0]]

    s = solve_dae(limited, (0, 2), [1], [-0.7], method, parameters=[0.7], rtol=1e-6, atol=1e-9)
    # One-sided differences have errors of 6e-6, and BDF has errors of up to 1000 tolerances.
    np.testing.assert_allclose(s.dy_dp[0, 0], -s.t * np.exp(-0.7 * s.t), rtol=0, atol=1e-3)


def test_inconsistent_sensitivities_are_rejected():
    with pytest.raises(ValueError, match=r"dy0_dp.*equation 4.*parameters\[0\]"):
        pendulum_at(1.0, 9.81, 1e-6, parameters=[1.0, 9.81])


def test_functions_cannot_change_the_parameters():
    def changing(t, y, yp, p):
        p *= 2
        return decay(t, y, yp, p)

    with pytest.raises(ValueError, match="read-only"):
        solve_dae(changing, (0, 1), [1, 3], [-0.7, -4.2], parameters=[0.7, 3.0])


def test_parameters_precede_other_arguments():
    def scaled(t, y, yp, p, factor):
        return [yp[0] + factor * p[0] * y[0]]

    s = solve_dae(scaled, (0, 1), [1], [-1.4], "radau5", parameters=[0.7], args=(2.0,), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(s.dy_dp[0, 0, -1], -2.0 * np.exp(-1.4), rtol=1e-6)


@pytest.mark.parametrize("rtol", [1e-3, 1e-8])
def test_sensitivities_to_the_initial_angle_are_consistent_where_entries_vanish(rtol):
    """Regression: the derivative 2 z of the constraint vanishes at the start, but its difference quotient does not."""
    start = np.zeros((5, 1))
    # At θ = 0: x = cos θ, z = sin θ, and the tension v² − g z = −g sin θ.
    start[[1, 4], 0] = 1.0, -9.81

    def equations(t, y, yp, p):
        return pendulum(t, y, yp, [1.0, 9.81])

    y0, yp0 = [1, 0, 0, 0, 0], [0, 0, 0, -9.81, 0]
    options = dict(index=[1, 1, 2, 2, 3], rtol=rtol, atol=rtol)
    s = solve_dae(equations, (0, 0.5), y0, yp0, "radau5", parameters=[0.0], dy0_dp=start, **options)
    x, z = s.y[:2, -1]
    dx, dz = s.dy_dp[:2, 0, -1]
    # The sensitivities satisfy the derivative of x² + z² = 1.
    assert s.success and abs(x * dx + z * dz) < 10 * rtol
    assert abs(dz) > 0.1


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("is_given", [False, True])
def test_a_parameter_of_zero_may_have_any_unit(method, unit, is_given):
    """Regression: the increment and the scale of the error test belonged to a parameter of size 1."""

    def equations(t, y, yp, p):
        # The exponential function overflows for some trial sizes of the parameter.
        return [yp[0] + math.exp(p[0] / unit) * y[0], y[1] - y[0] * (1.0 + np.sin(p[0] / unit))]

    def df_dp(t, y, yp, p):
        return [[y[0] / unit], [-y[0] / unit]]

    tolerances = dict(rtol=1e-6, atol=1e-9)
    s = solve_dae(
        equations, (0, 2), [1, 1], [-1, -1], method, parameters=[0.0], df_dp=df_dp if is_given else None, **tolerances
    )
    exact = np.array([-s.t, 1.0 - s.t]) * np.exp(-s.t)
    # The bound is 1000 tolerances for BDF and 100 for Radau IIA, as above.
    np.testing.assert_allclose(unit * s.dy_dp[:, 0], exact, rtol=0, atol=1e-3 if method == "bdf" else 1e-4)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_evaluations_for_sensitivities_are_counted(method):
    """Regression: `nfev` excluded the evaluations for linearizations, for dF/dp and for checks."""
    calls = []
    n = 20

    def chain(t, y, yp, p):
        calls.append(t)
        return yp + p[0] * y**2

    options = dict(rtol=1e-6, atol=1e-8, suppress=np.arange(n) == -1)
    s = solve_dae(chain, (0, 1), np.ones(n), -np.ones(n), method, parameters=[1.0], **options)
    assert s.success and s.nfev == len(calls)
    if method == "bdf":
        # Each attempt requires one linearization by central differences, with 4 (n + 1) evaluations and 2 for dF/dp, and
        # a few evaluations of the equations. Each matrix setup requires one-sided differences.
        attempts = s.nsteps + s.netf + s.ncfn + 1
        structure = 8 * n
        assert s.nfev <= attempts * (4 * (n + 1) + 2 + 8) + s.nlu * (n + 1) + structure + 100


@pytest.mark.parametrize(("angle", "speed"), [(0.3, 1.2), (0.0, 0.0), (0.0, 2.0), (-1.2, 0.0)])
@pytest.mark.parametrize("rtol", [1e-3, 1e-8])
def test_sensitivities_of_velocities_must_satisfy_hidden_constraints(angle, speed, rtol):
    """Regression: the derivatives of velocities of a pendulum were accepted although its length would change."""

    def start(length, gravity):
        x, z = length * np.cos(angle), length * np.sin(angle)
        tension = speed**2 - gravity * z / length**2
        y0 = np.array([x, z, -speed * z, speed * x, tension])
        return y0, np.array([y0[2], y0[3], -tension * x, -tension * z - gravity, 0.0])

    p = np.array([1.0, 9.81])
    y0, yp0 = start(*p)
    steps = 1e-6 * np.eye(2)
    dy0_dp = np.column_stack([(start(*(p + s))[0] - start(*(p - s))[0]) / 2e-6 for s in steps])
    options = dict(index=[1, 1, 2, 2, 3], parameters=p, rtol=rtol, atol=rtol)
    assert solve_dae(pendulum, (0, 0.2), y0, yp0, "radau5", dy0_dp=dy0_dp, **options).success
    for j in range(2):
        wrong = dy0_dp.copy()
        # The velocity changes along the pendulum.
        wrong[2:4, j] += 0.3 * y0[:2]
        with pytest.raises(ValueError, match=rf"dy0_dp.*equation 4.*parameters\[{j}\]"):
            solve_dae(pendulum, (0, 0.2), y0, yp0, "radau5", dy0_dp=wrong, **options)


@pytest.mark.parametrize("method", ["bdf", "radau5"])
@pytest.mark.parametrize(
    ("entries", "found"),
    [
        (lambda y: [[-y[0], 0.0], [0.0, -y[0] ** 2]], "row 0, column 0"),
        (lambda y: [[y[0], 0.0], [0.0, -1.2 * y[0] ** 2]], "row 1, column 1"),
        (lambda y: [[y[0], 1e-3], [0.0, -y[0] ** 2]], None),
        (lambda y: [[y[0], 0.0], [0.0, -y[0] ** 2]], None),
    ],
)
def test_a_wrong_df_dp_is_named(method, entries, found):
    def derivatives(t, y, yp, p):
        return entries(y)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_dae(decay, (0, 1), [1, 3], [-0.7, -4.2], method, parameters=[0.7, 3.0], df_dp=derivatives)
    assert s.success == (found is None) and (found or "") in s.message, s.message


def test_one_of_two_derivatives_at_a_kink_of_a_parameter_is_accepted():
    def residual(t, y, yp, p):
        return yp + max(p[0], 1.0) * y

    for slope in (0.0, 1.0):
        solution = myovib.solve_dae(
            residual, (0, 1), [1.0], [-1.0], "radau5", parameters=[1.0], df_dp=lambda t, y, yp, p, a=slope: a * y[:, None]
        )
        assert solution.success


def test_derivatives_below_the_rounding_of_their_equation_are_accepted():
    """The difference quotient of 1e12 (y' + y) + p y is zero, because the change is lost by rounding."""

    def residual(t, y, yp, p):
        return 1e12 * (yp + y) + p * y

    s = solve_dae(residual, (0, 1), [1.0], [-1.0], "radau5", parameters=[1.0], df_dp=lambda t, y, yp, p: y[:, None])
    # dy/dp = -1e-12 t exp(-t). The bound is at most one hundred tolerances of 1e-3 |dy/dp|.
    assert s.success and abs(s.dy_dp[0, 0, -1] + 1e-12 * math.exp(-1.0)) < 1e-13


def test_a_parameter_at_the_edge_of_its_domain_is_accepted_with_df_dp():
    def residual(t, y, yp, p):
        return yp + y - math.sqrt(p[0]) ** 3  # ValueError for p < 0

    s = solve_dae(residual, (0, 1), [1.0], [-1.0], "radau5", parameters=[0.0], df_dp=lambda t, y, yp, p: [[0.0]])
    assert s.success and np.abs(s.dy_dp).max() == 0.0
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n", [5, 300])
def test_sensitivities_continue_after_a_break_at_which_algebraic_variables_jump(method, n):
    """Regression: for more than 200 variables, Radau methods stopped after the break."""
    neighbors = [sorted({i, (i - 1) % n, (i + 1) % n}) for i in range(n)]
    rows, columns = zip(*((i, j) for i in range(n) for j in (neighbors[i] if i else [0])), strict=True)
    pattern = coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n)).tocsc()

    def residual(t, y, yp, p):
        r = yp - p[0] * (np.roll(y, 1) - 2.0 * y + np.roll(y, -1))
        r[0] = y[0] - p[1] * (t > 0.3)
        return r

    s = solve_dae(
        residual, (0, 0.6), np.zeros(n), np.zeros(n), method, parameters=[1.0, 2.0], sparsity=pattern, breaks=[0.3], rtol=1e-5
    )
    assert s.success
    # The equations are linear in p[1]: y = p[1] dy/dp[1]. The bound is one hundred tolerances.
    np.testing.assert_allclose(2.0 * s.dy_dp[:, 1, -1], s.y[:, -1], rtol=0, atol=1e-3 * 2.0)
    assert abs(s.dy_dp[1, 0, -1]) > 0.1


@pytest.mark.parametrize("p", [1e-9, 1e-7, 1e-5, 1.0])
def test_df_dp_is_accepted_where_quotients_are_lost_by_rounding(p):
    def gauge(t, y, yp, q):
        return [yp[0] + y[0], (y[1] + 101325.0) - (q[0] + 101325.0)]

    s = solve_dae(gauge, (0, 1), [1, p], [-1, 0], "radau5", parameters=[p], df_dp=lambda *_: [[0], [-1]], dy0_dp=[[0], [1]])
    assert s.success, s.message


@pytest.mark.parametrize("y0", [1.0, 0.01, 1e-6])
def test_df_dp_may_use_the_equations(y0):
    def derivative(t, y, yp, p):
        return [-yp / p[0]]

    for yp0 in (-y0, 0.0):
        s = solve_dae(lambda t, y, yp, p: yp + p[0] * y, (0, 1), [y0], [yp0], "bdf", parameters=[1.0], df_dp=derivative)
        assert s.success, s.message


@pytest.mark.parametrize(
    ("length", "gravity", "angle", "rate", "t0", "span"),
    [
        (1.0, 9.81, 3.14159, 1.2, 1e5, 0.1),
        (1e-6, 9.81, 0.0, 1e3, 1e5, 0.1),
        (1e6, 9.81, 1.5707963, 1e-3, 0.0, 3.19),
        (1.0, 1e6, 3.14159, 1e3, 0.0, 0.01),
    ],
)
def test_exact_velocities_of_pendulums_are_accepted(length, gravity, angle, rate, t0, span):
    """Regression: rounding errors were reported as violations of hidden constraints."""
    c, s = math.cos(angle), math.sin(angle)
    x, z = length * c, length * s
    multiplier = rate**2 - gravity * z / length**2
    y0 = [x, z, -rate * z, rate * x, multiplier]
    yp0 = [-rate * z, rate * x, -multiplier * x, -multiplier * z - gravity, 0.0]
    exact = np.array([[c, 0], [s, 0], [-rate * s, 0], [rate * c, 0], [gravity * s / length**2, -s / length]])

    def pendulum(t, y, yp, p):
        forces = [yp[2] + y[4] * y[0], yp[3] + y[4] * y[1] + p[1]]
        return [yp[0] - y[2], yp[1] - y[3], *forces, y[0] ** 2 + y[1] ** 2 - p[0] ** 2]

    options = dict(method="radau5", index=[1, 1, 2, 2, 3], rtol=1e-4, atol=1e-4 * length, max_steps=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solve_dae(pendulum, (t0, t0 + span), y0, yp0, parameters=[length, gravity], dy0_dp=exact, **options)
        with pytest.raises(ValueError, match="equation 4 with respect to time"):
            wrong = exact.copy()
            wrong[2:4, 0] += [c, s]
            solve_dae(pendulum, (t0, t0 + span), y0, yp0, parameters=[length, gravity], dy0_dp=wrong, **options)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("p", [1e-6, 1e-9, 1e-12, 1e-20])
def test_parameters_far_below_their_effect_have_accurate_sensitivities(method, p):
    """Regression: increments proportional to the parameter were lost by rounding, and the sensitivities were 0."""

    def gauge(t, y, yp, q):
        return [yp[0] + (1.0 + q[0]) * y[0], (y[1] + 101325.0) - (q[0] + 101325.0)]

    s = solve_dae(gauge, (0, 1), [1, p], [-1 - p, 0], method, parameters=[p], dy0_dp=[[0], [1]], rtol=1e-6, atol=1e-8)
    # The error test is loose, because y changes by less than its tolerances if the parameter changes by its size.
    np.testing.assert_allclose(s.dy_dp[:, 0, -1], [-math.exp(-1.0), 1.0], rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    ("function", "slope"),
    [(lambda p: max(p, 0.0), 1.0), (lambda p: max(p - 1.0, 0.0), 0.0), (lambda p: min(p, 1.0), 1.0), (abs, 1.0)],
)
def test_limits_of_small_parameters_do_not_affect_their_increments(function, slope):
    def residual(t, y, yp, p):
        return yp + y - function(p[0])

    s = solve_dae(residual, (0, 1), [1.0], [-1.0], "radau5", parameters=[1e-3], rtol=1e-6, atol=1e-8)
    # dy/dp = slope (1 - exp(-t)). The bound is one hundred tolerances.
    assert abs(s.dy_dp[0, 0, -1] - slope * (1.0 - math.exp(-1.0))) < 1e-4


@pytest.mark.parametrize("jacobian", [True, False])
@pytest.mark.parametrize(("method", "rtol"), [("radau5", 1e-3), ("radau5", 1e-6), ("bdf", 1e-4), ("bdf", 1e-6)])
def test_initial_sensitivities_of_algebraic_variables_do_not_depend_on_the_tolerances(method, rtol, jacobian):
    # Regression: errors were 74 rtol, because exp(40 y) is not linear over increments as large as the tolerances.
    def cell(t, y, yp, p):
        return [yp[0] + y[0], y[0] - p[0] * np.exp(40 * (y[1] - 3.7))]

    def matrices(t, y, yp, p):
        return np.array([[1, 0], [1, -40 * p[0] * np.exp(40 * (y[1] - 3.7))]]), np.array([[1, 0], [0, 0]])

    options = dict(jacobian=matrices if jacobian else None, rtol=rtol, parameters=[1.0])
    s = solve_dae(cell, (0, 1), [1, 3.7], [-1, -1 / 40], method, dy0_dp=[[0], [-1 / 40]], **options)
    assert s.success
    # The truncation error of differences of order 4 is (1e-5 x 40 x 3.7)^4 / 30.
    assert abs(-40 * s.dy_dp[1, 0, 0] - 1) < 1e-9


def test_initial_sensitivities_of_equations_nonlinear_in_the_derivatives():
    # Regression: the error was 1e-3 at all tolerances.
    v = -0.6823278038280193  # v + v³ + 1 = 0
    exact = -(v**3) / (1 + 3 * v**2)
    s = solve_dae(
        lambda t, y, yp, p: [yp[0] + p[0] * yp[0] ** 3 + y[0], y[1] - yp[0]],
        (0, 1), [1, v], [v, 0], "radau5", parameters=[1.0], dy0_dp=[[0], [exact]],
    )  # fmt: skip
    assert s.success
    # The error is the fourth power of the increment 1e-3.
    assert abs(s.dy_dp[1, 0, 0] / exact - 1) < 1e-9


@pytest.mark.parametrize(
    ("relation", "slope"),
    [
        (lambda x, y: y - max(x, 0.0), 1.0),
        (lambda x, y: y - abs(x), 1.0),
        (lambda x, y: y + 9 * max(y, 0.0) - x, 0.1),
    ],
)
@pytest.mark.parametrize("method", ["bdf", "radau5"])
def test_initial_sensitivities_at_a_kink_are_those_along_the_motion(method, relation, slope):
    s = solve_dae(
        lambda t, y, yp, p: [yp[0] - p[0], relation(*y)],
        (0, 1), [0, 0], [1, slope], method, parameters=[1.0], dy0_dp=[[1], [slope]],
    )  # fmt: skip
    assert s.success
    np.testing.assert_allclose(s.dy_dp[:, 0, 0], [1, slope], rtol=1e-9)


@pytest.mark.parametrize("n", [1, 150])
@pytest.mark.parametrize("atol", [1e-9, 1e-12, 1e-15, 1e-17])
def test_initial_sensitivities_of_variables_at_zero_are_accurate_for_small_tolerances(n, atol):
    # In the sum with 1, the effect of increments as small as the tolerance is lost by rounding.
    def sums(t, y, yp, p):
        u, w = y[:n], y[n:]
        return np.r_[yp[:n] + u - w, u + w - p[0]]

    block = np.eye(n)
    s = solve_dae(
        sums, (0, 1e-3), np.r_[np.ones(n), np.zeros(n)], np.r_[-np.ones(n), np.ones(n)], "radau5",
        parameters=[1.0], rtol=1e-6, atol=atol, sparsity=np.block([[block, block], [block, block]]), max_steps=3,
    )  # fmt: skip
    # Rounding errors are below 1e-8 of the effect of the increments.
    np.testing.assert_allclose(s.dy_dp[:, 0, 0], np.r_[np.zeros(n), np.ones(n)], atol=1e-7)


def test_sensitivities_that_shorten_the_steps_of_bdf_are_named():
    def robertson(t, y, yp, p):
        a, b, c = y
        return [yp[0] + p[0] * a - p[2] * b * c, yp[1] - p[0] * a + p[2] * b * c + p[1] * b**2, a + b + c - 1]

    def df_dp(t, y, yp, p):
        a, b, c = y
        return np.array([[a, 0, -b * c], [-a, b**2, b * c], [0, 0, 0]])

    # For p₁ = 0, ∂a/∂p₁ and ∂b/∂p₁ grow to 2e8 and cancel up to ∂c/∂p₁ = ∫b² dt with b = 1 − exp(−p₀ t).
    stopped = solve_dae(
        robertson, (0, 1e3), [1, 0, 0], [-0.04, 0.04, 0], "bdf",
        parameters=[0.04, 0.0, 1e4], df_dp=df_dp, rtol=1e-6, atol=1e-9, max_steps=4000,
    )  # fmt: skip
    assert stopped.status == -1 and "errors of the sensitivities" in stopped.message
    # The sensitivities up to the last accepted step have passed the error test. The guide states 1000 tolerances for BDF.
    t = stopped.t[-1]
    exact = t - 2 * (1 - np.exp(-0.04 * t)) / 0.04 + (1 - np.exp(-0.08 * t)) / 0.08
    assert abs(stopped.dy_dp[2, 1, -1] - exact) < 1e-3 * exact
