from pathlib import Path

import pytest

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.categories import OFFICIAL, box_class, require_known, require_known_parts


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


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("car", {"vehicle.car"}),
        ("bus", {"vehicle.bus.bendy", "vehicle.bus.rigid"}),
        ("bicycle", {"vehicle.bicycle"}),  # no rack
        ("construction", {"vehicle.construction"}),  # no worker
        ("emergency.police", {"vehicle.emergency.police"}),
        ("two=bicycle+vehicle.motorcycle", {"vehicle.bicycle", "vehicle.motorcycle"}),
        ("buses=vehicle.bus.", {"vehicle.bus.bendy", "vehicle.bus.rigid"}),
        ("vehicle.truck", {"vehicle.truck"}),
    ],
)
def test_classes_are_whole_parts_of_names(text, shown):
    found = box_class(text)
    assert found.name == text.partition("=")[0]
    assert {name for name in OFFICIAL if found.shows(name)} == shown
    require_known_parts((text,), (), Path("root"))


@pytest.mark.parametrize("text", ["", "=car", "a=", "a=+b", "a b=car", "../a=car", ".=car"])
def test_other_texts_are_no_class(text):
    with pytest.raises(SettingsError, match="is neither NAME, such as car, nor NAME=PART"):
        box_class(text)


def test_a_part_that_no_category_has_is_named():
    with pytest.raises(SettingsError, match=r"root: unknown category 'crane'"):
        require_known_parts(("car", "heavy=truck+crane"), ("vehicle.car",), Path("root"))
    require_known_parts(("crane",), ("vehicle.crane",), Path("root"))
