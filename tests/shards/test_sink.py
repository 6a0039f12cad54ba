import signal
import subprocess
import sys

import h5py
import numpy as np
import pytest

from ogmkit.shards.sink import create

FULL_DISK = """
import resource, signal, sys
from pathlib import Path
import h5py, numpy as np
from ogmkit.shards.sink import create

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
noise = np.random.default_rng(0).integers(0, 256, (40, 10_000)).astype(np.uint8)

def write(path, rows):
    with create(path) as file:
        with file.writing() as h5:
            dataset = h5.create_dataset("noise", noise.shape, "u1", chunks=(1, 10_000), compression="gzip")
        for row in range(rows):
            with file.writing():
                dataset[row] = noise[row]

for attempt in range(2):
    try:
        write(Path(sys.argv[1]), 40)
    except OSError as error:
        print(error.strerror)
write(Path(sys.argv[2]), 10)
"""


def test_a_full_disk_is_an_error_and_no_crash(tmp_path):
    small = tmp_path / "small.h5"
    command = [sys.executable, "-c", FULL_DISK, tmp_path / "large.h5", small]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.splitlines() == ["File too large"] * 2
    with h5py.File(small) as h5:
        assert h5["noise"][9].any()


READ_AGAIN = """
import io, resource, signal, sys
from pathlib import Path
from ogmkit.shards.sink import _Sink

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))
with _Sink(Path(sys.argv[1])) as sink:
    for part in (b"abcdefgh", b"ijklmnop", b"qr"):
        assert sink.write(part) == len(part)
    sink.seek(4)
    sink.write(b"EF")
    assert sink.truncate(20) == sink.seek(0, io.SEEK_END) == 20
    sink.seek(3)
    read = bytearray(30)
    print(bytes(read[: sink.readinto(read)]), sink.tell())
    try:
        sink.check()
    except OSError as error:
        print(error.strerror)
"""


def test_hdf5_reads_again_what_the_disk_didn_t_take(tmp_path):
    """It crashes, or says what misleads, where the file is shorter than what it wrote."""
    command = [sys.executable, "-c", READ_AGAIN, tmp_path / "a.h5"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.stderr == ""
    assert run.stdout.splitlines() == [r"b'dEFghijklmnopqr\x00\x00' 20", "File too large"]


def test_a_failure_while_the_file_is_closed_is_an_error(tmp_path):
    """/dev/full takes nothing: with little data, that shows only at the end."""
    full = tmp_path / "full.h5"
    full.symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"), create(full) as file, file.writing() as h5:
        h5["value"] = np.arange(3)


def test_ctrl_c_waits_until_hdf5_is_done(tmp_path):
    path = tmp_path / "a.h5"
    reached = []

    def write():
        with create(path) as file:
            with file.writing() as h5:
                signal.raise_signal(signal.SIGINT)
                h5["value"] = 1
                reached.append("inside")
            reached.append("after")

    with pytest.raises(KeyboardInterrupt):
        write()
    assert reached == ["inside"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with h5py.File(path) as h5:
        assert h5["value"][()] == 1


def test_ctrl_c_while_the_file_is_opened_closes_it(tmp_path, monkeypatch):
    opened = []
    plain_file = h5py.File

    def interrupted_file(*arguments):
        opened.append(plain_file(*arguments))
        signal.raise_signal(signal.SIGINT)
        return opened[0]

    monkeypatch.setattr(h5py, "File", interrupted_file)
    with pytest.raises(KeyboardInterrupt), create(tmp_path / "a.h5"):
        pytest.fail("the block was entered")
    assert not opened[0]  # closed
