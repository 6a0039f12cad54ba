import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.base.images import image_size, jpeg_size


def _jpeg(height=24, width=40, *options):
    picture = np.random.default_rng(0).integers(0, 255, (height, width, 3), dtype=np.uint8)
    return cv2.imencode(".jpg", picture, options)[1].tobytes()


@pytest.mark.parametrize(
    "options", [(), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 1)]
)
def test_size_is_height_and_width(options):
    assert jpeg_size(_jpeg(24, 40, *options)) == (24, 40)


def test_an_embedded_thumbnail_does_not_count():
    jpeg, thumbnail = _jpeg(24, 40), _jpeg(8, 8)
    segment = b"\xff\xe1" + (2 + len(thumbnail)).to_bytes(2, "big") + thumbnail
    assert jpeg_size(jpeg[:2] + segment + jpeg[2:]) == (24, 40)
    with pytest.raises(ValueError, match="cut short"):
        jpeg_size(jpeg[:2] + segment)


def test_huffman_tables_before_the_frame_header_are_not_taken_for_it():
    jpeg = _jpeg(24, 40)
    start = jpeg.index(b"\xff\xc4")
    tables = jpeg[start : start + 2 + int.from_bytes(jpeg[start + 2 : start + 4], "big")]
    assert jpeg_size(jpeg[:2] + tables + jpeg[2:]) == (24, 40)


def test_fill_bytes_before_a_marker_and_padding_at_the_end_are_allowed():
    jpeg = _jpeg(24, 40)
    assert jpeg_size(jpeg[:2] + b"\xff\xff" + jpeg[2:] + bytes(100)) == (24, 40)


def test_every_beginning_of_a_jpeg_is_refused():
    jpeg = _jpeg(16, 16)
    for length in range(len(jpeg)):
        with pytest.raises(ValueError, match=r"empty|not a JPEG|cut short"):
            jpeg_size(jpeg[:length])
        with pytest.raises(ValueError, match=r"empty|not a JPEG|cut short|damaged"):
            jpeg_size(jpeg[:length] + bytes(len(jpeg) - length))


@pytest.mark.parametrize("data", [b"<html>404</html>", b"\x89PNG\r\n\x1a\n" + bytes(50), b"\0" * 50])
def test_other_formats_are_no_jpeg(data):
    with pytest.raises(ValueError, match="not a JPEG"):
        jpeg_size(data)


@given(st.binary(max_size=60))
def test_arbitrary_bytes_give_a_value_error_or_a_size(data):
    try:
        height, width = jpeg_size(b"\xff\xd8" + data)
    except ValueError:
        return
    assert 0 <= height < 1 << 16
    assert 0 <= width < 1 << 16


def test_a_png_is_known_by_its_header_and_its_end():
    png = cv2.imencode(".png", np.zeros((24, 40, 3), np.uint8))[1].tobytes()

    assert image_size(png) == (24, 40)
    assert image_size(_jpeg(24, 40)) == (24, 40)
    for length in (8, 20, len(png) - 1):
        with pytest.raises(ValueError, match="cut short"):
            image_size(png[:length])


def test_a_pointer_of_git_lfs_says_how_to_get_the_file():
    with pytest.raises(ValueError, match="git-LFS pointer: run git lfs pull"):
        image_size(b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n")
