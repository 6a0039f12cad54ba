"""Names that are chosen by themselves or by patterns."""

from pathlib import Path

import pytest

from ogmkit.base.names import matching
from ogmkit.errors import SettingsError

SCENES = ("scene-0061", "scene-0103", "scene-0553", "odd[1]")
PLACE = Path("folder")


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [
        ((), SCENES),
        (("scene-0553", "scene-0061", "scene-0553"), ("scene-0061", "scene-0553")),
        (("scene-0*",), SCENES[:3]),
        (("scene-00*", "scene-0?03"), SCENES[:2]),
        (("*[13]",), SCENES[:3]),
        (("odd[1]",), ("odd[1]",)),
    ],
)
def test_names_come_in_the_order_known(wanted, expected):
    assert matching("scene", wanted, SCENES, PLACE) == expected


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ("scene-61", "folder: unknown scene 'scene-61'; did you mean scene-0061 or"),
        ("scene-09*", "folder: no scene matches 'scene-09*'; did you mean scene-"),
        ("Scene-00*", "folder: no scene matches 'Scene-00*'; did you mean scene-0"),
        ("sc", "folder: unknown scene 'sc'; did you mean scene-0061 or scene-0103 or scene-0553?"),
        ("*.h5", "folder: no scene matches '*.h5'; there are: scene-0061, scene-0103, scene-0553, odd[1]"),
    ],
)
def test_what_means_none_is_named(wanted, message):
    with pytest.raises(SettingsError) as caught:
        matching("scene", ["scene-0061", wanted], SCENES, PLACE)
    assert str(caught.value).startswith(message)
