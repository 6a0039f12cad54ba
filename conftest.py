"""What the tests and the conformance tests share."""

import fcntl
import os

import pytest


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory):
    """A folder that is filled once for all processes: `shared_folder(name, fill)`; tests only read it.

    `fill(folder)` gets the new folder. pytest-xdist gives each of its processes a folder within the run's.
    """
    own = tmp_path_factory.getbasetemp()
    base = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def make(name, fill):
        folder, done = base / "shared" / name, base / "shared" / f"{name}.done"
        folder.parent.mkdir(exist_ok=True)
        with (base / "shared" / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                folder.mkdir()
                fill(folder)
                done.touch()
        return folder

    return make
