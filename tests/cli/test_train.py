import re
import shutil
import signal
import subprocess
import sys
import time

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
yaml = pytest.importorskip("yaml", reason="yaml is not installed: pip install 'ogmkit[train]'")

TRAINED_S = 300
INTERRUPTED = (
    r"(ogmkit: stopping after this (step|validation); press Ctrl-C again to quit now\n){1,2}"
    r"ogmkit: interrupted; run the same command to resume\n"
)
SMALL = ["--encoder", "tu-test_resnet", "--workers", "0", "--batch-size", "2"]
TINY = ["--image-size", "64x96", *SMALL]


@pytest.fixture(scope="module")
def shards(tmp_path_factory, tiny_dataroot):
    """Two scenes, train and val, with homographies and footprints; tests only read it."""
    folder = tmp_path_factory.mktemp("train")
    out, grid = folder / "shards", ["--cell-size", "0.5", "--rows", "60", "--columns", "40"]
    for arguments in (
        ["extract", tiny_dataroot, out, *grid, "--cache-dir", folder / "cache"],
        ["homography-fit", out, "--method", "surface", "--method", "robust"],
        ["render-footprints", out, "--scale", "1"],
    ):
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        assert result.exit_code == 0, result.output
    return out


def run(*arguments):
    return CliRunner().invoke(main, ["train", *map(str, arguments)])


def test_print_config_is_a_config(shards, tmp_path):
    first = run("oft", shards, "--print-config", "--split-ratio", "77/9", "--epochs", "7")
    assert first.exit_code == 0
    values = yaml.safe_load(first.stdout)
    assert (values["system"], values["epochs"], values["lr"]) == ("oft", 7, 1e-7)
    (tmp_path / "config.yaml").write_text(first.stdout)
    again = run("oft", shards, "--print-config", "--config", tmp_path / "config.yaml")
    assert again.stdout == first.stdout
    more = run("oft", shards, "--print-config", "--config", tmp_path / "config.yaml", "--epochs", "8")
    assert yaml.safe_load(more.stdout) == values | {"epochs": 8}


def test_a_run_keeps_its_config_and_tells_what_it_did(shards, tmp_path, complaints):
    out = tmp_path / "run"
    result = run("homography", shards, "--out", out, *TINY, "--epochs", "1", "--head", "four-point")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    assert result.stdout.startswith(f"{out}: homography, 4 steps on 8 frames, best error_m ")
    values = yaml.safe_load((out / "config.yaml").read_text())
    assert (values["head"], values["image_size"], values["cameras"]) == (
        "four-point",
        [64, 96],
        ["CAM_FRONT"],
    )
    again = run("homography", shards, "--out", out, *TINY, "--epochs", "1", "--head", "four-point")
    assert ", resumed at step 4, " in again.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["footprint"], 2, "No such command 'footprint'. Did you mean 'footprints'?"),
        (["oft", "--image-size", "64"], 2, "is not HEIGHTxWIDTH"),
        (["oft", "--split-ratio", "77"], 2, "is not A/B"),
        (["oft"], 2, "Missing option '--out'"),
    ],
)
def test_usage_errors(shards, arguments, code, message):
    system, *options = arguments
    result = run(system, shards, *options)
    assert result.exit_code == code
    assert message in result.stderr


def test_a_setting_of_other_systems_is_refused_by_naming_them(shards, tmp_path):
    for option in (["--kl-weight", "7"], ["--head", "four-point"], ["--hidden", "3"]):
        result = run("footprints", shards, "--out", tmp_path / "run", *option)
        assert result.exit_code == 2
        assert f"{option[0]} is a setting of " in result.stderr
        assert "; footprints does not read it." in result.stderr
    assert not (tmp_path / "run").exists()


def no_valid_homography(folder):
    import h5py

    for path in folder.glob("*.h5"):
        with h5py.File(path, "r+") as file:
            file["CAM_FRONT/homography/robust/valid"][:] = False
    return ["homography", "--target", "robust"]


def unwritable(folder):
    (folder.parent / "file").write_text("a file")
    return ["homography", "--out", folder.parent / "file" / "run"]


def config_with(text):
    def spoil(folder):
        (folder.parent / "config.yaml").write_text(text)
        return ["homography", "--config", folder.parent / "config.yaml"]

    return spoil


def pickled(folder):
    import pickle

    short = ["homography", "--max-steps", "1"]
    assert run(short[0], folder, "--out", folder.parent / "run", *TINY, *short[1:]).exit_code == 0
    (folder.parent / "run" / "last.ckpt").write_bytes(pickle.dumps({"state_dict": print}))
    return short


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (no_valid_homography, "a valid robust homography|valid"),
        (lambda folder: ["footprints", "--masks", "dlt"], "render-footprints .* --homography dlt"),
        (lambda folder: ["homography", "--target", "network"], "predict homography .* --checkpoint"),
        (lambda folder: ["homography", "--val-split", "test"], "split 'test' has no scene"),
        (lambda folder: ["bev-lidar"], "extract .*--lidar"),
        (lambda folder: ["oft", "--bev-cell", "0.7"], "0.7"),
        (
            lambda folder: ["homography", "--lr", "1e3", "--epochs", "9"],
            "not finite at step .* batch of scene-",
        ),
        (unwritable, "file/run: can't be written"),
        (pickled, "last.ckpt: .*nothing of it was run"),
        (config_with("epoch: 3"), "unknown setting 'epoch'; did you mean epochs"),
        (config_with("kl_weight: 3"), "config.yaml: kl_weight: homography does not read it; ved does"),
        (config_with("- 3"), "not a mapping"),
        (config_with("a: [b"), "not YAML"),
        (config_with("[" * 9000), "nested too deeply"),
        (config_with("epochs: " + "9" * 400), "config.yaml: epochs: a number of 400 digits is too large"),
        (config_with("lr: " + "9" * 400), "config.yaml: lr: 9{40}.* is not a number"),
        (config_with("epochs: " + "9" * 5000), "not YAML"),
    ],
)
def test_bad_input_takes_one_line(shards, tmp_path, spoil, message, complaints):
    folder = shutil.copytree(shards, tmp_path / "shards")
    system, *options = spoil(folder)
    size = SMALL if system == "bev-lidar" else TINY
    result = run(system, folder, "--out", tmp_path / "run", *size, *options)
    assert (result.exit_code, result.stdout) == (1, "")
    assert complaints(result.stderr).count("\n") == 1, result.stderr
    assert re.search(message, result.stderr), result.stderr


def wait_for(path, process):
    while not path.exists() and process.running():
        time.sleep(0.01)


def weights(out):
    from ogmkit.learn.checkpoints import read_checkpoint

    return read_checkpoint(out / "last.ckpt")[1]["state_dict"]


@pytest.mark.slow
def test_killed_and_interrupted_it_ends_with_the_same_weights(shards, tmp_path, start):
    import torch

    options = ["--epochs", "4", "--checkpoint-every", "2", "--colour", "0.3", "--optimizer", "adamw"]
    arguments = ["train", "footprints", shards, *TINY, *options, "--out"]
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert start(*arguments, whole).finish(TRAINED_S) == (0, "")
    process = start(*arguments, cut)
    wait_for(cut / "last.ckpt", process)
    process.send(signal.SIGKILL)
    assert process.finish(TRAINED_S)[0] in (-signal.SIGKILL, 0)
    process = start(*arguments, cut)
    wait_for(cut / "samples.png", process)
    time.sleep(0.1)
    process.send(signal.SIGINT, group=False)
    code, errors = process.finish(TRAINED_S)
    assert (code, errors) == (0, "") or (code == 130 and re.fullmatch(INTERRUPTED, errors)), errors
    assert start(*arguments, cut).finish(TRAINED_S) == (0, "")
    left, right = weights(whole), weights(cut)
    assert all(torch.equal(left[name], right[name]) for name in left)
    assert not [path.name for path in cut.iterdir() if path.name.endswith(".part")]


def test_what_a_training_tells_where_stderr_is_no_terminal(shards, tmp_path):
    out = tmp_path / "run"
    options = ["homography", shards, "--out", out, *TINY, "--epochs"]
    first, longer = run(*options, "2").stderr.splitlines(), run(*options, "3").stderr.splitlines()

    device = re.search(r"; (cpu|cuda \(.+?\)); ", first[1])[1]
    found = "training on 8 frames of 1 scene, validation on 8 frames of 1 scene"
    lines = ["loading torch", f"{found}; {device}; reading in this process; {out}"]
    assert first[:2] == [f"train homography: {line}" for line in lines]
    epochs = [line for line in first if re.match(r"train homography: epoch ", line)]
    assert len(epochs) == 2
    for number, line in enumerate(epochs, 1):
        assert re.fullmatch(rf"train homography: epoch {number}/2: loss [\d.e-]+, error_m [\d.e-]+", line)
    assert longer[1] == f"{first[1]}; resumed from step 8"
    assert len([line for line in longer if re.match(r"train homography: epoch ", line)]) == 1


@pytest.mark.slow
def test_ctrl_c_at_a_terminal_reaches_no_worker_and_the_step_is_saved(shards, tmp_path, start):
    out = tmp_path / "run"
    options = ["--epochs", "1000", "--accumulate", "2", "--workers", "2"]
    process = start("train", "homography", shards, "--out", out, *TINY, *options)
    wait_for(out / "best.ckpt", process)
    (out / "last.ckpt").unlink(missing_ok=True)
    process.send(signal.SIGINT)
    code, errors = process.finish(TRAINED_S)
    assert code == 130
    assert re.fullmatch(INTERRUPTED, errors), errors
    assert (out / "last.ckpt").exists()


WATCHED = """
import sys
from ogmkit_cli.main import main
try:
    main(sys.argv[1:])
finally:
    print(*{"torch", "lightning"} & sys.modules.keys(), end="")
"""


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["train", "footprints", "{shards}", "--out", "run", "--val-split", "typo"], "split 'typo' has no"),
        (["train", "footprints", "{shards}", "--out", "run", "--masks", "dlt"], "has no footprints 'dlt'"),
        (["train", "homography", "{shards}", "--out", "{shards}"], "no training made it"),
        (["train", "homography", "nowhere", "--out", "run"], "nowhere/manifest.json: can't be read"),
        (["predict", "homography", "nowhere", "--checkpoint", "run.ckpt"], "nowhere/manifest.json"),
        (
            ["predict", "ved", "nowhere", "--checkpoint", "run.ckpt", "--out", "masks"],
            "nowhere/manifest.json",
        ),
        (["predict", "plan", "{shards}", "--checkpoint", "run.ckpt", "--scenes", "scene-7"], "'scene-7'"),
        (["evaluate", "nowhere", "run.ckpt"], "nowhere/manifest.json"),
        (["evaluate", "{shards}", "nowhere"], "nowhere: not a checkpoint"),
    ],
)
def test_what_the_shards_can_tell_is_told_before_torch_is_imported(shards, tmp_path, arguments, message):
    (tmp_path / "nowhere").mkdir()
    (tmp_path / "run.ckpt").touch()
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, *(argument.format(shards=shards) for argument in arguments)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
