#!/usr/bin/env python3
"""Checks a recorded run against the limits of its machine, by differentiating the commanded positions.

    check_trace.py TRACE.csv SUMMARY.json [--brisk] [--tolerance PERCENT] [--jerk-tolerance PERCENT] [--machine FILE.toml]

Shares no code with the simulator: positions are differenced as exact integers, then scaled.
Checked: one row per servo tick; per-axis velocity, acceleration and jerk within the limits stated in
SUMMARY (0.5 % unless told); the maxima printed there agree with the trace; final steps are the final
position rounded half up; the feed column is the speed of the linear axes (of the rotary axes where no
linear axis moves). --brisk leaves the jerk out, for programs that use BRISK.

--machine names the machine file, for its `corner_step`: where the executed block changes, an axis with a corner step may make
that step of velocity, over and above its limits, within one servo tick (two differences share it). Everywhere else, and
without --machine, nothing is granted. The last line names the limit that is used most, and where.

Exit codes: 0 all hold, 1 a check failed, 2 the files cannot be read.
"""

import argparse
import sys
import tomllib
from dataclasses import dataclass

import numpy as np

import trace_file as tr

ORDERS = [("velocity", "v_limit", "v_max", 1), ("acceleration", "a_limit", "a_max", 2), ("jerk", "j_limit", "j_max", 3)]


def differences(position, order, before=None):
    """Exact n-th differences, one row per row: `before` are at least n rows before the first, else the machine stands at zero there."""
    if before is None:
        before = np.zeros((order, position.shape[1]), dtype=position.dtype)
    return np.diff(np.concatenate([before[-order:], position]), n=order, axis=0)


@dataclass
class Peak:
    """Largest n-th difference of one axis, 1e-10 step, and where it is."""

    units: int = 0
    tick: int = 0
    block: int = 0


def peaks(trace, delta):
    """The `Peak` of every axis in differences [row, axis] of a trace."""
    rows = np.abs(delta).argmax(axis=0)
    return [Peak(abs(int(delta[row, a])), int(trace.tick[row]), int(trace.block[row])) for a, row in enumerate(rows)]


def check_rows(trace, summary):
    """Ticks run without a gap, times belong to them."""
    problems = []
    if np.any(np.diff(trace.tick) != 1):
        row = int(np.argmax(np.diff(trace.tick) != 1)) + 1
        problems.append(f"tick {trace.tick[row]} follows tick {trace.tick[row - 1]}")
    hz = summary["servo_hz"]
    off = np.abs(trace.t_s * hz - trace.tick - (trace.t_s[0] * hz - trace.tick[0]))
    if off.max() > 0.51:
        problems.append(f"t_s drifts from tick / servo_hz by {off.max():.2f} ticks")
    names = [axis["name"] for axis in summary["axes"]]
    if names != trace.axes:
        problems.append(f"axes differ: trace {trace.axes}, summary {names}")
    return problems


def corner_steps(path, summary):
    """Velocity step each axis may make at a corner, in the order of the summary; zero without a machine file."""
    if path is None:
        return [0.0] * len(summary["axes"])
    with open(path, "rb") as text:
        steps = {axis["name"]: float(axis["corner_step"]) for axis in tomllib.load(text)["axis"]}
    return [steps[axis["name"]] for axis in summary["axes"]]


def near_corners(block):
    """Rows whose third difference can see what happened when the block changed."""
    at = np.flatnonzero(np.diff(block) != 0)
    near = np.zeros(len(block), dtype=bool)
    for shift in range(-1, 4):
        near[np.clip(at + shift, 0, len(block) - 1)] = True
    return near


def check_corners(trace, summary, steps, near, tolerance):
    """At a corner, the velocity may change by the corner step and what one tick of acceleration gives on either side."""
    problems = []
    hz = float(summary["servo_hz"])
    velocity = differences(trace.position, 1) * hz / tr.SCALE
    for a, axis in enumerate(summary["axes"]):
        if steps[a] <= 0.0 or not near.any():
            continue
        v = velocity[:, a] / axis["steps_per_unit"]
        # A step between two ticks shows in two neighbouring differences.
        change = np.abs(v[2:] - v[:-2])
        seen = np.where(near[2:], change, 0.0)
        allowed = (steps[a] + 2.0 * axis["a_limit"] / hz) * (1.0 + tolerance)
        row = int(np.argmax(seen)) + 2
        if seen.max() > allowed:
            problems.append(f"{axis['name']} velocity steps by {seen.max():.6g} at tick {trace.tick[row]}, {allowed:.6g} is allowed")
    return problems


def check_limits(trace, summary, tolerances, brisk, free):
    """Per-axis maxima against limits and against the summary; returns (table rows, problems).

    `tolerances` are for velocity, acceleration and jerk; `free` [row, axis] are rows whose acceleration and jerk are a
    matter of `check_corners`.
    """
    rows, problems = [], []
    for order in (1, 2, 3):
        delta = differences(trace.position, order)
        judged = np.where(free, 0, delta) if order > 1 else delta
        real = [peak.units for peak in peaks(trace, delta)]
        table, more = against_limits(peaks(trace, judged), real, order, summary, tolerances[order - 1], not (brisk and order == 3))
        rows, problems = rows + table, problems + more
    return rows, problems


def against_limits(judged, real, order, summary, tolerance, counts):
    """The largest `order`-th differences, a `Peak` per axis, against its limit; `real` are what the summary should have found.

    Returns (table rows, problems), like `check_limits`. Without `counts` there is no limit.
    """
    rows, problems = [], []
    hz = summary["servo_hz"]
    label, limit_key, claim_key, _ = ORDERS[order - 1]
    for axis, most, units in zip(summary["axes"], judged, real):
        per_step = hz**order / (tr.SCALE * axis["steps_per_unit"])
        peak, found = most.units * per_step, units * per_step
        limit, claim = axis[limit_key], axis[claim_key]
        over = counts and peak > limit * (1.0 + tolerance)
        # Ten printed decimals leave 2^(order-1) units of the last place in an n-th difference.
        floor = 2.0**order * per_step
        lies = counts and abs(claim - found) > tolerance * max(found, limit * 1e-3) + floor
        verdict = "OVER" if over else ("claim" if lies else ("-" if not counts else "ok"))
        rows.append((axis["name"], label, peak, limit, peak / limit, claim, most.tick, most.block, verdict))
        if over:
            problems.append(f"{axis['name']} {label} {peak:.6g} exceeds {limit:.6g} at tick {most.tick}")
        if lies:
            problems.append(f"{axis['name']} {label}: summary says {claim:.6g}, trace has {found:.6g}")
    return rows, problems


def check_final(trace, summary):
    """Steps emitted in the end are the last commanded position rounded half up."""
    problems = []
    for a, axis in enumerate(summary["axes"]):
        last = int(trace.position[-1, a])
        expected = (2 * last + tr.SCALE) // (2 * tr.SCALE)
        if axis["final_steps"] != expected:
            problems.append(f"{axis['name']}: final_steps {axis['final_steps']}, last row {last / tr.SCALE} rounds to {expected}")
    return problems


def check_feed(trace, summary, tolerance, brisk):
    """The feed column is the speed along the path; returns (largest difference, problems).

    A difference of positions is the mean speed over a tick; two neighbouring means average to the speed
    between them but for a share of the jerk (and, under BRISK, half a tick of acceleration), which the
    tolerance grants. The column may be either, the speed at the end of the tick or the mean over it, but one
    of them throughout.
    """
    hz = float(summary["servo_hz"])
    linear = np.array([axis["unit"] == "mm" for axis in summary["axes"]])
    delta = np.diff(tr.units(trace, summary), axis=0) * hz
    straight = np.sqrt(np.sum(delta[:, linear] ** 2, axis=1))
    turning = np.sqrt(np.sum(delta[:, ~linear] ** 2, axis=1))
    # One digit of the last place per axis is rounding, not motion.
    moves = straight > 1e-9 * hz
    mean = np.where(moves, straight, turning)
    kind = np.where(moves, 1, 0)
    inner = slice(1, -1)
    central = 0.5 * (mean[:-1] + mean[1:])
    same = (kind[:-1] == kind[1:]) & (trace.block[inner] == trace.block[2:])
    jerk = max(axis["j_limit"] for axis in summary["axes"])
    slack = 4.0 * jerk / hz**2
    if brisk:
        slack += max(axis["a_limit"] for axis in summary["axes"]) / hz
    readings = []
    for speed in (mean[:-1], central):
        gap = np.where(same, np.abs(trace.feed[inner] - speed), 0.0)
        over = gap - tolerance * speed - slack
        readings.append((float(over.max(initial=0.0)), float(gap.max(initial=0.0)), over, speed))
    worst, gap, over, speed = min(readings, key=lambda r: r[:2])
    if worst <= 0.0:
        return gap, []
    row = int(np.argmax(over))
    return gap, [f"feed {trace.feed[row + 1]:.6g} at tick {trace.tick[row + 1]}, positions move at {speed[row]:.6g}"]


def judge(trace, summary, steps, tolerances, brisk):
    """Everything but the feed column: (table of `check_limits`, problems).

    `steps` are the corner steps of the axes, `tolerances` as in `check_limits`.
    """
    near = near_corners(trace.block)
    free = near[:, None] & (np.array(steps) > 0.0)
    table, over = check_limits(trace, summary, tolerances, brisk, free)
    problems = check_rows(trace, summary) + over
    problems += check_corners(trace, summary, steps, near, tolerances[0]) + check_final(trace, summary)
    return table, problems


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Differentiates a trace and checks it against the machine limits.")
    parser.add_argument("trace")
    parser.add_argument("summary")
    parser.add_argument("--brisk", action="store_true", help="leave out the jerk")
    parser.add_argument("--tolerance", type=float, default=0.5, help="percent")
    parser.add_argument("--jerk-tolerance", type=float, help="percent, on jerk; as --tolerance if not given")
    parser.add_argument("--machine", help="machine file, for its corner steps")
    options = parser.parse_args()
    try:
        trace, summary = tr.read_trace(options.trace), tr.read_summary(options.summary)
        steps = corner_steps(options.machine, summary)
    except (OSError, ValueError, KeyError, tr.BadTrace) as error:
        print(error, file=sys.stderr)
        return 2
    share = options.tolerance / 100.0
    jerk_share = share if options.jerk_tolerance is None else options.jerk_tolerance / 100.0
    table, problems = judge(trace, summary, steps, (share, share, jerk_share), options.brisk)
    feed_off, more = check_feed(trace, summary, share, options.brisk)
    problems += more
    print(f"{'axis':4} {'':12} {'trace':>14} {'limit':>14} {'used':>8} {'summary':>14} {'tick':>9} {'block':>6}")
    for name, label, peak, limit, used, claim, tick, block, verdict in table:
        print(f"{name:4} {label:12} {peak:14.6f} {limit:14.4f} {used:8.2%} {claim:14.6f} {tick:9} {block:6} {verdict}")
    name, label, *_, used, _, tick, block, _ = max((row for row in table if row[-1] != "-"), key=lambda row: row[4])
    print(f"most used: {name} {label} {used:.2%} at tick {tick}, block {block}")
    print(f"rows {len(trace.tick)}, feed column off by at most {feed_off:.6f} mm/s")
    for problem in problems:
        print(f"FAIL {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
