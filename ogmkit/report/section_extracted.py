"""What was extracted, from what, with which settings; and the scenes."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.base.stated import stated_fields
from ogmkit.grid import GridSpec
from ogmkit.report.html import Html, element, joined
from ogmkit.report.part import Part
from ogmkit.report.sections import Section, facts, number, percent, sortable, tiles
from ogmkit.shards.manifest import Manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings


def extracted_section(folder: Path, manifest: Manifest, parts: Sequence[Part]) -> Section:
    """Large figures, then the facts, then all settings."""
    return Section(
        "extracted",
        "What was extracted",
        "",
        joined((tiles(_figures(manifest, parts)), facts(_facts(folder, manifest)), _settings(manifest))),
    )


def scenes_section(parts: Sequence[Part]) -> Section:
    """A row a scene."""
    header = (
        *("Scene", "Map", "Split", "Frames", "Left out", "Trajectories", "Drivable", "Vehicles", "Size"),
    )
    return Section(
        "scenes",
        "Scenes",
        "Trajectories: frames whose past and future are all there. Drivable, vehicles: share of all cells.",
        sortable(header, map(_scene, parts)),
    )


def _scene(part: Part) -> Iterable[object]:
    one = part.summary
    yield from (one.scene, one.location, ", ".join(part.entry.splits))
    yield from (number(one.frames), number(one.left_out))
    yield number(one.valid_trajectories / max(one.frames, 1), 0, 100, " %")
    yield from (number(one.drivable_share, 1, 100, " %"), number(one.vehicle_share, 2, 100, " %"))
    yield number(one.bytes / 1e6, 1, unit=" MB")


def _figures(manifest: Manifest, parts: Sequence[Part]) -> dict[str, tuple[object, str]]:
    summaries = [part.summary for part in parts]
    maps = with_number(len({one.location for one in summaries}), "map")
    frames = sum(one.frames for one in summaries)
    valid, left_out = (
        sum(getattr(one, name) for one in summaries) for name in ("valid_trajectories", "left_out")
    )
    shares = np.array([one.drivable_share for one in summaries])
    weights = np.array([one.frames for one in summaries])
    drivable = float(np.average(shares, weights=weights)) if frames else math.nan
    vehicles = sum(int(part.distributions.ranges.sum()) for part in parts)
    cameras = manifest.settings.cameras
    return {
        "Scenes": (f"{len(parts):,}", maps),
        "Frames": (
            f"{frames:,}",
            f"{left_out:,} left out" if left_out else with_number(len(cameras), "camera"),
        ),
        "Trajectories": (percent(valid / max(frames, 1), 0), "whole, of all frames"),
        "Vehicles": (f"{vehicles:,}", f"{vehicles / max(frames, 1):.1f} a frame"),
        "Drivable": (percent(drivable), "of all cells"),
    }


def _facts(folder: Path, manifest: Manifest) -> dict[str, object]:
    settings, targets = manifest.settings, manifest.settings.targets
    grid = targets.grid
    return {
        "Shards": folder,
        "Dataset": f"{manifest.dataset_version} at {manifest.dataroot}",
        "Cameras": ", ".join(settings.cameras),
        "Grid": (
            f"{grid.rows:,} × {grid.columns:,} cells of {grid.m_per_cell:g} m, "
            f"{grid.rows * grid.m_per_cell:g} × {grid.columns * grid.m_per_cell:g} m"
        ),
        "Vehicles": f"boxes of {', '.join(targets.categories)}",
        "Steps": f"{targets.step_s:g} s, gaps up to {targets.gap_s:g} s",
        "Images": {"bytes": "kept in the shards", "reference": "in the dataset", "none": "left out"}[
            targets.images
        ],
        "Drivable area": "unknown (--no-map)" if targets.no_map else "",
        "Labels by name": ", ".join(one.name for one in settings.labels),
        "Splits": ", ".join(sorted({split for one in manifest.shards for split in one.splits})),
    }


def _settings(manifest: Manifest) -> Html:
    """All settings, those that differ from the default marked."""
    settings = manifest.settings
    records: tuple[tuple[Any, Any], ...] = (
        (settings.targets.grid, GridSpec()),
        (settings.targets, TargetSettings()),
        (settings, ExtractSettings()),
    )
    rows = [
        (name, getattr(record, name), getattr(default, name), stated.help)
        for record, default in records
        for name, stated in stated_fields(type(record)).items()
    ]
    changed = sum(value != default for _, value, default, _ in rows)
    body = (
        element(
            "tr",
            element("th", name, scope="row"),
            element("td", _shown(value), class_="changed" if value != default else None),
            element("td", text, class_="note"),
        )
        for name, value, default, text in rows
    )
    summary = element("summary", f"All settings, {changed} of {len(rows)} other than the default")
    return element(
        "details", summary, element("div", element("table", element("tbody", *body)), class_="scroll")
    )


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    if value is None:
        return "default"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)
