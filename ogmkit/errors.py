"""Everything ogmkit raises on purpose; the command line turns these into one line on stderr.

A message names the file, the record and what to do about it.
"""


class OgmkitError(Exception):
    """Root of all errors that ogmkit raises on purpose.

    Args:
        message: one line.
        kind: what is wrong, in words that are the same for all files and records with that fault.
    """

    def __init__(self, message: str, *, kind: str = "") -> None:
        super().__init__(message)
        self.kind = kind


class TableError(OgmkitError):
    """A metadata table is missing, malformed, or contradicts itself or another table."""


class DataFileError(OgmkitError):
    """An image, LiDAR sweep or map mask is absent, unreadable, or lies outside the dataset."""


class FrameFileError(DataFileError):
    """An image or LiDAR sweep that a frame needs is absent, damaged or of another size."""


class SettingsError(OgmkitError, ValueError):
    """A setting or argument is out of range, unknown, or contradicts another."""


class MissingPackageError(OgmkitError, ImportError):
    """A package of one of the extras isn't installed."""


class ShardError(OgmkitError):
    """A shard or manifest is absent, damaged, of another version, or not ogmkit's."""


class UnreadableShardError(ShardError):
    """The system refuses to read a shard, which may be sound: no permission, a disk that fails."""


class OutputError(OgmkitError):
    """Results can't be written: no space, no permission, or the folder holds something else."""


class TrainingError(OgmkitError):
    """A training can't continue: it diverged, or has nothing to learn from."""


class CheckpointError(OgmkitError):
    """A checkpoint or the folder of a run is absent, damaged, of another system, or not ogmkit's."""


MALFORMED = (KeyError, TypeError, ValueError, OverflowError)
"""What making a record of a file's plain values raises where these are wrong; `int(inf)` overflows."""
