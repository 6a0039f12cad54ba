"""PNG files: what goes in comes out, and what can't be written is said."""

import cv2
import numpy as np
import pytest

from ogmkit.drawing.png import write_png
from ogmkit.errors import OutputError


def test_pixels_come_back_in_their_order(tmp_path):
    pixels = np.arange(2 * 5 * 3, dtype=np.uint8).reshape(2, 5, 3)
    path = tmp_path / "picture.png"
    path.write_text("what was there before")
    write_png(path, pixels)

    np.testing.assert_array_equal(cv2.imread(str(path))[..., ::-1], pixels)
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OutputError, match="absent"):
        write_png(tmp_path / "absent" / "picture.png", np.zeros((1, 1, 3), np.uint8))
