"""What the paths that a report is made of are: shards, RUNs, tables, or the folder of `ogmkit run`."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.files import read_text
from ogmkit.errors import SettingsError
from ogmkit.learn.run_summary import is_run
from ogmkit.shards.manifest import NAME

CHAIN = "ogmkit-run"
"""Format of the manifest that `ogmkit run` writes."""
TABLES = ("perception.json", "planning.json")


@dataclass(frozen=True)
class Sources:
    """What a report is made of.

    Attributes:
        shards: folder of shards; None without.
        runs: folders of trainings.
        tables: files that `ogmkit evaluate --format json` wrote.
    """

    shards: Path | None
    runs: tuple[Path, ...]
    tables: tuple[Path, ...]


def sources_of(paths: Sequence[Path]) -> Sources:
    """Tell paths apart by what lies there.

    Raises:
        SettingsError: one is nothing that a report can show, or there are two folders of shards.
    """
    found = [_source(path) for path in paths]
    shards = [one.shards for one in found if one.shards is not None]
    if len({path.resolve() for path in shards}) > 1:
        raise SettingsError(f"{shards[1]}: a report shows one folder of shards, and {shards[0]} is one")
    return Sources(
        shards[0] if shards else None,
        _once(path for one in found for path in one.runs),
        _once(path for one in found for path in one.tables),
    )


def _source(path: Path) -> Sources:
    if path.is_file() and path.suffix == ".json":
        return Sources(None, (), (path,))
    if (path / NAME).is_file():
        return _of_chain(path) if _format(path / NAME) == CHAIN else Sources(path, (), ())
    if is_run(path):
        return Sources(None, (path,), ())
    raise SettingsError(
        f"{path}: neither shards, a RUN, a folder of `ogmkit run`, nor a table of `evaluate --format json`"
    )


def _of_chain(folder: Path) -> Sources:
    shards, runs = folder / "shards", folder / "runs"
    return Sources(
        shards if (shards / NAME).is_file() else None,
        tuple(sorted(path for path in runs.iterdir() if is_run(path))) if runs.is_dir() else (),
        tuple(path for name in TABLES if (path := folder / "tables" / name).is_file()),
    )


def _format(path: Path) -> str:
    """What a manifest calls itself; empty where it is damaged, which whoever reads it will tell."""
    try:
        content = json.loads(read_text(path))
        return str(content["format"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ""


def _once(paths: Iterable[Path]) -> tuple[Path, ...]:
    return tuple({path.resolve(): path for path in paths}.values())
