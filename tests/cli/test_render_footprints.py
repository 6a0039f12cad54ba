import re
import shutil
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main
from ogmkit_cli.render_footprints import command

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

MOMENTS = 10


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, extracted):
    """Shards of two cameras with homographies; tests only read them."""
    out = shutil.copytree(extracted, tmp_path_factory.mktemp("fitted") / "out")
    arguments = ["homography-fit", str(out), "--method", "surface", "--method", "robust"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return out


@pytest.fixture
def out(tmp_path, fitted):
    return shutil.copytree(fitted, tmp_path / "out")


def run(out, *more):
    return CliRunner().invoke(main, ["render-footprints", str(out), *map(str, more)])


def test_the_options_have_the_librarys_defaults():
    defaults = {option.name: option.default for option in command.params}
    settings = FootprintSettings()
    for name in ("homography", "method", "scale"):
        assert defaults[name] == getattr(settings, name)


def test_it_tells_what_was_made(out, complaints):
    result = run(out)
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    assert result.stdout.startswith("surface: 32 frames in 2 shards (0 already complete), ")
    assert "(2 already complete)" in run(out).stdout
    assert verify_folder(out) == ()


def test_it_tells_of_frames_without_a_homography(out):
    result = run(out, "--homography", "robust")
    assert result.exit_code == 0
    assert re.fullmatch(
        r"robust: no valid homography in \d+ frames?: left empty", result.stdout.splitlines()[1]
    )


def test_the_options_reach_the_masks(out):
    options = ["--homography", "calibration", "--method", "project", "--scale", "4", "--masks", "mine"]
    assert run(out, *options, "--camera", "CAM_BACK").exit_code == 0
    with Shard(next(out.glob("*.h5"))) as shard:
        assert shard.added("CAM_FRONT", "footprints") == ()
        group = shard.h5["CAM_BACK/footprints/mine"]
        assert [group.attrs[name] for name in ("homography", "method", "scale")] == [
            "calibration",
            "project",
            4.0,
        ]
        assert group["drivable"].shape == (8, 22, 40)


def no_shards(out):
    shutil.rmtree(out)
    out.mkdir()
    return []


def foreign(out):
    shutil.copy(Path(__file__), next(out.glob("*.h5")))
    return []


def other_settings(out):
    run(out)
    return ["--scale", "4"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (no_shards, "choose a folder that `ogmkit extract` finished"),
        (foreign, "bytes, by the manifest"),
        (other_settings, "scale is 4.0 here but 2.0 there; use --overwrite"),
        (lambda out: ["--homography", "dlt"], "unknown homography 'dlt'; there are: robust, surface"),
        (lambda out: ["--homography", "robust", "--method", "full-body"], "choose surface or calibration"),
        (lambda out: ["--scale", "nan"], "scale: nan is not above 0"),
        (lambda out: ["--scale", "1000"], "leaves nothing of 90 × 160 pixels"),
        (lambda out: ["--masks", ""], "use letters, digits"),
        (lambda out: ["--camera", "CAM_TOP"], "unknown camera 'CAM_TOP'"),
    ],
)
def test_bad_input_takes_one_line_and_loses_nothing(out, spoil, message, contents, complaints):
    options = spoil(out)
    before = contents(out)
    result = run(out, *options)
    assert (result.exit_code, result.stdout) == (1, "")
    assert message in result.stderr
    assert complaints(result.stderr).count("\n") == 1
    assert contents(out) == before


@pytest.mark.parametrize("options", [["--method", "wrap"], ["--scale", "0"], ["--scale", "-1"]])
def test_unknown_methods_and_ranges_are_usage_errors(out, options):
    assert run(out, *options).exit_code == 2


@pytest.mark.slow
def test_killed_and_finished_it_is_as_undisturbed(tmp_path, out, fitted, contents, start):
    options = ["--workers", "2", "--scale", "0.25"]
    whole = shutil.copytree(fitted, tmp_path / "whole")
    started = time.monotonic()
    assert start("render-footprints", whole, *options).finish() == (0, "")
    run_time_s = time.monotonic() - started
    hits = 0
    for moment in range(MOMENTS):
        process = start("render-footprints", out, *options)
        time.sleep(run_time_s * (moment + 0.5) / MOMENTS)
        hits += process.send(signal.SIGKILL)
        process.finish()
        for path in out.glob("*.h5"):
            with Shard(path) as shard:  # whole: the old one or the new one
                assert shard.added("CAM_FRONT", "footprints") in ((), ("surface",))
        if moment % 3 == 2:  # leave work for the moments to come
            shutil.rmtree(out)
            shutil.copytree(fitted, out)
    assert hits > MOMENTS / 3  # a machine that is less busy than at first finishes before the late ones
    assert start("render-footprints", out, *options).finish() == (0, "")
    assert contents(out) == contents(whole)
    assert verify_folder(out) == ()
