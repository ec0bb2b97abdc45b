#!/usr/bin/env python3
"""Points on rational B-splines and rational polynomials, for `tests/tests/nurbs.rs`.

    python3 tests/oracle/nurbs.py > tests/oracle/data/nurbs.csv

Rows: `sinumerik,TEXT` or `fanuc,TEXT` (lines joined by a backslash and n), then `point,x,y,z` in mm: places on the curve of its last
spline or polynomial, in order. B-splines are evaluated twice, by scipy in homogeneous coordinates and by the
Cox-de Boor recursion in exact fractions; polynomials by Horner's rule in exact fractions. The two ways must agree to
1e-12 or the program ends without a table.
"""

from fractions import Fraction as F

import numpy as np
from scipy.interpolate import BSpline


def basis(degree, knots, i, t):
    """Cox-de Boor in fractions; the last interval is closed on the right."""
    if degree == 0:
        last = knots[i + 1] == knots[-1] and t == knots[-1] and knots[i] < knots[i + 1]
        return F(int(knots[i] <= t < knots[i + 1] or last))
    total = F(0)
    if knots[i + degree] != knots[i]:
        total += (t - knots[i]) / (knots[i + degree] - knots[i]) * basis(degree - 1, knots, i, t)
    if knots[i + degree + 1] != knots[i + 1]:
        rest = (knots[i + degree + 1] - t) / (knots[i + degree + 1] - knots[i + 1])
        total += rest * basis(degree - 1, knots, i + 1, t)
    return total


def nurbs(degree, points, spans, weights, fanuc=False, per_span=5):
    """Dialect, program and points. Coordinates as decimal strings, one span from point `degree` on."""
    text = ["G1 F2400", f"BSPLINE SD={degree}"]
    for k, (p, w) in enumerate(zip(points[1:], weights[1:]), start=1):
        line = f"X{p[0]} Y{p[1]} Z{p[2]} PW={w}"
        if k >= degree:
            line += f" PL={spans[k - degree]}"
        text.append(line)
    text.append("M30")
    knots = [F(0)] * (degree + 1)
    for span in spans:
        knots.append(knots[-1] + F(span))
    knots += [knots[-1]] * degree
    if fanuc:
        text = ["G1 F2400"]
        for k, (p, w) in enumerate(zip(points, weights)):
            head = f"G06.2 P{degree + 1} " if k == 0 else ""
            text.append(f"{head}K{float(knots[k])} X{p[0]} Y{p[1]} Z{p[2]} R{w}")
        text += [f"K{float(k)}" for k in knots[len(points):]] + ["G01", "M30"]
    exact = [[F(x) for x in p] for p in points]
    w = [F(x) for x in weights]
    homogeneous = np.array([[float(x * v) for x in p] + [float(v)] for p, v in zip(exact, w)])
    curve = BSpline(np.array([float(k) for k in knots]), homogeneous, degree)
    out = []
    for k in range(degree, len(points)):
        if knots[k] == knots[k + 1]:
            continue
        for j in range(per_span):
            t = knots[k] + (knots[k + 1] - knots[k]) * F(2 * j + 1, 2 * per_span)
            b = [basis(degree, knots, i, t) * w[i] for i in range(len(points))]
            under = sum(b)
            p = [float(sum(x * q[axis] for x, q in zip(b, exact)) / under) for axis in range(3)]
            h = curve(float(t))
            assert np.allclose(h[:3] / h[3], p, atol=1e-12, rtol=0), (t, p)
            out.append(p)
    return "fanuc" if fanuc else "sinumerik", text, out


def poly(start, ends, higher, under, length, count=12):
    """Dialect, program and points of one POLY block: `higher` a2.. per axis, `under` [value at the end, b2..] or None."""
    letters = "XYZ"
    text = ["G1 F2400 " + " ".join(f"{l}{x}" for l, x in zip(letters, start))]
    line = "POLY"
    for l, e, h in zip(letters, ends, higher):
        line += f" PO[{l}]=({','.join([e] + h)})"
    if under:
        line += f" PO[]=({','.join(under)})"
    text += [line + f" PL={length}", "M30"]
    pl = F(length)
    e, *b = [F(x) for x in (under or ["1"])]
    d = [F(1), (e - 1 - sum(v * pl**k for k, v in enumerate(b, 2))) / pl] + b
    out = []
    for j in range(1, count):
        p = pl * F(j, count)
        below = sum(v * p**k for k, v in enumerate(d))
        row = []
        for axis in range(3):
            a0, xe, h = F(start[axis]), F(ends[axis]), [F(x) for x in higher[axis]]
            a = [a0, (xe * e - a0 - sum(v * pl**k for k, v in enumerate(h, 2))) / pl] + h
            row.append(float(sum(v * p**k for k, v in enumerate(a)) / below))
        out.append(row)
    return "sinumerik", text, out


CASES = [
    nurbs(3, [("0", "0", "0"), ("3", "8", "1"), ("12", "9", "2"), ("15", "-2", "0"), ("22", "1", "-1"), ("27", "9", "0")],
          ["1", "1", "1"], ["1", "0.5", "2.5", "0.75", "3", "1"]),
    nurbs(3, [("0", "0", "0"), ("5", "1", "0"), ("9", "6", "1"), ("8", "12", "2"), ("2", "15", "2"), ("-5", "12", "1"), ("-7", "5", "0")],
          ["0.5", "2", "0.75", "1.25"], ["1", "1.5", "0.3", "2", "0.6", "1.2", "0.8"]),
    nurbs(2, [("0", "0", "0"), ("4", "0", "0"), ("8", "3", "1"), ("9", "8", "2"), ("5", "13", "0")],
          ["1", "0.5", "2"], ["1", "0.7071", "2", "0.5", "1"]),
    # A double knot inside: continuous in its tangent only.
    nurbs(3, [("0", "0", "0"), ("2", "5", "0"), ("7", "7", "0"), ("12", "5", "0"), ("15", "0", "0"), ("20", "-3", "0"), ("26", "0", "0")],
          ["1", "0", "1.5", "1"], ["1", "2", "1", "0.5", "1", "3", "1"], fanuc=True),
    nurbs(2, [("0", "0", "0"), ("4", "1", "0"), ("8", "-3", "1"), ("13", "2", "2"), ("18", "0", "0")],
          ["0.75", "1", "2"], ["2", "1", "4", "0.5", "3"], fanuc=True),
    nurbs(2, [("0", "0", "0"), ("10", "0", "0"), ("10", "10", "0")], ["1"], ["1", "0.7071", "1"]),
    poly(["0", "0", "0"], ["10", "5", "1"], [["0.5", "-0.02"], ["1", "0.1", "-0.03"], []], None, "4"),
    poly(["10", "0", "0"], ["0", "10", "0"], [["-10"], ["0"], []], ["2", "1"], "1"),
    poly(["1", "2", "0"], ["14", "7", "0"], [["1.5"], ["2", "-0.5"], []], ["1.25", "0.125"], "2"),
]

HEAD = """# Written by tests/oracle/nurbs.py, which says what it is.
"""


def main():
    print(HEAD, end="")
    for dialect, text, points in CASES:
        print(dialect + "," + "\\n".join(text + [""]))
        for p in points:
            print("point," + ",".join(f"{x:.9f}" for x in p))


if __name__ == "__main__":
    main()
