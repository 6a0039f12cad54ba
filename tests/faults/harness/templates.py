"""What the commands read, each made once: small datasets, shards, trained networks and files."""

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from ogmkit_cli.main import main

from ogmkit.nuscenes.maps import MaskStore
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

FIXTURES = Path(__file__).resolve().parents[3] / "fixtures"
CHAIN = """
data: world
out: chain
extract: {grid: {m_per_cell: 0.5, rows: 60, columns: 40}}
homography_fit: {methods: [surface]}
render_footprints: {scale: 1, sets: [surface]}
evaluate: {samples: 1}
"""


def world(folder: Path) -> None:
    """Two scenes (train, val) of two key frames, one camera, LiDAR."""
    settings = SynthesisSettings(2, 2, cameras=("CAM_FRONT",), image_size=(90, 160), lidar_azimuths=60)
    synthesize(folder / "world", settings)


def long_world(folder: Path) -> None:
    """Scenes long enough for sequences."""
    shutil.copytree(FIXTURES / "nuscenes-synthetic", folder / "long")


def cache(folder: Path) -> None:
    """Decoded masks of `world`, named as for the place to which templates are copied."""
    for png in (folder / "world" / "maps").glob("*.png"):
        made = MaskStore(folder / "cache").open(png).path
        there = folder.parent / "case" / png.relative_to(folder)
        made.rename(made.with_stem(hashlib.sha256(os.fsencode(there.resolve())).hexdigest()[:16]))


def images(folder: Path) -> None:
    """Six images."""
    (folder / "images").mkdir()
    for number in range(6):
        cv2.imwrite(str(folder / "images" / f"{number}.jpg"), np.full((180, 320, 3), 40 * number, np.uint8))


def encoder(folder: Path) -> None:
    """Weights of the encoder that networks here have."""
    import timm
    import torch

    torch.save(timm.create_model("test_resnet").state_dict(), folder / "encoder.pth")


def past(folder: Path) -> None:
    """Past positions and a destination."""
    positions = [[float(2 * number), 0.0] for number in range(-5, 1)]
    content = {"positions": positions, "destination": [12.0, 0.5], "image_size": [180, 320]}
    (folder / "past.json").write_text(json.dumps(content))


def camera(folder: Path) -> None:
    """A way from the images' pixels to cells."""
    content = {
        "image_size": [180, 320],
        "bev_from_image": [[0.3, -1.85, -117.0], [0.0, 1.0, -513.0], [0.0, 0.01, -1.0]],
    }
    (folder / "camera.json").write_text(json.dumps(content))


def chain(folder: Path) -> None:
    """The configuration of a small chain."""
    (folder / "chain.yaml").write_text(CHAIN)


def settings(folder: Path) -> None:
    """The settings of a training."""
    with (folder / "settings.yaml").open("w") as file, contextlib.redirect_stdout(file):
        main(["train", "lstm-ed", str(folder / "plans"), "--print-config"], standalone_mode=False)


def command(line: str, copied: str = "", name: str = "") -> Callable[[Path], None]:
    """What makes a template by a command, on a copy of another template where one is named."""

    def make(folder: Path) -> None:
        if copied:
            shutil.copytree(folder / copied, folder / name)
        with contextlib.chdir(folder), contextlib.redirect_stdout(None):
            main(["-q", *line.split()], standalone_mode=False)

    return make
