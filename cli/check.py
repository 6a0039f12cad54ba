"""`ogmkit check`: a dataset against numbered rules."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ogmkit.base.names import with_number
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

from .command import Command
from .options import (
    dataroot_argument,
    json_option,
    list_option,
    scheduler_option,
    version_option,
    workers_option,
)
from .progress import progress
from .record_options import setting_options
from .text import json_text, lines_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ogmkit.nuscenes.fix import Fixed


@click.command(
    cls=Command,
    examples=(
        "ogmkit check dataroot",
        "ogmkit check dataroot --camera CAM_FRONT,CAM_BACK --lidar --exclude R704 --strict",
    ),
)
@dataroot_argument
@version_option
@setting_options(ExtractSettings, "cameras")
@setting_options(TargetSettings, "images", "lidar", "lidar_channel", "no_map", "categories")
@list_option("--exclude", metavar="RULE,…", help="Rules to leave out, such as R704; repeat or use commas.")
@workers_option
@scheduler_option
@json_option
@click.option("--strict", is_flag=True, help="Fail on warnings too.")
@click.option(
    "--fix",
    metavar="NAME",
    help="First write the tables, with unambiguous faults corrected (links, counts, backslashes, byte-order "
    "marks), to the new folder DATAROOT/NAME; then check that one.",
)
def command(
    dataroot: Path,
    version: str | None,
    cameras: tuple[str, ...],
    images: str,
    lidar: bool,
    lidar_channel: str,
    no_map: bool,
    categories: tuple[str, ...],
    exclude: tuple[str, ...],
    workers: int,
    scheduler: str,
    as_json: bool,
    strict: bool,
    fix: str | None,
) -> None:
    """Check a dataset against numbered rules.

    Checks all tables and all files that they name. Lists each broken rule with its count and the first
    examples. An error is what makes `ogmkit extract` with the same options fail for some scene;
    everything else is a warning. Exit code 1 where there is an error, with --strict also a warning.

    Fields of --json: errors and warnings (how many rules are broken), findings (a list: rule, severity,
    title, remedy, count, examples), fixed (a list: table, column, count).
    """
    from ogmkit.base.execution import Execution
    from ogmkit.nuscenes.check import check_dataset
    from ogmkit.nuscenes.fix import fix_tables
    from ogmkit.nuscenes.uses import Use

    fixed = () if fix is None else fix_tables(dataroot, version, fix)
    if fixed:
        version = fix
    use = Use(cameras, images != "none", lidar_channel if lidar else None, not no_map, categories)
    with progress(None, "files", "check") as advance:
        execution = Execution(workers, scheduler, on_progress=advance)
        findings = check_dataset(dataroot, version, use=use, exclude=exclude, execution=execution)
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = len(findings) - errors
    if as_json:
        shown = {"errors": errors, "warnings": warnings, "findings": findings, "fixed": fixed}
        click.echo(json_text(shown))
    else:
        if fix is not None:
            click.echo(lines_text(_fix_lines(dataroot / fix, fixed)))
        for finding in findings:
            click.echo(f"{finding.rule} {finding.severity}: {finding.title} ({finding.count:,}×)")
            click.echo(lines_text(f"    {line}" for line in (*finding.examples, f"→ {finding.remedy}")))
        click.echo(f"{dataroot}: rules broken: {errors} with errors, {warnings} with warnings")
    if errors or (strict and warnings):
        raise click.exceptions.Exit(1)


def _fix_lines(folder: Path, fixed: Sequence[Fixed]) -> Iterator[str]:
    """What was corrected, a line a column."""
    for one in fixed:
        records = with_number(one.count, "record")
        what = f"{one.column} corrected in {records}" if one.column else "byte-order mark removed"
        yield f"{one.table}.json: {what}"
    if fixed:
        yield f"{folder}: written; use it with --version {folder.name}"
    else:
        yield "nothing to correct; no tables written"
