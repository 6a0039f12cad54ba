"""A training behind a frozen perception: each image looked at once, or in each sequence of each epoch."""

import tempfile
import time
from pathlib import Path

import torch
from bench_shards import extracted
from measure import show

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import KEY, Card, write_checkpoint
from ogmkit.learn.runs import BEST
from ogmkit.learn.systems.registry import build_system
from ogmkit.learn.training.train import train
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.shards.manifest import read_manifest
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

CAMERA = "CAM_FRONT"
WORLD = SynthesisSettings(scenes=3, frames=40, cameras=(CAMERA,), image_size=(90, 160), lidar=False)
NETWORK = {"image_size": (64, 128), "encoder": "resnet18", "decoder_width": 64, "masks": "calibration"}
EPOCHS = 5
UNSEEN_COLOUR = 1e-9
"""Random colours that round to nothing: images may change, so that they are looked at anew."""


def main():
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        shards = shards_in(Path(folder))
        perception = perception_in(Path(folder), shards)
        seconds = {
            name: seconds_of(shards, Path(folder) / name, perception, colour)
            for name, colour in (("in each sequence", UNSEEN_COLOUR), ("once", 0.0))
        }
    rows = [
        (f"images looked at {name}", f"{one:.1f} s", f"{one / seconds['once']:.1f}×")
        for name, one in seconds.items()
    ]
    show(
        f"Training `holistic --freeze perception` for {EPOCHS} epochs, validations included; one thread",
        ("", "time", "to once"),
        rows,
    )


def shards_in(folder):
    """Shards of a synthetic world, with homographies."""
    synthesize(folder / "world", WORLD)
    extracted(folder / "world", folder / "shards")
    fit_shards(folder / "shards", ("calibration",))
    return folder / "shards"


def perception_in(folder, shards):
    """A run of footprints that has learnt nothing, which takes as long to look."""
    grid, entry = read_manifest(shards).settings.targets.grid, CATALOGUE["footprints"]
    settings = entry.settings(**entry.read(NETWORK))
    net = build_system(settings, grid, (CAMERA,))
    run = folder / "footprints"
    run.mkdir()
    card = Card(settings, grid, (CAMERA,), 0.5)
    write_checkpoint(run / BEST, {"state_dict": net.state_dict(), KEY: card.to_dict()})
    return run


def seconds_of(shards, run, perception, colour):
    """How long a training takes."""
    entry = CATALOGUE["holistic"]
    frozen = {"warp": "calibration", "perception": str(perception), "freeze": ("perception",)}
    chosen = {**NETWORK, **frozen, "epochs": EPOCHS, "split_ratio": (2, 1), "flip": 0.5, "colour": colour}
    start = time.perf_counter()
    train(entry.settings(**entry.read(chosen)), shards, run)
    return time.perf_counter() - start


main()
