"""What `ogmkit predict` writes, in recordings."""

import json
import shutil

import h5py
import numpy as np
import pytest

from ogmkit.errors import DataFileError, SettingsError
from ogmkit.learn.predict.form import FORMAT, FORMAT_VERSION
from ogmkit.view.view import Shown, view

SCENE, CAMERA = "scene-0001", "CAM_FRONT"
FRAMES = (0, 2)
"""Those that are predicted."""


@pytest.fixture
def shards(rerun, sample_shards):
    return sample_shards


@pytest.fixture
def folder(shards, sample_grid, tmp_path):
    """A folder of masks of two frames, random; with the file, open for changes by whoever asks."""
    path = tmp_path / "footprints"
    path.mkdir()
    random = np.random.default_rng(1)
    with h5py.File(shards / f"{SCENE}.h5") as shard, h5py.File(path / f"{SCENE}.h5", "w") as h5:
        h5.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION, "scene": SCENE})
        group = h5.create_group(CAMERA)
        group["frame"] = np.array(FRAMES)
        group["sample_token"] = shard[f"{CAMERA}/sample_token"][:][list(FRAMES)]
        group["bev"] = random.random((len(FRAMES), 2, *sample_grid.shape)).astype(np.float16)
        group["image"] = random.random((len(FRAMES), 2, 30, 40)).astype(np.float16)
    return path


@pytest.fixture
def plans(shards, tmp_path):
    """A file with a plan of frame 2."""
    with h5py.File(shards / f"{SCENE}.h5") as shard:
        token = shard[f"{CAMERA}/sample_token"][2].decode()
    points = [
        {"t_s": t / 2, "x": 4.0 * t, "y": -0.5 * t, "sigma_x": 1.0, "sigma_y": 0.5, "rho": 0.2}
        for t in range(1, 6)
    ]
    one = {"scene": SCENE, "camera": CAMERA, "frame": 2, "sample_token": token, "plan": points}
    path = tmp_path / "plans.json"
    path.write_text(json.dumps([one]))
    return path


def masks(recorded, place):
    buffers = recorded[place]["SegmentationImage:buffer"]
    return {frame: np.array(value[0], np.uint8) for frame, _, value in buffers if value}


def test_masks_and_plans_stand_beside_the_truth(record, shards, folder, plans, tmp_path):
    found = record(shards, tmp_path / "x.rrd", scenes=[SCENE], cameras=[CAMERA], predictions=[folder, plans])

    with h5py.File(folder / f"{SCENE}.h5") as h5:
        for number, target in enumerate(("drivable", "vehicles")):
            for kind, place in (("bev", f"plane/{CAMERA}"), ("image", f"{CAMERA}/camera")):
                shown = masks(found, f"/{SCENE}/{place}/predictions/footprints/{target}")
                assert sorted(shown) == list(FRAMES)
                for row, frame in enumerate(FRAMES):
                    expected = (h5[f"{CAMERA}/{kind}"][row, number] > 0.5) * (number + 1)
                    np.testing.assert_array_equal(shown[frame], expected.ravel())
    ((scale,),) = (
        value
        for frame, _, value in found[f"/{SCENE}/{CAMERA}/camera/predictions/footprints"]["Transform3D:scale"]
        if frame == 0
    )
    assert scale == [4.0, 3.0, 1.0]

    plan = found[f"/{SCENE}/{CAMERA}/predictions/plans/plan"]["LineStrips3D:strips"]
    ((frame, _, (level,)),) = plan
    assert frame == 2
    np.testing.assert_allclose(level, [[4.0 * t, -0.5 * t, 0] for t in range(6)])
    ((_, _, cells),) = found[f"/{SCENE}/plane/{CAMERA}/predictions/plans/plan"]["LineStrips2D:strips"]
    assert len(cells) == 6  # the means, and five ellipses
    np.testing.assert_allclose(cells[0], [[15 + t, 60 - 8 * t] for t in range(6)])


def test_what_is_not_predicted_is_removed(record, shards, folder, tmp_path):
    found = record(shards, tmp_path / "x.rrd", scenes=[SCENE], cameras=[CAMERA], predictions=[folder])

    cleared = found[f"/{SCENE}/plane/{CAMERA}/predictions/footprints"]["Clear:is_recursive"]
    assert [frame for frame, _, _ in cleared] == [1, 3, 4, 5, 6, 7]


def change(folder, edit):
    with h5py.File(folder / f"{SCENE}.h5", "r+") as h5:
        edit(h5)


def replaced(name, value):
    def edit(h5):
        del h5[f"{CAMERA}/{name}"]
        h5[f"{CAMERA}/{name}"] = value

    return edit


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (replaced("sample_token", ["a", "b"]), "is of another key frame than in the shard"),
        (replaced("bev", np.zeros((2, 2, 9, 9), np.float16)), "has masks of 9 × 9 cells, the shards 60 × 40"),
        (replaced("bev", np.zeros((1, 2, 60, 40), np.float16)), "is damaged"),
        (replaced("bev", np.zeros((2, 3, 60, 40), np.float16)), "is damaged"),
        (replaced("image", np.zeros((2, 2), np.float16)), "is damaged"),
        (replaced("frame", np.zeros((2, 2))), "is damaged"),
        (lambda h5: h5.attrs.pop("format"), "is no ogmkit-predictions of version 1"),
    ],
)
def test_wrong_masks_are_told_and_nothing_is_written(shards, folder, tmp_path, edit, said):
    change(folder, edit)
    path = tmp_path / "x.rrd"
    with pytest.raises(DataFileError, match=said) as caught:
        view(shards, path, Shown(scenes=[SCENE], predictions=[folder]))
    assert str(folder / f"{SCENE}.h5") in str(caught.value)
    assert [one for one in tmp_path.iterdir() if one.is_file()] == []


def test_numbers_that_are_no_gaussian_are_told(shards, plans, tmp_path):
    for name, value in (("x", float("nan")), ("sigma_y", -1.0), ("rho", 2.0)):
        (one,) = json.loads(plans.read_text())
        one["plan"][3][name] = value
        wrong = tmp_path / "wrong.json"
        wrong.write_text(json.dumps([one]))
        with pytest.raises(DataFileError, match="numbers that are no Gaussian"):
            view(shards, tmp_path / "x.rrd", Shown(predictions=[wrong]))


@pytest.mark.parametrize("text", ["", "[1]", "{}", '[{"scene": "scene-0001"}]', "[[]]", "null"])
def test_wrong_plans_are_told(shards, tmp_path, text):
    plans = tmp_path / "plans.json"
    plans.write_text(text)
    with pytest.raises(
        (DataFileError, SettingsError), match=r"plans\.json: (holds no plans|has predictions of none)"
    ):
        view(shards, tmp_path / "x.rrd", Shown(predictions=[plans]))


def test_predictions_of_other_scenes_are_told(shards, folder, plans, tmp_path):
    for path in (folder, plans):
        with pytest.raises(SettingsError, match="has predictions of none of the scenes"):
            view(shards, tmp_path / "x.rrd", Shown(scenes=["scene-0002"], predictions=[path]))


def test_two_of_the_same_name_are_told(shards, folder, tmp_path):
    other = tmp_path / "other" / folder.name
    shutil.copytree(folder, other)
    with pytest.raises(SettingsError, match="has the same name as"):
        view(shards, tmp_path / "x.rrd", Shown(predictions=[folder, other]))
