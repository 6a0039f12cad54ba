"""Every kind of damage: raised for the scene that uses the record, by name, and for no other."""

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.uses import Use

NAN = float("nan")

# what: (table, record, values (None deletes the key), rule, words of the message)
DAMAGE = {
    "timestamp missing": ("sample", "sample-1-2", {"timestamp": None}, "R201", "timestamp missing"),
    "timestamp is text": ("sample", "sample-1-2", {"timestamp": "noon"}, "R201", "wrong type"),
    "token is a number": ("sample_data", "samples-1-2-CAM_FRONT", {"ego_pose_token": 7}, "R203", "'7'"),
    "rotation is text": ("ego_pose", "pose-samples-1-2-CAM_FRONT", {"rotation": "north"}, "R201", "rotation"),
    "rotation too short": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"rotation": [1, 0, 0]},
        "R201",
        "rotation",
    ),
    "translation holds null": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"translation": [1, None, 0]},
        "R302",
        "translation",
    ),
    "size is an object": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"size": {"w": 1}},
        "R201",
        "size",
    ),
    "key-frame flag is text": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"is_key_frame": "perhaps"},
        "R201",
        "is_key_frame",
    ),
    "filename missing": ("sample_data", "samples-1-2-CAM_FRONT", {"filename": None}, "R201", "filename"),
    "location is a list": ("log", "log-1", {"location": ["boston-seaport"]}, "R201", "location"),
    "mask name is a number": ("map", "map-1", {"filename": 5}, "R201", "filename"),
    "dangling log": ("scene", "scene-1", {"log_token": "gone"}, "R203", "'gone' is not in log.json"),
    "dangling first sample": (
        "scene",
        "scene-1",
        {"first_sample_token": "gone"},
        "R203",
        "first_sample_token",
    ),
    "dangling pose": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"ego_pose_token": "gone"},
        "R203",
        "ego_pose.json",
    ),
    "dangling calibration": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"calibrated_sensor_token": "gone"},
        "R203",
        "calibrated_sensor.json",
    ),
    "dangling sensor": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"sensor_token": "gone"},
        "R203",
        "sensor",
    ),
    "dangling instance": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"instance_token": "gone"},
        "R203",
        "instance.json",
    ),
    "dangling category": (
        "instance",
        "instance-1-vehicle.car",
        {"category_token": "gone"},
        "R203",
        "category.json",
    ),
    "dangling next": ("sample", "sample-1-2", {"next": "gone"}, "R203", "next 'gone'"),
    "pose rotation NaN": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"rotation": [NAN, 0, 0, 0]},
        "R301",
        "nan",
    ),
    "pose rotation not unit": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"rotation": [1, 0, 0, 0.1]},
        "R301",
        "",
    ),
    "pose rotation zero": ("ego_pose", "pose-samples-1-2-CAM_FRONT", {"rotation": [0, 0, 0, 0]}, "R301", ""),
    "calibration rotation not unit": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"rotation": [2, 0, 0, 0]},
        "R301",
        "not a unit quaternion",
    ),
    "box rotation NaN": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"rotation": [1, NAN, 0, 0]},
        "R301",
        "not a unit quaternion",
    ),
    "translation infinite": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"translation": [float("inf"), 0, 0]},
        "R302",
        "finite",
    ),
    "box translation NaN": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"translation": [0, NAN, 0]},
        "R302",
        "finite",
    ),
    "pose beyond all maps": (
        "ego_pose",
        "pose-samples-1-2-CAM_FRONT",
        {"translation": [1e308, 0, 0]},
        "R302",
        "within 1e+08 m",
    ),
    "box size immense": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"size": [1, 1e308, 1]},
        "R303",
        "up to 10000 m",
    ),
    "box size zero": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"size": [1, 0, 1]},
        "R303",
        "positive",
    ),
    "box size negative": (
        "sample_annotation",
        "annotation-1-2-vehicle.car",
        {"size": [-1, 2, 1]},
        "R303",
        "",
    ),
    "box size NaN": ("sample_annotation", "annotation-1-2-vehicle.car", {"size": [1, 2, NAN]}, "R303", ""),
    "intrinsics singular": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"camera_intrinsic": [[20, 0, 15], [20, 0, 15], [0, 0, 1]]},
        "R305",
        "invertible",
    ),
    "intrinsics with a fourth column": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"camera_intrinsic": [[20, 0, 15, 0], [0, 20, 15, 0], [0, 0, 1, 0]]},
        "R305",
        "not an invertible 3×3",
    ),
    "intrinsics empty": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"camera_intrinsic": []},
        "R305",
        "",
    ),
    "intrinsics NaN": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"camera_intrinsic": [[NAN, 0, 15], [0, 20, 15], [0, 0, 1]]},
        "R305",
        "",
    ),
    "intrinsics scaled": (
        "calibrated_sensor",
        "calibration-1-CAM_FRONT",
        {"camera_intrinsic": [[20, 0, 15], [0, 20, 15], [0, 0, 2]]},
        "R305",
        "last row",
    ),
    "image without size": ("sample_data", "samples-1-2-CAM_FRONT", {"width": 0}, "R306", "0 × 18"),
    "image immense": ("sample_data", "samples-1-2-CAM_FRONT", {"height": 10**9}, "R306", "pixels a side"),
    "camera without width": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"width": None},
        "R306",
        "null",
    ),
    "timestamp in seconds": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"timestamp": 1_532_402_927},
        "R308",
        "1532402927 is in seconds by its size",
    ),
    "timestamp in seconds with decimals": (
        "sample",
        "sample-1-2",
        {"timestamp": 1_532_402_927.65},
        "R308",
        "in seconds",
    ),
    "timestamp in milliseconds": (
        "sample",
        "sample-1-2",
        {"timestamp": 1_532_402_927_647},
        "R308",
        "in milliseconds",
    ),
    "timestamp in nanoseconds": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"timestamp": 1_532_402_927_647_951_000},
        "R308",
        "in nanoseconds by its size, not in microseconds",
    ),
    "timestamp negative": ("sample_data", "samples-1-2-CAM_FRONT", {"timestamp": -5}, "R307", "-5"),
    "next skips": ("sample", "sample-1-2", {"next": "sample-1-4"}, "R401", "leads back"),
    "next into another scene": ("sample", "sample-1-7", {"next": "sample-2-0"}, "R401", "sample-2-0"),
    "next to itself": ("sample", "sample-1-2", {"next": "sample-1-2"}, "R401", ""),
    "chain closed to a ring": ("sample", "sample-1-7", {"next": "sample-1-0"}, "R401", ""),
    "first sample inside the chain": (
        "scene",
        "scene-1",
        {"first_sample_token": "sample-1-1"},
        "R401",
        "first_",
    ),
    "last sample inside the chain": (
        "scene",
        "scene-1",
        {"last_sample_token": "sample-1-1"},
        "R401",
        "last_",
    ),
    "key frames miscounted": ("scene", "scene-1", {"nbr_samples": 9}, "R401", "8 key frames"),
    "camera lacking": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"is_key_frame": False},
        "R402",
        "no key-frame data",
    ),
    "camera twice": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"sample_token": "sample-1-3"},
        "R402",
        "CAM_FRONT",
    ),
    "time of key frames backwards": ("sample", "sample-1-2", {"timestamp": 1}, "R403", "does not follow"),
    "time of images backwards": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"timestamp": 1},
        "R403",
        "CAM_FRONT does not follow",
    ),
    "file name absolute": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"filename": "/etc/passwd"},
        "R501",
        "inside",
    ),
    "file name climbs": ("sample_data", "samples-1-2-CAM_FRONT", {"filename": "a/../../b"}, "R501", "inside"),
    "file name with backslash": (
        "sample_data",
        "samples-1-2-CAM_FRONT",
        {"filename": "..\\b"},
        "R501",
        "inside",
    ),
    "file name with NUL": ("sample_data", "samples-1-2-CAM_FRONT", {"filename": "a\0b"}, "R501", "inside"),
    "file name empty": ("sample_data", "samples-1-2-CAM_FRONT", {"filename": ""}, "R501", "inside"),
    "mask name climbs": ("map", "map-1", {"filename": "../mask.png"}, "R501", "inside"),
    "no map": ("map", "map-1", {"log_tokens": ["log-3"]}, "R503", "0 records"),
    "two maps": ("map", "map-2", {"log_tokens": ["log-1", "log-2"]}, "R503", "2 records"),
}


@pytest.mark.sampled(16)
@pytest.mark.parametrize("damaged", DAMAGE.values(), ids=DAMAGE)
def test_damage_is_named_where_it_is_used(small_root, damage, damaged):
    table, token, values, rule, words = damaged
    path = damage(table, token, **values)

    with Dataset(small_root) as dataset:
        with pytest.raises(TableError) as caught:
            dataset.scene("scene-0001", ["CAM_FRONT"])
        other = dataset.scene("scene-0002", ["CAM_FRONT"])

    message = str(caught.value)
    assert f"[{rule}, scene-0001]; " in message
    assert words in message
    assert "\n" not in message
    if rule not in ("R402", "R503"):  # these blame the key frame or scene that lacks something
        assert message.startswith(f"{path}: record ")
    assert len(other.cameras["CAM_FRONT"]) == 3


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\\b", "CAM\n", "CAM ", ".hidden", "C" * 201])
def test_a_channel_that_can_t_be_a_file_name_is_refused_for_whom_it_is_used(small_root, damage, name):
    path = damage("sensor", "sensor-CAM_FRONT", channel=name)

    assert f"{path}: record " in (message := _message(small_root, (name,)))
    assert "cannot be a file name [R504, scene-0001]; " in message
    assert "\n" not in message
    found = check_dataset(small_root, use=Use((name,)))
    (finding,) = (one for one in found if one.rule == "R504")
    assert (finding.severity, finding.count) == ("error", 1)
    with Dataset(small_root) as dataset:
        assert dataset.scene("scene-0001", ["CAM_BACK"]).cameras["CAM_BACK"]


def _message(root, cameras=("CAM_FRONT",), scene="scene-0001", **options):
    with Dataset(root) as dataset, pytest.raises(TableError) as caught:
        dataset.scene(scene, cameras, **options)
    return str(caught.value)


def _edit(records, token, **values):
    (record,) = (record for record in records if record["token"] == token)
    record.update(values)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("table", "token"),
    [
        ("scene", "scene-1"),
        ("log", "log-1"),
        ("map", "map-1"),
        ("sample", "sample-1-2"),
        ("sample_data", "samples-1-2-CAM_FRONT"),
        ("ego_pose", "pose-samples-1-2-CAM_FRONT"),
        ("calibrated_sensor", "calibration-1-CAM_FRONT"),
        ("sensor", "sensor-CAM_FRONT"),
        ("sample_annotation", "annotation-1-2-vehicle.car"),
        ("instance", "instance-1-vehicle.car"),
        ("category", "category-vehicle.car"),
    ],
)
def test_a_token_that_stands_twice(small_root, edit_table, table, token):
    def repeat(records):
        records.append(next(record for record in records if record["token"] == token))

    path = edit_table(small_root, table, repeat)

    assert _message(small_root).startswith(f"{path}: record {token}: token stands in several records [R202")


@pytest.mark.parametrize(
    "table", ["sample", "sample_data", "ego_pose", "sample_annotation", "calibrated_sensor"]
)
def test_a_column_that_no_record_has(small_root, edit_table, table):
    def strip(records):
        for record in records:
            del record["translation" if "translation" in record else "timestamp"]

    path = edit_table(small_root, table, strip)

    message = _message(small_root)
    assert message.startswith(f"{path}: record ")
    assert "missing or of the wrong type: " in message
    assert " is absent or null, not " in message
    assert "[R201" in message


@pytest.mark.parametrize(
    ("table", "token", "values", "words"),
    [
        (
            "ego_pose",
            "pose-samples-1-2-CAM_FRONT",
            {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
            "rotation is a 3×3 matrix, not 4 numbers, a quaternion w, x, y, z",
        ),
        (
            "calibrated_sensor",
            "calibration-1-CAM_FRONT",
            {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1]},
            "rotation is 9 numbers, not 4 numbers, a quaternion w, x, y, z",
        ),
        ("sample", "sample-1-2", {"timestamp": "noon"}, 'timestamp is "noon", not a whole number'),
    ],
)
def test_what_was_found_instead_of_a_value_is_told(small_root, damage, table, token, values, words):
    damage(table, token, **values)

    message = _message(small_root)

    assert f"{token}: {next(iter(values))} missing or of the wrong type: {words} [R201" in message
    assert "\n" not in message


def test_a_null_link_is_told_from_an_empty_one(small_root, edit_table):
    edit_table(small_root, "sample", lambda records: records[0].update(prev=None))

    message = _message(small_root)
    assert 'prev is absent or null, not text, "" for none [R201, scene-0001]; ' in message
    assert "ogmkit check --fix" in message


def test_a_lidar_of_another_name(small_root, edit_table):
    def rename(records):
        for record in records:
            if record["channel"] == "LIDAR_TOP":
                record["channel"] = "LIDAR_CONCAT"

    edit_table(small_root, "sensor", rename)

    with Dataset(small_root) as dataset:
        frames = dataset.scene("scene-0001", ["CAM_FRONT"], lidar="LIDAR_CONCAT").cameras["CAM_FRONT"]
        assert all(frame.lidar.path.startswith("samples/LIDAR_TOP/1-") for frame in frames)
        with pytest.raises(SettingsError, match=r"'LIDAR_TOP'.*LIDAR_CONCAT.*--lidar-channel"):
            dataset.scene("scene-0001", ["CAM_FRONT"], lidar="LIDAR_TOP")


def test_an_annotation_without_a_sample_is_not_lost_silently(small_root, damage):
    path = damage("sample_annotation", "annotation-1-2-vehicle.car", sample_token=None)

    found = "sample_token missing or of the wrong type: sample_token is absent or null, not text"
    assert _message(small_root).startswith(f"{path}: record annotation-1-2-vehicle.car: {found} [R201")
    assert {finding.severity for finding in check_dataset(small_root)} == {"error"}


@pytest.mark.parametrize("value", [None, "of-another-version", {"token": "sample-1-2"}])
def test_annotations_that_all_lack_their_samples_are_not_lost_silently(small_root, edit_table, value):
    def strip(records):
        for record in records:
            record["sample_token"] = value

    path = edit_table(small_root, "sample_annotation", strip)

    message = _message(small_root)
    assert message.startswith(f"{path}: record number 1: sample_token leads to no key frame")
    assert ("R203", "error") in {(finding.rule, finding.severity) for finding in check_dataset(small_root)}


def test_a_sensor_without_a_channel_is_no_camera_to_choose(small_root, damage):
    damage("sensor", "sensor-CAM_FRONT", channel=None)

    with Dataset(small_root) as dataset:
        assert dataset.channels() == ("CAM_BACK",)
        with pytest.raises(SettingsError, match="unknown camera 'CAM_FRONT'"):
            dataset.scene("scene-0001", ["CAM_FRONT"])


def test_a_category_whose_name_is_no_text_is_not_taken_for_one(small_root, damage):
    """Else its vehicles would silently be missing from the canvas."""
    path = damage("category", "category-vehicle.car", name={"en": "vehicle.car"})

    assert _message(small_root).startswith(
        f"{path}: record category-vehicle.car: name missing or of the wrong"
    )


def test_a_scene_without_a_token(small_root, edit_table):
    path = edit_table(small_root, "scene", lambda records: records[0].pop("token") and None)

    assert _message(small_root).startswith(f"{path}: scene scene-0001 has no token; ")


def test_a_ring_beside_the_chain(small_root, edit_table):
    """sample-1-3 and sample-1-4 lead to each other; the rest is a sound chain: only time gives it away."""

    def ring(records):
        _edit(records, "sample-1-2", next="sample-1-5")
        _edit(records, "sample-1-5", prev="sample-1-2")
        _edit(records, "sample-1-3", prev="sample-1-4")
        _edit(records, "sample-1-4", next="sample-1-3")

    edit_table(small_root, "sample", ring)

    assert "prev/next run in a circle) [R403" in _message(small_root)


def test_a_whole_scene_in_a_ring(small_root, edit_table):
    def ring(records):
        _edit(records, "sample-1-0", prev="sample-1-7")
        _edit(records, "sample-1-7", next="sample-1-0")

    edit_table(small_root, "sample", ring)

    assert "prev/next of its key frames run in a circle [R401" in _message(small_root)


def test_a_chain_in_two_parts(small_root, edit_table):
    def cut(records):
        _edit(records, "sample-1-3", next="")
        _edit(records, "sample-1-4", prev="")

    edit_table(small_root, "sample", cut)

    assert "several chains [R401" in _message(small_root)


def test_a_scene_without_key_frames(small_root, edit_table):
    edit_table(small_root, "sample", lambda records: [r for r in records if r["scene_token"] != "scene-1"])

    assert "[R203, scene-0001]" in _message(small_root)  # first_sample_token


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    "name", ["", ".", "..", ".hidden", "a/b", "a\\b", "a\0b", "a\nb", "ends.", "x" * 201, "é" * 101]
)
def test_a_scene_name_that_cannot_be_a_file_name(small_root, damage, name):
    path = damage("scene", "scene-1", name=name)

    message = _message(small_root, scene=name)
    assert message.startswith(f"{path}: record scene-1: name ")
    assert "cannot be a file name" in message
    assert "\n" not in message
    assert "\0" not in message


@pytest.mark.parametrize("name", ["x" * 200, "Szene 1", "é" * 100, "scene-0001.b", "con"])
def test_a_scene_name_that_can(small_root, damage, name):
    damage("scene", "scene-1", name=name)

    with Dataset(small_root) as dataset:
        assert dataset.scene(name, ["CAM_FRONT"]).name == name


@pytest.mark.parametrize("name", ["scene-0002", "SCENE-0002"])
def test_two_scenes_of_one_file_name(small_root, damage, name):
    damage("scene", "scene-1", name=name)

    assert "stands for several scenes" in _message(small_root, scene=name)


@pytest.mark.parametrize("name", [None, 12, ["scene-0001"]])
def test_a_scene_without_a_name_is_listed_by_its_token_and_fails(small_root, damage, name):
    path = damage("scene", "scene-1", name=name)

    with Dataset(small_root) as dataset:
        assert dataset.scene_names() == ("scene-0002", "scene-1")
    message = _message(small_root, scene="scene-1")
    assert message.startswith(f"{path}: record scene-1: name missing or of the wrong type: name is ")


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("table", "token", "values"),
    [
        ("calibrated_sensor", "calibration-1-CAM_BACK", {"camera_intrinsic": []}),
        ("calibrated_sensor", "calibration-1-CAM_BACK", {"rotation": "north"}),
        ("ego_pose", "pose-samples-1-2-CAM_BACK", {"rotation": [0, 0, 0, 0]}),
        ("sample_data", "samples-1-2-CAM_BACK", {"filename": "../x"}),
        ("sample_data", "samples-1-2-CAM_BACK", {"is_key_frame": False}),
        ("ego_pose", "pose-samples-1-2-LIDAR_TOP", {"rotation": [0, 0, 0, 0]}),
    ],
)
def test_damage_to_other_sensors_does_not_matter(small_root, damage, table, token, values):
    damage(table, token, **values)
    channel = token.rsplit("-", 1)[1]

    with Dataset(small_root) as dataset:
        assert len(dataset.scene("scene-0001", ["CAM_FRONT"]).cameras["CAM_FRONT"]) == 8
    if channel == "LIDAR_TOP":
        _message(small_root, lidar="LIDAR_TOP")
    else:
        _message(small_root, ["CAM_FRONT", channel])


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("table", "token", "values"),
    [
        ("sample_data", "sweeps-1-2-CAM_FRONT", {"ego_pose_token": "gone"}),
        ("sample_data", "samples-1-2-RADAR_FRONT", {"filename": "/x"}),
        ("ego_pose", "pose-sweeps-1-2-CAM_FRONT", {"rotation": [0, 0, 0, 0]}),
        ("ego_pose", "pose-sweeps-1-2-CAM_FRONT", {"translation": "here"}),
        ("map", "map-1", {"log_tokens": ["log-1", "log-of-another-part"]}),
        ("sample_annotation", "annotation-1-2-vehicle.car", {"attribute_tokens": ["gone"]}),
        ("sample_annotation", "annotation-1-2-vehicle.car", {"next": "gone"}),
        ("instance", "instance-1-vehicle.car", {"first_annotation_token": "gone"}),
        ("log", "log-1", {"date_captured": None}),
    ],
)
def test_what_no_frame_uses_is_a_warning_of_check_alone(small_root, damage, table, token, values):
    damage(table, token, **values)

    with Dataset(small_root) as dataset:
        assert len(dataset.scene("scene-0001", ["CAM_FRONT"], lidar="LIDAR_TOP").cameras["CAM_FRONT"]) == 8
    findings = check_dataset(small_root)
    assert findings
    assert {finding.severity for finding in findings} == {"warning"}


def test_a_camera_that_a_scene_lacks(small_root, edit_table):
    def remove(records):
        return [r for r in records if r["calibrated_sensor_token"] != "calibration-1-CAM_BACK"]

    edit_table(small_root, "sample_data", remove)

    assert "scene-0001 has no key frame of CAM_BACK; there are: CAM_FRONT, LIDAR_TOP" in _message(
        small_root, ["CAM_BACK"]
    )


def test_lidar_asked_for_where_there_is_none(small_root, edit_table):
    edit_table(
        small_root, "sample_data", lambda records: [r for r in records if "LIDAR" not in r["filename"]]
    )

    assert "has no key frame of LIDAR_TOP" in _message(small_root, lidar="LIDAR_TOP")


def test_a_cause_is_named_before_what_follows_from_it(small_root, damage):
    """A key frame's missing sample token leaves the sample without its camera; the token is to blame."""
    path = damage("sample_data", "samples-1-2-CAM_FRONT", sample_token=None)

    findings = check_dataset(small_root)

    assert findings[0].rule == "R201"
    assert path.name in findings[0].examples[0]
