"""Settings that the estimators share."""

import math
from dataclasses import dataclass

from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class FitSettings:
    """Which boxes give corners to `dlt`, `robust`, `four-point` and `plane`, and how many are enough.

    `surface` and `calibration` answer on every frame: the former takes its evidence by its own recipe.

    Attributes:
        min_points: fewest corners; None is the method's own least number: 8 for `robust`, else 4
            (`four-point` always takes four).
        min_spread_m: least standard deviation of the corners on the ground, over all directions. The default
            accepts a single car (about 0.9 m) and refuses corners in a line.
        max_distance_m: farthest box centre from the ego.
        categories: prefixes of category names; a box that starts with any of them counts.
        min_visibility: least nuScenes visibility, 1 to 4; unknown visibility (0) always counts.

    Raises:
        SettingsError: a value is out of range.
    """

    min_points: int | None = None
    min_spread_m: float = 0.1
    max_distance_m: float = 60.0
    categories: tuple[str, ...] = ("vehicle.",)
    min_visibility: int = 0

    def __post_init__(self) -> None:
        if self.min_points is not None and self.min_points < 4:
            raise SettingsError(f"min_points: a homography needs at least 4 corners, not {self.min_points}")
        if not (math.isfinite(self.min_spread_m) and self.min_spread_m >= 0):
            raise SettingsError(f"min_spread_m: {self.min_spread_m} m is not a length")
        if not (math.isfinite(self.max_distance_m) and self.max_distance_m > 0):
            raise SettingsError(f"max_distance_m: {self.max_distance_m} m is not a positive distance")
        if not self.categories:
            raise SettingsError("categories: name at least one prefix, such as vehicle.")
        if not 0 <= self.min_visibility <= 4:
            raise SettingsError(f"min_visibility: {self.min_visibility} is not between 0 and 4")
