"""`ogmkit extract` on partial downloads and without maps."""

import json
import re
import shutil

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

GRID = ("--cell-size", "0.5", "--rows", "60", "--columns", "40")


def _run(*arguments):
    return CliRunner().invoke(main, [str(value) for value in arguments])


def _shown(result):
    """The summary's lines by name."""
    return dict(re.split(r"  +", line) for line in result.stdout.splitlines())


@pytest.fixture
def partial(tmp_path, tiny_dataroot):
    """The tiny dataset without maps, and without the images of CAM_BACK but for the first three."""
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    shutil.rmtree(root / "maps")
    for path in sorted((root / "samples/CAM_BACK").iterdir())[3:]:
        path.unlink()
    return root


@pytest.fixture
def extract(partial, tmp_path):
    """Extract CAM_BACK of that dataset: `extract(*options)`."""

    def call(*options):
        arguments = ("--camera", "CAM_BACK", *GRID, "--cache-dir", tmp_path / "cache", *options)
        return _run("extract", partial, tmp_path / "out", *arguments)

    return call


def test_a_line_a_kind_says_what_is_missing_and_how_to_go_on(extract, complaints):
    result = extract()
    assert (result.exit_code, _shown(result)["failed"]) == (1, "2")
    lines = complaints(result.stderr).splitlines()
    assert len(lines) == 2
    image, mask = sorted(lines, key=lambda line: "map mask" in line)
    assert re.fullmatch(
        r"ogmkit: scene-0001, scene-0002 failed: .*/CAM_BACK/.*\.jpg: image is absent, one of 13 of "
        r"CAM_BACK; download them, or leave out such scenes \(--only-complete\), such frames "
        r"\(--skip-bad-frames\) or all images \(--images none\)",
        image,
    )
    assert re.search(r"/maps/.*\.png: map mask is absent, one of 2; .*\(--no-map\)$", mask)


def test_frames_that_lack_a_file_are_left_out(extract, tmp_path, complaints):
    result = extract("--no-map", "--skip-bad-frames")
    shown = _shown(result)
    assert (result.exit_code, shown["frames"], shown["frames left out"], shown["failed"]) == (
        0,
        "3",
        "5",
        "0",
    )
    assert (shown["scenes"], shown["scenes left out"]) == ("1 (0 were there)", "1")
    assert "drivable cells" not in shown
    (line,) = complaints(result.stderr).splitlines()
    assert re.search(r"scene-0002 left out: .*image is absent, and so for every frame of CAM_BACK", line)
    assert _run("verify", tmp_path / "out").output == f"{tmp_path / 'out'}: sound\n"
    assert _shown(extract("--no-map", "--skip-bad-frames"))["scenes"] == "1 (1 were there)"
    text = _run("inspect", tmp_path / "out").stdout
    assert text.startswith(f"{tmp_path / 'out'}: 1 shard of v1.0-mini, without drivable area (--no-map)\n")
    assert re.search(r"camera +left out  reason\nCAM_BACK +5  image is absent\n", text)
    for place in ("out", "out/scene-0001.h5"):
        held = json.loads(_run("inspect", tmp_path / place, "--json").stdout)
        assert held["left_out"] == [{"camera": "CAM_BACK", "reason": "image is absent", "frames": 5}]


def test_where_no_scene_is_complete_that_is_an_error(extract, complaints, tmp_path):
    result = extract("--no-map", "--only-complete")
    assert (result.exit_code, _shown(result)["scenes left out"], _shown(result)["failed"]) == (1, "2", "0")
    left_out, none = complaints(result.stderr).splitlines()
    assert re.fullmatch(
        r"ogmkit: scene-0001, scene-0002 left out: .*\.jpg: image is absent, one of 13 of CAM_BACK", left_out
    )
    assert none == f"ogmkit: {tmp_path / 'out'}: no scene is left"


def test_one_complete_scene_is_enough(extract, partial, tiny_dataroot):
    names = sorted(path.name for path in (tiny_dataroot / "samples/CAM_BACK").iterdir())
    for name in names[:8]:
        shutil.copy(tiny_dataroot / "samples/CAM_BACK" / name, partial / "samples/CAM_BACK")
    result = extract("--no-map", "--only-complete")
    assert (result.exit_code, _shown(result)["scenes"], _shown(result)["scenes left out"]) == (
        0,
        "1 (0 were there)",
        "1",
    )


def test_a_dry_run_tells_it_beforehand(extract, tmp_path):
    first, second, total = extract("--no-map", "--dry-run").stdout.splitlines()
    assert re.match(r"scene-0001  fail: .*image is absent, one of 5 of CAM_BACK; download them", first)
    assert "one of 8 of CAM_BACK" in second
    assert total.endswith("0 of 2 scenes to write, 0 frames")
    assert "leave out: " in extract("--no-map", "--dry-run", "--only-complete").stdout
    lines = extract("--no-map", "--dry-run", "--skip-bad-frames").stdout.splitlines()
    assert lines[0].split() == ["scene-0001", "write", "3", "frames"]
    assert not (tmp_path / "out").exists()


def test_scenes_or_frames_not_both(extract, complaints):
    result = extract("--only-complete", "--skip-bad-frames")
    assert result.exit_code == 1
    assert complaints(result.stderr) == (
        "ogmkit: error: only_complete, skip_bad_frames: leave out whole scenes or frames, not both\n"
    )


def test_settings_differ_where_maps_were_left_out(extract, partial, tiny_dataroot):
    shutil.copytree(tiny_dataroot / "maps", partial / "maps")
    assert extract("--no-map", "--skip-bad-frames").exit_code == 0
    result = extract("--skip-bad-frames")
    assert result.exit_code == 1
    assert "no_map is" in result.stderr
    assert extract("--skip-bad-frames", "--overwrite").exit_code == 0


def test_a_real_partial_download(partial_dataroot, tmp_path, complaints):
    def extract(out, *options):
        return _run("extract", partial_dataroot, tmp_path / out, *GRID, "--no-map", *options)

    front = extract("front", "--camera", "CAM_FRONT")
    assert (front.exit_code, complaints(front.stderr), _shown(front)["frames"]) == (0, "", "80")
    back = extract("back", "--camera", "CAM_BACK")
    (line,) = complaints(back.stderr).splitlines()
    assert back.exit_code == 1
    assert line.startswith("ogmkit: scene-0103, scene-0523 failed: ")
    assert "image is absent, one of 74 of CAM_BACK" in line
    assert all(option in line for option in ("--only-complete", "--skip-bad-frames"))
    skipped = extract("back", "--camera", "CAM_BACK", "--skip-bad-frames")
    shown = _shown(skipped)
    assert (skipped.exit_code, complaints(skipped.stderr)) == (0, "")
    assert (shown["scenes"], shown["frames"], shown["frames left out"]) == ("2 (0 were there)", "6", "74")
