"""What commands on whole folders tell before and while they work."""

import shutil

import pytest

from ogmkit.base.execution import Execution
from ogmkit.base.news import Found, Waiting, listening
from ogmkit.homography.settings import FitSettings
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.maps import MapsAhead

SCENES = ("scene-0001", "scene-0002")


@pytest.fixture
def told():
    news = []
    with listening(news.append):
        yield news


@pytest.fixture
def maps(dataset):
    """The map's file name of each scene."""
    scenes = [dataset.scene(name, ["CAM_FRONT"]) for name in SCENES]
    return [scene.cameras["CAM_FRONT"][0].map_path.rpartition("/")[2] for scene in scenes]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("workers", "place"), [(1, "in this process"), (2, "in 2 worker processes")], ids=["alone", "pool"]
)
def test_an_extraction_tells_what_it_found_and_each_map_that_it_decodes(
    tmp_path, dataset, small_settings, told, maps, workers, place
):
    options = {"scenes": SCENES, "splits": dataset.splits(), "cache_dir": tmp_path / "cache"}
    execution = Execution(workers)
    extract(dataset, tmp_path / "out", small_settings, execution=execution, **options)
    found = Found(f"2 scenes with CAM_FRONT, CAM_BACK; {place}")
    assert told == [found, *(Waiting(f"decoding map {name}") for name in dict.fromkeys(maps))]
    told.clear()
    shutil.rmtree(tmp_path / "cache")
    extract(dataset, tmp_path / "out", small_settings, execution=execution, **options)
    assert told == [found]  # all shards are there: no map is needed


def test_maps_are_decoded_ahead_once_and_damage_is_left_to_the_worker(
    tmp_path, tiny_dataroot, dataset, told, maps
):
    root = shutil.copytree(tiny_dataroot, tmp_path / "world")
    (root / "maps" / maps[0]).write_bytes(b"no picture")
    ahead = MapsAhead(tmp_path / "cache")
    with type(dataset)(root) as damaged:
        scene = damaged.scene(SCENES[0], ["CAM_FRONT"])
    ahead.decode(scene)
    ahead.decode(scene)
    assert told == [Waiting(f"decoding map {maps[0]}")]


def test_a_fit_tells_what_it_found_and_what_is_done(tmp_path, undisturbed, told):
    out = shutil.copytree(undisturbed, tmp_path / "out")
    fit_shards(out, ("calibration",), FitSettings(), cameras=("CAM_FRONT",))
    compared = Waiting("comparing checksums of 2 shards")
    assert told == [compared, Found("2 scenes, 16 frames of CAM_FRONT; in this process")]
    told.clear()
    fit_shards(out, ("calibration",), FitSettings())
    fit_shards(out, ("calibration",), FitSettings())
    assert told == [
        compared,
        Found("2 scenes, 32 frames of CAM_BACK, CAM_FRONT; in this process"),
        compared,
        Found("2 scenes, 32 frames of CAM_BACK, CAM_FRONT; 2 scenes already complete; in this process"),
    ]
