"""`ogmkit inspect`: what a dataset, a shard or a folder of shards holds."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import version_option
from .text import text_table

if TYPE_CHECKING:
    import h5py

    from ogmkit.shards.reader import Shard


@click.command()
@click.argument("path", type=click.Path(exists=True, path_type=Path))
@version_option
def command(path: Path, version: str | None) -> None:
    """Show what a dataset or a shard holds.

    PATH is a dataset's root, a shard (scene.h5), or a folder that `ogmkit extract` wrote.
    """
    if path.is_file():
        click.echo(_shard(path))
    elif (path / "manifest.json").is_file():
        click.echo(_shards(path))
    else:
        click.echo(_dataset(path, version))


def _dataset(root: Path, version: str | None) -> str:
    from ogmkit.nuscenes.dataset import Dataset

    with Dataset(root, version) as dataset:
        scenes, cameras, splits = dataset.overview(), dataset.channels(), dataset.splits()
        found = dataset.version
    rows = [
        (s.name, s.location, s.frames, len(s.cameras), s.boxes, f"{s.images_present:,} of {s.images:,}")
        for s in scenes
    ]
    return "\n".join(
        (
            f"{root}: {found}, {len(scenes):,} scenes, {sum(s.frames for s in scenes):,} key frames, "
            f"{sum(s.boxes for s in scenes):,} boxes",
            f"cameras: {', '.join(cameras)}",
            f"splits: {', '.join(f'{name} ({len(names)})' for name, names in splits.items()) or 'none'}",
            "",
            text_table(("scene", "location", "key frames", "cameras", "boxes", "images present"), rows),
        )
    )


def _shards(folder: Path) -> str:
    from ogmkit.shards.manifest import read_manifest

    manifest = read_manifest(folder)
    rows = [
        (shard.scene, shard.location, shard.frames, shard.bytes, ", ".join(shard.splits))
        for shard in manifest.shards
    ]
    return "\n".join(
        (
            f"{folder}: {len(rows)} shards of {manifest.dataset_version}",
            "",
            text_table(("scene", "location", "frames", "bytes", "splits"), rows),
        )
    )


def _shard(path: Path) -> str:
    from ogmkit.errors import ShardError
    from ogmkit.shards.reader import H5_ERRORS, REMEDY, Shard

    with Shard(path) as shard:
        try:
            return _shard_text(shard)
        except H5_ERRORS as error:
            raise ShardError(f"{path}: damaged inside ({error}); {REMEDY}") from error


def _shard_text(shard: "Shard") -> str:
    grid = shard.grid
    lines = [
        f"{shard.path}: {shard.scene}, {shard.location}, {shard.dataset_version}",
        f"grid: {grid.rows} rows × {grid.columns} columns, {grid.m_per_cell} m a cell, "
        f"ego at row {grid.ego_row}, column {grid.ego_column}",
    ]
    for camera in shard.cameras:
        lines += ["", f"{camera}: {shard.frames(camera)} frames", _datasets(shard.h5[camera])]
    return "\n".join(lines)


def _datasets(group: "h5py.Group") -> str:
    """A table of all datasets below a group."""
    import h5py

    rows: list[tuple[str, str, str, str]] = []

    def add(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            shape = " × ".join(str(side) for side in item.shape)
            text = h5py.check_string_dtype(item.dtype) is not None
            kind = "text" if text else str(h5py.check_vlen_dtype(item.dtype) or item.dtype)
            rows.append((name, shape, kind, str(item.attrs.get("description", ""))))

    group.visititems(add)
    return text_table(("dataset", "shape", "type", "holds"), rows)
