"""The whole work in parts that can be cut short: each keeps its counts in a file and goes on from there."""

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from harness.broken import BROKEN
from harness.cases import Bench
from harness.faults import Subject, Tally, chosen
from harness.fuzz import Fuzz
from harness.scenarios import SCENARIOS, Pace, Scenario
from harness.shim import COUNT

Case = Callable[[Tally], None]
SEED = "0"
_SLICE_S = 20.0
"""How long a part is worked on before the next has its turn."""


@dataclass(frozen=True)
class Part:
    """Some of the work.

    Attributes:
        group: faults, kills, inputs or options.
        name: of the scenario or the kind of input.
        most: number of cases that are chosen, where there are more.
        slow: whether it is left out of short samples.
    """

    group: str
    name: str
    most: int
    slow: bool = False

    @property
    def needs_torch(self) -> bool:
        """Whether one of its commands does."""
        names = BROKEN[self.name].readers if self.group == "inputs" else (self.name,)
        return any(SCENARIOS[name].needs_torch for name in names)

    @property
    def file(self) -> str:
        """The name of its JSON file."""
        return f"{self.group}-{self.name}".replace(" ", "-").replace("'", "") + ".json"


_MOST: Mapping[str, Mapping[Pace, int]] = {
    "faults": {"quick": 1000, "steady": 260, "slow": 30},
    "kills": {"quick": 20, "steady": 20, "slow": 8},
    "options": {"quick": 400, "steady": 220, "slow": 40},
}


def all_parts() -> list[Part]:
    """Every part, in the order of the tables; sums to the numbers that docs/reliability.md promises."""
    faults, kills, options = (
        [Part(group, one.name, most[one.pace], one.pace == "slow") for one in SCENARIOS.values()]
        for group, most in _MOST.items()
    )
    inputs = [Part("inputs", one.name, one.cases, one.slow) for one in BROKEN.values()]
    return faults + kills + inputs + options


class Worker:
    """Works through parts in one process."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._fuzz = Fuzz(bench)
        self._subjects: dict[str, Subject] = {}

    def cases(self, part: Part, seed: str = SEED) -> list[Case]:
        """The part's cases, in an order that the seed gives."""
        if part.group == "inputs":
            kind = BROKEN[part.name]
            return [_bound(self._fuzz.broken, kind, f"{seed}/{part.name}/{n}") for n in range(part.most)]
        if part.group == "options":
            return [
                _bound(self._fuzz.options, part.name, f"{seed}/{part.name}/{n}") for n in range(part.most)
            ]
        subject = self._subject(SCENARIOS[part.name])
        if part.group == "faults":
            found = subject.faults()
            return [_bound(subject.disturb, fault) for fault in chosen(found, part.most, seed)]
        random = Random(seed)
        if not subject.kills():
            return []  # it changes nothing
        at_operations = [_bound(subject.disturb, fault) for fault in chosen(subject.kills(), part.most, seed)]
        moments = [random.random() for _ in range(part.most // 4)]
        return at_operations + [_timed(subject, moment) for moment in moments]

    def run(self, part: Part, folder: Path, until: float) -> None:
        """Go on with a part until it is done or the time (`time.monotonic`) is up; keep its counts."""
        if is_done(folder, part):
            return
        before = read_counts(folder, part)
        cases = self.cases(part)
        tally = Tally(Counter(before.get("outcomes", {})), before.get("bad", []), before.get("missed", 0))
        done, start = before.get("done", 0), time.monotonic()
        until = min(until, start + _SLICE_S)
        for case in cases[done:]:
            if time.monotonic() > until:
                break
            case(tally)
            done += 1
        seconds = round(before.get("seconds", 0) + time.monotonic() - start, 1)
        counts = {
            "group": part.group,
            "name": part.name,
            "cases": max(len(cases), done),  # a part may have been larger once
            "most": part.most,
            "done": done,
            "seconds": seconds,
        }
        counts |= {"outcomes": dict(tally.outcomes), "missed": tally.missed, "bad": tally.bad}
        (folder / part.file).write_text(json.dumps(counts, indent=1, sort_keys=True) + "\n")

    def _subject(self, scenario: Scenario) -> Subject:
        if scenario.name not in self._subjects:
            self._subjects[scenario.name] = Subject(self._bench, scenario)
        return self._subjects[scenario.name]


def read_counts(folder: Path, part: Part) -> dict[str, Any]:
    """What is there of a part; empty where nothing is."""
    with suppress(FileNotFoundError):
        counts: dict[str, Any] = json.loads((folder / part.file).read_text())
        return counts
    return {}


def is_done(folder: Path, part: Part) -> bool:
    """Whether all its cases were tried."""
    counts = read_counts(folder, part)
    return bool(counts) and counts["done"] >= counts["cases"] and counts["most"] >= part.most


def _bound(function: Callable[..., None], *values: object) -> Case:
    return lambda tally: function(*values, tally)


def _timed(subject: Subject, moment: float) -> Case:
    """A kill at a moment, 0 … 1 of the time that the command takes."""
    return lambda tally: subject.disturb(COUNT, tally, moment * subject.seconds)
