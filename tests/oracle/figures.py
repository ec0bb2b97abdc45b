#!/usr/bin/env python3
"""Draws the figures of docs/planner.md from runs of the simulator, and writes its table of times.

    figures.py [--sim PATH] [--doc FILE]

In: programs of tests/corpus, `data/optimum.json`, `data/optimum_curves.json`, a built `host-sim`. Out: feed.svg, limits.svg and events.svg in
the folder `figures` beside FILE (docs/planner.md), and the lines between the two marks in FILE. Needs numpy, scipy and matplotlib.

What axes do comes from differences of the commanded positions in the trace. Curves are thinned to the least and the largest value
of each stretch, so no extreme is lost. The same traces give the same files.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import check_trace
import ratios
import trace_file as tr
from path_deviation import metric

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(__file__).resolve().parent / "data"
MARKS = ("<!-- times: begin -->\n", "<!-- times: end -->\n")
# Colours that stay apart with any colour vision (Okabe and Ito).
AXES = {"X": "#0072b2", "Y": "#e69f00", "Z": "#009e73", "A": "#cc79a7", "C": "#d55e00"}
OURS, BEST, GREY, PALE = "#0072b2", "#d55e00", "#777777", "#d0d0d0"
KINDS = ("velocity", "acceleration", "jerk")
STRETCHES = 500
# From this share on a limit counts as binding.
BINDS = 0.95
plt.rcParams.update(
    {
        "svg.fonttype": "none",
        "svg.hashsalt": "pentaspline",
        "font.family": "sans-serif",
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 9,
        "lines.linewidth": 1.1,
        "path.simplify": False,
        # Readable on a dark page, too.
        "figure.facecolor": "white",
    }
)


class Run:
    """One run of a program, of the corpus if no text is given: time, path length, feed, programmed feed, use of each axis limit [kind, row, axis]."""

    def __init__(self, sim, folder, name, mode="SOFT", events=(), text=None):
        stem = folder / f"{name}_{mode}_{len(events)}"
        text = (text or (ratios.CORPUS / f"{name}.nc").read_text(encoding="ascii")).replace("SOFT", mode)
        stem.with_suffix(".nc").write_text(text, encoding="ascii")
        stem.with_suffix(".events").write_text("tick,event\n" + "".join(f"{t},{e}\n" for t, e in events), encoding="ascii")
        files = ["--events", f"{stem}.events", "--trace", f"{stem}.csv", "--json", f"{stem}.json"]
        subprocess.run([sim, "run", f"{stem}.nc", "--auto-start", *files], check=True, stdout=subprocess.DEVNULL)
        trace, summary = tr.read_trace(f"{stem}.csv"), tr.read_summary(f"{stem}.json")
        Path(f"{stem}.csv").unlink()
        self.axes, self.hz, self.feed = trace.axes, summary["servo_hz"], trace.feed
        self.time = (summary["ticks"] - 1) / self.hz
        self.t = trace.t_s - trace.t_s[0]
        linear = np.array([axis["unit"] == "mm" for axis in summary["axes"]])
        self.s = np.cumsum(metric(np.diff(tr.units(trace, summary), axis=0, prepend=0.0), linear))
        scale = tr.SCALE * np.array([axis["steps_per_unit"] for axis in summary["axes"]])
        self.use = np.zeros((3, *trace.position.shape))
        for k, (_, limit, _, order) in enumerate(check_trace.ORDERS):
            limits = np.array([axis[limit] for axis in summary["axes"]])
            self.use[k] = np.abs(check_trace.differences(trace.position, order)) * float(self.hz) ** order / scale / limits
        if mode == "BRISK":
            self.use[2] = 0.0
        feeds = programmed(text)
        self.programmed = feeds[np.clip(trace.block, 0, len(feeds) - 1)]

    def bound(self):
        """Share of the time in which the programmed feed or a limit of an axis binds."""
        moves = self.feed > 1e-6
        binds = (self.use.max(axis=(0, 2)) >= BINDS) | (self.feed >= BINDS * self.programmed)
        return float((binds & moves).sum() / max(moves.sum(), 1))


def programmed(text):
    """Feed per second of each line of a program, infinite where it moves rapidly; the first line has number 1."""
    feed, rapid, out = np.inf, False, [np.inf]
    for line in text.splitlines():
        code = line.split(";")[0]
        for word in re.findall(r"\bG0*(\d+)\b", code):
            rapid = int(word) == 0 if int(word) < 4 else rapid
        rapid = rapid and "SPLINE" not in code
        found = re.search(r"\bF([\d.]+)", code)
        feed = float(found[1]) / 60.0 if found else feed
        out.append(np.inf if rapid else feed)
    return np.array(out)


def stretches(x, low, high, count=STRETCHES):
    """Index ranges of equal stretches of x between low and high, empty ones left out."""
    edges = np.searchsorted(x, np.linspace(low, high, count + 1))
    return [(a, b) for a, b in zip(edges[:-1], edges[1:]) if b > a]


def curve(x, y, low, high, count=STRETCHES):
    """x and y, thinned to the least and the largest value of each stretch."""
    rows = []
    for a, b in stretches(x, low, high, count):
        rows += sorted({a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))})
    return np.round(x[rows], 4), np.round(y[rows], 4)


def save(figure, out, name):
    """Writes one SVG without a date in it, with a hundredth of a point as the last digit."""
    path = out / f"{name}.svg"
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r"(\d\.\d\d)\d+", r"\1", text), encoding="utf-8")
    print(f"{path}: {path.stat().st_size} bytes")


def draw_feed(sim, folder, out):
    """Feed over path beside that of the shortest motion."""
    best = json.loads((DATA / "optimum_curves.json").read_text(encoding="ascii"))
    shown = [
        ("thesis_a", "SOFT", "one quarter of the thesis contour as A-spline", 82.0, 132.0),
        ("random_3axis_10mm", "SOFT", "random C-spline", 0.0, None),
        ("random_3axis_10mm", "BRISK", "the same without limit of jerk", 0.0, None),
    ]
    figure, panels = plt.subplots(len(shown), 1, figsize=(7.6, 6.6), layout="constrained")
    for panel, (name, mode, what, low, high) in zip(panels, shown):
        run = Run(sim, folder, name, mode)
        high = high or run.s[-1]
        s, v = (np.array(x) for x in best[name][mode.lower()])
        near = slice(max(0, np.searchsorted(s, low) - 1), np.searchsorted(s, high) + 1)
        s, v = s[near], v[near]
        feed = np.where(np.isfinite(run.programmed), run.programmed, np.nan)
        panel.plot(*curve(run.s, feed, low, high), color=GREY, linestyle=(0, (4, 2)), linewidth=0.9, label="programmed")
        panel.plot(s, v, color=BEST, linewidth=0.9, label="shortest motion")
        panel.plot(*curve(run.s, run.feed, low, high), color=OURS, label="planner")
        panel.set(ylabel="feed, mm/s", xlim=(low, high), ylim=(0, 1.08 * max(v)))
        panel.set_title(f"{name}, {mode} ({what})", loc="left")
    figure.legend(*panels[0].get_legend_handles_labels(), ncols=3, loc="outside upper center", frameon=False)
    panels[-1].set_xlabel("path, mm")
    save(figure, out, "feed")


def binding(run, low, high):
    """Edges of stretches of path, and in each the largest use of every limit [stretch, limit]: programmed feed, then kind by kind the axes."""
    feed = np.where(np.isfinite(run.programmed), run.feed / run.programmed, 0.0)
    parts = stretches(run.s, low, high, 240)
    edges = np.array([run.s[a] for a, _ in parts] + [high])
    return edges, np.array([[feed[a:b].max(), *run.use[:, a:b].max(axis=1).ravel()] for a, b in parts])


def runs_of(values):
    """(value, first index, index behind the last) of equal neighbours."""
    cuts = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    return [(values[a], a, b) for a, b in zip(cuts[:-1], cuts[1:])]


def draw_limits(sim, folder, out):
    """Which limit binds where along the path."""
    shown = [("five_axis_sweep", "SOFT", 0.0, None), ("ellipse", "SOFT", 0.0, None), ("random_3axis_10mm", "BRISK", 75.0, 275.0)]
    figure, columns = plt.subplots(4, 3, figsize=(8.4, 6.0), sharex="col", sharey="row", height_ratios=(1.3, 1, 1, 1), layout="constrained")
    lanes = ["feed", *KINDS, "none"]
    for (name, mode, low, high), panels in zip(shown, columns.T):
        run = Run(sim, folder, name, mode)
        high = high or run.s[-1]
        edges, use = binding(run, low, high)
        axes = len(run.axes)
        most = np.where(use.max(axis=1) < BINDS, -1, use.argmax(axis=1))
        for limit, a, b in runs_of(most):
            lane = 4 if limit < 0 else 0 if limit == 0 else 1 + (limit - 1) // axes
            colour = PALE if limit < 0 else GREY if limit == 0 else AXES[run.axes[(limit - 1) % axes]]
            panels[0].broken_barh([(edges[a], edges[b] - edges[a])], (lane - 0.4, 0.8), facecolor=colour, linewidth=0)
        panels[0].set(yticks=range(len(lanes)), yticklabels=lanes, ylim=(len(lanes) - 0.5, -0.5), xlim=(low, high))
        panels[0].set_title(f"{name}, {mode}", loc="left")
        for k, panel in enumerate(panels[1:]):
            share = 100 * use[:, 1 + k * axes : 1 + (k + 1) * axes]
            for axis, a, b in runs_of(share.argmax(axis=1)):
                panel.stairs(share[a:b, axis], edges[a : b + 1], fill=True, color=AXES[run.axes[axis]], linewidth=0)
            panel.axhline(100, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
            panel.set(ylim=(0, 112), xlim=(low, high))
        if mode == "BRISK":
            panels[3].text(0.5, 0.5, "no limit", transform=panels[3].transAxes, ha="center", va="center", color=GREY)
        panels[-1].set_xlabel("path, mm")
    columns[0, 0].set_ylabel("what binds")
    for kind, panel in zip(KINDS, columns[1:, 0]):
        panel.set_ylabel(f"{kind},\n% of limit")
    keys = [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in (*AXES.values(), GREY, PALE)]
    names = [f"axis {axis}" for axis in AXES] + ["programmed feed", f"all below {BINDS:.0%}"]
    figure.legend(keys, names, ncols=7, loc="outside upper center", frameon=False, handlelength=1.0, columnspacing=1.0)
    save(figure, out, "limits")


def ring(points=700, radius=100.0):
    """Text of a C-spline through points on a circle, 0.9 mm apart."""
    angle = 2.0 * np.pi * np.arange(1, points + 1) / points
    rows = [f"X{radius * np.sin(x):.4f} Y{radius * (1 - np.cos(x)):.4f}" for x in angle]
    return "\n".join(["G90 G64 SOFT", "G1 X0 Y0 F6000", "BNAT ENAT", "CSPLINE", *rows, "M30", ""])


def draw_events(sim, folder, out):
    """Hold and resume, steps of the override, a failing supply."""
    shown = [
        ("hold, resume", [(5000, "hold"), (6000, "resume")], 0.9, 1.9),
        ("override 50 %, 150 %", [(5000, "override=50"), (6000, "override=150")], 0.9, 1.9),
        ("supply fails", [(5000, "starve=15000")], 0.9, 2.9),
    ]
    figure, columns = plt.subplots(3, 3, figsize=(8.4, 5.2), sharex="col", sharey="row", height_ratios=(1.6, 1, 1), layout="constrained")
    calm = Run(sim, folder, "ring", text=ring())
    for (title, events, low, high), panels in zip(shown, columns.T):
        run = Run(sim, folder, "ring", events=events, text=ring())
        panels[0].plot(*curve(calm.t, calm.feed, low, high, 20), color=GREY, linewidth=0.9, linestyle=(0, (4, 2)), label="feed without event")
        panels[0].plot(*curve(run.t, run.feed, low, high, 250), color="black", label="feed")
        panels[0].set_title(title, loc="left")
        for k, panel in ((1, panels[1]), (2, panels[2])):
            for a, axis in enumerate(run.axes[:2]):
                panel.plot(*curve(run.t, 100 * run.use[k, :, a], low, high, 250), color=AXES[axis], linewidth=0.8, label=f"axis {axis}" if k == 1 else None)
            panel.axhline(100, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
            panel.set(ylim=(0, 112))
        for tick, _ in events:
            for panel in panels:
                panel.axvline(tick / run.hz, color=BEST, linewidth=0.8, label="event" if panel is panels[0] and tick == events[0][0] else None)
        panels[2].set(xlabel="time, s", xlim=(low, high))
    columns[0, 0].set(ylabel="feed, mm/s", ylim=(0, 165))
    columns[1, 0].set(ylabel="acceleration,\n% of limit")
    columns[2, 0].set(ylabel="jerk,\n% of limit")
    found = [panel.get_legend_handles_labels() for panel in columns[:2, 0]]
    keys, names = ([x for pair in found for x in pair[i]] for i in (0, 1))
    figure.legend(keys, names, ncols=5, loc="outside upper center", frameon=False)
    save(figure, out, "events")


def times(sim, folder):
    """The table of times, as lines of Markdown."""
    store = json.loads((DATA / "optimum.json").read_text(encoding="ascii"))["programs"]
    names, modes = sorted(path.stem for path in ratios.CORPUS.glob("*.nc")), ("BRISK", "SOFT")

    def row(name):
        return [(run.time, store[name][f"{mode.lower()}_s"], run.bound()) for mode, run in ((m, Run(sim, folder, name, m)) for m in modes)]

    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(names, pool.map(row, names)))
    cells = lambda ours, best, bound: f"{ours:.3f} | {best:.3f} | {ours / best:.3f} | {100 * bound:.0f}"
    yield "| program | BRISK, s | shortest | ratio | bound, % | SOFT, s | shortest | ratio | bound, % |\n"
    yield "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    for name in names:
        yield f"| `{name}` | " + " | ".join(cells(*cell) for cell in found[name]) + " |\n"
    sums = []
    for m in range(len(modes)):
        rows = [found[name][m] for name in names]
        ours, best = (sum(row[i] for row in rows) for i in (0, 1))
        sums.append(cells(ours, best, sum(row[0] * row[2] for row in rows) / ours))
    yield "| **total** | " + " | ".join(sums) + " |\n"
    largest = (max(names, key=lambda name: found[name][m][0] / found[name][m][1]) for m in range(len(modes)))
    worst = (f"{found[name][m][0] / found[name][m][1]:.3f} (`{name}`)" for m, name in enumerate(largest))
    yield "\nLargest ratio: " + ", ".join(f"{w} in {mode}" for w, mode in zip(worst, modes)) + ".\n"


def rewrite(doc, lines):
    """Puts `lines` between the marks of a page."""
    text = doc.read_text(encoding="utf-8")
    head, begin, rest = text.partition(MARKS[0])
    _, end, tail = rest.partition(MARKS[1])
    if not begin or not end:
        raise ValueError(f"{doc}: the marks {MARKS} are not there")
    doc.write_text(head + begin + "".join(lines) + end + tail, encoding="utf-8")
    print(f"{doc}: table written")


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Figures and table of docs/planner.md.")
    parser.add_argument("--sim", default=str(ratios.SIM), help="the simulator")
    parser.add_argument("--doc", type=Path, default=ROOT / "docs" / "planner.md")
    options = parser.parse_args()
    out = options.doc.parent / "figures"
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for draw in (draw_feed, draw_limits, draw_events):
            draw(options.sim, folder, out)
        rewrite(options.doc, list(times(options.sim, folder)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
