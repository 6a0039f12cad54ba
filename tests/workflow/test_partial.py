"""A chain on a partial download, or without maps."""

import shutil

import pytest

from ogmkit.errors import DataFileError, SettingsError
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.workflow.extraction import Extract
from ogmkit.workflow.needs import require_needs
from ogmkit.workflow.reading import config_of
from ogmkit.workflow.steps import Call

NOTHING_TRAINED = ("homography", "footprints", "planners")


@pytest.fixture
def data(world, tmp_path):
    """The dataset without the last five images of its first scene."""
    root = shutil.copytree(world, tmp_path / "world")
    for path in sorted((root / "samples/CAM_FRONT").iterdir())[11:16]:
        path.unlink()
    return root


@pytest.fixture
def chain(data, tmp_path, chain_config):
    """A chain that trains nothing: `chain(**extract)`."""

    def make(without=NOTHING_TRAINED, **extract):
        return chain_config(tmp_path / "out", without, data=str(data), extract=extract)

    return make


def _extract(config):
    step = Extract.of(config)
    return step.run(Call(overwrite=False, let_go=lambda: None, advance=lambda done, total: None))


def test_the_file_s_keys_are_kept(chain):
    for name in ("skip_bad_frames", "only_complete", "no_map"):
        values = chain(**{name: True}).to_dict()["extract"]
        assert values[name] is True
        found = config_of({"data": "d", "out": "o", "extract": {name: True}}, chain().out)
        assert name in found.to_dict()["extract"]
    assert chain().extract.to_dict().get("no_map") is None


def test_a_chain_stops_where_nothing_says_to_go_on(chain):
    with pytest.raises(
        DataFileError,
        match=r"^1 of 2 scenes failed, first scene-0001: .*\.jpg: image is absent, one of 5 of CAM_FRONT; "
        r"download them, or leave out .* \(keys of `extract` here, such as `skip_bad_frames: true`\)$",
    ):
        _extract(chain())


def test_a_chain_goes_on_with_the_sound_scenes(chain):
    config = chain(only_complete=True)
    assert _extract(config).note == "1 scene, 16 frames; left out: 1 scene"
    assert [entry.scene for entry in read_manifest(config.shards).shards] == ["scene-0002"]


def test_a_chain_goes_on_with_the_sound_frames(chain):
    config = chain(skip_bad_frames=True)
    assert _extract(config).note == "2 scenes, 27 frames; left out: 5 frames"
    with Shard(config.shards / "scene-0001.h5") as shard:
        assert shard.left_out("CAM_FRONT") == 5


def test_where_nothing_is_left_the_chain_stops(chain, data):
    for path in (data / "samples/CAM_FRONT").iterdir():
        path.unlink()
    for setting in ("only_complete", "skip_bad_frames"):
        with pytest.raises(
            DataFileError, match=r"^2 of 2 scenes were left out, first scene-0001: .*is absent"
        ):
            _extract(chain(**{setting: True}))


@pytest.mark.parametrize("setting", ["only_complete", "skip_bad_frames"])
def test_files_that_arrive_or_are_replaced_make_it_another_dataset(chain, data, world, setting):
    def settings(**extract):
        return Extract.of(chain(**extract)).settings

    before, plain = settings(**{setting: True}), settings()
    assert settings(**{setting: True}) == before
    lost = [
        path
        for path in (world / "samples/CAM_FRONT").iterdir()
        if not (data / path.relative_to(world)).exists()
    ]
    shutil.copy(lost[0], data / "samples/CAM_FRONT")
    arrived = settings(**{setting: True})
    assert arrived != before
    (data / "samples/CAM_FRONT" / lost[0].name).write_bytes(b"cut short")
    assert settings(**{setting: True}) not in (before, arrived)
    assert settings() == plain
    assert setting not in plain


def test_splits_are_those_of_the_scenes_that_will_be_there(chain):
    require_needs(chain((), skip_bad_frames=True))
    with pytest.raises(
        SettingsError, match=r"train homography: split 'train' has no scene among those to extract"
    ):
        require_needs(chain((), only_complete=True))


@pytest.mark.parametrize(
    ("without", "step"),
    [(("homography", "planners"), "train footprints"), (("homography", "footprints"), "train mid-to-end")],
)
def test_what_learns_the_drivable_area_needs_maps(chain, without, step):
    with pytest.raises(
        SettingsError, match=rf"^{step}: needs the drivable area, which `no_map: true` leaves out"
    ):
        require_needs(chain(without, no_map=True))


def test_without_maps_they_take_no_part(chain, data):
    shutil.rmtree(data / "maps")
    require_needs(chain(("footprints", "planners"), no_map=True))
    assert _extract(chain(no_map=True, skip_bad_frames=True)).note.startswith("2 scenes, 27 frames")
