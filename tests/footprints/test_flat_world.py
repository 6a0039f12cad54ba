"""What a homography is worth where the truth is known: a flat synthetic world, and one with hills."""

import numpy as np
import pytest

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import image_from_resized
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.footprint_masks import renderer
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

CAMERA, IMAGE_SIZE = "CAM_FRONT", (900, 1600)
LAYERS = ("drivable", "vehicles")


def shards(folder, *, frames, relief_m):
    """Shards of one scene on the default grid, with homographies, and their summary."""
    root, out = folder / "dataset", folder / "shards"
    synthesize(
        root,
        SynthesisSettings(
            scenes=1,
            frames=frames,
            seed=3,  # cars stand and drive at 5 to 80 m
            cameras=(CAMERA,),
            image_size=IMAGE_SIZE,
            lidar=False,
            relief_m=relief_m,
        ),
    )
    settings = ExtractSettings(TargetSettings(images="none"))
    with Dataset(root) as dataset:
        names, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, out, settings, scenes=names, splits=splits, cache_dir=folder / "cache")
    return out, fit_shards(out)


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    out, _ = shards(tmp_path_factory.mktemp("flat"), frames=6, relief_m=0.0)
    with Shard(next(out.glob("*.h5"))) as shard:
        yield shard


def overlap(pairs):
    """IoU over all frames, of (first, second) masks."""
    pairs = [(first > 0, second > 0) for first, second in pairs]
    common = sum(np.count_nonzero(first & second) for first, second in pairs)
    return common / sum(np.count_nonzero(first | second) for first, second in pairs)


def homographies(shard, source):
    return shard.dataset(CAMERA, f"homography/{source}/bev_from_image")[:]


def test_corners_give_the_calibrations_homography_to_a_cell_at_40_m(flat):
    found, expected = homographies(flat, "dlt"), homographies(flat, "calibration")
    cells = flat.grid.cells(np.array([[40.0, y] for y in (-10, -5, 0, 5, 10)]))
    for frame in range(flat.frames(CAMERA)):
        pixels = np.c_[cells, np.ones(5)] @ np.linalg.inv(expected[frame]).T
        mapped = pixels @ found[frame].T
        assert np.hypot(*(mapped[:, :2] / mapped[:, 2:] - cells).T).max() < 1


@pytest.mark.parametrize("source", ["surface", "dlt", "plane", "calibration"])
def test_warped_masks_are_the_exact_ones(flat, source):
    warped = renderer(flat, CAMERA, FootprintSettings(source))
    exact = renderer(flat, CAMERA, FootprintSettings("calibration", "project"))
    frames = [(warped(frame), exact(frame)) for frame in range(flat.frames(CAMERA))]
    least = {"drivable": 0.99, "vehicles": 0.95}  # cells of 0.1 m allow no more
    for layer in LAYERS:
        assert overlap([(getattr(a, layer), getattr(b, layer)) for a, b in frames]) >= least[layer]


def test_the_ground_through_the_boxes_is_the_flat_one(flat):
    surface = renderer(flat, CAMERA, FootprintSettings("surface", "project"))
    level = renderer(flat, CAMERA, FootprintSettings("calibration", "project"))
    frames = [(surface(frame).drivable, level(frame).drivable) for frame in range(flat.frames(CAMERA))]
    assert overlap(frames) >= 0.995


@pytest.mark.parametrize("source", ["surface", "calibration"])
@pytest.mark.parametrize(
    ("scale", "drivable", "vehicles"), [(1, 0.98, 0.92), (2, 0.98, 0.86), (4, 0.97, 0.75)]
)
def test_there_and_back_again(flat, source, scale, drivable, vehicles):
    """BEV → camera → BEV, as far as the camera sees and at most 40 m: thin cars lose most."""
    rendered = renderer(flat, CAMERA, FootprintSettings(source, scale=scale))
    size = tuple(side // scale for side in IMAGE_SIZE)
    bev_from_mask = homographies(flat, source) @ image_from_resized(IMAGE_SIZE, size)
    seen = flat.dataset(CAMERA, "field_of_view")[:] > 0
    seen[:, flat.grid.positions_m(np.c_[np.zeros(1000), np.arange(1000)])[:, 0] > 40] = False
    for layer, least in (("drivable", drivable), ("vehicles", vehicles)):
        masks = flat.dataset(CAMERA, layer)
        pairs = [
            (
                warp_to_bev(getattr(rendered(frame), layer), bev_from_mask[frame], flat.grid.shape)
                * seen[frame],
                masks[frame] * seen[frame],
            )
            for frame in range(flat.frames(CAMERA))
        ]
        assert overlap(pairs) >= least


def test_whole_bodies_are_far_larger_than_footprints(flat):
    body = renderer(flat, CAMERA, FootprintSettings(method="full-body"))
    footprint = renderer(flat, CAMERA, FootprintSettings(method="project"))
    for frame in range(flat.frames(CAMERA)):
        whole, ground = body(frame).vehicles, footprint(frame).vehicles
        assert not (ground > whole).any()
        assert whole.sum() > 2 * ground.sum()
        np.testing.assert_array_equal(body(frame).drivable, footprint(frame).drivable)


@pytest.mark.slow
def test_on_hills_what_the_boxes_tell_beats_the_calibration(tmp_path):
    _, summary = shards(tmp_path, frames=6, relief_m=2.0)
    errors = {method.method: [r.median_m for r in method.ranges if r.boxes > 5] for method in summary.methods}
    assert errors["calibration"]
    for method in ("surface", "dlt", "plane"):
        assert errors[method][-1] < errors["calibration"][-1] / 2
