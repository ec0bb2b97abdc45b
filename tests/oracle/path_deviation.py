#!/usr/bin/env python3
"""Distance between a commanded path and the curve its program asks for, the curve computed here in f64.

    path_deviation.py PROGRAM TRACE.csv SUMMARY.json [--limit-um 1.0]
    path_deviation.py --g6 PROGRAM [--axes XYZAC]

First form: builds lines, arcs of the XY plane, C-splines (chord-length parameter; tangent, natural or not-a-knot ends), A-splines
(Akima; tangent, natural or extrapolated ends), clamped B-splines (scipy) and G6 cubics from the program text, then
matches every trace row to the curve point at the same travelled length and takes the distance to the nearest
point of the curve around it, nearest over all axes. The limit is 1 um plus half a step on the linear axes, and the same number in
thousandths of a degree on the rotary ones.

Second form: exact rational evaluation of the printed G6 coefficients: end points, gaps, range of |dP/di|.

Exit codes: 0 within the limit, 1 not, 2 unreadable.
"""

import argparse
import sys
from fractions import Fraction

import numpy as np
from scipy.interpolate import Akima1DInterpolator, BSpline, CubicHermiteSpline, CubicSpline, PPoly

import nc_program
import trace_file as tr

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(16)
PER_SEGMENT = 64
# Largest angle of the cubic pieces an arc is made of: 0.3 nm off the arc at 20 mm radius (h^4 / 384 of the radius).
ARC_ANGLE = 0.05
# Distance from which on a match is looked for more closely, mm or degree.
DOUBT = 5.0e-4
FINE = np.linspace(0.0, 1.0, 1025)


def chord_lengths(points, linear):
    """Length of each chord over the linear axes; over the rotary ones where no linear axis moves."""
    delta = np.diff(points, axis=0)
    straight = np.sqrt((delta[:, linear] ** 2).sum(axis=1))
    turning = np.sqrt((delta[:, ~linear] ** 2).sum(axis=1))
    return np.where(straight > 0.0, straight, turning)


def end_condition(word, chord, linear):
    """scipy's name for an end condition; `chord` is the neighbouring line or None."""
    if word.endswith("TAN") and chord is not None:
        return (1, chord / chord_lengths(np.array([0 * chord, chord]), linear)[0])
    if word.endswith("AUTO"):
        return "not-a-knot"
    return (2, None)


def akima(t, points, begin, end):
    """A-spline through `points` [n, axis] at `t`: Akima's slopes, the outer two as the end conditions of `end_condition` say.

    At a natural end the second derivative of the first or last piece is zero: 2 m0 + m1 = 3 d0.
    """
    slopes = Akima1DInterpolator(t, points).derivative()(t)
    for condition, outer, inner in ((begin, 0, 1), (end, -1, -2)):
        if condition == "not-a-knot":
            continue
        order, tangent = condition
        chord = (points[outer] - points[inner]) / (t[outer] - t[inner])
        slopes[outer] = tangent if order == 1 else 0.5 * (3.0 * chord - slopes[inner])
    return CubicHermiteSpline(t, points, slopes)


def spline(stretch, before, after, linear):
    """One spline stretch as PPoly over axes; `before`, `after` are the neighbouring chords or None."""
    points = np.array([[float(v) for v in p] for p in [stretch.start, *stretch.points]])
    if stretch.kind == "BSPLINE":
        degree = min(stretch.degree, len(points) - 1)
        given = stretch.intervals[: len(points) - 1]
        inner = len(points) - degree
        if any(i not in (None, 1) for i in given):
            raise ValueError("B-splines with unequal PL are not covered here")
        knots = np.concatenate([np.zeros(degree), np.arange(inner + 1), np.full(degree, inner)])
        columns = [PPoly.from_spline(BSpline(knots.astype(float), column, degree)) for column in points.T]
        return PPoly(np.stack([c.c for c in columns], axis=2), columns[0].x)
    t = np.concatenate([[0.0], np.cumsum(chord_lengths(points, linear))])
    if stretch.kind == "ASPLINE":
        return akima(t, points, *(end_condition(w, c, linear) for w, c in ((stretch.begin, before), (stretch.end, after))))
    zero = np.zeros(points.shape[1])
    ends = [end_condition(stretch.begin, before, linear), end_condition(stretch.end, after, linear)]
    ends = [(2, zero) if isinstance(e, tuple) and e[1] is None else e for e in ends]
    return CubicSpline(t, points, bc_type=tuple(ends))


def g6_exact(stretch, axis, i):
    """P(i) of a G6 block, exact, mm (shared facts 1); i runs from I down to 0."""
    value = stretch.points[0][axis]
    if stretch.k[axis] is not None:
        k3, k2, k1 = stretch.k[axis]
        value += Fraction(k3 * 10**6, 2**53) * i**3 + Fraction(k2 * 1000, 2**41) * i**2 + Fraction(k1, 2**28) * i
    return value


def arc(stretch):
    """Cubic Hermite pieces of one arc, like those of `curve`; the radius goes evenly from that of the start to that of the end."""
    start, end = (np.array([float(v) for v in p]) for p in (stretch.start, stretch.points[0]))
    centre = start[:2] + [float(v) for v in stretch.centre]
    (r0, r1), (first, last) = zip(*((np.hypot(*d), np.arctan2(d[1], d[0])) for d in (start[:2] - centre, end[:2] - centre)))
    sign = -1.0 if stretch.clockwise else 1.0
    sweep = sign * (sign * (last - first) % (2 * np.pi) or 2 * np.pi) + sign * 2 * np.pi * stretch.turns
    count = int(np.ceil(abs(sweep) / ARC_ANGLE))
    w, share = sweep / count, np.linspace(0.0, 1.0, count + 1)
    angle, radius = first + sweep * share, (r0 + (r1 - r0) * share)[:, None]
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-out[:, 1], out[:, 0]], axis=1)
    even = (end - start)[None, 2:] * np.ones((count + 1, 1))
    q = np.concatenate([centre + radius * out, start[2:] + even * share[:, None]], axis=1)
    d = np.concatenate([w * radius * across + (r1 - r0) / count * out, even / count], axis=1)
    q[0], q[-1] = start, end
    step = q[1:] - q[:-1]
    return list(np.stack([d[:-1] + d[1:] - 2 * step, 3 * step - 2 * d[:-1] - d[1:], d[:-1], q[:-1]], axis=2))


def curve(stretches, linear):
    """Cubic pieces of the whole program: coefficients [piece, axis, power 3..0] over u in [0, 1]."""
    pieces = []
    for n, stretch in enumerate(stretches):
        if stretch.kind == "arc":
            pieces += arc(stretch)
        elif stretch.kind == "line":
            start, end = (np.array([float(v) for v in p]) for p in (stretch.start, stretch.points[0]))
            pieces.append(np.stack([0 * start, 0 * start, end - start, start], axis=1))
        elif stretch.kind == "G6":
            length = stretch.length
            piece = np.zeros((len(linear), 4))
            for a in range(len(linear)):
                # As printed, so that a piece may start up to 0.5 um off the end of the one before.
                q = [float(g6_exact(stretch, a, length * (1 - Fraction(j, 3)))) for j in range(4)]
                piece[a] = np.polyfit([0, 1 / 3, 2 / 3, 1], q, 3)
                if stretch.k[a] is None:
                    piece[a] = [0, 0, 0, q[0]]
            pieces.append(piece)
        elif stretch.points:
            chord = [None, None]
            for side, m in ((0, n - 1), (1, n + 1)):
                if 0 <= m < len(stretches) and stretches[m].kind == "line":
                    a, b = stretches[m].start, stretches[m].points[0]
                    chord[side] = np.array([float(q - p) for p, q in zip(a, b)])
            poly = spline(stretch, *chord, linear)
            c, x = np.asarray(poly.c), np.asarray(poly.x)
            if c.shape[0] < 4:
                c = np.concatenate([np.zeros((4 - c.shape[0], *c.shape[1:])), c])
            for s in range(c.shape[1]):
                h = x[s + 1] - x[s]
                if h > 0:
                    pieces.append((c[:, s, :] * h ** np.array([3, 2, 1, 0])[:, None]).T)
    return np.array(pieces)


def at(pieces, u):
    """Points of pieces [n, axis, 4] at u [n]."""
    return ((pieces[:, :, 0] * u[:, None] + pieces[:, :, 1]) * u[:, None] + pieces[:, :, 2]) * u[:, None] + pieces[:, :, 3]


def slope(pieces, u):
    """dP/du of pieces at u."""
    return (3 * pieces[:, :, 0] * u[:, None] + 2 * pieces[:, :, 1]) * u[:, None] + pieces[:, :, 2]


def metric(vectors, linear):
    """Length over the linear axes, over the rotary axes where no linear axis moves."""
    straight = np.sqrt((vectors[:, linear] ** 2).sum(axis=1))
    turning = np.sqrt((vectors[:, ~linear] ** 2).sum(axis=1))
    return np.where(straight > 1e-9, straight, turning)


def length_table(pieces, linear):
    """Piece index, u and travelled length at PER_SEGMENT steps of every piece."""
    edges = np.linspace(0.0, 1.0, PER_SEGMENT + 1)
    half = 0.5 / PER_SEGMENT
    lengths = np.zeros((len(pieces), PER_SEGMENT))
    for x, w in zip(GAUSS_X, GAUSS_W):
        for k in range(PER_SEGMENT):
            u = np.full(len(pieces), edges[k] + half * (1 + x))
            lengths[:, k] += w * half * metric(slope(pieces, u), linear)
    return edges, np.concatenate([[0.0], np.cumsum(lengths.ravel())])


def nearest(points, pieces, u, linear, passes=12):
    """Distance of each point to the piece beside it, by damped Gauss-Newton from u: mm, and largest rotary difference.

    Nearest is the point of the curve over all axes, a degree counted as a millimetre. Over the linear axes alone it would be any
    point where the tool all but stands still while the rotary axes turn.
    """
    d, share = at(pieces, u) - points, np.ones(len(u))
    for _ in range(passes):
        v = slope(pieces, u)
        to = np.clip(u - share * (d * v).sum(axis=1) / np.maximum((v * v).sum(axis=1), 1e-18), 0.0, 1.0)
        there = at(pieces, to) - points
        closer = (there**2).sum(axis=1) < (d**2).sum(axis=1)
        u, d = np.where(closer, to, u), np.where(closer[:, None], there, d)
        share = np.where(closer, np.minimum(2.0 * share, 1.0), 0.25 * share)
    return np.sqrt((d[:, linear] ** 2).sum(axis=1)), np.abs(d[:, ~linear]).max(axis=1, initial=0.0)


def match(points, travelled, pieces, lengths, linear, enough=0.0):
    """Distance in mm and rotary distance in degrees of points at these travelled lengths; `lengths` as `length_table` has them.

    Where both are within `enough`, the pieces around are not looked at.
    """
    edges, table = lengths
    goal = np.clip(travelled, 0.0, table[-1])
    cell = np.clip(np.searchsorted(table, goal, side="right") - 1, 0, len(table) - 2)
    home, inside = cell // PER_SEGMENT, edges[cell % PER_SEGMENT]
    best = np.full(len(points), np.inf)
    turned = np.full(len(points), np.inf)
    def take(rows, piece, u, passes):
        far, turn = nearest(points[rows], pieces[piece], u, linear, passes)
        better = np.maximum(far, turn) < np.maximum(best[rows], turned[rows])
        best[rows[better]], turned[rows[better]] = far[better], turn[better]

    around = lambda rows, shift: np.clip(home[rows] + shift, 0, len(pieces) - 1)
    for shift, passes in ((0, 2), (0, 12), (-1, 12), (1, 12), (-2, 12), (2, 12)):
        rows = np.flatnonzero(np.maximum(best, turned) > enough)
        u = inside[rows] if shift == 0 else np.full(len(rows), 1.0 if shift < 0 else 0.0)
        take(rows, around(rows, shift), u, passes)
    # Where a piece bends sharply near its end the search from there may have gone the wrong way: from the nearest of many.
    for shift in (0, -1, 1, -2, 2):
        rows = np.flatnonzero(np.maximum(best, turned) > max(enough, DOUBT))
        piece = around(rows, shift)
        grid = [((at(pieces[piece], np.full(len(rows), u)) - points[rows]) ** 2).sum(axis=1) for u in FINE]
        take(rows, piece, FINE[np.argmin(grid, axis=0)], 12)
    return best, turned


def deviations(points, pieces, linear):
    """Per trace row: distance in mm and rotary distance in degrees; and travelled length of trace and curve."""
    lengths = length_table(pieces, linear)
    total = lengths[1][-1]
    steps = np.diff(points, axis=0, prepend=np.zeros((1, points.shape[1])))
    travelled = np.cumsum(metric(steps, linear))
    # A polyline of ticks is shorter than the curve by parts in 1e6; scale it away before matching.
    scale = total / travelled[-1] if travelled[-1] > 0 else 1.0
    return *match(points, travelled * scale, pieces, lengths, linear), travelled[-1], total


def report_g6(program, axes):
    """Exact look at the G6 blocks of a program; returns the exit code."""
    print(f"{'block':30} {'axis':4} {'gap um':>9} {'end':>5}  |dP/di|")
    worst = Fraction(0)
    for stretch in nc_program.read(program, axes):
        if stretch.kind != "G6":
            continue
        speed = []
        for j in range(101):
            i = stretch.length * Fraction(j, 100)
            d = [
                Fraction(3 * k[0] * 10**6, 2**53) * i**2 + Fraction(2 * k[1] * 1000, 2**41) * i + Fraction(k[2], 2**28)
                for k in stretch.k
                if k is not None
            ]
            speed.append(float(sum(v * v for v in d)) ** 0.5)
        for a in range(len(axes)):
            if stretch.k[a] is None:
                continue
            gap = g6_exact(stretch, a, stretch.length) - stretch.start[a]
            end = g6_exact(stretch, a, Fraction(0)) == stretch.points[0][a]
            worst = max(worst, abs(gap))
            print(f"{stretch.line:30} {axes[a]:4} {float(gap) * 1000:9.3f} {'exact' if end else 'OFF'}  {min(speed):.3f}..{max(speed):.3f}")
    print(f"largest gap {float(worst) * 1000:.3f} um")
    return 0 if worst <= Fraction(8, 10_000) else 1


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Distance of a trace from the curve of its program.")
    parser.add_argument("program")
    parser.add_argument("trace", nargs="?")
    parser.add_argument("summary", nargs="?")
    parser.add_argument("--g6", action="store_true", help="only evaluate the printed G6 coefficients")
    parser.add_argument("--axes", default="XYZAC")
    parser.add_argument("--limit-um", type=float, default=1.0)
    options = parser.parse_args()
    try:
        if options.g6:
            return report_g6(options.program, options.axes)
        recorded, summary = tr.read_trace(options.trace), tr.read_summary(options.summary)
        stretches = nc_program.read(options.program, "".join(recorded.axes))
    except (OSError, ValueError, TypeError, tr.BadTrace) as error:
        print(error, file=sys.stderr)
        return 2
    linear = np.array([axis["unit"] == "mm" for axis in summary["axes"]])
    points = tr.units(recorded, summary)
    pieces = curve(stretches, linear)
    far, turned, run, total = deviations(points, pieces, linear)
    half_step = 0.5 / min(axis["steps_per_unit"] for axis in summary["axes"])
    limit = options.limit_um / 1000.0 + half_step
    row = int(np.argmax(far))
    final = np.array([float(v) for v in stretches[-1].points[-1]]) - points[-1]
    problems = []
    if far.max() > limit:
        problems.append(f"{far.max() * 1000:.3f} um off at tick {recorded.tick[row]}, block {recorded.block[row]}")
    if turned.max() > limit:
        problems.append(f"rotary axes off by {turned.max() * 1000:.3f} thousandths of a degree")
    if np.abs(final).max() > 1e-9:
        problems.append(f"end point missed by {np.abs(final).max():.3g}")
    if abs(run - total) > 1e-4 * total + 0.001:
        problems.append(f"travelled {run:.6f}, the curve is {total:.6f} long")
    print(f"pieces {len(pieces)}, length {total:.6f}, travelled {run:.6f}")
    print(f"largest deviation {far.max() * 1000:.4f} um (mean {far.mean() * 1000:.4f}), rotary {turned.max() * 1000:.4f} mdeg, limit {limit * 1000:.3f}")
    for problem in problems:
        print(f"FAIL {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
