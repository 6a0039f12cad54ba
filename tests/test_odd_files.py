"""A pipe, a device or a folder where a file should be: one line that names it, at once."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ogmkit.errors import OgmkitError
from ogmkit.learn.predict.json_values import json_object
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.png import read_grey_png
from ogmkit.nuscenes.splits import read_split_file
from ogmkit.nuscenes.tables import Tables
from ogmkit.raster.lidar import read_points
from ogmkit.shards.manifest import read_json
from ogmkit.shards.reader import Shard
from ogmkit.workflow.records import read_records


def _yaml(path: Path) -> Any:
    pytest.importorskip("yaml")
    from ogmkit.learn.runs import read_yaml

    return read_yaml(path)


def _table(path: Path) -> None:
    with Tables(path.parent) as tables:
        tables.load("scene")


READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "split file": ("splits.json", read_split_file),
    "manifest": ("manifest.json", read_json),
    "run's manifest": ("manifest.json", lambda path: read_records(path.parent)),
    "sweep": ("a.pcd.bin", lambda path: read_points(path, "restore it")),
    "map mask": ("a.png", read_grey_png),
    "map mask in the store": ("a.png", lambda path: MaskStore(path.parent / "cache").open(path)),
    "calibration": ("a.json", lambda path: json_object(path, ("intrinsics",))),
    "settings": ("a.yaml", _yaml),
    "shard": ("a.h5", Shard),
    "table": ("scene.json", _table),
}


@pytest.mark.parametrize("kind", ["a named pipe", "a device", "a folder"])
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_is_refused_in_one_line(tmp_path, reader, kind):
    name, read = READERS[reader]
    path = tmp_path / name
    make = {
        "a named pipe": os.mkfifo,
        "a folder": Path.mkdir,
        "a device": lambda p: p.symlink_to("/dev/zero"),
    }
    make[kind](path)
    lists = (reader, kind) == ("split file", "a folder")  # published lists come as one
    with pytest.raises(OgmkitError, match="no list of scenes" if lists else f"{kind}, not a") as caught:
        read(path)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)
