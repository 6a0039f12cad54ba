"""`ogmkit check`: a dataset against numbered rules."""

from pathlib import Path

import click

from .command import Command
from .options import dataroot_argument, json_option, version_option
from .progress import progress
from .text import json_text, lines_text


@click.command(
    cls=Command,
    examples=(
        "ogmkit check dataroot",
        "ogmkit check dataroot --version v1.0-mini --strict",
    ),
)
@dataroot_argument
@version_option
@json_option
@click.option("--strict", is_flag=True, help="Fail on warnings too.")
def command(dataroot: Path, version: str | None, as_json: bool, strict: bool) -> None:
    """Check a dataset against numbered rules.

    Checks all tables and all files that they name. Lists each broken rule with its count and the first
    examples. An error is what makes the extraction of some scene fail whatever the settings;
    everything else is a warning. Exit code 1 where there is an error, with --strict also a warning.

    Fields of --json: errors and warnings (how many rules are broken), findings (a list: rule, severity,
    title, remedy, count, examples).
    """
    from ogmkit.nuscenes.check import check_dataset

    with progress(None, "files", "check") as advance:
        findings = check_dataset(dataroot, version, on_progress=advance)
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = len(findings) - errors
    if as_json:
        click.echo(json_text({"errors": errors, "warnings": warnings, "findings": findings}))
    else:
        for finding in findings:
            click.echo(f"{finding.rule} {finding.severity}: {finding.title} ({finding.count:,}×)")
            click.echo(lines_text(f"    {line}" for line in (*finding.examples, f"→ {finding.remedy}")))
        click.echo(f"{dataroot}: rules broken: {errors} with errors, {warnings} with warnings")
    if errors or (strict and warnings):
        raise click.exceptions.Exit(1)
