"""Settings that depend on what the shards hold: which cameras, masks and homographies there are."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.homography.sources import SURFACE, preferred_source
from ogmkit.learn.perception_settings import MaskTraining
from ogmkit.learn.settings import TrainSettings
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.shards import schema
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest


def completed(settings: TrainSettings, shards: Path, manifest: Manifest) -> TrainSettings:
    """The settings with cameras and, where masks are learnt, their set filled in.

    Raises:
        SettingsError: a camera is not in the shards.
        ShardError: a shard can't be read.
    """
    cameras = chosen_cameras(shards, manifest, settings.cameras)
    full = dataclasses.replace(settings, cameras=cameras)
    if isinstance(full, MaskTraining) and full.masks is None:
        masks = preferred(shards, manifest, cameras[0], schema.FOOTPRINTS.name)
        return dataclasses.replace(full, masks=masks)
    return full


def preferred(shards: Path, manifest: Manifest, camera: str, kind: str) -> str:
    """`network` where the shards have an added group of that name, else `surface`.

    Args:
        shards: the folder.
        manifest: its manifest.
        camera: channel.
        kind: a name of `schema.ADDED`.

    Raises:
        ShardError: the first shard can't be read.
    """
    if not manifest.shards:
        return SURFACE
    with listed_shard(shards, manifest.shards[0]) as shard:
        return preferred_source(shard.added(camera, kind)) or SURFACE


def common_cameras(
    run: Path, known: Sequence[str], shards: Path, manifest: Manifest, cameras: Sequence[str]
) -> tuple[str, ...]:
    """The cameras that a run is to predict: those asked for, else all that both it and the shards know.

    Args:
        run: the run's path, for messages.
        known: the cameras that it was trained on.
        shards: the folder.
        manifest: its manifest.
        cameras: channels that are asked for; none for all.

    Raises:
        SettingsError: one of them is unknown to shards or run, or the two have none in common.
    """
    there = tuple(sorted(manifest.settings.cameras))
    for camera in cameras:
        if camera not in there:
            raise SettingsError(f"{shards}: {unknown('camera', camera, there)}")
        if camera not in known:
            raise SettingsError(f"{run}: {unknown('camera', camera, known)}")
    chosen = tuple(dict.fromkeys(cameras)) or tuple(camera for camera in there if camera in known)
    if not chosen:
        raise SettingsError(
            f"{run}: was trained on {', '.join(known)}, but {shards} has {', '.join(there)}; choose another"
        )
    return chosen
