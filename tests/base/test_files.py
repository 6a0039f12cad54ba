import errno
import os
import socket
from pathlib import Path

import pytest

from ogmkit.base.files import file_status, open_file, read_bytes, read_text

READERS = [file_status, open_file, read_bytes, read_text]


@pytest.fixture
def pipe(tmp_path):
    """A named pipe that nobody writes to: to open it would wait for ever."""
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


def test_a_file_is_read_whole(tmp_path):
    (tmp_path / "a").write_bytes("Größe\n".encode())
    assert read_text(tmp_path / "a") == "Größe\n"
    assert read_bytes(tmp_path / "a", most=8) == b"Gr\xc3\xb6\xc3\x9fe\n"
    assert file_status(tmp_path / "a").st_size == 8
    with open_file(tmp_path / "a") as file:
        assert file.read(2) == b"Gr"


def test_a_link_to_a_file_is_followed(tmp_path):
    (tmp_path / "a").write_bytes(b"x")
    (tmp_path / "b").symlink_to("a")
    assert read_bytes(tmp_path / "b") == b"x"


@pytest.mark.parametrize("read", READERS)
def test_a_pipe_is_refused_at_once(pipe, read):
    with pytest.raises(OSError, match="a named pipe, not a regular file") as caught:
        read(pipe)
    assert caught.value.filename == str(pipe)


@pytest.mark.parametrize(
    "read", [lambda file: file.read(), lambda file: file.read(1), lambda file: file.readinto(bytearray(9))]
)
def test_what_is_refused_while_a_file_is_read_names_it_too(read):
    memory = Path("/proc/self/mem")  # a regular file that can be opened; nothing is mapped at its beginning
    with open_file(memory) as file, pytest.raises(OSError, match="Input/output error") as caught:
        read(file)
    assert caught.value.filename == str(memory)


@pytest.mark.parametrize("read", READERS)
def test_a_device_is_refused(read):
    with pytest.raises(OSError, match="a device, not a regular file"):
        read(Path("/dev/zero"))


@pytest.mark.parametrize("read", READERS)
def test_a_socket_is_refused(tmp_path, read):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s"))
        with pytest.raises(OSError, match="a socket, not a regular file"):
            read(tmp_path / "s")


@pytest.mark.parametrize("read", READERS)
def test_a_folder_is_refused(tmp_path, read):
    with pytest.raises(IsADirectoryError, match="a folder, not a file"):
        read(tmp_path)


@pytest.mark.parametrize("read", READERS)
def test_what_is_absent_is_as_always(tmp_path, read):
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "a")


def test_a_file_over_the_limit_is_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    with pytest.raises(OSError, match="larger than 4 bytes") as caught:
        read_bytes(tmp_path / "a", most=4)
    assert caught.value.errno == errno.EFBIG
    assert read_bytes(tmp_path / "a", most=5) == b"12345"


def test_a_sparse_file_over_the_limit_takes_no_memory(tmp_path):
    with (tmp_path / "a").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(OSError, match="larger than 268,435,456 bytes"):
        read_bytes(tmp_path / "a")


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc here")
def test_a_file_that_hides_its_size_is_bounded_too():
    assert b"Pid:" in read_bytes(Path("/proc/self/status"))
    with pytest.raises(OSError, match="larger than 3 bytes"):
        read_bytes(Path("/proc/self/status"), most=3)


def test_what_takes_the_place_of_a_file_meanwhile_is_refused(tmp_path, pipe, monkeypatch):
    """Between the look at a file and its opening, a pipe is put there."""
    (tmp_path / "a").write_bytes(b"x")
    opened = os.open

    def replaced(path, flags):
        os.replace(pipe, path)
        return opened(path, flags)

    monkeypatch.setattr(os, "open", replaced)
    with pytest.raises(OSError, match="a named pipe, not a regular file"):
        open_file(tmp_path / "a")
