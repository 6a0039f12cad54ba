import json

import cv2
import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import TableError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.uses import Use


def _by_rule(findings):
    return {(finding.rule, finding.severity): finding for finding in findings}


def test_a_sound_dataset_has_no_findings(small_root):
    assert check_dataset(small_root) == ()


def test_a_synthetic_dataset_has_no_findings(tiny_dataroot):
    assert check_dataset(tiny_dataroot) == ()


def test_real_data_lacks_only_files(real_dataroot):
    findings = check_dataset(real_dataroot)

    assert {(f.rule, f.severity, f.count) for f in findings} == {
        ("R701", "error", 40),
        ("R701", "warning", 200),
        ("R703", "warning", 40),
    }


def test_all_findings_are_counted_with_first_examples(small_root, edit_table):
    def damage(records):
        for record in records:
            if record["token"].startswith("annotation-1"):
                record["size"] = [0, 0, 0]
            if record["token"].startswith("annotation-2-1"):
                record["translation"] = "there"

    edit_table(small_root, "sample_annotation", damage)

    findings = _by_rule(check_dataset(small_root))

    assert set(findings) == {("R201", "error"), ("R303", "error")}
    assert findings["R201", "error"].count == 2
    assert findings["R303", "error"].count == 16
    assert findings["R303", "error"].examples == tuple(
        f"sample_annotation.json: record annotation-1-{i}-vehicle.car: "
        "size [0.0, 0.0, 0.0] is not three positive lengths up to 10000 m [scene-0001]"
        for i in range(3)
    )


def test_a_record_that_many_frames_use_counts_once(small_root, damage):
    damage("calibrated_sensor", "calibration-1-CAM_FRONT", rotation=[2, 0, 0, 0])

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.count, len(finding.examples)) == ("R301", 1, 1)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("table", "token", "values", "rule"),
    [
        ("sample_data", "sweeps-1-2-CAM_FRONT", {"ego_pose_token": "gone"}, "R203"),
        ("ego_pose", "pose-sweeps-1-2-CAM_FRONT", {"rotation": [0, 0, 0, 2]}, "R301"),
        ("sample_data", "samples-1-2-RADAR_FRONT", {"filename": "/x"}, "R501"),
        ("sample_data", "sweeps-1-2-CAM_FRONT", {"next": "samples-1-0-CAM_FRONT"}, "R601"),
        ("sample_annotation", "annotation-1-2-vehicle.car", {"next": ""}, "R602"),
        ("instance", "instance-1-vehicle.car", {"nbr_annotations": 9}, "R603"),
        ("map", "map-1", {"log_tokens": ["log-1", "gone"]}, "R604"),
        ("sample_annotation", "annotation-1-2-vehicle.car", {"attribute_tokens": ["gone"]}, "R605"),
        ("visibility", "4", {"level": None}, "R201"),
        ("sample_annotation", "annotation-1-2-vehicle.car", {"visibility_token": "5"}, "R607"),
    ],
)
def test_rules_beyond_what_frames_use(small_root, damage, table, token, values, rule):
    damage(table, token, **values)

    findings = _by_rule(check_dataset(small_root))

    assert (rule, "warning") in findings
    assert findings[rule, "warning"].examples[0].startswith(f"{table}.json: record ")


def test_tables_that_cannot_be_read_are_all_listed(small_root):
    folder = small_root / "v1.0-small"
    (folder / "log.json").unlink()
    (folder / "sample.json").write_text("<html>")
    (folder / "attribute.json").write_text("")

    error, warning = check_dataset(small_root)

    assert (error.rule, error.severity, error.count) == ("R101", "error", 2)
    assert [line.split(":")[0] for line in error.examples] == [
        str(folder / "log.json"),
        str(folder / "sample.json"),
    ]
    assert (warning.rule, warning.severity, warning.count) == ("R101", "warning", 1)


def test_a_missing_root_is_an_error(tmp_path):
    with pytest.raises(TableError, match="no such folder"):
        check_dataset(tmp_path / "gone")


def test_a_dataset_without_scenes_is_an_error(small_root, edit_table):
    edit_table(small_root, "scene", lambda records: [])

    findings = _by_rule(check_dataset(small_root))

    assert findings["R102", "error"].examples == ("scene.json: no record has a name",)


@pytest.mark.parametrize("folder", ["samples", "sweeps"])
def test_a_file_that_cannot_be_examined_counts_as_absent(small_root, folder):
    """A link that leads to itself: the system refuses to say whether it is there."""
    image = small_root / folder / "CAM_FRONT" / "1-2.jpg"
    image.unlink()
    image.symlink_to(image.name)

    (finding,) = check_dataset(small_root)

    assert finding.rule == {"samples": "R701", "sweeps": "R704"}[folder]


def test_unsound_splits(small_root):
    (small_root / "splits.json").write_text(json.dumps({"train": ["scene-9"]}))

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.severity) == ("R606", "warning")


def _cut(path):
    path.write_bytes(path.read_bytes()[:-30])


def _replace_with_text(path):
    path.write_text("<html>")


def _empty(path):
    path.write_bytes(b"")


def _unlink(path):
    path.unlink()


FILES = [
    ("samples/CAM_FRONT/1-2.jpg", _unlink, "R701", "error"),
    ("samples/CAM_FRONT/1-2.jpg", _cut, "R702", "error"),
    ("samples/CAM_FRONT/1-2.jpg", _replace_with_text, "R702", "error"),
    ("samples/CAM_FRONT/1-2.jpg", _empty, "R702", "error"),
    ("samples/CAM_BACK/1-2.jpg", _unlink, "R701", "warning"),
    ("samples/LIDAR_TOP/1-2.bin", _unlink, "R703", "warning"),
    ("samples/LIDAR_TOP/1-2.bin", _cut, "R703", "warning"),
    ("samples/LIDAR_TOP/1-2.bin", _empty, "R703", "warning"),
    ("samples/RADAR_FRONT/1-2.bin", _unlink, "R704", "warning"),
    ("sweeps/CAM_FRONT/1-2.jpg", _unlink, "R704", "warning"),
    ("maps/1.png", _unlink, "R705", "error"),
    ("maps/1.png", _cut, "R705", "error"),
    ("maps/1.png", _replace_with_text, "R705", "error"),
    ("maps/1.png", _empty, "R705", "error"),
]


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("name", "damage_file", "rule", "severity"), FILES)
def test_files(small_root, name, damage_file, rule, severity):
    damage_file(small_root / name)

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.severity, finding.count) == (rule, severity, 1)
    assert name in finding.examples[0]


def test_an_image_of_another_size(small_root, damage):
    damage("sample_data", "samples-1-2-CAM_FRONT", width=64)

    (finding,) = check_dataset(small_root)

    assert finding.rule == "R702"
    assert finding.examples == ("samples/CAM_FRONT/1-2.jpg: 32 × 18 pixels, but 64 × 18 in the table",)


def test_a_mask_of_a_map_that_no_scene_uses(small_root, damage):
    damage("map", "map-1", log_tokens=["log-1"])
    edited = json.loads((small_root / "v1.0-small" / "map.json").read_text())
    edited.append({**edited[0], "token": "map-3", "filename": "maps/3.png", "log_tokens": []})
    (small_root / "v1.0-small" / "map.json").write_text(json.dumps(edited))

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.severity) == ("R705", "warning")


def _spoil_pixels(path):
    """Another byte in the middle of the compressed pixels, header and end as they were."""
    data = bytearray(path.read_bytes())
    data[data.index(b"IDAT") + 12] ^= 0xFF
    path.write_bytes(data)


def test_a_mask_is_read_to_its_last_byte(small_root):
    _spoil_pixels(small_root / "maps" / "1.png")

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.severity) == ("R705", "error")
    assert check_dataset(small_root, use=Use(maps=False)) == ()


def test_a_mask_without_a_drivable_pixel(small_root):
    cv2.imwrite(str(small_root / "maps" / "1.png"), np.full((400, 500), 254, np.uint8))

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.severity, finding.examples) == ("R707", "warning", ("maps/1.png",))


def test_tables_of_another_release_than_the_files(small_root):
    for path in small_root.glob("samples/CAM_*/*"):
        path.unlink()

    findings = _by_rule(check_dataset(small_root))

    assert findings["R708", "warning"].examples == ("none of 22 images of key frames",)
    assert findings["R701", "error"].count == 11


def test_a_mask_too_small_for_the_drive(small_root, damage):
    damage("ego_pose", "pose-samples-1-2-CAM_FRONT", translation=[60.0, 20.0, 0.0])

    (finding,) = check_dataset(small_root)

    assert (finding.rule, finding.examples) == (
        "R706",
        ("maps/1.png: 500 × 400 pixels, ego up to (60, 22) m",),
    )


def test_progress_counts_every_file(small_root):
    calls = []

    check_dataset(small_root, execution=Execution(on_progress=lambda *counts: calls.append(counts)))

    assert calls == [(2, 57), (35, 57), (57, 57)]  # 2 masks, 33 files of key frames, and the others
