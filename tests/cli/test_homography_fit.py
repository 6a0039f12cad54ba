import hashlib
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest
from click.testing import CliRunner
from ogmkit_cli.homography_fit import command
from ogmkit_cli.main import main
from PIL import Image

from ogmkit.homography.methods import METHODS
from ogmkit.homography.settings import FitSettings
from ogmkit.pipeline.homography_fit import DEFAULT_METHODS
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

MOMENTS = 10
FULL_DISK = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
from ogmkit_cli.main import main
main(sys.argv[1:])
"""


@pytest.fixture
def out(tmp_path, extracted):
    return shutil.copytree(extracted, tmp_path / "out")


def run(out, *more):
    return CliRunner().invoke(main, ["homography-fit", str(out), *map(str, more)])


def test_the_options_have_the_librarys_defaults():
    defaults = {option.name: option.default for option in command.params}
    assert defaults["methods"] == DEFAULT_METHODS
    assert tuple(command.params[1].type.choices) == tuple(METHODS)
    settings = FitSettings()
    for name in ("min_spread_m", "max_distance_m", "categories", "min_visibility", "min_lidar_points"):
        assert defaults[name] == getattr(settings, name)
    assert settings.min_points is None


def test_it_tells_what_the_methods_are_worth(out, complaints):
    result = run(out, "--method", "surface", "--method", "robust")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0].startswith("32 frames in 2 shards (0 already complete)")
    surface, robust = (
        [line for line in lines if re.match(rf"{name} +\S", line)] for name in ("surface", "robust")
    )
    assert "32 of 32" in surface[0]
    assert surface[1].count(" / ") == 6
    refused = [line for line in lines if line.startswith("robust: no homography in ")]
    frames = sum(int(line.split()[4]) for line in refused)
    assert f"{32 - frames} of 32" in robust[0]
    assert verify_folder(out) == ()


def test_json_says_what_the_table_says(out, complaints):
    result = run(out, "--method", "surface,robust", "--json")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    held = json.loads(result.stdout)
    assert (held["shards"], held["kept"]) == (2, 0)
    surface, robust = held["methods"]
    figures = {name: surface[name] for name in ("method", "frames", "valid", "invalid")}
    assert figures == {"method": "surface", "frames": 32, "valid": 32, "invalid": []}
    assert robust["valid"] + sum(one["frames"] for one in robust["invalid"]) == 32
    assert {one["from_m"] for one in robust["left_out"]} == {0, 20, 40}
    assert set(robust["left_out"][0]) == {"from_m", "to_m", "boxes", "median_m", "p90_m", "refused_share"}


def test_json_has_null_for_what_was_not_measured(out):
    result = run(out, "--method", "plane", "--min-spread", 1000, "--json")
    (plane,) = json.loads(result.stdout)["methods"]
    assert (plane["valid"], plane["residual_px"], plane["left_out"][0]["median_m"]) == (0, None, None)
    assert sum(one["frames"] for one in plane["invalid"]) == 32


def test_many_reasons_are_counted_instead_of_listed(out):
    result = run(out, "--method", "plane", "--min-spread", 1000)
    assert "32 frames in 2 shards" in result.stdout
    refused = [line for line in result.stdout.splitlines() if line.startswith("plane: no homography in ")]
    assert len(refused) == 6
    assert sum(int(line.split()[4]) for line in refused) == 32
    assert re.fullmatch(
        r"plane: no homography in \d+ frames?: \d+ other reasons?, each in the shard", refused[-1]
    )
    assert "nan" not in result.stdout


def test_a_second_run_says_that_all_was_there(out):
    first, second = run(out), run(out)
    assert "(2 already complete)" in second.stdout
    assert second.stdout.splitlines()[1:] == first.stdout.splitlines()[1:]


def test_one_camera_can_be_chosen(out):
    assert run(out, "--camera", "CAM_BACK").exit_code == 0
    with Shard(next(out.glob("*.h5"))) as shard:
        assert shard.added("CAM_FRONT", "homography") == ()
        assert shard.added("CAM_BACK", "homography") == tuple(sorted(DEFAULT_METHODS))


def test_the_options_reach_the_fit(out):
    options = ["--min-points", 8, "--min-spread", 0.5, "--max-distance", 40, "--min-visibility", 2]
    options += ["--min-lidar-points", 1]
    assert run(out, "--method", "dlt", *options, "--categories", "vehicle.car,human.").exit_code == 0
    with Shard(next(out.glob("*.h5"))) as shard:
        settings = shard.h5["CAM_FRONT/homography/dlt"].attrs["settings"]
    assert settings == (
        '{"categories": ["vehicle.car", "human."], "max_distance_m": 40.0, "min_lidar_points": 1, '
        '"min_points": 8, "min_spread_m": 0.5, "min_visibility": 2}'
    )


def test_the_plot_is_a_png(tmp_path, out):
    assert run(out, "--plot", tmp_path / "errors.png").exit_code == 0
    with Image.open(tmp_path / "errors.png") as picture:
        assert picture.format == "PNG"
        assert min(picture.size) > 100


def test_a_plot_that_has_no_place_is_named(tmp_path, out):
    result = run(out, "--plot", tmp_path / "absent/errors.png")
    assert result.exit_code == 1
    assert re.search(r"errors\.png: can't be written: No such file", result.stderr)
    assert verify_folder(out) == ()


def other_settings(out):
    run(out, "--method", "dlt")
    return ["--method", "dlt", "--min-points", "8"]


def no_shards(out):
    shutil.rmtree(out)
    out.mkdir()
    return []


def foreign(out):
    shutil.copy(Path(__file__), next(out.glob("*.h5")))
    return []


def lost(out):
    next(out.glob("*.h5")).unlink()
    return []


def edit_manifest(out, edit):
    content = json.loads((out / "manifest.json").read_text())
    del content["sha256"]  # or the change would be taken for damage
    edit(content)
    (out / "manifest.json").write_text(json.dumps(content))


def no_shard_named(out):
    edit_manifest(out, lambda content: content["shards"].clear())
    return []


def foreign_hdf5(out):
    with h5py.File(next(out.glob("*.h5")), "w") as h5:
        h5["image"] = 1
    return []


def without_boxes(out):
    path = min(out.glob("*.h5"))
    with h5py.File(path, "r+") as h5:
        del h5["CAM_FRONT/boxes"]
    known = {"bytes": path.stat().st_size, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    edit_manifest(out, lambda content: content["shards"][0].update(known))
    return []


def unknown_camera(out):
    return ["--camera", "CAM_TOP"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (other_settings, "settings.min_points is 8 here but None there; use --overwrite"),
        (no_shards, "choose a folder that `ogmkit extract` finished"),
        (no_shard_named, "the manifest names no shard; run `ogmkit extract` again"),
        (foreign, "bytes, by the manifest"),
        (foreign_hdf5, "bytes, by the manifest"),
        (without_boxes, "/CAM_FRONT/boxes/offsets is missing; remove it and run `ogmkit extract` again"),
        (lost, "is absent; run `ogmkit extract` again"),
        (unknown_camera, "unknown camera 'CAM_TOP'"),
        (lambda out: ["--plot", out / "plot.png"], "holds nothing but shards; choose another place"),
        (lambda out: ["--max-distance", "inf"], "max_distance_m: inf is not finite"),
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


@pytest.mark.parametrize(
    "option", [["--method", "best"], ["--min-points", "3"], ["--max-distance", "0"], ["--min-spread", "-1"]]
)
def test_bad_options_are_usage_errors(out, option):
    assert run(out, *option).exit_code == 2


def test_a_full_disk_leaves_old_shards_intact(out, contents, complaints):
    before = contents(out)
    run_full = subprocess.run(
        [sys.executable, "-c", FULL_DISK, "homography-fit", out], capture_output=True, text=True, check=False
    )
    assert run_full.returncode == 1, run_full
    assert "can't be written: File too large" in run_full.stderr
    assert complaints(run_full.stderr).count("\n") == 1
    assert {name: digest for name, digest in contents(out).items() if not name.startswith(".")} == before
    assert run(out).exit_code == 0
    assert verify_folder(out) == ()


@pytest.mark.slow
def test_killed_and_finished_it_is_as_undisturbed(tmp_path, out, extracted, contents, start):
    whole = shutil.copytree(extracted, tmp_path / "whole")
    started = time.monotonic()
    assert start("homography-fit", whole, "--workers", "2").finish() == (0, "")
    run_time_s = time.monotonic() - started
    hits = 0
    for moment in range(MOMENTS):
        process = start("homography-fit", out, "--workers", "2")
        time.sleep(run_time_s * (moment + 0.5) / MOMENTS)
        hits += process.send(signal.SIGKILL)
        process.finish()
        for path in out.glob("*.h5"):
            with Shard(path) as shard:  # whole: the old one or the new one
                assert len(shard.added("CAM_FRONT", "homography")) in (0, len(DEFAULT_METHODS))
        if moment % 3 == 2:  # leave work for the moments to come
            shutil.rmtree(out)
            shutil.copytree(extracted, out)
    assert hits > MOMENTS / 3  # a machine that is less busy than at first finishes before the late ones
    assert start("homography-fit", out, "--workers", "2").finish() == (0, "")
    assert contents(out) == contents(whole)


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_ends_at_once_with_whole_shards_only(out, workers, start):
    process = start("homography-fit", out, "--workers", workers, "--method", "surface")
    while not list(out.glob(".scene-*.part")):
        assert process.running()
        time.sleep(0.001)
    process.send(signal.SIGINT)
    assert process.finish() == (130, "ogmkit: interrupted; run the same command to resume\n")
    names = {path.name for path in out.iterdir() if path.suffix != ".h5"}
    assert names == {"manifest.json", ".ogmkit-amend.json"}
    assert run(out, "--method", "surface").exit_code == 0
    assert verify_folder(out) == ()
