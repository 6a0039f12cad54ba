import numpy as np
import pytest

from ogmkit.shards import schema
from ogmkit.shards.fields import parts_of
from ogmkit.shards.reference import schema_markdown
from ogmkit.target_settings import TargetSettings

# design.md §5: the names that users and checks rely on.
PROMISED = {
    "sample_token sample_data_token timestamp_us drivable vehicles field_of_view image image_path image_size",
    "intrinsics ego_from_camera global_from_ego level_from_global trajectory/past trajectory/future",
    "trajectory/past_valid trajectory/future_valid trajectory/valid boxes/annotation_token",
    "boxes/instance_token boxes/category boxes/global_from_box boxes/size_wlh boxes/visibility",
    "boxes/num_lidar_pts boxes/offsets lidar/points lidar/offsets",
}


def test_the_promised_names_are_there():
    assert {field.name for field in schema.FIELDS} >= set(" ".join(PROMISED).split())


ADDED = {
    "homography": "bev_from_image valid reason rms_px num_points plane left_out_error_m left_out_refused",
    "footprints": "drivable vehicles valid",
}


def test_the_promised_names_of_added_groups_are_there():
    assert {kind.name for kind in schema.ADDED} == ADDED.keys()
    for kind in schema.ADDED:
        assert {field.name for field in kind.fields} >= set(ADDED[kind.name].split())
        assert {"method", "settings"} <= {attribute.name for attribute in kind.attributes}


@pytest.mark.parametrize(
    "fields", [schema.FIELDS, schema.LEFT_OUT_FIELDS, *(kind.fields for kind in schema.ADDED)]
)
def test_names_are_unique_and_described(fields):
    names = [field.name for field in fields]
    assert len(set(names)) == len(names)
    assert all(field.description for field in fields)


SEEN = {"seen/rays", "seen/lidar", "seen/lidar_centre_level"}


@pytest.mark.parametrize(
    ("settings", "absent"),
    [
        ({"lidar": True, "seen": ("rays", "lidar")}, set()),
        ({"lidar": True}, SEEN),
        ({"lidar": True, "images": "reference"}, {"image"} | SEEN),
        ({"seen": ("lidar",)}, {"lidar/points", "lidar/offsets", "seen/rays"}),
        ({"lidar": True, "no_map": True}, {"drivable"} | SEEN),
    ],
)
@pytest.mark.parametrize("left_out", [True, False])
def test_parts_by_settings_and_frames_that_are_left_out(settings, absent, left_out):
    whole = {field.name for field in schema.FIELDS}
    if left_out:
        whole |= {"left_out/sample_data_token", "left_out/timestamp_us", "left_out/reason"}
    parts = parts_of(TargetSettings(**settings), left_out=left_out)
    assert {field.name for field in schema.fields(parts)} == whole - absent


def test_shapes_resolve():
    field = next(field for field in schema.FIELDS if field.name == "drivable")
    assert field.resolved({"N": 3, "rows": 4, "columns": 5}) == (3, 4, 5)
    assert field.h5_dtype == np.uint8


def test_the_markdown_names_every_dataset_and_attribute():
    text = schema_markdown()
    for field in (
        *schema.FIELDS,
        *schema.LEFT_OUT_FIELDS,
        *(field for kind in schema.ADDED for field in kind.fields),
    ):
        assert f"| `{field.name}` | {field.dtype} |" in text
    added = [attribute for kind in schema.ADDED for attribute in kind.attributes]
    for attribute in (*schema.FILE_ATTRIBUTES, *schema.CAMERA_ATTRIBUTES, *added):
        assert f"| `{attribute.name}` |" in text
    columns = {line.count("|") for line in text.splitlines() if line}
    assert columns == {5, 7}
