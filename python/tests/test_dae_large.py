"""Structure of systems with more than 200 variables, which `solve_dae` examines by sparse factorizations."""

import numpy as np
import pytest
import scipy.sparse as sp
from myovib import solve_dae
from myovib._structure import LARGEST, Structure
from scipy.sparse.linalg import spsolve

from test_dae_diagnosis import JOINT, PENDULUM, flexible_joint, pendulum, solved

# Smallest number of blocks of five variables for which dense matrices are not computed.
BLOCKS = LARGEST // 5 + 1


def blocks_of(function, n_blocks=BLOCKS):
    """Return F of a system of independent blocks, and its sparsity pattern."""

    def residual(t, y, yp):
        pairs = zip(y.reshape(n_blocks, -1), yp.reshape(n_blocks, -1), strict=True)
        return np.concatenate([function(t, *pair) for pair in pairs])

    return residual, sp.kron(sp.eye(n_blocks), np.ones((5, 5)))


def stokes(n_cells, with_gauge):
    """Return F, sparsity, U, pressure and index of Stokes flow on a staggered grid with the velocity (1 + t) U.

    `with_gauge` states whether one value of the pressure is prescribed.
    """
    h, identity = 1.0 / n_cells, sp.identity(n_cells)
    d = sp.diags([-np.ones(n_cells), np.ones(n_cells)], [0, 1], shape=(n_cells - 1, n_cells)) / h
    gradient = sp.vstack([sp.kron(d, identity), sp.kron(identity, d)]).tocsr()
    n, m = gradient.shape
    x = np.linspace(0.0, 1.0, n_cells + 1)
    psi = np.outer(np.sin(np.pi * x) ** 2, np.sin(np.pi * x) ** 2)
    u = np.r_[(np.diff(psi, axis=1)[1:n_cells] / h).ravel(), (-np.diff(psi, axis=0)[:, 1:n_cells] / h).ravel()]
    p = np.arange(m) / m
    gauge = sp.csr_matrix(([1.0 if with_gauge else 0.0], ([0], [0])), shape=(m, m))
    by_y = sp.bmat([[sp.identity(n), gradient], [gradient.T, gauge]]).tocsr()
    by_yp = sp.diags(np.r_[np.ones(n), np.zeros(m)]).tocsr()

    def residual(t, y, yp):
        return by_y @ y + by_yp @ yp - np.r_[u + (1.0 + t) * u + gradient @ p, gauge @ p]

    return residual, abs(by_y) + by_yp, u, p, [1] * n + [2] * m


@pytest.mark.parametrize("method", ["radau5", "radau9"])
@pytest.mark.parametrize("n_cells", [12, 14])
def test_an_undetermined_pressure_of_a_large_system_is_no_success(method, n_cells):
    """Regression: radau9 ended with status 0, a wrong velocity and a pressure of 1e45 for 12 cells."""
    for with_gauge in (False, True):
        residual, sparsity, u, p, index = stokes(n_cells, with_gauge)
        start = (np.r_[u, p], np.r_[u, np.zeros(len(p))])
        s, texts = solved(residual, (0, 1), *start, method, index=index, sparsity=sparsity, max_steps=2000)
        assert s.success == with_gauge, s.message
        if with_gauge:
            # The bound is a hundred times the default relative tolerance.
            assert np.abs(s.y[: len(u), -1] - 2.0 * u).max() < 100 * 1e-4 * np.abs(u).max()
            assert not texts
        else:
            assert "do not determine" in s.message and "pressure" in s.message


def test_an_index_of_5_of_a_large_system_is_no_success():
    residual, sparsity = blocks_of(flexible_joint)
    start = (np.tile(value, BLOCKS) for value in JOINT)
    s, _ = solved(residual, (0, 2), *start, "radau5", index=[1, 1, 1, 1, 3] * BLOCKS, sparsity=sparsity, max_steps=2000)
    assert not s.success and "index 5" in s.message


@pytest.mark.parametrize(("index", "is_wrong"), [([1, 1, 1, 1, 1], True), ([1, 1, 1, 1, 2], True), ([1, 1, 2, 2, 3], False)])
def test_stated_indices_of_a_large_system_are_compared_with_the_equations(index, is_wrong):
    residual, sparsity = blocks_of(pendulum)
    start = (np.tile(value, BLOCKS) for value in PENDULUM)
    _, texts = solved(residual, (0, 0.05), *start, "radau5", index=index * BLOCKS, sparsity=sparsity, rtol=1e-6)
    assert any("index" in text for text in texts) == is_wrong, texts


def test_sparse_and_dense_structures_agree():
    """Compare structures of the same blocks. The sparse system has one more block than the dense system."""
    for function, start in [(pendulum, PENDULUM), (flexible_joint, JOINT)]:
        found = []
        for n_blocks in (BLOCKS - 1, BLOCKS):
            residual, sparsity = blocks_of(function, n_blocks)
            y, yp = (np.tile(np.array(value, dtype=float), n_blocks) for value in start)
            columns = sparsity.tocsc()
            pattern = (columns.indptr, columns.indices)
            structure = Structure.at(residual, 0.0, y, yp, 1e-6 * (1.0 + np.abs(y)), pattern=pattern)
            found.append(
                (
                    structure.index(), structure.singular, structure.has_free_rates(), structure.variable_indices[:5].tolist(),
                    structure.differential[:5].tolist(), structure.algebraic[:5].tolist(),
                    [j for j in structure.of_higher_index if j < 5], [j for j in structure.undetermined() if j < 5],
                    [j for j in structure.contradictory("algebraic") if j < 5],
                )
            )  # fmt: skip
        assert found[0] == found[1]


def coupled(t, y, yp):
    """Two capacitors in series with y0 + y1 = 1. Each equation contains only the difference of both derivatives."""
    current = yp[0] - yp[1]
    return [current + y[0] - 1.0, -current + y[1]]


@pytest.mark.parametrize("method", ["bdf", "radau5", "radau9"])
@pytest.mark.parametrize("rate", [0.0, 1e-9, 1e-6, 1e-3, 1e6])
def test_violated_combinations_of_equations_are_rejected(method, rate):
    """Regression: radau5 ended with status 0 and a jump to (0.65, 0.35)."""
    with pytest.raises(RuntimeError, match=r"combination of the equations \[0, 1\]"):
        solve_dae(coupled, (0, 1), [0.8, 0.5], [rate, 0], method)
    # (y0 − y1)′ = y1 and y0 + y1 = 1.
    s = solve_dae(coupled, (0, 1), [0.65, 0.35], [0.175, -0.175], method)
    # The bound is a hundred times the default relative tolerance.
    assert s.success and s.y[:, -1] == pytest.approx([1 - 0.35 * np.exp(-0.5), 0.35 * np.exp(-0.5)], rel=1e-2)


def small(t, y, yp):
    return [yp[0] - yp[1] + y[0] - 1.0, -yp[0] + (1 + 1e-9) * yp[1] + y[1]]


def quadratic(t, y, yp):
    return [yp[0] + yp[1] + y[0] - 1.0, yp[0] + yp[1] + (yp[0] - yp[1]) ** 2 + y[1]]


def beyond_a_threshold(t, y, yp):
    difference = yp[0] - yp[1]
    return [max(abs(difference) - 5, 0) * np.sign(difference) + yp[0] + yp[1] - y[0], yp[0] + yp[1] + y[1] - 7]


@pytest.mark.parametrize("function", [small, quadratic, beyond_a_threshold])
def test_combinations_with_derivatives_are_no_contradiction(function):
    """In each function, dF/dy' has the rank 1 at the start, at least nearly, but no y violates the equations."""
    y, yp = np.array([0.8, 0.5]), np.zeros(2)
    structure = Structure.at(function, 0.0, y, yp, 1e-6 * y)
    assert structure.has_free_rates()
    assert structure.contradiction(lambda yp: np.array(function(0.0, y, yp)), 1e-6 * y) is None


def wire(t, y, yp):
    """A source, a wire of 1 mΩ and a load of 10 kΩ."""
    return [
        1e-6 * yp[0] + (y[0] - np.sin(t)) * 1e-3, 1e3 * (y[1] - y[2]) - 1e-6 * np.sin(t), 1e3 * (y[2] - y[1]) + 1e-4 * y[2],
    ]  # fmt: skip


def beam(n):
    """Return the stiffness matrix of a static beam with n unknowns."""
    d = sp.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n))
    return (d @ d * float(n) ** 4).tocsr()


def ladder(n):
    """Return the matrix of a ladder of resistors with conductances of 1e6 along the ladder and of 1e-3 to ground."""
    d = sp.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n))
    return (-1e6 * d + 1e-3 * sp.identity(n)).tocsr()


@pytest.mark.parametrize(
    ("matrix", "scale"), [(beam(100), 1e8), (beam(300), 1e8), (ladder(300), 1e6)], ids=["beam 100", "beam 300", "ladder"]
)
def test_ill_conditioned_equations_are_not_singular(matrix, scale):
    """The equations determine all variables, although some singular values are below 1e-7 of the largest."""

    def residual(t, y, yp):
        return matrix @ y - scale * (1 + np.sin(t))

    start = spsolve(matrix.tocsc(), np.full(matrix.shape[0], scale))
    s, texts = solved(residual, (0, 1), start, start, "radau5", sparsity=matrix, rtol=1e-4, atol=1e-4 * np.abs(start).max())
    assert s.success and not any("do not determine" in text for text in texts), texts
    assert s.y[:, -1] == pytest.approx((1 + np.sin(1.0)) * start, rel=1e-3)


def test_badly_scaled_conductances_are_not_singular():
    s, texts = solved(wire, (0, 1), [0, 0, 0], [0, 0, 0], "radau5", rtol=1e-6, atol=1e-9)
    assert s.success and not any("do not determine" in text for text in texts), texts


def test_a_variable_in_all_equations_is_no_obstacle():
    """Regression: SuperLU raised an exception, because a column had 300 equal entries."""
    n = 300

    def branches(t, y, yp):
        current = yp[0] - yp[1]
        r = y - current
        r[0], r[1] = current + y[0] - 1.0, y[0] + y[1] - 1.0
        return r

    pattern = np.eye(n)
    pattern[:, :2] = 1.0
    start = (np.r_[0.65, 0.35, np.full(n - 2, 0.35)], np.r_[0.175, -0.175, np.zeros(n - 2)])
    s, _ = solved(branches, (0, 1), *start, "radau5", sparsity=pattern)
    # The bound is a hundred times the default relative tolerance.
    assert s.success and s.y[2, -1] == pytest.approx(0.35 * np.exp(-0.5), rel=1e-2)


def test_messages_list_few_variables():
    def pairs(t, y, yp):
        current = yp[::2] - yp[1::2]
        return np.column_stack([current + y[::2] - 1.0, -current + y[1::2]]).ravel()

    sparsity = sp.kron(sp.eye(150), np.ones((2, 2)))
    start = (np.tile([0.65, 0.35], 150), np.tile([0.175, -0.175], 150))
    _, texts = solved(pairs, (0, 1), *start, "radau5", initial="algebraic", sparsity=sparsity)
    assert texts and max(map(len, texts)) < 400, texts
