"""Stage 2 on synthetic worlds of incidents, in parts: planners that see true masks, then those of images.

`python benchmarks/planning.py` makes what is missing, `--plan` says what that is and how long it takes;
`python benchmarks/assemble.py` puts the tables of what is there into RESULTS.md. A part that was cut short
resumes. Masks need no pictures, so that there are many scenes of them (`masks/…`, 300); the planners with
images have a world of their own (`images/…`, 112), and beside them stand rows that were trained as long on
true masks and on none, and longer on true ones. Planners behind a frozen perception look at each image once,
so that they are trained on a third world (`frozen/…`, 300) as long as those on masks; it is the perception of
the second one, which has seen no scene of the third. Every part is trained on the scenes of `train`, chooses
its checkpoint by those of `val`, and tells figures of `test`.
"""

import sys
from dataclasses import dataclass

from bench_command import run_bench
from bench_data import PLAN_GRID, make_world, world_settings
from bench_grids import make_grids
from bench_parts import Part
from bench_plans import make_controls, make_gain, make_planner

NAME = "plan"
MASKS, IMAGES, FROZEN = "masks", "images", "frozen"
WORLD_SEED = {MASKS: 23, IMAGES: 24, FROZEN: 25}
UNRENDERED = "16x16"
"""Of a world whose pictures nobody looks at."""
LINEAR = ["--mean", "linear"]
FREEZE = ["--freeze", "perception"]
COARSE, FINE = 240, 960
"""Numbers that masks are averaged to, at most; each map by its own aspect."""
PERCEPTION = f"{IMAGES}/footprints"


@dataclass(frozen=True)
class Sizes:
    """What decides how long it takes."""

    mask_split: tuple = (240, 20, 40)
    image_split: tuple = (80, 8, 24)
    frames: int = 40
    rendered: str = "90x160"
    images: str = "64x128"
    encoder: str = "resnet18"
    epochs: int = 15
    perception_epochs: int = 4
    image_epochs: int = 2
    decoder_width: int = 64
    gain_epochs: int = 60
    seeds: tuple = (0, 1, 2)


TOY = Sizes((1, 1, 1), (1, 1, 1), 13, "64x128", "32x64", "tu-test_resnet", 1, 1, 1, 8, 1, (0,))


def parts_of(toy):
    """All parts, in order."""
    sizes = TOY if toy else Sizes()
    yield _world(MASKS, sizes.mask_split, UNRENDERED, sizes)
    yield _controls(MASKS)
    for seed in sizes.seeds:
        yield _from_masks("mid-to-end-linear", ["mid-to-end", *_pooled(), *LINEAR], seed, sizes)
    yield _gain(sizes)
    for seed in sizes.seeds:
        yield _from_masks("lstm-ed-linear", ["lstm-ed", *LINEAR], seed, sizes)
        yield _from_masks("mid-to-end", ["mid-to-end", *_pooled()], seed, sizes)
        yield _from_masks("lstm-ed", ["lstm-ed"], seed, sizes)
        yield _from_masks("mid-to-end-np", ["mid-to-end", *_pooled(), "--no-past"], seed, sizes)
    yield _world(IMAGES, sizes.image_split, sizes.rendered, sizes)
    yield _controls(IMAGES)
    yield _perception(sizes)
    for seed in sizes.seeds:
        yield _beside("lstm-ed", seed, sizes)
        yield _beside("mid-to-end", seed, sizes, _pooled())
        yield _from_masks("mid-to-end-linear-long", ["mid-to-end", *_pooled(), *LINEAR], seed, sizes, IMAGES)
        for frozen in (True, False):
            yield _holistic("holistic", seed, frozen, sizes)
            yield _holistic("holistic-cv", seed, frozen, sizes)
    yield _world(FROZEN, sizes.mask_split, sizes.rendered, sizes)
    yield _controls(FROZEN)
    for seed in sizes.seeds:
        yield _behind_frozen("holistic", seed, sizes)
        yield _behind_frozen("holistic-cv", seed, sizes)
        yield _from_masks("mid-to-end-linear", ["mid-to-end", *_pooled(), *LINEAR], seed, sizes, FROZEN)
        yield _from_masks("lstm-ed-linear", ["lstm-ed", *LINEAR], seed, sizes, FROZEN)
    for system in ("holistic", "holistic-cv"):
        yield _behind_frozen(system, sizes.seeds[0], sizes, FINE)
    fine = ["mid-to-end", *_pooled(FINE), *LINEAR]
    yield _from_masks("mid-to-end-linear-fine", fine, sizes.seeds[0], sizes, FROZEN)


def _world(world, split, image_size, sizes):
    seen = world != MASKS
    settings = world_settings(
        split=split,
        frames=sizes.frames,
        seed=WORLD_SEED[world],
        image_size=image_size,
        annotate_by="rendered" if seen else "all",
        more=["--incidents", "--no-lidar"],
        extract=[*PLAN_GRID, "--images", "bytes" if seen else "none"],
        sources="surface" if seen else "",
        masks=["warp"] if world == IMAGES else [],
    )
    return Part(f"{world}/data", 10 if world == IMAGES else 35, settings, make_world)


def _controls(world):
    return Part(f"{world}/controls", 1, {"data": f"{world}/data"}, make_controls, (f"{world}/data",))


def _gain(sizes):
    settings = {"data": f"{MASKS}/data", "seeds": [*sizes.seeds], "epochs": sizes.gain_epochs}
    return Part(f"{MASKS}/regression", 5, settings, make_gain, (settings["data"],))


def _from_masks(name, train, seed, sizes, world=MASKS):
    return _planner(name, [*train, *_planning(), "--epochs", sizes.epochs], seed, world, 5)


def _planner(name, train, seed, world, minutes):
    data = f"{world}/data"
    settings = {"data": data, "seed": seed, "train": train}
    return Part(f"{world}/{name}-{seed}", minutes, settings, make_planner, (data,))


def _perception(sizes):
    data = f"{IMAGES}/data"
    train = ["footprints", *_common(), *_images(sizes), "--balance", "weighted", "--masks", "surface"]
    train += ["--lr", 1e-3, "--epochs", sizes.perception_epochs]
    settings = {"data": data, "homography": "surface", "seed": 0, "train": train}
    return Part(PERCEPTION, 7, settings, make_grids, (data,))


def _beside(system, seed, sizes, more=()):
    """What sees no images, trained as the holistic ones are."""
    return _planner(f"{system}-linear", [system, *more, *_steps(sizes)], seed, IMAGES, 1)


def _behind_frozen(system, seed, sizes, cells=COARSE):
    """Trained as long as those on masks."""
    train = [system, *_images(sizes), *_planning(), *LINEAR, *_pooled(cells), "--masks", "surface"]
    train += [*_warped(system), *FREEZE, "--epochs", sizes.epochs]
    needs = (f"{FROZEN}/data", PERCEPTION)
    settings = {"data": needs[0], "perception": PERCEPTION, "seed": seed, "train": train}
    name = f"{system}-frozen-fine" if cells == FINE else f"{system}-frozen"
    return Part(f"{FROZEN}/{name}-{seed}", 10, settings, make_planner, needs)


def _holistic(system, seed, frozen, sizes):
    """With a perception that stays as it was learnt, or is trained on.

    Both have the linear mean, so that what differs is what they see: from nothing, so few steps are spent on
    learning to use the destination.
    """
    train = [system, *_images(sizes), *_steps(sizes), *_pooled(), "--masks", "surface"]
    train += ["--balance", "weighted"]
    train += [*_warped(system), *(FREEZE if frozen else [])]
    needs = (f"{IMAGES}/data", PERCEPTION)
    settings = {"data": needs[0], "perception": PERCEPTION, "seed": seed, "train": train}
    name = f"{system}-frozen" if frozen else system
    return Part(f"{IMAGES}/{name}-{seed}", 6 if frozen else 12, settings, make_planner, needs)


def _warped(system):
    return ["--warp", "surface"] if system == "holistic" else []


def _steps(sizes):
    """Of planners beside and with images."""
    return [*_planning(), *LINEAR, "--batch-size", 4, "--epochs", sizes.image_epochs]


def _planning():
    return [*_common(), "--lr", 3e-3, "--weight-decay", 0.1]


def _common():
    return ["--workers", 0, "--flip", 0.5, "--optimizer", "adamw", "--schedule", "cosine"]


def _images(sizes):
    """A narrow decoder, and bfloat16, for time: a step of a planner sees 24 images."""
    shape = ["--image-size", sizes.images, "--encoder", sizes.encoder, "--decoder-width", sizes.decoder_width]
    return [*shape, "--precision", "bf16-mixed"]


def _pooled(cells=COARSE):
    return ["--pool-cells", cells]


if __name__ == "__main__":
    sys.exit(run_bench(NAME, parts_of, __doc__))
