"""The YAML file of a run: sections of settings by the names that their records give them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ogmkit.base.cluster import require_usable
from ogmkit.base.names import unknown
from ogmkit.base.places import place
from ogmkit.base.values import built, converted, field_names, mapping, require_known
from ogmkit.errors import SettingsError
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.grid import GridSpec, default_ego
from ogmkit.homography.methods import METHODS
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import preferred_source
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.pipeline.homography_fit import DEFAULT_METHODS
from ogmkit.shards.settings import LEAVING_OUT, ExtractSettings
from ogmkit.target_settings import TargetSettings
from ogmkit.workflow.config import Config, MaskSettings, Source
from ogmkit.workflow.trainings import read_trainings

_KEYS = (
    *("data", "out", *field_names(Source)[1:], "cameras", "workers", "scheduler"),
    "trainings_at_once",
    *("extract", "homography_fit", "render_footprints", "train", "homography", "footprints"),
    *("baselines", "planners", "evaluate"),
)


def read_config(path: Path) -> Config:
    """Read the file of a run; paths in it are relative to its folder.

    Raises:
        CheckpointError: it is absent, no YAML, or no mapping.
        SettingsError: a key is unknown or missing, or a value of another kind or out of range.
    """
    from ogmkit.learn.yaml_files import read_yaml  # noqa: PLC0415  # YAML comes with the extra `train`

    return config_of(read_yaml(path), path)


def config_of(values: Mapping[str, Any], path: Path) -> Config:
    """The configuration that a file says.

    Args:
        values: the file's content.
        path: its place, for messages and relative paths.

    Raises:
        SettingsError: as `read_config`.
    """
    require_known(values, _KEYS, str(path))
    for name in ("data", "out"):
        if not isinstance(values.get(name), str):
            raise SettingsError(f"{path}: {name}: say which folder, relative to this file")
    file = _File(values, path)
    methods, fit = file.fit()
    config = Config(
        source=file.source(),
        out=place(values["out"], path.parent),
        workers=max(file.count("workers", 0), 1),  # 0 and 1 both mean this process
        scheduler=file.scheduler(),
        trainings_at_once=file.count("trainings_at_once", 1),
        extract=file.extract(),
        methods=methods,
        fit=fit,
        masks=built(MaskSettings, *file.section("render_footprints")),
        homography=None,
        footprints=None,
        baselines=(),
        planners=(),
        evaluate=built(EvaluateSettings, *file.section("evaluate")),
    )
    config = read_trainings(config, values, path)
    _require_sets(config, path)
    _require_lidar(config, path)
    return replace(config, evaluate=_completed(config, f"{path}: evaluate"))


@dataclass(frozen=True)
class _File:
    """The parts of a file that say what is made of the dataset."""

    values: Mapping[str, Any]
    path: Path

    def section(self, name: str) -> tuple[dict[str, Any], str]:
        where = f"{self.path}: {name}"
        return mapping(self.values.get(name), where), where

    def source(self) -> Source:
        names = field_names(Source)
        source = built(Source, {k: v for k, v in self.values.items() if k in names}, str(self.path))
        folder, split_file = self.path.parent, source.split_file
        return replace(
            source,
            data=place(source.data, folder),
            split_file=None if split_file is None else place(split_file, folder),
        )

    def count(self, name: str, least: int) -> int:
        """A number of processes; 1 where the file doesn't say."""
        count: int = converted(self.values.get(name, 1), int, f"{self.path}: {name}")
        if count < least:
            raise SettingsError(f"{self.path}: {name}: {count} is below {least}")
        return count

    def scheduler(self) -> str:
        """The Dask scheduler's address, or `local`; empty for none."""
        where = f"{self.path}: scheduler"
        scheduler: str = converted(self.values.get("scheduler", ""), str, where)
        try:
            if scheduler:
                require_usable(scheduler)
        except SettingsError as error:
            raise SettingsError(f"{where}: {error}") from error
        return scheduler

    def extract(self) -> ExtractSettings:
        values, where = self.section("extract")
        names = ("compression", *LEAVING_OUT)
        require_known(values, (*field_names(TargetSettings), *names), where)
        own = {name: values.pop(name) for name in names if name in values}
        if "cameras" in self.values:
            own["cameras"] = self.values["cameras"]
        if "grid" in values:
            values["grid"] = _grid(mapping(values["grid"], f"{where}: grid"), f"{where}: grid")
        targets = built(TargetSettings, values, where)
        return built(ExtractSettings, {"targets": targets, **own}, where)

    def fit(self) -> tuple[tuple[str, ...], FitSettings]:
        """Methods, each once, and which boxes they rest on."""
        values, where = self.section("homography_fit")
        require_known(values, ("methods", *field_names(FitSettings)), where)
        methods = converted(values.pop("methods", DEFAULT_METHODS), tuple[str, ...], f"{where}: methods")
        if not methods:
            raise SettingsError(f"{where}: methods: name at least one")
        for method in methods:
            if method not in METHODS:
                raise SettingsError(f"{where}: methods: {unknown('method', method, tuple(METHODS))}")
        return tuple(dict.fromkeys(methods)), built(FitSettings, values, where)


def _grid(values: Mapping[str, Any], where: str) -> GridSpec:
    whole = GridSpec()
    rows = converted(values.get("rows", whole.rows), int, f"{where}: rows")
    columns = converted(values.get("columns", whole.columns), int, f"{where}: columns")
    ego_row, ego_column = default_ego(rows, columns)
    return built(GridSpec, {"ego_row": ego_row, "ego_column": ego_column, **values}, where)


def _require_sets(config: Config, path: Path) -> None:
    for name in config.masks.sets:
        try:
            config.footprint_set(name)
        except SettingsError as error:
            raise SettingsError(f"{path}: render_footprints: sets: {error}") from error


def _require_lidar(config: Config, path: Path) -> None:
    for training in config.baselines:
        if CATALOGUE[training.settings.system].inputs == "lidar" and not config.extract.targets.lidar:
            raise SettingsError(f"{path}: baselines: {training.name} needs `lidar: true` under extract")


def _completed(config: Config, where: str) -> EvaluateSettings:
    """The settings with the homography filled in: what is learnt, if it is."""
    settings, known = config.evaluate, config.homographies
    if settings.homography is None:
        return replace(settings, homography=preferred_source(known))
    if settings.homography not in known:
        there = ", ".join(known)
        raise SettingsError(f"{where}: homography: nothing makes {settings.homography!r}; there are: {there}")
    return settings
