import json

import pytest

from ogmkit.base.differences import differences
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings


def test_settings_survive_json():
    settings = ExtractSettings(
        TargetSettings(
            GridSpec(0.25, 7, 5, 3.5, 2.0), ("vehicle.car", "animal"), 2, 3, 0.1, 1.5, "none", True
        ),
        ("CAM_BACK", "CAM_FRONT"),
        "lzf",
    )
    assert ExtractSettings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings


def test_settings_of_half_a_second_are_stored_as_before_steps_could_be_set():
    values = ExtractSettings().to_dict()

    assert values["max_gap_s"] == 0.75
    assert "step_s" not in values
    assert ExtractSettings.from_dict(values) == ExtractSettings()


def test_a_number_of_lidar_points_is_stored_where_it_is_asked_for():
    asked = ExtractSettings(TargetSettings(min_lidar_points=1))

    assert "min_lidar_points" not in ExtractSettings().to_dict()
    assert asked.to_dict() == ExtractSettings().to_dict() | {"min_lidar_points": 1}
    assert ExtractSettings.from_dict(json.loads(json.dumps(asked.to_dict()))) == asked


@pytest.mark.parametrize("step_s", [0.1, 0.2, 1.0])
def test_another_step_is_stored_with_its_own_gap(step_s):
    settings = ExtractSettings(TargetSettings(step_s=step_s))
    values = json.loads(json.dumps(settings.to_dict()))

    assert (values["step_s"], values["max_gap_s"]) == (step_s, 1.5 * step_s)
    assert ExtractSettings.from_dict(values) == settings


@pytest.mark.parametrize(
    ("cameras", "compression", "message"),
    [
        ((), "gzip", "cameras: none"),
        (("CAM_FRONT", "CAM_FRONT"), "gzip", "each once"),
        (("CAM_FRONT",), "zip", "unknown compression 'zip'; .* gzip"),
    ],
)
def test_impossible_settings_are_refused(cameras, compression, message):
    with pytest.raises(SettingsError, match=message):
        ExtractSettings(TargetSettings(), cameras, compression)


@pytest.mark.parametrize("damage", [{"grid": {"rows": 1}}, {"min_visibility": 9}, {"new": 1}, {"cameras": 3}])
def test_damaged_settings_are_refused(damage):
    values = ExtractSettings().to_dict() | damage
    if damage == {"grid": {"rows": 1}}:
        values["grid"] = {"rows": -1}
    with pytest.raises(SettingsError):
        ExtractSettings.from_dict(values)


def test_differences_are_named_with_both_values():
    here = ExtractSettings(TargetSettings(GridSpec(rows=800)), ("CAM_FRONT", "CAM_BACK")).to_dict()
    there = ExtractSettings().to_dict()
    assert differences(here, there) == (
        "cameras is CAM_BACK,CAM_FRONT here but CAM_FRONT there",
        "grid.rows is 800 here but 1000 there",
    )
    assert differences(here, here) == ()


def test_the_order_of_cameras_makes_no_difference():
    one, other = (ExtractSettings(cameras=names).to_dict() for names in (("A", "B"), ("B", "A")))
    assert differences(one, other) == ()
