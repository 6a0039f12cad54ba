"""Homographies: DLT fits a second against OpenCV's, every method's time, and what refining a DLT gains."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from measure import show, side_by_side

from ogmkit.grid import GridSpec
from ogmkit.homography.corners import usable_corners
from ogmkit.homography.dlt import direct_linear_transformation, refine
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.methods import METHODS, fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

REPEATS = 15
NOISE_PX = 1.0
GRID = GridSpec()
SETTINGS = FitSettings()
WORLD = SynthesisSettings(
    scenes=2, frames=20, cameras=("CAM_FRONT",), image_size=(90, 160), lidar=False, relief_m=2.0
)


def main():
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "dataset"
        synthesize(root, WORLD)
        with Dataset(root) as dataset:
            frames = [
                geometry(frame)
                for name in dataset.scene_names()
                for frame in dataset.scene(name, ("CAM_FRONT",)).cameras["CAM_FRONT"]
            ]
    pairs = [(corners.pixels, GRID.cells(corners.positions_m)) for corners in map(usable, frames)]
    pairs = [pair for pair in pairs if len(pair[0]) >= 4]
    ways = {"cv2.findHomography(…, 0)": lambda: [cv2.findHomography(*pair, 0) for pair in pairs]}
    ways |= {
        f"ogmkit {method}": lambda method=method: [
            fit(method, fresh(frame), GRID, SETTINGS) for frame in frames
        ]
        for method in METHODS
    }
    seconds = side_by_side(ways, REPEATS)
    each = {name: value / (len(pairs) if "cv2" in name else len(frames)) for name, value in seconds.items()}
    reference = each["cv2.findHomography(…, 0)"]
    rows = [
        (name, f"{1e3 * value:.2f} ms", f"{1 / value:,.0f}", f"{value / reference:.2f}×")
        for name, value in each.items()
    ]
    corners = np.median([len(pair[0]) for pair in pairs])
    show(
        f"A frame's homography, median {corners:.0f} corners; ogmkit's with projection and residuals "
        "(aim: dlt > 2,000 fits/s)",
        ("", "a frame", "fits/s", "to OpenCV's"),
        rows,
    )
    show_residuals(pairs)


def show_residuals(pairs):
    """Residuals in the image of plain fits over those of the refined one, on the same noisy corners.

    With noise in the image only, the refined fit is the maximum-likelihood one: a test holds it to scipy's.
    """
    ratios = {"cells → pixels": [], "pixels → cells, inverted": []}
    for seed, (pixels, cells) in enumerate(pairs):
        seen = pixels + np.random.default_rng(seed).normal(0, NOISE_PX, pixels.shape)
        weights = np.ones((1, len(seen)))
        direct, _ = direct_linear_transformation(cells, seen, weights)
        backwards, _ = direct_linear_transformation(seen, cells, weights)
        best = residual_px(refine(direct, cells, seen, weights), cells, seen)
        if best > NOISE_PX / 10:  # four corners leave none
            ratios["cells → pixels"].append(residual_px(direct, cells, seen) / best)
            inverted = residual_px(np.linalg.inv(backwards), cells, seen)
            ratios["pixels → cells, inverted"].append(inverted / best)
    rows = [
        (name, f"{np.median(found):.3f}×", f"{np.quantile(found, 0.9):.3f}×")
        for name, found in ratios.items()
    ]
    show(
        f"Plain DLT's residual over the refined fit's, corners with {NOISE_PX:g} px of noise",
        ("", "median frame", "90th percentile"),
        rows,
    )


def residual_px(image_from_bev, cells, pixels):
    mapped, _ = apply(image_from_bev, cells)
    return np.sqrt(((mapped - pixels) ** 2).sum(axis=-1).mean())


def geometry(frame):
    return FrameGeometry(
        intrinsics=frame.intrinsics,
        level_from_camera=frame.level_from_camera,
        level_from_ego=frame.level_from_global @ frame.global_from_ego,
        image_size=frame.image_size,
        level_from_box=frame.level_from_global @ frame.boxes.global_from_box,
        size_wlh=frame.boxes.size_wlh,
        category=frame.boxes.category,
        visibility=frame.boxes.visibility,
        num_lidar_pts=frame.boxes.num_lidar_pts,
    )


def usable(frame):
    return usable_corners(frame, SETTINGS)


def fresh(frame):
    """The frame without what earlier fits have cached in it."""
    names = FrameGeometry.__dataclass_fields__
    return FrameGeometry(**{name: getattr(frame, name) for name in names})


main()
