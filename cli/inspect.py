"""`ogmkit inspect`: what a dataset, shards, a training or a checkpoint holds."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .command import Command
from .options import json_option, version_option
from .paths import SHARDS_OR_FILE
from .text import json_text, lines_text

if TYPE_CHECKING:
    from ogmkit.shards.reader import Shard


@click.command(
    cls=Command,
    examples=(
        "ogmkit inspect shards",
        "ogmkit inspect runs/footprints --json",
    ),
)
@click.argument("path", type=SHARDS_OR_FILE)
@version_option
@json_option
def command(path: Path, version: str | None, as_json: bool) -> None:
    """Show what a dataset, shards, a training or a checkpoint holds.

    PATH is a dataset's root, a folder that `ogmkit extract` wrote or a shard in it (scene.h5), a RUN folder
    that `ogmkit train` wrote, or a checkpoint (file.ckpt), which needs torch to be read. Of shards, also the
    frames that lack a valid trajectory, homography or set of masks are listed, with the reason, and how many
    were left out.

    Fields of --json: path, kind (dataset, shards, shard, run or checkpoint), then by kind:

    \b
    dataset     version, cameras, splits, scenes
    shards      version, dataroot, settings, shards, invalid (camera, of, reason, frames: how many),
                left_out (camera, reason, frames: how many)
    shard       scene, location, version, grid, no_map, cameras (camera, frames, datasets),
                labels (place, definition, version, samples, arrays),
                invalid (scene, camera, of, reason, frames: their numbers from 0),
                left_out (camera, reason, frames: how many)
    run         system, settings, scenes, checkpoints, figures (epoch, step, name, value)
    checkpoint  system, settings, grid, cameras, epoch, package_version, adapted (null, or run, sha256,
                source, scenes, images, share)
    """  # noqa: D301  # Click wants the character
    kind = _kind(path)
    held = {"path": str(path), "kind": kind, **_READERS[kind](path, version)}
    if as_json:
        click.echo(json_text(held))
        return
    from .inspect_text import WRITERS

    for part in WRITERS[kind](held):
        click.echo(lines_text(part.split("\n")))


def _kind(path: Path) -> str:
    """What a path is, by its looks."""
    from ogmkit.learn.run_summary import is_checkpoint, is_run
    from ogmkit.shards.manifest import NAME

    if path.is_file():
        return "checkpoint" if is_checkpoint(path) else "shard"
    if is_run(path):
        return "run"
    return "shards" if (path / NAME).is_file() else "dataset"


def _dataset(root: Path, version: str | None) -> dict[str, Any]:
    from ogmkit.nuscenes.dataset import Dataset

    with Dataset(root, version) as dataset:
        return {
            "version": dataset.version,
            "cameras": dataset.channels(),
            "splits": dataset.splits(),
            "scenes": [asdict(scene) for scene in dataset.overview()],
        }


def _shards(folder: Path, version: str | None) -> dict[str, Any]:
    del version
    from ogmkit.shards.invalid import count_invalid
    from ogmkit.shards.left_out import count_left_out_of_all
    from ogmkit.shards.manifest import read_manifest

    manifest = read_manifest(folder)
    return {
        "version": manifest.dataset_version,
        "dataroot": manifest.dataroot,
        "settings": manifest.settings.to_dict(),
        "shards": [asdict(entry) for entry in manifest.shards],
        "invalid": [asdict(count) for count in count_invalid(folder, manifest)],
        "left_out": [asdict(count) for count in count_left_out_of_all(folder, manifest)],
    }


def _shard(path: Path, version: str | None) -> dict[str, Any]:
    del version
    from ogmkit.shards.contents import labels_in
    from ogmkit.shards.faults import H5_ERRORS, damaged
    from ogmkit.shards.invalid import invalid_frames
    from ogmkit.shards.left_out import count_left_out
    from ogmkit.shards.reader import Shard

    with Shard(path) as shard:
        try:
            return {
                "scene": shard.scene,
                "location": shard.location,
                "version": shard.dataset_version,
                "grid": asdict(shard.grid),
                "no_map": shard.settings.targets.no_map,
                "cameras": [_camera(shard, camera) for camera in shard.cameras],
                "labels": [asdict(one) for one in labels_in(shard)],
                "invalid": [asdict(found) for found in invalid_frames(shard)],
                "left_out": [asdict(count) for count in count_left_out(shard)],
            }
        except H5_ERRORS as error:
            raise damaged(path, error) from error


def _camera(shard: Shard, camera: str) -> dict[str, Any]:
    from ogmkit.shards.contents import datasets_of

    datasets = [asdict(found) for found in datasets_of(shard, camera)]
    return {"camera": camera, "frames": shard.frames(camera), "datasets": datasets}


def _run(folder: Path, version: str | None) -> dict[str, Any]:
    del version
    from .extras import require_yaml

    require_yaml()
    from ogmkit.learn.run_summary import summarise_run

    return asdict(summarise_run(folder))


def _checkpoint(path: Path, version: str | None) -> dict[str, Any]:
    del version
    from .extras import require_train

    require_train()
    from ogmkit.learn.run_summary import summarise_checkpoint

    return asdict(summarise_checkpoint(path))


_READERS = {
    "dataset": _dataset,
    "shards": _shards,
    "shard": _shard,
    "run": _run,
    "checkpoint": _checkpoint,
}
