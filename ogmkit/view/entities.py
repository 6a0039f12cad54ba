"""A frame as entities of a recording: what stands at which place of the tree.

Places begin with the scene. Below it, `CAM_FRONT` and the like are level frames, x ahead, y left, z up in
metres; below these, `camera` is the camera's frame with its image in pixels. `plane/CAM_FRONT` is in cells.
Rerun counts pixels and cells from the corner of the first one, not from its centre: all is half of one
further there.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ogmkit.drawing.palette import theme
from ogmkit.metrics.gaussian import ellipse
from ogmkit.metrics.plan import Plan
from ogmkit.pictures.planning_sheet import SHARE
from ogmkit.typing import FloatArray
from ogmkit.view.classes import NOTHING, OF_TARGETS, UNSEEN, box_class, classes, numbered
from ogmkit.view.frames import CameraFrame
from ogmkit.view.lines import CORNER, ground_lines, projected_boxes, quaternion_xyzw
from ogmkit.view.places import Camera, entity
from ogmkit.view.predictions import Masks, Predicted

Entity = tuple[str, Any]
"""Its place, and Rerun's archetype."""

_OVERLAY = 0.5
"""Opacity of masks over others and over images."""
_POINT_PX, _LINE_PX = 1.5, 2.0


def scene_entities(scene: str, cameras: Sequence[Camera]) -> Iterator[Entity]:
    """What is the same in all frames of a scene: axes and classes."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    named = [one for camera in cameras for one in camera.rasters]
    known = classes(dict.fromkeys(named))
    context = rr.AnnotationContext([rr.AnnotationInfo(one.number, one.name, one.colour) for one in known])
    yield entity(scene), context
    yield entity(scene), rr.ViewCoordinates.RIGHT_HAND_Z_UP
    for camera in cameras:
        yield camera.level(), rr.ViewCoordinates.FLU
        own = rr.AnnotationContext([rr.AnnotationInfo(NOTHING, "", (0, 0, 0, 0))])
        yield camera.plane("instances"), own  # numbers of vehicles, not of classes
        yield camera.speed, rr.SeriesLines(names=[f"{camera.channel}, m/s"], colors=[theme().first])


def frame_entities(camera: Camera, frame: CameraFrame) -> Iterator[Entity]:
    """What a frame shows."""
    yield from _in_level(camera, frame)
    yield from _in_image(camera, frame)
    yield from _on_plane(camera, frame)


def predicted_entities(
    camera: Camera, name: str, predicted: Predicted | None, size: tuple[int, int]
) -> Iterator[Entity]:
    """What a run predicted of a frame, whose image is of that (height, width).

    Where there is nothing, what was there before is removed.
    """
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    parts = ("predictions", name)
    if predicted is None:
        for place in (camera.image, camera.plane, camera.level):
            yield place(*parts), rr.Clear(recursive=True)
        return
    yield from _masks(camera.plane, parts, predicted.bev, 1.0)
    if predicted.image:
        yield camera.image(*parts), _resized(size, next(iter(predicted.image.values())).shape)
        yield from _masks(camera.image, parts, predicted.image)
    if predicted.plan is not None:
        yield from _plan(camera, parts, predicted.plan)


def lost_entities(camera: Camera) -> Iterator[Entity]:
    """What removes the frame before, where a camera lost one."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    for place in (camera.level(), camera.plane()):
        yield place, rr.Clear(recursive=True)


def _in_level(camera: Camera, frame: CameraFrame) -> Iterator[Entity]:
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    yield camera.level(), _pose(frame.global_from_level)
    level_from_box, category = frame.level_from_box, frame.boxes.category
    boxes = rr.Boxes3D(
        centers=level_from_box[:, :3, 3],
        half_sizes=frame.boxes.size_wlh[:, [1, 0, 2]] / 2,
        quaternions=[quaternion_xyzw(one) for one in level_from_box[:, :3, :3]],
        class_ids=list(map(box_class, category)),
        labels=list(category),
        show_labels=False,
    )
    yield camera.level("boxes"), boxes
    paths = _paths(frame)
    for name, (points, colour) in paths.items():
        level = [np.column_stack([points, np.zeros(len(points))])] if len(points) > 1 else []
        yield camera.level(name), rr.LineStrips3D(level, colors=[colour] * len(level))
        cells = [camera.grid.cells(points) + CORNER] if len(points) > 1 else []
        lines = rr.LineStrips2D(cells, colors=[colour] * len(cells), draw_order=40.0)
        yield camera.plane(name), lines
    if frame.lidar is not None:
        radius = rr.Radius.ui_points(_POINT_PX)
        yield camera.level("lidar"), rr.Points3D(frame.lidar[:, :3], radii=radius, colors=theme().muted)
    if np.isfinite(frame.speed_m_s):
        yield camera.speed, rr.Scalars(frame.speed_m_s)


def _in_image(camera: Camera, frame: CameraFrame) -> Iterator[Entity]:
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    height, width = frame.image_size
    intrinsics = frame.intrinsics.copy()
    intrinsics[:2, 2] += CORNER
    yield camera.image(), _pose(frame.level_from_camera)
    pinhole = rr.Pinhole(
        image_from_camera=intrinsics, resolution=[width, height], camera_xyz=rr.ViewCoordinates.RDF
    )
    yield camera.image(), pinhole
    if frame.image is not None:
        yield camera.image("image"), rr.EncodedImage(contents=frame.image, media_type="image/jpeg")
    strips, numbers = projected_boxes(frame)
    radius = rr.Radius.ui_points(_LINE_PX / 2)
    lines = rr.LineStrips2D(strips, class_ids=numbers, radii=[radius] * len(strips), draw_order=40.0)
    yield camera.image("boxes"), lines
    for name, masks in frame.footprints.items():
        yield camera.image("footprints", name), _resized(frame.image_size, masks["vehicles"].shape)
        yield from _masks(camera.image, ("footprints", name), masks)
    for name, bev_from_image in frame.homographies.items():
        found = [] if bev_from_image is None else ground_lines(camera.grid, bev_from_image, frame.image_size)
        colours = [theme().first] * len(found)
        yield camera.image("homography", name), rr.LineStrips2D(found, colors=colours, draw_order=30.0)


def _on_plane(camera: Camera, frame: CameraFrame) -> Iterator[Entity]:
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    further = numbered(camera.rasters)
    for order, (name, raster) in enumerate(frame.rasters.items()):
        if name == "field_of_view":
            ids = np.where(raster > 0, NOTHING, UNSEEN).astype(np.uint8)
        else:
            ids = raster * np.uint8(OF_TARGETS[name] if name in OF_TARGETS else further[name])
        yield camera.plane(name), rr.SegmentationImage(ids, opacity=1.0, draw_order=float(order))
    if frame.instances is not None:
        yield camera.plane("instances"), rr.SegmentationImage(frame.instances, draw_order=30.0)


def _masks(
    place: Callable[..., str], parts: tuple[str, ...], masks: Masks, opacity: float = _OVERLAY
) -> Iterator[Entity]:
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    for order, (target, mask) in enumerate(masks.items()):
        ids = mask * np.uint8(OF_TARGETS[target])
        yield place(*parts, target), rr.SegmentationImage(ids, opacity=opacity, draw_order=10.0 + order)


def _plan(camera: Camera, parts: tuple[str, ...], plan: Plan) -> Iterator[Entity]:
    """The plan's means from the ego on, and on the plane what each step's Gaussian holds 90 % of the time."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    points = np.concatenate([np.zeros((1, 2)), plan.mean])
    level = [np.column_stack([points, np.zeros(len(points))])]
    yield camera.level(*parts, "plan"), rr.LineStrips3D(level, colors=[theme().second])
    outlines = [
        ellipse(mean, sigma, rho, SHARE)
        for mean, sigma, rho in zip(plan.mean, plan.sigma, plan.rho.tolist(), strict=True)
    ]
    cells = [camera.grid.cells(one) + CORNER for one in (points, *outlines)]
    lines = rr.LineStrips2D(cells, colors=[theme().second] * len(cells), draw_order=50.0)
    yield camera.plane(*parts, "plan"), lines


def _paths(frame: CameraFrame) -> Mapping[str, tuple[FloatArray, Any]]:
    """Past and future that are known, each with the ego's own place, and their colours."""
    ego = np.zeros((1, 2))
    past, future = (path[np.isfinite(path).all(axis=1)] for path in (frame.past, frame.future))
    return {
        "past": (np.concatenate([past, ego]), theme().first),
        "future": (np.concatenate([ego, future]), theme().future),
    }


def _resized(image_size: tuple[int, int], mask: tuple[int, ...]) -> Any:  # noqa: ANN401  # Rerun's
    """From a mask's pixels to the image's, corners on corners."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    return rr.Transform3D(scale=[image_size[1] / mask[1], image_size[0] / mask[0], 1.0])


def _pose(parent_from_own: FloatArray) -> Any:  # noqa: ANN401  # Rerun's
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    return rr.Transform3D(translation=parent_from_own[:3, 3], mat3x3=parent_from_own[:3, :3])
