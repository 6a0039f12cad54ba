"""`ogmkit check`: all rules on all records and files of a dataset, with counts and first examples.

An error is what makes the extraction of some scene fail, whatever the settings; all else is a warning.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ogmkit.errors import TableError
from ogmkit.nuscenes.files import FILE_RULES, file_problems
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.rules import Rule, find_violations
from ogmkit.nuscenes.schema import EDGE_TABLES, TABLES
from ogmkit.nuscenes.splits import SPLITS_FILE, read_split_file, require_present
from ogmkit.nuscenes.tables import Tables, find_version
from ogmkit.nuscenes.uses import prepare

EXAMPLES = 3
"""First examples that a finding holds."""

Severity = Literal["error", "warning"]

_COUNTS = """
SELECT scene IS NOT NULL, count(DISTINCT (source, record, detail)) FROM violation
WHERE rule = ? GROUP BY 1 ORDER BY 1 DESC
"""
_FIRST = """
SELECT source, record, detail, min(s.name) FROM violation v LEFT JOIN scene s ON s.token = v.scene
WHERE v.rule = ? AND (v.scene IS NOT NULL) = ?
GROUP BY source, record, detail ORDER BY min(v.rowid) LIMIT ?
"""


@dataclass(frozen=True)
class Finding:
    """A broken rule.

    Attributes:
        rule: its number, such as R301.
        severity: `error` where a scene can't be extracted for it, else `warning`.
        title: what is wrong.
        remedy: what to do.
        count: in how many records, tables or files.
        examples: the first few, each in one line.
    """

    rule: str
    severity: Severity
    title: str
    remedy: str
    count: int
    examples: tuple[str, ...]


def check_dataset(
    dataset_root: Path, version: str | None = None, *, on_progress: Callable[[int, int], None] | None = None
) -> tuple[Finding, ...]:
    """Apply every rule to a dataset.

    Args:
        dataset_root: holds `v1.0-…/`, `samples/` and `maps/`.
        version: the version folder's name; None where there is only one `v1.0-*`.
        on_progress: called with the number of files looked at and of all.

    Returns:
        The broken rules in order of number, errors before warnings. Where a table that records are made
        from can't be read, only rules on tables are applied.

    Raises:
        TableError: the root or its version folder is absent.
        SettingsError: the version is absent, or several are there and none was asked for.
    """
    folder = dataset_root / find_version(dataset_root, version)
    with Tables(folder, complete=True) as tables:
        findings = list(_load(tables))
        if any(finding.severity == "error" for finding in findings):
            return tuple(findings)
        prepare(tables)
        findings += _scene_findings(tables)
        for rule in find_violations(tables):
            findings += _broken(tables, rule)
        findings += _split_findings(tables, dataset_root)
        findings += _file_findings(tables, dataset_root, on_progress)
    return tuple(findings)


def _load(tables: Tables) -> Iterator[Finding]:
    """Load what can be loaded; a finding for each severity among the tables that can't."""
    problems: dict[Severity, list[str]] = {"error": [], "warning": []}
    for table in TABLES:
        try:
            tables.load(table)
        except TableError as error:
            tables.load_empty(table)
            problems["error" if table in EDGE_TABLES else "warning"].append(str(error))
    for severity, lines in problems.items():
        if lines:
            title, remedy = "table is missing or unreadable", "extract the metadata archive again"
            yield Finding("R101", severity, title, remedy, len(lines), tuple(lines))


def _scene_findings(tables: Tables) -> Iterator[Finding]:
    if not tables.rows("SELECT 1 FROM scene WHERE name IS NOT NULL LIMIT 1"):
        title, remedy = "the dataset has no scene", "extract the metadata archive again"
        yield Finding("R102", "error", title, remedy, 1, ("scene.json: no record has a name",))


def _broken(tables: Tables, rule: Rule) -> Iterator[Finding]:
    for used, count in tables.rows(_COUNTS, [rule.id]):
        examples = tuple(
            one_line(f"{source}.json: record {record}: {detail}" + (f" [{scene}]" if scene else ""))
            for source, record, detail, scene in tables.rows(_FIRST, [rule.id, used, EXAMPLES])
        )
        yield Finding(rule.id, "error" if used else "warning", rule.title, rule.remedy, count, examples)


def _split_findings(tables: Tables, root: Path) -> Iterator[Finding]:
    names = [name for (name,) in tables.rows("SELECT name FROM scene WHERE name IS NOT NULL ORDER BY name")]
    path = root / SPLITS_FILE
    if not path.exists():
        return
    try:
        require_present(path, read_split_file(path), names)
    except TableError as error:
        yield Finding("R606", "warning", "splits.json is unsound", "correct it", 1, (one_line(str(error)),))


def _file_findings(
    tables: Tables, root: Path, on_progress: Callable[[int, int], None] | None
) -> Iterator[Finding]:
    counts: Counter[tuple[str, bool]] = Counter()
    examples: defaultdict[tuple[str, bool], list[str]] = defaultdict(list)
    seen = 0
    ((total,),) = tables.rows("SELECT (SELECT count(*) FROM sample_data) + (SELECT count(*) FROM map)")

    def tick() -> None:
        nonlocal seen
        seen += 1
        if on_progress is not None:
            on_progress(seen, total)

    for rule, fatal, text in file_problems(tables, root, tick):
        counts[rule, fatal] += 1
        if counts[rule, fatal] <= EXAMPLES:
            examples[rule, fatal].append(one_line(text))
    for (rule, fatal), count in sorted(counts.items(), key=lambda item: (item[0][0], not item[0][1])):
        title, remedy = FILE_RULES[rule]
        yield Finding(
            rule, "error" if fatal else "warning", title, remedy, count, tuple(examples[rule, fatal])
        )
