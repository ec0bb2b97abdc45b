#!/usr/bin/env python3
"""Velocity over path of the shortest motion, for the programs that figures show.

    optimum_curves.py [--write] [NAME..]

In: tests/corpus/*.nc. Out: data/optimum_curves.json, per program and mode the nodes (path from the start of the program, velocity), mm
and mm/s, thinned where straight lines between the rest are as good. Computed as in `optimum.py`; needs CasADi like it.
"""

import argparse
import json
import sys

import numpy as np

import optimum
import programmed_path

STORE = optimum.HERE / "data" / "optimum_curves.json"
SHOWN = ("thesis_a", "random_3axis_10mm")
# What thinning may move a curve by, as a share of its largest velocity.
THINNED = 5e-4


def thin(s, v, tolerance):
    """Indices kept of a polyline: Douglas and Peucker's algorithm, in v only."""
    keep, spans = {0, len(s) - 1}, [(0, len(s) - 1)]
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        line = np.interp(s[a + 1 : b], [s[a], s[b]], [v[a], v[b]])
        far = int(np.argmax(np.abs(v[a + 1 : b] - line)))
        if abs(v[a + 1 + far] - line[far]) > tolerance:
            keep.add(a + 1 + far)
            spans += [(a, a + 1 + far), (a + 1 + far, b)]
    return sorted(keep)


def curve(m, name, mode):
    """[s, v] of a program of the corpus in a mode, `brisk` or `soft`."""
    at, s, v = 0.0, [], []
    runs = programmed_path.runs(m, optimum.CORPUS / f"{name}.nc", mode == "soft")
    for run in runs:
        if mode == "soft":
            _, g, speed = optimum.soft(m, run, 1.0, closed=False)
        else:
            _, g, speed = optimum.brisk(m, run)
        s.append(at + np.concatenate([[0.0], np.cumsum(g.ds)]))
        v.append(speed)
        at = s[-1][-1]
    s, v = np.concatenate(s), np.concatenate(v)
    kept = thin(s, v, THINNED * v.max())
    return [np.round(s[kept], 4).tolist(), np.round(v[kept], 3).tolist()]


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Shortest motions of the programs that figures show.")
    parser.add_argument("names", nargs="*", default=SHOWN)
    parser.add_argument("--write", action="store_true", help="store the results")
    options = parser.parse_args()
    m = programmed_path.machine()
    found = {name: {mode: curve(m, name, mode) for mode in ("brisk", "soft")} for name in options.names}
    for name, modes in found.items():
        print(name, {mode: len(nodes[0]) for mode, nodes in modes.items()})
    if options.write:
        rows = ",\n".join(f'"{name}": {json.dumps(modes)}' for name, modes in sorted(found.items()))
        STORE.write_text("{\n" + rows + "\n}\n", encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main())
