"""Masks predicted by a Dask cluster's workers: the same files as in one process, whole ones only."""

import logging
import os
import signal
import threading
from pathlib import Path

import pytest

from ogmkit.errors import OutputError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.shards import PredictionJob, predict_shards

distributed = pytest.importorskip(
    "distributed", reason="distributed is not installed: pip install 'ogmkit[cluster]'"
)

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")
BATCH = 3
"""No divisor of a scene's 16 frames: a batch that went on into the next scene would be another one."""
KILLS = 3


@pytest.fixture(scope="module")
def run(tmp_path_factory, make_run):
    return make_run(tmp_path_factory.mktemp("runs") / "footprints", "footprints", GRID, CAMERAS)


@pytest.fixture(scope="module")
def cluster():
    """A cluster of one process of this machine, which is started again where it dies."""
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        scheduler_kwargs={"dashboard": False},
        memory_limit=None,
        silence_logs=logging.CRITICAL,
    ) as found:
        yield found


@pytest.fixture(scope="module")
def by_one(tmp_path_factory, learn_shards, run):
    """Form of the files → folder of what one process writes."""
    folder = tmp_path_factory.mktemp("by-one")
    return {form: predicted(run, learn_shards, folder / form, form=form) for form in ("hdf5", "png")}


def predicted(run, shards, out, *, form="hdf5", workers=0, **more):
    predict_shards(PredictionJob("footprints", run, out, form, BATCH, workers), shards, **more)
    return out


@pytest.mark.parametrize(("form", "files"), [("hdf5", 2), ("png", 4 * 32)])
def test_workers_write_the_same_bytes(
    tmp_path, learn_shards, run, by_one, cluster, contents, form, files, monkeypatch, caplog
):
    caplog.set_level(logging.DEBUG, "ogmkit")
    monkeypatch.chdir(tmp_path)  # where the workers are not
    told = []
    job = PredictionJob("footprints", run, Path("out"), form, BATCH)
    summary = predict_shards(
        job,
        learn_shards,
        scheduler=cluster.scheduler_address,
        on_progress=lambda *counts: told.append(counts),
    )
    assert contents(tmp_path / "out") == contents(by_one[form])
    assert (summary.frames, summary.files, told) == (32, files, [(16, 32), (32, 32)])
    lines = {record.message for record in caplog.records if record.process != os.getpid()}
    assert len([line for line in lines if line.startswith("scene-000") and ": 16 frames in " in line]) == 2


def test_a_scene_is_predicted_the_same_whatever_else_is(tmp_path, learn_shards, run, by_one, contents):
    """So are the batches of one process the workers': none goes beyond its scene."""
    out = predicted(run, learn_shards, tmp_path / "out", choice=Choice(("scene-0002",)))
    assert contents(out) == {"scene-0002.h5": contents(by_one["hdf5"])["scene-0002.h5"]}


def test_ctrl_c_leaves_whole_files_only(tmp_path, learn_shards, run, by_one, cluster, contents):
    def interrupt(done, total):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        predicted(run, learn_shards, out, scheduler=cluster.scheduler_address, on_progress=interrupt)
    assert {} != contents(out).items() <= contents(by_one["hdf5"]).items()


def test_a_workers_error_is_the_commands(tmp_path, learn_shards, run, cluster):
    out = tmp_path / "out"
    (out / "scene-0002.h5").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"scene-0002\.h5: can't be written"):
        predicted(run, learn_shards, out, scheduler=cluster.scheduler_address)


def test_what_is_no_scheduler_is_refused_before_anything_is_written(tmp_path, learn_shards, run):
    with pytest.raises(SettingsError, match="scheduler 'here'"):
        predicted(run, learn_shards, tmp_path / "out", scheduler="here")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_processes_of_this_machine_write_the_same_bytes(tmp_path, learn_shards, run, by_one, contents):
    out = predicted(run, learn_shards, tmp_path / "out", workers=2, scheduler="local")
    assert contents(out) == contents(by_one["hdf5"])


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing(tmp_path, learn_shards, run, by_one, cluster, contents):
    (worker,) = cluster.workers.values()
    for number in range(KILLS):
        threading.Timer(0.1 + 0.3 * number, os.kill, [worker.pid, signal.SIGKILL]).start()
        out = predicted(run, learn_shards, tmp_path / str(number), scheduler=cluster.scheduler_address)
        written = {name: digest for name, digest in contents(out).items() if not name.startswith(".")}
        assert written == contents(by_one["hdf5"])
