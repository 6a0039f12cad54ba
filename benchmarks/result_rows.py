"""What tables of the benchmarks in parts share."""

import re

NOT_RUN = "not run yet"
SEED = re.compile(r"-(\d+)$")
"""At the end of a name."""


def row(*cells):
    return f"| {' | '.join(cells)} |"


def sorted_rows(names):
    """Names with the seeds of a system beside each other; systems in the order that they first come in."""
    names = [*names]
    systems = [system_of(name) for name in names]
    return sorted(names, key=lambda name: systems.index(system_of(name)))


def system_of(name):
    """A part's name without its seed."""
    return SEED.sub("", name)


def state(bench, command):
    """How much is there, of which code, and how long it took."""
    records = [record for part in bench.parts if (record := bench.record(part.name)) is not None]
    if not records:
        return f"Not run yet: `{command} --plan` says what there is to run."
    hours = sum(record["wall_s"] for record in records) / 3600
    commits = sorted({record["commit"][:10] or "unknown" for record in records})
    most = max(records, key=lambda record: record["wall_s"])
    return (
        f"{len(records)} of {len(bench.parts)} parts are there: {hours:.1f} hours of a core, the longest "
        f"{most['part']} with {most['wall_s'] / 60:.0f} min; commits {', '.join(commits)}."
    )
