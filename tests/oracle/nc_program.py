"""A tiny reader for the programs under examples/, written from the language description alone.

In: a program file (sub-programs are looked for beside it). Out: a list of `Stretch`: straight lines, arcs of
the XY plane, whole splines, and G6 cubics, with all coordinates absolute, in mm and degrees. It knows only what
the examples and the corpus use and raises on anything else.
"""

import re
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

TOKEN = re.compile(
    r"(?P<word>ASPLINE|BSPLINE|CSPLINE|BAUTO|BNAT|BTAN|EAUTO|ENAT|ETAN|BRISK|SOFT)"
    r"|(?P<name>SD|PL|PW|TURN|[A-Z])=?(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:E(?![A-Z])[+-]?\d+)?|\"[^\"]*\")"
)
SPLINES = {"ASPLINE", "BSPLINE", "CSPLINE"}
INCH = Fraction(254, 10)
IGNORED = set("NSTM")


@dataclass
class Stretch:
    """A piece of path of one kind; `points` are the programmed points without the start point."""

    kind: str  # "line", "arc", "ASPLINE", "BSPLINE", "CSPLINE", "G6"
    start: list  # Fractions, one per axis
    points: list = field(default_factory=list)
    begin: str = "BNAT"
    end: str = "ENAT"
    degree: int = 3
    intervals: list = field(default_factory=list)  # PL per point, None where not given
    length: Fraction = Fraction(0)  # G6: I
    k: list = field(default_factory=list)  # G6: [K3, K2, K1] per axis
    line: str = ""
    feed: Fraction | None = None  # as programmed, per minute, mm (degrees where no linear axis moves); None: rapid
    exact: bool = False  # comes to rest at its end
    centre: list = field(default_factory=list)  # arc: I and J, relative to the start
    clockwise: bool = False
    turns: int = 0  # arc: TURN


def strip(line):
    """Removes comments; upper case."""
    line = re.sub(r"\([^)]*\)", " ", line.split(";", 1)[0])
    return line.strip().upper()


def inlined(path):
    """Program lines with sub-program calls replaced by their text (M17 dropped)."""
    path = Path(path)
    for raw in path.read_text(encoding="ascii").splitlines():
        text = strip(raw)
        call = re.fullmatch(r"(?:N\d+\s+)?([A-Z]{2}[A-Z0-9_]*)", text)
        if call and (path.parent / f"{call[1]}.SPF").is_file():
            yield from inlined(path.parent / f"{call[1]}.SPF")
        elif not re.fullmatch(r"(N\d+\s*)?M17", text):
            yield text


def tokens(text):
    """(name, value text) pairs; a keyword has an empty value. Raises on what it does not know."""
    text = re.sub(r"\s+", "", text) if '"' not in text else text.replace(" ", "")
    at, out = 0, []
    while at < len(text):
        match = TOKEN.match(text, at)
        if not match:
            raise ValueError(f"cannot read {text[at:]!r} in {text!r}")
        out.append((match["word"] or match["name"], match["value"] or ""))
        at = match.end()
    return out


def read(path, axes):
    """Stretches of the program at `path` for a machine with the axis letters `axes`; starts at zero."""
    here = [Fraction(0)] * len(axes)
    mode, absolute, inch = "G1", True, False
    begin, end, degree = "BNAT", "ENAT", 3
    speed, stops = Fraction(0), False
    out, pending = [], None
    for text in inlined(path):
        if not text or text.startswith("%"):
            continue
        words = tokens(text)
        names = [name for name, _ in words]
        if names and set(names) == {"K"}:
            pending.k[next(pending_axes)] = [int(value) for _, value in words]
            continue
        given, interval, dwell, parameter = {}, None, False, None
        across, turns, once, feed = Fraction(0), 0, False, None
        for name, value in words:
            if name in SPLINES:
                mode = name
            elif name[:1] == "B" and name in ("BAUTO", "BNAT", "BTAN"):
                begin = name
            elif name in ("EAUTO", "ENAT", "ETAN"):
                end = name
            elif name == "SD":
                degree = int(value)
            elif name == "PL":
                interval = Fraction(value)
            elif name == "G":
                number = int(value)
                if number in (0, 1, 2, 3, 6):
                    mode = f"G{number}"
                elif number in (90, 91):
                    absolute = number == 90
                elif number in (70, 71):
                    inch = number == 70
                elif number == 4:
                    dwell = True
                elif number == 9:
                    once = True
                elif number in (60, 64):
                    stops = number == 60
            elif name in axes:
                given[axes.index(name)] = Fraction(value)
            elif name == "I":
                parameter = Fraction(value)
            elif name == "J":
                across = Fraction(value)
            elif name == "TURN":
                turns = int(value)
            elif name == "F":
                feed = Fraction(value)
            elif name not in IGNORED and name not in ("PW", "SOFT", "BRISK"):
                raise ValueError(f"{name} in {text!r} is not known here")
        if feed is not None and not dwell:
            speed = feed * (INCH if inch else 1)
        if dwell or not given:
            continue
        target = list(here)
        for a, value in given.items():
            value = value * INCH if inch and axes[a] in "XYZ" else value
            target[a] = value if absolute else here[a] + value
        if mode == "G6":
            pending = Stretch("G6", here, [target], length=parameter, k=[None] * len(axes), line=text)
            pending_axes = iter([axes.index(name) for name, _ in words if name in axes])
            out.append(pending)
        elif mode in SPLINES:
            if not out or out[-1].kind != mode:
                out.append(Stretch(mode, here, begin=begin, degree=degree, line=text))
            if target != here:
                out[-1].points.append(target)
                out[-1].intervals.append(interval)
            out[-1].end = end
        elif mode in ("G2", "G3"):
            arc = Stretch("arc", here, [target], line=text, clockwise=mode == "G2", turns=turns)
            arc.centre = [parameter or Fraction(0), across]
            out.append(arc)
        elif target != here:
            out.append(Stretch("line", here, [target], line=text))
        if out:
            out[-1].feed = None if mode == "G0" else speed
            out[-1].exact = stops or once
        here = target
    return out
