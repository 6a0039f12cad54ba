"""The command line of the benchmarks in parts: what is missing is made, two parts at a time."""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from bench_parts import Bench, say

RESULTS = Path(__file__).resolve().parent / "results"
WAIT_S = 0.5


def run_bench(name, parts_of, description, arguments=None, *, jobs=2):
    """Do what the command line asks of a benchmark.

    Args:
        name: of the benchmark and its folders.
        parts_of: called with whether it is the toy; gives the parts.
        description: for its help.
        arguments: of the command line; None takes the process's.
        jobs: parts at a time where the command line doesn't say.

    Returns:
        The exit code: 1 where a part failed.
    """
    options = _parsed(name, description, arguments, jobs)
    folder = (options.folder or Path(".bench") / (f"{name}-toy" if options.toy else name)).resolve()
    results = (options.results or (folder / "results" if options.toy else RESULTS / name)).resolve()
    bench = Bench(folder, results, tuple(parts_of(options.toy)))
    if options.part:
        bench.make(options.part)
        return 0
    names = bench.missing(options.only)
    if options.plan:
        print(plan(bench, names, options.jobs))
        return 0
    if options.toy:
        for one in names:
            bench.make(one)
        return 0
    again = [sys.executable, sys.argv[0], "--folder", str(folder), "--results", str(results), "--part"]
    failed = run_parts(bench, names, again, jobs=options.jobs, minutes=options.minutes)
    return 1 if failed else 0


def _parsed(name, description, arguments, jobs):
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path, help=f"where data and runs are kept; default: .bench/{name}")
    parser.add_argument(
        "--results",
        type=Path,
        help=f"where figures are kept; default: benchmarks/results/{name}, of the toy FOLDER/results",
    )
    parser.add_argument("--minutes", type=float, help="start no part after so many minutes")
    parser.add_argument("--jobs", type=int, default=jobs, help="parts at a time, a core each")
    parser.add_argument("--only", action="append", default=[], metavar="BEGINNING", help="of parts' names")
    parser.add_argument("--plan", action="store_true", help="print what would be made, and make nothing")
    parser.add_argument("--toy", action="store_true", help="all parts at a size that says nothing, quickly")
    parser.add_argument("--part", metavar="NAME", help="make this one part, in this process")
    return parser.parse_args(arguments)


def plan(bench, names, jobs):
    """A table of the parts to make, with the time each takes, and all of them."""
    lines = ["| part | minutes of a core | needs |", "| --- | ---: | --- |"]
    for name in names:
        part = bench.part(name)
        lines.append(f"| {name} | {part.minutes:.0f} | {', '.join(part.needs)} |")
    hours = sum(bench.part(name).minutes for name in names) / 60
    done = len(bench.parts) - len(names)
    lines += ["", f"{len(names)} parts, {hours:.1f} hours of a core: {hours / jobs:.1f} h with --jobs {jobs}"]
    return "\n".join([*lines, f"{done} of {len(bench.parts)} parts are there" if done else ""]).rstrip()


def run_parts(bench, names, command, *, jobs, minutes=None):
    """Make parts, each in a process of its own; the names of those that failed, or need one that did.

    Args:
        bench: the parts.
        names: which, in order; a part waits for those among them that it needs.
        command: that makes the part whose name is added to it.
        jobs: parts at a time.
        minutes: after which none is started; None for no bound.
    """
    started, waiting, running, failed = time.monotonic(), [*names], {}, []
    try:
        while waiting or running:
            in_time = minutes is None or time.monotonic() - started < 60 * minutes
            waiting = waiting if in_time else []
            for name in _ready(bench, waiting, running)[: jobs - len(running)]:
                waiting.remove(name)
                running[name] = _started(bench, name, command)
            time.sleep(WAIT_S)
            for name in [one for one, process in running.items() if process.poll() is not None]:
                if running.pop(name).returncode:
                    say(f"{name} failed: {_log(bench, name)}")
                    failed.append(name)
                    waiting, left_out = _without(bench, waiting, failed)
                    failed += left_out
    finally:
        for process in running.values():
            process.wait()  # Ctrl-C reaches them too: they keep what they have
    return failed


def _ready(bench, waiting, running):
    """Names whose needs are neither under way nor to be made first."""
    open_ones = {*waiting, *running}
    return [name for name in waiting if not open_ones & {*bench.part(name).needs}]


def _without(bench, waiting, failed):
    """Waiting parts, and those of them that need, directly or not, one that failed."""
    kept, left_out = [], []
    for name in waiting:
        bad = {*failed, *left_out} & {*bench.part(name).needs}
        (left_out if bad else kept).append(name)
    return kept, left_out


def _started(bench, name, command):
    say(f"{time.strftime('%H:%M')} {name}, about {bench.part(name).minutes:.0f} min")
    path = _log(bench, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    # Networks so small gain nothing from a second thread; the other core has a part of its own.
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with path.open("a") as log:
        return subprocess.Popen([*command, name], env=environment, stdout=log, stderr=log)


def _log(bench, name):
    return bench.folder / "logs" / f"{name}.log"
