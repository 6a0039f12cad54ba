from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import SettingsError
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.grid import GridSpec
from ogmkit.homography.projective import apply
from ogmkit.learn.data.augment import Augmentation, flipped, jittered
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.index import index_frames
from ogmkit.samples.pooling import equal_parts, part_counts, shares
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.reader import Shard

ALL = SampleSpec((30, 64), "calibration", "calibration", 0.5, True, True, True, True)
FLIP = Augmentation(colour=0.0, flip=1.0)
MIRROR = np.array([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def dataset(sample_shards):
    index = index_frames(sample_shards, ["scene-0002"], ["CAM_FRONT"], needs=replace(ALL, trajectory=False))
    return FrameDataset(index, ALL, augment=FLIP)


@pytest.fixture(scope="module", params=[1, 5])
def both(request, dataset):
    """A sample as it is, and flipped, as numpy arrays."""
    i = request.param
    return tuple({name: part.numpy() for name, part in dataset[key].items()} for key in (i, (i, 0)))


@pytest.fixture(scope="module")
def corners_level(sample_shards):
    """Bottom corners of some boxes before the camera, laid on z = 0, (N, 3)."""
    with Shard(sample_shards / "scene-0002.h5") as shard:
        boxes = shard.boxes("CAM_FRONT", 5)
        level_from_box = shard.dataset("CAM_FRONT", "level_from_global")[5] @ boxes.global_from_box
    signs = np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]]) / 2
    corners = transform_points(level_from_box, signs * boxes.size_wlh[:, None, [1, 0, 2]]).reshape(-1, 3)
    corners[:, 2] = 0
    return corners[corners[:, 0] > 6]


def pixels_of(sample, points_level):
    pixels, depth = project(
        sample["intrinsics"], transform_points(inverse(sample["level_from_camera"]), points_level)
    )
    assert (depth > 0).all()
    return pixels


def test_boxes_of_the_mirrored_world_are_seen_mirrored(both, corners_level):
    plain, flipped_ = both
    assert len(corners_level) >= 8

    mirrored = pixels_of(flipped_, corners_level * MIRROR)

    expected = pixels_of(plain, corners_level) * [-1, 1] + [63, 0]
    np.testing.assert_allclose(mirrored, expected, atol=1e-9)
    assert np.linalg.det(flipped_["level_from_camera"][:3, :3]) == pytest.approx(1)
    assert flipped_["intrinsics"][0, 0] > 0


def test_the_homography_takes_mirrored_pixels_to_mirrored_cells(both, corners_level, sample_grid):
    _, flipped_ = both
    mirrored = corners_level * MIRROR

    cells, w = apply(flipped_["bev_from_image"], pixels_of(flipped_, mirrored))

    np.testing.assert_allclose(cells, sample_grid.cells(mirrored), atol=1e-5)
    assert (w > 0).all()
    assert abs(flipped_["bev_from_image"][2, 2]) == pytest.approx(1)


def test_a_mirrored_place_keeps_its_truth(both, sample_grid):
    """Cell by cell through metres: what stood at (x, y) stands at (x, −y)."""
    plain, flipped_ = both
    rows, columns = np.indices(sample_grid.shape)
    positions_m = sample_grid.positions_m(np.stack([columns, rows], axis=-1))
    mirror_columns, mirror_rows = np.moveaxis(
        np.round(sample_grid.cells(positions_m * [1, -1])).astype(int), -1, 0
    )
    inside = (mirror_columns >= 0) & (mirror_columns < sample_grid.columns)

    assert 0 < inside.sum() < inside.size
    np.testing.assert_array_equal(flipped_["bev_known"], inside)
    assert not flipped_["bev"][:, ~inside].any()
    source = plain["bev"][:, mirror_rows[inside], mirror_columns[inside]]
    assert source.any(axis=1).all()
    np.testing.assert_array_equal(flipped_["bev"][:, inside], source)


def test_image_and_masks_are_mirrored(both):
    plain, flipped_ = both
    for name in ("image", "masks"):
        np.testing.assert_array_equal(flipped_[name], plain[name][..., ::-1])


def test_flipped_masks_lie_on_the_flipped_truth(both, sample_grid):
    """Masks warped to the grid by the homography, before and after: the same picture, mirrored."""
    known = both[1]["bev_known"].astype(bool)
    laid = [
        np.stack(
            [warp_to_bev(m.astype(np.uint8), s["bev_from_image"], sample_grid.shape) for m in s["masks"]]
        )
        for s in both
    ]
    as_sample = SampleArrays(np.array([[30, 64]]), bev=laid[0][None])

    expected = flipped(as_sample, sample_grid).bev[0]

    assert expected[:, known].any(axis=1).all()
    # Cells whose pixel lies on the edge between two fall to either side.
    assert (laid[1] == expected)[:, known].mean() > 0.995


def test_lidar_points_are_mirrored_before_they_become_cells(both):
    """So cells from outside the grid are filled, too: sensors know no map's edge."""
    plain, flipped_ = both
    known = flipped_["bev_known"].astype(bool)
    mirrored = flipped(
        SampleArrays(np.array([[30, 64]]), bev=plain["lidar"][None]), GridSpec(0.5, 60, 40, 60, 15)
    )

    agree = np.isclose(flipped_["lidar"], mirrored.bev[0], rtol=1e-5)

    assert agree[:, known].mean() > 0.99
    assert flipped_["lidar"][:, ~known].any()


def test_paths_change_sides(both):
    plain, flipped_ = both
    for name in ("past", "future"):
        np.testing.assert_array_equal(flipped_[name], plain[name] * [1, -1])
        assert np.isfinite(plain[name]).any()


def grids():
    """Of 4 to 12 columns, the ego on an edge or a centre, inside or out."""
    return st.builds(
        lambda columns, halves: GridSpec(0.5, 3, columns, 3.0, halves / 2),
        st.integers(4, 12),
        st.integers(-6, 40),
    )


def arrays_of(sample_grid, seed):
    rng = np.random.default_rng(seed)
    return SampleArrays(
        image_size=np.array([[6, 8]] * 2),
        image=rng.integers(0, 256, (2, 6, 8, 3), dtype=np.uint8),
        masks=rng.integers(0, 2, (2, 2, 6, 8), dtype=np.uint8),
        bev=rng.integers(0, 2, (2, 2, *sample_grid.shape), dtype=np.uint8),
        bev_parts=rng.random((2, 2, *sample_grid.shape), dtype=np.float32),
        known_columns=np.ones(sample_grid.columns, np.bool_),
        bev_from_image=rng.normal(size=(2, 3, 3)) * [[1], [1], [0.1]] + np.diag([0, 0, -1.0]),
        homography_valid=np.ones(2, np.bool_),
        intrinsics=np.stack([np.array([[70.0, 0.3, 4.1], [0, 71.0, 2.2], [0, 0, 1]])] * 2),
        level_from_camera=rng.normal(size=(2, 4, 4)),
        points_level=tuple(rng.normal(size=(5, 4)).astype(np.float32) for _ in range(2)),
        past=rng.normal(size=(6, 2)),
        future=rng.normal(size=(6, 2)),
        trajectory_valid=np.bool_(True),
        positions=rng.normal(size=(2, 2)),
    )


@given(grids(), st.integers(0, 99))
def test_twice_is_the_identity_where_known(sample_grid, seed):
    plain = arrays_of(sample_grid, seed)

    back = flipped(flipped(plain, sample_grid), sample_grid)

    known = back.known_columns
    np.testing.assert_array_equal(back.bev[..., known], plain.bev[..., known])
    assert not back.bev[..., ~known].any()
    centre_inside = 0 < sample_grid.ego_column < sample_grid.columns
    assert known.any() == centre_inside
    for name in ("image", "masks", "past", "future", "positions"):
        np.testing.assert_array_equal(getattr(back, name), getattr(plain, name))
    for ours, theirs in zip(back.points_level, plain.points_level, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_allclose(back.intrinsics, plain.intrinsics)
    np.testing.assert_allclose(back.level_from_camera, plain.level_from_camera)
    scale = abs(plain.bev_from_image[:, 2:, 2:])
    np.testing.assert_allclose(back.bev_from_image, plain.bev_from_image / scale, rtol=1e-6, atol=1e-6)


@given(st.integers(1, 4), st.integers(2, 8), st.integers(-3, 20), st.integers(0, 99))
def test_averages_over_parts_are_mirrored_as_the_masks_are(width, columns, halves, seed):
    """The ego is on a part's edge or in its middle, inside the grid or out."""
    grid, parts = GridSpec(0.5, 6, width * columns, 6.0, halves * width / 2), (2, columns)
    bev = np.random.default_rng(seed).integers(0, 2, (1, 2, *grid.shape), dtype=np.uint8)
    averages = shares(part_counts(bev, parts), grid.shape)

    found = flipped(SampleArrays(np.array([[6, 8]]), bev=bev, bev_parts=averages), grid)

    assert equal_parts(grid, parts)
    np.testing.assert_array_equal(found.bev_parts, shares(part_counts(found.bev, parts), grid.shape))


@given(grids(), st.integers(0, 99))
def test_a_flip_leaves_its_input_alone(sample_grid, seed):
    plain, same = arrays_of(sample_grid, seed), arrays_of(sample_grid, seed)

    flipped(plain, sample_grid)

    for field in fields(SampleArrays):
        ours, theirs = getattr(plain, field.name), getattr(same, field.name)
        np.testing.assert_array_equal(
            np.concatenate(ours) if isinstance(ours, tuple) else ours,
            np.concatenate(theirs) if isinstance(theirs, tuple) else theirs,
        )


def test_unknown_columns_by_hand():
    """Ego on the edge between columns 1 and 2 of 6: 0 … 3 mirror each other, the rest comes from outside."""
    grid = GridSpec(0.5, 1, 6, 1.0, 2.0)
    plain = SampleArrays(
        np.array([[2, 2]]),
        bev=np.array([[[[1, 0, 0, 1, 1, 1]], [[0, 1, 0, 0, 0, 1]]]], np.uint8),
        known_columns=np.ones(6, np.bool_),
    )

    mirrored = flipped(plain, grid)

    assert mirrored.known_columns.tolist() == [True] * 4 + [False] * 2
    assert mirrored.bev.tolist() == [[[[1, 0, 0, 1, 0, 0]], [[0, 0, 1, 0, 0, 0]]]]


def test_a_coarse_cell_is_known_where_all_its_cells_are(sample_shards):
    needs = SampleSpec(bev_cell_m=2.0, bev=True)
    index = index_frames(sample_shards, ["scene-0002"], ["CAM_FRONT"], needs=needs)
    dataset = FrameDataset(index, needs, augment=FLIP)

    known = dataset[(0, 0)]["bev_known"]

    # Of 40 fine columns 0 … 29 are known, four a coarse one.
    assert (known == np.array([1.0] * 7 + [0.0] * 3)).all()


def test_brightness_contrast_and_saturation_by_hand():
    grey = np.array([[[40, 40, 40], [80, 80, 80]]], np.uint8)
    red = np.array([[[200, 0, 0]]], np.uint8)  # luma 59.8

    assert jittered(grey, 1.5, 1.0, 1.0)[0, :, 0].tolist() == [60, 120]
    assert jittered(grey, 1.0, 0.5, 1.0)[0, :, 0].tolist() == [50, 70]
    assert jittered(grey, 1.5, 0.5, 0.0)[0, :, 0].tolist() == [75, 105]
    assert jittered(grey, 4.0, 1.0, 1.0)[0, :, 0].tolist() == [160, 255]
    assert jittered(red, 1.0, 1.0, 0.0)[0, 0].tolist() == [60, 60, 60]
    assert jittered(red, 1.0, 1.0, 0.5)[0, 0].tolist() == [130, 30, 30]


@given(st.integers(0, 99), st.floats(0.8, 1.2), st.floats(0.8, 1.2), st.floats(0.8, 1.2))
def test_jitter_keeps_greys_grey_and_one_is_the_identity(seed, brightness, contrast, saturation):
    image = np.random.default_rng(seed).integers(0, 256, (3, 4, 3), dtype=np.uint8)
    greys = np.repeat(image[..., :1], 3, axis=-1)

    changed = jittered(greys, brightness, contrast, saturation).astype(int)

    assert (np.ptp(changed, axis=-1) <= 1).all()
    np.testing.assert_array_equal(jittered(image, 1.0, 1.0, 1.0), image)


def test_the_seed_alone_decides():
    grid = GridSpec(0.5, 3, 6, 3.0, 2.0)
    plain = arrays_of(grid, 1)
    augmentation = Augmentation(colour=0.3, flip=0.5)

    made = [augmentation.apply(plain, grid, seed) for seed in range(200)]
    again = augmentation.apply(plain, grid, 17)

    np.testing.assert_array_equal(again.image, made[17].image)
    np.testing.assert_array_equal(again.past, made[17].past)
    flips = sum(one.past[0, 1] != plain.past[0, 1] for one in made)
    assert 70 < flips < 130
    assert len({one.image.tobytes() for one in made}) > 190


def test_all_frames_of_a_sample_change_alike():
    grid = GridSpec(0.5, 3, 6, 3.0, 2.0)
    plain = arrays_of(grid, 1)
    twice = replace(plain, image=np.stack([plain.image[0]] * 2))

    made = Augmentation(0.5, 1.0).apply(twice, grid, 3)

    np.testing.assert_array_equal(made.image[0], made.image[1])


def test_nothing_asked_for_changes_nothing():
    grid = GridSpec(0.5, 3, 6, 3.0, 2.3)
    plain = arrays_of(grid, 1)
    still = Augmentation(0.0, 0.0)

    still.require_grid(grid)

    assert all(still.apply(plain, grid, seed) is plain for seed in range(20))


def test_what_can_t_be_is_refused():
    with pytest.raises(SettingsError, match=r"augmentation: flip 1\.5 is not within 0 … 1"):
        Augmentation(flip=1.5)
    with pytest.raises(SettingsError, match="augmentation: colour nan is not within"):
        Augmentation(colour=float("nan"))
    with pytest.raises(
        SettingsError, match=r"the ego's column 2\.3 is not a whole or half number.*set flip to 0"
    ):
        Augmentation().require_grid(GridSpec(0.5, 3, 6, 3.0, 2.3))


def test_a_grid_given_in_integers_can_be_mirrored():
    Augmentation().require_grid(GridSpec(0.5, 3, 6, 3, 2))
