"""Footprints of a frame, from shard to shard, against the OpenCV and h5py calls that can't be spared."""

import tempfile
from pathlib import Path

import cv2
import h5py
import numpy as np
from bench_shards import extracted
from measure import show, side_by_side

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.geometry.camera import image_from_resized
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import RenderFootprints
from ogmkit.shards.additions import new_group
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import create
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

CAMERA = "CAM_FRONT"
FRAMES = 40
REPEATS = 15
IMAGE_SIZE = (900, 1600)
METHODS = ("warp", "project", "full-body")


def main():
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        shards = prepare(Path(folder))
        with Shard(next(shards.glob("*.h5"))) as shard:
            out = Path(folder) / "footprints.h5"
            for scale in (2, 1):
                bare = bare_inputs(shard, scale)
                ways = {"two bare warps": lambda bare=bare: write_bare(out, bare)}
                for method in METHODS:
                    settings = FootprintSettings(method=method, scale=scale)
                    ways[method] = lambda settings=settings: write_footprints(out, shard, settings)
                report(scale, side_by_side(ways, REPEATS))


def prepare(folder):
    """One scene's shard, with homographies."""
    settings = SynthesisSettings(
        scenes=1, frames=FRAMES, cameras=(CAMERA,), image_size=IMAGE_SIZE, lidar=False, relief_m=2.0
    )
    synthesize(folder / "dataset", settings)
    out = folder / "shards"
    extracted(folder / "dataset", out)
    fit_shards(out, ("surface",))
    return out


def bare_inputs(shard, scale):
    """What the bare calls need, read and worked out beforehand and not timed."""
    size = tuple(side // scale for side in IMAGE_SIZE)
    bev_from_image = shard.dataset(CAMERA, "homography/surface/bev_from_image")[:]
    return {
        "size": size,
        "matrices": bev_from_image @ image_from_resized(IMAGE_SIZE, size),
        "masks": {name: shard.dataset(CAMERA, name)[:] for name in ("drivable", "vehicles")},
    }


def write_bare(path, bare):
    """Warp and write, with no care for anything else, the horizon included."""
    height, width = bare["size"]
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    with h5py.File(path, "w") as file:
        for name, masks in bare["masks"].items():
            written = file.create_dataset(
                name,
                (FRAMES, height, width),
                np.uint8,
                chunks=(1, height, width),
                compression="gzip",
                compression_opts=1,
            )
            for frame in range(FRAMES):
                written[frame] = cv2.warpPerspective(
                    masks[frame], bare["matrices"][frame], (width, height), flags=flags
                )


def write_footprints(path, shard, settings):
    """What `ogmkit render-footprints` does in a shard, the BEV masks' reading included."""
    job = RenderFootprints(settings)
    path.unlink(missing_ok=True)
    with create(path) as file:
        for name, values in job.groups(shard, CAMERA).items():
            with file.writing() as h5:
                new_group(h5, CAMERA, job.kind, name, values)
            job.write(shard, CAMERA, (name,), file)


def report(scale, seconds):
    height, width = (side // scale for side in IMAGE_SIZE)
    rows = [
        (name, f"{1e3 * value / FRAMES:.2f} ms", f"{value / seconds['two bare warps']:.2f}×")
        for name, value in seconds.items()
    ]
    show(
        f"Footprints of a frame, {height} × {width} pixels, with the write (aim of warp: ≤ 2×)",
        ("", "time", "to bare warps"),
        rows,
    )


main()
