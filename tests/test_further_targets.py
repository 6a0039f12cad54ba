"""Rasters beside the paper's, on whole scenes: numbers, flow, what follows, classes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from ogmkit.frames import STEPS
from ogmkit.further_targets import Around, following_boxes, further_targets, instance_numbers
from ogmkit.geometry.boxes import ground_corners
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.raster.vehicles import select
from ogmkit.target_settings import TargetSettings

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "nuscenes-synthetic"
SETTINGS = TargetSettings(
    GridSpec(0.25, 300, 160, 250.0, 87.0),
    classes=("car", "large=vehicle.bus+truck", "pedestrian"),
    instances=True,
    flow=True,
    future=2,
    images="none",
    no_map=True,
)
LEAST_INSIDE = 0.99


def _frames(root, scene=None):
    with Dataset(root) as dataset:
        name = scene or dataset.scene_names()[0]
        return dataset.scene(name, ["CAM_FRONT"], maps=False).cameras["CAM_FRONT"]


@pytest.fixture(scope="module", params=["fixtures", "real"])
def scene(request):
    """A scene's frames, what is drawn of each, and the boxes of the next two."""
    if request.param == "real":
        frames = _frames(request.getfixturevalue("real_dataroot"), "scene-0103")
    else:
        frames = _frames(FIXTURE)
    frames, numbers = frames[:12], instance_numbers((frame.boxes for frame in frames), SETTINGS)
    following = following_boxes(frames, SETTINGS)
    drawn = [
        further_targets(frame.level_from_global, frame.boxes, SETTINGS, Around({}, numbers, after))
        for frame, after in zip(frames, following, strict=True)
    ]
    return frames, numbers, following, drawn


def _polygons(frame, boxes):
    """Instance → its ground face in the frame's cells."""
    corners = ground_corners(frame.level_from_global @ boxes.global_from_box, boxes.size_wlh)
    faces = shapely.polygons(SETTINGS.grid.cells(corners))
    return dict(zip(boxes.instance_token, faces, strict=True))


def _centres(mask):
    """(n, 2) column and row of a mask's cells."""
    return np.argwhere(mask)[:, ::-1].astype(float)


def test_numbers_are_the_same_in_all_frames_and_cover_what_vehicles_do(scene):
    frames, numbers, _, drawn = scene
    assert sorted(numbers.values()) == list(range(1, len(numbers) + 1))
    seen = 0
    for frame, rasters in zip(frames, drawn, strict=True):
        shown = select(frame.boxes)
        polygons = {numbers[token]: face for token, face in _polygons(frame, shown).items()}
        raster = rasters["instances/id"]
        for number in np.unique(raster[raster > 0]).tolist():
            assert shapely.covers(
                polygons[number].buffer(1e-6), shapely.points(_centres(raster == number))
            ).all()
            seen += 1
    assert seen > 50


def test_flow_leads_into_the_instance_s_next_polygon(scene):
    frames, numbers, following, drawn = scene
    tested = 0
    for frame, after, rasters in zip(frames, following, drawn, strict=True):
        raster, flow = rasters["instances/id"], rasters["instances/flow"]
        polygons = {} if after[0] is None else _polygons(frame, after[0])
        for token, number in numbers.items():
            cells = raster == number
            if token not in polygons:
                assert np.isnan(flow[:, cells]).all()
                continue
            if cells.any():
                at_m = SETTINGS.grid.positions_m(_centres(cells))
                moved = SETTINGS.grid.cells(at_m + flow[:, cells].T)
                inside = shapely.covers(polygons[token].buffer(1e-3), shapely.points(moved))
                assert inside.mean() >= LEAST_INSIDE
                tested += 1
    assert tested > 50


def test_offsets_lead_into_the_middle(scene):
    frames, numbers, _, drawn = scene
    for frame, rasters in zip(frames, drawn, strict=True):
        polygons = _polygons(frame, frame.boxes)
        for token, number in numbers.items():
            cells = rasters["instances/id"] == number
            centres = SETTINGS.grid.cells(
                SETTINGS.grid.positions_m(_centres(cells)) + rasters["instances/offset"][:, cells].T
            )
            if cells.any():
                middle = shapely.get_coordinates(polygons[token].centroid)
                np.testing.assert_allclose(centres, np.tile(middle, (len(centres), 1)), atol=1e-3)


def test_the_future_is_where_boxes_will_be(scene):
    frames, _, following, drawn = scene
    assert [bool(rasters["future/valid"].all()) for rasters in drawn][:8] == [True] * 8
    for frame, after, rasters in zip(frames, following, drawn, strict=True):
        for step, boxes in enumerate(after):
            faces = {} if boxes is None else _polygons(frame, select(boxes))
            rows, columns = np.indices(SETTINGS.grid.shape)
            expected = shapely.contains_xy(shapely.union_all(list(faces.values())), columns, rows)
            assert np.mean(rasters["future/vehicles"][step] != expected) < 1e-4
            assert rasters["future/valid"][step] == (boxes is not None)


def test_what_follows_are_the_frames_a_step_on(scene):
    frames, _, following, _ = scene
    later = [frame.boxes for frame in frames[1:]]
    assert [after[0] for after in following[:-1]] == later
    assert following[-1] == (None, None)  # of twelve frames the last ones know what comes, but it is not here
    halves = following_boxes(frames, replace(SETTINGS, max_gap_s=0.1))
    assert halves == [(None, None)] * len(frames)
    assert following_boxes(frames, TargetSettings()) == [()] * len(frames)


def test_a_frame_that_is_left_out_follows_on_none(scene):
    frames, _, _, _ = scene
    kept = frames[:3] + frames[4:]
    following = following_boxes(kept, SETTINGS)
    assert [after[0] is None for after in following[:4]] == [False, False, True, False]
    assert following[2][1] is frames[4].boxes
    assert frames[2].neighbour_timestamps_us[STEPS + 1] == frames[3].timestamp_us


def test_classes_show_the_categories_that_hold_their_parts(scene):
    frames, _, _, drawn = scene
    wanted = {
        "car": ("vehicle.car",),
        "large": ("vehicle.bus.bendy", "vehicle.bus.rigid", "vehicle.truck"),
        "pedestrian": ("human.pedestrian.",),
    }
    for frame, rasters in zip(frames[:3], drawn, strict=False):
        for name, beginnings in wanted.items():
            faces = _polygons(frame, select(frame.boxes, beginnings))
            rows, columns = np.indices(SETTINGS.grid.shape)
            expected = shapely.contains_xy(shapely.union_all(list(faces.values())), columns, rows)
            assert np.mean(rasters[f"classes/{name}"] != expected) < 1e-4
    assert any(rasters["classes/car"].any() for rasters in drawn)


def test_a_frame_by_itself_knows_no_future(scene):
    frames, _, _, _ = scene
    frame = frames[4]
    rasters = further_targets(frame.level_from_global, frame.boxes, SETTINGS, Around())
    assert set(np.unique(rasters["instances/id"])) <= set(range(len(select(frame.boxes)) + 1))
    assert np.isnan(rasters["instances/flow"]).all()
    assert not rasters["future/vehicles"].any()
    assert not rasters["future/valid"].any()
