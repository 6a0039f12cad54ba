"""Time and memory of a command with all its processes."""

import os
import subprocess
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

EVERY_S = 0.25
MIB_KIB = 1024


@dataclass(frozen=True)
class Cost:
    """What a command cost.

    Attributes:
        wall_s: from its start to its end.
        cpu_s: of all its processes.
        own_mib: the greatest sum, over processes at one moment, of memory that is no file's (PSS).
        mapped_mib: the same of mapped files, such as decoded masks, which the system may drop at any time.
    """

    wall_s: float
    cpu_s: float
    own_mib: float
    mapped_mib: float

    def told(self):
        """Rounded, as plain values."""
        return {name: round(value, 2) for name, value in asdict(self).items()}


def cost_of(*commands: Sequence[object]) -> Cost:
    """Run commands side by side, sampling the memory of all their processes.

    Raises:
        subprocess.CalledProcessError: one failed.
    """
    started, before = time.perf_counter(), os.times()
    running = [subprocess.Popen([*map(str, one)], stdout=subprocess.DEVNULL) for one in commands]
    own, mapped = 0, 0
    while any(one.poll() is None for one in running):
        both = [_pss_kib(pid) for one in running for pid in _tree(one.pid)]
        own = max(own, sum(one for one, _ in both))
        mapped = max(mapped, sum(one for _, one in both))
        time.sleep(EVERY_S)
    wall_s = time.perf_counter() - started
    for one in running:
        if one.returncode:
            raise subprocess.CalledProcessError(one.returncode, one.args)
    after = os.times()
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(wall_s, cpu_s, own / MIB_KIB, mapped / MIB_KIB)


def _tree(pid):
    """A process and those below it."""
    yield pid
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                yield from _tree(int(child))
    except OSError:
        return  # it has ended meanwhile


def _pss_kib(pid):
    """(own, mapped) of a process that may have ended."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0, 0
    found = {line.split(":")[0]: int(line.split()[1]) for line in lines if line.startswith("Pss")}
    return found.get("Pss", 0) - found.get("Pss_File", 0), found.get("Pss_File", 0)
