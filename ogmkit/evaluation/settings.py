"""How runs are scored."""

from dataclasses import dataclass

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class EvaluateSettings:
    """How runs are scored.

    Attributes:
        samples: number of predictions of each run that are kept for pictures.

    Raises:
        SettingsError: a value is out of range.
    """

    split: str | None = setting(
        None,
        "Split to evaluate on.",
        form="NAME",
        unset="test where the shards have one with boxes, else val",
    )
    homography: str | None = setting(
        None,
        "Homographies that masks in camera view are warped by; of grids also one for the drivable area and "
        "one for the vehicles, such as surface+plane.",
        form="SOURCE",
        unset="network where the shards have it, else surface; of a planner, what it was trained with",
    )
    threshold: float = setting(
        0.5,
        "Probability above which a cell counts as predicted; not for planners.",
        low=0,
        below=1,
    )
    scale: float = setting(
        2.0, "Image size / mask size of the ceilings' true masks; not for planners.", above=0
    )
    batch_size: int = setting(8, "Number of frames, or sequences of six, in a batch.", low=1)
    limit: int | None = setting(
        None,
        "Maximum number of frames, or sequences, of each split, evenly spread.",
        low=1,
        flag="--limit-frames",
        unset="all",
    )
    samples: int = 4

    def __post_init__(self) -> None:
        require_stated(self)
        if self.samples < 0:
            raise SettingsError(f"samples: {self.samples} is below 0")
