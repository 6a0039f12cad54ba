"""Contact sheets as files: which are written, and what is refused."""

from typing import get_args

import cv2
import h5py
import numpy as np
import pytest

from ogmkit.drawing.bev_panel import plan_for
from ogmkit.drawing.canvas import fit
from ogmkit.drawing.legend import draw_legend
from ogmkit.drawing.palette import THEMES, theme
from ogmkit.drawing.sheet import CAPTION, GAP
from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.grid import GridSpec
from ogmkit.pictures.preview import draw_shard, preview
from ogmkit.pictures.settings import PreviewSettings, View
from ogmkit.pictures.subjects import PLANE_SIZE, SUBJECTS, photo_size
from ogmkit.shards.reader import Shard

GRID, IMAGE_SIZE = GridSpec(m_per_cell=0.5, rows=80, columns=40, ego_row=80, ego_column=24), (90, 160)


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
    (path,) = preview(out, tmp_path / "pictures", scenes=("scene-0002",), settings=PreviewSettings(frames=2))

    with Shard(out / "scene-0002.h5") as shard:
        sheet = draw_shard(shard, "CAM_FRONT", settings=PreviewSettings(frames=2))
    np.testing.assert_array_equal(cv2.imread(str(path))[..., ::-1], sheet)
    assert preview(out, tmp_path / "pictures", scenes=("scene-0002",)) == (path,)


@pytest.mark.parametrize("images", ["bytes", "reference", "none"])
@pytest.mark.parametrize("frames", [1, 2, 3])
def test_sheets_grow_with_their_frames(make_shards, images, frames):
    with Shard(make_shards(images) / "scene-0001.h5") as shard:
        height, width, _ = draw_shard(shard, "CAM_FRONT", settings=PreviewSettings(frames=frames)).shape

    plan = plan_for(GRID, [np.array([[-6.0, 0.0]])], PLANE_SIZE)
    photo_height, photo_width = fit(IMAGE_SIZE, photo_size(plan))
    left = 2 * (CAPTION + photo_height) + GAP
    tile_height = CAPTION + max(left, CAPTION + plan.size[0])
    tile_width = photo_width + GAP + plan.size[1]
    columns, rows = {1: (1, 1), 2: (1, 2), 3: (2, 2)}[frames]
    legend = draw_legend(SUBJECTS["targets"].groups, columns * tile_width + (columns - 1) * 44)
    assert width == 2 * 40 + legend.shape[1]
    assert height == 40 + 104 + rows * (tile_height + 44) + legend.shape[0] + 20


@pytest.mark.parametrize("subject", [name for name, kind in SUBJECTS.items() if not kind.further])
def test_themes_draw_the_same_in_other_colours(make_shards, add_masks, subject):
    path = make_shards() / "scene-0001.h5"
    for name in ("full-body", "surface"):
        add_masks(path, name)
    with Shard(path) as shard:
        sheets = [
            draw_shard(shard, "CAM_FRONT", subject, PreviewSettings(frames=1, theme=name)) for name in THEMES
        ]

    dark, light = sheets
    assert dark.shape == light.shape
    assert tuple(dark[0, 0].tolist()) == THEMES["dark"].page
    assert tuple(light[0, 0].tolist()) == THEMES["light"].page
    for sheet, colours in zip(sheets, THEMES.values(), strict=True):
        assert (sheet == colours.drivable).all(axis=-1).sum() > 1000


def test_workers_draw_the_same(make_shards, tmp_path):
    out, settings = make_shards(), PreviewSettings(frames=1, theme="light")
    alone, told = preview(out, tmp_path / "alone", settings), []
    shared = preview(
        out, tmp_path / "shared", settings, workers=2, on_progress=lambda *counts: told.append(counts)
    )

    assert [path.name for path in shared] == [path.name for path in alone]
    assert told == [(1, 2), (2, 2)]
    for one, other in zip(alone, shared, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_the_legend_takes_the_lines_that_it_needs():
    groups = SUBJECTS["targets"].groups

    assert draw_legend(groups, 4000).shape == (38, 4000, 3)
    assert draw_legend(groups, 1300).shape == (2 * 38, 1300, 3)
    assert draw_legend(groups, 900).shape == (4 * 38, 900, 3)
    narrow = draw_legend(groups, 1)
    assert narrow.shape[0] == 38 * sum(len(list(entries())) for _, entries in groups)
    assert narrow.shape[1] < 400


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenes": ("scene-0009",)}, "unknown scene 'scene-0009'; did you mean scene-0002 or scene-0001"),
        ({"cameras": ("CAM_BACK",)}, "unknown camera 'CAM_BACK'; there are: CAM_FRONT"),
        ({"settings": PreviewSettings(("stretch",), "full-body")}, "set 'full-body' would be drawn twice"),
    ],
)
def test_unknown_names_and_numbers_out_of_range(make_shards, tmp_path, arguments, message):
    with pytest.raises(SettingsError, match=message):
        preview(make_shards(), tmp_path / "pictures", **arguments)
    assert not (tmp_path / "pictures").exists()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"frames": 0}, "frames: 0 is below 1"),
        ({"frames": 61}, "frames: 61 is above 60"),
        ({"views": ("target",)}, "unknown views 'target'; did you mean targets"),
    ],
)
def test_settings_out_of_range(values, message):
    with pytest.raises(SettingsError, match=message):
        PreviewSettings(**values)


def test_layers_are_drawn_with_what_lies_beside_them(further_shards, tmp_path):
    settings = PreviewSettings(("layers", "targets"), frames=1)
    chosen = {"scenes": ("scene-0001",), "cameras": ("CAM_FRONT",)}
    names = [path.name for path in preview(further_shards, tmp_path / "pictures", settings, **chosen)]
    assert names == ["scene-0001_CAM_FRONT_layers.png", "scene-0001_CAM_FRONT.png"]
    sheet = cv2.imread(str(tmp_path / "pictures" / names[0]))[..., ::-1]
    for colour in (theme().drivable, theme().future, theme().vehicle, theme().first):
        assert (sheet == colour).all(axis=-1).sum() > 500


def test_layers_are_drawn_of_shards_that_have_them(sample_shards, tmp_path):
    with pytest.raises(ShardError, match=r"scene-0001\.h5: has nothing beside the paper's targets to draw"):
        preview(sample_shards, tmp_path / "pictures", PreviewSettings(("layers",)))


def test_every_view_has_a_subject():
    assert set(get_args(View)) == {*SUBJECTS, "surround"}


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


def test_each_view_and_set_has_a_file_of_its_own(make_shards, add_masks, tmp_path):
    out = make_shards()
    for name in ("surface", "full-body", "dlt"):
        add_masks(out / "scene-0001.h5", name)
    subjects = ("masks", "targets", "stretch", "masks")
    written = preview(out, tmp_path, settings=PreviewSettings(subjects), scenes=("scene-0001",))
    other = preview(out, tmp_path, settings=PreviewSettings(("footprints",), "dlt"), scenes=("scene-0001",))

    endings = ("_masks_surface", "", "_stretch_surface", "_footprints_dlt")
    assert written + other == tuple(tmp_path / f"scene-0001_CAM_FRONT{ending}.png" for ending in endings)
    assert len({path.read_bytes() for path in written + other}) == 4


@pytest.mark.parametrize(
    ("subject", "mask_set", "command"),
    [
        ("footprints", "surface", "render-footprints {out} --method warp --homography surface"),
        ("masks", "dlt-project", "render-footprints {out} --method project --homography dlt"),
        ("stretch", "surface", "render-footprints {out} --method full-body"),
        ("masks", "mine", "render-footprints {out} --masks mine"),
    ],
)
def test_an_absent_set_is_an_error_that_names_the_command(make_shards, tmp_path, subject, mask_set, command):
    out = make_shards()
    with pytest.raises(ShardError) as failure:
        preview(out, tmp_path / "pictures", settings=PreviewSettings((subject,), mask_set))

    text = str(failure.value)
    assert "scene-0001.h5: CAM_FRONT has no footprints" in text
    assert text.endswith(f"(it has none); run `ogmkit {command.format(out=out)}`")


def test_an_absent_homography_is_an_error_that_names_the_command(make_shards, add_masks, tmp_path):
    out = make_shards()
    add_masks(out / "scene-0001.h5", "surface")
    add_masks(out / "scene-0001.h5", "mine", homography="plane")
    with h5py.File(out / "scene-0001.h5", "r+") as h5:
        del h5["CAM_FRONT/homography/plane"]

    with pytest.raises(ShardError) as failure:
        preview(out, tmp_path, settings=PreviewSettings(("masks",), "mine"))
    message = f"no homography 'plane' (it has surface); run `ogmkit homography-fit {out} --method plane`"
    assert message in str(failure.value)
