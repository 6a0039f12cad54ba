"""Datasets that are wrong as a whole, one mutation a kind, and the figure that tells."""

import re
import shutil

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.categories import require_known
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset


@pytest.fixture
def world(tiny_dataroot, tmp_path):
    """A copy of the tables of the synthetic dataset, beside links to its files."""
    root = tmp_path / "world"
    root.mkdir()
    for path in tiny_dataroot.iterdir():
        if path.name.startswith("v1.0-"):
            shutil.copytree(path, root / path.name)
        else:
            (root / path.name).symlink_to(path)
    return root


def _scalar_last(records):
    for record in records:
        w, x, y, z = record["rotation"]
        record["rotation"] = [x, y, z, w]


def _north(records):
    for record in records:
        record["rotation"] = [0.0, 0.0, 0.5**0.5, 0.5**0.5]


def _turned_around(records):
    for record in records:
        w, x, y, z = record["rotation"]
        record["rotation"] = [-z, y, -x, w]  # half a turn about z


def _length_first(records):
    for record in records:
        width, length, height = record["size"]
        record["size"] = [length, width, height]


def _bottoms_for_centres(records):
    for record in records:
        record["translation"][2] -= record["size"][2] / 2


def _plain_names(records):
    for record in records:
        record["name"] = record["name"].removeprefix("vehicle.")


def _looking_up(records):
    for record in records:
        if record["camera_intrinsic"]:
            record["rotation"] = [1.0, 0.0, 0.0, 0.0]


WHOLE = {
    "heading north, the scalar last": ("ego_pose", _north, "R801", r"poses lean by more than 45° \(100%\)"),
    "poses with the scalar last": (
        "ego_pose",
        _scalar_last,
        "R802",
        r"more than 45° off its x axis \(100%\)",
    ),
    "ego drives backwards": (
        "ego_pose",
        _turned_around,
        "R802",
        r"moves by more than 45° off its x axis \(100%\)",
    ),
    "boxes with the scalar last": ("sample_annotation", _scalar_last, "R803", r"boxes lean by more than 45°"),
    "length before width": ("sample_annotation", _length_first, "R804", r"are wider than long \(100%\)"),
    "bottoms for centres": (
        "sample_annotation",
        _bottoms_for_centres,
        "R805",
        r"stand -[01]\.\d\d m above the ego",
    ),
    "cameras look up": ("calibrated_sensor", _looking_up, "R806", r"2 of 2|4 of 4"),
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("table", "mutate", "rule", "figure"), WHOLE.values(), ids=WHOLE)
def test_a_figure_tells_what_single_records_can_t(world, edit_table, table, mutate, rule, figure):
    edit_table(world, table, mutate)

    findings = {finding.rule: finding for finding in check_dataset(world)}

    assert rule in findings
    assert findings[rule].severity == "warning"
    assert re.search(figure, findings[rule].examples[0])
    assert set(findings) <= {"R801", "R802", "R803", "R804", "R805", "R806"}


def test_vehicles_of_other_names_are_named(world, edit_table):
    edit_table(world, "category", _plain_names)

    (finding,) = check_dataset(world)

    assert (finding.rule, finding.severity) == ("R807", "error")
    assert (
        "no category begins with vehicle.; the dataset's own names would fit: --categories "
        in finding.examples[0]
    )
    assert "bus.bendy,bus.rigid,car" in finding.examples[0]
    with Dataset(world) as dataset:
        with pytest.raises(SettingsError, match=r"--categories bus\.bendy"):
            require_known(["vehicle."], dataset.categories(), world)
        require_known(["car", "truck"], dataset.categories(), world)


def test_lens_distortion_is_refused_and_zeros_are_none(world, edit_table):
    def distort(*values):
        def change(records):
            for record in records:
                record["camera_distortion"] = list(values)

        return change

    edit_table(world, "calibrated_sensor", distort(0.0, 0.0, 0.0, 0.0, 0.0))
    assert check_dataset(world) == ()

    edit_table(world, "calibrated_sensor", distort(-0.3, 0.1, 0.0, 0.0, 0.0))
    errors = [finding for finding in check_dataset(world) if finding.severity == "error"]
    assert [finding.rule for finding in errors] == ["R309"]
    with (
        Dataset(world) as dataset,
        pytest.raises(TableError, match=r"camera_distortion \[-0.3.*R309.*undistort"),
    ):
        dataset.scene("scene-0001", ["CAM_FRONT"])
