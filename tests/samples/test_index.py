import dataclasses
import pickle

import h5py
import numpy as np
import pytest

from ogmkit.errors import SettingsError, ShardError, TrainingError
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.poses import require_finite_poses
from ogmkit.samples.reading import Rows, read_sample
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import AMENDING, read_manifest, write_manifest
from ogmkit.shards.reader import Shard

SCENES = ("scene-0001", "scene-0002")
IMAGE = SampleSpec((45, 80))
TRAJECTORY = SampleSpec((45, 80), trajectory=True)


def places(index):
    return [index.place(i) for i in range(len(index))]


@pytest.fixture
def change(copied_shards):
    """Overwrite a dataset of CAM_FRONT in a scene's shard, in the copy."""

    def write(name, values, scene="scene-0001", camera="CAM_FRONT"):
        with h5py.File(copied_shards / f"{scene}.h5", "r+") as h5:
            h5[f"{camera}/{name}"][...] = values

    return write


def test_all_frames_of_scenes_and_cameras_in_order(sample_shards, sample_grid):
    index = index_frames(sample_shards, SCENES[::-1], ["CAM_FRONT", "CAM_BACK"], needs=IMAGE)

    assert places(index) == [
        (scene, camera, frame)
        for scene in ("scene-0002", "scene-0001")
        for camera in ("CAM_FRONT", "CAM_BACK")
        for frame in range(8)
    ]
    assert index.grid == sample_grid


def test_each_scene_by_itself_has_its_samples_in_the_same_order(sample_shards):
    cameras = ["CAM_FRONT", "CAM_BACK"]
    index = index_frames(sample_shards, SCENES, cameras, needs=IMAGE, limit=5)
    parts = list(index.by_scene())
    assert [part.scenes for part in parts] == [(scene,) for scene in SCENES]
    assert [place for part in parts for place in places(part)] == places(index)
    assert [part.paths for part in parts] == [(path,) for path in index.paths]
    one = index_frames(sample_shards, SCENES, cameras, needs=IMAGE, limit=1)
    assert [part.scenes for part in one.by_scene()] == [SCENES[:1]]


def test_no_camera_stands_for_all(sample_shards):
    assert index_frames(sample_shards, SCENES[:1], [], needs=IMAGE).cameras == ("CAM_BACK", "CAM_FRONT")


def test_the_index_is_light(sample_shards):
    index = index_frames(sample_shards, SCENES, [], needs=IMAGE)

    data = pickle.dumps(index)

    assert len(data) < 3000
    assert places(pickle.loads(data)) == places(index)


@pytest.mark.parametrize(
    ("needs", "source"),
    [(SampleSpec(homography="dlt"), "homography/dlt"), (SampleSpec((45, 80), masks="dlt"), "footprints/dlt")],
    ids=["homography", "masks"],
)
def test_frames_without_something_valid_are_left_out_unless_asked_for(sample_shards, needs, source):
    expected = []
    for scene in SCENES:
        with h5py.File(sample_shards / f"{scene}.h5") as h5:
            expected += [(scene, "CAM_FRONT", i) for i in np.flatnonzero(h5[f"CAM_FRONT/{source}/valid"])]
    assert 0 < len(expected) < 16

    assert places(index_frames(sample_shards, SCENES, ["CAM_FRONT"], needs=needs)) == expected
    assert len(index_frames(sample_shards, SCENES, ["CAM_FRONT"], needs=needs, valid_only=False)) == 16


def test_frames_without_a_valid_trajectory_are_left_out(copied_shards, change):
    change("trajectory/valid", np.arange(8) % 3 == 0)

    index = index_frames(copied_shards, SCENES, ["CAM_FRONT"], needs=TRAJECTORY)

    assert places(index) == [("scene-0001", "CAM_FRONT", frame) for frame in (0, 3, 6)]


@pytest.mark.parametrize(
    ("limit", "frames"), [(1, [0]), (3, [0, 2, 5]), (7, [0, 1, 2, 3, 4, 5, 6]), (8, range(8)), (99, range(8))]
)
def test_a_limit_takes_evenly_spread_frames(sample_shards, limit, frames):
    index = index_frames(sample_shards, SCENES[:1], ["CAM_FRONT"], needs=IMAGE, limit=limit)

    assert index.frame.tolist() == list(frames)


def test_sequences_are_unbroken_runs_of_six(copied_shards, change):
    change("trajectory/valid", True)
    change("trajectory/valid", np.arange(8) != 6, scene="scene-0002")

    index = index_sequences(copied_shards, SCENES, ["CAM_FRONT"], needs=TRAJECTORY)

    assert places(index) == [
        ("scene-0001", "CAM_FRONT", 5),
        ("scene-0001", "CAM_FRONT", 6),
        ("scene-0001", "CAM_FRONT", 7),
        ("scene-0002", "CAM_FRONT", 5),
        ("scene-0002", "CAM_FRONT", 7),
    ]


@pytest.mark.parametrize(
    ("gap_s", "frames"), [(0.75, [5, 6, 7]), (0.76, [7])], ids=["longest allowed", "too long"]
)
def test_a_gap_breaks_a_sequence(copied_shards, change, gap_s, frames):
    change("trajectory/valid", True)
    steps_s = np.array([0.0, 0.5, gap_s, 0.5, 0.5, 0.5, 0.5, 0.5])  # between frames 1 and 2
    change("timestamp_us", 1_500_000_000_000_000 + np.round(steps_s.cumsum() * 1e6).astype(np.int64))

    index = index_sequences(copied_shards, SCENES[:1], ["CAM_FRONT"], needs=TRAJECTORY)

    assert index.frame.tolist() == frames


def test_all_six_of_a_sequence_are_valid_unless_asked_for(copied_shards, change):
    change("trajectory/valid", True)
    change("homography/dlt/valid", np.arange(8) != 1)
    needs = SampleSpec(homography="dlt", trajectory=True)

    chosen, everything = (
        index_sequences(copied_shards, SCENES[:1], ["CAM_FRONT"], needs=needs, valid_only=valid_only)
        for valid_only in (True, False)
    )

    assert chosen.frame.tolist() == [7]
    assert everything.frame.tolist() == [5, 6, 7]


def test_sequences_without_a_whole_trajectory_are_kept_if_asked_for(sample_shards):
    # Scenes of eight frames: no frame has six before it and six after it.
    index = index_sequences(
        sample_shards, SCENES[:1], ["CAM_FRONT"], needs=TRAJECTORY, whole_trajectory=False
    )

    assert index.frame.tolist() == [5, 6, 7]
    require_finite_poses(index)
    with Shard(index.paths[0]) as shard:
        sample = read_sample(Rows(shard, "CAM_FRONT", range(1, 7)), TRAJECTORY, None)
    assert not sample.trajectory_valid
    assert np.isfinite(sample.past).all()
    assert np.isfinite(sample.future[:1]).all()
    assert np.isnan(sample.future[1:]).all()


def test_only_trajectories_called_valid_need_every_point(copied_shards, change):
    change("trajectory/valid", np.arange(8) == 6)
    index = index_sequences(
        copied_shards, SCENES[:1], ["CAM_FRONT"], needs=TRAJECTORY, whole_trajectory=False
    )

    with pytest.raises(ShardError, match=r"frame 6: its trajectory \(trajectory/future\) holds a number"):
        require_finite_poses(index)


def test_images_by_reference_are_read_from_the_dataset(make_sample_shards, sample_shards, tmp_path):
    def images(folder):
        index = index_frames(folder, SCENES[:1], ["CAM_BACK"], needs=IMAGE)
        with Shard(index.paths[0]) as shard:
            return read_sample(Rows(shard, "CAM_BACK", range(8)), IMAGE, index.image_root).image

    stored = images(sample_shards)

    assert stored.shape == (8, 45, 80, 3)
    assert (images(make_sample_shards(tmp_path, images="reference")) == stored).all()


@pytest.fixture(scope="module")
def bare(make_sample_shards, tmp_path_factory):
    """Shards without images and LiDAR points; tests only read it."""
    return make_sample_shards(tmp_path_factory.mktemp("bare"), images="none")


@pytest.mark.parametrize(
    ("needs", "problem"),
    [
        (
            SampleSpec(homography="surface"),
            r"scene-0001\.h5: CAM_BACK has no homography 'surface' \(it has none\); "
            r"run `ogmkit homography-fit \S+/out --method surface`",
        ),
        (
            SampleSpec(homography="network"),
            r"no homography 'network' .*run `ogmkit predict homography \S+/out --checkpoint RUN`",
        ),
        (IMAGE, r"/out: has no images \(--images none\); run `ogmkit extract \S+ \S+/out .*--images bytes`"),
        (
            SampleSpec(lidar=True, bev_cell_m=0.5),
            r"/out: has no LiDAR points; run `ogmkit extract \S+ \S+/out --overwrite --lidar`",
        ),
    ],
    ids=["homography", "network", "images", "lidar"],
)
@pytest.mark.parametrize("find", [index_frames, index_sequences])
def test_what_is_missing_is_said_with_its_command(bare, find, needs, problem):
    with pytest.raises(ShardError, match=problem) as caught:
        find(bare, SCENES, [], needs=needs)

    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["layers/lane", "instances/id", "image", "truck"])
def test_rasters_that_are_not_there_are_said_with_the_command(further_shards, name):
    needs = SampleSpec(bev_cell_m=0.5, bev=True, rasters=("layers/lane_divider", "classes/large", name))
    with pytest.raises(
        ShardError,
        match=rf"out: unknown raster '{name}'; .*run `ogmkit extract \S+ \S+/out --overwrite` with --layers",
    ):
        index_frames(further_shards, SCENES, [], needs=needs)


def test_missing_masks_are_said_with_their_command(sample_shards):
    with pytest.raises(
        ShardError,
        match=r"scene-0001\.h5: CAM_BACK has no footprints 'surface' \(it has calibration, dlt, large\); "
        r"run `ogmkit render-footprints \S+/out --method warp --homography surface`",
    ):
        index_frames(sample_shards, SCENES, [], needs=SampleSpec((45, 80), masks="surface"))


def test_images_whose_dataset_is_gone(make_sample_shards, tmp_path):
    out = make_sample_shards(tmp_path, images="reference")
    write_manifest(out, dataclasses.replace(read_manifest(out), dataroot="/nowhere"))

    with pytest.raises(ShardError, match=r"out: its images lie in /nowhere, which is absent; bring it back"):
        index_frames(out, SCENES, [], needs=IMAGE)


def test_masks_of_an_earlier_homography_are_refused(copied_shards):
    with h5py.File(copied_shards / "scene-0001.h5", "r+") as h5:
        h5["CAM_BACK/homography/dlt"].attrs["settings"] = '{"min_points": 8}'
    (copied_shards / AMENDING).write_text('{"command": "homography-fit"}')  # the file's size is another

    with pytest.raises(ShardError, match=r"CAM_BACK/footprints/dlt is warped by an earlier .*--overwrite"):
        index_frames(copied_shards, SCENES, [], needs=SampleSpec((45, 80), masks="dlt"))


def test_unknown_names_and_limits(sample_shards):
    with pytest.raises(SettingsError, match="unknown scene 'scene-0011'; did you mean scene-0001"):
        index_frames(sample_shards, ["scene-0011"], [], needs=IMAGE)
    with pytest.raises(SettingsError, match="unknown camera 'CAM_FRNT'; did you mean CAM_FRONT"):
        index_frames(sample_shards, SCENES, ["CAM_FRNT"], needs=IMAGE)
    with pytest.raises(SettingsError, match="limit: 0 frames are not a positive number"):
        index_frames(sample_shards, SCENES, [], needs=IMAGE, limit=0)


def test_nothing_left_says_why(copied_shards, change):
    for scene in SCENES:
        change("homography/dlt/valid", False, scene)
        change("footprints/dlt/valid", False, scene)
    change("trajectory/valid", np.arange(8) < 3)
    needs = SampleSpec((45, 80), masks="calibration", homography="dlt")

    with pytest.raises(
        TrainingError,
        match=r"out: none of 16 frames can be used \(0 have a valid homography 'dlt', "
        r"16 have valid footprints 'calibration'\)",
    ):
        index_frames(copied_shards, SCENES, ["CAM_FRONT"], needs=needs)
    with pytest.raises(
        TrainingError,
        match=r"out: none of 16 frames can be used \(6 have 5 images before it without a gap, "
        r"3 have a valid trajectory\)",
    ):
        index_sequences(copied_shards, SCENES, ["CAM_FRONT"], needs=TRAJECTORY)
    with pytest.raises(TrainingError, match="there are 0 frames in the chosen scenes; choose others"):
        index_frames(copied_shards, [], [], needs=IMAGE)
