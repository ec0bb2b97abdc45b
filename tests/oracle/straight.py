"""Shortest jerk-limited move along one straight line, rest to rest, in closed form.

In: length and the limits of velocity, acceleration and jerk along the line. Out: the time. Textbook profile of up to seven
phases; every phase that the length leaves no room for is dropped.
"""

import numpy as np


def limits(m, run):
    """(length, v, a, j) of a run that is one straight line, else None."""
    if len(run.pieces) != 1:
        return None
    first, second, third = run.pieces[0].along(np.linspace(0.0, 1.0, 5))
    if np.abs(second).max() > 1e-9 or np.abs(third).max() > 1e-9:
        return None
    share = np.abs(first[0])
    on = share > 1e-12
    least = lambda limit: float((limit[on] / share[on]).min())
    return run.pieces[0].length, min(run.pieces[0].feed, least(m.v)), least(m.a), least(m.j)


def shortest(length, v, a, j):
    """Time of the move, s."""
    # Speeding up to w takes 2 sqrt(w/j), or w/a + a/j once the acceleration limit is reached, at w/2 on average.
    rise = lambda w: 2.0 * np.sqrt(w / j) if w * j <= a * a else w / a + a / j
    if v * rise(v) <= length:
        return 2.0 * rise(v) + (length - v * rise(v)) / v
    if 2.0 * a**3 / j**2 >= length:
        return 4.0 * (0.5 * length / j) ** (1.0 / 3.0)
    # w (w/a + a/j) = length
    w = 0.5 * a * (np.sqrt(a * a / j**2 + 4.0 * length / a) - a / j)
    return 2.0 * rise(w)
