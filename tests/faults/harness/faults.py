"""Faults and kills of a command at chosen operations, and whether it finishes afterwards."""

import errno
import os
import random
import signal
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from harness import outcome
from harness.cases import Bench
from harness.forked import Ended
from harness.scenarios import Scenario
from harness.shim import ANY_CHANGE, COUNT, Fault

_REFUSALS: dict[str, tuple[int, ...]] = {
    "open": (errno.EACCES, errno.EMFILE, errno.EIO),
    "read": (errno.EIO,),
    "write": (errno.ENOSPC, errno.EIO),
    "fsync": (errno.EIO, errno.ENOSPC),
    "rename": (errno.EACCES, errno.ENOSPC, errno.EIO),
    "mkdir": (errno.EACCES, errno.ENOSPC),
    "unlink": (errno.EACCES, errno.EIO),
    "stat": (errno.EACCES, errno.EIO),
    "list": (errno.EACCES, errno.EMFILE),
    "truncate": (errno.ENOSPC, errno.EIO),
}
_LASTING = {"open": errno.EMFILE, "read": errno.EIO, "write": errno.ENOSPC}
"""Faults that may also stay: no descriptors left, a disk that fails, a disk that is full."""
_KEPT_TEXT = 1500


@dataclass
class Tally:
    """Counts of a part.

    Attributes:
        outcomes: how often each.
        bad: cases that came out badly, with what they wrote.
        missed: cases whose operation was not reached.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    bad: list[dict[str, Any]] = field(default_factory=list)
    missed: int = 0

    def add(self, case: str, found: str, ended: Ended, differing: Sequence[str] = ()) -> None:
        """Count a case; of a bad one keep what was said, and which files differ."""
        self.outcomes[found] += 1
        if found in outcome.BAD:
            said = (ended.kept or outcome.complaint(ended) or ended.stdout)[-_KEPT_TEXT:]
            kept = {"case": case, "outcome": found, "code": ended.code, "said": said}
            self.bad.append(kept | ({"differing": list(differing)} if differing else {}))


class Subject:
    """A scenario, what it does undisturbed, and how disturbances of it come out."""

    def __init__(self, bench: Bench, scenario: Scenario) -> None:
        self._bench, self.scenario = bench, scenario
        self._sound_end, self._sound = bench.sound(scenario)
        self.counts = self._sound_end.counts
        bench.fresh(scenario)
        self._before = bench.contents(scenario)
        self.names = outcome.names_of(self._before, self._sound) | scenario.names

    @property
    def seconds(self) -> float:
        """How long it takes, with all modules imported."""
        self._bench.fresh(self.scenario)
        return self._bench.forker.command(self.scenario.arguments).seconds

    def faults(self) -> list[Fault]:
        """Every fault of every operation."""
        return [
            fault
            for kind in _REFUSALS
            for at in range(1, self.counts[kind] + 1)
            for fault in _faults(kind, at)
        ]

    def kills(self) -> list[Fault]:
        """A kill before every change of a file, and half-way through every write."""
        return [
            Fault(ANY_CHANGE, at, action)
            for at in range(1, self.counts[ANY_CHANGE] + 1)
            for action in ("kill", "torn")
        ]

    def disturb(self, fault: Fault, tally: Tally, kill_after_s: float | None = None) -> None:
        """Run with a fault, or a kill after a time, then again without; count what came of it."""
        self._bench.fresh(self.scenario)
        ended = self._bench.forker.command(self.scenario.arguments, fault, kill_after_s)
        if not ended.hit and kill_after_s is None:
            tally.missed += 1
        case, files = f"{self.scenario.name}: {fault}", self._bench.contents(self.scenario)
        found = self._first(
            ended, files, fault, killed=fault.action in ("kill", "torn") or kill_after_s is not None
        )
        if found not in outcome.BAD and files not in (self._before, self._sound):
            ended, case = self._bench.forker.command(self.scenario.arguments, COUNT), f"{case}, then again"
            files = self._bench.contents(self.scenario)
            found = found if ended.code == 0 and files == self._sound else outcome.UNFINISHED
        tally.add(case, found, ended, outcome.differing(files, self._sound))

    def _first(self, ended: Ended, files: dict[str, str], fault: Fault, *, killed: bool) -> str:
        was_killed = killed and ended.signal == signal.SIGKILL
        found = outcome.OK if was_killed else outcome.of_end(ended, self.names)
        if found in outcome.BAD:
            return found
        if outcome.of_files(self._before, files, self._sound) == outcome.LOST:
            return outcome.LOST
        if found == outcome.OK and not was_killed:
            if fault.error and os.strerror(fault.error) in ended.stdout:
                return outcome.NAMED  # the result says what couldn't be read, as `check` does
            return outcome.of_result(ended, files, self._sound_end, self._sound, speaks=self.scenario.speaks)
        return found


def _faults(kind: str, at: int) -> Iterator[Fault]:
    for error in _REFUSALS[kind]:
        yield Fault(kind, at, "fail", error)
    if kind in _LASTING:
        yield Fault(kind, at, "fail on", _LASTING[kind])
    if kind in ("read", "write"):
        yield Fault(kind, at, "short")


def chosen(faults: Sequence[Fault], most: int, seed: str) -> list[Fault]:
    """At most so many of them, evenly drawn; more of them begin with the same ones."""
    return random.Random(seed).sample(faults, len(faults))[:most]
