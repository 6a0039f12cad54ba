"""Definitions as records: named, frozen, and compared field by field."""

import json
from dataclasses import FrozenInstanceError, replace

import pytest

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.labels.catalogue import PRESETS, definition, paper
from ogmkit.labels.definition import differing_fields, without_map
from ogmkit.labels.names import NAMES
from ogmkit.target_settings import TargetSettings

LSS = PRESETS["lss"]


def test_names():
    assert set(NAMES) == {"paper", "surround", *PRESETS}
    assert [definition(name).name for name in NAMES] == list(NAMES)
    with pytest.raises(SettingsError, match="unknown definition 'lsss'; did you mean lss"):
        definition("lsss")
    with pytest.raises(FrozenInstanceError):
        LSS.version = 2


@pytest.mark.parametrize("name", NAMES)
def test_a_record_is_plain_json(name):
    values = definition(name).to_dict()
    assert json.loads(json.dumps(values)) == values
    assert not differing_fields(values, definition(name).to_dict())


def test_a_field_that_differs_is_named_with_both_values():
    changed = replace(LSS, filters=replace(LSS.filters, min_visibility=2))
    assert differing_fields(LSS.to_dict(), changed.to_dict()) == (
        "filters.min_visibility is 0 here but 2 there",
    )
    other = replace(LSS, classes=(replace(LSS.classes[0], categories="^vehicle.car"),))
    (line,) = differing_fields(LSS.to_dict(), other.to_dict())
    assert line.startswith("classes.vehicle.categories is ")


def test_classes_by_category():
    cvt, pon = PRESETS["cvt"], PRESETS["pon"]
    found = {
        category: (LSS.class_of(category), cvt.class_of(category), pon.class_of(category))
        for category in (
            "vehicle.emergency.police",
            "vehicle.bus.bendy",
            "vehicle.construction",
            "human.pedestrian.construction_worker",
            "static_object.bicycle_rack",
            "human.pedestrian.stroller",
            "movable_object.trafficcone",
        )
    }
    assert list(found.values()) == [
        ("vehicle", None, None),
        ("vehicle", "bus", "bus"),
        ("vehicle", "construction", "construction_vehicle"),
        (None, "pedestrian", "pedestrian"),
        (None, None, None),
        (None, "pedestrian", None),
        (None, None, "traffic_cone"),
    ]
    assert PRESETS["stp3"].class_of("human.pedestrian.stroller") == "pedestrian"


def test_without_a_map_classes_of_it_are_gone_and_what_unites_them():
    names = without_map(PRESETS["cvt"]).class_names
    assert "vehicle" in names
    assert not {"lane", "road_segment", "road", "lane_divider"} & set(names)
    assert without_map(LSS) == LSS


def test_the_papers_follows_the_extractions_settings():
    targets = TargetSettings(GridSpec(0.5, 80, 60, 80.0, 34.0), ("vehicle.car",), min_visibility=3)
    found = paper(targets)
    assert found.grid.rows.first_m == pytest.approx(39.75)
    assert found.grid.columns.first_m == pytest.approx(16.75)
    assert found.class_of("vehicle.car") == "vehicles"
    assert found.class_of("vehicle.truck") is None
    assert differing_fields(paper(TargetSettings()).to_dict(), found.to_dict())
