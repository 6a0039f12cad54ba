"""`ogmkit check`: all rules on all records and files of a dataset, with counts and first examples.

An error is what makes the extraction of some scene fail for the use in question; all else is a warning.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Literal

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution
from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.array_file import MISSING
from ogmkit.nuscenes.categories import require_known
from ogmkit.nuscenes.files import EXAMPLES, FILE_RULES, file_problems
from ogmkit.nuscenes.found import with_found
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.plausible import implausible
from ogmkit.nuscenes.rule_list import OTHER_RULES, all_rules
from ogmkit.nuscenes.rules import CONCERNS, Rule, find_violations
from ogmkit.nuscenes.schema import EDGE_TABLES, TABLES
from ogmkit.nuscenes.splits import SPLITS_FILE, read_split_file, require_present
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import Use, prepare
from ogmkit.nuscenes.versions import find_version

Severity = Literal["error", "warning"]
_USE = Use()

_FATAL = f"(scene IS NOT NULL AND {CONCERNS})"
# A record that is used in several ways counts once, for the worst.
_COUNTS = f"""
SELECT fatal, count(*) FROM (
    SELECT bool_or({_FATAL}) AS fatal FROM violation WHERE rule = $rule GROUP BY source, record, detail
) GROUP BY 1 ORDER BY 1 DESC
"""
_FIRST = f"""
SELECT source, record, detail, name FROM (
    SELECT source, record, detail, min(s.name) AS name, min(v.rowid) AS first, bool_or({_FATAL}) AS fatal
    FROM violation v LEFT JOIN scene s ON s.token = v.scene WHERE v.rule = $rule
    GROUP BY source, record, detail
) WHERE fatal = $fatal ORDER BY first LIMIT $examples
"""
_LACKING = """
SELECT s.name, u.channel FROM scene s CROSS JOIN (SELECT unnest($channels) AS channel) u
ANTI JOIN key_frame k ON k.scene = s.token AND k.channel = u.channel
WHERE s.name IS NOT NULL ORDER BY ALL
"""


@dataclass(frozen=True)
class Finding:
    """A broken rule.

    Attributes:
        rule: its number, such as R301.
        severity: `error` where a scene can't be extracted for it in the use in question, else `warning`.
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
    dataset_root: Path,
    version: str | None = None,
    *,
    use: Use = _USE,
    exclude: Sequence[str] = (),
    execution: Execution = DEFAULT_EXECUTION,
) -> tuple[Finding, ...]:
    """Apply every rule to a dataset.

    Args:
        dataset_root: holds `v1.0-…/`, `samples/` and `maps/`.
        version: the version folder's name; None where there is only one `v1.0-*`.
        use: what the dataset is to be used for; what `extract` makes by default.
        exclude: numbers of rules whose findings are left out.
        execution: where the files are looked at; progress counts them.

    Returns:
        The broken rules in order of number, errors before warnings. Where a table that records are made
        from can't be read, only rules on tables are applied.

    Raises:
        TableError: the root or its version folder is absent.
        SettingsError: the version is absent, or several are there and none was asked for; a rule is
            unknown.
        OgmkitError: a worker process died, or the scheduler is gone.
    """
    known = tuple(all_rules())
    for rule in exclude:
        if rule not in known:
            raise SettingsError(unknown("rule", rule, known))
    found = _findings(dataset_root, version, use, execution)
    return tuple(finding for finding in found if finding.rule not in exclude)


def _findings(dataset_root: Path, version: str | None, use: Use, execution: Execution) -> tuple[Finding, ...]:
    folder = dataset_root / find_version(dataset_root, version)
    with Tables(folder, complete=True) as tables:
        findings = list(_load(tables, use))
        if any(finding.severity == "error" for finding in findings):
            return tuple(findings)
        prepare(tables)
        findings += _scene_findings(tables)
        for rule in find_violations(tables):
            findings += _broken(tables, rule, use)
        findings += _lacking_findings(tables, use)
        findings += _split_findings(tables, dataset_root)
        findings += _file_findings(tables, dataset_root, use, execution)
        findings += _whole_findings(tables, dataset_root, use)
    return tuple(sorted(findings, key=lambda finding: finding.rule))


def _load(tables: Tables, use: Use) -> Iterator[Finding]:
    """Load what can be loaded; a finding for each severity among the tables that can't."""
    problems: dict[Severity, list[str]] = {"error": [], "warning": []}
    for table in TABLES:
        try:
            tables.load(table)
        except TableError as error:
            tables.load_empty(table)
            unless = {"map": use.maps, "visibility": error.kind != MISSING}
            needed = unless.get(table, table in EDGE_TABLES)
            problems["error" if needed else "warning"].append(str(error))
    for severity, lines in problems.items():
        if lines:
            yield _other("R101", severity, len(lines), *lines)


def _other(rule: str, severity: Severity, count: int, *examples: str) -> Finding:
    title, remedy = OTHER_RULES[rule]
    return Finding(rule, severity, title, remedy, count, examples)


def _scene_findings(tables: Tables) -> Iterator[Finding]:
    if not tables.rows("SELECT 1 FROM scene WHERE name IS NOT NULL LIMIT 1"):
        yield _other("R102", "error", 1, "scene.json: no record has a name")


def _broken(tables: Tables, rule: Rule, use: Use) -> Iterator[Finding]:
    values = {"rule": rule.id, "channels": list(use.channels), "maps": use.maps}
    for fatal, count in tables.rows(_COUNTS, values):
        examples = tuple(
            _example(tables, rule, *row)
            for row in tables.rows(_FIRST, values | {"fatal": fatal, "examples": EXAMPLES})
        )
        yield Finding(rule.id, "error" if fatal else "warning", rule.title, rule.remedy, count, examples)


def _example(tables: Tables, rule: Rule, source: str, record: str, detail: str, scene: str | None) -> str:
    detail = with_found(tables, rule.id, source, record, detail)
    return one_line(f"{source}.json: record {record}: {detail}" + (f" [{scene}]" if scene else ""))


def _lacking_findings(tables: Tables, use: Use) -> Iterator[Finding]:
    """Scenes without a single key frame of a camera or LiDAR that is used."""
    lacking = tables.rows(_LACKING, {"channels": list(use.channels)})
    if lacking:
        known = tables.rows("SELECT DISTINCT channel FROM key_frame WHERE channel IS NOT NULL ORDER BY 1")
        there = ", ".join(name for (name,) in known) or "none"
        lines = (f"{scene}: no key frame of {channel}; there are: {there}" for scene, channel in lacking)
        yield _other("R404", "error", len(lacking), *map(one_line, islice(lines, EXAMPLES)))


def _whole_findings(tables: Tables, root: Path, use: Use) -> Iterator[Finding]:
    """What only the dataset as a whole tells."""
    for figure, text in implausible(tables):
        yield Finding(figure.id, "warning", figure.title, figure.remedy, 1, (text,))
    names = tables.rows("SELECT name FROM category WHERE name IS NOT NULL ORDER BY name")
    try:
        require_known(use.categories, [name for (name,) in names], root)
    except SettingsError as error:
        yield _other("R807", "error", 1, one_line(str(error)))


def _split_findings(tables: Tables, root: Path) -> Iterator[Finding]:
    names = [name for (name,) in tables.rows("SELECT name FROM scene WHERE name IS NOT NULL ORDER BY name")]
    path = root / SPLITS_FILE
    if not path.exists():
        return
    try:
        require_present(path, read_split_file(path), names)
    except TableError as error:
        yield _other("R606", "warning", 1, one_line(str(error)))


def _file_findings(tables: Tables, root: Path, use: Use, execution: Execution) -> Iterator[Finding]:
    seen = 0
    ((total,),) = tables.rows("SELECT (SELECT count(*) FROM sample_data) + (SELECT count(*) FROM map)")

    def tick(files: int) -> None:
        nonlocal seen
        seen += files
        execution.report(seen, total)

    problems = file_problems(tables, root, use, execution, tick)
    for (rule, fatal), found in sorted(problems.items(), key=lambda item: (item[0][0], not item[0][1])):
        title, remedy = FILE_RULES[rule]
        examples = tuple(map(one_line, found.examples))
        yield Finding(rule, "error" if fatal else "warning", title, remedy, found.count, examples)
