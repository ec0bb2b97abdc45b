"""Shortest time along a path with limits on axis velocity, acceleration and jerk (SOFT), by interior points.

In: a `Grid` and a first guess of the velocity. Out: velocity, acceleration, durations and jerk along the path.

The path jerk goes linearly from i to j within each interval, whose duration h is free, and may step at the nodes. So the
kinematics between the nodes are exact,

    ds = v h + a h^2/2 + (3 i + j) h^3/24,   v' = v + a h + (2 i + j) h^2/6,   a' = a + (i + j) h/2,

and nothing is singular at rest. At both ends of each interval every axis keeps, by the chain rule,

    |q' v| <= v_max,   |q' a + q'' v^2| <= a_max,   |q' j + 3 q'' v a + q''' v^3| <= j_max.

The constraints hold at nodes only, and the jerk steps there only; the caller refines until the time stands still. IPOPT by way of CasADi.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

EMPTY = 1e-12


@dataclass
class Motion:
    """v and a at the nodes, durations h, jerks i and j at both ends of the intervals; mm (or degree), s."""

    v: np.ndarray
    a: np.ndarray
    h: np.ndarray
    i: np.ndarray
    j: np.ndarray

    def total(self):
        """Time of the run, s."""
        return float(self.h.sum())


def node_limit(m, g):
    """Largest velocity at each node by axes, feed and joints; [n + 1]."""
    cap = g.node_v.copy()
    for derivatives, nodes in ((g.left, slice(None, -1)), (g.right, slice(1, None))):
        first = np.abs(derivatives[0])
        v = np.min(np.where(first > EMPTY, m.v / np.maximum(first, EMPTY), np.inf), axis=1)
        cap[nodes] = np.minimum(cap[nodes], np.minimum(v, g.feed))
    return cap


def guess(g, v):
    """A motion through node velocities `v`, roughly consistent."""
    h = 2.0 * g.ds / np.maximum(v[:-1] + v[1:], 1e-9)
    rate = np.diff(v) / h
    a = np.zeros(len(v))
    a[1:-1] = 0.5 * (rate[:-1] + rate[1:])
    return Motion(v, a, h, np.diff(a) / h, np.diff(a) / h)


def carry(old, motion, new):
    """`motion` on the grid `old` as a guess on the grid `new` of the same run: v and a taken over the share of length."""
    at_old = np.concatenate([[0.0], np.cumsum(old.ds)])
    at_new = np.concatenate([[0.0], np.cumsum(new.ds)])
    t_old = np.concatenate([[0.0], np.cumsum(motion.h)])
    k = np.clip(np.searchsorted(at_old, at_new, side="right") - 1, 0, len(old.ds) - 1)
    # Time within the old interval by bisection of its quartic.
    low, high, slope = np.zeros(len(k)), motion.h[k], (motion.j[k] - motion.i[k]) / motion.h[k]
    goal = at_new - at_old[k]
    for _ in range(50):
        t = 0.5 * (low + high)
        s = t * (motion.v[k] + t * (0.5 * motion.a[k] + t * (motion.i[k] / 6.0 + t * slope / 24.0)))
        low, high = np.where(s < goal, t, low), np.where(s < goal, high, t)
    t = 0.5 * (low + high)
    v = np.maximum(motion.v[k] + t * (motion.a[k] + t * (0.5 * motion.i[k] + t * slope / 6.0)), 0.0)
    a = motion.a[k] + t * (motion.i[k] + 0.5 * t * slope)
    v[0] = v[-1] = a[0] = a[-1] = 0.0
    h = np.maximum(np.diff(t_old[k] + t), 1e-9)
    return Motion(v, a, h, np.diff(a) / h, np.diff(a) / h)


def solve(m, g, start, strategy="adaptive", verbose=False):
    """Optimal motion on the grid, from the guess `start`; raises RuntimeError if IPOPT does not converge."""
    n = len(g.ds)
    # Units of length and time in which a typical interval is 1 long and takes 1.
    unit_t = start.total() / n
    unit_s = g.ds.sum() / n
    unit_v, unit_a, unit_j = unit_s / unit_t, unit_s / unit_t**2, unit_s / unit_t**3
    v, a = ca.SX.sym("v", n + 1), ca.SX.sym("a", n + 1)
    h, i, j = ca.SX.sym("h", n), ca.SX.sym("i", n), ca.SX.sym("j", n)
    v0, v1, a0, a1 = v[:-1], v[1:], a[:-1], a[1:]
    ds = g.ds / unit_s
    rows, low, high = [], [], []

    def add(expression, lower, upper):
        rows.append(expression)
        low.append(np.broadcast_to(lower, expression.shape[0]))
        high.append(np.broadcast_to(upper, expression.shape[0]))

    add((v0 * h + a0 * h**2 / 2 + (3 * i + j) * h**3 / 24) / ds - 1.0, 0.0, 0.0)
    add(v0 + a0 * h + (2 * i + j) * h**2 / 6 - v1, 0.0, 0.0)
    add(a0 + (i + j) * h / 2 - a1, 0.0, 0.0)
    for axis in range(len(m.v)):
        for (q1, q2, q3), vn, an, jn in ((g.left, v0, a0, i), (g.right, v1, a1, j)):
            q1, q2, q3 = q1[:, axis], q2[:, axis], q3[:, axis]
            # Only intervals in which the axis moves; a limit is a box of one.
            on = np.flatnonzero((np.abs(q1) > EMPTY) | (np.abs(q2) > EMPTY) | (np.abs(q3) > EMPTY))
            if len(on) == 0:
                continue
            vn, an, jn = vn[on], an[on], jn[on]
            q1, q2, q3 = (ca.DM(q[on]) for q in (q1, q2, q3))
            add(q1 * an * (unit_a / m.a[axis]) + q2 * vn**2 * (unit_v**2 / m.a[axis]), -1.0, 1.0)
            jerk = q1 * jn * (unit_j / m.j[axis]) + 3 * q2 * vn * an * (unit_v * unit_a / m.j[axis]) + q3 * vn**3 * (unit_v**3 / m.j[axis])
            add(jerk, -1.0, 1.0)
    for node, joint in g.joints:
        for axis in np.flatnonzero(joint.turn != 0.0):
            step = joint.turn[axis] * a[int(node)] * unit_a + joint.bend[axis] * v[int(node)] ** 2 * unit_v**2
            add(step / (m.j[axis] * m.dt), -1.0, 1.0)
    cap = node_limit(m, g) / unit_v
    lower_v, lower_a, upper_a = np.zeros(n + 1), np.full(n + 1, -np.inf), np.full(n + 1, np.inf)
    lower_a[[0, -1]] = upper_a[[0, -1]] = 0.0
    lbx = np.concatenate([lower_v, lower_a, np.full(n, 1e-6), np.full(2 * n, -np.inf)])
    ubx = np.concatenate([cap, upper_a, np.full(n, np.inf), np.full(2 * n, np.inf)])
    x = ca.vertcat(v, a, h, i, j)
    x0 = np.concatenate([np.minimum(start.v / unit_v, cap), start.a / unit_a, start.h / unit_t, start.i / unit_j, start.j / unit_j])
    options = {
        "ipopt.print_level": 5 if verbose else 0,
        "print_time": False,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-7,
        "ipopt.max_iter": 400,
        "ipopt.mu_strategy": strategy,
    }
    problem = {"x": x, "f": ca.sum1(h) / n, "g": ca.vertcat(*rows)}
    solver = ca.nlpsol("soft", "ipopt", problem, options)
    found = solver(x0=x0, lbx=lbx, ubx=ubx, lbg=np.concatenate(low), ubg=np.concatenate(high))
    status = solver.stats()["return_status"]
    if status not in ("Solve_Succeeded", "Solved_To_Acceptable_Level"):
        raise RuntimeError(f"IPOPT: {status}")
    out = np.array(found["x"]).ravel()
    parts = np.split(out, [n + 1, 2 * n + 2, 3 * n + 2, 4 * n + 2])
    return Motion(parts[0] * unit_v, parts[1] * unit_a, parts[2] * unit_t, parts[3] * unit_j, parts[4] * unit_j)
