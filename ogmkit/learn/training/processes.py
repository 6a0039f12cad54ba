"""The processes of one training, one a device: Lightning starts the further ones by the same command."""

from collections.abc import Iterator
from contextlib import contextmanager

from lightning.pytorch.utilities import rank_zero_only
from torch import distributed

from ogmkit.errors import TrainingError


class LostProcessError(TrainingError):
    """Another process of this training has ended, and it is that one that says why."""


def helps() -> bool:
    """Whether this process helps another that trains: it writes no results and tells nothing."""
    return bool(getattr(rank_zero_only, "rank", 0))


@contextmanager
def connected() -> Iterator[None]:
    """Inside, the error of a lost connection to another process is a line.

    Raises:
        LostProcessError: the connection is lost.
    """
    try:
        yield
    except RuntimeError as error:
        # Of gloo's errors, torch gives some no class of their own.
        if not (isinstance(error, distributed.DistError) or "/gloo/" in str(error)):
            raise
        raise LostProcessError(
            "another process of this training has ended; what it said above is the reason, or it was killed, "
            "perhaps for lack of memory; run the same command to resume"
        ) from error
