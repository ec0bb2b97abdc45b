#!/usr/bin/env python3
"""Shortest possible time of every program of the corpus on the MCV 1210, independent of the planner.

    optimum.py --write [--only soft] [NAME..]    compute all (or the named) programs and store them in data/optimum.json
    optimum.py [NAME..]            compute and print only
    optimum.py --against-toppra    recompute the BRISK times with the package toppra and print the differences

In: tests/corpus/*.nc and machines/mcv1210.toml. Out, per program: `brisk_s` (velocity and acceleration limited, `topp.py`) and
`soft_s` (jerk limited too, `jerk_limited.py`) on the path exactly as programmed, which `programmed_path.py` builds from the text;
the rules for joints stand there. A run along one line has a closed form (`straight.py`). Grids are refined until the time stands still; `*_change` is the last relative change, and
`soft_s` is what the finest grid gave. `toppra_s` is the BRISK time by the package, on the same grid.

Needs numpy, scipy, casadi (with IPOPT); toppra for the comparison.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import jerk_limited
import programmed_path
import straight
import topp

HERE = Path(__file__).resolve().parent
CORPUS = HERE.parent / "corpus"
STORE = HERE / "data" / "optimum.json"
# A run is refined until doubling the grid changes its time by less than this share of the program, or the grid is this fine.
STILL = 1e-3
SOFT_LARGEST = 6_000
BRISK_NODES = (2_500, 7_500)
BRISK_PER_PIECE = (8, 24)


def mixed(times, g, share):
    """Where nodes are wanted: by time spent, and a share of them by length."""
    return times / times.sum() + share * g.ds / g.ds.sum()


def brisk_grid(m, run, nodes):
    """Grid with about `nodes` intervals, denser where the motion is slow and where it changes."""
    count = len(run.pieces)
    g = programmed_path.grid(run, [np.linspace(0.0, 1.0, max(4, 500 // count) + 1)] * count)
    for _ in range(3):
        b = topp.profile(m, g)
        change = np.abs(np.diff(np.sqrt(b)))
        wanted = mixed(topp.times(g, b), g, 0.3) + change / change.sum()
        g = programmed_path.grid(run, programmed_path.refine(g, wanted, nodes, count, 4))
    return g


def brisk(m, run):
    """Times of one run on two grids, the finer grid, and the velocity at its nodes."""
    found = []
    for nodes, per_piece in zip(BRISK_NODES, BRISK_PER_PIECE):
        g = brisk_grid(m, run, max(nodes, per_piece * len(run.pieces)))
        b = topp.profile(m, g)
        found.append(float(topp.times(g, b).sum()))
    return found, g, np.sqrt(b)


def attempts(m, g, tries):
    """The first of the (strategy, guess) pairs that IPOPT solves, or None."""
    for strategy, start in tries:
        try:
            return jerk_limited.solve(m, g, start, strategy)
        except RuntimeError:
            continue
    return None


def soft(m, run, program_s, factor=0.4, closed=True):
    """Times of one run on finer and finer grids, the finest grid, and the velocity at its nodes; no grid where the form is closed.

    The first guess is `factor` times the velocity without a jerk limit.
    """
    count = len(run.pieces)
    line = straight.limits(m, run)
    if closed and line is not None:
        return [straight.shortest(*line)], None, None
    g = brisk_grid(m, run, max(120, 3 * count))
    fast = np.sqrt(topp.profile(m, g))
    cap = jerk_limited.node_limit(m, g)
    fresh = lambda share: jerk_limited.guess(g, np.minimum(share * fast, cap))
    motion = attempts(m, g, ((s, fresh(f)) for f in (factor, 0.4 * factor, 0.1 * factor) for s in ("adaptive", "monotone")))
    if motion is None:
        raise RuntimeError("no first motion")
    found = [motion.total()]
    while True:
        finer = programmed_path.grid(run, programmed_path.refine(g, mixed(motion.h, g, 0.1), 2 * len(g.ds), count, 3))
        start = jerk_limited.carry(g, motion, finer)
        better = attempts(m, finer, ((s, start) for s in ("adaptive", "monotone")))
        if better is None:
            return found, g, motion.v
        motion, g = better, finer
        found.append(motion.total())
        still = abs(found[-1] - found[-2]) < STILL * program_s
        if still or 2 * len(g.ds) > SOFT_LARGEST:
            return found, g, motion.v


def optimum(m, program, mode, factor=0.4):
    """Record of one program in one mode, `brisk` or `soft`."""
    runs = programmed_path.runs(m, program, mode == "soft")
    if mode == "soft":
        # A lower bound of the time, to judge what a change is worth.
        least = sum(float(topp.times(g, topp.profile(m, g)).sum()) for g in (brisk_grid(m, run, 200) for run in runs))
        found = [soft(m, run, least, factor) for run in runs]
    else:
        found = [brisk(m, run) for run in runs]
    total = sum(times[-1] for times, *_ in found)
    change = sum(abs(times[-1] - times[-2]) for times, *_ in found if len(times) > 1)
    return {
        f"{mode}_s": round(total, 6),
        f"{mode}_change": float(f"{change / total:.1e}"),
        f"{mode}_intervals": sum(1 if g is None else len(g.ds) for _, g, _ in found),
        f"{mode}_runs": len(runs),
    }


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Shortest time of the programs of the corpus.")
    parser.add_argument("names", nargs="*", help="programs without .nc; all if none is given")
    parser.add_argument("--write", action="store_true", help="store the results")
    parser.add_argument("--against-toppra", action="store_true", help="compare BRISK with the package toppra")
    parser.add_argument("--only", choices=("brisk", "soft"), help="leave the other mode as it is")
    parser.add_argument("--guess", type=float, default=0.4, help="first velocity of SOFT, as a share of BRISK")
    options = parser.parse_args()
    m = programmed_path.machine()
    names = options.names or sorted(path.stem for path in CORPUS.glob("*.nc"))
    store = json.loads(STORE.read_text(encoding="ascii")) if STORE.is_file() else {"programs": {}}
    for name in names:
        begun = time.monotonic()
        path = CORPUS / f"{name}.nc"
        if options.against_toppra:
            import topp_package

            runs = programmed_path.runs(m, path, False)
            pairs = [topp_package.compare(m, brisk_grid(m, run, BRISK_NODES[0])) for run in runs]
            own, theirs = (sum(pair[i] for pair in pairs) for i in range(2))
            found = {"toppra_s": round(theirs, 6) if np.isfinite(theirs) else None, "toppra_scheme_s": round(own, 6)}
            print(f"{name:24} own {own:10.6f} toppra {theirs:10.6f} {theirs / own - 1:+.2e}  {time.monotonic() - begun:.1f} s", flush=True)
        else:
            found = {}
            for mode in ("brisk", "soft"):
                if options.only in (None, mode):
                    found.update(optimum(m, path, mode, options.guess))
            print(f"{name:24} {json.dumps(found)}  {time.monotonic() - begun:.1f} s", flush=True)
        if options.write:
            # Another process may have stored what it found meanwhile.
            fresh = json.loads(STORE.read_text(encoding="ascii")) if STORE.is_file() else {"programs": {}}
            fresh["programs"].setdefault(name, {}).update(found)
            store = fresh
            store["machine"] = "machines/mcv1210.toml"
            store["solver"] = {"brisk": "topp.py, reachability analysis", "soft": "jerk_limited.py, CasADi/IPOPT"}
            store["programs"] = dict(sorted(store["programs"].items()))
            STORE.write_text(json.dumps(store, indent=1, sort_keys=True) + "\n", encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main())
