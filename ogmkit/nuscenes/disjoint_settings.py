"""How scenes are divided into splits that lie apart."""

from dataclasses import dataclass

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class DisjointSettings:
    """How scenes are divided.

    Raises:
        SettingsError: a value is out of range, or nothing is left to learn from.
    """

    apart_m: float = setting(
        50.0,
        "Distance that key frames of two splits keep from each other.",
        form="METRES",
        flag="--apart",
        low=0,
    )
    val_share: float = setting(0.15, "Share of the scenes that val gets.", low=0, below=1)
    test_share: float = setting(0.15, "Share of the scenes that test gets; 0 makes none.", low=0, below=1)
    seed: int = setting(0, "Random seed of which zone goes to which split.", low=0)

    def __post_init__(self) -> None:
        require_stated(self)
        if self.val_share + self.test_share >= 1:
            raise SettingsError("val_share and test_share: together they leave nothing to train")

    @property
    def shares(self) -> dict[str, float]:
        """Split → its share, of those that get any."""
        shares = {
            "train": 1 - self.val_share - self.test_share,
            "val": self.val_share,
            "test": self.test_share,
        }
        return {name: share for name, share in shares.items() if share > 0}
