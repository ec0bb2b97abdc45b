#!/usr/bin/env python3
"""Writes the equidistant 57-knot finishing sub-programs of the thesis into examples/thesis/ (seed 000, section 2.3.3.2).

In: nothing but the formula of the contour. Out: three sub-programs; `host-sim study thesis --write` has to write the same.

    thesis_knots.py             write the files
    thesis_knots.py --check     exit 1 if a committed file differs from what would be written

Contour, r(theta) = 18 + 4 cos(2 theta) cos(6 theta) mm (shared facts 3). "15 per quadrant" counts both
ends, which makes 14 equal arcs per quadrant and 56 distinct knots per turn; the thesis prints 57 with the
closing knot. Only the first quadrant is solved, the others are its mirror images, as in the thesis.
"""

import math
import sys
from pathlib import Path

from scipy.integrate import quad
from scipy.optimize import brentq

import generated

OUT = Path(__file__).resolve().parents[2] / "examples" / "thesis"
ARCS_PER_QUADRANT = 14
ARCS_PER_TURN = 4 * ARCS_PER_QUADRANT
DEPTH = -6.0
LEAD_KNOTS = 2  # before the first and behind the last knot: thesis, Table 2.2.3.2
LEAD_START_THETA = math.radians(30.0)  # X13.856 Y-8.000 of the main programs lies at theta = -30 degrees
LEAD_START_Z = 0.5  # and has Z0.500


def radius(theta):
    """Contour radius, mm."""
    return 18.0 + 4.0 * math.cos(2.0 * theta) * math.cos(6.0 * theta)


def radius_slope(theta):
    """dr/dtheta, mm per radian."""
    return -8.0 * math.sin(2.0 * theta) * math.cos(6.0 * theta) - 24.0 * math.cos(2.0 * theta) * math.sin(6.0 * theta)


def arc(theta):
    """Arc length from theta = 0, mm (thesis, equation 33)."""
    return quad(lambda t: math.hypot(radius(t), radius_slope(t)), 0.0, theta, epsabs=1e-12, epsrel=1e-12, limit=400)[0]


def first_quadrant():
    """Knots of the first quadrant including both ends, mm."""
    quarter = arc(math.pi / 2.0)
    knots = []
    for k in range(ARCS_PER_QUADRANT + 1):
        if k in (0, ARCS_PER_QUADRANT):
            theta = k * math.pi / 2.0 / ARCS_PER_QUADRANT
        else:
            goal = quarter * k / ARCS_PER_QUADRANT
            theta = brentq(lambda t, goal=goal: arc(t) - goal, 0.0, math.pi / 2.0, xtol=1e-14)
        knots.append((radius(theta) * math.cos(theta), radius(theta) * math.sin(theta)))
    return knots


def turn():
    """The 56 distinct knots of one turn, counter-clockwise from X22 Y0."""
    q = first_quadrant()
    return (
        q[:-1]
        + [(-x, y) for x, y in reversed(q[1:])]
        + [(-x, -y) for x, y in q[:-1]]
        + [(x, -y) for x, y in reversed(q[1:])]
    )


def knots():
    """All knots of the sub-program: lead-in, three turns, closing knot, lead-out."""
    xy = turn()
    step = arc(math.pi / 2.0) / ARCS_PER_QUADRANT
    rise = LEAD_START_Z / arc(LEAD_START_THETA)  # mm of height per mm of arc on the leads
    out = []
    for k in range(-LEAD_KNOTS, 3 * ARCS_PER_TURN + LEAD_KNOTS + 1):
        if k < 0:
            z = -k * step * rise
        elif k <= ARCS_PER_TURN:
            z = DEPTH * k / ARCS_PER_TURN
        elif k <= 2 * ARCS_PER_TURN:
            z = DEPTH
        elif k <= 3 * ARCS_PER_TURN:
            z = DEPTH - DEPTH * (k - 2 * ARCS_PER_TURN) / ARCS_PER_TURN
        else:
            z = (k - 3 * ARCS_PER_TURN) * step * rise
        out.append((*xy[k % ARCS_PER_TURN], z))
    return out


def number(value):
    """Three decimals, as the thesis prints them; no minus zero."""
    text = f"{value:.3f}"
    return "0.000" if text == "-0.000" else text


def subprogram(before, behind):
    """Text of a sub-program; `before` and `behind` stand around the coordinates, blanks as in Table 2.3.2.2."""
    lines = []
    n = 0
    for x, y, z in knots():
        n += 10
        lines.append(f"N{n} {before} X{number(x)}  Y{number(y)}  Z{number(z)}{behind}")
    lines.append(f"N{n + 10} M17")
    return "\n".join(lines) + "\n"


def files():
    """File name to text."""
    return {
        "EKVI_POSTUPNE_15.SPF": subprogram(" ", "   "),
        "EKVI_POSTUPNE_B_15.SPF": subprogram(" ", "  PW=3  "),
        "EKVI_POSTUPNE_LIN_15.SPF": subprogram("G1", "   "),
    }


if __name__ == "__main__":
    sys.exit(generated.main(OUT, files(), sys.argv))
