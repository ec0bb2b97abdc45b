"""Programs and events of the campaign (`campaign.py`): the same for the same seed and number.

In: seed, number, how many. Out: program text; rows (tick, event) of an events file of `host-sim`.
"""

import math
import random


def generator(seed, number, kind):
    """Random numbers of program `number` of a seed, another sequence for each prime `kind`. A program without number has its name for a seed."""
    if number is None:
        return random.Random(f"{seed} {kind}")
    return random.Random(seed * kind + number)


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
    rng = generator(seed, number, 1_000_003)
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
    rng = generator(seed, number, 7_368_787)
    at = sorted(rng.sample(range(1, max(ticks, 4 * count)), 2 * count))
    return [(tick, ("hold", "resume")[k % 2]) for k, tick in enumerate(at)]


def mixed(seed, number, ticks, count):
    """Rows of `count` events of all kinds, in order, spread over `ticks`; behind each hold its resume."""
    rng = generator(seed, number, 2_750_159)
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
