#!/usr/bin/env python3
"""Reference values for the thesis contour with 57 knots, computed with scipy.

    python3 tests/oracle/splines.py > tests/oracle/data/thesis57.csv

One turn of r(theta) = 18 + 4 cos(2 theta) cos(6 theta) mm (shared facts 3) in 14 equal arcs per quadrant: 56 points and
the closing one, rounded to 0.001 mm; z falls evenly from 0 to -6 so that a third axis takes part in the chord length.
The parameter of the interpolating splines is the chord length, that of the B-spline is uniform.

Rows: `method,index,u,x,y,z` in mm. `knot` rows give knot `index` (u = 0). The other rows give the curve at the fraction u of
interval `index`: methods `natural`, `not-a-knot`, `clamped` (C-spline; unit slope +y at both ends), `akima`, `b-spline`
(cubic, clamped; the knots are its control points, interval = knot span).
"""

import numpy as np
from scipy.interpolate import Akima1DInterpolator, BSpline, CubicSpline

FRACTIONS = (0.3, 0.5, 0.8)


def contour(theta):
    """x, y of the contour."""
    r = 18 + 4 * np.cos(2 * theta) * np.cos(6 * theta)
    return r * np.cos(theta), r * np.sin(theta)


def knots(per_quadrant=14, fine=400_000):
    """Equal arcs, each quadrant on its own, rounded to 0.001 mm; shape (n, 3)."""
    out = []
    for quadrant in range(4):
        theta = np.linspace(quadrant * np.pi / 2, (quadrant + 1) * np.pi / 2, fine)
        x, y = contour(theta)
        arc = np.concatenate(([0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
        at = np.interp(np.arange(per_quadrant) * arc[-1] / per_quadrant, arc, theta)
        out.extend(zip(*contour(at)))
    out.append(contour(0.0))
    points = np.array(out)
    z = np.linspace(0, -6, len(points))
    return np.round(np.column_stack((points, z)), 3) + 0.0


def rows(method, curve, breaks):
    """Samples of `curve` inside each interval of `breaks`."""
    for index, (a, b) in enumerate(zip(breaks[:-1], breaks[1:])):
        for u in FRACTIONS:
            yield method, index, u, curve(a + u * (b - a))


def main():
    points = knots()
    chord = np.concatenate(([0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    tangent = ((1, np.array([0.0, 1.0, 0.0])),) * 2
    table = [("knot", k, 0, p) for k, p in enumerate(points)]
    for name, condition in (("natural", "natural"), ("not-a-knot", "not-a-knot"), ("clamped", tangent)):
        table += rows(name, CubicSpline(chord, points, bc_type=condition), chord)
    table += rows("akima", Akima1DInterpolator(chord, points), chord)
    spans = len(points) - 3
    vector = np.concatenate((np.zeros(3), np.arange(spans + 1), np.full(3, spans)))
    table += rows("b-spline", BSpline(vector, points, 3), np.arange(spans + 1))
    print("method,index,u,x,y,z")
    for method, index, u, (x, y, z) in table:
        print(f"{method},{index},{u},{x:.9f},{y:.9f},{z:.9f}")


if __name__ == "__main__":
    main()
