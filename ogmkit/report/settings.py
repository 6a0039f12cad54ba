"""What a report shows."""

from dataclasses import dataclass

from ogmkit.base.stated import require_stated, setting


@dataclass(frozen=True)
class ReportSettings:
    """What a report shows.

    Raises:
        SettingsError: a number is out of range.
    """

    frames: int = setting(
        12,
        "Most frames of a scene that are pictured; fewer where the page would grow beyond 50 MB.",
        low=0,
        high=200,
    )
    examples: int = setting(
        24,
        "Frames of the reported split that each RUN which predicts grids is shown on; 0 needs no torch.",
        low=0,
        high=200,
    )
    no_verify: bool = setting(False, "Don't verify the shards, which reads all of them.")
    no_check: bool = setting(False, "Don't check the dataset, also where it is there.")

    def __post_init__(self) -> None:
        require_stated(self)
