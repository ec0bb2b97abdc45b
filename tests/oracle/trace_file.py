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
