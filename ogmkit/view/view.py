"""Shards and predictions as a Rerun recording, a key frame at a time."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.atomic import require_outside
from ogmkit.base.extras import require_packages
from ogmkit.base.names import matching
from ogmkit.drawing.palette import ThemeName, themed
from ogmkit.errors import OutputError
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.shards import schema
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.view.entities import (
    Entity,
    frame_entities,
    lost_entities,
    predicted_entities,
    scene_entities,
)
from ogmkit.view.frames import Moment, moments, read_frame, shown_rasters
from ogmkit.view.layout import SceneLayout, blueprint
from ogmkit.view.places import Camera
from ogmkit.view.predictions import Place, Reader, Source, open_predictions
from ogmkit.view.recording import flush, recording_to

TIME, FRAME = "time", "frame"
"""Timelines: the image's own time, and the key frame's place in its scene."""


@dataclass(frozen=True)
class Shown:
    """What a recording shows.

    Attributes:
        scenes: names, or patterns such as `scene-00*`; empty = all.
        cameras: channels; empty = all.
        predictions: folders of masks and files of plans that `ogmkit predict` wrote.
        dataroot: where images are that the shards only refer to; None leaves them out.
        theme: colours.
    """

    scenes: Sequence[str] = ()
    cameras: Sequence[str] = ()
    predictions: Sequence[Path] = ()
    dataroot: Path | None = None
    theme: ThemeName = "dark"


def view(
    out: Path,
    save: Path | None = None,
    shown: Shown | None = None,
    *,
    overwrite: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> int:
    """Record shards as one recording, with each scene under its own entity path.

    Args:
        out: a folder that `ogmkit extract` finished.
        save: the file, whole or absent at the end; None starts a viewer.
        shown: what is recorded.
        overwrite: replace the file if it is there.
        on_progress: called with (key frames done, key frames in all).

    Returns:
        Number of key frames.

    Raises:
        MissingPackageError: the extra `view` isn't installed.
        SettingsError: an unknown scene or camera, or predictions that have none of the scenes.
        ShardError: the manifest or a shard is absent or damaged.
        DataFileError, TableError: an image or a prediction is absent or damaged.
        OutputError: the file is there, lies among the shards or can't be written, or no viewer can be shown.
    """
    require_packages("view", ("rerun",))
    if save is not None:
        require_outside(save, out)
        if save.exists() and not overwrite:
            raise OutputError(f"{save}: is there already; choose another name, or --overwrite")
    shown, manifest = shown or Shown(), read_manifest(out)
    entries = _entries(manifest, out, shown.scenes)
    cameras = matching("camera", shown.cameras, chosen_cameras(out, manifest, ()), out)
    names, grid = [entry.scene for entry in entries], manifest.settings.targets.grid
    sources = open_predictions(shown.predictions, names, grid)
    with themed(shown.theme):
        layouts, found = [], []
        for entry in entries:
            with listed_shard(out, entry) as shard:
                layouts.append(_layout(shard, cameras, sources))
                found.append(moments(shard, cameras))
        total = sum(map(len, found))
        with recording_to(save, out.resolve().name, blueprint(layouts)) as stream:
            done = 0
            for entry, layout, of_scene in zip(entries, layouts, found, strict=True):
                with listed_shard(out, entry) as shard:
                    for _ in _record(stream, shard, layout, of_scene, sources, shown.dataroot):
                        done += 1
                        if on_progress is not None:
                            on_progress(done, total)
    return total


def _record(
    stream: Any,  # noqa: ANN401  # Rerun's
    shard: Shard,
    layout: SceneLayout,
    found: Sequence[Moment],
    sources: Sequence[Source],
    dataroot: Path | None,
) -> Iterator[None]:
    """Log a scene; yields once a key frame, when it is written."""
    with ExitStack() as stack:
        readers = [stack.enter_context(one.opened(layout.scene)) for one in sources]
        scene = _Scene(shard, layout.cameras, readers, dataroot)
        _log(stream, scene_entities(layout.scene, layout.cameras), static=True)
        for moment in found:
            scene.log(stream, moment)
            flush(stream)
            yield


@dataclass(frozen=True, eq=False)
class _Scene:
    """An open shard with its predictions."""

    shard: Shard
    cameras: Sequence[Camera]
    readers: Sequence[Reader]
    dataroot: Path | None

    def log(self, stream: Any, moment: Moment) -> None:  # noqa: ANN401  # Rerun's
        """Log a key frame: each camera at its own time."""
        for camera in self.cameras:
            index = moment.frames.get(camera.channel)
            if index is None:
                _stamp(stream, moment.number, moment.time_us)
                _log(stream, lost_entities(camera))
                continue
            frame = read_frame(self.shard, camera.channel, index, self.dataroot)
            _stamp(stream, moment.number, frame.time_us)
            _log(stream, frame_entities(camera, frame))
            token = self.shard.strings(camera.channel, "sample_token", slice(index, index + 1))[0]
            place = Place(camera.scene, camera.channel, index, token)
            for reader in self.readers:
                found = reader.read(place)
                _log(stream, predicted_entities(camera, reader.source.name, found, frame.image_size))


def _log(stream: Any, entities: Iterable[Entity], *, static: bool = False) -> None:  # noqa: ANN401  # Rerun's
    for place, archetype in entities:
        stream.log(place, archetype, static=static)


def _stamp(stream: Any, number: int, time_us: int) -> None:  # noqa: ANN401  # Rerun's
    stream.set_time(FRAME, sequence=number)
    stream.set_time(TIME, timestamp=np.datetime64(time_us, "us"))


def _entries(manifest: Manifest, out: Path, scenes: Sequence[str]) -> tuple[ShardEntry, ...]:
    chosen = matching("scene", scenes, [entry.scene for entry in manifest.shards], out)
    return tuple(entry for entry in manifest.shards if entry.scene in chosen)


def _layout(shard: Shard, cameras: Sequence[str], sources: Sequence[Source]) -> SceneLayout:
    rasters = shown_rasters(shard)
    return SceneLayout(
        scene=shard.scene,
        cameras=tuple(Camera(shard.scene, one, shard.grid, rasters) for one in cameras),
        footprints=_names(shard, cameras, schema.FOOTPRINTS.name),
        homographies=_names(shard, cameras, schema.HOMOGRAPHY.name),
        predictions=tuple(one.name for one in sources if one.has(shard.scene)),
    )


def _names(shard: Shard, cameras: Sequence[str], kind: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for camera in cameras for name in shard.added(camera, kind)))
