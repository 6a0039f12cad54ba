"""`check` takes and refuses the map masks that `extract` takes and refuses."""

import numpy as np
import pytest
from PIL import Image

from ogmkit.nuscenes.check import check_dataset


def _of_masks(root):
    return [finding for finding in check_dataset(root) if finding.rule == "R705"]


@pytest.mark.parametrize(
    ("mode", "ending"),
    [("L", "png"), ("1", "png"), ("RGB", "png"), ("RGBA", "png"), ("P", "png"), ("L", "jpg")],
)
def test_masks_of_two_values_are_sound(small_root, damage, mode, ending):
    damage("map", "map-1", filename=f"maps/1.{ending}")
    picture = Image.fromarray(np.repeat(np.array([[0], [255]], np.uint8), 200, 0).repeat(500, 1))
    picture.convert(mode).save(small_root / f"maps/1.{ending}")
    assert _of_masks(small_root) == []


@pytest.mark.parametrize("there", [True, False])
def test_a_vector_map_is_called_one(small_root, damage, there):
    damage("map", "map-1", filename="maps/expansion/boston-seaport.json")
    if there:
        (small_root / "maps/expansion").mkdir()
        (small_root / "maps/expansion/boston-seaport.json").write_text("{}")
    (finding,) = _of_masks(small_root)
    (example,) = finding.examples
    assert example == (
        "maps/expansion/boston-seaport.json: is a vector map of the map expansion; ogmkit needs the mask "
        "PNG, or --no-map"
    )
    assert finding.severity == "error"
    assert "--no-map" in finding.remedy


def test_what_can_t_be_read_as_a_mask_is_named_without_its_path_twice(small_root):
    Image.fromarray(np.zeros((40, 50), np.uint16)).save(small_root / "maps/1.png")
    (finding,) = _of_masks(small_root)
    assert finding.examples[0].startswith("maps/1.png: map mask is a greyscale PNG of 16 bits; convert it")
