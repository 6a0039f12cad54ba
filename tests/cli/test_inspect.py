import importlib.util
import json
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
    from ogmkit.target_settings import TargetSettings

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
    assert rows[2:] == [
        "",
        "camera     invalid     frames  reason",
        "CAM_FRONT  trajectory       4  future positions are missing",
        "CAM_FRONT  trajectory       8  past and future positions are missing",
        "CAM_FRONT  trajectory       4  past positions are missing",
    ]


def test_a_shard_says_which_frames_are_invalid(shards):
    lines = _run(min(shards.glob("*.h5"))).stdout.splitlines()

    assert lines[-4].split() == ["camera", "invalid", "frames", "reason", "which,", "from", "0"]
    assert lines[-2] == "CAM_FRONT  trajectory       4  past and future positions are missing  2-5"


def _json(path):
    result = _run(path, "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.isascii()
    return json.loads(result.stdout)


def test_json_of_data(tiny_dataroot, shards):
    path = min(shards.glob("*.h5"))
    dataset, folder, shard = _json(tiny_dataroot), _json(shards), _json(path)

    assert [one["kind"] for one in (dataset, folder, shard)] == ["dataset", "shards", "shard"]
    assert [one["path"] for one in (dataset, folder, shard)] == [str(tiny_dataroot), str(shards), str(path)]
    assert (dataset["version"], dataset["cameras"]) == ("v1.0-mini", ["CAM_BACK", "CAM_FRONT"])
    assert dataset["splits"] == {"train": ["scene-0001"], "val": ["scene-0002"]}
    assert [scene["frames"] for scene in dataset["scenes"]] == [8, 8]
    assert [entry["file"] for entry in folder["shards"]] == ["scene-0001.h5", "scene-0002.h5"]
    assert sum(one["frames"] for one in folder["invalid"]) == 16
    assert folder["settings"]["grid"]["rows"] == 100
    assert [(one["camera"], one["frames"]) for one in shard["cameras"]] == [("CAM_FRONT", 8)]
    (drivable,) = (one for one in shard["cameras"][0]["datasets"] if one["name"] == "drivable")
    assert (drivable["shape"], drivable["type"]) == ([8, 100, 55], "uint8")
    assert [one["frames"] for one in shard["invalid"]] == [[6, 7], [2, 3, 4, 5], [0, 1]]


@pytest.fixture
def trained(tmp_path, make_run):
    """A RUN as a training leaves it, but for pictures and logs."""
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    from ogmkit.grid import GridSpec

    run = make_run(tmp_path / "run", "lstm-ed", GridSpec(rows=80), ("CAM_FRONT",))
    (run / "config.yaml").write_text("system: lstm-ed\nlr: 0.5\nmax_steps: null\ncameras: [CAM_FRONT]\n")
    (run / "splits.json").write_text('{"train": ["a", "b"], "val": ["c"]}')
    (run / "metrics.csv").write_text("epoch,step,name,value\n1,8,val/ade,2.5\n")
    return run


def test_a_run_and_its_checkpoint(trained):
    assert _run(trained).stdout.splitlines() == [
        f"{trained}: training of lstm-ed",
        "scenes: train (2), val (1)",
        "checkpoints: best.ckpt",
        "",
        "figure   epoch  step  last value",
        "val/ade      1     8  2.5",
        "",
        "setting    value",
        "lr         0.5",
        "max_steps",
        "cameras    CAM_FRONT",
    ]
    held = _json(trained)
    assert (held["kind"], held["system"], held["settings"]["lr"]) == ("run", "lstm-ed", 0.5)
    assert held["figures"] == [{"epoch": 1, "step": 8, "name": "val/ade", "value": 2.5}]
    lines = _run(trained / "best.ckpt").stdout.splitlines()
    assert lines[0].startswith(f"{trained / 'best.ckpt'}: lstm-ed, epoch 0, by ogmkit ")
    assert lines[1:3] == ["cameras: CAM_FRONT", "grid: 80 rows × 550 columns, 0.1 m a cell"]
    held = _json(trained / "best.ckpt")
    assert (held["kind"], held["cameras"], held["grid"]["rows"]) == ("checkpoint", ["CAM_FRONT"], 80)


def test_a_checkpoint_needs_torch_and_a_run_does_not(trained, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "torch" else find(name))
    assert _run(trained).exit_code == 0
    result = _run(trained / "best.ckpt")
    assert result.exit_code == 1
    assert "needs torch, which is not installed: pip install 'ogmkit[train]'" in result.stderr


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
