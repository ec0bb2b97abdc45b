"""Reads what `host-sim run` writes: the trace CSV and the JSON summary.

In: file names. Out: `Trace` with exact integer positions, and the summary as a dictionary. Positions are
printed in steps with ten decimals; they are kept as integers of 1e-10 step, so that differences are exact.
"""

import json
from dataclasses import dataclass

import numpy as np

DECIMALS = 10
SCALE = 10**DECIMALS
FIXED_COLUMNS = ["tick", "t_s", "block", "feed_mm_s"]


class BadTrace(Exception):
    """The file is not a trace; the text says where and why."""


@dataclass
class Trace:
    """One row per servo tick."""

    axes: list  # names, in file order
    tick: np.ndarray  # int64
    t_s: np.ndarray  # float64, s
    block: np.ndarray  # int64
    feed: np.ndarray  # float64, mm/s
    position: np.ndarray  # int64, rows x axes, 1e-10 step


def fixed_point(text):
    """A number with exactly ten decimals as an integer of 1e-10."""
    whole, _, decimals = text.partition(".")
    if len(decimals) != DECIMALS:
        raise ValueError(f"{text!r} has not {DECIMALS} decimals")
    return int(whole + decimals)


def read_trace(path):
    """Reads a trace CSV; raises BadTrace."""
    with open(path, "rb") as file:
        names = header(file)
        trace = columns(file.read(), names) if names else None
    return read_lines(path) if trace is None else trace


def header(file):
    """Axes named by the first line of an open trace, or None if it is not that of a trace."""
    names = file.readline().decode("ascii", "replace").strip().split(",")
    return names[4:] if names[:4] == FIXED_COLUMNS and len(names) > 4 else None


def columns(rows, axes):
    """Rows of a trace (bytes) all at once; None unless every column keeps its number of decimals.

    Without their points the numbers are integers. That each point stands in its place is checked first.
    """
    if not rows.endswith(b"\n"):
        return None
    text = np.frombuffer(rows, dtype=np.uint8)
    ends = np.flatnonzero((text == ord(",")) | (text == ord("\n")))
    points = np.flatnonzero(text == ord("."))
    width, pointed = len(axes) + 4, len(axes) + 2
    if len(ends) % width or len(points) * width != len(ends) * pointed:
        return None
    ends, points = ends.reshape(-1, width), points.reshape(-1, pointed)
    last = text[ends] == ord("\n")
    decimals = ends[:, [1, *range(3, width)]] - points - 1
    regular = last[:, -1].all() and not last[:, :-1].any() and (decimals == decimals[0]).all() and (decimals[0, 2:] == DECIMALS).all()
    digits = int(((text >= ord("0")) & (text <= ord("9"))).sum())
    # A sign stands at the beginning of a number only.
    signs = np.flatnonzero(text == ord("-"))
    before = text[signs - 1]
    begins = (signs == 0) | (before == ord(",")) | (before == ord("\n"))
    if not regular or not begins.all() or digits + ends.size + points.size + signs.size != text.size:
        return None
    numbers = np.fromstring(rows.replace(b".", b"").replace(b"\n", b",")[:-1], dtype=np.int64, sep=",")
    if numbers.size != ends.size:
        return None
    numbers = numbers.reshape(-1, width)
    t_s, feed = (numbers[:, c] / 10.0 ** decimals[0, d] for c, d in ((1, 0), (3, 1)))
    return Trace(axes, numbers[:, 0].copy(), t_s, numbers[:, 2].copy(), feed, numbers[:, 4:].copy())


def stream(file, size=4_000_000):
    """Parts of a trace that is still being written, about `size` bytes each; raises BadTrace."""
    axes = header(file)
    if axes is None:
        return
    rest = b""
    while True:
        more = file.read(size)
        rows, cut, rest = (rest + more).rpartition(b"\n")
        if cut:
            part = columns(rows + cut, axes)
            if part is None:
                raise BadTrace("columns do not keep their decimals")
            yield part
        if not more:
            break
    if rest:
        raise BadTrace("the last row is not complete")


def read_lines(path):
    """Reads a trace CSV line by line; raises BadTrace with the line that is wrong."""
    ticks, times, blocks, feeds, positions = [], [], [], [], []
    with open(path, encoding="utf-8") as lines:
        header = lines.readline().strip().split(",")
        if header[:4] != FIXED_COLUMNS or len(header) < 5:
            raise BadTrace(f"{path}: header is {header}")
        for number, line in enumerate(lines, 2):
            cells = line.rstrip("\r\n").split(",")
            if len(cells) != len(header):
                raise BadTrace(f"{path}:{number}: {len(cells)} columns, header has {len(header)}")
            try:
                ticks.append(int(cells[0]))
                times.append(float(cells[1]))
                blocks.append(int(cells[2]))
                feeds.append(float(cells[3]))
                positions.append([fixed_point(c) for c in cells[4:]])
            except ValueError as error:
                raise BadTrace(f"{path}:{number}: {error}") from error
    if not ticks:
        raise BadTrace(f"{path}: no rows")
    return Trace(
        header[4:],
        np.array(ticks, dtype=np.int64),
        np.array(times),
        np.array(blocks, dtype=np.int64),
        np.array(feeds),
        np.array(positions, dtype=np.int64),
    )


def read_summary(path):
    """Reads the JSON summary."""
    with open(path, encoding="utf-8") as text:
        return json.load(text)


def units(trace, summary):
    """Positions in mm or degrees, float64, rows x axes. Exact to 1e-13 mm at 1 um per step."""
    per_unit = np.array([axis["steps_per_unit"] for axis in summary["axes"]], dtype=float)
    return trace.position / (SCALE * per_unit)
