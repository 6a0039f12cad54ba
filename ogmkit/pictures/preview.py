"""Contact sheets of extracted frames, as PNG files: one for each scene, camera and subject."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ogmkit.base.atomic import output_errors, require_outside
from ogmkit.base.names import matching
from ogmkit.errors import SettingsError, ShardError
from ogmkit.pictures.bev_panel import plan_for
from ogmkit.pictures.masks import DEFAULT_SET, MaskSet, open_sets
from ogmkit.pictures.png import write_png
from ogmkit.pictures.sheet import Heading, draw_sheet
from ogmkit.pictures.subjects import PLANE_SIZE, SUBJECTS
from ogmkit.pictures.views import evenly, read_view
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest
from ogmkit.shards.reader import REMEDY, Shard
from ogmkit.typing import UInt8Array

MAX_FRAMES = 60
"""Frames of one sheet: about 300 MB of pixels."""


def preview(
    out: Path,
    pictures: Path | None = None,
    *,
    subjects: Sequence[str] = ("targets",),
    mask_set: str = DEFAULT_SET,
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
        subjects: what to draw, names of `ogmkit.pictures.subjects.SUBJECTS`; a sheet each.
        mask_set: which set of camera-view masks to draw, for subjects that show one.
        scenes: names, or patterns such as `scene-00*`; empty = all.
        cameras: channels; empty = all.
        frames: how many frames a sheet shows, evenly spread over the scene.
        dataroot: where to find images that the shards only refer to; None draws an empty panel instead.
        on_progress: called with (done, total) sheets.

    Returns:
        The files written.

    Raises:
        SettingsError: an unknown subject, scene or camera, or a number of frames out of range.
        ShardError: the manifest, a shard or a set of masks is absent, damaged or of another version.
        DataFileError: an image is absent or damaged.
        OutputError: `pictures` lies inside `out` or can't be written.
    """
    _check(subjects, mask_set, frames)
    folder = out.resolve()
    target = folder.with_name(f"{folder.name}-preview") if pictures is None else pictures
    require_outside(target, out)
    chosen = _chosen(read_manifest(out), out, scenes, cameras)
    with output_errors(target):
        target.mkdir(parents=True, exist_ok=True)
    sheets = [(*one, subject) for one in chosen for subject in dict.fromkeys(subjects)]
    written = []
    for entry, camera, subject in sheets:
        path = target / f"{Path(entry.file).stem}_{camera}{_ending(subject, mask_set)}.png"
        with Shard(out / entry.file) as shard:
            write_png(path, draw_shard(shard, camera, subject, frames, mask_set, dataroot))
        written.append(path)
        if on_progress is not None:
            on_progress(len(written), len(sheets))
    return tuple(written)


def draw_shard(
    shard: Shard,
    camera: str,
    subject: str = "targets",
    frames: int = 6,
    mask_set: str = DEFAULT_SET,
    dataroot: Path | None = None,
) -> UInt8Array:
    """Draw one camera's contact sheet: (h, w, 3) uint8 RGB; arguments and errors as for `preview`."""
    if camera not in shard.cameras:
        raise ShardError(f"{shard.path}: lacks camera {camera}, which the manifest names; {REMEDY}")
    kind, names = SUBJECTS[subject], SUBJECTS[subject].sets(mask_set)
    count = shard.frames(camera)
    indices = evenly(frames, count)
    if not indices:
        raise ShardError(f"{shard.path}: camera {camera} has no frame; {REMEDY}")
    try:
        sets = open_sets(shard, camera, names) if names else ()
        pasts = [shard.dataset(camera, "trajectory/past")[index] for index in indices] if kind.paths else ()
        plan = plan_for(shard.grid, pasts, PLANE_SIZE)
        views = (read_view(shard, camera, index, dataroot=dataroot) for index in indices)
        tiles = [kind.tile(view, plan, sets) for view in views]
    except OSError as error:
        raise ShardError(f"{shard.path}: {camera}: a frame can't be read ({error}); {REMEDY}") from error
    heading = Heading(shard.scene, camera, _note(shard, count, sets))
    return draw_sheet(heading, tiles, kind.columns, kind.groups)


def _note(shard: Shard, count: int, sets: Sequence[MaskSet]) -> str:
    grid, parts = shard.grid, []
    if sets:
        chosen = sets[-1]
        other = "" if chosen.homography == chosen.name else f", homography {chosen.homography}"
        parts.append(f"footprints {chosen.name} at 1:{chosen.scale:g}{other}")
    parts += [
        shard.location,
        shard.dataset_version,
        f"{count} frame{'s' if count > 1 else ''}",
        f"{grid.rows} by {grid.columns} cells of {grid.m_per_cell:g} m",
    ]
    return " · ".join(parts)


def _check(subjects: Sequence[str], mask_set: str, frames: int) -> None:
    for name in subjects:
        if name not in SUBJECTS:
            raise SettingsError(f"view {name!r} is unknown: choose from {', '.join(SUBJECTS)}")
        if SUBJECTS[name].sets(mask_set).count(mask_set) > 1:
            raise SettingsError(f"view {name}: set {mask_set!r} would be drawn twice; choose another")
    if not 1 <= frames <= MAX_FRAMES:
        raise SettingsError(f"frames: {frames} is not between 1 and {MAX_FRAMES}")


def _ending(subject: str, mask_set: str) -> str:
    """What tells a sheet's file from those of other subjects and sets."""
    shown = SUBJECTS[subject].sets(mask_set)
    return f"_{subject}_{shown[-1]}" if shown else ""


def _chosen(
    manifest: Manifest, out: Path, scenes: Sequence[str], cameras: Sequence[str]
) -> tuple[tuple[ShardEntry, str], ...]:
    """Shards and cameras asked for, in the manifest's order."""
    known_scenes = tuple(entry.scene for entry in manifest.shards)
    chosen_scenes = matching("scene", scenes, known_scenes, out)
    chosen_cameras = matching("camera", cameras, manifest.settings.cameras, out)
    return tuple(
        (entry, camera)
        for entry in manifest.shards
        if entry.scene in chosen_scenes
        for camera in chosen_cameras
    )
