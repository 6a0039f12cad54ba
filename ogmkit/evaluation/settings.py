"""How runs are scored."""

import math
from dataclasses import dataclass

from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class EvaluateSettings:
    """How runs are scored.

    Attributes:
        split: the split to evaluate on.
        homography: the source that masks in camera view are warped by; None means, in the first table,
            `network` if all shards have it, else `surface`, and of planners each one's own.
        threshold: what probabilities must exceed to count as predicted, in the first table.
        scale: image size / mask size of the ceilings' true masks, in the first table.
        batch_size: frames predicted at a time.
        limit: frames of each split at most, evenly spread; None for all.
        samples: predictions of each run to keep, of evenly spread frames.

    Raises:
        SettingsError: a value is out of range.
    """

    split: str = "val"
    homography: str | None = None
    threshold: float = 0.5
    scale: float = 2.0
    batch_size: int = 8
    limit: int | None = None
    samples: int = 4

    def __post_init__(self) -> None:
        if not 0 <= self.threshold < 1:
            raise SettingsError(f"threshold: {self.threshold:g} is not from 0 and below 1")
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise SettingsError(f"scale: {self.scale:g} is not a positive number")
        for name, value, least in (
            ("batch_size", self.batch_size, 1),
            ("limit", self.limit, 1),
            ("samples", self.samples, 0),
        ):
            if value is not None and value < least:
                raise SettingsError(f"{name}: {value} is below {least}")
