"""Work on a Dask cluster: what it writes is what one process writes, whoever dies meanwhile."""

import contextlib
import json
import os
import pickle
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from ogmkit.base import cluster, cluster_worker
from ogmkit.base.execution import Execution, run_over
from ogmkit.base.news import Waiting, listening
from ogmkit.errors import OgmkitError, SettingsError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.verify import verify_folder
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

pytest.importorskip("distributed", reason="distributed is not installed: pip install 'ogmkit[cluster]'")

METHODS = ("surface", "dlt")


class Programs:
    """`dask scheduler` and `dask worker` as processes of this machine."""

    def __init__(self, folder):
        self.folder, self.workers = folder, []
        self.start_scheduler("tcp://127.0.0.1:0")

    def start_scheduler(self, address):
        where = self.folder / "scheduler.json"
        where.unlink(missing_ok=True)
        host, port = address.removeprefix("tcp://").split(":")
        options = ["--host", host, "--port", port, "--no-dashboard", "--no-show", "--scheduler-file", where]
        self.scheduler = self._start("scheduler", *options)
        while not where.exists() or not where.read_text():
            assert self.scheduler.poll() is None
            time.sleep(0.05)
        self.address = json.loads(where.read_text())["address"]

    def start_workers(self, count):
        options = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", self.folder]
        new = [self._start("worker", self.address, "--host", "127.0.0.1", *options) for _ in range(count)]
        self.workers += new
        return new

    def wait_for(self, count):
        """Return once so many workers have joined."""
        with cluster._quiet(), cluster._client(self.address) as client:
            client.wait_for_workers(count)

    def _start(self, name, *options):
        # Elsewhere than the command, as on another machine: relative paths would lead nowhere.
        command = [sys.executable, "-m", f"distributed.cli.dask_{name}", *map(str, options)]
        return subprocess.Popen(
            command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def end(self):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """`start()` gives a scheduler that ends with the module."""
    with contextlib.ExitStack() as stack:

        def call():
            programs = Programs(tmp_path_factory.mktemp("cluster"))
            stack.callback(programs.end)
            return programs

        yield call


@pytest.fixture(scope="module")
def two(start):
    """A cluster of two workers."""
    programs = start()
    programs.start_workers(2)
    return programs


@pytest.fixture
def on_two(two):
    return Execution(scheduler=two.address)


@pytest.fixture(scope="module")
def by_one(tmp_path_factory, undisturbed):
    """What one process makes by all commands; tests only read it."""
    out = tmp_path_factory.mktemp("by-one") / "out"
    shutil.copytree(undisturbed, out)
    fit_shards(out, METHODS)
    render_footprints(out)
    return out


def test_workers_started_by_hand_give_the_same_bytes(tmp_path, run, on_two, by_one, digests, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where the workers are not
    progress = []
    execution = replace(on_two, on_progress=lambda *counts: progress.append(counts))
    out = Path("out")
    run(out, execution=execution)
    fit_shards(out, METHODS, execution=execution)
    render_footprints(out, execution=execution)
    assert digests(out) == digests(by_one)
    assert progress == 3 * [(1, 2), (2, 2)]
    assert verify_folder(out, execution=execution) == ()


def test_verify_and_check_find_the_same(tmp_path, by_one, tiny_dataroot, on_two):
    out = shutil.copytree(by_one, tmp_path / "out")
    shard = next(out.glob("*.h5"))
    shard.write_bytes(shard.read_bytes()[:-1])
    assert verify_folder(out, execution=on_two) == verify_folder(out) != ()
    root = shutil.copytree(tiny_dataroot, tmp_path / "world")
    for image in sorted(root.glob("samples/CAM_FRONT/*.jpg"))[1:6]:
        image.unlink()
    assert check_dataset(root, execution=on_two) == check_dataset(root) != ()


def test_processes_of_this_machine_give_the_same_bytes(tmp_path, undisturbed, by_one, digests):
    out = shutil.copytree(undisturbed, tmp_path / "out")
    local = Execution(2, "local")
    fit_shards(out, METHODS, execution=local)
    render_footprints(out)
    assert digests(out) == digests(by_one)
    assert local.place == "in a Dask cluster of 2 worker processes"


def test_a_worker_that_sees_no_folder_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_worker, "_PATIENCE_S", 0.0)
    monkeypatch.setattr(cluster_worker, "_name", lambda: "tcp://10.0.0.8:4711 on node-8")
    terms = cluster_worker.Terms("run", cluster_worker.releases(), (tmp_path, tmp_path / "absent"), 0)
    with pytest.raises(OgmkitError, match=r"^worker tcp\S+ on node-8 sees no .*absent; the folder must"):
        cluster_worker.work(terms, b"").unpacked()
    (tmp_path / "absent").touch()
    assert cluster_worker.work(terms, cluster._packed((abs, -7))).unpacked() == 7


def test_threads_are_limited_before_torch_may_be_imported(monkeypatch):
    terms = cluster.Terms("run", cluster.releases(), (), 0)
    packed = cluster._packed((abs, -7))
    order, loads = [], pickle.loads
    monkeypatch.setattr(cluster_worker, "limit_threads", lambda: order.append("limited"))
    monkeypatch.setattr(pickle, "loads", lambda data: order.append("unpickled") or loads(data))
    assert cluster_worker.work(terms, packed).unpacked() == 7
    assert order == ["limited", "unpickled"]


def test_another_release_is_refused(on_two, monkeypatch):
    monkeypatch.setattr(cluster, "releases", lambda: (("ogmkit", "99.1"),) * 5)
    with pytest.raises(OgmkitError, match=r"worker tcp.* has ogmkit 0\.\S+, this command 99\.1; install"):
        list(run_over(abs, [1], on_two))


def test_leaving_waits_for_what_was_begun_and_begins_nothing_more(tmp_path, on_two):
    commands = [f"sleep 0.5; touch {tmp_path / str(number)}" for number in range(12)]
    with closing(run_over(os.system, commands, on_two)) as results:
        next(results)
    there = set(tmp_path.iterdir())
    time.sleep(1.0)
    assert set(tmp_path.iterdir()) == there
    assert 1 <= len(there) < 12


def test_who_waits_for_workers_is_told_and_a_dead_scheduler_too(
    tmp_path, start, run, undisturbed, digests, two, monkeypatch
):
    """Then the same command resumes, once there is a scheduler again."""
    monkeypatch.setattr(cluster, "_CONNECT_S", 1)
    own = start()
    news = []

    def hear(told):
        news.append(told)
        if isinstance(told, Waiting):
            own.start_workers(1)

    execution = Execution(scheduler=own.address, on_progress=lambda *_: own.scheduler.kill())
    with listening(hear), pytest.raises(OgmkitError, match=rf"{own.address}; what was finished .*: it resu"):
        run(tmp_path / "out", execution=execution)
    assert Waiting(f"no worker has joined {own.address} yet; start some: dask worker {own.address}") in news
    with pytest.raises(OgmkitError, match=rf"no Dask scheduler answers at {own.address}; start one"):
        fit_shards(undisturbed, METHODS, execution=execution)
    own.scheduler.wait()
    summary = run(tmp_path / "out", execution=Execution(scheduler=two.address))
    assert summary.kept >= 1
    assert digests(tmp_path / "out") == digests(undisturbed)


def test_a_worker_that_is_killed_loses_nothing(tmp_path, start, undisturbed, run, digests):
    own = start()
    doomed, _ = own.start_workers(2)
    own.wait_for(2)
    delay_s = random.Random(7).uniform(0.1, 1.0)
    with killed_after(delay_s, doomed):
        run(tmp_path / "out", execution=Execution(scheduler=own.address))
    assert doomed.poll() == -signal.SIGKILL
    assert digests(tmp_path / "out") == digests(undisturbed)


@contextlib.contextmanager
def killed_after(delay_s, process):
    timer = threading.Timer(delay_s, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.join()
        process.wait()


@pytest.mark.parametrize("scheduler", ["10.0.0.7:8786", "tcp://here", "tcp://a:1 b", "locale", "http://a:80"])
def test_what_is_no_scheduler_is_refused(scheduler):
    with pytest.raises(SettingsError, match="give local, or an address such as tcp://"):
        Execution(scheduler=scheduler)


@pytest.mark.slow
def test_ctrl_c_is_told_in_one_line_and_leaves_no_process(tmp_path, tiny_dataroot, mask_cache):
    """The terminal sends it to all processes of the command."""
    out = tmp_path / "out"
    code = "from ogmkit_cli.main import main; main(prog_name='ogmkit')"
    options = ["--scheduler", "local", "--workers", "2", "--cache-dir", mask_cache, "-q"]
    command = [sys.executable, "-c", code, "extract", tiny_dataroot, out, *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        while not list(out.glob(".scene-*.part")):
            assert process.poll() is None
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        told = process.communicate()[1]  # at the end of the last process that has stderr
    assert told == "ogmkit: interrupted; run the same command to resume\n"
    assert not list(out.glob("*.part"))


@pytest.mark.slow
def test_a_unit_that_kills_every_worker_ends_the_run():
    with pytest.raises(OgmkitError, match="died over the same unit of work again and again"):
        list(run_over(os._exit, [3], Execution(1, "local")))


@pytest.mark.slow
def test_killed_at_random_moments_three_commands_give_the_same_bytes(
    tmp_path, start, small_settings, mask_cache, digests
):
    """Of four workers, one is killed at five moments of each command, and replaced."""
    root = tmp_path / "world"
    synthesize(root, SynthesisSettings(8, 12, cameras=small_settings.cameras, image_size=(90, 160)))
    own, draw = start(), random.Random(20261130)
    own.start_workers(4)
    with Dataset(root) as dataset:

        def extracted(out, execution):
            scenes, splits = dataset.scene_names(), dataset.splits()
            options = {"execution": execution, "cache_dir": mask_cache}
            extract(dataset, out, small_settings, scenes=scenes, splits=splits, **options)

        commands = {
            "extract": extracted,
            "fit": lambda out, execution: fit_shards(out, METHODS, execution=execution),
            "render": lambda out, execution: render_footprints(out, execution=execution),
        }
        before = None
        for name, command in commands.items():
            whole = tmp_path / f"{name}-whole"
            copied(before, whole)
            command(whole, Execution())
            own.wait_for(4)
            timed = tmp_path / f"{name}-timed"
            copied(before, timed)
            started = time.monotonic()
            command(timed, Execution(scheduler=own.address))
            took_s = time.monotonic() - started
            assert digests(timed) == digests(whole)
            for moment in range(5):
                own.wait_for(4)
                out = tmp_path / f"{name}-{moment}"
                copied(before, out)
                doomed = draw.choice([one for one in own.workers if one.poll() is None])
                with killed_after(draw.uniform(0.0, took_s), doomed):
                    command(out, Execution(scheduler=own.address))
                assert digests(out) == digests(whole)
                own.start_workers(1)
            before = whole


def copied(before, out):
    if before is not None:
        shutil.copytree(before, out)
