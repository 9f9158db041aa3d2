"""A pendulum in Cartesian coordinates: a differential-algebraic equation of index 3.

    python pendulum.py

Unknowns: position (x, y), velocity (u, v) and the force λ of the rod per length. The pendulum starts
at rest at 60 degrees; its period follows from the complete elliptic integral.
"""

import numpy as np
from scipy.special import ellipk

from myovib import solve_dae

LENGTH, GRAVITY = 1.0, 9.81  # m, m/s²


def residual(t, q, qp):
    x, y, u, v, force = q
    return [
        qp[0] - u,
        qp[1] - v,
        qp[2] + force * x,
        qp[3] + force * y + GRAVITY,
        x**2 + y**2 - LENGTH**2,
    ]


def turning_point(t, q, qp):
    return q[2]  # the velocity along x vanishes


angle = np.pi / 3
x, y = LENGTH * np.sin(angle), -LENGTH * np.cos(angle)
force = GRAVITY * np.cos(angle) / LENGTH
solution = solve_dae(
    residual,
    (0.0, 10.0),
    [x, y, 0.0, 0.0, force],
    [0.0, 0.0, -force * x, -force * y - GRAVITY, 0.0],
    method="radau9",
    index=[1, 1, 2, 2, 3],
    rtol=1e-8,
    atol=1e-10,
    events=turning_point,
)
turns = solution.t_events[0]
period = 2 * np.diff(turns).mean()
exact = 4 * np.sqrt(LENGTH / GRAVITY) * ellipk(np.sin(angle / 2) ** 2)
print(f"period {period:.6f} s, exact {exact:.6f} s, {solution.nsteps} steps")
assert abs(period - exact) < 1e-6 * exact
