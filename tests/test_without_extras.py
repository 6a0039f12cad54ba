"""The data commands need none of the extras, and what needs them says how to install them."""

import subprocess
import sys

import pytest

# Python's own way to make an import fail, as it does where the package is not installed.
BLOCKED = """
import sys
for name in ("torch", "torchvision", "lightning", "kornia", "segmentation_models_pytorch", "torchmetrics",
             "tensorboard", "yaml", "onnx", "onnxruntime", "matplotlib", "scipy", "pyarrow", "rerun",
             "distributed"):
    sys.modules[name] = None
from ogmkit_cli.main import main
main(prog_name="ogmkit")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bare")


def run(*arguments):
    return subprocess.run(
        [sys.executable, "-c", BLOCKED, *map(str, arguments)], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def shards(folder, tiny_dataroot):
    out = folder / "shards"
    grid = ["--cell-size", "0.5", "--rows", "60", "--columns", "40"]
    result = run("extract", "-q", tiny_dataroot, out, *grid, "--cache-dir", folder / "cache")
    assert (result.returncode, result.stderr) == (0, "")
    return out


def test_every_module_of_the_core_imports_without_them():
    code = """
import sys, pkgutil, importlib
for name in ("torch", "lightning", "kornia", "segmentation_models_pytorch", "torchmetrics", "yaml", "onnx",
             "pyarrow", "rerun", "distributed"):
    sys.modules[name] = None
import ogmkit
names = [module.name for module in pkgutil.walk_packages(ogmkit.__path__, "ogmkit.")
         if not module.name.startswith(("ogmkit.learn", "ogmkit.torch"))]
for name in names:
    importlib.import_module(name)
print(len(names))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


def test_the_samples_for_torch_say_how_to_install_it():
    code = """
import sys
sys.modules["torch"] = None
try:
    import ogmkit.torch
except ImportError as error:
    print(type(error).__name__, error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    expected = "MissingPackageError needs torch, which is not installed: pip install 'ogmkit[train]'\n"
    assert done.stdout == expected


def test_the_data_commands_work(folder, shards, tiny_dataroot):
    for arguments in (
        ["check", tiny_dataroot],
        ["homography-fit", shards, "--method", "surface"],
        ["render-footprints", shards, "--scale", "1"],
        ["verify", shards],
        ["inspect", shards],
        ["export-shards", shards, folder / "tars", "--format", "webdataset"],
        ["preview", shards, "--out", folder / "pictures", "--frames", "1"],
        ["report", shards, "--out", folder / "report.html", "--frames", "1"],
    ):
        result = run(*arguments)
        assert result.returncode == 0, result.stderr


def test_evaluation_of_the_fixed_rows_needs_no_network(shards):
    result = run("evaluate", shards, "--format", "csv")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("system,definition,target,view,region,cells,metric,value,low,high,")


def test_parquet_says_how_to_install_what_it_needs(folder, shards):
    for layout in ("parquet", "hf"):
        result = run("export-shards", shards, folder / layout, "--format", layout)
        assert (result.returncode, result.stderr) == (
            1,
            "ogmkit: error: needs pyarrow, which is not installed: pip install 'ogmkit[parquet]'\n",
        )
        assert not (folder / layout).exists()


def test_the_viewer_says_how_to_install_what_it_needs(folder, shards):
    result = run("view", shards, "--save", folder / "scene.rrd")
    assert (result.returncode, result.stderr) == (
        1,
        "ogmkit: error: needs rerun, which is not installed: pip install 'ogmkit[view]'\n",
    )
    assert not (folder / "scene.rrd").exists()


def test_a_scheduler_says_how_to_install_what_it_needs(shards):
    for scheduler in ("local", "tcp://10.0.0.7:8786"):
        result = run("verify", shards, "--scheduler", scheduler)
        assert (result.returncode, result.stderr) == (
            1,
            "ogmkit: error: needs distributed, which is not installed: pip install 'ogmkit[cluster]'\n",
        )


def test_training_says_how_to_install_what_it_needs(folder, shards):
    for arguments in (
        ["train", "footprints", shards, "--out", folder / "run"],
        ["predict", "homography", shards, "--checkpoint", folder / "run"],
        ["predict", "footprints", shards, "--checkpoint", folder / "run", "--out", folder / "masks"],
        ["predict", "plan", shards, "--checkpoint", folder / "run"],
        ["run", folder / "chain.yaml"],
        ["evaluate", shards, folder / "run"],
        ["export", folder / "run", "--out", folder / "model.onnx"],
    ):
        (folder / "run").mkdir(exist_ok=True)
        (folder / "chain.yaml").touch()
        result = run(*arguments)
        assert result.returncode == 1
        assert result.stderr.count("\n") == 1
        assert "pip install 'ogmkit[train]'" in result.stderr
