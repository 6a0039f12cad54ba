"""Tables of counts: of each part, as `make harden` prints them, and sums, as docs/reliability.md has them."""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from harness.outcome import OUTCOMES
from harness.parts import all_parts, read_counts

_TITLES = {"faults": "faults", "kills": "kills", "inputs": "broken inputs", "options": "odd options"}


def details(folder: Path) -> str:
    """A row for each part that was begun, then the sums."""
    return "\n".join((*_header(), *_details(folder), *_sums(folder)))


def sums(folder: Path) -> str:
    """A row for each group of parts."""
    return "\n".join((*_header(), *_sums(folder)))


def _header() -> tuple[str, str]:
    columns = ("", "tried", "of", *OUTCOMES)
    return "| " + " | ".join(columns) + " |", "| --- |" + " --: |" * (len(columns) - 1)


def _details(folder: Path) -> Iterator[str]:
    for part in all_parts():
        counts = read_counts(folder, part)
        if counts:
            title = f"{_TITLES[part.group]}: {part.name}"
            yield _line(title, counts["done"], counts["cases"], counts["outcomes"])


def _sums(folder: Path) -> Iterator[str]:
    for group, title in _TITLES.items():
        found: Counter[str] = Counter()
        for part in all_parts():
            if part.group == group:
                counts = read_counts(folder, part)
                found.update(counts.get("outcomes", {}))
                found.update(tried=counts.get("done", 0), of=counts.get("cases", part.most))
        yield _line(f"{title}, all", found["tried"], found["of"], found)


def _line(title: str, tried: int, of: int, outcomes: Mapping[str, int]) -> str:
    counts = (tried, of, *(outcomes.get(name, 0) for name in OUTCOMES))
    return f"| {title} | " + " | ".join(f"{count:,}" for count in counts) + " |"
