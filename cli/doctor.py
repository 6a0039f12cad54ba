"""`ogmkit doctor`: what this installation has and lacks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .command import Command
from .options import json_option
from .text import json_text, lines_text, text_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.doctor.report import Report


@click.command(cls=Command, examples=("ogmkit doctor", "ogmkit doctor --json > report.json"))
@json_option
@click.pass_context
def command(context: click.Context, as_json: bool) -> None:
    """Show what this installation has, and what it lacks for what.

    Versions, devices, decoders, disks and the cache, in a form for a report of a bug. Exit code 1 says that
    the core lacks a package, or can't read what it must.

    Fields of --json: ogmkit, machine (python, system, processors, memory_bytes, devices, variables), packages
    (name, installed, asked, extra, sound), decoders (name, library, problem), disks (purpose, folder,
    free_bytes, total_bytes, writable), cache (folder, masks, bytes, problem), lacks (extra, packages, uses,
    remedy).
    """
    from ogmkit.doctor.report import examine

    report = examine()
    click.echo(json_text(report) if as_json else lines_text(_lines(report)))
    if not report.sound:
        context.exit(1)


def _lines(report: Report) -> Iterator[str]:
    machine = report.machine
    memory = "unknown" if machine.memory_bytes is None else _gib(machine.memory_bytes)
    yield f"ogmkit {report.ogmkit}, Python {machine.python}"
    yield f"{machine.system}; processors: {machine.processors}; memory: {memory}"
    yield f"devices: {'; '.join(machine.devices) or 'none without torch'}"
    yield f"variables: {' '.join(machine.variables) or 'none'}"
    yield ""
    packages = [
        (one.name, one.installed or "absent", one.asked, one.extra or "core", "" if one.sound else "missing")
        for one in report.packages
    ]
    yield from text_table(("package", "installed", "asked", "for", ""), packages).splitlines()
    yield ""
    decoders = [(one.name, one.library, one.problem or "works") for one in report.decoders]
    yield from text_table(("reads", "by", ""), decoders).splitlines()
    yield ""
    disks = [
        (one.purpose, one.folder, _gib(one.free_bytes), "" if one.writable else "can't be written")
        for one in report.disks
    ]
    yield from text_table(("disk", "folder", "free", ""), disks).splitlines()
    cache = report.cache
    yield f"cache: {cache.problem or f'{cache.folder}, {cache.masks} decoded map masks, {_gib(cache.bytes)}'}"
    yield ""
    yield from (f"lacks {', '.join(one.packages)}: for {one.uses}; {one.remedy}" for one in report.lacks)
    if not report.lacks:
        yield "lacks nothing"


def _gib(size: int) -> str:
    return f"{size / 2**30:.1f} GiB"
