"""The long commands with one and with two workers, on the same synthesized dataset."""

import shutil
import sys
import tempfile
from pathlib import Path

from measure import run_process, show

from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

SCENES = 8
FRAMES = 120
ROUNDS = 2
CAMERAS = ("CAM_FRONT", "CAM_FRONT_RIGHT", "CAM_BACK", "CAM_FRONT_LEFT")
SETTINGS = SynthesisSettings(scenes=SCENES, frames=FRAMES, cameras=CAMERAS, image_size=(90, 160), lidar=False)
FRAMES_IN_ALL = SCENES * FRAMES * len(CAMERAS)
OGMKIT = str(Path(sys.executable).with_name("ogmkit"))


def main():
    with tempfile.TemporaryDirectory() as folder:
        root, out, cache = (Path(folder) / name for name in ("dataset", "shards", "cache"))
        synthesize(root, SETTINGS)
        chosen = [argument for camera in CAMERAS for argument in ("--camera", camera)]
        extract = ["extract", str(root), str(out), *chosen, "--cache-dir", str(cache)]
        compare(extract, before=lambda: shutil.rmtree(out, ignore_errors=True))
        compare(["homography-fit", str(out), "--overwrite"])
        compare(["render-footprints", str(out), "--overwrite", "--scale", "0.2"])


def compare(arguments, before=lambda: None):
    """Time one command; masks of four times the tiny images' size, so that there is something to draw."""
    seconds = {1: [], 2: []}
    for _ in range(ROUNDS):
        for workers, times in seconds.items():
            before()
            times.append(run_process([OGMKIT, *arguments, "--workers", str(workers)])[0])
    best = {workers: min(times) for workers, times in seconds.items()}
    rows = [
        (
            f"--workers {workers}",
            f"{value:.1f} s",
            f"{1e3 * value / FRAMES_IN_ALL:.2f} ms",
            f"{best[1] / value:.2f}×",
        )
        for workers, value in best.items()
    ]
    show(
        f"ogmkit {arguments[0]}, {FRAMES_IN_ALL} frames (whole command, best of {ROUNDS}; aim: ≥ 1.7×)",
        ("", "time", "a frame", "faster"),
        rows,
    )


main()
