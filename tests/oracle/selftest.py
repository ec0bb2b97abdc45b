#!/usr/bin/env python3
"""Shows that the checkers here, those of the campaign included, pass a right record and fail a wrong one, without any simulator.

Records are made from closed formulas: a straight jerk-limited move, and the C-spline of the thesis sampled
along its own length; then each is spoiled in one way at a time. Exit code 0 if every verdict is as expected.
"""

import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

import check_trace
import nc_program
import path_deviation
import trace_file
import watch

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
HZ = 5000
NAMES = "XYZAC"
# Early in the fifth piece of its spline the linear axes all but stand still.
TURNING = """G90 G64 SOFT
G1 X0 Y0 Z0 A0 C0 F3000
G1 X0.0607 Y-0.0531 Z0.0700 A0.0059 C0.0347
CSPLINE
X-0.0444 Y-0.0676 Z0.0215 A-0.0089 C-0.0159
X0.0037 Y0.0233 Z-0.0004 A-0.0077 C-0.0599
X-0.0272 Y0.0541 Z0.0223 A-0.0670 C0.0250
X0.0561 Y-0.0483 Z-0.0719 A0.0097 C0.0695
X-0.0712 Y-0.0539 Z-0.0525 A-0.0375 C-0.0640
X-0.0392 Y0.0288 Z0.0168 A0.0139 C-0.0559
X-0.0421 Y0.0133 Z-0.0137 A-0.0267 C-0.0687
X-0.0062 Y0.0539 Z-0.0010 A0.0350 C-0.0323
M30
"""
# An A-spline that turns back within a few hundredths of a millimetre.
SHARP = """G90 G64 SOFT
G1 X0 Y0 Z0 A0 C0 F9000
ASPLINE
X-11.1382 Y0.1093 Z-10.8243
X-12.5531 Y-14.3739 Z2.5676
X-0.5647 Y13.5380 Z-12.9786
X11.2855 Y7.0037 Z5.5246
X-5.8499 Y-4.9809 Z7.8329
X-5.1368 Y-11.2519 Z11.0815
X-5.8275 Y-11.3739 Z1.6384
X-11.0671 Y9.6732 Z-4.6798
X6.7609 Y4.4719 Z5.5863
X11.6148 Y10.6865 Z-12.1689
X-12.3937 Y7.5212 Z13.5711
X8.3095 Y2.2266 Z9.0013
M30
"""
LIMITS = {"mm": (666.6667, 5000.0, 50000.0), "degree": (1.0, 5.0, 50.0)}


def write(folder, positions, feed, block=None):
    """Writes a trace and a summary that tells the truth about `positions` (mm, degree)."""
    bits = np.round(positions * 1000.0 * 1e10).astype(np.int64)
    with open(folder / "t.csv", "w", encoding="ascii") as out:
        out.write("tick,t_s,block,feed_mm_s," + ",".join(NAMES) + "\n")
        for i, row in enumerate(bits):
            cells = ",".join(f"{'-' if v < 0 else ''}{abs(v) // 10**10}.{abs(v) % 10**10:010}" for v in map(int, row))
            out.write(f"{i + 1},{(i + 1) / HZ:.6f},{1 if block is None else block[i]},{feed[i]:.9f},{cells}\n")
    axes = []
    for a, name in enumerate(NAMES):
        unit = "mm" if name in "XYZ" else "degree"
        v, acc, j = LIMITS[unit]
        peak = [float(np.abs(check_trace.differences(bits, n)[:, a]).max()) * HZ**n / 1e13 for n in (1, 2, 3)]
        last = int(bits[-1, a])
        axes.append({"name": name, "unit": unit, "steps_per_unit": 1000.0, "v_limit": v, "a_limit": acc, "j_limit": j,
                     "v_max": peak[0], "a_max": peak[1], "j_max": peak[2], "final_steps": (2 * last + 10**10) // (2 * 10**10)})
    summary = {"servo_hz": HZ, "axes": axes}
    (folder / "s.json").write_text(json.dumps(summary), encoding="ascii")
    return summary


def jerk_move(distance, jerk):
    """Symmetric four-piece jerk-limited move: positions and speeds per tick, standing for 10 ticks on either side."""
    quarter = (distance / (2.0 * jerk)) ** (1.0 / 3.0)
    t = np.arange(1, int(4 * quarter * HZ) + 2) / HZ
    j = np.array([jerk, -jerk, -jerk, jerk])
    s, v, a = [0.0], [0.0], [0.0]
    for k in range(4):
        s.append(s[k] + v[k] * quarter + a[k] * quarter**2 / 2 + j[k] * quarter**3 / 6)
        v.append(v[k] + a[k] * quarter + j[k] * quarter**2 / 2)
        a.append(a[k] + j[k] * quarter)
    k = np.minimum((t / quarter).astype(int), 3)
    d = np.minimum(t, 4 * quarter) - k * quarter
    pos = np.array(s)[k] + np.array(v)[k] * d + np.array(a)[k] * d**2 / 2 + j[k] * d**3 / 6
    vel = np.array(v)[k] + np.array(a)[k] * d + j[k] * d**2 / 2
    rest = np.full(10, pos[-1])
    return np.concatenate([np.zeros(10), pos, rest]), np.concatenate([np.zeros(10), vel, np.zeros(10)])


def verdict(module, *arguments):
    """Runs a checker's command line in silence; returns its exit code."""
    sys.argv = [module.__name__, *map(str, arguments)]
    with contextlib.redirect_stdout(io.StringIO()):
        return module.main()


def expect(name, got, wanted, failures):
    """Prints one line and remembers a wrong verdict."""
    print(f"{'ok  ' if got == wanted else 'FAIL'} {name}: {got}")
    if got != wanted:
        failures.append(name)


def limits(folder, failures):
    """check_trace on a straight move."""
    s, v = jerk_move(20.0, 49_900.0)
    positions = np.zeros((len(s), 5))
    positions[:, 0] = s
    run = lambda: verdict(check_trace, folder / "t.csv", folder / "s.json")
    summary = write(folder, positions, v)
    expect("a move within limits passes", run(), 0, failures)
    wrong = json.loads(json.dumps(summary))
    wrong["axes"][0]["final_steps"] += 1
    (folder / "s.json").write_text(json.dumps(wrong))
    expect("one step too many is seen", run(), 1, failures)
    wrong = json.loads(json.dumps(summary))
    wrong["axes"][0]["j_max"] *= 0.9
    (folder / "s.json").write_text(json.dumps(wrong))
    expect("a summary that flatters itself is seen", run(), 1, failures)
    write(folder, positions, v * 1.02)
    expect("a feed column 2 % off is seen", run(), 1, failures)
    fast, w = jerk_move(20.0, 50_500.0)
    positions = np.zeros((len(fast), 5))
    positions[:, 0] = fast
    write(folder, positions, w)
    expect("jerk 1 % over the limit is seen", run(), 1, failures)


def corners(folder, failures):
    """check_trace on a square corner passed at speed, with and without a corner step in the machine file."""
    machine = (EXAMPLES.parent / "machines" / "mcv1210.toml").read_text(encoding="utf-8")
    (folder / "m.toml").write_text(machine.replace("corner_step = 0.0 ", "corner_step = 10.0"), encoding="utf-8")

    def pass_at(speed, block):
        """Up to `speed` along X, through the corner between two ticks, and down to rest along Y."""
        there, v = jerk_move(20.0, 10_000.0)
        top = int(np.argmax(v >= speed))
        up, rate = there[:top], v[:top]
        positions = np.zeros((2 * top + 20, 5))
        positions[:top, 0] = up
        positions[top:, 0] = up[-1]
        # Y mirrors X; the corner lies on a tick.
        positions[top - 1 : 2 * top - 1, 1] = up[-1] - up[::-1]
        positions[2 * top - 1 :, 1] = up[-1]
        feed = np.concatenate([rate, rate[-2::-1], np.zeros(21)])
        write(folder, positions, feed, block=block(top, len(positions)))

    two = lambda top, rows: np.where(np.arange(rows) < top, 1, 2)
    one = lambda top, rows: np.ones(rows, dtype=int)
    run = lambda *more: verdict(check_trace, folder / "t.csv", folder / "s.json", "--tolerance", "0.5", *more)
    given = ("--machine", folder / "m.toml")
    pass_at(8.0, two)
    expect("a corner within the corner step passes", run(*given), 0, failures)
    expect("the same without a corner step is seen", run(), 1, failures)
    pass_at(8.0, one)
    expect("the same within a block is seen", run(*given), 1, failures)
    pass_at(14.0, two)
    expect("a corner beyond the corner step is seen", run(*given), 1, failures)


def sampled(program, count):
    """`count` points of the curve of `program`, evenly along its length; its direction there."""
    linear = np.array([True, True, True, False, False])
    pieces = path_deviation.curve(nc_program.read(program, NAMES), linear)
    edges, table = path_deviation.length_table(pieces, linear)
    goal = np.linspace(0.0, table[-1], count)
    cell = np.clip(np.searchsorted(table, goal, side="right") - 1, 0, len(table) - 2)
    piece = cell // path_deviation.PER_SEGMENT
    share = (goal - table[cell]) / (table[cell + 1] - table[cell])
    u = edges[cell % path_deviation.PER_SEGMENT] + share / path_deviation.PER_SEGMENT
    return path_deviation.at(pieces[piece], u), path_deviation.slope(pieces[piece], u)


def deviation(folder, failures):
    """path_deviation on the thesis C-spline, sampled along its own length."""
    program = EXAMPLES / "thesis" / "CSPLINE_57.MPF"
    points, _ = sampled(program, 20_000)
    still = np.zeros(len(points))
    run = lambda: verdict(path_deviation, program, folder / "t.csv", folder / "s.json")
    write(folder, points, still)
    expect("points of the curve pass", run(), 0, failures)
    off = points.copy()
    off[10_000:10_010, 2] += 0.0017  # the middle turn is level: this is straight away from the curve
    write(folder, off, still)
    expect("1.7 um beside the curve is seen", run(), 1, failures)
    write(folder, points[:-400], still[:-400])
    expect("a run that ends early is seen", run(), 1, failures)


def turning(folder, failures):
    """path_deviation where the tool all but stands still and the rotary axes turn."""
    program = folder / "p.nc"
    program.write_text(TURNING, encoding="ascii")
    points, slopes = sampled(program, 20_000)
    still = np.zeros(len(points))
    run = lambda: verdict(path_deviation, program, folder / "t.csv", folder / "s.json")
    write(folder, points, still)
    expect("points of a curve whose tool all but stands still pass", run(), 0, failures)
    slowest = int(np.argmin((slopes[:, :3] ** 2).sum(axis=1) / (slopes[:, 3:] ** 2).sum(axis=1)))
    across = np.array([-slopes[slowest, 4], slopes[slowest, 3]])
    across /= np.abs(across).max()
    points[slowest - 5 : slowest + 5, 3:] += 0.002 * across
    write(folder, points, still)
    expect("rotary axes 2 thousandths of a degree beside the curve there are seen", run(), 1, failures)


def sharp(folder, failures):
    """path_deviation beside sharp turns of a curve, with lengths that are a little off."""
    program = folder / "p.nc"
    program.write_text(SHARP, encoding="ascii")
    points, _ = sampled(program, 20_000)
    linear = np.array([name in "XYZ" for name in NAMES])
    pieces = path_deviation.curve(nc_program.read(program, NAMES), linear)
    lengths = path_deviation.length_table(pieces, linear)
    travelled = np.linspace(0.0, lengths[1][-1], len(points))
    for off in (-0.1, -0.03, 0.03, 0.1):
        far, _ = path_deviation.match(points, travelled + off, pieces, lengths, linear)
        expect(f"points of a curve with sharp turns are on it, {off:+} mm on", far.max() < 1e-6, True, failures)
    beside = points + [0.0, 0.0, 0.002, 0.0, 0.0]
    far, _ = path_deviation.match(beside, travelled, pieces, lengths, linear)
    expect("those beside it are not", 1.9e-3 < far.max() < 2.1e-3, True, failures)


def watched(folder, failures):
    """watch on a straight move, all at once and in parts; each kind of violation alone."""
    program = folder / "p.nc"
    program.write_text("G90 SOFT\nG1 X20 F30000\nM30\n", encoding="ascii")
    course = watch.Course(program)

    def kinds(size):
        run = watch.Watch(course)
        with open(folder / "t.csv", "rb") as file:
            try:
                for part in trace_file.stream(file, size):
                    run.take(part)
            except trace_file.BadTrace:
                return ["unreadable"]
        return sorted({kind for kind, _ in run.verdict(trace_file.read_summary(folder / "s.json"), False)[0]})

    def case(name, wanted, jerk=50_900.0, spoil=None):
        s, v = jerk_move(20.0, jerk)
        positions = np.zeros((len(s), 5))
        positions[:, 0] = s
        if spoil:
            spoil(positions, v)
        write(folder, positions, v)
        expect(name, kinds(1 << 24), wanted, failures)
        expect(f"{name}, in parts", kinds(3000), wanted, failures)

    def beside(steps):
        def spoil(positions, _):
            # So slowly that no other limit is touched.
            positions[:, 1] = steps / 1000.0 * np.sin(np.linspace(0.0, np.pi, len(positions))) ** 4

        return spoil

    def back(_, v):
        v[len(v) // 2] = -0.001

    def short(positions, _):
        positions[:, 0] *= 19.999 / 20.0

    case("a run within the tolerances passes", [])
    case("jerk 2.5 % over the limit is a violation", ["jerk"], jerk=51_250.0)
    case("0.95 steps beside the path pass", [], spoil=beside(0.95))
    case("1.05 steps beside the path are a violation", ["path"], spoil=beside(1.05))
    case("a motion backwards is a violation", ["backwards"], spoil=back)
    case("an end one step short is a violation", ["end"], spoil=short)
    case("a run on the path passes again", [])
    lines = (folder / "t.csv").read_text(encoding="ascii").splitlines(keepends=True)
    (folder / "t.csv").write_text("".join(lines[:6] + lines[7:]), encoding="ascii")
    expect("a missing tick is a violation", kinds(1 << 24), ["trace"], failures)
    (folder / "t.csv").write_text("".join(lines)[:-7], encoding="ascii")
    expect("a trace that breaks off is seen", kinds(1 << 24), ["unreadable"], failures)


def main():
    """Command line; returns the exit code."""
    failures = []
    with tempfile.TemporaryDirectory() as name:
        limits(Path(name), failures)
        corners(Path(name), failures)
        deviation(Path(name), failures)
        turning(Path(name), failures)
        sharp(Path(name), failures)
        watched(Path(name), failures)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
