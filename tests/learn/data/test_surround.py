"""Samples round the vehicle as tensors: each layout against the others, by points and cells."""

import numpy as np
import pytest
import torch

from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.surround import SurroundDataset
from ogmkit.samples.images import IMAGENET_STATISTICS
from ogmkit.samples.surround import index_surround
from ogmkit.samples.surround_spec import SurroundSpec

SCENES = ("scene-0001", "scene-0002")
POINTS_M = torch.tensor([[12.0, 3.0, 0.0, 1.0], [25.0, -8.0, 1.0, 1.0], [6.0, 0.5, 0.2, 1.0]])
"""x ahead, y left, z up: before the first camera."""


@pytest.fixture
def sample(surround_shards):
    """A sample: `sample(layout, definition)`."""

    def read(layout="ogmkit", definition="surround", i=6):
        spec = SurroundSpec(definition, (40, 100), 11, layout)
        dataset = SurroundDataset(index_surround(surround_shards, SCENES, needs=spec), spec)
        return dataset[i]

    return read


def pixels_of(sample):
    """(3, 2) pixels of the points in the first image, in the layout `ogmkit`."""
    camera = torch.linalg.inv(sample["reference_from_camera"][0]).float()
    found = POINTS_M @ camera[:3].T @ sample["intrinsics"][0].float().T
    return found[:, :2] / found[:, 2:]


def test_shapes_and_kinds(sample):
    own = sample()
    assert {name: (tuple(one.shape), one.dtype) for name, one in own.items()} == {
        "image": ((2, 3, 40, 100), torch.float32),
        "intrinsics": ((2, 3, 3), torch.float64),
        "reference_from_camera": ((2, 4, 4), torch.float64),
        "labels": ((2, 200, 200), torch.float32),
        "visibility": ((200, 200), torch.uint8),
        "nearness": ((200, 200), torch.float32),
        "seen": ((200, 200), torch.bool),
        "index": ((), torch.int64),
    }
    assert 0.1 < own["image"].mean() < 0.9
    assert own["image"].max() <= 1
    assert int(own["index"]) == 6


def test_lift_splat_shoots_points_fall_where_they_belong(sample):
    own, lss = sample(), sample("lss")
    *_, index = lss.values()
    assert list(lss) == ["imgs", "rots", "trans", "intrins", "post_rots", "post_trans", "binimg", "index"]
    # From pixels to points as its `get_geometry` does: undo the resizing, then the camera.
    depth = (torch.linalg.inv(own["reference_from_camera"][0]).float() @ POINTS_M.T)[2]
    pixels = torch.column_stack([pixels_of(own), depth])
    pixels = torch.linalg.solve(lss["post_rots"][0], (pixels - lss["post_trans"][0]).T).T
    pixels = torch.column_stack([pixels[:, :2] * pixels[:, 2:], pixels[:, 2]])
    points = torch.linalg.solve(lss["intrins"][0], pixels.T).T @ lss["rots"][0].T + lss["trans"][0]
    torch.testing.assert_close(points, POINTS_M[:, :3], rtol=0, atol=1e-3)
    mean, deviation = (torch.tensor(IMAGENET_STATISTICS[name])[:, None, None] for name in ("mean", "std"))
    torch.testing.assert_close(lss["imgs"] * deviation + mean, own["image"])
    assert int(index) == 6


def test_cross_view_transformers_pixels_and_cells(sample):
    own, cvt = sample(), sample("cvt")
    assert list(cvt) == [
        "image", "intrinsics", "extrinsics", "bev", "view", "center", "visibility", "index",
    ]  # fmt: skip
    found = POINTS_M @ cvt["extrinsics"][0, :3].T @ cvt["intrinsics"][0].T
    torch.testing.assert_close(found[:, :2] / found[:, 2:], pixels_of(own), rtol=0, atol=1e-3)
    assert cvt["center"].shape == (1, 200, 200)
    assert (cvt["visibility"].dtype, cvt["visibility"].shape) == (torch.uint8, (200, 200))


def test_simple_bevs_cameras_hang_on_one_that_looks_ahead(sample):
    own, simple = sample(), sample("simple-bev")
    in_eye = torch.column_stack([-POINTS_M[:, 1], 1.5 - POINTS_M[:, 2], POINTS_M[:, 0], torch.ones(3)])
    camera_from_eye = torch.linalg.inv(simple["cam0_T_camXs"][0])
    found = in_eye @ camera_from_eye.T @ simple["pix_T_cams"][0].T
    torch.testing.assert_close(found[:, :2] / found[:, 2:3], pixels_of(own), rtol=0, atol=1e-3)
    torch.testing.assert_close(simple["rgb_camXs"] + 0.5, own["image"])
    hidden = sample("cvt")["visibility"] == 1
    assert simple["valid_bev_g"].shape == (1, 200, 200)
    assert (simple["valid_bev_g"] == 0).sum() == hidden.sum()


@pytest.mark.parametrize("definition", ["surround", "lss", "pointbev"])
def test_all_layouts_show_the_same_cells(sample, definition):
    cells = {
        "lss": sample("lss", definition)["binimg"],
        "cvt": sample("cvt", definition)["bev"].flip(1, 2),
        "simple-bev": sample("simple-bev", definition)["seg_bev_g"].flip(2),
    }
    assert 0 < cells["lss"].mean() < 0.9
    torch.testing.assert_close(cells["cvt"], cells["lss"])
    torch.testing.assert_close(cells["simple-bev"], cells["lss"])


@pytest.mark.parametrize("definition", ["surround", "lss", "cvt", "pointbev"])
def test_the_view_matrix_leads_to_the_cells_of_boxes(sample, definition):
    """A vehicle of LSS's raster, as x and y, is one of the array's that the matrix leads to."""
    rows, columns = np.nonzero(sample("lss", "lss")["binimg"][0].numpy())
    x, y = rows * 0.5 - 49.75, columns * 0.5 - 49.75
    cvt = sample("cvt", definition)
    column, row, _ = np.rint(cvt["view"].numpy() @ np.stack([x, y, np.ones(len(x))])).astype(int)
    inside = (row >= 0) & (row < 200) & (column >= 0) & (column < 200)
    drawn = (cvt["visibility"] < 255).numpy()[row[inside], column[inside]]
    assert drawn.mean() > 0.65  # its outline makes LSS's vehicles a third larger
    assert (cvt["visibility"] < 255).float().mean() < 0.2


def test_a_loader_takes_them_by_place_and_seed(surround_shards):
    spec = SurroundSpec("cvt", (40, 100), 11, "cvt", ("car", "truck"))
    dataset = SurroundDataset(index_surround(surround_shards, SCENES, needs=spec), spec)
    batches = loader(dataset, EpochBatches(len(dataset), 3, seed=0, shuffle=True), workers=0)
    first = next(iter(batches))
    assert first["image"].shape == (3, 2, 3, 40, 100)
    assert first["bev"].shape == (3, 2, 200, 200)
    torch.testing.assert_close(first["bev"][1], dataset[int(first["index"][1])]["bev"])
