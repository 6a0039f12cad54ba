"""What the benchmarks share: timing side by side, peak memory of a process, one table a claim."""

import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence


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
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return seconds, usage.ru_maxrss / 1024  # Linux counts KiB


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
