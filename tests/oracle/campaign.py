#!/usr/bin/env python3
"""Runs the corpus and random programs, also with events at random instants, and holds every trace against the limits.

    campaign.py [--sim PATH] [--jobs 2] [--log FILE] [--programs 1000] [--mixed 13] [--holds 0] [--seed 1] [--keep FOLDER]

In: a built `host-sim`; every program of tests/corpus in SOFT and in BRISK; random programs (`random_programs.py`): lines, arcs, C-,
Akima and B-splines and exact stops over three or five axes, 10 um to 20 mm large, feeds from 500 to 30000 mm/min. Each is run once as it
is, once with events of all kinds at `--mixed` instants spread over its time (holds with their resume, feed overrides from 10 to
200 %, rapid overrides, failing supply), and once with `--holds` holds. As called without options that is 1,066 programs with more than
10,000 holds, overrides and failures of the supply.

Out: one line per violation, progress, and the totals. Judged is the trace only, with the tolerances of `watch.py`: it is read
while the simulator writes it, so length costs neither memory nor disk. With --log, programs that are in FILE already are not run
again: the same call goes on where it was stopped. Programs that fail stay in the folder of --keep with their events.

A run ends when its simulated time does (--max-time of `host-sim`), however slow the machine is that simulates; a simulator that no
longer gets on is ended by its processor time. Exit code 1 if anything is violated, 2 if --log is of another campaign.
"""

import argparse
import hashlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import random_programs
import trace_file
from watch import Course, Watch

ROOT = Path(__file__).resolve().parents[2]
CORPUS = ROOT / "tests" / "corpus"
SIM = ROOT / "target" / "release" / "host-sim"

# Simulated time a program may take as it is, s: thrice the longest, which turns rotary axes at a degree per second.
PATIENCE = 3600
# With events: so many times as long, for an override of 10 %, and so much more, for all the holds.
SLOWER, WAITING = 20, 600
# Processor time of one run, s. All of the simulated time takes a tenth of it.
PROCESSOR = 3600
# Share of random programs that has to be accepted by the machine.
ACCEPTED = 0.8
# Programs between two lines of progress.
EVERY = 25


def simulate(sim, stem, course, brisk, longest):
    """Runs `stem`.nc with `stem`.events if there is one; (summary or None, violations, shares)."""
    read, write = os.pipe()
    summary_json = Path(f"{stem}.json")
    summary_json.unlink(missing_ok=True)
    command = [sim, "run", f"{stem}.nc", "--auto-start", "--max-time", str(longest), "--trace", f"/dev/fd/{write}", "--json", summary_json]
    if Path(f"{stem}.events").is_file():
        command += ["--events", f"{stem}.events"]
    bound = lambda: resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR, PROCESSOR))
    watch, broken = Watch(course), []
    with tempfile.TemporaryFile() as said:
        child = subprocess.Popen(command, stdout=said, stderr=said, pass_fds=[write], preexec_fn=bound)
        os.close(write)
        with open(read, "rb") as trace:
            try:
                for part in trace_file.stream(trace):
                    watch.take(part)
            except trace_file.BadTrace as error:
                broken = [("trace", str(error))]
        child.wait()
        said.seek(0)
        text = said.read().decode("utf-8", "replace").strip()[-200:]
    if child.returncode < 0:
        return None, [("unfinished", f"ended by signal {-child.returncode}, after {PROCESSOR} s of processor time at the most")], {}
    if not summary_json.is_file():
        return None, [("refused", text)], {}
    summary = trace_file.read_summary(summary_json)
    if summary["outcome"] != "finished":
        kind = "unfinished" if summary["outcome"] == "time_bound" else "refused"
        return None, [(kind, f"{summary['outcome']}: {text}")], {}
    found, used = watch.verdict(summary, brisk)
    return summary, broken + found, used


def one(sim, name, text, number, options, folder):
    """Record of one program: what was violated, in which of its runs, and what it did."""
    record = {"name": name, "ran": False, "ticks": 0, "events": {}, "violations": [], "used": {}}
    stem, brisk = folder / name, "BRISK" in text
    stem.with_suffix(".nc").write_text(text, encoding="ascii")
    course = Course(stem.with_suffix(".nc"))
    calm, found, used = simulate(sim, stem, course, brisk, PATIENCE)
    # Random arcs may be refused; programs of the corpus and what has been accepted may not.
    refused = calm is None and found[0][0] == "refused"
    if refused and number is not None:
        return record
    violations, events = [(name, *violation) for violation in found], Counter()
    if calm is not None:
        record["ran"] = True
        record["ticks"] = calm["ticks"]
        for suffix, rows_of, count in (("h", random_programs.holds, options["holds"]), ("m", random_programs.mixed, options["mixed"])):
            if not count:
                continue
            seed = options["seed"] if number is not None else name
            rows = rows_of(seed, number, calm["ticks"], count)
            other = folder / (name + suffix)
            other.with_suffix(".nc").write_text(text, encoding="ascii")
            lines = "".join(f"{tick},{event}\n" for tick, event in rows)
            other.with_suffix(".events").write_text("tick,event\n" + lines, encoding="ascii")
            longest = SLOWER * calm["duration_s"] + WAITING
            summary, found, more = simulate(sim, other, course, brisk, longest)
            violations += [(name + suffix, *violation) for violation in found]
            used = {label: max(share, more.get(label, 0.0)) for label, share in used.items()}
            events.update(event.split("=")[0] for _, event in rows)
            record["ticks"] += summary["ticks"] if summary else 0
    if not violations:
        for file in [*folder.glob(f"{name}.*"), *folder.glob(f"{name}[hm].*")]:
            file.unlink()
    return record | {"events": dict(events), "violations": violations, "used": used}


def programs(options):
    """(name, text, number or None) of all."""
    out = []
    for path in sorted(CORPUS.glob("*.nc")) if options["corpus"] else []:
        text = path.read_text(encoding="ascii")
        out += [(f"{path.stem}_{mode}", text.replace("SOFT", mode), None) for mode in ("SOFT", "BRISK")]
    seed = options["seed"]
    return out + [(f"s{seed}_{k}", random_programs.program(seed, k), k) for k in range(options["programs"])]


def resume(log, campaign):
    """Records of an earlier call by name; starts the file if there is none. Exits with 2 if it is of another campaign."""
    if not log.is_file() or not log.stat().st_size:
        log.write_text(json.dumps(campaign) + "\n", encoding="utf-8")
        return {}
    lines = log.read_text(encoding="utf-8").splitlines(keepends=True)
    if json.loads(lines[0]) != campaign:
        print(f"{log} is of another campaign: {lines[0].strip()}", file=sys.stderr)
        sys.exit(2)
    # A line without an end was being written when the campaign was stopped.
    whole = [line for line in lines if line.endswith("\n")]
    log.write_text("".join(whole), encoding="utf-8")
    return {record["name"]: record for record in map(json.loads, whole[1:])}


def total(records, wanted, seconds):
    """Prints the totals; returns the exit code."""
    events, kinds, used, failing, ran, ticks = Counter(), Counter(), {}, [], 0, 0
    for record in records:
        ran, ticks = ran + record["ran"], ticks + record["ticks"]
        events.update(record["events"])
        kinds.update(kind for _, kind, _ in record["violations"])
        failing += sorted({run for run, *_ in record["violations"]})
        for label, share in record["used"].items():
            used[label] = max(used.get(label, 0.0), share)
    row = lambda counts: ", ".join(f"{kind} {counts[kind]}" for kind in sorted(counts)) or "none"
    print(f"programs {ran} of {wanted}; {ticks} ticks; {seconds:.0f} s")
    print(f"events: {row(events)}; instants of hold, override and starvation: {sum(events[k] for k in ('hold', 'override', 'starve'))}")
    print("largest use: " + ", ".join(f"{label} {share:.4f}" for label, share in used.items()))
    print(f"violations {sum(kinds.values())}: {row(kinds)}; failing: {' '.join(failing) or 'none'}")
    return 1 if kinds or ran < ACCEPTED * wanted else 0


def main():
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description="Corpus, random programs and events against the limits of the machine.")
    parser.add_argument("--sim", default=str(SIM), help="the simulator")
    parser.add_argument("--programs", type=int, default=1000, help="random programs")
    parser.add_argument("--mixed", type=int, default=13, help="events of all kinds per program")
    parser.add_argument("--holds", type=int, default=0, help="holds per program, in a run of their own")
    parser.add_argument("--no-corpus", action="store_true", help="random programs only")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[], help="names of programs, as the totals have them")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--log", type=Path, help="records of programs that are done")
    parser.add_argument("--keep", type=Path, help="folder for programs that fail")
    given = parser.parse_args()
    options = {"seed": given.seed, "programs": given.programs, "mixed": given.mixed, "holds": given.holds, "corpus": not given.no_corpus}
    campaign = options | {"sim": hashlib.sha256(Path(given.sim).read_bytes()).hexdigest()[:16]}
    records = resume(given.log, campaign) if given.log else {}
    only = set(given.only)
    every = [row for row in programs(options) if not only or only & {row[0] + run for run in ("", "h", "m")}]
    begun, failed = time.monotonic(), sum(bool(record["violations"]) for record in records.values())
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(given.jobs) as pool:
        folder = given.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        jobs = [pool.submit(one, given.sim, *row, options, folder) for row in every if row[0] not in records]
        for job in as_completed(jobs):
            record = job.result()
            records[record["name"]] = record
            if given.log:
                with open(given.log, "a", encoding="utf-8") as log:
                    log.write(json.dumps(record) + "\n")
            for run, kind, text in record["violations"]:
                print(f"{run}: {kind}: {text}", flush=True)
            failed += bool(record["violations"])
            if len(records) % EVERY == 0:
                print(f"{len(records)} of {len(every)} done, {failed} failed, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    return total([records[name] for name, *_ in every], len(every), time.monotonic() - begun)


if __name__ == "__main__":
    sys.exit(main())
