"""Checkpoints: what they carry besides weights, and reading them without trusting them."""

import dataclasses
import pickle
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self, cast

import torch
from lightning.fabric.plugins.io.torch_io import TorchCheckpointIO

from ogmkit import __version__
from ogmkit.base.atomic import replacing
from ogmkit.base.steps import STEP_S
from ogmkit.errors import MALFORMED, CheckpointError, OgmkitError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.adaptation import Adaptation
from ogmkit.learn.catalogue import settings_from_dict
from ogmkit.learn.checksums import add_checksum, require_checksum
from ogmkit.learn.models.weights import are_weights
from ogmkit.learn.own_copies import own_copies
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System
from ogmkit.learn.systems.registry import build_system

_Path = str | Path

KEY = "ogmkit"
"""Of our own part of a checkpoint, which is Lightning's otherwise."""
FORMAT_VERSION = 4

_FOREIGN = (
    pickle.UnpicklingError,
    RuntimeError,
    ValueError,
    EOFError,
    LookupError,
    TypeError,
    AttributeError,
)
"""What torch raises on files that others made."""

AGAIN = "train again, or choose another checkpoint"


@dataclass(frozen=True)
class Card:
    """What a checkpoint says of itself.

    Attributes:
        settings: of the training.
        grid: of the shards it was trained on.
        cameras: channels, in the order that the system numbers them.
        step_s: of these shards.
        epoch: the current one, from 0.
        batches: batches of it that are done.
        package_version: ogmkit's that wrote it.
        adapted: to which images, after the training; None for a checkpoint as it was trained.
    """

    settings: TrainSettings
    grid: GridSpec
    cameras: tuple[str, ...]
    step_s: float = STEP_S
    epoch: int = 0
    batches: int = 0
    package_version: str = __version__
    adapted: Adaptation | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as `torch.load(weights_only=True)` takes them."""
        values = {
            "format_version": FORMAT_VERSION,
            "settings": self.settings.to_dict(),
            "grid": dataclasses.asdict(self.grid),
            "cameras": list(self.cameras),
            "step_s": self.step_s,
            "epoch": self.epoch,
            "batches": self.batches,
            "package_version": self.package_version,
        }
        if self.adapted is None:
            return values
        return values | {"adapted": self.adapted.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`.

        Raises:
            SettingsError: settings or grid are out of range.
            MALFORMED: something is missing or of another kind.
        """
        return cls(
            settings=settings_from_dict(values["settings"]),
            grid=GridSpec(**values["grid"]),
            cameras=tuple(str(camera) for camera in values["cameras"]),
            step_s=float(values["step_s"]),
            epoch=int(values["epoch"]),
            batches=int(values["batches"]),
            package_version=str(values["package_version"]),
            adapted=Adaptation.from_dict(values["adapted"]) if "adapted" in values else None,
        )


class AtomicCheckpointIO(TorchCheckpointIO):
    """Lightning's reading and writing of checkpoints: whole or not at all, and weights only."""

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: _Path, storage_options: object = None
    ) -> None:
        """Write as `write_checkpoint`."""
        del storage_options
        write_checkpoint(Path(path), checkpoint)

    def load_checkpoint(
        self, path: _Path, map_location: object = None, weights_only: bool | None = None
    ) -> dict[str, Any]:
        """Read tensors and plain values.

        Raises:
            CheckpointError: as `read_checkpoint`.
        """
        del weights_only, map_location
        return read_checkpoint(Path(path))[1]


class _Remembering:
    """A file to write to; torch turns what the system raises there into errors of its own.

    Attributes:
        error: what the system raised first.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.error: OSError | None = None

    def write(self, data: bytes) -> int:
        try:
            return self._file.write(data)
        except OSError as error:
            self.error = self.error or error
            raise

    def flush(self) -> None:
        self._file.flush()


def write_checkpoint(path: Path, content: Mapping[str, Any]) -> None:
    """Write a checkpoint with its checksum, whole or not at all; equal content gives equal bytes.

    Args:
        path: the file; what was there is replaced.
        content: tensors and plain values.

    Raises:
        OutputError: the system refuses to write.
    """
    with replacing(path) as part, part.open("w+b") as file:
        watched = _Remembering(file)
        try:
            # By name, it would put the name inside.
            torch.save(own_copies(content), cast("BinaryIO", watched))
        except RuntimeError:
            if watched.error is None:
                raise
            raise watched.error from None
        add_checksum(file)


def read_checkpoint(path: Path, *, mapped: bool = False) -> tuple[Card, dict[str, Any]]:
    """What a checkpoint says of itself, and all of its content, on the CPU.

    Args:
        path: the file.
        mapped: leave the weights in the file until they are used: they take no memory before.

    Raises:
        CheckpointError: the file is absent, damaged by its checksum or without one, holds more than weights
            and plain values, isn't ogmkit's, or is of another format version.
    """
    require_checksum(path, AGAIN)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of foreign files; what matters is raised
            content = torch.load(path, map_location="cpu", weights_only=True, mmap=mapped)
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror or error}); {AGAIN}") from error
    except _FOREIGN as error:
        raise CheckpointError(
            f"{path}: is damaged, or holds more than weights and plain values; nothing of it was run; {AGAIN}"
        ) from error
    values = content.get(KEY) if isinstance(content, dict) else None
    if not isinstance(values, dict) or not are_weights(content.get("state_dict")):
        raise CheckpointError(f"{path}: not a checkpoint of ogmkit; {AGAIN}")
    if values.get("format_version") != FORMAT_VERSION:
        found = values.get("format_version")
        raise CheckpointError(f"{path}: has checkpoint format {found}, not {FORMAT_VERSION}; {AGAIN}")
    try:
        return Card.from_dict(values), content
    except (*MALFORMED, OgmkitError) as error:
        raise CheckpointError(f"{path}: what it says of itself is damaged ({error}); {AGAIN}") from error


def system_of(path: Path, card: Card, weights: Mapping[str, Any]) -> System:
    """The trained system that a checkpoint's content makes, on the CPU and ready to predict.

    Args:
        path: the checkpoint, for messages.
        card: what it says of itself.
        weights: its `state_dict`.

    Raises:
        CheckpointError: the weights are not this system's.
    """
    fresh = card.settings.for_prediction()
    try:
        system = build_system(fresh, card.grid, card.cameras)
        system.load_state_dict(weights)
    except (RuntimeError, SettingsError) as error:
        reason = str(error).splitlines()[0]
        raise CheckpointError(
            f"{path}: its weights are no {card.settings.system} ({reason}); {AGAIN}"
        ) from error
    return system.eval()
