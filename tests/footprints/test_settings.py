import math

import pytest

from ogmkit.errors import SettingsError
from ogmkit.footprints.settings import FootprintSettings


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        (FootprintSettings(), "surface"),
        (FootprintSettings("network-a"), "network-a"),
        (FootprintSettings(method="project"), "surface-project"),
        (FootprintSettings("calibration", "project"), "calibration-project"),
        (FootprintSettings(method="full-body"), "full-body"),
        (FootprintSettings(method="full-body", name="mine"), "mine"),
    ],
)
def test_names_of_sets(settings, name):
    assert settings.set_name == name


@pytest.mark.parametrize(
    ("scale", "size"), [(2, (450, 800)), (1, (900, 1600)), (3, (300, 533)), (900, (1, 2))]
)
def test_mask_sizes(scale, size):
    assert FootprintSettings(scale=scale).mask_size((900, 1600)) == size


@pytest.mark.parametrize("scale", [0, -2, math.nan, math.inf])
def test_a_scale_that_is_no_positive_number_is_refused(scale):
    with pytest.raises(SettingsError, match=r"scale: .* is not (above 0|finite)"):
        FootprintSettings(scale=scale)


def test_masks_of_nothing_and_of_too_much_are_refused():
    with pytest.raises(SettingsError, match="scale: 2000 leaves nothing of 900 × 1600 pixels"):
        FootprintSettings(scale=2000).mask_size((900, 1600))
    with pytest.raises(SettingsError, match="90000 × 160000"):
        FootprintSettings(scale=0.01).mask_size((900, 1600))


def test_an_unknown_method_is_refused():
    with pytest.raises(SettingsError, match=r"unknown method 'wrap'; .* warp"):
        FootprintSettings(method="wrap")
