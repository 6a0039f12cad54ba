"""What a sample round the vehicle holds, and whether a folder of shards has the labels for it."""

from dataclasses import dataclass
from typing import Literal

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.labels.catalogue import definition as named
from ogmkit.labels.definition import Definition
from ogmkit.labels.names import PAPER, SURROUND
from ogmkit.shards import schema_labels
from ogmkit.shards.folder import ShardFolder

Layout = Literal["ogmkit", "lss", "cvt", "simple-bev"]
"""Names and shapes of a sample's tensors: ogmkit's own, or those that a repository's network takes."""
OWN_LAYOUT: Layout = "ogmkit"


@dataclass(frozen=True)
class SurroundSpec:
    """What a sample round the vehicle holds.

    Attributes:
        definition: whose labels; of those that lie round the vehicle, not before a camera.
        image_size: (height, width) of the images.
        crop_top: rows that are cut off above: images are resized to `image_size` and so many rows more.
        layout: of the tensors.
        classes: of the labels, in this order; none stands for all of the definition's.

    Raises:
        SettingsError: a size is not positive.
    """

    definition: str = SURROUND
    image_size: tuple[int, int] = (224, 480)
    crop_top: int = 46
    layout: Layout = OWN_LAYOUT
    classes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if min(self.image_size) < 1 or self.crop_top < 0:
            raise SettingsError(
                f"surround: an image size {self.image_size} below 1, or a crop {self.crop_top} below 0"
            )

    @property
    def resized(self) -> tuple[int, int]:
        """(height, width) of the images before they are cropped."""
        return self.image_size[0] + self.crop_top, self.image_size[1]


def labels_for(folder: ShardFolder, needs: SurroundSpec) -> Definition:
    """The definition that is wanted, as a folder's shards have it.

    Raises:
        SettingsError: they lack it or a class of it, or the layout doesn't fit it.
    """
    stored = [one for one in folder.manifest.settings.labels if one.place == schema_labels.SURROUND]
    chosen = next((one for one in stored if one.name == needs.definition), None)
    if chosen is None:
        there = ", ".join(one.name for one in stored) or "none"
        lies_round = needs.definition != PAPER and named(needs.definition).place == schema_labels.SURROUND
        raise SettingsError(
            f"{folder.path}: has no labels {needs.definition!r} round the vehicle, only {there}; extract "
            f"with --definition {PAPER},{needs.definition if lies_round else SURROUND}"
        )
    for wanted in needs.classes:
        if wanted not in chosen.class_names:
            raise SettingsError(f"{folder.path}: {unknown('class', wanted, chosen.class_names)}")
    if needs.layout != OWN_LAYOUT and chosen.frame == "lidar-heading":
        raise SettingsError(
            f"layout {needs.layout}: has x ahead, but labels {chosen.name} to the right; choose {OWN_LAYOUT}"
        )
    return chosen
