"""What `ogmkit inspect` found, as text for terminals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

from .text import text_table, with_number

_Held = Mapping[str, Any]


def _dataset(held: _Held) -> Iterator[str]:
    scenes = held["scenes"]
    frames, boxes = (sum(scene[name] for scene in scenes) for name in ("frames", "boxes"))
    yield f"{held['path']}: {held['version']}, {len(scenes):,} scenes, {frames:,} key frames, {boxes:,} boxes"
    yield f"cameras: {', '.join(held['cameras'])}"
    splits = ", ".join(f"{name} ({len(names)})" for name, names in held["splits"].items())
    yield f"splits: {splits or 'none'}"
    yield ""
    rows = [
        (
            *(scene[name] for name in ("name", "location", "frames")),
            len(scene["cameras"]),
            scene["boxes"],
            f"{scene['images_present']:,} of {scene['images']:,}",
        )
        for scene in scenes
    ]
    yield text_table(("scene", "location", "key frames", "cameras", "boxes", "images present"), rows)


def _shards(held: _Held) -> Iterator[str]:
    bare = _bare(held["settings"].get("no_map", False))
    yield f"{held['path']}: {with_number(len(held['shards']), 'shard')} of {held['version']}{bare}"
    yield ""
    rows = [
        (*(shard[name] for name in ("scene", "location", "frames", "bytes")), ", ".join(shard["splits"]))
        for shard in held["shards"]
    ]
    yield text_table(("scene", "location", "frames", "bytes", "splits"), rows)
    yield ""
    yield from _left_out(held)
    if not held["invalid"]:
        yield "invalid frames: none"
        return
    counts = [tuple(one[name] for name in ("camera", "of", "frames", "reason")) for one in held["invalid"]]
    yield text_table(("camera", "invalid", "frames", "reason"), counts)


def _shard(held: _Held) -> Iterator[str]:
    grid = held["grid"]
    yield f"{held['path']}: {held['scene']}, {held['location']}, {held['version']}{_bare(held['no_map'])}"
    yield (
        f"grid: {grid['rows']} rows × {grid['columns']} columns, {grid['m_per_cell']} m a cell, "
        f"ego at row {grid['ego_row']}, column {grid['ego_column']}"
    )
    for camera in held["cameras"]:
        yield ""
        yield f"{camera['camera']}: {camera['frames']} frames"
        rows = [
            (one["name"], " × ".join(map(str, one["shape"])), one["type"], one["holds"])
            for one in camera["datasets"]
        ]
        yield text_table(("dataset", "shape", "type", "holds"), rows)
    yield ""
    yield from _labels(held)
    yield from _left_out(held)
    if not held["invalid"]:
        yield "invalid frames: none"
        return
    found = [
        (one["camera"], one["of"], len(one["frames"]), one["reason"], _places(one["frames"]))
        for one in held["invalid"]
    ]
    yield text_table(("camera", "invalid", "frames", "reason", "which, from 0"), found)


def _labels(held: _Held) -> Iterator[str]:
    """Labels by name, where there are any."""
    if held["labels"]:
        rows = [
            (f"{one['definition']} v{one['version']}", one["place"], one["samples"], ", ".join(one["arrays"]))
            for one in held["labels"]
        ]
        yield text_table(("labels", "below", "samples", "arrays"), rows)
        yield ""


def _bare(no_map: bool) -> str:
    return ", without drivable area (--no-map)" if no_map else ""


def _left_out(held: _Held) -> Iterator[str]:
    """Frames that are not there."""
    if held["left_out"]:
        counts = [tuple(one[name] for name in ("camera", "frames", "reason")) for one in held["left_out"]]
        yield text_table(("camera", "left out", "reason"), counts)
        yield ""


def _run(held: _Held) -> Iterator[str]:
    yield f"{held['path']}: training of {held['system']}"
    scenes = ", ".join(f"{split} ({len(names)})" for split, names in held["scenes"].items())
    yield f"scenes: {scenes or 'unknown'}"
    yield f"checkpoints: {', '.join(held['checkpoints']) or 'none yet'}"
    if held["figures"]:
        yield ""
        rows = [(one["name"], one["epoch"], one["step"], f"{one['value']:.6g}") for one in held["figures"]]
        yield text_table(("figure", "epoch", "step", "last value"), rows)
    yield from _settings(held["settings"])


def _checkpoint(held: _Held) -> Iterator[str]:
    grid = held["grid"]
    yield f"{held['path']}: {held['system']}, epoch {held['epoch']}, by ogmkit {held['package_version']}"
    yield f"cameras: {', '.join(held['cameras'])}"
    yield f"grid: {grid['rows']} rows × {grid['columns']} columns, {grid['m_per_cell']} m a cell"
    if held["adapted"]:
        made = held["adapted"]
        share = "" if made["share"] == 1 else f", with a share of {made['share']:g}"
        images = f"{made['images']} images of {made['source']}{share}"
        yield f"batch normalisation: by {images}, from {made['run']}"
    yield from _settings(held["settings"])


def _settings(settings: Mapping[str, Any]) -> Iterator[str]:
    yield ""
    yield text_table(("setting", "value"), [(name, _shown(value)) for name, value in settings.items()])


def _shown(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    return "" if value is None else str(value)


def _places(frames: Sequence[int]) -> str:
    """Numbers in order, those that follow each other joined: `0-5, 9`."""
    runs = [
        [frame for _, frame in run] for _, run in groupby(enumerate(frames), lambda pair: pair[1] - pair[0])
    ]
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


WRITERS: Mapping[str, Callable[[_Held], Iterator[str]]] = {
    "dataset": _dataset,
    "shards": _shards,
    "shard": _shard,
    "run": _run,
    "checkpoint": _checkpoint,
}
"""Kind of what was found → its lines."""
