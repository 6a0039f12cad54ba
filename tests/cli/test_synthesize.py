import json

import cv2
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

SMALL = ["--num-scenes", "1", "--frames", "1", "--camera", "CAM_BACK", "--image-size", "45x80", "--no-lidar"]


def run(*arguments):
    return CliRunner().invoke(main, ["synthesize", *map(str, arguments)])


def test_makes_a_dataset_and_says_what(tmp_path):
    out = tmp_path / "out"
    result = run(out, *SMALL, "--version", "v1.0-toy", "--seed", "4", "--relief", "2")
    assert result.exit_code == 0, result.output
    assert result.output.startswith(f"{out}: 1 scene ")
    assert "1 key frame," in result.output
    assert json.loads((out / "splits.json").read_text()) == {"train": ["scene-0001"], "val": []}
    assert len(list((out / "v1.0-toy").iterdir())) == 13
    (image,) = (out / "samples").glob("*/*")
    assert image.parent.name == "CAM_BACK"
    assert cv2.imread(str(image)).shape == (45, 80, 3)


@pytest.mark.slow
def test_incidents_change_the_traffic(tmp_path):
    for name, more in (("calm", []), ("busy", ["--incidents"])):
        result = run(tmp_path / name, *SMALL, *more)
        assert result.exit_code == 0, result.output
    calm, busy = ((tmp_path / name / "v1.0-mini" / "ego_pose.json").read_text() for name in ("calm", "busy"))
    assert calm != busy


def test_full_folder_is_an_error_of_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    result = run(tmp_path, *SMALL)
    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert str(tmp_path) in result.stderr


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--camera", "CAM_TOP"], 1),
        (["--cameras", "CAM_TOP"], 1),
        (["--num-scenes", "0"], 2),
        (["--relief", "-1"], 2),
        (["--image-size", "big"], 2),
        (["--frames", "many"], 2),
    ],
)
def test_wrong_options_are_refused_before_anything_is_written(tmp_path, arguments, code):
    result = run(tmp_path / "out", *SMALL, *arguments)
    assert result.exit_code == code
    assert list(tmp_path.iterdir()) == []


def test_default_cameras_are_all_of_the_rig():
    from ogmkit_cli.synthesize import command

    from ogmkit.synthetic.rig import CAMERA_MOUNTS

    (option,) = [option for option in command.params if option.name == "cameras"]
    assert list(option.default) == list(CAMERA_MOUNTS)
