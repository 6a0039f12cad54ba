"""Labels side by side: by hand, and against figures that were measured by another hand."""

from dataclasses import replace

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.evaluation.label_comparison import compare_labels
from ogmkit.labels.catalogue import PRESETS, paper
from ogmkit.labels.compare import SHIFTS, counts_by_range, counts_by_shift, masks_of, range_masks, same_cells
from ogmkit.labels.definition import without_map
from ogmkit.labels.exact import exact_of
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import build_targets

LSS, CVT, PON, POINTBEV = (PRESETS[name] for name in ("lss", "cvt", "pon", "pointbev"))
MEASURED = {
    ("lss", "exact", "vehicle"): (123337, 96151, 0.7534),
    ("fiery", "exact", "vehicle"): (91602, 69508, 0.7317),
    ("cvt", "exact", "vehicle"): (122554, 95137, 0.7518),
    ("cvt", "exact", "visibility"): (123889, 96110, 0.7512),
    ("pointbev", "exact", "vehicle"): (123995, 96110, 0.7515),
    ("stp3", "exact", "pedestrian"): (4635, 1629, 0.3263),
    ("pon", "exact", "vehicle"): (235601, 205122, 0.8531),
    ("pon", "exact", "barrier"): (5991, 4374, 0.6956),
}
"""Cells, exact cells and IoU on all 80 real frames, as peer-labels' README has them."""


def test_counts_by_hand():
    one, other = np.zeros((2, 4, 5), bool)
    one[1, 1:4], other[2, 2:5] = True, True
    shifts = dict(zip(SHIFTS, counts_by_shift(one, other).tolist(), strict=True))
    assert shifts[0, 0] == [0, 6]
    assert shifts[-1, -1] == [3, 3]  # one[row - 1, column - 1] lies on other[row, column]
    assert shifts[-1, 0] == [2, 4]
    ranges = {"all": np.ones((4, 5), bool), "left": np.arange(5) < 3 * np.ones((4, 1))}
    assert counts_by_range(one, other, ranges).tolist() == [[3, 3, 0], [2, 1, 0]]


def test_arrays_are_turned_so_that_coordinates_grow():
    array = np.zeros((200, 200), np.uint8)
    array[0, 10] = 1  # 49.75 m ahead, 44.75 m left
    masks = masks_of(dict.fromkeys(CVT.class_names, array) | {"visibility": array * 0 + 255}, CVT)
    assert np.argwhere(masks["vehicle"]).tolist() == [[199, 189]]
    assert not masks["visibility"].any()
    far = range_masks(CVT)
    assert [bool(far[name][199, 189]) for name in far] == [True, False, False, True]


def test_which_cells_lie_on_each_other():
    assert same_cells(LSS, CVT)
    assert same_cells(CVT, POINTBEV)
    assert not same_cells(LSS, PON)
    assert not same_cells(LSS, PRESETS["bevfusion"])
    assert not same_cells(LSS, replace(LSS, grid=paper(TargetSettings()).grid))


def test_exact_keeps_frame_grid_and_filters_and_drops_lines():
    exact = exact_of(CVT)
    assert (exact.frame, exact.grid, exact.filters) == (CVT.frame, CVT.grid, CVT.filters)
    assert "lane" in exact.class_names
    assert not {"lane_divider", "road_divider"} & set(exact.class_names)
    assert "divider" not in exact_of(PRESETS["bevfusion"]).class_names


def test_the_papers_labels_are_their_exact_raster(key_frames, fixture_root, sample_grid):
    targets = TargetSettings(sample_grid, images="none", no_map=True)
    for key_frame in list(key_frames(fixture_root).values())[::8]:
        found = labels_of(key_frame, exact_of(paper(targets)))["vehicles"]
        assert np.array_equal(found, build_targets(key_frame.camera, targets, None).vehicles)


def test_figures_of_a_synthetic_scene(fixture_root):
    with Dataset(fixture_root) as dataset:
        found = compare_labels(dataset, ("scene-0001",), [without_map(CVT), POINTBEV, PON])
    assert (found.frames, found.worst[0]) == (20, "scene-0001")
    assert found.apart == (("cvt", "pon"), ("pointbev", "pon"))
    rows = {(row.one, row.other, row.label, row.range): row for row in found.rows}
    vehicles = rows["cvt", "pointbev", "visibility", "all"]
    assert vehicles.shift == (-1, -1)
    assert vehicles.iou < 0.7
    assert vehicles.shifted_iou > 0.9
    assert vehicles.area_ratio == vehicles.cells / vehicles.other_cells
    parts = [rows["pon", "exact", "car", name].cells for name in ("all", "0–20 m", "20–40 m", "40 m +")]
    assert parts[0] == sum(parts[1:])


@pytest.mark.parametrize("definitions", [(), (LSS, LSS), (without_map(PRESETS["bevfusion"]),)])
def test_what_cant_be_compared(fixture_root, definitions):
    with Dataset(fixture_root) as dataset, pytest.raises(SettingsError, match=r"name at least|without a map"):
        compare_labels(dataset, ("scene-0001",), definitions)


@pytest.mark.slow
def test_figures_of_all_real_frames(partial_dataroot):
    names = ("lss", "fiery", "cvt", "pon", "pointbev", "stp3")
    with Dataset(partial_dataroot) as dataset:
        definitions = [without_map(PRESETS[name]) for name in names]
        found = compare_labels(dataset, dataset.scene_names(), definitions)
    rows = {(row.one, row.other, row.label): row for row in found.rows if row.range == "all"}
    for place, (cells, exact, iou) in MEASURED.items():
        assert rows[place].cells == cells
        assert abs(rows[place].other_cells - exact) <= 2  # a centre on a border
        assert rows[place].iou == pytest.approx(iou, abs=6e-5)
    apart = rows["cvt", "pointbev", "visibility"]
    assert (round(apart.iou, 3), apart.shift, round(apart.shifted_iou, 3)) == (0.689, (-1, -1), 0.989)
