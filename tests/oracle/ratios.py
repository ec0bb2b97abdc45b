#!/usr/bin/env python3
"""Runs the corpus in the simulator and prints how far each program is from its optimum.

    ratios.py [--sim PATH] [--check] [NAME..]

In: tests/corpus/*.nc, data/optimum.json, a built `host-sim`. Each program runs as it stands (SOFT) and with BRISK in its place. Out:
a table of program, our time, optimum, ratio, and the totals; --check also holds every trace against the limits with
`check_trace.py` (0.5 % on velocity and acceleration, 2 % on jerk). Exit code 1 if a run or a check fails.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORPUS = HERE.parent / "corpus"
MACHINE = HERE.parents[1] / "machines" / "mcv1210.toml"
SIM = HERE.parents[1] / "target" / "release" / "host-sim"


def run(sim, name, mode, folder, check):
    """(time in s, lines of complaint) of one program in one mode."""
    text = (CORPUS / f"{name}.nc").read_text(encoding="ascii")
    if text.count("SOFT") != 1:
        return float("nan"), [f"{name}: SOFT has to stand in it once"]
    stem = folder / f"{name}_{mode}"
    program = stem.with_suffix(".nc")
    program.write_text(text.replace("SOFT", mode), encoding="ascii")
    files = ["--json", str(stem) + ".json"] + (["--trace", str(stem) + ".csv"] if check else [])
    done = subprocess.run([sim, "run", program, "--auto-start", *files], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return float("nan"), [f"{name} {mode}: exit {done.returncode}", *done.stdout.splitlines()[-3:], *done.stderr.splitlines()[-3:]]
    complaints = []
    if check:
        brisk = ["--brisk"] if mode == "BRISK" else []
        judge = [sys.executable, HERE / "check_trace.py", str(stem) + ".csv", str(stem) + ".json", "--jerk-tolerance", "2", "--machine", MACHINE]
        verdict = subprocess.run([*judge, *brisk], capture_output=True, text=True, check=False)
        complaints = [f"{name} {mode}: {line}" for line in verdict.stdout.splitlines() if line.startswith("FAIL")]
        Path(str(stem) + ".csv").unlink()
    summary = json.loads(Path(str(stem) + ".json").read_text(encoding="utf-8"))
    # The last tick is the one that finds nothing to do.
    return (summary["ticks"] - 1) / summary["servo_hz"], complaints


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Times of the corpus over their optimum.")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--sim", default=str(SIM), help="the simulator")
    parser.add_argument("--check", action="store_true", help="also check the limits of every trace")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    store = json.loads((HERE / "data" / "optimum.json").read_text(encoding="ascii"))["programs"]
    names = options.names or sorted(path.stem for path in CORPUS.glob("*.nc"))
    complaints = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        jobs = {(n, mode): pool.submit(run, options.sim, n, mode, Path(folder), options.check) for n in names for mode in ("BRISK", "SOFT")}
        print(f"{'program':22} {'BRISK s':>9} {'optimum':>9} {'ratio':>6}   {'SOFT s':>9} {'optimum':>9} {'ratio':>6}")
        totals = {mode: [0.0, 0.0, 0.0] for mode in ("BRISK", "SOFT")}
        for name in names:
            cells = []
            for mode in ("BRISK", "SOFT"):
                ours, said = jobs[name, mode].result()
                complaints += said
                best = store.get(name, {}).get(f"{mode.lower()}_s", float("nan"))
                cells.append(f"{ours:9.4f} {best:9.4f} {ours / best:6.3f}")
                if best == best and ours == ours:
                    sums = totals[mode]
                    sums[0], sums[1], sums[2] = sums[0] + ours, sums[1] + best, max(sums[2], ours / best)
            print(f"{name:22} " + "   ".join(cells), flush=True)
    cells = [f"{ours:9.4f} {best:9.4f} {ours / best if best else 0.0:6.3f}" for ours, best, _ in totals.values()]
    print(f"{'total':22} " + "   ".join(cells))
    print(f"{'largest':22} " + "   ".join(f"{'':9} {'':9} {worst:6.3f}" for _, _, worst in totals.values()))
    for line in complaints:
        print(line)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
