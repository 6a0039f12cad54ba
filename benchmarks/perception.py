"""Stage 1 on synthetic worlds, in parts: flat ground, then mild hills for what the homography costs.

`python benchmarks/perception.py` makes what is missing, `--plan` says what that is and how long it takes;
`python benchmarks/assemble.py` puts the tables of what is there into RESULTS.md. A part that was cut short
resumes. Every part is trained on the scenes of `train`, chooses its checkpoint and its thresholds by those
of `val`, and tells figures of `test`; nothing else is chosen. Those that answer most come first.
"""

import sys
from dataclasses import dataclass

from bench_command import run_bench
from bench_data import make_world, world_settings
from bench_grids import NETWORK, make_by_heart, make_free, make_grids, make_homography, make_turned
from bench_latents import make_latents
from bench_parts import Part

NAME = "learn"
SOURCES = "surface,dlt,plane,calibration"
FLAT, HILLS = "flat", "hills"
RELIEF_M = {FLAT: 0, HILLS: 0.5}
WORLD_SEED = {FLAT: 11, HILLS: 12}

TURNS_DEG = [0.25, 0.5, 1.0, 2.0]
"""By which test scenes' cameras are turned at most, up or down; half of that about their axis."""

MASK_PRECISION = "bf16-mixed"
"""0.6 of the time of a step where the processor has avx512_bf16."""


@dataclass(frozen=True)
class Sizes:
    """What decides how long it takes."""

    split: tuple = (40, 8, 12)
    frames: int = 20
    rendered: str = "180x320"
    images: str = "128x224"
    encoder: str = "resnet18"
    epochs: int = 6
    homography_epochs: int = 12
    ved_epochs: int = 9
    ved_cell: float = 2.5
    few_scenes: int = 2
    few_epochs: int = 60
    seeds: tuple = (0, 1, 2)
    hill_seeds: tuple = (0, 1)
    channels: int = 32
    bev_cell: float = 0.5


TOY = Sizes((1, 1, 1), 2, "64x112", "64x96", "tu-test_resnet", 1, 1, 1, 5, 1, 1, (0,), (0,), 8, 2.5)


def parts_of(toy):
    """All parts, in order."""
    sizes = TOY if toy else Sizes()
    yield _world(FLAT, sizes, lidar=True)
    yield _free(FLAT, f"{FLAT}/data", "surface")
    yield from _masks(FLAT, f"{FLAT}/data", "surface", sizes, sizes.seeds)
    for system, minutes, own in (
        ("oft", 17, ["--lr", 1e-3, "--channels", sizes.channels, "--blocks", 2]),
        ("ved", 38, _ved(sizes)),
    ):
        yield _grids(f"{FLAT}/{system}", minutes, [system, *_images(sizes), *_balanced(sizes), *own])
    yield _by_heart(sizes)
    yield _world(HILLS, sizes, lidar=False)
    yield _homography(sizes, "four-point")
    yield _free(HILLS, f"{HILLS}/homography-four-point", NETWORK)
    lidar = ["--lr", 1e-3, "--bev-cell", sizes.bev_cell]
    yield _turned(HILLS, f"{HILLS}/homography-four-point")
    yield _grids(f"{FLAT}/bev-lidar", 20, ["bev-lidar", *_common(sizes), *_balanced(sizes), *lidar])
    yield from _masks(HILLS, f"{HILLS}/homography-four-point", NETWORK, sizes, sizes.hill_seeds)
    yield _homography(sizes, "entries")
    yield _ved_on(sizes)
    yield _latents(sizes)


def _world(world, sizes, *, lidar):
    settings = world_settings(
        split=sizes.split,
        frames=sizes.frames,
        seed=WORLD_SEED[world],
        image_size=sizes.rendered,
        more=["--relief", RELIEF_M[world], "--lidar" if lidar else "--no-lidar"],
        extract=["--lidar"] if lidar else [],
        sources=SOURCES,
        masks=["warp", "full-body"],
    )
    return Part(f"{world}/data", 8, settings, make_world)


def _free(world, data, homography):
    """`data` is the part whose shards are read, `homography` what masks are warped by."""
    settings = {"data": data, "homography": homography, "sources": SOURCES}
    return Part(f"{world}/free", 3, settings, make_free, (data,))


def _masks(world, data, homography, sizes, seeds):
    """Footprints and whole bodies, seed by seed."""
    for seed in seeds:
        for name, masks in (("footprints", homography), ("full-body", "full-body")):
            train = ["footprints", *_images(sizes), *_balanced(sizes), "--lr", 1e-3, "--masks", masks]
            train += ["--precision", MASK_PRECISION]
            yield _grids(f"{world}/{name}-{seed}", 20, train, data, homography, seed)


def _grids(name, minutes, train, data=f"{FLAT}/data", homography="surface", seed=0, before=None):
    """`before` is the part whose network the training goes on from."""
    settings = {"data": data, "homography": homography, "seed": seed, "train": train}
    if before is None:
        return Part(name, minutes, settings, make_grids, (data,))
    return Part(name, minutes, settings | {"begins_with": before}, make_grids, (data, before))


def _homography(sizes, head):
    """On hills alone: on flat ground the training set's mean is exact."""
    turned = ["--pitch", 2, "--roll", 1]
    steps = ["--lr", 5e-4, "--epochs", sizes.homography_epochs]
    train = ["homography", *_images(sizes), *turned, *steps, "--head", head]
    data = f"{HILLS}/data"
    settings = {"data": data, "seed": 0, "train": train}
    return Part(f"{HILLS}/homography-{head}", 38, settings, make_homography, (data,))


def _turned(world, network):
    """What a network sees of mountings that differ more than those of the world do."""
    data = f"{world}/data"
    settings = {"data": data, "network": network, "angles_deg": TURNS_DEG, "seed": 5}
    return Part(f"{world}/turned", 4, settings, make_turned, (data, network))


def _ved(sizes):
    """Cells of 2.5 m: its decoder, whose cost goes by their number, leaves time for three times the steps.

    On cells of 1 m, 300 steps took 45 minutes and ended without a vehicle on val. The divergence weighs less
    by the number of cells, and keeps the weight that it had there.
    """
    cells = ["--bev-cell", sizes.ved_cell, "--kl-weight", 0.16, "--precision", MASK_PRECISION]
    return ["--lr", 1e-3, *cells, "--epochs", sizes.ved_epochs]


def _ved_on(sizes):
    """Whether more passes help that network: goes on from it, the schedule anew."""
    train = ["ved", *_images(sizes), *_balanced(sizes), *_ved(sizes)]
    return _grids(_ved_passes(sizes), 38, train, before=f"{FLAT}/ved")


def _ved_passes(sizes):
    return f"{FLAT}/ved-passes-{2 * sizes.ved_epochs}"


def _latents(sizes):
    """What those networks' latents tell of an image."""
    runs = [f"{FLAT}/ved", _ved_passes(sizes), f"{FLAT}/ved-by-heart"]
    settings = {"data": f"{FLAT}/data", "runs": runs}
    return Part(f"{FLAT}/latents", 1, settings, make_latents, (f"{FLAT}/data", *runs))


def _by_heart(sizes):
    """Whether that network can learn where vehicles are: a third of its steps, on a few of its scenes."""
    train = ["ved", *_images(sizes), *_balanced(sizes), *_ved(sizes), "--epochs", sizes.few_epochs]
    settings = {"data": f"{FLAT}/data", "network": f"{FLAT}/ved", "scenes": sizes.few_scenes, "seed": 0}
    settings |= {"homography": "surface", "train": train}
    return Part(f"{FLAT}/ved-by-heart", 15, settings, make_by_heart, (f"{FLAT}/data", f"{FLAT}/ved"))


def _common(sizes):
    how = ["--optimizer", "adamw", "--schedule", "cosine"]
    return ["--encoder", sizes.encoder, "--workers", 0, "--flip", 0.5, *how]


def _images(sizes):
    return [*_common(sizes), "--image-size", sizes.images, "--colour", 0.2]


def _balanced(sizes):
    return ["--balance", "weighted", "--epochs", sizes.epochs]


if __name__ == "__main__":
    sys.exit(run_bench(NAME, parts_of, __doc__))
