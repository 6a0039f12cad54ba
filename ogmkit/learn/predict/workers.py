"""Networks in worker processes: opened once in each, and where they are, in words."""

from functools import lru_cache
from pathlib import Path

from ogmkit.base.execution import Execution
from ogmkit.learn.devices import device_name
from ogmkit.learn.predict.run import Run, open_run


@lru_cache(maxsize=1)
def opened_once(checkpoint: Path, sha256: str) -> Run:
    """The run of a checkpoint, loaded once a process however many scenes it predicts.

    Args:
        checkpoint: the file.
        sha256: its checksum, which tells files of the same name apart.

    Raises:
        CheckpointError: as `open_run`.
    """
    del sha256
    return open_run(checkpoint)


def place_name(execution: Execution) -> str:
    """Where networks work, in words; of other machines, their devices aren't known here."""
    if execution.beside:
        return f"on {device_name()}, {execution.place}"
    return execution.place if execution.scheduler else f"on {device_name()}"
