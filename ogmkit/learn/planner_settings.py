"""The settings of the systems of stage 2, which plan."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

from ogmkit.base.stated import setting, with_default
from ogmkit.errors import SettingsError
from ogmkit.learn.perception_settings import ImageTraining, MaskTraining
from ogmkit.learn.settings import TrainSettings

Mean = Literal["zero", "linear"]


@dataclass(frozen=True, kw_only=True)
class PlannerTraining(TrainSettings):
    """Of a system that plans."""

    epochs: int = with_default(TrainSettings, "epochs", 200)
    batch_size: int = with_default(TrainSettings, "batch_size", 10)
    clip_norm: float = with_default(TrainSettings, "clip_norm", 1.0)
    hidden: int = setting(128, "Size of the states of the planner's LSTMs.", "Model", low=1, high=65536)
    mean: Mean = setting(
        "zero",
        "What the planner's means are added to: zero, or the linear least-squares plan of the training set.",
        "Model",
    )
    no_destination: bool = setting(
        False, "Do without the destination, and predict that point as well.", "Model", later=True
    )

    @property
    def sees_past(self) -> bool:
        """Whether the planner is told the past trajectory."""
        return True

    @property
    def label(self) -> str:
        """The system's name; `-np` without the past, as in the paper, `-nd` without the destination."""
        return f"{self.system}{'-np' * (not self.sees_past)}{'-nd' * self.no_destination}"


@dataclass(frozen=True, kw_only=True)
class ObservingTraining(PlannerTraining):
    """Of a planner that sees more than the past, and may do without it."""

    no_past: bool = setting(False, "Do without the past trajectory.", "Model")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.no_past and self.mean == "linear":
            raise SettingsError("mean: linear reads the past: leave out no_past, or choose zero")

    @property
    def sees_past(self) -> bool:
        """As set."""
        return not self.no_past


@dataclass(frozen=True, kw_only=True)
class PoolingTraining(ObservingTraining):
    """Of a planner that sees masks."""

    pool_cells: int = setting(
        5500,
        "Maximum number of cells that masks are averaged to, by each map's own aspect, before the planner "
        "sees them.",
        "Model",
        low=1,
    )


@dataclass(frozen=True, kw_only=True)
class RecomputingTraining(ImageTraining):
    """Of a planner with an encoder for six images at once."""

    checkpoint_gradients: bool = setting(
        False, "Recompute the activations of residual blocks: less memory, more time.", "Run"
    )

    def for_prediction(self) -> Self:
        """Without gradients."""
        return replace(super().for_prediction(), checkpoint_gradients=False)


@dataclass(frozen=True, kw_only=True)
class LstmTraining(PlannerTraining):
    """Of `lstm-ed`."""

    system: ClassVar[str] = "lstm-ed"


@dataclass(frozen=True, kw_only=True)
class EndToEndTraining(ObservingTraining, RecomputingTraining):
    """Of `end-to-end`."""

    system: ClassVar[str] = "end-to-end"


@dataclass(frozen=True, kw_only=True)
class MidToEndTraining(PoolingTraining):
    """Of `mid-to-end`."""

    system: ClassVar[str] = "mid-to-end"

    @property
    def learns_drivable(self) -> bool:
        """It sees the true masks."""
        return True


@dataclass(frozen=True, kw_only=True)
class HolisticTraining(PoolingTraining, MaskTraining, RecomputingTraining):
    """Of `holistic-cv`, and of `holistic` but for its warp."""

    system: ClassVar[str] = "holistic-cv"
    perception: str | None = setting(
        None,
        "RUN of footprints that the perception starts from.",
        "Model",
        form="RUN",
        unset="random weights",
    )
    perception_weight: float = setting(
        0.1, "Weight of the perception's loss beside the motion's.", "Optimisation", low=0
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.freezes_perception and not self.runs_read:
            raise SettingsError("freeze: a perception needs weights to keep: set perception, or init")

    @property
    def freezes_perception(self) -> bool:
        """Whether the planner alone is trained."""
        return "perception" in self.freeze

    @property
    def runs_read(self) -> Mapping[str, str]:
        """The perception's, too."""
        own = {} if self.perception is None else {"perception": self.perception}
        return {**super().runs_read, **own}

    @property
    def learns_drivable(self) -> bool:
        """Its perception does, unless that is frozen."""
        return not self.freezes_perception


@dataclass(frozen=True, kw_only=True)
class WarpedTraining(HolisticTraining):
    """Of `holistic`."""

    system: ClassVar[str] = "holistic"
    warp: str = setting("network", "Homographies used to warp masks to the plane.", "Data", form="SOURCE")

    @property
    def homographies_read(self) -> Mapping[str, str]:
        """The warp."""
        return {"warp": self.warp}
