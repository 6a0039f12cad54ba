"""Contact sheets of extracted frames, as PNG files: one for each scene, subject, and camera, or for all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.atomic import output_errors, require_outside
from ogmkit.base.execution import Execution, run_over
from ogmkit.base.names import matching, with_number
from ogmkit.drawing.bev_panel import plan_for
from ogmkit.drawing.legend import Group
from ogmkit.drawing.palette import themed
from ogmkit.drawing.png import write_png
from ogmkit.drawing.sheet import Heading, draw_sheet
from ogmkit.errors import SettingsError, ShardError
from ogmkit.pictures import surround
from ogmkit.pictures.further_panel import further_groups
from ogmkit.pictures.masks import MaskSet, open_sets
from ogmkit.pictures.settings import PreviewSettings, View
from ogmkit.pictures.subjects import PLANE_SIZE, SUBJECTS, Subject
from ogmkit.pictures.views import evenly, read_view
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_further import further_rasters
from ogmkit.shards.schema_labels import SURROUND
from ogmkit.typing import UInt8Array

DEFAULT = PreviewSettings()


def preview(
    out: Path,
    pictures: Path | None = None,
    settings: PreviewSettings = DEFAULT,
    *,
    scenes: Sequence[str] = (),
    cameras: Sequence[str] = (),
    dataroot: Path | None = None,
    workers: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> tuple[Path, ...]:
    """Draw contact sheets of shards.

    Args:
        out: a folder that `ogmkit extract` finished.
        pictures: where the PNGs go; None = beside `out`, its name with `-preview`. Sheets of an earlier run
            are replaced.
        settings: what sheets show.
        scenes: names, or patterns such as `scene-00*`; empty = all.
        cameras: channels; empty = all.
        dataroot: where to find images that the shards only refer to; None draws an empty panel instead.
        workers: number of worker processes, as of `ogmkit.base.execution.Execution`.
        on_progress: called with (done, total) sheets.

    Returns:
        The files written.

    Raises:
        SettingsError: an unknown scene or camera, or a set of masks that a view would draw twice.
        ShardError: the manifest, a shard or a set of masks is absent, damaged or of another version.
        DataFileError: an image is absent or damaged.
        OutputError: `pictures` lies inside `out` or can't be written.
    """
    _require_distinct(settings)
    folder = out.resolve()
    target = folder.with_name(f"{folder.name}-preview") if pictures is None else pictures
    require_outside(target, out)
    chosen = _chosen(read_manifest(out), out, scenes, cameras)
    with output_errors(target):
        target.mkdir(parents=True, exist_ok=True)
    sheets = _sheets(out, target, chosen, settings, dataroot)
    for done, _ in enumerate(run_over(_write, sheets, Execution(workers)), start=1):
        if on_progress is not None:
            on_progress(done, len(sheets))
    return tuple(sheet.path for sheet in sheets)


@dataclass(frozen=True)
class _Sheet:
    """A sheet to draw: the file that it becomes, shards with entry and camera, and what to show of them."""

    path: Path
    place: tuple[Path, ShardEntry, str]
    view: View
    settings: PreviewSettings
    dataroot: Path | None


def _sheets(
    out: Path,
    target: Path,
    chosen: Sequence[tuple[ShardEntry, str]],
    settings: PreviewSettings,
    dataroot: Path | None,
) -> list[_Sheet]:
    """Of each camera and view; then, where that is asked for, of all of a scene's cameras."""
    views = tuple(dict.fromkeys(settings.views))
    named: list[tuple[ShardEntry, str, View]] = [
        (entry, camera, view) for entry, camera in chosen for view in views if view in SUBJECTS
    ]
    if surround.VIEW in views:
        entries = {entry.file: entry for entry, _ in chosen}
        named += [(entry, SURROUND, surround.VIEW) for entry in entries.values()]
    return [
        _Sheet(
            target / f"{Path(entry.file).stem}_{camera}{_ending(view, settings.masks)}.png",
            (out, entry, camera),
            view,
            settings,
            dataroot,
        )
        for entry, camera, view in named
    ]


def _write(sheet: _Sheet) -> None:
    out, entry, camera = sheet.place
    with listed_shard(out, entry) as shard:
        if sheet.view == surround.VIEW:
            pixels = surround.draw_surround(shard, sheet.settings, sheet.dataroot)
        else:
            pixels = draw_shard(shard, camera, sheet.view, sheet.settings, sheet.dataroot)
    write_png(sheet.path, pixels)


def draw_shard(
    shard: Shard,
    camera: str,
    view: View = "targets",
    settings: PreviewSettings = DEFAULT,
    dataroot: Path | None = None,
) -> UInt8Array:
    """Draw a camera's contact sheet of a view: (h, w, 3) uint8 RGB; arguments and errors as for `preview`."""
    if camera not in shard.cameras:
        raise ShardError(f"{shard.path}: lacks camera {camera}, which the manifest names; {REMEDY}")
    kind, names = SUBJECTS[view], SUBJECTS[view].sets(settings.masks)
    count = shard.frames(camera)
    indices = evenly(settings.frames, count)
    if not indices:
        raise ShardError(f"{shard.path}: camera {camera} has no frame; {REMEDY}")
    if kind.further and not shard.settings.targets.further:
        raise ShardError(
            f"{shard.path}: has nothing beside the paper's targets to draw; extract with --layers, "
            "--classes, --instances or --future"
        )
    try:
        sets = open_sets(shard, camera, names) if names else ()
        pasts = [shard.dataset(camera, "trajectory/past")[index] for index in indices] if kind.paths else ()
        plan = plan_for(shard.grid, pasts, PLANE_SIZE)
        views = (
            read_view(shard, camera, index, dataroot=dataroot, further=kind.further) for index in indices
        )
        with themed(settings.theme):
            tiles = [kind.tile(view, plan, sets) for view in views]
            heading = Heading(shard.scene, camera, _note(shard, camera, sets))
            return draw_sheet(heading, tiles, kind.columns, _groups(kind, shard))
    except OSError as error:
        raise damaged(shard.path, error) from error


def _groups(kind: Subject, shard: Shard) -> tuple[Group, ...]:
    """The legend's: of what the shard has, where that is what is shown."""
    return kind.groups + (further_groups(further_rasters(shard.settings.targets)) if kind.further else ())


def _note(shard: Shard, camera: str, sets: Sequence[MaskSet]) -> str:
    grid, parts = shard.grid, []
    left_out = shard.left_out(camera)
    if sets:
        chosen = sets[-1]
        other = "" if chosen.homography == chosen.name else f", homography {chosen.homography}"
        parts.append(f"footprints {chosen.name} at 1:{chosen.scale:g}{other}")
    parts += [
        shard.location,
        shard.dataset_version,
        with_number(shard.frames(camera), "frame") + (f", {left_out} left out" if left_out else ""),
        f"{grid.rows} by {grid.columns} cells of {grid.m_per_cell:g} m",
    ]
    if shard.settings.targets.no_map:
        parts.append("drivable area unknown (--no-map)")
    return " · ".join(parts)


def _require_distinct(settings: PreviewSettings) -> None:
    for view in SUBJECTS.keys() & set(settings.views):
        if SUBJECTS[view].sets(settings.masks).count(settings.masks) > 1:
            raise SettingsError(f"view {view}: set {settings.masks!r} would be drawn twice; choose another")


def _ending(subject: str, mask_set: str) -> str:
    """What tells a sheet's file from those of other subjects and sets."""
    kind = SUBJECTS.get(subject)
    if kind is not None and kind.further:
        return f"_{subject}"
    shown = kind.sets(mask_set) if kind is not None else ()
    return f"_{subject}_{shown[-1]}" if shown else ""


def _chosen(
    manifest: Manifest, out: Path, scenes: Sequence[str], cameras: Sequence[str]
) -> tuple[tuple[ShardEntry, str], ...]:
    """Shards and cameras asked for, in the manifest's order."""
    known_scenes = tuple(entry.scene for entry in manifest.shards)
    chosen_scenes = matching("scene", scenes, known_scenes, out)
    known_cameras = chosen_cameras(out, manifest, ())
    return tuple(
        (entry, camera)
        for entry in manifest.shards
        if entry.scene in chosen_scenes
        for camera in matching("camera", cameras, known_cameras, out)
    )
