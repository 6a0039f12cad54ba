"""The table of counts, as `make harden` prints it and docs/reliability.md shows it."""

from collections import Counter
from pathlib import Path

from harness.outcome import OUTCOMES
from harness.parts import rows

_TITLES = {
    "faults": "faults",
    "kills": "kills",
    "inputs": "broken inputs",
    "options": "odd options",
}


def markdown(folder: Path) -> str:
    """A row for each part of the work that was begun, and a sum for each group."""
    header = ("", "tried", "of", *OUTCOMES)
    lines = ["| " + " | ".join(header) + " |", "| --- |" + " --: |" * (len(header) - 1)]
    for group, title in _TITLES.items():
        sums: Counter[str] = Counter()
        for part, counts in rows(folder):
            if part.group == group:
                sums.update(counts.get("outcomes", {}))
                sums.update(tried=counts.get("done", 0), of=counts.get("cases", part.most))
                if counts:
                    lines.append(
                        _line(f"{title}: {part.name}", counts["done"], counts["cases"], counts["outcomes"])
                    )
        lines.append(_line(f"**{title}, all**", sums["tried"], sums["of"], sums))
    return "\n".join(lines)


def _line(title: str, tried: int, of: int, outcomes: dict[str, int] | Counter[str]) -> str:
    return (
        f"| {title} | {tried} | {of} | " + " | ".join(str(outcomes.get(name, 0)) for name in OUTCOMES) + " |"
    )
