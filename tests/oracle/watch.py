"""Watches one run of the simulator through its trace, part by part, however long it is.

In: parts of a trace (`trace_file.stream`), the path as programmed, the machine file, at the end the summary. Out: what is wrong,
each with its kind. Shares no code with the core or the simulator. Tolerances, per instant of the run:

    velocity 0.5 %, acceleration 0.5 %, jerk 2 % (SOFT; without it there is no limit), path one step of each axis

Besides: no tick is missing, no motion backwards, the summary says what the trace has, and the final steps are the programmed end.
"""

import tomllib
from fractions import Fraction
from pathlib import Path

import numpy as np

import check_trace
import nc_program
import path_deviation
import trace_file as tr

MACHINE = Path(__file__).resolve().parents[2] / "machines" / "mcv1210.toml"

# Of velocity, acceleration, jerk.
TOLERANCES = (0.005, 0.005, 0.02)
# Steps that a commanded position may be beside the path.
PATH_STEPS = 1.0
# Within this many steps nobody looks whether another piece of the path is nearer still.
NEAR_STEPS = 0.05
# Feed below which a motion backwards is the rounding of ten decimals.
STILL = 1e-6
# Rows kept for the differences of the next part.
KEPT = 3


class Course:
    """The path a program asks for, in mm and degrees, on the machine of `MACHINE`."""

    def __init__(self, program):
        with open(MACHINE, "rb") as text:
            axes = tomllib.load(text)["axis"]
        if any(axis["corner_step"] for axis in axes):
            raise ValueError(f"{MACHINE}: corner steps are not covered here")
        self.names = "".join(axis["name"] for axis in axes)
        self.linear = np.array([axis["kind"] == "linear" for axis in axes])
        self.per_unit = np.array([axis["steps_per_unit"] for axis in axes], dtype=float)
        stretches = nc_program.read(program, self.names)
        self.pieces = path_deviation.curve(stretches, self.linear)
        self.lengths = path_deviation.length_table(self.pieces, self.linear)
        steps = (end * Fraction(n) for end, n in zip(stretches[-1].points[-1], self.per_unit))
        self.final = [int((x + Fraction(1, 2)) // 1) for x in steps]

    def step(self, which):
        """Smallest step of the axes `which`, mm or degree."""
        return 1.0 / self.per_unit[which].max()


class Watch:
    """One run along a `Course`."""

    def __init__(self, course):
        self.course = course
        axes = len(course.names)
        self.axes = None
        self.before = np.zeros((KEPT, axes), dtype=np.int64)
        self.peaks = {order: [check_trace.Peak() for _ in range(axes)] for order in (1, 2, 3)}
        self.tick = None
        self.travelled = 0.0
        self.off = {"linear": (0.0, 0), "rotary": (0.0, 0)}
        self.backwards = (0.0, 0)
        self.gap = None

    def take(self, part):
        """The next rows."""
        self.axes = part.axes
        expected = part.tick[0] if self.tick is None else self.tick + 1
        wrong = np.flatnonzero(part.tick != expected + np.arange(len(part.tick)))
        if len(wrong) and self.gap is None:
            self.gap = int(part.tick[wrong[0]])
        self.tick = int(part.tick[-1])
        for order, largest in self.peaks.items():
            delta = check_trace.differences(part.position, order, self.before)
            found = check_trace.peaks(part, delta)
            self.peaks[order] = [max(pair, key=lambda peak: peak.units) for pair in zip(largest, found)]
        row = int(np.argmin(part.feed))
        self.backwards = min(self.backwards, (float(part.feed[row]), int(part.tick[row])))
        self.follow(part)
        self.before = np.concatenate([self.before, part.position])[-KEPT:]

    def follow(self, part):
        """How far the rows are from the path; those at rest are where the one before was."""
        course = self.course
        scale = tr.SCALE * course.per_unit
        steps = np.diff(np.concatenate([self.before[-1:], part.position]), axis=0) / scale
        moving = np.flatnonzero(steps.any(axis=1))
        if len(moving) == 0:
            return
        travelled = self.travelled + np.cumsum(path_deviation.metric(steps[moving], course.linear))
        self.travelled = float(travelled[-1])
        points = part.position[moving] / scale
        near = NEAR_STEPS * min(course.step(course.linear), course.step(~course.linear))
        far, turned = path_deviation.match(points, travelled, course.pieces, course.lengths, course.linear, near)
        for kind, distance in (("linear", far), ("rotary", turned)):
            row = int(np.argmax(distance))
            self.off[kind] = max(self.off[kind], (float(distance[row]), int(part.tick[moving[row]])))

    def verdict(self, summary, brisk):
        """(violations as (kind, text), largest used share of each limit: label to fraction)."""
        if self.axes is None:
            return [("trace", "no rows")], {}
        found, used = [], {}
        if [axis["name"] for axis in summary["axes"]] != self.axes or "".join(self.axes) != self.course.names:
            return [("trace", f"axes differ: {self.axes}")], {}
        for order, largest in self.peaks.items():
            label, counts = check_trace.ORDERS[order - 1][0], not (brisk and order == 3)
            real = [peak.units for peak in largest]
            table, problems = check_trace.against_limits(largest, real, order, summary, TOLERANCES[order - 1], counts)
            found += [("summary" if "summary" in text else label, text) for text in problems]
            if counts:
                used[label] = max(row[4] for row in table)
        for kind, which in (("linear", self.course.linear), ("rotary", ~self.course.linear)):
            distance, tick = self.off[kind]
            steps = distance / self.course.step(which)
            used["path"] = max(used.get("path", 0.0), steps / PATH_STEPS)
            if steps > PATH_STEPS:
                found.append(("path", f"{kind} axes {steps:.3f} steps beside the path at tick {tick}"))
        if self.backwards[0] < -STILL:
            found.append(("backwards", f"feed {self.backwards[0]:.6f} at tick {self.backwards[1]}"))
        if self.gap is not None:
            found.append(("trace", f"tick {self.gap} does not follow the one before"))
        final = [axis["final_steps"] for axis in summary["axes"]]
        last = [(2 * int(x) + tr.SCALE) // (2 * tr.SCALE) for x in self.before[-1]]
        if final != last or final != self.course.final:
            found.append(("end", f"final steps {final}, last row {last}, programmed {self.course.final}"))
        return found, used
