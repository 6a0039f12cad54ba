"""Where recordings go, and what stands in their way."""

import resource
import sys

import pytest

from ogmkit.errors import DataFileError, MissingPackageError, OutputError, ShardError
from ogmkit.shards.reader import Shard
from ogmkit.view.entities import lost_entities
from ogmkit.view.frames import moments
from ogmkit.view.places import Camera
from ogmkit.view.view import Shown, view

ONE = Shown(scenes=["scene-0001"], cameras=["CAM_FRONT"])


def test_key_frames_are_counted_and_told(rerun, sample_shards, tmp_path):
    told = []
    count = view(
        sample_shards, tmp_path / "x.rrd", ONE, on_progress=lambda done, total: told.append((done, total))
    )
    assert told == [(done, 8) for done in range(1, 9)]
    assert count == 8


def test_a_file_that_is_there_is_kept_unless_it_may_be_replaced(rerun, sample_shards, tmp_path):
    path = tmp_path / "x.rrd"
    path.write_text("mine")
    with pytest.raises(OutputError, match=r"x\.rrd: is there already; choose another name, or --overwrite"):
        view(sample_shards, path, ONE)
    assert path.read_text() == "mine"

    view(sample_shards, path, ONE, overwrite=True)
    assert path.read_bytes().startswith(b"RRF2")


def test_nothing_else_comes_among_the_shards(rerun, sample_shards):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        view(sample_shards, sample_shards / "x.rrd", ONE)


def test_a_full_disk_leaves_nothing(rerun, sample_shards, tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, limits[1]))
    try:
        with pytest.raises(OutputError, match=r"x\.rrd: can't be written: File too large"):
            view(sample_shards, tmp_path / "x.rrd", ONE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []

    view(sample_shards, tmp_path / "x.rrd", ONE)
    assert (tmp_path / "x.rrd").stat().st_size > 300_000  # so that the limit was met


def test_damage_that_shows_late_leaves_nothing(rerun, sample_shards, tmp_path, monkeypatch):
    whole = Shard.image

    def image(self, camera, frame):
        return whole(self, camera, frame)[: 100 if frame == 3 else None]

    monkeypatch.setattr(Shard, "image", image)
    with pytest.raises(DataFileError, match=r"scene-0001\.h5: CAM_FRONT/image\[3\]: is not a whole JPEG"):
        view(sample_shards, tmp_path / "x.rrd", ONE)
    assert list(tmp_path.iterdir()) == []


def test_a_shard_that_is_absent_is_told_before_anything_is_written(rerun, copied_shards, tmp_path):
    (copied_shards / "scene-0002.h5").unlink()
    before = set(tmp_path.iterdir())
    with pytest.raises(ShardError, match=r"scene-0002\.h5: is absent"):
        view(copied_shards, tmp_path / "x.rrd")
    assert set(tmp_path.iterdir()) == before


def test_a_folder_without_shards_is_told(rerun, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ShardError, match=r"manifest\.json: can't be read"):
        view(tmp_path / "empty", tmp_path / "x.rrd")


def test_without_rerun_the_extra_is_named(sample_shards, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'ogmkit\[view\]'"):
        view(sample_shards, tmp_path / "x.rrd")


def test_without_a_screen_a_file_is_proposed(rerun, sample_shards, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(
        OutputError, match="there is no screen to show the viewer on; write a file with --save"
    ):
        view(sample_shards)


def test_a_viewer_that_does_not_start_is_told(rerun, sample_shards, monkeypatch):
    def refuse(self, **options):
        raise RuntimeError("no graphics adapter")

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(rerun.RecordingStream, "spawn", refuse)
    with pytest.raises(OutputError, match=r"the viewer doesn't start \(no graphics adapter\); write a file"):
        view(sample_shards)


def test_a_viewer_gets_what_a_file_would_hold(rerun, sample_shards, monkeypatch, tmp_path, read_back):
    path = tmp_path / "x.rrd"

    def spawn(self, default_blueprint):
        self.save(path, default_blueprint=default_blueprint)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(rerun.RecordingStream, "spawn", spawn)
    view(sample_shards, None, ONE)
    assert len(read_back(path)["/scene-0001/CAM_FRONT/camera/image"]["EncodedImage:blob"]) == 8


def test_rerun_that_is_switched_off_is_told(rerun, sample_shards, monkeypatch, tmp_path):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(OutputError, match="Rerun is switched off by the variable RERUN"):
        view(sample_shards, tmp_path / "x.rrd", ONE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("there", [True, False])
def test_images_elsewhere_are_found_or_left_out(
    record, sample_shards, tiny_dataroot, tmp_path, monkeypatch, there
):
    monkeypatch.setattr(Shard, "image", lambda *_: None)  # as where the shards only refer to them
    shown = {"scenes": ["scene-0001"], "cameras": ["CAM_FRONT"], "dataroot": tiny_dataroot if there else None}
    found = record(sample_shards, tmp_path / "x.rrd", **shown)
    blobs = found.get("/scene-0001/CAM_FRONT/camera/image", {"EncodedImage:blob": []})["EncodedImage:blob"]
    assert len(blobs) == (8 if there else 0)


def test_a_frame_that_a_camera_lost_is_not_that_before(rerun, sample_shards, tmp_path):
    with Shard(sample_shards / "scene-0001.h5") as shard:

        class Lost:
            """A shard whose back camera lost its third frame."""

            def dataset(self, camera, name):
                values = shard.dataset(camera, name)[:]
                return values if camera == "CAM_FRONT" else values[[0, 1, 3, 4, 5, 6, 7]]

            def strings(self, camera, name):
                values = shard.strings(camera, name)
                return values if camera == "CAM_FRONT" else (*values[:2], *values[3:])

        found = moments(Lost(), ("CAM_FRONT", "CAM_BACK"))
        grid = shard.grid
    assert [one.number for one in found] == list(range(8))
    assert found[2].frames == {"CAM_FRONT": 2}
    assert found[3].frames == {"CAM_FRONT": 3, "CAM_BACK": 2}
    cleared = dict(lost_entities(Camera("scene-0001", "CAM_BACK", grid, ())))
    assert set(cleared) == {"/scene-0001/CAM_BACK", "/scene-0001/plane/CAM_BACK"}
