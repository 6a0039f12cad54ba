"""Samples from shards against the same made on the fly with the official devkit; workers' memory."""

import json
import os
import subprocess
import tempfile
import time
from multiprocessing import active_children
from pathlib import Path

import cv2
import numpy as np
import torch
from bench_shards import extracted
from measure import show
from tiling import tiled

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, keep_freed_memory, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

HERE = Path(__file__).resolve().parent
DEVKIT_PYTHON = HERE.parent / ".venv-devkit" / "bin" / "python"
CAMERA = "CAM_FRONT"
WORLD = SynthesisSettings(scenes=3, frames=40, cameras=(CAMERA,), image_size=(900, 1600), lidar=False)
TILES = (4, 5)
"""Copies east and north: maps of singapore-onenorth's size, which is 1586 m × 2025 m."""
JPEG_BYTES = 131_000
"""Mean size of nuScenes' images; the synthesized ones are re-encoded, as decoding takes time by the byte."""
CASES = (
    ("sequence", (448, 800), 0.1),
    ("sequence", (448, 800), 1.0),
    ("sequence", (96, 160), 1.0),
    ("sequence", None, 1.0),
    ("frame", (448, 800), 1.0),
)
"""Kind of sample, height and width of images, side of a BEV cell in metres."""
SAMPLES = 12
TURNS = 3
EPOCHS = 3
WORKERS = 2
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


def main():
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    keep_freed_memory()  # as the loader's workers do
    with tempfile.TemporaryDirectory() as folder:
        dataroot, out = Path(folder) / "dataset", Path(folder) / "shards"
        scenes = prepare(dataroot, out)
        for case in CASES:
            compare(dataroot, out, scenes, *case)
        watch(dataset_of(out, scenes, "sequence", (96, 160), 1.0, augment=Augmentation()))


def prepare(dataroot, out):
    """A dataset and its shards; returns the scenes' names."""
    synthesize(dataroot, WORLD)
    shrink_images(sorted((dataroot / "samples" / CAMERA).glob("*.jpg")))
    scenes = extracted(dataroot, out)
    enlarge_maps(dataroot)
    fit_shards(out, ("calibration",))
    render_footprints(out, FootprintSettings("calibration"))
    return scenes


def shrink_images(paths):
    """Re-encode images at the best quality at which they are no larger than real ones, on average."""
    some = [cv2.imread(str(path)) for path in paths[::10]]
    sizes = {quality: np.mean([len(encoded(image, quality)) for image in some]) for quality in range(60, 96)}
    quality = max(quality for quality, size in sizes.items() if size <= JPEG_BYTES)
    for path in paths:
        path.write_bytes(encoded(cv2.imread(str(path)), quality))
    size = np.mean([path.stat().st_size for path in paths])
    print(
        f"Images of 900 × 1600, as JPEGs of quality {quality}: {size / 1e3:.0f} KB on average (nuScenes: 131)"
    )


def encoded(image, quality):
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def enlarge_maps(dataroot):
    """Tile the polygons that the devkit reads; the masks that shards come from are the first tile."""
    for path in (dataroot / "maps" / "expansion").glob("*.json"):
        layers = json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps(tiled(layers, layers["canvas_edge"], TILES)), encoding="utf-8")


def dataset_of(out, scenes, kind, image_size, cell_m, **options):
    """Images with masks, homographies and calibration, BEV truth; of sequences, the path."""
    of_sequences = kind == "sequence"
    of_image = (image_size, "calibration", "calibration") if image_size else (None, None, None)
    spec = SampleSpec(*of_image, cell_m, calibration=bool(image_size), bev=True, trajectory=of_sequences)
    find, make = (index_sequences, SequenceDataset) if of_sequences else (index_frames, FrameDataset)
    return make(find(out, scenes, (CAMERA,), needs=spec), spec, **options)


def compare(dataroot, out, scenes, kind, image_size, cell_m):
    """One case: the same samples both ways."""
    dataset = dataset_of(out, scenes, kind, image_size, cell_m)
    chosen = range(0, len(dataset), max(1, len(dataset) // SAMPLES))
    tokens = [dataset.name(i).rpartition("(")[2].rstrip(")") for i in chosen]
    made = dataroot.parent / "devkit.npz"
    sizes = (*(image_size or (0, 0)), dataset.grid.rows // dataset.own_grid.rows)
    command = [DEVKIT_PYTHON, HERE / "loading_devkit.py", dataroot, made, kind, *sizes, *tokens]
    subprocess.run([str(part) for part in command], stdout=subprocess.DEVNULL, check=True)
    devkits = np.load(made)
    turns = {"devkit, on the fly": devkits["seconds"], "shards": timed(dataset, chosen)}
    if image_size:
        dataset.keep_pixels(made.with_suffix(".pixels"))
        turns["shards, images and masks decoded before"] = timed(dataset, chosen)
    ways = {name: seconds.min(axis=0) for name, seconds in turns.items()}  # what else runs only adds
    ours_s = np.median(ways["shards"])
    agreement = same(devkits, dataset[chosen[0]])
    table = [
        (
            name,
            f"{1e3 * np.median(seconds):.1f} ms",
            f"{1e3 * max(seconds):.1f} ms",
            f"{np.median(seconds) / ours_s:.1f}×",
        )
        for name, seconds in ways.items()
    ]
    show(
        f"{described(kind, image_size, dataset.own_grid)}; one thread (aim: ≥ 10×)\n"
        f"Median of {len(chosen)}, each the best of {TURNS} turns; the devkit's tables are in memory\n"
        f"{agreement}",
        ("", "time", "longest", "to shards'"),
        table,
    )


def described(kind, image_size, grid):
    """What a sample holds."""
    many = kind == "sequence"
    images = f"image of {image_size[0]} × {image_size[1]}, its masks, " if image_size else ""
    each = f"{images}BEV of {grid.rows} × {grid.columns}"
    return f"Sequence sample: six times {each}; path" if many else f"Frame sample: {each}"


def same(devkits, sample):
    """How far the first samples agree."""
    parts = [name for name in ("bev", "masks") if name in sample]
    cells = ", ".join(f"{name} {np.mean(devkits[name] == sample[name].numpy()):.2%}" for name in parts)
    if "image" not in sample:
        return f"Same cells: {cells}"
    difference = 255 * np.abs(devkits["image"] - sample["image"].numpy()).mean()
    return f"Same cells: {cells}; images differ by {difference:.1f} of 255"


def timed(dataset, places):
    """Seconds of each sample in each turn; one is made before, so files are open, as the devkit's are."""
    dataset[places[0]]
    seconds = np.zeros((TURNS, len(places)))
    for turn, place in np.ndindex(seconds.shape):
        start = time.perf_counter()
        dataset[places[place]]
        seconds[turn, place] = time.perf_counter() - start
    return seconds


def watch(dataset):
    """Memory of the workers at the start, in the middle and at the end of epochs."""
    batches = EpochBatches(len(dataset), 2, seed=0, shuffle=True)
    loading = loader(dataset, batches, workers=WORKERS)
    rows = []
    for epoch in range(EPOCHS):
        batches.epoch = epoch
        sizes = [memory() for _ in loading]
        moments = (sizes[WORKERS], sizes[len(sizes) // 2], sizes[-1])
        rows.append((f"epoch {epoch}", *(" + ".join(f"{mib:.0f}" for mib in each) for each in moments)))
    show(
        f"Memory of {WORKERS} workers over epochs of {len(dataset)} sequence samples, MiB of their own",
        ("", "start", "middle", "end"),
        rows,
    )


def memory():
    """MiB that each worker holds alone: resident, less what is shared (batches under way, libraries)."""
    pages = [Path(f"/proc/{worker.pid}/statm").read_text().split() for worker in active_children()]
    return sorted((int(resident) - int(shared)) * PAGE_MIB for _, resident, shared, *_ in pages)


if __name__ == "__main__":  # workers import this file
    main()
