import re

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")


def run(*arguments):
    return CliRunner().invoke(main, ["adapt", *map(str, arguments)])


def test_a_line_says_what_was_done(tmp_path, make_run, sample_grid, sample_shards):
    there, out = make_run(tmp_path / "run", "footprints", sample_grid, ("CAM_FRONT",)), tmp_path / "out"
    result = run(there, sample_shards, "--out", out, "--split", "val", "--limit-frames", 4, "--batch-size", 2)

    assert result.exit_code == 0, result.stderr
    counted = r"footprints, \d+ layers of batch normalisation by 4 images of"
    assert re.fullmatch(rf"{out}: {counted} {sample_shards}, \d+\.\d s\n", result.stdout)
    held = CliRunner().invoke(main, ["inspect", str(out / "best.ckpt")]).stdout
    assert f"batch normalisation: by 4 images of {sample_shards}, from {there}\n" in held


def test_a_share_is_told_by_inspect(tmp_path, make_run, sample_grid, sample_shards):
    there, out = make_run(tmp_path / "run", "footprints", sample_grid, ("CAM_FRONT",)), tmp_path / "out"
    result = run(there, sample_shards, "--out", out, "--limit-frames", 2, "--share", 0.5)

    assert result.exit_code == 0, result.stderr
    held = CliRunner().invoke(main, ["inspect", str(out / "best.ckpt")]).stdout
    assert f"batch normalisation: by 2 images of {sample_shards}, with a share of 0.5, from {there}\n" in held
    assert run(there, sample_shards, "--out", tmp_path / "other", "--share", 0).exit_code == 2


def test_what_sees_no_images_is_refused_in_a_line(tmp_path, make_run, sample_grid, sample_shards, complaints):
    there = make_run(tmp_path / "run", "mid-to-end", sample_grid, ("CAM_FRONT",))
    result = run(there, sample_shards, "--out", tmp_path / "out")

    assert (result.exit_code, result.stdout) == (1, "")
    assert complaints(result.stderr) == (
        f"ogmkit: error: {there}: mid-to-end sees no images; there is nothing to adapt\n"
    )
