"""Which sequences are evaluated, and what is refused."""

import re

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError, TrainingError
from ogmkit.evaluation.planning.sequences import sequences_of

VAL = [("scene-0002", "CAM_FRONT", frame) for frame in (6, 7, 8)] + [
    ("scene-0003", "CAM_FRONT", frame) for frame in (6, 7, 8)
]


def find(shards, **changes):
    settings = {"split": "val", "split_file": None, "cameras": (), "limit": None}
    return sequences_of(shards, **(settings | changes))


@pytest.fixture
def spoil():
    """`spoil(path, name, row, value)` changes one row of a dataset of the camera."""

    def change(path, name, row, value):
        with h5py.File(path, "r+") as h5:
            h5[f"CAM_FRONT/{name}"][row] = value

    return change


def test_all_with_a_valid_trajectory_in_order(shards, driven):
    found = find(shards)

    assert [found.index.place(i) for i in range(len(found))] == VAL
    for number, place in enumerate(VAL):
        np.testing.assert_array_equal(found.truth[number], driven(shards, place)[:5])
        np.testing.assert_array_equal(found.destination[number], driven(shards, place)[5])
    np.testing.assert_array_equal(found.scene, [0, 0, 0, 1, 1, 1])
    assert found.scenes == 2
    assert (found.past[..., 0] < 0).all()


def test_scenes_without_sequences_are_not_counted(shards, spoil):
    spoil(shards / "scene-0002.h5", "trajectory/valid", slice(None), False)
    found = find(shards)

    assert (found.scenes, len(found)) == (1, 3)
    np.testing.assert_array_equal(found.scene, [0, 0, 0])


def test_no_valid_trajectory_is_told(shards, spoil):
    for scene in ("scene-0002", "scene-0003"):
        spoil(shards / f"{scene}.h5", "trajectory/valid", slice(None), False)

    with pytest.raises(TrainingError, match=r"none of 30 frames can be used .* 0 have a valid trajectory"):
        find(shards)


@pytest.mark.parametrize(
    ("what", "name", "frame"),
    [
        ("trajectory", "trajectory/past", 7),
        ("trajectory", "trajectory/future", 8),
        ("pose", "level_from_global", 6),
        ("pose", "global_from_ego", 2),  # of the first of the six images that end at frame 7
    ],
)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_named(shards, spoil, what, name, frame, value):
    spoil(shards / "scene-0003.h5", name, frame, value)

    message = f"scene-0003.h5: CAM_FRONT frame {frame}: its {what} ({name}) holds a number that is not finite"
    with pytest.raises(ShardError, match=re.escape(message)):
        find(shards)


def test_poses_that_no_sequence_sees_do_not_matter(shards, spoil):
    spoil(shards / "scene-0003.h5", "global_from_ego", 0, np.nan)

    assert len(find(shards)) == 6


def test_a_trajectory_beyond_the_shard_is_named(shards, spoil):
    for name, value in (("valid", True), ("past", 0.0), ("future", 0.0)):
        spoil(shards / "scene-0002.h5", f"trajectory/{name}", 10, value)

    with pytest.raises(
        ShardError, match=re.escape("frame 10 has a valid trajectory, but too few frames follow")
    ):
        find(shards)
