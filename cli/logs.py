"""Lines on stderr and in the log file, and the options that say how many: -v, -q and --log-file."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import click

from .paths import FILE
from .text import one_line

LOG = logging.getLogger("ogmkit")
"""The library's modules log below it."""
LOG.addHandler(logging.NullHandler())  # else Python itself would write errors to stderr

_QUIET = "ogmkit.quiet"


def note(line: str) -> None:
    """Write a line of progress or advice: to stderr, unless -q is given, and to the log file."""
    shown = one_line(line)
    LOG.info(shown)
    if not quiet():
        _write(shown)


def complain(line: str) -> None:
    """Write an error: to stderr, whatever is given, and to the log file."""
    shown = one_line(line)
    LOG.error(shown)
    _write(f"ogmkit: {shown}")


def quiet() -> bool:
    """Whether this call of the command has -q."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_QUIET))


def log_options() -> list[click.Option]:
    """`-v`, `-q` and `--log-file`, which take effect as they are read; the last one counts."""
    return [
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            callback=_verbose,
            help="Also write details to stderr, with timestamps.",
        ),
        click.Option(
            ["-q", "--quiet"],
            is_flag=True,
            expose_value=False,
            callback=_quiet,
            help="Write only errors to stderr: no progress, no notes.",
        ),
        click.Option(
            ["--log-file"],
            type=FILE,
            metavar="FILE",
            expose_value=False,
            callback=_log_file,
            help="Append all log lines to FILE, with timestamps.",
        ),
    ]


class _Terminal(logging.Handler):
    """Writes details to stderr, around a progress bar."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a detail; other levels are written elsewhere."""
        if record.levelno == logging.DEBUG and not quiet():
            _write(self.format(record))


def _write(line: str) -> None:
    bars = sys.modules.get("tqdm")  # imported with the bar only
    if bars is None:
        click.echo(line, err=True)
    else:
        bars.tqdm.write(line, file=sys.stderr)


def _verbose(context: click.Context, parameter: click.Parameter, given: bool) -> None:
    del parameter
    if not given:
        return
    context.meta[_QUIET] = False
    if not any(isinstance(handler, _Terminal) for handler in LOG.handlers):
        form = logging.Formatter("%(asctime)s.%(msecs)03d %(name)s: %(message)s", "%H:%M:%S")
        _attach(context, _Terminal(), form)


def _quiet(context: click.Context, parameter: click.Parameter, given: bool) -> None:
    del parameter
    if given:
        context.meta[_QUIET] = True


def _log_file(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    try:
        handler = logging.FileHandler(path, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise click.BadParameter(f"{path}: can't be written: {error.strerror}", context, parameter) from error
    form = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%S%z")
    _attach(context, handler, form)
    LOG.debug("ogmkit %s", " ".join(sys.argv[1:]))


def _attach(context: click.Context, handler: logging.Handler, form: logging.Formatter) -> None:
    """Have a handler get all log lines until this call of the command ends."""
    handler.setFormatter(form)
    LOG.addHandler(handler)
    LOG.setLevel(logging.DEBUG)
    context.find_root().call_on_close(lambda: _detach(handler))


def _detach(handler: logging.Handler) -> None:
    LOG.removeHandler(handler)
    handler.close()
    if len(LOG.handlers) == 1:
        LOG.setLevel(logging.NOTSET)
