import re

import h5py
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main
from ogmkit_cli.text import text_table


def _run(*arguments):
    return CliRunner().invoke(main, ["inspect", *map(str, arguments)])


@pytest.fixture(scope="module")
def shards(tiny_dataroot, tmp_path_factory):
    """The synthetic dataset's shards, extracted coarsely."""
    from ogmkit.grid import GridSpec
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.extract import extract
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.targets import TargetSettings

    folder = tmp_path_factory.mktemp("inspect")
    grid = GridSpec(m_per_cell=1.0, rows=100, columns=55, ego_row=100, ego_column=30)
    settings = ExtractSettings(targets=TargetSettings(grid=grid))
    with Dataset(tiny_dataroot) as dataset:
        extract(
            dataset,
            folder / "out",
            settings,
            scenes=dataset.scene_names(),
            splits=dataset.splits(),
            cache_dir=folder / "cache",
        )
    return folder / "out"


def test_dataset(tiny_dataroot):
    result = _run(tiny_dataroot)

    assert result.exit_code == 0, result.output
    first, cameras, splits, blank, header, *rows = result.stdout.splitlines()
    assert first.startswith(f"{tiny_dataroot}: v1.0-mini, 2 scenes, 16 key frames, ")
    assert cameras == "cameras: CAM_BACK, CAM_FRONT"
    assert splits == "splits: train (1), val (1)"
    assert blank == ""
    assert header.split() == ["scene", "location", "key", "frames", "cameras", "boxes", "images", "present"]
    assert len(rows) == 2
    assert all(re.fullmatch(r"scene-\d+ +[\w-]+ +8 +2 +[\d,]+  16 of 16", row) for row in rows)


def test_real_data(real_dataroot):
    result = _run(real_dataroot)

    assert (
        "scene-0103  boston-seaport              40        6  2,090  0 of 240" in result.stdout.splitlines()
    )


def test_folder_of_shards(shards):
    result = _run(shards)

    assert result.exit_code == 0, result.output
    first, blank, header, *rows = result.stdout.splitlines()
    assert (first, blank) == (f"{shards}: 2 shards of v1.0-mini", "")
    assert header.split() == ["scene", "location", "frames", "bytes", "splits"]
    assert len(rows) == 2


def test_shard_lists_every_dataset(shards):
    path = min(shards.glob("*.h5"))

    result = _run(path)

    assert result.exit_code == 0, result.output
    assert "grid: 100 rows × 55 columns, 1.0 m a cell, ego at row 100, column 30" in result.stdout
    with h5py.File(path) as file:
        names = []
        file["CAM_FRONT"].visititems(
            lambda name, item: names.append(name) if hasattr(item, "shape") else None
        )
    lines = {line.split()[0]: line for line in result.stdout.splitlines() if line}
    assert set(names) <= set(lines)
    assert re.match(r"drivable +8 × 100 × 55 +uint8 +\w", lines["drivable"])
    assert re.match(r"sample_token +8 +text ", lines["sample_token"])


def test_what_is_neither_is_one_line(tmp_path):
    (tmp_path / "a.h5").write_bytes(b"text")

    for path in (tmp_path / "a.h5", tmp_path):
        result = _run(path)
        assert result.exit_code == 1
        assert re.fullmatch(r"ogmkit: error: [^\n]+\n", result.stderr)


def test_numbers_stand_to_the_right():
    assert (
        text_table(("name", "count"), [("a", 1234), ("bcdef", 5)])
        == "name   count\na      1,234\nbcdef      5"
    )


def test_a_table_without_rows_is_its_header():
    assert text_table(("name", "count"), []) == "name  count"
