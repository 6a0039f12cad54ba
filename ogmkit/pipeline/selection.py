"""Which scenes a run is about, and whether the dataset has what was asked for."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ogmkit.base.names import matching, unknown
from ogmkit.errors import SettingsError
from ogmkit.frames import SceneRecord
from ogmkit.nuscenes.categories import require_known, require_known_parts
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.sources import SceneSource
from ogmkit.shards.schema_labels import SURROUND
from ogmkit.shards.settings import ExtractSettings


def select_scenes(
    dataset: Dataset, names: Sequence[str] = (), splits: Sequence[str] = (), split_file: Path | None = None
) -> tuple[str, ...]:
    """The chosen scenes, in the dataset's order.

    Args:
        dataset: the dataset.
        names: scenes, or patterns of their names such as `scene-00*`; none means all.
        splits: only the scenes of these; none means no such limit.
        split_file: where the splits stand; the dataset's own by default.

    Raises:
        SettingsError: a scene or split is unknown, a pattern matches none, or no scene is left.
        TableError: the split file is absent or malformed.
    """
    present = dataset.scene_names()
    chosen = set(matching("scene", names, present, dataset.root))
    if splits:
        chosen &= {scene for split in splits for scene in dataset.split(split, split_file)}
    if not chosen:
        wanted = f"none of the scenes is in split {', '.join(splits)}" if splits else "has no scenes"
        raise SettingsError(f"{dataset.root}: {wanted}; choose others")
    return tuple(name for name in present if name in chosen)


def read_scene(dataset: SceneSource, name: str, settings: ExtractSettings) -> SceneRecord:
    """A scene's records, as far as the settings need them.

    Raises:
        SettingsError, TableError: as the dataset's `scene`.
    """
    targets = settings.targets
    scene = dataset.scene(
        name,
        settings.cameras,
        lidar=targets.lidar_source if settings.paper else None,
        step_s=targets.step_s,
        maps=settings.paper and not targets.no_map,
    )
    if not settings.labels:
        return scene
    ahead = next((one.place for one in settings.labels if one.place != SURROUND), None)
    frames = dataset.key_frames(name, lidar=targets.lidar_channel, camera=ahead, maps=settings.draws_mask)
    return replace(scene, key_frames=frames)


def require_known_names(dataset: SceneSource, settings: ExtractSettings, scenes: Sequence[str]) -> None:
    """Check scenes, cameras and categories against the dataset, before anything is written.

    Raises:
        SettingsError: the dataset has no such scene or camera, or no category begins so.
    """
    _require("scene", scenes, dataset.scene_names(), dataset.root)
    _require("camera", settings.cameras, dataset.channels(), dataset.root)
    if settings.paper:
        require_known(settings.targets.categories, dataset.categories(), dataset.root)
        require_known_parts(settings.targets.classes, dataset.categories(), dataset.root)


def _require(kind: str, names: Iterable[str], known: Sequence[str], root: Path) -> None:
    there = frozenset(known)  # of a million scenes, each would look through half of them
    for name in names:
        if name not in there:
            raise SettingsError(f"{root}: {unknown(kind, name, known)}")
