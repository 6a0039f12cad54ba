"""What a run of the whole chain makes: one record, as a file says it and with every default filled in."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.errors import SettingsError
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.footprints.sets import FULL_BODY, mask_kind
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import NETWORK, sources_of
from ogmkit.learn.settings import TrainSettings
from ogmkit.shards.settings import LEAVING_OUT, ExtractSettings

HOMOGRAPHY, FOOTPRINTS = "homography", "footprints"
"""Names of the two trainings that others build on."""
ELSEWHERE = {
    "split_ratio": "give a split_file, so that all networks learn from and are scored on the same scenes",
    "devices": "a chain trains each network on one GPU; `ogmkit train` takes several",
}
"""Settings of a training that the chain has no use for, and what to do instead."""


@dataclass(frozen=True)
class Source:
    """Which dataset, and which of its scenes.

    Attributes:
        data: the dataset's root.
        version: folder of the tables; None for the only one there is.
        scenes: names; none means all.
        splits: only the scenes of these; none means no such limit.
        split_file: JSON of split → scenes; None for the dataset's own splits.
    """

    data: Path
    version: str | None = None
    scenes: tuple[str, ...] = ()
    splits: tuple[str, ...] = ()
    split_file: Path | None = None


@dataclass(frozen=True)
class MaskSettings:
    """Which masks in camera view are rendered.

    Attributes:
        scale: image size / mask size.
        sets: names such as `surface` or `full-body`, beside those that something learns.
    """

    scale: float = 2.0
    sets: tuple[str, ...] = ()


@dataclass(frozen=True)
class Training:
    """One training.

    Attributes:
        name: of its RUN folder.
        settings: what to train. `perception` names another training of the run here, or is a path.
    """

    name: str
    settings: TrainSettings


@dataclass(frozen=True)
class Config:
    """The whole chain.

    Attributes:
        source: the dataset.
        out: folder that gets everything.
        workers: processes that work on shards, and that read for networks.
        scheduler: of the Dask cluster that works on shards instead; empty for none.
        trainings_at_once: how many trainings that don't need each other go on side by side.
        extract: what the shards hold.
        methods: homographies that are fitted.
        fit: which boxes they rest on.
        masks: which masks in camera view there are.
        homography: the homography network; None for none.
        footprints: the paper's footprint network; None for none.
        baselines: other networks that give grids.
        planners: networks that plan.
        evaluate: how they are scored.
        notes: what the user should know of the file.
    """

    source: Source
    out: Path
    workers: int
    scheduler: str
    trainings_at_once: int
    extract: ExtractSettings
    methods: tuple[str, ...]
    fit: FitSettings
    masks: MaskSettings
    homography: Training | None
    footprints: Training | None
    baselines: tuple[Training, ...]
    planners: tuple[Training, ...]
    evaluate: EvaluateSettings
    notes: tuple[str, ...] = ()

    @property
    def readers(self) -> int:
        """Processes that read for networks beside this one: none, unless several are to work."""
        return self.workers if self.workers > 1 else 0

    @property
    def shards(self) -> Path:
        """The folder of shards."""
        return self.out / "shards"

    def run_folder(self, name: str) -> Path:
        """The folder of a training."""
        return self.out / "runs" / name

    @property
    def grids(self) -> tuple[Training, ...]:
        """Trainings whose networks give occupancy grids, as the first table has them."""
        return self.baselines if self.footprints is None else (self.footprints, *self.baselines)

    @property
    def trainings(self) -> tuple[Training, ...]:
        """All of them."""
        first = () if self.homography is None else (self.homography,)
        return (*first, *self.grids, *self.planners)

    @property
    def homographies(self) -> tuple[str, ...]:
        """Sources of homographies that the shards get."""
        return self.methods if self.homography is None else (*self.methods, NETWORK)

    def footprint_set(self, name: str) -> FootprintSettings:
        """What makes the set of camera-view masks of this name.

        Raises:
            SettingsError: no set that can be made is called so.
        """
        found = mask_kind(name)
        sources = set() if found is None or found.method == FULL_BODY else {*sources_of(found.homography)}
        if found is None or not sources <= {*self.homographies}:
            known = ", ".join((*self.homographies, FULL_BODY))
            raise SettingsError(f"nothing makes the masks {name!r}; there are: {known}")
        return FootprintSettings(found.homography, found.method, self.masks.scale)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that, as a YAML file, are this configuration again; paths are absolute."""
        source = dataclasses.asdict(self.source) | {"data": str(self.source.data.resolve())}
        if self.source.split_file is not None:
            source["split_file"] = str(self.source.split_file.resolve())
        extract = self.extract.to_dict()
        cameras = extract.pop("cameras")
        extract |= {name: getattr(self.extract, name) for name in LEAVING_OUT}
        values = {
            **source,
            "out": str(self.out.resolve()),
            "cameras": cameras,
            "workers": self.workers,
            "scheduler": self.scheduler,
            "trainings_at_once": self.trainings_at_once,
            "extract": extract,
            "homography_fit": {"methods": self.methods, **dataclasses.asdict(self.fit)},
            "render_footprints": dataclasses.asdict(self.masks),
            "baselines": [_entry(training) for training in self.baselines],
            "planners": [_entry(training) for training in self.planners],
            "evaluate": dataclasses.asdict(self.evaluate),
        }
        for training in (self.homography, self.footprints):
            if training is not None:
                values[training.name] = _entry(training)
                del values[training.name]["name"], values[training.name]["system"]
        plain: dict[str, Any] = json.loads(json.dumps(values))
        return plain


def _entry(training: Training) -> dict[str, Any]:
    """A training as the file has it; what `ogmkit run` decides for all of them is left out."""
    settings = training.settings.to_dict()
    return {"name": training.name, **{k: v for k, v in settings.items() if k not in ELSEWHERE}}
