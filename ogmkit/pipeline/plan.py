"""What an extraction would do, without doing it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ogmkit.errors import OgmkitError
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.output import Request, check_contents, check_place
from ogmkit.pipeline.selection import require_known_names
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import is_current


@dataclass(frozen=True)
class ScenePlan:
    """What an extraction would do for one scene.

    Attributes:
        scene: the scene's name.
        action: `keep` its shard, `write` one, `replace` the existing one, or `fail`.
        frames: over all cameras; 0 where its tables are unsound.
        error: what is wrong with its tables; files are not looked at.
    """

    scene: str
    action: Literal["keep", "write", "replace", "fail"]
    frames: int
    error: OgmkitError | None = None


def plan(
    dataset: Dataset,
    out: Path,
    settings: ExtractSettings,
    *,
    scenes: Sequence[str],
    overwrite: bool = False,
) -> tuple[ScenePlan, ...]:
    """Say what `extract` would do with the same arguments; writes nothing.

    Raises:
        SettingsError: the dataset lacks a scene, camera or category.
        OutputError: the folder is foreign, or holds other settings.
    """
    request = Request(out, settings, dataset.version, tuple(dict.fromkeys(scenes)), overwrite)
    require_known_names(dataset, settings, request.scenes)
    check_place(out, dataset.root)
    check_contents(request)
    return tuple(_plan_scene(dataset, request, name) for name in request.scenes)


def _plan_scene(dataset: Dataset, request: Request, name: str) -> ScenePlan:
    settings, path = request.settings, request.path(name)
    try:
        scene = dataset.scene(
            name, settings.cameras, lidar=settings.targets.lidar_source, step_s=settings.targets.step_s
        )
    except OgmkitError as error:
        return ScenePlan(name, "fail", 0, error)
    frames = sum(map(len, scene.cameras.values()))
    if not path.exists():
        return ScenePlan(name, "write", frames)
    current = is_current(path, scene, settings, request.dataset_version)
    return ScenePlan(name, "keep" if current and not request.overwrite else "replace", frames)
