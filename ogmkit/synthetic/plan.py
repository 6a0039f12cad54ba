"""Which scenes there are: their logs, places, times and splits; and tokens for all records."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from ogmkit.synthetic.layout import LOCATIONS, Location

_VEHICLE = "n099"
_FIRST_DAY = datetime(2024, 3, 4, 9, 30, tzinfo=UTC)
_SCENES_PER_TEST = 6
_SCENES_PER_VAL = 5


@dataclass(frozen=True)
class LogPlan:
    """One recording drive.

    Attributes:
        index: counted over all logs.
        location: where.
        start: its first moment.
    """

    index: int
    location: Location
    start: datetime

    @property
    def name(self) -> str:
        """The log file's name, in nuScenes' manner."""
        return f"{_VEHICLE}-{self.start:%Y-%m-%d-%H-%M-%S%z}"

    @property
    def row(self) -> dict[str, object]:
        """All columns of the `log` table but the token."""
        return {
            "logfile": self.name,
            "vehicle": _VEHICLE,
            "date_captured": f"{self.start:%Y-%m-%d}",
            "location": self.location.name,
        }


@dataclass(frozen=True)
class ScenePlan:
    """One scene.

    Attributes:
        index: counted over all scenes.
        log: the drive that it is cut from.
        start_us: timestamp of about its first key frame.
    """

    index: int
    log: LogPlan
    start_us: int

    @property
    def name(self) -> str:
        """Such as `scene-0001`."""
        return f"scene-{self.index + 1:04d}"


def plan_scenes(count: int, duration_s: float, scenes_per_log: int) -> tuple[ScenePlan, ...]:
    """Spread scenes over the locations, and over logs of at most so many scenes each."""
    scenes = []
    for index in range(count):
        place, turn = index % len(LOCATIONS), index // len(LOCATIONS)
        log_index = place + len(LOCATIONS) * (turn // scenes_per_log)
        log = LogPlan(log_index, LOCATIONS[place], _FIRST_DAY + timedelta(days=log_index))
        wait_s = (turn % scenes_per_log) * (duration_s + 60)
        scenes.append(ScenePlan(index, log, round((log.start.timestamp() + 10 + wait_s) * 1e6)))
    return tuple(scenes)


def split_scenes(names: Sequence[str]) -> dict[str, list[str]]:
    """Train, val and, from six scenes on, test; train and val are never empty from two scenes on."""
    count = len(names)
    tests = count // _SCENES_PER_TEST
    vals = max(1, count // _SCENES_PER_VAL) if count > 1 else 0
    trains = count - vals - tests
    splits = {"train": list(names[:trains]), "val": list(names[trains : trains + vals])}
    return splits | ({"test": list(names[trains + vals :])} if tests else {})


def token(seed: int, kind: str, *indices: object) -> str:
    """32 hexadecimal digits, always the same for the same record."""
    text = "/".join(str(part) for part in (seed, kind, *indices))
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
