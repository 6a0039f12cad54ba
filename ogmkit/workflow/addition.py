"""Steps that add to the shards: homographies, fitted and learnt, and masks in camera view."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ogmkit.base.atomic import output_errors
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.homography.sources import NETWORK, sources_of
from ogmkit.pictures.homography_plot import write_plot
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards import schema
from ogmkit.workflow.config import Config, Training
from ogmkit.workflow.groups import groups_gone, groups_of, settle
from ogmkit.workflow.steps import (
    EXTRACT,
    FIT,
    PREDICT,
    Call,
    Made,
    first_gone,
    maker_of,
    plain,
    rendering,
    training,
)

_PLOT = "pictures/homographies.png"


@dataclass(frozen=True)
class FitHomographies:
    """Homographies by each method, and a plot of their errors."""

    config: Config

    @property
    def name(self) -> str:
        """The command."""
        return FIT

    @property
    def needs(self) -> tuple[str, ...]:
        """Shards."""
        return (EXTRACT,)

    @property
    def settings(self) -> Mapping[str, Any]:
        """Methods, and which boxes count."""
        return plain({"methods": self.config.methods, **asdict(self.config.fit)})

    @property
    def exact(self) -> bool:
        """They follow from the shards."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """A method in a shard, or the plot."""
        gone = groups_gone(self.config.shards, schema.HOMOGRAPHY, self.config.methods)
        return gone or first_gone(self.config.out, files)

    def run(self, call: Call) -> Made:
        """Fit and plot."""
        config = self.config
        settle(config.shards, FIT)
        summary = fit_shards(
            config.shards,
            config.methods,
            config.fit,
            execution=call.execution(config),
        )
        path = config.out / _PLOT
        with output_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        write_plot(path, summary)
        groups = groups_of(schema.HOMOGRAPHY, config.methods)
        return Made((_PLOT,), groups, f"{summary.shards} shards")


@dataclass(frozen=True)
class RenderMasks:
    """One set of masks in camera view.

    Attributes:
        config: the whole configuration.
        set: what to make.
    """

    config: Config
    set: FootprintSettings

    @property
    def name(self) -> str:
        """The command and the set."""
        return rendering(self.set.set_name)

    @property
    def needs(self) -> tuple[str, ...]:
        """What made the homography that masks are warped with; others need only the shards."""
        sources = sources_of(self.set.homography) if self.set.method == "warp" else ()
        return (EXTRACT, *dict.fromkeys(map(maker_of, sources)))

    @property
    def settings(self) -> Mapping[str, Any]:
        """The set's."""
        return asdict(self.set)

    @property
    def exact(self) -> bool:
        """They follow from shards and homographies."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """The set in a shard."""
        del files
        return groups_gone(self.config.shards, schema.FOOTPRINTS, (self.set.set_name,))

    def run(self, call: Call) -> Made:
        """Render."""
        settle(self.config.shards, "render-footprints")
        summary = render_footprints(
            self.config.shards,
            self.set,
            execution=call.execution(self.config),
        )
        left = f", {summary.invalid} of them empty" if summary.invalid else ""
        groups = groups_of(schema.FOOTPRINTS, (self.set.set_name,))
        return Made((), groups, f"{summary.frames} frames{left}")


@dataclass(frozen=True)
class PredictHomographies:
    """The homographies that a trained network reads off the images.

    Attributes:
        config: the whole configuration.
        network: what was trained.
    """

    config: Config
    network: Training

    @property
    def name(self) -> str:
        """The command."""
        return PREDICT

    @property
    def needs(self) -> tuple[str, ...]:
        """Shards and network."""
        return EXTRACT, training(self.network.name)

    @property
    def settings(self) -> Mapping[str, Any]:
        """None of its own."""
        return {}

    @property
    def exact(self) -> bool:
        """They follow from the network's weights."""
        return True

    def missing(self, files: Sequence[str]) -> str:
        """The homographies in a shard."""
        del files
        cameras = self.network.settings.cameras
        return groups_gone(self.config.shards, schema.HOMOGRAPHY, (NETWORK,), cameras)

    def run(self, call: Call) -> Made:
        """Predict."""
        from ogmkit.learn.predict.homographies import predict_homographies  # noqa: PLC0415  # needs torch

        settle(self.config.shards, PREDICT)
        summary = predict_homographies(
            self.config.shards,
            self.config.run_folder(self.network.name),
            batch_size=self.network.settings.batch_size,
            execution=call.execution(self.config),
        )
        return Made((), groups_of(schema.HOMOGRAPHY, (NETWORK,)), f"{summary.shards} shards")
