"""Contact sheets of extracted frames, as PNG files: one for each scene and camera."""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.pictures.sheet import draw_sheet
from ogmkit.pictures.views import View, evenly, read_view
from ogmkit.shards.atomic import output_errors, replacing
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest
from ogmkit.shards.reader import REMEDY, Shard
from ogmkit.typing import UInt8Array

MAX_FRAMES = 60
"""Frames of one sheet: about 300 MB of pixels."""

_PNG_SETTINGS = (cv2.IMWRITE_PNG_COMPRESSION, 4)  # 6 takes three times as long and saves 5 %


def preview(
    out: Path,
    pictures: Path | None = None,
    *,
    scenes: Sequence[str] = (),
    cameras: Sequence[str] = (),
    frames: int = 6,
    dataroot: Path | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> tuple[Path, ...]:
    """Draw contact sheets of shards.

    Args:
        out: a folder that `ogmkit extract` finished.
        pictures: where the PNGs go; None = beside `out`, its name with `-preview`. Sheets of an earlier run
            are replaced.
        scenes: names; empty = all.
        cameras: channels; empty = all.
        frames: how many frames a sheet shows, evenly spread over the scene.
        dataroot: where to find images that the shards only refer to; None draws an empty panel instead.
        on_progress: called with (done, total) sheets.

    Returns:
        The files written.

    Raises:
        SettingsError: an unknown scene or camera, or a number of frames out of range.
        ShardError: the manifest or a shard is absent, damaged or of another version.
        DataFileError: an image is absent or damaged.
        OutputError: `pictures` lies inside `out` or can't be written.
    """
    if not 1 <= frames <= MAX_FRAMES:
        raise SettingsError(f"frames: {frames} is not between 1 and {MAX_FRAMES}")
    folder = out.resolve()
    target = folder.with_name(f"{folder.name}-preview") if pictures is None else pictures
    if target.resolve().is_relative_to(folder):
        raise OutputError(f"{target}: lies in {out}, which holds nothing but shards; choose another folder")
    chosen = _chosen(read_manifest(out), out, scenes, cameras)
    with output_errors(target):
        target.mkdir(parents=True, exist_ok=True)
    written = []
    for entry, camera in chosen:
        path = target / f"{Path(entry.file).stem}_{camera}.png"
        with Shard(out / entry.file) as shard:
            _write_png(path, draw_shard(shard, camera, frames, dataroot))
        written.append(path)
        if on_progress is not None:
            on_progress(len(written), len(chosen))
    return tuple(written)


def draw_shard(shard: Shard, camera: str, frames: int, dataroot: Path | None = None) -> UInt8Array:
    """Draw one camera's contact sheet: (h, w, 3) uint8 RGB; arguments and errors as for `preview`."""
    if camera not in shard.cameras:
        raise ShardError(f"{shard.path}: lacks camera {camera}, which the manifest names; {REMEDY}")
    grid, count = shard.grid, shard.frames(camera)
    views = [_read(shard, camera, index, dataroot) for index in evenly(frames, count)]
    if not views:
        raise ShardError(f"{shard.path}: camera {camera} has no frame; {REMEDY}")
    note = (
        f"{shard.location} · {shard.dataset_version} · {count} frame{'s' if count > 1 else ''} · "
        f"{grid.rows} by {grid.columns} cells of {grid.m_per_cell:g} m"
    )
    return draw_sheet(shard.scene, camera, note, grid, views)


def _read(shard: Shard, camera: str, index: int, dataroot: Path | None) -> View:
    try:
        return read_view(shard, camera, index, dataroot=dataroot)
    except OSError as error:
        raise ShardError(
            f"{shard.path}: {camera}: frame {index} can't be read ({error}); {REMEDY}"
        ) from error


def _chosen(
    manifest: Manifest, out: Path, scenes: Sequence[str], cameras: Sequence[str]
) -> tuple[tuple[ShardEntry, str], ...]:
    """Shards and cameras asked for, in the manifest's order."""
    known_scenes = tuple(entry.scene for entry in manifest.shards)
    known_cameras = manifest.settings.cameras
    for kind, asked, known in (("scene", scenes, known_scenes), ("camera", cameras, known_cameras)):
        for name in asked:
            if name not in known:
                raise SettingsError(f"{out}: has no {kind} {name!r}; it has {', '.join(known) or 'none'}")
    return tuple(
        (entry, camera)
        for entry in manifest.shards
        for camera in known_cameras
        if entry.scene in (scenes or known_scenes) and camera in (cameras or known_cameras)
    )


def _write_png(path: Path, pixels: UInt8Array) -> None:
    """Write (h, w, 3) RGB pixels atomically."""
    _, data = cv2.imencode(".png", np.ascontiguousarray(pixels[..., ::-1]), _PNG_SETTINGS)
    with replacing(path) as part:
        part.write_bytes(data.tobytes())
