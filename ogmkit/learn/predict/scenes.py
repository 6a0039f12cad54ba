"""One scene's predictions and their files: the unit of work, here or on a cluster."""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.learn.predict.files import Format, Group, Row, Value, write_h5, write_pngs
from ogmkit.learn.predict.frames import FramePrediction, predict_frames
from ogmkit.learn.predict.workers import opened_once
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards import schema
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Scene:
    """What is to be predicted of one scene, and written.

    Attributes:
        index: of its frames.
        spec: what they are predicted from.
        out: folder for the files.
        form: of the files.
        about: attributes of an HDF5 file, which say what predicted.
    """

    index: FrameIndex
    spec: SampleSpec
    out: Path
    form: Format
    about: Mapping[str, str | int | float]


@dataclass(frozen=True)
class Written:
    """What became of a scene.

    Attributes:
        frames: how many were predicted.
        files: how many were written.
    """

    frames: int
    files: int


@dataclass(frozen=True)
class Predictor:
    """Predicts and writes scenes in a process that has the network for itself, opened once.

    Attributes:
        checkpoint: the network's file.
        sha256: its checksum, hexadecimal.
        batch_size: frames at a time.
    """

    checkpoint: Path
    sha256: str
    batch_size: int

    def __call__(self, scene: Scene) -> Written:
        """Predict a scene's frames and write them.

        Raises:
            OgmkitError: as `ogmkit.learn.predict.shards.predict_shards`.
        """
        run = opened_once(self.checkpoint, self.sha256)
        frames = predict_frames(run, scene.index, scene.spec, batch_size=self.batch_size)
        return write_scene(scene, frames)


def write_scene(scene: Scene, frames: Iterator[FramePrediction]) -> Written:
    """Write a scene's file, or its pictures, each whole or not at all.

    Args:
        scene: the scene.
        frames: predictions of its frames, in the index's order; each is taken when it is written.

    Raises:
        ShardError: the shard is absent or damaged.
        OutputError: the disk is full or refuses otherwise.
    """
    (name,) = scene.index.scenes
    rows = _rows(scene, frames)
    if scene.form == "png":
        files = sum(len(write_pngs(scene.out, row)) for row in rows)
    else:
        counts = np.bincount(scene.index.camera, minlength=len(scene.index.cameras)).tolist()
        cameras = zip(scene.index.cameras, counts, strict=True)
        groups = [Group(camera, count, rows) for camera, count in cameras if count]
        write_h5(scene.out / f"{name}.h5", {**scene.about, "scene": name}, groups)
        files = 1
    count = len(scene.index)
    _LOG.debug("%s: %s in %s", name, with_number(count, "frame"), with_number(files, "file"))
    return Written(count, files)


def _rows(scene: Scene, frames: Iterator[FramePrediction]) -> Iterator[Row]:
    source = scene.spec.homography
    (path,) = scene.index.paths
    for camera, group in groupby(frames, key=lambda frame: frame.camera):
        with Shard(path) as shard:
            tokens = {name: shard.strings(camera, name) for name in ("sample_token", "sample_data_token")}
            valid: BoolArray | None = None
            if source is not None:
                valid = shard.dataset(camera, f"{schema.HOMOGRAPHY.name}/{source}/valid")[:]
        for found in group:
            values: dict[str, Value] = {name: column[found.frame] for name, column in tokens.items()}
            values["frame"] = found.frame
            for name, value in (("bev", found.bev), ("image", found.image)):
                if value is not None:
                    values[name] = value
            if valid is not None:
                values["homography_valid"] = bool(valid[found.frame])
            yield Row(f"{found.scene}_{camera}_{found.frame:04d}", values)
