"""Shortest time along a path with limits on axis velocity and acceleration (BRISK).

In: a `Grid`. Out: squared path velocity b at its nodes, and the time. Reachability analysis on the interval scheme of
Pham and Pham, "A new approach to time-optimal path parameterization based on reachability analysis", IEEE T-RO 34 (2018):
within an interval the path acceleration u is constant, b' = b + 2 u ds, and every axis keeps |q' u + q'' b| <= a_max at both
ends of the interval. Backward, the interval of b from which the end can be reached; forward, the largest b in it.
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


def profile(m, g):
    """b at the nodes, and u in the intervals."""
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
    b, u = np.zeros(n + 1), np.zeros(n)
    for k in range(n):
        up, down, slope = bounds[k]
        u[k] = max((up - slope * b[k]).min(), (down - slope * b[k]).max())
        b[k + 1] = min(max(0.0, b[k] + 2.0 * u[k] * g.ds[k]), reach[k + 1])
    return b, u


def times(g, b):
    """Time of each interval."""
    v = np.sqrt(b)
    with np.errstate(divide="ignore"):
        return 2.0 * g.ds / (v[:-1] + v[1:])
