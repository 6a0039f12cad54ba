"""Contact sheets as files: which are written, and what is refused."""

import cv2
import h5py
import numpy as np
import pytest

from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.pictures.preview import draw_shard, preview
from ogmkit.shards.reader import Shard


def test_one_sheet_for_each_scene_beside_the_shards(make_shards):
    out = make_shards()
    before = sorted(out.iterdir())
    progress = []
    written = preview(out, on_progress=lambda *counts: progress.append(counts))

    folder = out.parent / "shards-preview"
    assert written == (folder / "scene-0001_CAM_FRONT.png", folder / "scene-0002_CAM_FRONT.png")
    assert sorted(folder.iterdir()) == sorted(written)
    assert sorted(out.iterdir()) == before
    assert progress == [(1, 2), (2, 2)]


def test_the_file_holds_the_sheet(make_shards, tmp_path):
    out = make_shards()
    (path,) = preview(out, tmp_path / "pictures", scenes=("scene-0002",), frames=2)

    with Shard(out / "scene-0002.h5") as shard:
        sheet = draw_shard(shard, "CAM_FRONT", 2)
    np.testing.assert_array_equal(cv2.imread(str(path))[..., ::-1], sheet)
    assert preview(out, tmp_path / "pictures", scenes=("scene-0002",)) == (path,)


@pytest.mark.parametrize("images", ["bytes", "reference", "none"])
@pytest.mark.parametrize("frames", [1, 2, 3])
def test_sheets_grow_with_their_frames(make_shards, images, frames):
    with Shard(make_shards(images) / "scene-0001.h5") as shard:
        height, width, _ = draw_shard(shard, "CAM_FRONT", frames).shape

    tile_height, tile_width = 44 + 540, 960 + 12 + 216
    columns, rows = {1: (1, 1), 2: (1, 2), 3: (2, 2)}[frames]
    legend_height = {1: 3, 2: 1}[columns] * 38
    assert width == 2 * 40 + columns * tile_width + (columns - 1) * 36
    assert height == 40 + 104 + rows * (tile_height + 36) + legend_height + 20


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenes": ("scene-0009",)}, "no scene 'scene-0009'; it has scene-0001, scene-0002"),
        ({"cameras": ("CAM_BACK",)}, "no camera 'CAM_BACK'; it has CAM_FRONT"),
        ({"frames": 0}, "frames: 0 is not between 1 and 60"),
        ({"frames": 61}, "frames: 61 is not between 1 and 60"),
    ],
)
def test_unknown_names_and_numbers_out_of_range(make_shards, tmp_path, arguments, message):
    with pytest.raises(SettingsError, match=message):
        preview(make_shards(), tmp_path / "pictures", **arguments)
    assert not (tmp_path / "pictures").exists()


def test_pictures_never_go_among_the_shards(make_shards):
    out = make_shards()
    for folder in (out, out / "pictures", out / "a" / ".." / "pictures"):
        with pytest.raises(OutputError, match="holds nothing but shards"):
            preview(out, folder)


def test_a_folder_that_cannot_be_made_is_named(make_shards, tmp_path):
    (tmp_path / "file").write_text("")

    with pytest.raises(OutputError, match="file"):
        preview(make_shards(), tmp_path / "file")


def test_a_folder_without_a_manifest_is_refused(tmp_path):
    with pytest.raises(ShardError, match=r"manifest\.json"):
        preview(tmp_path)


def test_a_shard_that_is_cut_short_is_named(make_shards, tmp_path):
    out = make_shards()
    path = out / "scene-0001.h5"
    path.write_bytes(path.read_bytes()[:5000])

    with pytest.raises(ShardError, match=r"scene-0001\.h5"):
        preview(out, tmp_path / "pictures")


def test_a_shard_without_a_dataset_or_a_frame_is_named(make_shards, tmp_path):
    out = make_shards()
    with h5py.File(out / "scene-0001.h5", "r+") as h5:
        del h5["CAM_FRONT/vehicles"]
    with pytest.raises(ShardError, match=r"scene-0001\.h5: has no dataset CAM_FRONT/vehicles"):
        preview(out, tmp_path / "pictures")

    with h5py.File(out / "scene-0001.h5", "r+") as h5:
        del h5["CAM_FRONT/sample_token"]
        h5["CAM_FRONT"].create_dataset("sample_token", (0,), h5py.string_dtype())
    with pytest.raises(ShardError, match=r"scene-0001\.h5: camera CAM_FRONT has no frame"):
        preview(out, tmp_path / "pictures")
