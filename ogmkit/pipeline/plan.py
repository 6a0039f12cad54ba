"""What an extraction would do, without doing it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ogmkit.errors import OgmkitError, UnreadableShardError
from ogmkit.frames import SceneRecord
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.frame_files import Refusal, prepare
from ogmkit.pipeline.output import Request, check_contents, check_place
from ogmkit.pipeline.resuming import is_up_to_date
from ogmkit.pipeline.selection import read_scene, require_known_names
from ogmkit.shards.settings import ExtractSettings


@dataclass(frozen=True)
class ScenePlan:
    """What an extraction would do for one scene.

    Attributes:
        scene: the scene's name.
        action: `keep` its shard, `write` one, `replace` the existing one, leave the scene out, or `fail`.
        frames: over all cameras, or of labels alone its samples; 0 where the scene gives no shard.
        error: why it gives none; files are looked for, but not read.
    """

    scene: str
    action: Literal["keep", "write", "replace", "leave out", "fail"]
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
    path = request.path(name)
    try:
        scene = read_scene(dataset, name, request.settings)
        if not request.overwrite and path.exists() and is_up_to_date(path, scene, request, read=False):
            return ScenePlan(name, "keep", _frames(scene))
        prepared = prepare(scene, request.settings, read=False)
    except UnreadableShardError:
        raise
    except OgmkitError as error:
        return ScenePlan(name, "fail", 0, error)
    if isinstance(prepared, Refusal):
        return ScenePlan(name, "leave out" if prepared.left_out else "fail", 0, prepared.error)
    return ScenePlan(name, "replace" if path.exists() else "write", _frames(prepared))


def _frames(scene: SceneRecord) -> int:
    return sum(map(len, scene.cameras.values())) or len(scene.key_frames)
