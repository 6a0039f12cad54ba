import io
import os
import pickle
import struct
import subprocess
import sys
import textwrap
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from ogmkit.errors import DataFileError, OutputError
from ogmkit.nuscenes import decoded, maps, mask_cache
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.png import read_grey_png


@pytest.fixture
def store(tmp_path):
    return MaskStore(tmp_path / "cache")


@pytest.fixture
def png(tmp_path):
    path = tmp_path / "mask.png"
    _write(path, _pixels((50, 37)))
    return path


def _pixels(shape, seed=0):
    return np.random.default_rng(seed).choice(np.array([0, 255], np.uint8), shape)


def _write(path, pixels, **options):
    Image.fromarray(pixels).save(path, **options)


def _whole(mask):
    return mask.window(0, mask.shape[0], 0, mask.shape[1])


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png_header(width, height):
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))


@pytest.mark.parametrize("shape", [(1, 1), (3, 8), (50, 37), (7, 4097)])
def test_every_pixel_survives(store, tmp_path, shape):
    pixels = _pixels(shape)
    _write(tmp_path / "mask.png", pixels)
    mask = store.open(tmp_path / "mask.png")
    assert mask.shape == shape
    np.testing.assert_array_equal(_whole(mask), pixels // 255)


def test_decoding_by_blocks_of_rows_changes_nothing(store, png, monkeypatch):
    pixels = _pixels((700, 37))
    _write(png, pixels)
    at_once = store.open(png).path.read_bytes()
    monkeypatch.setattr(decoded, "_BLOCK_PIXELS", 3 * 37)
    again = MaskStore(store.cache_dir / "again").open(png)
    assert again.path.read_bytes() == at_once
    np.testing.assert_array_equal(_whole(again), pixels // 255)


def test_only_the_devkit_s_foreground_value_is_drivable(store, png):
    _write(png, np.array([[0, 1, 254, 255]], np.uint8))
    np.testing.assert_array_equal(_whole(store.open(png)), [[0, 0, 0, 1]])


def test_one_bit_masks_read_alike(store, png):
    Image.open(png).convert("1").save(png)
    np.testing.assert_array_equal(_whole(store.open(png)), _pixels((50, 37)) // 255)


@given(st.data())
def test_windows_are_cut_anywhere(tmp_path_factory, data):
    pixels = _pixels((20, 43), seed=5)
    folder = tmp_path_factory.getbasetemp()
    _write(folder / "windows.png", pixels)
    mask = MaskStore(folder / "windows").open(folder / "windows.png")
    row0, row1 = sorted(data.draw(st.tuples(st.integers(0, 20), st.integers(0, 20))))
    column0, column1 = sorted(data.draw(st.tuples(st.integers(0, 43), st.integers(0, 43))))
    window = mask.window(row0, row1, column0, column1)
    np.testing.assert_array_equal(window, pixels[row0:row1, column0:column1] // 255)


def test_a_mask_pickles_without_its_pixels(store, png):
    _write(png, _pixels((900, 900)))
    mask = store.open(png)
    expected = _whole(mask)
    pickled = pickle.dumps(mask)
    assert len(pickled) < 1000
    np.testing.assert_array_equal(_whole(pickle.loads(pickled)), expected)


def test_a_second_opening_decodes_nothing(store, png, monkeypatch):
    expected = _whole(store.open(png))
    monkeypatch.setattr(maps, "_decode", None)
    np.testing.assert_array_equal(_whole(MaskStore(store.cache_dir).open(png)), expected)


def test_the_default_folder_is_the_platform_s(tmp_path, png, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("OGMKIT_CACHE_DIR", raising=False)
    monkeypatch.setattr(mask_cache, "user_cache_path", lambda name: tmp_path / "home" / name)
    assert MaskStore().open(png).path.is_relative_to(tmp_path / "home" / "ogmkit")


def test_an_environment_variable_names_the_folder(tmp_path, png, monkeypatch):
    monkeypatch.setenv("OGMKIT_CACHE_DIR", str(tmp_path / "named"))
    assert MaskStore().open(png).path.parent == tmp_path / "named"
    assert MaskStore(tmp_path / "given").open(png).path.parent == tmp_path / "given"


@pytest.mark.parametrize("place", [0, 63, 64, 64 + 128 * 320 + 5, -1])
def test_a_flipped_bit_in_the_cache_is_found(store, png, place):
    """In the header the mask is decoded again; in pixels or checksums the reading of that tile fails."""
    pixels = _pixels((300, 2560), seed=3)
    _write(png, pixels)
    path = store.open(png).path
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)
    mask = store.open(png)
    if 0 <= place < 64:
        np.testing.assert_array_equal(_whole(mask), pixels // 255)
        return
    with pytest.raises(
        DataFileError, match=r"\.mask: decoded map mask is damaged; remove it \(`ogmkit cache"
    ):
        _whole(mask)


def test_only_the_tiles_that_a_window_touches_are_read(store, png):
    """300 × 2560 pixels are 3 × 3 tiles of 128 × 1024; the one in the middle is spoilt."""
    pixels = _pixels((300, 2560), seed=3)
    _write(png, pixels)
    path = store.open(png).path
    data = bytearray(path.read_bytes())
    data[64 + 200 * 320 + 150] ^= 0xFF
    path.write_bytes(data)
    mask = store.open(png)
    for row0, row1, column0, column1 in [(0, 128, 0, 2560), (256, 300, 0, 2560), (0, 300, 0, 1024)]:
        window = mask.window(row0, row1, column0, column1)
        np.testing.assert_array_equal(window, pixels[row0:row1, column0:column1] // 255)
    for row0, row1, column0, column1 in [(127, 129, 1024, 1025), (255, 256, 2047, 2048), (0, 300, 0, 2560)]:
        with pytest.raises(DataFileError, match="is damaged"):
            mask.window(row0, row1, column0, column1)


@pytest.mark.parametrize("shape", [(50, 37), (61, 40)])
def test_a_changed_source_is_noticed_even_by_its_time_alone(store, png, shape):
    _write(png, _pixels((50, 37)), compress_level=0)  # so that the size depends on the shape only
    store.open(png)
    changed = _pixels(shape, seed=1)
    _write(png, changed, compress_level=0)
    os.utime(png, ns=(1, 1))
    np.testing.assert_array_equal(_whole(store.open(png)), changed // 255)


def test_a_mask_open_since_before_the_change_still_shows_what_it_showed(store, png):
    before = store.open(png)
    expected = _whole(before)
    _write(png, _pixels((90, 12), seed=1))
    store.open(png)
    np.testing.assert_array_equal(_whole(before), expected)


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: b"", lambda data: b"?" * len(data)])
def test_a_damaged_cache_file_is_made_again(store, png, damage):
    decoded = store.open(png).path
    decoded.write_bytes(damage(decoded.read_bytes()))
    np.testing.assert_array_equal(_whole(store.open(png)), _pixels((50, 37)) // 255)


@pytest.mark.parametrize("change", [Path.unlink, lambda path: path.write_bytes(b"?")])
def test_a_decoded_file_lost_before_its_first_use_is_named(store, png, change):
    mask = store.open(png)
    change(mask.path)
    with pytest.raises(DataFileError, match=r"\.mask.*run again"):
        _whole(mask)


def test_masks_of_the_same_name_in_two_folders_stay_apart(store, tmp_path):
    for seed in (1, 2):
        (tmp_path / str(seed)).mkdir()
        _write(tmp_path / str(seed) / "mask.png", _pixels((9, 9), seed))
    for seed in (1, 2):
        mask = store.open(tmp_path / str(seed) / "mask.png")
        np.testing.assert_array_equal(_whole(mask), _pixels((9, 9), seed) // 255)


def test_processes_that_start_at_once_decode_once(png, tmp_path):
    script = textwrap.dedent(
        f"""
        import time
        from pathlib import Path
        from ogmkit.nuscenes import maps

        decode = maps._decode

        def slow_decode(*arguments):
            with open({str(tmp_path / "log")!r}, "a") as log:
                log.write("x")
            time.sleep(0.5)
            return decode(*arguments)

        maps._decode = slow_decode
        mask = maps.MaskStore(Path({str(tmp_path / "cache")!r})).open(Path({str(png)!r}))
        print(mask.window(0, 50, 0, 37).sum())
        """
    )
    processes = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    sums = {process.communicate(timeout=60)[0].strip() for process in processes}
    assert sums == {str((_pixels((50, 37)) // 255).sum())}
    assert (tmp_path / "log").read_text() == "x"


def _encoded(pixels, format_):
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format_)
    return buffer.getvalue()


_PNG = _encoded(_pixels((60, 60)), "PNG")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<html><body>404 Not Found</body></html>",
        _encoded(_pixels((60, 60)), "JPEG")[:-200],
        _encoded(_pixels((60, 60, 3)), "PNG"),
        _encoded(_pixels((60, 60)).astype(np.uint16), "PNG"),
        _PNG[:20],
        _PNG[: len(_PNG) // 2],
        _PNG[:-12],
        _PNG[:-1],
        _PNG[:200] + bytes([_PNG[200] ^ 1]) + _PNG[201:],
        _png_header(64, 64) + _chunk(b"IDAT", zlib.compress(bytes(65 * 64))[:-9]) + _chunk(b"IEND", b""),
        _png_header(1 << 16, 1 << 16) + _chunk(b"IEND", b""),
        _png_header((1 << 21), 1) + _chunk(b"IEND", b""),
    ],
    ids=[
        "empty", "html", "jpeg cut short", "colours", "16 bit", "cut in header", "cut in half", "without end",
        "last byte missing", "bit flipped", "data missing", "too many pixels", "too wide",
    ],
)  # fmt: skip
def test_anything_but_a_whole_mask_is_named(store, png, content):
    png.write_bytes(content)
    with pytest.raises(DataFileError, match=r"mask\.png: map mask [^\n]+$"):
        store.open(png)
    assert not list(store.cache_dir.glob("*.mask")) + list(store.cache_dir.glob("*.partial"))


def _idat(rows):
    """The stream of some rows, each after its filter's number, ended as a whole one is."""
    return _chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows)))


@pytest.mark.parametrize("rows", [0, 1, 30, 59])
def test_a_mask_whose_pixels_end_early_is_no_mask_with_black_below(store, png, rows):
    """Every chunk is sound, and so is the stream's end."""
    png.write_bytes(_png_header(60, 60) + _idat(_pixels((60, 60))[:rows]) + _chunk(b"IEND", b""))
    with pytest.raises(
        DataFileError, match=r"mask\.png: map mask is not a whole PNG \(its pixels end early\)"
    ):
        store.open(png)


@pytest.mark.parametrize("cut", [1, 5, 200, 600])
def test_a_mask_whose_stream_is_cut_is_refused(store, png, cut):
    """The chunk's checksum goes with what is left."""
    whole = zlib.compress(b"".join(b"\0" + row.tobytes() for row in _pixels((60, 60))))
    png.write_bytes(_png_header(60, 60) + _chunk(b"IDAT", whole[: -4 - cut]) + _chunk(b"IEND", b""))
    with pytest.raises(DataFileError, match=r"mask\.png: map mask is not a whole PNG"):
        store.open(png)


def test_a_stream_in_several_chunks_is_one(store, png):
    pixels = _pixels((60, 60))
    whole = zlib.compress(b"".join(b"\0" + row.tobytes() for row in pixels))
    parts = [_chunk(b"IDAT", whole[start : start + 100]) for start in range(0, len(whole), 100)]
    png.write_bytes(_png_header(60, 60) + b"".join(parts) + _chunk(b"IEND", b""))
    np.testing.assert_array_equal(_whole(store.open(png)), pixels // 255)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (8, 9), (61, 37)])
@pytest.mark.parametrize("depth", [1, 8])
def test_interlaced_masks_are_whole_by_their_passes(png, shape, depth):
    """The sizes of Adam7's passes, from the standard's own drawing of one 8 × 8 block."""
    block = np.array([[int(digit) for digit in row] for row in _ADAM7_BLOCK.split()])
    passes = np.tile(block, (8, 8))[: shape[0], : shape[1]]
    raw = b""
    for number in range(1, 8):
        rows = [row[row == number] for row in passes if (row == number).any()]
        raw += b"".join(bytes(1 + -(-len(row) * depth // 8)) for row in rows)
    header = struct.pack(">IIBBBBB", shape[1], shape[0], depth, 0, 0, 0, 1)
    start, end = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header), _chunk(b"IEND", b"")
    png.write_bytes(start + _chunk(b"IDAT", zlib.compress(raw)) + end)
    assert not np.asarray(read_grey_png(png)).any()
    png.write_bytes(start + _chunk(b"IDAT", zlib.compress(raw[:-1])) + end)
    with pytest.raises(DataFileError, match="pixels end early"):
        read_grey_png(png)


_ADAM7_BLOCK = "16462646 77777777 56565656 77777777 36463646 77777777 56565656 77777777"


def test_an_absent_mask_is_named(store, png):
    png.unlink()
    with pytest.raises(DataFileError, match=r"mask\.png.*No such file"):
        store.open(png)


def test_a_folder_that_cannot_be_written_names_the_option(png, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(OutputError, match="--cache-dir"):
        MaskStore(tmp_path / "file").open(png)


def test_a_full_disk_leaves_nothing_behind_and_names_the_option(store, png, monkeypatch):
    def full(image, header):
        yield b"some"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(maps, "decoded_parts", full)
    with pytest.raises(OutputError, match=r"No space left.*--cache-dir"):
        store.open(png)
    assert {path.name for path in store.cache_dir.iterdir()} <= {"decoding.lock"}


_MEASURE = """
import resource, sys
from pathlib import Path
from ogmkit.geometry.se3 import level_from_global, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.png import read_grey_png
from ogmkit.raster.drivable import drivable_mask

mask = MaskStore(Path(sys.argv[2])).open(Path(sys.argv[1]))
assert mask.shape == (32286, 36871)
for i in range(100):
    pose = pose_matrix([36.0 * i, 32.0 * i, 0], [1, 0, 0, 0.37 * i])
    drivable_mask(GridSpec(), level_from_global(pose), mask)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
def test_the_largest_real_size_decodes_in_bounded_memory(tmp_path):
    columns, rows = 36_871, 32_286
    with (tmp_path / "big.png").open("wb") as file:
        file.write(_png_header(columns, rows))
        stream = zlib.compressobj(1)
        for row in range(rows):
            line = np.where((np.arange(columns) // 700 + row // 256) % 3 == 0, 255, 0)
            file.write(_chunk(b"IDAT", stream.compress(b"\0" + line.astype(np.uint8).tobytes())))
        file.write(_chunk(b"IDAT", stream.flush()) + _chunk(b"IEND", b""))
    peaks_kib = [
        int(
            subprocess.run(
                [sys.executable, "-c", _MEASURE, Path(file.name), tmp_path / "cache"],
                stdout=subprocess.PIPE,
                check=True,
            ).stdout
        )
        for _ in range(2)
    ]
    assert peaks_kib[0] < 2.5e9 / 1024
    assert peaks_kib[1] < 600e6 / 1024
