#!/usr/bin/env python3
"""Runs random programs, with events at random instants, and holds every trace against the limits.

    campaign.py [--sim PATH] [--programs N] [--holds M] [--mixed M] [--seed S] [--jobs J] [--keep FOLDER]

In: a built `host-sim`. Program k of seed S is always the same: lines, arcs, C-, Akima and B-splines and exact stops over three
or five axes, 10 um to 20 mm large, feeds from 500 to 30000 mm/min, SOFT or BRISK. Each is run once as it is, once with M holds,
each with its resume, spread over its time, and once with M events of all kinds: holds, feed overrides from 10 to 200 %, rapid
overrides, failing supply. Out: one line per failure and the totals; programs that fail stay in FOLDER.

Judged is the trace only, with `check_trace.py`: velocity and acceleration within 0.5 %, jerk (SOFT) within 2 %, corner steps
as the machine file grants them, no motion backwards, and with events the same final steps as without.
Exit code 1 if anything fails, or if too few programs ran.
"""

import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import check_trace
import trace_file

HERE = Path(__file__).resolve().parent
MACHINE = HERE.parents[1] / "machines" / "mcv1210.toml"
SIM = HERE.parents[1] / "target" / "release" / "host-sim"

# Longest run of the simulator, s: a program that takes longer counts as one that does not end.
PATIENCE = 60

# Feed below which a motion backwards is the rounding of ten decimals.
STILL = 1e-6


def point(rng, size, axes):
    """One random target."""
    return " ".join(f"{axis}{rng.uniform(-size, size):.4f}" for axis in axes)


def arcs(rng, size, count):
    """Arcs of random radius and angle, one behind the other."""
    lines, x, y = [], 0.0, 0.0
    for _ in range(count):
        radius = rng.uniform(0.2, 1.0) * size
        start = rng.uniform(0.0, 2.0 * math.pi)
        end = start + rng.uniform(0.3, 5.0)
        i, j = -radius * math.cos(start), -radius * math.sin(start)
        to_x, to_y = x + i + radius * math.cos(end), y + j + radius * math.sin(end)
        lines.append(f"G17 G3 X{to_x:.6f} Y{to_y:.6f} I{i:.6f} J{j:.6f}")
        x, y = round(to_x, 6), round(to_y, 6)
    return lines


def program(seed, number):
    """Text of one program."""
    rng = random.Random(seed * 1_000_003 + number)
    size = 10.0 ** rng.uniform(-2.0, 1.3)
    mode = rng.choice(["SOFT", "SOFT", "BRISK"])
    count = rng.randint(2, 20)
    points = lambda axes, more: [point(rng, size, axes) for _ in range(count + more)]
    kinds = {
        "lines": lambda: [f"G1 {p}" for p in points("XYZ", 0)],
        "natural": lambda: ["BAUTO EAUTO", "CSPLINE", *points("XYZ", 3)],
        "five": lambda: ["CSPLINE", *points("XYZAC", 3)],
        "akima": lambda: ["ASPLINE", *points("XYZ", 4)],
        "b": lambda: ["BSPLINE SD=3", *points("XYZ", 4)],
        "arcs": lambda: arcs(rng, size, count),
        "mixed": lambda: [f"G1 {point(rng, size, 'XYZ')}", "CSPLINE", *points("XYZ", 1), "G9", f"G1 {point(rng, size, 'XYZ')}"],
    }
    body = kinds[rng.choice(sorted(kinds))]()
    feed = rng.choice([500, 3000, 9000, 30000])
    return "\n".join([f"G90 G64 {mode}", f"G1 X0 Y0 Z0 A0 C0 F{feed}", *body, "M30", ""])


def holds(seed, number, ticks, count):
    """Rows of `count` holds and of the resume behind each, in order, spread over `ticks`; a resume may come while still braking."""
    rng = random.Random(seed * 7_368_787 + number)
    at = sorted(rng.sample(range(1, max(ticks, 4 * count)), 2 * count))
    return [(tick, ("hold", "resume")[k % 2]) for k, tick in enumerate(at)]


def mixed(seed, number, ticks, count):
    """Rows of `count` events of all kinds, in order, spread over `ticks`; behind each hold its resume."""
    rng = random.Random(seed * 2_750_159 + number)
    rows = []
    for tick in rng.sample(range(1, max(ticks, 2 * count)), count):
        kind = rng.choice(["hold", "override", "override", "rapid", "starve"])
        if kind == "hold":
            rows += [(tick, "hold"), (tick + rng.randint(1, 2000), "resume")]
        elif kind == "override":
            rows.append((tick, f"override={rng.randint(10, 200)}"))
        elif kind == "rapid":
            rows.append((tick, f"rapid={rng.randint(10, 100)}"))
        else:
            rows.append((tick, f"starve={rng.randint(1, 2000)}"))
    rows.sort(key=lambda row: row[0])
    # Whatever came last: the program is to end.
    return [*rows, (max(ticks, rows[-1][0]) + 4000, "resume")] if rows else rows


def judge(stem, brisk):
    """Complaints about one run, ticks it took, its final steps and the largest share used of each kind of limit."""
    trace = trace_file.read_trace(f"{stem}.csv")
    summary = trace_file.read_summary(f"{stem}.json")
    steps = check_trace.corner_steps(MACHINE, summary)
    table, problems = check_trace.judge(trace, summary, steps, (0.005, 0.005, 0.02), brisk)
    if trace.feed.min() < -STILL:
        row = int(np.argmin(trace.feed))
        problems.append(f"feed {trace.feed[row]:.6f} at tick {trace.tick[row]}: backwards")
    used = {}
    for _, label, *_, share, _, _, _, verdict in table:
        if verdict != "-":
            used[label] = max(used.get(label, 0.0), share)
    return problems, summary["ticks"], [axis["final_steps"] for axis in summary["axes"]], used


def run(sim, text, folder, name, rows):
    """Runs a program with the events `rows`; None if it is refused (a random arc may be), else what `judge` says."""
    stem = folder / name
    stem.with_suffix(".nc").write_text(text, encoding="ascii")
    command = [sim, "run", f"{stem}.nc", "--auto-start", "--trace", f"{stem}.csv", "--json", f"{stem}.json"]
    if rows:
        stem.with_suffix(".events").write_text("tick,event\n" + "".join(f"{t},{e}\n" for t, e in rows), encoding="ascii")
        command += ["--events", f"{stem}.events"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        Path(f"{stem}.csv").unlink(missing_ok=True)
        return [f"does not come to an end in {PATIENCE} s"], 0, [], {}
    summary = Path(f"{stem}.json")
    if not summary.is_file() or json.loads(summary.read_text(encoding="utf-8"))["outcome"] != "finished":
        return (["did not finish: " + (done.stdout + done.stderr)[-200:]], 0, [], {}) if rows else None
    verdict = judge(stem, "BRISK" in text)
    Path(f"{stem}.csv").unlink()
    return verdict


def one(sim, seed, number, counts, folder):
    """(complaints, events made, largest uses) of one program; None if it is refused."""
    text, name = program(seed, number), f"s{seed}_{number}"
    calm = run(sim, text, folder, name, [])
    if calm is None:
        return None
    problems, ticks, final, used = calm
    complaints = [f"{name}: {p}" for p in problems]
    for suffix, rows_of, count in [("h", holds, counts[0]), ("m", mixed, counts[1])]:
        if not count:
            continue
        rows = rows_of(seed, number, ticks, count)
        problems, _, other_final, more = run(sim, text, folder, name + suffix, rows)
        complaints += [f"{name}{suffix}: {p}" for p in problems]
        if other_final and other_final != final:
            complaints.append(f"{name}{suffix}: final steps {other_final}, without events {final}")
        used = {label: max(used.get(label, 0.0), more.get(label, 0.0)) for label in used}
    if not complaints:
        for file in folder.glob(f"{name}[.hm]*"):
            file.unlink()
    return complaints, sum(counts), used


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Random programs and events against the limits of the machine.")
    parser.add_argument("--sim", default=str(SIM), help="the simulator")
    parser.add_argument("--programs", type=int, default=100)
    parser.add_argument("--holds", type=int, default=0, help="holds per program")
    parser.add_argument("--mixed", type=int, default=0, help="events of all kinds per program")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", help="folder for programs that fail")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(options.jobs) as pool:
        folder = Path(options.keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        jobs = [pool.submit(one, options.sim, options.seed, k, (options.holds, options.mixed), folder) for k in range(options.programs)]
        ran, failed, made, most = 0, 0, 0, {}
        for job in jobs:
            result = job.result()
            if result is None:
                continue
            complaints, count, used = result
            ran, made, failed = ran + 1, made + count, failed + bool(complaints)
            most = {label: max(most.get(label, 0.0), share) for label, share in used.items()} | {
                label: share for label, share in most.items() if label not in used
            }
            for line in complaints:
                print(line, flush=True)
    uses = ", ".join(f"{label} {share:.4f}" for label, share in most.items())
    print(f"{ran} programs of {options.programs} ran, {made} events, {failed} programs failed; largest use: {uses}")
    return 1 if failed or ran < 0.8 * options.programs else 0


if __name__ == "__main__":
    sys.exit(main())
