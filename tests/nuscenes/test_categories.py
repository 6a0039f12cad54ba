from pathlib import Path

import pytest

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.categories import OFFICIAL, require_known


def test_there_are_23_official_categories():
    assert len(set(OFFICIAL)) == 23


@pytest.mark.parametrize("wanted", [("vehicle.",), ("vehicle.car", "human."), ("movable",), ("own.thing",)])
def test_names_and_their_beginnings_are_known(wanted):
    require_known(wanted, ("own.thing.small",), Path("root"))


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (("vehicle.", "vehicle.cra"), r"unknown category 'vehicle\.cra'; did you mean vehicle\.car"),
        (("",), "unknown category ''"),
        ((), "no category chosen"),
    ],
)
def test_others_are_not(wanted, words):
    with pytest.raises(SettingsError, match=words):
        require_known(wanted, (), Path("root"))
