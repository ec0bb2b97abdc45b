#!/usr/bin/env python3
"""Writes the corpus the planner is timed on: tests/corpus/*.nc.

In: nothing but formulas and seeds. Out: one program per kind of path, each below about 20 s on the MCV 1210 and each in SOFT;
whoever runs it in BRISK replaces that word. The programs use only what `nc_program.py` reads.

    corpus.py            write the files
    corpus.py --check    exit 1 if a committed file differs from what would be written
"""

import math
import sys
from pathlib import Path

import numpy as np

import generated
import thesis_knots

OUT = Path(__file__).resolve().parents[1] / "corpus"
LETTERS = "XYZAC"


def number(value, decimals):
    """Shortest decimal of a rounded value; no minus zero."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def words(point, decimals=3):
    """`X1 Y2` of a point; None leaves an axis out."""
    return " ".join(f"{name}{number(v, decimals)}" for name, v in zip(LETTERS, point) if v is not None)


def program(title, *lines):
    """A whole program around `lines`."""
    return "\n".join([f"; {title}", "G54 G90 G64 SOFT", *lines, "M30"]) + "\n"


def spline(kind, points, decimals=3):
    """Lines of one spline through (or about) `points`."""
    return [kind, *(words(p, decimals) for p in points)]


def curve(f, count, start=0.0, end=1.0, decimals=3):
    """`count` points of f over (start, end], the first one left out."""
    return [f(t) for t in np.linspace(start, end, count + 1)[1:]]


def equal_arcs(f, spacing):
    """Points of f over [0, 1], `spacing` apart along the curve; both ends."""
    t = np.linspace(0.0, 1.0, 200_001)
    xy = np.array([f(v) for v in t])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
    count = max(1, round(s[-1] / spacing))
    return [f(v) for v in np.interp(np.linspace(0.0, s[-1], count + 1), s, t)]


def thesis():
    """One turn of the thesis contour at its own feed, without compensation, by each method."""
    knots = thesis_knots.knots()[: thesis_knots.ARCS_PER_TURN + 3]
    lead = ["G1 Z2 F5000", "X37 F5000", "G1 X30 Y-20 F1530"]
    out = {}
    for name, kind, title in (
        ("thesis_a", "ASPLINE", "A-spline"),
        ("thesis_b", "BSPLINE", "B-spline"),
        ("thesis_c", "CSPLINE", "C-spline"),
        ("thesis_linear", "G1", "lines"),
    ):
        ends = ["BTAN ETAN"] if kind in ("ASPLINE", "CSPLINE") else []
        out[name] = program(f"Thesis contour, 57 knots per turn, one turn, {title}.", *lead, *ends, *spline(kind, knots), "G1 X30 Y30 F700")
    return out


def smooth():
    """Curves with slowly changing curvature."""
    turn = 2.0 * math.pi
    ellipse = lambda t: (30 * math.cos(turn * t), 12 * math.sin(turn * t))
    spiral = lambda t: ((3 + 20 * t) * math.cos(4 * turn * t), (3 + 20 * t) * math.sin(4 * turn * t))
    troch = lambda t: (40 * t + 4 * math.cos(16 * turn * t) - 4, 4 * math.sin(16 * turn * t))
    wave = lambda t: (240 * t, 15 * math.sin(6 * turn * t), 5 * math.cos(4 * turn * t) - 5)
    natural = "BNAT ENAT"
    auto = "BAUTO EAUTO"
    rose = lambda t: ((20 + 6 * math.cos(5 * turn * t)) * math.cos(turn * t) - 26, (20 + 6 * math.cos(5 * turn * t)) * math.sin(turn * t))
    return {
        "ellipse": program("Ellipse 60 x 24 mm, two turns, C-spline of 36 points per turn.", "G1 X30 Y0 F9000", auto, *spline("CSPLINE", curve(ellipse, 72, 0, 2))),
        "spiral": program("Spiral outwards, four turns.", "G1 X3 Y0 F6000", auto, *spline("CSPLINE", curve(spiral, 128))),
        "trochoid_spline": program("Trochoidal slot as one C-spline.", "G1 X0 Y0 F12000", natural, *spline("CSPLINE", curve(troch, 256))),
        "wave_fast": program("Long wave in space, feed never reached.", "G1 X0 Y0 Z0 F40000", auto, *spline("CSPLINE", curve(wave, 96))),
        "rose_akima": program("Five-leaved rose, A-spline: curvature jumps at every knot.", "G1 X0 Y0 F6000", auto, *spline("ASPLINE", curve(rose, 80))),
        "bspline_rose": program("The same rose, control points of a B-spline.", "G1 X0 Y0 F6000", *spline("BSPLINE", curve(rose, 60))),
    }


def dense():
    """Points 0.05 mm apart on a smooth curve."""
    f = lambda t: (12 * t, 2 * math.sin(2.0 * math.pi * t) + 0.4 * math.sin(10.0 * math.pi * t))
    points = equal_arcs(f, 0.05)[1:]
    return {
        "cloud_spline": program("Point cloud 0.05 mm apart, rounded to 1 um, C-spline.", "G1 X0 Y0 F6000", "BNAT ENAT", *spline("CSPLINE", points)),
        "cloud_spline_fine": program("Point cloud 0.05 mm apart, rounded to 1 nm, C-spline.", "G1 X0 Y0 F6000", "BNAT ENAT", *spline("CSPLINE", points, 6)),
        "cloud_lines": program("Point cloud 0.05 mm apart, rounded to 1 um, lines.", "G1 X0 Y0 F6000", *spline("G1", points)),
    }


def lines():
    """Corners."""
    corner = lambda k, n, r: (r * math.cos(2 * math.pi * k / n), r * math.sin(2 * math.pi * k / n))
    zigzag = [((k + 1) * 0.5, (k + 1) % 2 * math.sqrt(0.75)) for k in range(60)]
    star = [corner(3 * k, 7, 25) for k in range(1, 8)]
    rng = np.random.default_rng(7)
    tiny = []
    at = np.zeros(3)
    for length in (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2):
        for _ in range(6):
            step = rng.normal(size=3)
            at = np.round(at + length * step / np.linalg.norm(step), 3)
            tiny.append(tuple(at))
    return {
        "zigzag_1mm": program("Teeth of 1 mm.", "G1 X0 Y0 F6000", *spline("G1", zigzag)),
        "polygon_g64": program("Sharp star at full feed, continuous path.", "G1 X25 Y0 F12000", *spline("G1", star)),
        "polygon_g9": program("Hexagon, exact stops by G9 and G60.", "G1 X20 Y0 F9000", *(f"G9 {words(corner(k, 6, 20))}" for k in range(1, 4)), "G60", *(words(corner(k, 6, 20)) for k in range(4, 7)), "G64"),
        "polygon_flat": program("Polygon of 72 sides: corners of five degrees.", "G1 X20 Y0 F6000", *spline("G1", [corner(k, 72, 20) for k in range(1, 73)])),
        "tiny_moves": program("Moves of 1 um to 0.2 mm in all directions.", "G1 X0 Y0 Z0 F3000", *spline("G1", tiny)),
        "rapid_linear": program("Rapid motion over much of the travel.", "G0 X450", "X-450 Y-350 Z250", "X0 Y350 Z-250", "Y-350", "X0 Y0 Z0"),
        "rapid_mixed": program("Rapid motion of linear and rotary axes together.", "G0 X100 A2", "X-100 Y50 C-3", "X0 Y0 Z-40 A0 C0", "X200 A0.2", "X0 C0.1", "A-1 C1"),
        "rotary_only": program("Rotary axes alone: lines and a spline.", "G1 A2 F50", "C-1.5 A1", "BAUTO EAUTO", *spline("CSPLINE", [(None, None, None, 1 + math.sin(0.5 * k), -1.5 + 0.4 * k) for k in range(1, 11)]), "G0 A0 C0"),
    }


def arcs():
    """Arcs and what touches them."""
    slot = ["G1 X0 Y-4 F9000"]
    for k in range(8):
        slot += [f"G1 X{number(2 + 2 * k, 3)} Y-4", f"G3 X{number(2 + 2 * k, 3)} Y4 I0 J4", f"G1 X{number(2 * k, 3)} Y4", f"G3 X{number(2 * k, 3)} Y-4 I0 J-4"]
    rounded = ["G1 X10 Y0 F9000", "X50", "G3 X60 Y10 J10", "G1 Y30", "G3 X50 Y40 I-10", "G1 X10", "G3 X0 Y30 J-10", "G1 Y10", "G3 X10 Y0 I10"]
    return {
        "circle": program("Circle of 20 mm radius, touched tangentially, two turns.", "G1 X20 Y-30 F6000", "Y0", "G3 X20 Y0 I-20 TURN=1", "G1 Y30"),
        "helix": program("Helix of one turn and a quarter, 8 mm deep.", "G1 X15 Y0 F9000", "G3 X0 Y15 Z-8 I-15 J0 TURN=1", "G1 X-20"),
        "trochoid_arcs": program("Trochoidal slot of lines and half circles, tangents common, curvature not.", *slot),
        "rounded_rectangle": program("Rectangle with rounded corners.", *rounded),
    }


def random_splines():
    """C-splines through random walks: three scales, three and five axes."""
    out = {}
    for axes in (3, 5):
        for scale, count, feed in ((0.1, 60, 3000), (1.0, 60, 6000), (10.0, 40, 12000)):
            rng = np.random.default_rng(round(100 * scale) + axes)
            at, heading, points = np.zeros(5), rng.normal(size=3), []
            turned = np.zeros(2)
            for _ in range(count):
                heading = heading / np.linalg.norm(heading) + 0.6 * rng.normal(size=3)
                turned = 0.8 * turned + 0.6 * rng.normal(size=2)
                at[:3] += scale * rng.uniform(0.6, 1.4) * heading / np.linalg.norm(heading)
                at[3:] += min(0.1, 0.02 * scale) * turned
                points.append(tuple(at[:axes]) if axes == 5 else tuple(at[:3]))
            name = f"random_{axes}axis_{number(scale, 1).replace('.', 'p')}mm"
            title = f"Random C-spline, knots {number(scale, 1)} mm apart, {axes} axes."
            out[name] = program(title, f"G1 {words([0] * axes)} F{feed}", "BNAT ENAT", *spline("CSPLINE", points, 4))
    return out


def five_axes():
    """A sweep with both rotary axes, and lines that turn into splines and back."""
    sweep = lambda t: (60 * t, 25 * t * t, -4 * math.sin(math.pi * t), 3 * math.sin(math.pi * t) ** 2, -3 * t)
    mix = [
        "G1 X10 Y0 F6000", "BTAN ETAN", "CSPLINE", "X16 Y2", "X20 Y7", "X20 Y14", "X16 Y19", "X10 Y21", "G1 X0 Y21", "CSPLINE", "X-6 Y19",
        "X-10 Y14", "X-10 Y7", "X-6 Y2", "X0 Y0", "G1 X20 Y0", "BNAT ENAT", "ASPLINE", "X26 Y-1", "X32 Y-4", "X38 Y-4", "X44 Y-1", "X50 Y0", "G1 X60 Y0",
    ]
    return {
        "five_axis_sweep": program("Five axes in one C-spline; the rotary axes bind.", "G1 X0 Y0 Z0 A0 C0 F1800", "BAUTO EAUTO", *spline("CSPLINE", curve(sweep, 16), 4)),
        "line_spline_mix": program("Lines and splines in turn, tangent where they meet.", *mix),
    }


def files():
    """File name to text."""
    out = {}
    for group in (thesis, smooth, dense, lines, arcs, random_splines, five_axes):
        out.update(group())
    return {f"{name}.nc": text for name, text in out.items()}


if __name__ == "__main__":
    sys.exit(generated.main(OUT, files(), sys.argv))
