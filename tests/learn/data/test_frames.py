import dataclasses
import pickle

import h5py
import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from ogmkit.errors import DataFileError, SettingsError, ShardError
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.homography.projective import apply
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.tensors import as_float
from ogmkit.samples.index import index_frames
from ogmkit.samples.lidar_image import lidar_image
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import read_manifest, write_manifest
from ogmkit.shards.reader import Shard

SCENES = ("scene-0001", "scene-0002")
ALL = SampleSpec((30, 64), "calibration", "calibration", 1.0, True, True, True, True)
SHAPES = {
    "image": (3, 30, 64),
    "masks": (2, 30, 64),
    "bev": (2, 30, 20),
    "bev_known": (30, 20),
    "bev_from_image": (3, 3),
    "homography_valid": (),
    "intrinsics": (3, 3),
    "level_from_camera": (4, 4),
    "lidar": (3, 30, 20),
    "past": (6, 2),
    "future": (6, 2),
    "trajectory_valid": (),
    "camera": (),
    "index": (),
    "mirrored": (),
}


@pytest.fixture(scope="module")
def make(sample_shards):
    """A dataset of all frames, of a folder's or the shared shards'."""

    def dataset(spec, out=sample_shards, cameras=(), **options):
        index = index_frames(out, SCENES, cameras, needs=spec, valid_only=False)
        return FrameDataset(index, spec, **options)

    return dataset


@pytest.fixture(scope="module")
def front(sample_shards):
    """The first scene's shard, to read what samples should hold."""
    with Shard(sample_shards / "scene-0001.h5") as shard:
        yield lambda name: shard.dataset("CAM_FRONT", name)


def test_a_whole_sample(make):
    sample = make(ALL)[3]

    assert {name: tuple(value.shape) for name, value in sample.items()} == SHAPES
    kinds = {torch.float64: {"bev_from_image", "intrinsics", "level_from_camera"}}
    kinds |= {
        torch.bool: {"homography_valid", "trajectory_valid", "mirrored"},
        torch.int64: {"camera", "index"},
    }
    kinds |= {torch.float32: set(SHAPES) - set.union(*kinds.values())}
    assert all(sample[name].dtype == kind for kind, names in kinds.items() for name in names)
    assert 0 <= sample["image"].min() < sample["image"].max() <= 1


@pytest.mark.parametrize(
    ("spec", "names"),
    [
        (SampleSpec(), set()),
        (SampleSpec((30, 64)), {"image"}),
        (SampleSpec((30, 64), masks="large"), {"image", "masks"}),
        (SampleSpec(homography="surface"), {"bev_from_image", "homography_valid"}),
        (SampleSpec(bev_cell_m=1.0, bev=True), {"bev", "bev_known"}),
        (SampleSpec(bev_cell_m=1.0, lidar=True), {"lidar"}),
        (SampleSpec(calibration=True), {"intrinsics", "level_from_camera"}),
        (SampleSpec(trajectory=True), {"past", "future", "trajectory_valid"}),
    ],
    ids=lambda value: "+".join(sorted(value)) if isinstance(value, set) else "",
)
def test_only_what_is_asked_for(make, spec, names):
    assert set(make(spec)[0]) == names | {"camera", "index", "mirrored"}


def test_several_cameras_and_names(make, sample_shards):
    dataset = make(SampleSpec(), cameras=["CAM_FRONT", "CAM_BACK"])

    assert dataset.cameras == ("CAM_FRONT", "CAM_BACK")
    assert [int(dataset[i]["camera"]) for i in (0, 8, 16, 31)] == [0, 1, 0, 1]
    assert dataset.place(31) == ("scene-0002", "CAM_BACK", 7)
    with Shard(sample_shards / "scene-0002.h5") as shard:
        token = shard.strings("CAM_BACK", "sample_token")[7]
    assert dataset.name(31) == f"scene-0002 CAM_BACK frame 7 ({token})"
    assert int(dataset[31]["index"]) == 31


def test_calibration_and_homography_follow_the_resize(make, sample_grid):
    """Points of the flat ground are projected, found in the resized image, and taken to their cells."""
    sample = make(ALL, cameras=["CAM_FRONT"])[2]
    ground_level = np.array([[8.0, 2.5, 0.0], [12.0, -4.0, 0.0], [25.0, 1.0, 0.0]])
    camera_from_level = inverse(sample["level_from_camera"].numpy())

    pixels, depth = project(sample["intrinsics"].numpy(), transform_points(camera_from_level, ground_level))
    cells, w = apply(sample["bev_from_image"].numpy(), pixels)

    assert (depth > 0).all()
    assert (w > 0).all()
    assert ((pixels > -0.5) & (pixels < np.array([63.5, 29.5]))).all()
    np.testing.assert_allclose(cells, sample_grid.cells(ground_level), atol=1e-6)
    assert abs(sample["bev_from_image"][2, 2]) == pytest.approx(1)


def test_a_pixel_of_the_resized_image_is_the_image_s_ray(make, front):
    """Half-pixel exactness, worked by hand: 90 × 160 at 30 × 64 is divided by 3 and 2.5."""
    sample = make(ALL, cameras=["CAM_FRONT"])[2]
    (fx, _, cx), (_, fy, cy), _ = front("intrinsics")[2]

    expected = [[fx / 2.5, 0, (cx + 0.5) / 2.5 - 0.5], [0, fy / 3, (cy + 0.5) / 3 - 0.5], [0, 0, 1]]
    np.testing.assert_allclose(sample["intrinsics"], expected)


def test_without_an_image_size_matrices_are_the_shard_s(make, front):
    sample = make(SampleSpec(homography="surface", calibration=True), cameras=["CAM_FRONT"])[5]

    np.testing.assert_allclose(sample["bev_from_image"], front("homography/surface/bev_from_image")[5])
    np.testing.assert_allclose(sample["intrinsics"], front("intrinsics")[5])


@pytest.mark.parametrize("masks", ["calibration", "large"])
def test_masks_are_taken_at_the_nearest_pixel_s_centre(make, front, masks):
    sample = make(SampleSpec((30, 64), masks=masks), cameras=["CAM_FRONT"])[4]
    stored = np.stack([front(f"footprints/{masks}/{target}")[4] for target in ("drivable", "vehicles")])
    rows, columns = (
        np.floor((np.arange(own) + 0.5) * side / own).astype(int)
        for own, side in zip((30, 64), stored.shape[1:], strict=True)
    )

    assert stored.shape[1:] != (30, 64)
    assert sample["masks"].any()
    np.testing.assert_array_equal(sample["masks"], stored[:, rows][:, :, columns])


def test_bev_truth_holds_what_rasters_are_named(make, further_shards):
    names = ("layers/drivable_area", "classes/car", "vehicles")
    spec = SampleSpec(bev_cell_m=0.5, bev=True, rasters=names)
    sample = make(spec, further_shards, ["CAM_FRONT"])[6]
    with Shard(further_shards / "scene-0001.h5") as shard:
        stored = np.stack([shard.dataset("CAM_FRONT", name)[6] for name in names])
    assert stored[[0, 2]].any(axis=(1, 2)).all()
    np.testing.assert_array_equal(sample["bev"], stored)
    flipped = make(spec, further_shards, ["CAM_FRONT"], augment=Augmentation(flip=1.0))[6, 0]
    np.testing.assert_array_equal(flipped["bev"][:, :, :30], sample["bev"][:, :, :30].flip(-1))


def test_bev_truth_is_by_majority_and_all_known(make, front, sample_grid):
    own = make(ALL, cameras=["CAM_FRONT"])
    fine = make(SampleSpec(bev_cell_m=0.5, bev=True), cameras=["CAM_FRONT"])
    stored = np.stack([front("drivable")[6], front("vehicles")[6]])

    assert own.own_grid.shape == (30, 20)
    assert fine.own_grid == sample_grid
    np.testing.assert_array_equal(fine[6]["bev"], stored)
    counts = np.array(
        [
            [[c[2 * i : 2 * i + 2, 2 * j : 2 * j + 2].sum() for j in range(20)] for i in range(30)]
            for c in stored
        ]
    )
    assert set(np.unique(counts)) >= {0, 1, 2, 4}
    np.testing.assert_array_equal(own[6]["bev"], counts >= 2)
    assert (own[6]["bev_known"] == 1).all()
    assert make(SampleSpec()).own_grid is None


def test_lidar_is_the_frame_s_own_points(make, front):
    dataset = make(ALL, cameras=["CAM_FRONT"])
    first, stop = front("lidar/offsets")[4:6]

    expected = lidar_image(front("lidar/points")[first:stop], dataset.own_grid)

    assert expected.any()
    np.testing.assert_array_equal(dataset[4]["lidar"], expected)


def test_an_invalid_homography_is_nan(make):
    dataset = make(SampleSpec((30, 64), homography="dlt"), cameras=["CAM_FRONT"])
    samples = [dataset[i] for i in range(len(dataset))]

    valid = [bool(sample["homography_valid"]) for sample in samples]

    assert 0 < sum(valid) < len(valid)
    assert [bool(sample["bev_from_image"].isfinite().all()) for sample in samples] == valid
    assert [bool(sample["bev_from_image"].isnan().all()) for sample in samples] == [not v for v in valid]


def test_trajectories_are_the_shard_s(make, front):
    sample = make(ALL, cameras=["CAM_FRONT"])[4]

    np.testing.assert_allclose(sample["past"], front("trajectory/past")[4], rtol=1e-6)
    np.testing.assert_allclose(sample["future"], front("trajectory/future")[4], rtol=1e-6)
    assert not sample["trajectory_valid"]
    assert sample["past"].isnan().any()


def test_a_plain_place_is_never_augmented(make):
    augmented = make(ALL, augment=Augmentation(flip=1.0))
    plain = make(ALL)

    assert (augmented[3]["image"] == plain[3]["image"]).all()
    assert (plain[(3, 7)]["image"] == plain[3]["image"]).all()
    assert not (augmented[(3, 7)]["image"] == plain[3]["image"]).all()


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize("start", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_workers_read_what_this_process_reads(make, start):
    dataset = make(ALL, augment=Augmentation())
    here = [dataset[(i, 100 + i)] for i in range(len(dataset))]  # the handles are open when workers start
    keys = [[(i, 100 + i) for i in range(first, first + 8)] for first in (0, 8, 16, 24)]
    batches = DataLoader(dataset, batch_sampler=keys, num_workers=2, multiprocessing_context=start)

    there = [batch for _ in range(2) for batch in batches][4:]  # a second epoch's

    for name in SHAPES:
        expected = torch.stack([sample[name] for sample in here])
        torch.testing.assert_close(
            torch.cat([batch[name] for batch in there]), expected, rtol=0, atol=0, equal_nan=True
        )


def test_a_dataset_pickles_small(make):
    dataset = make(ALL)
    dataset[0]

    assert len(pickle.dumps(dataset)) < 8000


def test_specifications_that_contradict_themselves(make):
    with pytest.raises(SettingsError, match="masks come at the image's pixels, so they need an image size"):
        make(SampleSpec(masks="calibration"))
    for needs in (SampleSpec(bev=True), SampleSpec(lidar=True)):
        with pytest.raises(SettingsError, match="need the side of a BEV cell"):
            make(needs)
    with pytest.raises(SettingsError, match=r"BEV cell: 0\.7 m is not a whole number"):
        make(SampleSpec(bev_cell_m=0.7, bev=True))


def test_damage_is_named(make, copied_shards):
    with h5py.File(copied_shards / "scene-0001.h5", "r+") as h5:
        h5["CAM_FRONT/image"][1] = h5["CAM_FRONT/image"][1][:-300]
        offset = h5["CAM_FRONT/drivable"].id.get_chunk_info(2).byte_offset
    with (copied_shards / "scene-0001.h5").open("r+b") as file:
        file.seek(offset)
        file.write(bytes(16))

    with pytest.raises(DataFileError, match=r"scene-0001\.h5: CAM_FRONT frame 1: image is not a whole JPEG"):
        make(SampleSpec((30, 64)), out=copied_shards, cameras=["CAM_FRONT"])[1]
    with pytest.raises(ShardError, match=r"scene-0001\.h5: is damaged inside .*; remove it and run"):
        make(SampleSpec(bev_cell_m=1.0, bev=True), out=copied_shards, cameras=["CAM_FRONT"])[2]


def test_an_absent_image_is_named(make, make_sample_shards, tmp_path, tiny_dataroot):
    out = make_sample_shards(tmp_path, images="reference")
    root = tmp_path / "dataset"
    root.mkdir()
    write_manifest(out, dataclasses.replace(read_manifest(out), dataroot=str(root)))

    with pytest.raises(DataFileError, match=r"dataset/samples/CAM_BACK/\S+: image can't be read \(No such"):
        make(SampleSpec((30, 64)), out=out)[0]


def test_compact_samples_are_bytes_of_the_same_values(make):
    """As networks get them: floats are made where they are."""
    plain, compact = make(ALL)[3], make(ALL, compact=True)[3]
    assert {name for name, value in compact.items() if value.dtype == torch.uint8} == {
        "image",
        "masks",
        "bev",
        "bev_known",
    }
    for name, value in as_float(compact).items():
        assert value.dtype == plain[name].dtype
        torch.testing.assert_close(value, plain[name], rtol=0, atol=0, equal_nan=True)
