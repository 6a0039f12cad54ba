"""Where a checkpoint's normalisation comes from, if not from its training."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self


@dataclass(frozen=True)
class Adaptation:
    """The images that a network was adapted to: `ogmkit.learn.predict.adapt`.

    Attributes:
        run: what was adapted, as it was named.
        sha256: checksum of its checkpoint, hexadecimal.
        source: the folder of shards or images.
        scenes: of shards, names of the scenes.
        images: how many.
        share: of the images' statistics in the new ones, up to 1; the run's own have the rest.
    """

    run: str
    sha256: str
    source: str
    scenes: tuple[str, ...]
    images: int
    share: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dataclasses.asdict(self) | {"scenes": [*self.scenes]}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`.

        Raises:
            MALFORMED: something is missing or of another kind.
        """
        texts = {name: str(values[name]) for name in ("run", "sha256", "source")}
        scenes = tuple(str(scene) for scene in values["scenes"])
        # Checkpoints of before have no share: all was the images'.
        share = float(values.get("share", 1.0))
        return cls(**texts, scenes=scenes, images=int(values["images"]), share=share)
