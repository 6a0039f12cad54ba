"""Masks of other forms than nuScenes' own give what the greyscale PNG gives, or say what is wrong."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from ogmkit.errors import DataFileError
from ogmkit.nuscenes import mask_files
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.mask_files import mask_form


def _mask():
    """Streets and a hole, off centre: (150, 203)."""
    mask = np.zeros((150, 203), np.uint8)
    mask[20:60, 5:] = mask[:, 130:160] = 255
    mask[35:41, 50:57] = 0
    return mask


def _grey():
    return Image.fromarray(_mask())


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png_header(width, height, *, bits, colour):
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header)


def _on_transparent():
    """White where drivable, white and transparent elsewhere, as drawing programs leave it."""
    return Image.fromarray(np.dstack([np.full((*_mask().shape, 3), 255, np.uint8), _mask()]))


def _transparent_palette():
    """White entries, one of them transparent."""
    image = Image.frombytes("P", (203, 150), (_mask() == 0).tobytes())
    image.putpalette([255, 255, 255] * 2)
    image.info["transparency"] = 1
    return image


FORMS = {
    "RGB": ("png", lambda: _grey().convert("RGB"), {}),
    "RGBA": ("png", lambda: _grey().convert("RGBA"), {}),
    "white on transparent": ("png", _on_transparent, {}),
    "grey with alpha": ("png", lambda: _grey().convert("LA"), {}),
    "palette of 256": ("png", lambda: _grey().convert("P"), {}),
    "palette of two": ("png", lambda: _grey().convert("RGB").quantize(2), {"bits": 1}),
    "transparent entry of a palette": ("png", _transparent_palette, {}),
    "JPEG": ("jpg", _grey, {"quality": 85}),
    "JPEG in colour": ("jpg", lambda: _grey().convert("RGB"), {"quality": 75}),
    "JPEG, progressive and coarse": (
        "jpeg",
        lambda: _grey().convert("RGB"),
        {"quality": 50, "progressive": True},
    ),
    "JPEG that is called a PNG": ("png", _grey, {"format": "JPEG"}),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("block_pixels", [None, 1000])
def test_a_mask_of_two_values_reads_as_the_greyscale_one(tmp_path, monkeypatch, form, block_pixels):
    if block_pixels is not None:
        monkeypatch.setattr(mask_files, "_BLOCK_PIXELS", block_pixels)
    ending, make, options = FORMS[form]
    path = tmp_path / f"mask.{ending}"
    make().save(path, **options)
    mask = MaskStore(tmp_path / "cache").open(path)
    assert mask.shape == _mask().shape == mask_form(path)[1]
    np.testing.assert_array_equal(mask.window(0, 150, 0, 203), _mask() // 255)


def test_greyscale_of_two_bits_is_greyscale(tmp_path):
    """As optimisers write it: 3 is white."""
    twos = np.pad(_mask() // 85, ((0, 0), (0, 1))).reshape(150, 51, 4)
    rows = (twos << np.array([6, 4, 2, 0], np.uint8)).sum(axis=2, dtype=np.uint8)
    path = tmp_path / "mask.png"
    stream = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    path.write_bytes(_png_header(203, 150, bits=2, colour=0) + _chunk(b"IDAT", stream) + _chunk(b"IEND", b""))
    assert mask_form(path)[0].kind == "greyscale PNG"
    mask = MaskStore(tmp_path / "cache").open(path)
    np.testing.assert_array_equal(mask.window(0, 150, 0, 203), _mask() // 255)


def _painted(*values):
    """The mask in colours, a pixel of them in another."""
    pixels = np.array(_grey().convert("RGBA" if len(values) == 4 else "RGB"))
    pixels[7, 9] = values
    return Image.fromarray(pixels)


@pytest.mark.parametrize(
    ("image", "shown"),
    [
        (_painted(255, 255, 254), r"\(255, 255, 254, 255\)"),
        (_painted(1, 0, 0), r"\(1, 0, 0, 255\)"),
        (_painted(255, 255, 255, 128), r"\(255, 255, 255, 128\)"),
    ],
)
def test_a_third_colour_is_named_with_its_place(tmp_path, image, shown):
    path = tmp_path / "mask.png"
    image.save(path)
    with pytest.raises(
        DataFileError,
        match=rf"mask\.png: map mask holds other colours than black and white, such as {shown} in row 7, "
        r"column 9; convert it to an 8-bit greyscale PNG, or extract with --no-map",
    ):
        MaskStore(tmp_path / "cache").open(path)
    assert not list((tmp_path / "cache").glob("*.mask"))


def test_a_photo_is_no_mask(tmp_path):
    path = tmp_path / "mask.jpg"
    Image.fromarray(np.tile(np.arange(0, 256, 2, np.uint8), (40, 1))).save(path)
    with pytest.raises(DataFileError, match="is a JPEG with 50% of its pixels between black and white"):
        MaskStore(tmp_path / "cache").open(path)


def _huge_png():
    return _png_header(30_000, 20_000, bits=8, colour=2) + _chunk(b"IEND", b"")


def _huge_jpeg():
    """A small one that says it is large."""
    data = io.BytesIO()
    _grey().save(data, "JPEG")
    return data.getvalue().replace(struct.pack(">HH", 150, 203), struct.pack(">HH", 20_000, 30_000), 1)


@pytest.mark.parametrize(("kind", "make"), [("colour PNG", _huge_png), ("JPEG", _huge_jpeg)])
def test_what_would_take_too_much_memory_is_refused_by_its_header(tmp_path, kind, make):
    path = tmp_path / "mask.png"
    path.write_bytes(make())
    with pytest.raises(
        DataFileError, match=rf"is a {kind} of 30000 × 20000 pixels, over 2\^29 .*; convert it to an 8"
    ):
        MaskStore(tmp_path / "cache").open(path)


@pytest.mark.parametrize("there", [True, False])
def test_a_vector_map_is_called_one(tmp_path, there):
    path = tmp_path / "boston-seaport.json"
    if there:
        path.write_text('{"version": "1.3"}')
    with pytest.raises(
        DataFileError,
        match=r"boston-seaport\.json: is a vector map of .*; ogmkit needs the mask PNG, or --no-map",
    ):
        MaskStore(tmp_path / "cache").open(path)


def test_a_pointer_of_git_lfs_is_called_one(tmp_path):
    path = tmp_path / "mask.png"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n")
    with pytest.raises(DataFileError, match=r"mask\.png: map mask is a git-LFS pointer; run git lfs pull"):
        MaskStore(tmp_path / "cache").open(path)
