"""Where a recording goes: into a file that is whole or absent, or to a viewer that is started for it."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from ogmkit.base.atomic import replacing
from ogmkit.errors import OutputError

APPLICATION = "ogmkit"
_BLOCK = 1 << 16
_PATIENCE_S = 60.0
"""With a viewer that takes nothing more."""


@contextmanager
def recording_to(save: Path | None, name: str, blueprint: Any) -> Iterator[Any]:  # noqa: ANN401  # Rerun's
    """A stream to log to.

    Args:
        save: the file; None starts a viewer.
        name: of the recording.
        blueprint: how the viewer begins.

    Raises:
        OutputError: the file can't be written, or the viewer can't be started or has no display.
    """
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    if save is None:
        _require_screen()
    stream = rr.RecordingStream(APPLICATION)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    if not stream.is_enabled():
        raise OutputError("Rerun is switched off by the variable RERUN; unset it, then run again")
    if save is None:
        try:
            stream.spawn(default_blueprint=blueprint)
        except (RuntimeError, OSError) as error:
            raise OutputError(
                f"the viewer doesn't start ({error}); write a file with --save FILE.rrd"
            ) from error
        with _named(stream, name):
            yield stream
        return
    with replacing(save) as part, part.open("wb") as file, _piped(file) as pipe:
        stream.save(pipe, default_blueprint=blueprint)
        with _named(stream, name):
            yield stream


def flush(stream: Any) -> None:  # noqa: ANN401  # Rerun's
    """Wait until all that was logged is written, so that no more than that is held in memory.

    Raises:
        OutputError: the viewer no longer takes it.
    """
    try:
        stream.flush(timeout_sec=_PATIENCE_S)
    except (RuntimeError, OSError) as error:
        raise OutputError(f"the recording can't be passed on ({error}); run again") from error


@contextmanager
def _named(stream: Any, name: str) -> Iterator[None]:  # noqa: ANN401  # Rerun's
    """A recording with a name, closed at the end."""
    try:
        stream.send_recording_name(name)
        yield
        flush(stream)
    finally:
        stream.disconnect()


def _require_screen() -> None:
    if sys.platform.startswith("linux") and not {"DISPLAY", "WAYLAND_DISPLAY"} & {
        name for name, value in os.environ.items() if value
    }:
        raise OutputError("there is no screen to show the viewer on; write a file with --save FILE.rrd")


@contextmanager
def _piped(file: BinaryIO) -> Iterator[str]:
    """A name to write to, whose bytes go into a file.

    Where the system refuses to write, Rerun says nothing and waits for ever: so it writes into a pipe.
    """
    reader, writer = os.pipe()
    refused: list[OSError] = []
    copying = threading.Thread(target=_copy, args=(reader, file, refused), daemon=True)
    copying.start()
    try:
        yield f"/dev/fd/{writer}"
    finally:
        os.close(writer)
        copying.join()
    if refused:
        raise refused[0]


def _copy(reader: int, file: BinaryIO, refused: list[OSError]) -> None:
    """Copy until the other end is closed; after a refusal the rest is read all the same."""
    try:
        while block := os.read(reader, _BLOCK):
            if not refused:
                try:
                    file.write(block)
                except OSError as error:
                    refused.append(error)
    finally:
        os.close(reader)
