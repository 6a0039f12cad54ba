"""What the benchmarks share: timing side by side, peak memory of a process, one table a claim."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence

_LAUNCH = """
import json, os, subprocess, sys, time
start = time.perf_counter()
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
print(json.dumps([time.perf_counter() - start, usage.ru_maxrss, os.waitstatus_to_exitcode(status)]))
"""
"""A small process starts the measured one: Linux counts into a peak what the parent had at the fork."""


def side_by_side(functions: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Least seconds of each function; they take turns, since what else the machine does only adds."""
    for function in functions.values():
        function()  # warm: caches filled, modules imported
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(repeats):
        for name, function in functions.items():
            start = time.perf_counter()
            function()
            times[name].append(time.perf_counter() - start)
    return {name: min(values) for name, values in times.items()}


def run_process(command: Sequence[str]) -> tuple[float, float]:
    """Seconds and peak MiB of a process of its own (not its children's).

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    launched = subprocess.run(
        [sys.executable, "-S", "-c", _LAUNCH, *command], stdout=subprocess.PIPE, check=True
    )
    seconds, peak_kib, code = json.loads(launched.stdout)
    if code:
        raise subprocess.CalledProcessError(code, command)
    return seconds, peak_kib / 1024


def show(claim: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print one claim's table."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    print(f"\n{claim}")
    for row in (header, *rows):
        first, *others = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print(
            "  "
            + "  ".join(
                [first, *(cell.strip().rjust(width) for cell, width in zip(others, widths[1:], strict=True))]
            )
        )
