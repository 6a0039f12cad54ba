"""A run is opened once, whatever is asked of it, and its weights stay in the file until they are used."""

import pytest
import torch
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.learn.predict.run import open_run
from ogmkit.shards.manifest import read_manifest

CAMERAS = ("CAM_FRONT",)


@pytest.fixture
def loads(monkeypatch):
    """The files that torch has loaded, in order."""
    paths, load = [], torch.load

    def counted(path, *arguments, **options):
        paths.append(path)
        return load(path, *arguments, **options)

    monkeypatch.setattr(torch, "load", counted)
    return paths


@pytest.fixture
def builds(monkeypatch):
    """The systems that were built, in order."""
    from ogmkit.learn import checkpoints

    names, build = [], checkpoints.build_system

    def counted(settings, *arguments):
        names.append(settings.system)
        return build(settings, *arguments)

    monkeypatch.setattr(checkpoints, "build_system", counted)
    return names


def test_evaluate_opens_and_builds_each_run_once(plan_shards, tmp_path, make_run, loads, builds):
    grid = read_manifest(plan_shards).settings.targets.grid
    systems = ["ved", "footprints", "oft", "lstm-ed", "holistic"]
    runs = []
    for system in systems:
        warp = {"warp": "surface"} if system == "holistic" else {}
        runs.append(make_run(tmp_path / system, system, grid, CAMERAS, **warp))
    builds.clear()
    options = ["--workers", "0", "--pictures", tmp_path / "pictures"]
    result = CliRunner().invoke(main, ["evaluate", *map(str, (plan_shards, *runs, *options))])
    assert result.exit_code == 0, result.stderr
    assert loads == [run / "best.ckpt" for run in runs]
    assert sorted(builds) == sorted(systems)


def test_a_network_is_let_go_when_its_predictions_are_done(plan_shards, tmp_path, make_run):
    from ogmkit.samples.index import index_frames
    from ogmkit.samples.spec import SampleSpec

    grid = read_manifest(plan_shards).settings.targets.grid
    run = open_run(make_run(tmp_path / "run", "ved", grid, CAMERAS))
    assert "model" not in vars(run)
    index = index_frames(plan_shards, ("scene-0001",), CAMERAS, needs=SampleSpec(), limit=2)
    frames = run.frames(index, None, batch_size=1, workers=0)
    next(frames)
    assert "model" in vars(run)
    frames.close()
    assert "model" not in vars(run)
