"""Settings that the estimators share."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class FitSettings:
    """Which boxes give corners to `dlt`, `robust`, `four-point` and `plane`, and how many are enough.

    `surface`, `calibration` and `ego-plane` answer on every frame: the first takes its evidence by its own
    recipe.

    The least spread accepts a single car (about 0.9 m) and refuses corners in a line.

    Raises:
        SettingsError: a value is out of range.
    """

    min_points: int | None = setting(
        None,
        "Minimum number of ground corners; four-point always takes four.",
        low=4,
        unset="8 for robust, else 4",
    )
    min_spread_m: float = setting(
        0.1,
        "Minimum standard deviation of the corners on the ground, over all directions.",
        low=0,
        form="METRES",
        flag="--min-spread",
    )
    max_distance_m: float = setting(
        60.0, "Maximum distance of a box's centre.", above=0, form="METRES", flag="--max-distance"
    )
    categories: tuple[str, ...] = setting(
        ("vehicle.",), "Category prefixes treated as vehicles.", form="PREFIX,…"
    )
    min_visibility: int = setting(
        0, "Minimum visibility level of a vehicle, 1 to 4; unknown visibility always counts.", low=0, high=4
    )
    min_lidar_points: int = setting(
        0, "Minimum number of LiDAR points in a vehicle's box; an unknown number always counts.", low=0
    )

    def __post_init__(self) -> None:
        require_stated(self)
        if not self.categories or not all(self.categories):
            raise SettingsError("categories: name at least one prefix, such as vehicle.")

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as shards have it: what could not be set before is left out at its default."""
        values = dataclasses.asdict(self)
        if not self.min_lidar_points:
            del values["min_lidar_points"]
        return values
