"""What is read back from a recording is what the shards hold."""

import h5py
import numpy as np
import pytest

from ogmkit.geometry.boxes import EDGES, box_corners
from ogmkit.geometry.se3 import transform_points

SCENE, CAMERA = "scene-0001", "CAM_FRONT"
LEVEL, IMAGE, PLANE = (f"/{SCENE}/{part}" for part in (CAMERA, f"{CAMERA}/camera", f"plane/{CAMERA}"))
FRAME = 3


@pytest.fixture
def group(sample_shards):
    with h5py.File(sample_shards / f"{SCENE}.h5") as h5:
        yield h5[CAMERA]


def rows(recorded, place, component):
    return [value for _, _, value in recorded[place][component]]


def masks(recorded, place):
    """(N, h, w) classes."""
    buffers = rows(recorded, place, "SegmentationImage:buffer")
    forms = rows(recorded, place, "SegmentationImage:format")
    return np.stack(
        [
            np.array(buffer[0], np.uint8).reshape(form[0]["height"], form[0]["width"])
            for buffer, form in zip(buffers, forms, strict=True)
        ]
    )


def matrix(recorded, place, frame):
    """(4, 4) parent from own."""
    found = np.eye(4)
    (columns,) = rows(recorded, place, "Transform3D:mat3x3")[frame]
    found[:3, :3] = np.array(columns).reshape(3, 3).T
    (found[:3, 3],) = rows(recorded, place, "Transform3D:translation")[frame]
    return found


def test_every_frame_of_every_camera_is_there_at_its_own_time(recorded, sample_shards):
    for scene in ("scene-0001", "scene-0002"):
        with h5py.File(sample_shards / f"{scene}.h5") as h5:
            for camera in ("CAM_FRONT", "CAM_BACK"):
                stamps_ns = (h5[camera]["timestamp_us"][:] * 1000).tolist()
                for place in (f"/{scene}/{camera}/camera/image", f"/{scene}/plane/{camera}/vehicles"):
                    component = next(iter(recorded[place]))
                    found = [(frame, time) for frame, time, _ in recorded[place][component]]
                    assert found == list(enumerate(stamps_ns))


def test_images_are_the_shards_files(recorded, group):
    blobs = rows(recorded, f"{IMAGE}/image", "EncodedImage:blob")
    assert [bytes(blob[0]) for blob in blobs] == [image.tobytes() for image in group["image"][:]]
    assert rows(recorded, f"{IMAGE}/image", "EncodedImage:media_type")[0] == ["image/jpeg"]


def test_rasters_are_classes_that_have_names_and_colours(recorded, group):
    np.testing.assert_array_equal(masks(recorded, f"{PLANE}/drivable"), group["drivable"][:])
    np.testing.assert_array_equal(masks(recorded, f"{PLANE}/vehicles"), group["vehicles"][:] * 2)
    np.testing.assert_array_equal(
        masks(recorded, f"{PLANE}/field_of_view"), 3 - group["field_of_view"][:] * 3
    )

    ((_, _, (context,)),) = recorded[f"/{SCENE}"]["AnnotationContext:context"]
    infos = {one["class_id"]: one["class_description"]["info"] for one in context}
    assert [infos[number]["label"] for number in (1, 2, 3, 4)] == [
        *("drivable", "vehicle", "not in view", "human"),
    ]
    assert infos[1]["color"] == int.from_bytes((60, 117, 88, 255), "big")  # the dark theme's
    assert infos[0]["color"] == 0


def test_footprints_are_laid_on_the_image_by_their_corners(recorded, group):
    for name in ("calibration", "dlt", "large"):
        for number, target in ((1, "drivable"), (2, "vehicles")):
            found = masks(recorded, f"{IMAGE}/footprints/{name}/{target}")
            np.testing.assert_array_equal(found, group[f"footprints/{name}/{target}"][:] * number)
        ((across, down, _),) = rows(recorded, f"{IMAGE}/footprints/{name}", "Transform3D:scale")[0]
        assert (across * found.shape[2], down * found.shape[1]) == pytest.approx((160, 90))


def test_cameras_stand_where_the_shard_says(recorded, group):
    intrinsics = np.array(rows(recorded, IMAGE, "Pinhole:image_from_camera")[FRAME][0]).reshape(3, 3).T
    half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    np.testing.assert_allclose(intrinsics, group["intrinsics"][FRAME] + half, rtol=1e-6)
    assert rows(recorded, IMAGE, "Pinhole:resolution")[FRAME] == [[160.0, 90.0]]

    global_from_camera = matrix(recorded, LEVEL, FRAME) @ matrix(recorded, IMAGE, FRAME)
    expected = group["global_from_ego"][FRAME] @ group["ego_from_camera"][FRAME]
    np.testing.assert_allclose(global_from_camera, expected, atol=1e-3)


def test_boxes_stand_where_the_shard_says_and_are_drawn_where_the_camera_sees_them(recorded, group):
    first, stop = group["boxes/offsets"][FRAME : FRAME + 2]
    centres, half, quaternions = (
        np.array(rows(recorded, f"{LEVEL}/boxes", f"Boxes3D:{name}")[FRAME])
        for name in ("centers", "half_sizes", "quaternions")
    )
    assert rows(recorded, f"{LEVEL}/boxes", "Boxes3D:labels")[FRAME] == [
        name.decode() for name in group["boxes/category"][first:stop]
    ]
    level_from_box = np.tile(np.eye(4), (len(centres), 1, 1))
    level_from_box[:, :3, :3] = [rotation(one) for one in quaternions]
    level_from_box[:, :3, 3] = centres
    corners = box_corners(level_from_box, 2 * half[:, [1, 0, 2]])
    in_global = transform_points(matrix(recorded, LEVEL, FRAME)[None], corners)
    expected = box_corners(group["boxes/global_from_box"][first:stop], group["boxes/size_wlh"][first:stop])
    np.testing.assert_allclose(in_global, expected, atol=2e-3)

    camera_from_level = np.linalg.inv(matrix(recorded, IMAGE, FRAME))
    intrinsics = np.array(rows(recorded, IMAGE, "Pinhole:image_from_camera")[FRAME][0]).reshape(3, 3).T
    homogeneous = transform_points(camera_from_level[None], corners) @ intrinsics.T
    in_sight = [
        box
        for box in homogeneous
        if (box[:, 2] > 1).all()
        and (abs(box[:, 0] / box[:, 2] - 80) < 80).all()
        and (abs(box[:, 1] / box[:, 2] - 45) < 45).all()
    ]
    assert in_sight
    strips = rows(recorded, f"{IMAGE}/boxes", "LineStrips2D:strips")[FRAME]
    drawn = {
        tuple(map(tuple, np.rint(np.array(strip) * 20).astype(int))) for strip in strips if len(strip) == 2
    }
    for box in in_sight:
        pixels = box[:, :2] / box[:, 2:]
        near = [
            any(np.abs(np.array(strip) / 20 - pixels[list(edge)]).max() < 0.1 for strip in drawn)
            for edge in EDGES
        ]
        assert all(near)


def rotation(quaternion_xyzw):
    x, y, z, w = quaternion_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_points_and_paths_are_in_the_level_frame_and_on_the_grid(recorded, group, sample_grid):
    first, stop = group["lidar/offsets"][FRAME : FRAME + 2]
    points = np.array(rows(recorded, f"{LEVEL}/lidar", "Points3D:positions")[FRAME], np.float32)
    np.testing.assert_array_equal(points, group["lidar/points"][first:stop, :3])

    future = group["trajectory/future"][0]
    assert np.isfinite(future).all()
    (level,) = rows(recorded, f"{LEVEL}/future", "LineStrips3D:strips")[0]
    np.testing.assert_allclose(level, np.pad(future, ((1, 0), (0, 1))), atol=1e-5)
    (cells,) = rows(recorded, f"{PLANE}/future", "LineStrips2D:strips")[0]
    # The ego is 60 cells of 0.5 m below the grid's top edge, 15 right of its left one.
    expected = np.array([15, 60]) - np.pad(future, ((1, 0), (0, 0)))[:, ::-1] / 0.5
    np.testing.assert_allclose(cells, expected, atol=1e-4)
    assert rows(recorded, f"{LEVEL}/past", "LineStrips3D:strips")[0] == []  # a scene begins without


def test_speed_is_known_from_the_second_frame_on(recorded, group):
    last = group["trajectory/past"][:, -1]
    expected = np.hypot(*last.T) / 0.5
    found = recorded[f"/{SCENE}/speed/{CAMERA}"]["Scalars:scalars"]
    assert [frame for frame, _, _ in found] == np.flatnonzero(np.isfinite(expected)).tolist()
    np.testing.assert_allclose([value[0] for _, _, value in found], expected[np.isfinite(expected)])


def test_a_homography_shows_the_grids_lines_on_the_ground(recorded, group):
    """By calibration they are where the pinhole sees z = 0 of the level frame."""
    camera_from_level = np.linalg.inv(matrix(recorded, IMAGE, FRAME))
    x, y = np.meshgrid([10.0, 20.0, 30.0], np.arange(-12.0, 8.0))
    ground = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)
    homogeneous = transform_points(camera_from_level, ground) @ group["intrinsics"][FRAME].T
    pixels = homogeneous[:, :2] / homogeneous[:, 2:] + 0.5
    inside = pixels[((pixels > 0) & (pixels < [160, 90])).all(axis=1)]
    strips = rows(recorded, f"{IMAGE}/homography/calibration", "LineStrips2D:strips")[FRAME]
    drawn = np.concatenate([np.array(strip) for strip in strips])
    apart = np.linalg.norm(inside[:, None] - drawn[None], axis=-1).min(axis=1)
    assert len(inside) > 10
    assert apart.max() < 0.02
    assert ((drawn >= 0) & (drawn <= [160, 90])).all()


def test_where_a_homography_is_invalid_no_line_stays(recorded, sample_shards):
    seen = set()
    for scene in ("scene-0001", "scene-0002"):
        with h5py.File(sample_shards / f"{scene}.h5") as h5:
            valid = h5[f"{CAMERA}/homography/dlt/valid"][:].tolist()
        place = f"/{scene}/{CAMERA}/camera/homography/dlt"
        assert [bool(strips) for strips in rows(recorded, place, "LineStrips2D:strips")] == valid
        seen.update(valid)
    assert seen == {True, False}


def test_layers_and_classes_have_names_and_instances_their_own_numbers(record, further_shards, tmp_path):
    found = record(further_shards, tmp_path / "further.rrd", scenes=[SCENE], cameras=[CAMERA], theme="light")
    ((_, _, (context,)),) = found[f"/{SCENE}"]["AnnotationContext:context"]
    infos = {one["class_description"]["info"]["label"]: one["class_id"] for one in context}
    with h5py.File(further_shards / f"{SCENE}.h5") as h5:
        for name in ("layers/drivable_area", "layers/lane_divider", "classes/car", "classes/large"):
            raster = h5[f"{CAMERA}/{name}"][:]
            np.testing.assert_array_equal(masks(found, f"{PLANE}/{name}"), raster * infos[name])
        numbers = h5[f"{CAMERA}/instances/id"][:]
    place = found[f"{PLANE}/instances"]
    buffers = [bytes(value[0]) for _, _, value in place["SegmentationImage:buffer"]]
    assert buffers == [one.astype("<u2").tobytes() for one in numbers]
    assert len(place["AnnotationContext:context"]) == 1
    assert not any(path.startswith(f"/{SCENE}/CAM_BACK") or "scene-0002" in path for path in found)


def test_cells_that_are_seen_are_shown(record, seen_shards, tmp_path):
    found = record(seen_shards, tmp_path / "seen.rrd", scenes=[SCENE], cameras=[CAMERA])
    with h5py.File(seen_shards / f"{SCENE}.h5") as h5:
        for name in ("seen/rays", "seen/lidar"):
            shown = masks(found, f"{PLANE}/{name}")
            np.testing.assert_array_equal(shown > 0, h5[f"{CAMERA}/{name}"][:] > 0)


def test_the_first_layout_has_a_tab_a_scene_with_cameras_plane_and_speed(rerun, recording):
    reader = rerun.chunk.RrdReader(recording)
    (layout,) = reader.blueprints()
    names, hidden = [], set()
    for chunk in reader.stream(store=layout).collect().stream():
        batch = chunk.to_record_batch()
        columns = dict(zip(batch.schema.names, batch.columns, strict=True))
        for name, column in columns.items():
            if name.endswith(":display_name"):
                names += [value[0] for value in column.to_pylist() if value]
            if name == "EntityBehavior:visible" and column.to_pylist() == [[False]]:
                hidden.add(chunk.entity_path.partition("/overrides/")[2])
    views = ["CAM_BACK", "CAM_FRONT", "CAM_FRONT, level frame", "plane, truth", "speed"]
    assert sorted(names) == sorted([*views, "scene-0001", *views, "scene-0002"])
    assert f"{SCENE}/{CAMERA}/camera/homography/surface" in "\n".join(hidden)
    assert f"{SCENE}/{CAMERA}/camera/footprints/dlt" in "\n".join(hidden)
    assert f"{SCENE}/{CAMERA}/camera/footprints/calibration" not in "\n".join(hidden)  # the first set
