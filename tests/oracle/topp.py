"""Shortest time along a path with limits on axis velocity and acceleration (BRISK).

In: a `Grid`. Out: squared path velocity b at its nodes; the time. Reachability analysis after Pham and Pham, "A new approach to
time-optimal path parameterization based on reachability analysis", IEEE T-RO 34 (2018): backward, the interval [0, reach] of b
from which the end can be reached; forward, the largest b in it. Every axis keeps |q' u + q'' b| <= a_max, u the acceleration along
the path. Two schemes of first and second order:

- `profile`: u is free at both ends of an interval and linear between, b' = b + (u + u') ds, limits at both ends;
- `profile_constant_u`: u is constant in an interval, b' = b + 2 u ds, limits at both ends. That is the scheme of the package
  toppra, and only there to be compared with it (`topp_package.py`): it wastes acceleration where an axis turns round.
"""

import numpy as np

EMPTY = 1e-14


def ceiling(m, g):
    """Largest b at each node by velocity, feed and joints; [n + 1]."""
    cap = g.node_v**2
    for derivatives, nodes in ((g.left, slice(None, -1)), (g.right, slice(1, None))):
        first = np.abs(derivatives[0])
        v = np.min(np.where(first > EMPTY, m.v / np.maximum(first, EMPTY), np.inf), axis=1)
        cap[nodes] = np.minimum(cap[nodes], np.minimum(v, g.feed) ** 2)
    return cap


def lines(m, derivatives):
    """Bounds of u per axis as -top - slope b <= u <= top - slope b, both [n, axis]; and the b beyond which no u is left, [n]."""
    first, second, _ = derivatives
    on = np.abs(first) > 1e-9 * np.abs(first).max(axis=1, keepdims=True)
    safe = np.where(on, first, 1.0)
    top = np.where(on, m.a / np.abs(safe), np.inf)
    slope = np.where(on, second / safe, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        still = np.where(~on & (np.abs(second) > EMPTY), m.a / np.abs(second), np.inf).min(axis=1)
        rise = slope[:, :, None] - slope[:, None, :]
        room = top[:, :, None] + top[:, None, :]
        pairs = np.where(rise > EMPTY, room / rise, np.inf).min(axis=(1, 2))
    return top, slope, np.minimum(still, pairs)


def profile(m, g):
    """b at the nodes, u linear within the intervals."""
    n = len(g.ds)
    cap = ceiling(m, g)
    top0, slope0, most = lines(m, g.left)
    cap[:-1] = np.minimum(cap[:-1], most)
    top1, slope1, most = lines(m, g.right)
    cap[1:] = np.minimum(cap[1:], most)
    ds = g.ds[:, None]
    # The four lines in question: b' - ds u' and b + ds u at their largest, over b' and b.
    lift1, hold1 = ds * top1, 1.0 + ds * slope1
    lift0, hold0 = ds * top0, 1.0 - ds * slope0
    reach = np.zeros(n + 1)
    for k in range(n - 1, -1, -1):
        most = reach[k + 1]
        if hold1[k].min() > 0.0:
            gain = (lift1[k] + hold1[k] * most).min()
        else:
            gain = peak(lift1[k], hold1[k], most)
        room = gain + lift0[k]
        positive = hold0[k] > EMPTY
        reach[k] = max(0.0, min(cap[k], (room[positive] / hold0[k][positive]).min(initial=np.inf)))
    b = np.zeros(n + 1)
    for k in range(n):
        push = (lift0[k] + hold0[k] * b[k]).min()
        positive = hold1[k] > EMPTY
        b[k + 1] = max(0.0, min(reach[k + 1], ((push + lift1[k][positive]) / hold1[k][positive]).min(initial=np.inf)))
    return b


def peak(lift, slope, most):
    """Largest value over [0, most] of the least of the lines lift + slope x."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = ((lift[None, :] - lift[:, None]) / (slope[:, None] - slope[None, :])).ravel()
    x = np.concatenate([[0.0, most], cross[(cross > 0.0) & (cross < most)]])
    return (lift[:, None] + slope[:, None] * x).min(axis=0).max()


def profile_constant_u(m, g):
    """b at the nodes, u constant within the intervals."""
    n = len(g.ds)
    cap = ceiling(m, g)
    # Every axis at both ends as |c u + d b| <= a, b at the start of the interval.
    c = np.concatenate([g.left[0], g.right[0] + 2.0 * g.ds[:, None] * g.right[1]], axis=1)
    d = np.concatenate([g.left[1], g.right[1]], axis=1)
    limit = np.concatenate([m.a, m.a])
    reach = np.zeros(n + 1)
    bounds = []
    for k in range(n - 1, -1, -1):
        ck = np.concatenate([c[k], [2.0 * g.ds[k]]])
        dk = np.concatenate([d[k], [1.0]])
        high = np.concatenate([limit, [reach[k + 1]]])
        low = np.concatenate([-limit, [0.0]])
        turns = np.abs(ck) > EMPTY * np.abs(ck).max()
        flip = ck[turns] < 0.0
        up = np.where(flip, low[turns], high[turns]) / ck[turns]
        down = np.where(flip, high[turns], low[turns]) / ck[turns]
        slope = dk[turns] / ck[turns]
        # down_j - slope_j b <= u <= up_i - slope_i b for all i, j.
        rise = slope[:, None] - slope[None, :]
        room = up[:, None] - down[None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            largest = np.where(rise > 0.0, room / rise, np.inf).min()
            still = np.where(~turns & (np.abs(dk) > EMPTY), high / np.abs(dk), np.inf).min()
        reach[k] = max(0.0, min(cap[k], largest, still))
        bounds.append((up, down, slope))
    bounds.reverse()
    b = np.zeros(n + 1)
    for k in range(n):
        up, down, slope = bounds[k]
        u = max((up - slope * b[k]).min(), (down - slope * b[k]).max())
        b[k + 1] = min(max(0.0, b[k] + 2.0 * u * g.ds[k]), reach[k + 1])
    return b


def times(g, b):
    """Time of each interval."""
    v = np.sqrt(b)
    with np.errstate(divide="ignore"):
        return 2.0 * g.ds / (v[:-1] + v[1:])
