import dataclasses

import pytest

from ogmkit.errors import SettingsError
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.sources import RecordDataset


@pytest.fixture(scope="module")
def own(tiny_dataroot):
    """The tiny dataset's scenes as records, the later one first."""
    from ogmkit.nuscenes.dataset import Dataset

    with Dataset(tiny_dataroot) as dataset:
        scenes = [dataset.scene(name, dataset.channels()) for name in dataset.scene_names()]
    return RecordDataset(tiny_dataroot, "v1.0-mini", tuple(reversed(scenes)))


def test_records_answer_as_the_dataset_that_they_came_from(own, dataset):
    assert own.scene_names() == dataset.scene_names()
    assert own.channels() == dataset.channels()
    assert {"vehicle.car"} <= set(own.categories()) <= set(dataset.categories())
    name = own.scene_names()[0]
    ours, theirs = (source.scene(name, ["CAM_BACK"]) for source in (own, dataset))
    assert (ours.name, ours.location, list(ours.cameras)) == (theirs.name, theirs.location, ["CAM_BACK"])
    assert ours.log == theirs.log != ""
    assert [frame.sample_data_token for frame in ours.cameras["CAM_BACK"]] == [
        frame.sample_data_token for frame in theirs.cameras["CAM_BACK"]
    ]


def test_their_shards_are_the_dataset_s(
    own, dataset, undisturbed, small_settings, mask_cache, tmp_path, digests
):
    out = tmp_path / "out"

    extract(
        own,
        out,
        small_settings,
        scenes=own.scene_names(),
        splits=dataset.splits(),
        strict=True,
        cache_dir=mask_cache,
    )

    assert digests(out) == digests(undisturbed)


def test_what_is_not_there(own):
    with pytest.raises(SettingsError, match="unknown scene 'scene-0009'"):
        own.scene("scene-0009", ["CAM_FRONT"])
    with pytest.raises(SettingsError, match="scene scene-0001: unknown camera 'CAM_LEFT'"):
        own.scene("scene-0001", ["CAM_FRONT", "CAM_LEFT"])


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        ((), "scenes none: give at least one, each once"),
        (("one", "one"), "scenes one, one: give at least one, each once"),
        (("up/../there",), "scene name 'up/../there' can't be a file's"),
    ],
)
def test_scenes_that_can_not_be_told_apart_or_stored(own, names, problem):
    scenes = tuple(dataclasses.replace(own.scenes[0], name=name) for name in names)

    with pytest.raises(SettingsError, match=problem):
        RecordDataset(own.root, "mine", scenes)
