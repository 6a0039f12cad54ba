"""Masks predicted by a Dask cluster's workers: the same files as in one process, whole ones only."""

import logging
import os
import signal
import threading
from pathlib import Path

import pytest

from ogmkit.errors import OutputError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.predict import frames
from ogmkit.learn.predict.frames import predict_batch
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


def start_cluster(*, processes):
    """A cluster of one worker: a thread here, or a process, which is started again where it dies."""
    return distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=processes,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        scheduler_kwargs={"dashboard": False},
        memory_limit=None,
        silence_logs=logging.CRITICAL,
    )


@pytest.fixture(scope="module")
def scheduler():
    """The address of one whose worker need not import torch again."""
    with start_cluster(processes=False) as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def by_one(tmp_path_factory, learn_shards, run):
    """Form of the files → folder of what one process writes."""
    folder = tmp_path_factory.mktemp("by-one")
    return {form: predicted(run, learn_shards, folder / form, form=form) for form in ("hdf5", "png")}


def predicted(run, shards, out, *, form="hdf5", workers=0, **more):
    predict_shards(PredictionJob("footprints", run, out, form, BATCH, workers), shards, **more)
    return out


@pytest.mark.parametrize(("form", "files"), [("hdf5", 2), ("png", 4 * 32)])
def test_workers_write_the_same_bytes(tmp_path, learn_shards, run, by_one, scheduler, contents, form, files):
    told = []
    job = PredictionJob("footprints", run, tmp_path / "out", form, BATCH)
    summary = predict_shards(
        job, learn_shards, scheduler=scheduler, on_progress=lambda *counts: told.append(counts)
    )
    assert contents(tmp_path / "out") == contents(by_one[form])
    assert (summary.frames, summary.files, told) == (32, files, [(16, 32), (32, 32)])


def test_no_batch_goes_beyond_its_scene(tmp_path, learn_shards, run, monkeypatch):
    batches = []

    def predict(model, batch, cameras):
        batches.append(batch["index"].tolist())
        return predict_batch(model, batch, cameras)

    monkeypatch.setattr(frames, "predict_batch", predict)
    predicted(run, learn_shards, tmp_path / "out")
    assert batches == [
        list(range(start, min(start + BATCH, scene + 16)))
        for scene in (0, 16)
        for start in range(scene, scene + 16, BATCH)
    ]


def test_ctrl_c_leaves_whole_files_only(tmp_path, learn_shards, run, by_one, scheduler, contents):
    def interrupt(done, total):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        predicted(run, learn_shards, out, scheduler=scheduler, on_progress=interrupt)
    assert {} != contents(out).items() <= contents(by_one["hdf5"]).items()


def test_a_workers_error_is_the_commands(tmp_path, learn_shards, run, scheduler):
    out = tmp_path / "out"
    (out / "scene-0002.h5").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"scene-0002\.h5: can't be written"):
        predicted(run, learn_shards, out, scheduler=scheduler)


def test_what_is_no_scheduler_is_refused_before_anything_is_written(tmp_path, learn_shards, run):
    with pytest.raises(SettingsError, match="scheduler 'here'"):
        predicted(run, learn_shards, tmp_path / "out", scheduler="here")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("form", "files"), [("hdf5", "1 file"), ("png", "64 files")])
def test_processes_of_this_machine_write_the_same_bytes(
    tmp_path, learn_shards, run, by_one, contents, form, files, monkeypatch, caplog
):
    caplog.set_level(logging.DEBUG, "ogmkit")
    monkeypatch.chdir(tmp_path)  # where the workers are not
    predicted(run, learn_shards, Path("out"), form=form, workers=2, scheduler="local")
    assert contents(tmp_path / "out") == contents(by_one[form])
    lines = [record.message for record in caplog.records if record.process != os.getpid()]
    assert sorted(lines) == [f"scene-000{number}: 16 frames in {files}" for number in (1, 2)]


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing(tmp_path, learn_shards, run, by_one, contents):
    with start_cluster(processes=True) as cluster:
        (worker,) = cluster.workers.values()
        for number in range(KILLS):
            threading.Timer(0.1 + 0.3 * number, os.kill, [worker.pid, signal.SIGKILL]).start()
            out = predicted(run, learn_shards, tmp_path / str(number), scheduler=cluster.scheduler_address)
            written = {name: digest for name, digest in contents(out).items() if not name.startswith(".")}
            assert written == contents(by_one["hdf5"])
