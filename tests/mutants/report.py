"""What came of the mutants: a JSON file that grows as they are tried, and a table of it."""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from listing import MODULES, ROOT, Mutant, source_of, tests_of

EQUAL = Path(__file__).with_name("equal.json")
"""Mutants that no test can tell from the original, with the reason."""


class Outcomes:
    """The outcomes of mutants in a JSON file; those of a changed module, or changed tests, are dropped."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._fingerprints = {module: _fingerprint(module) for module in MODULES}
        self._modules: dict[str, Any] = {}
        if path.exists():
            known = json.loads(path.read_text(encoding="utf-8"))["modules"]
            self._modules = {
                module: entry
                for module, entry in known.items()
                if entry["fingerprint"] == self._fingerprints.get(module)
            }

    def of(self, mutant: Mutant) -> str | None:
        """A mutant's outcome, where it was tried."""
        outcome: str | None = self._modules.get(mutant.module, {}).get("outcomes", {}).get(mutant.name)
        return outcome

    def add(self, mutant: Mutant, outcome: str) -> None:
        """Keep an outcome."""
        new = {"fingerprint": self._fingerprints[mutant.module], "outcomes": {}}
        entry = self._modules.setdefault(mutant.module, new)
        entry["outcomes"][mutant.name] = outcome
        self._write()

    def close(self, shares: dict[str, "Share"]) -> None:
        """Say of each module what was counted, and which mutants survived."""
        for module, share in shares.items():
            self._modules[module] |= share.to_dict()
        self._write()

    def _write(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        part = self._path.with_suffix(".part")
        text = json.dumps({"modules": dict(sorted(self._modules.items()))}, indent=1, ensure_ascii=False)
        part.write_text(text + "\n", encoding="utf-8")
        os.replace(part, self._path)


@dataclass(frozen=True)
class Share:
    """What became of a module's mutants; a sum of these is what became of all."""

    killed: int = 0
    timed_out: int = 0
    equal: int = 0
    survivors: tuple[dict[str, Any], ...] = ()

    @classmethod
    def of(cls, mutants: list[Mutant], source: str, outcomes: Outcomes) -> "Share":
        """Count mutants of one module that were tried; `source` is the module's."""
        counts = {"killed": 0, "timed_out": 0, "survived": 0, "equal": 0}
        survivors = []
        for mutant in mutants:
            outcome, after = str(outcomes.of(mutant)), mutant.after(source)
            if outcome == "survived" and (mutant.before, after) in equal_ones(mutant.module):
                outcome = "equal"
            counts[outcome] += 1
            if outcome == "survived":
                survivors.append(
                    {"line": mutant.line, "mutant": mutant.name, "before": mutant.before, "after": after}
                )
        return cls(counts["killed"], counts["timed_out"], counts["equal"], tuple(survivors))

    def __add__(self, other: "Share") -> "Share":
        return Share(
            self.killed + other.killed,
            self.timed_out + other.timed_out,
            self.equal + other.equal,
            self.survivors + other.survivors,
        )

    @property
    def score(self) -> float:
        """Share noticed among those that can be: an endless loop is noticed, too."""
        noticed = self.killed + self.timed_out
        return noticed / max(1, noticed + len(self.survivors))

    def to_dict(self) -> dict[str, Any]:
        """As it is written."""
        return {
            "killed": self.killed,
            "timed_out": self.timed_out,
            "equal": self.equal,
            "survived": len(self.survivors),
            "survivors": list(self.survivors),
        }


def equal_ones(module: str) -> set[tuple[str, str]]:
    """A module's equal mutants, each by its line before and after."""
    entries = json.loads(EQUAL.read_text(encoding="utf-8"))
    return {
        (entry["line"], after) for entry in entries if entry["module"] == module for after in entry["becomes"]
    }


def table(shares: dict[str, Share], possible: int) -> str:
    """Survivors, a line each, then a line for each module, and the score."""
    lines = []
    for module, share in shares.items():
        for survivor in share.survivors:
            lines += [f"{source_of(module)}:{survivor['line']} {survivor['mutant']} survived"]
            lines += [f"  - {survivor['before']}", f"  + {survivor['after']}"]
    form = "{:<24} {:>6} {:>9} {:>8} {:>5} {:>6}"
    lines += ["", form.format("module", "killed", "timed out", "survived", "equal", "score")]
    total = sum(shares.values(), Share())
    for name, share in [*shares.items(), ("all", total)]:
        counts = share.killed, share.timed_out, len(share.survivors), share.equal, f"{share.score:.0%}"
        lines.append(form.format(name, *counts))
    tried = total.killed + total.timed_out + total.equal + len(total.survivors)
    return "\n".join(
        [*lines, "", f"{total.score:.1%} of {tried} of {possible} mutants, without the equal ones"]
    )


def _fingerprint(module: str) -> str:
    """Of what a module's outcomes depend on first: itself and its own tests."""
    paths = ROOT / source_of(module), ROOT / tests_of(module)
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in paths)).hexdigest()
