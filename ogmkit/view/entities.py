"""A frame as entities of a recording: what stands at which place of the tree.

Places begin with the scene. Below it, `CAM_FRONT` and the like are level frames, x ahead, y left, z up in
metres; below these, `camera` is the camera's frame with its image in pixels. `plane/CAM_FRONT` is in cells.
Rerun counts pixels and cells from the corner of the first one, not from its centre: all is half of one
further there.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from ogmkit.drawing.palette import theme
from ogmkit.geometry.boxes import EDGES, box_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.polygons import clip_near_plane
from ogmkit.grid import GridSpec
from ogmkit.metrics.gaussian import ellipse
from ogmkit.metrics.plan import Plan
from ogmkit.pictures.planning_sheet import SHARE
from ogmkit.typing import FloatArray
from ogmkit.view.classes import NOTHING, OF_TARGETS, UNSEEN, box_class, classes, numbered
from ogmkit.view.frames import CameraFrame
from ogmkit.view.predictions import Masks, Predicted

Entity = tuple[str, Any]
"""Its place, and Rerun's archetype."""

CORNER = 0.5
"""From the centre of the first pixel or cell, where ogmkit counts from, to its corner, where Rerun does."""
OVERLAY = 0.5
_NEAR_M = 0.1
_LINES_M, _APART_M = 10.0, 1.0
"""Lines of a homography's grid, and points on each."""
_POINT_PX, _LINE_PX = 1.5, 2.0


@dataclass(frozen=True)
class Camera:
    """A camera of a scene.

    Attributes:
        scene: its name.
        channel: its name.
        grid: of its rasters.
        rasters: names of its further rasters.
    """

    scene: str
    channel: str
    grid: GridSpec
    rasters: tuple[str, ...]

    def level(self, *parts: str) -> str:
        """A place in the level frame."""
        return entity(self.scene, self.channel, *parts)

    def image(self, *parts: str) -> str:
        """A place in the camera's frame."""
        return self.level("camera", *parts)

    def plane(self, *parts: str) -> str:
        """A place on the grid."""
        return entity(self.scene, "plane", self.channel, *parts)

    @property
    def speed(self) -> str:
        """The place of the speed."""
        return entity(self.scene, "speed", self.channel)


def entity(*parts: str) -> str:
    """A place, whatever characters its parts have."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    found: str = rr.new_entity_path([part for name in parts for part in name.split("/")])
    return found


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
    yield from _masks(camera.plane, parts, predicted.bev)
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
    strips, numbers = _projected(frame)
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


def _masks(place: Callable[..., str], parts: tuple[str, ...], masks: Masks) -> Iterator[Entity]:
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    for order, (target, mask) in enumerate(masks.items()):
        ids = mask * np.uint8(OF_TARGETS[target])
        yield place(*parts, target), rr.SegmentationImage(ids, opacity=OVERLAY, draw_order=10.0 + order)


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


def _projected(frame: CameraFrame) -> tuple[list[FloatArray], list[int]]:
    """Edges of the boxes before the camera, in pixels, and the class of each."""
    strips, numbers = [], []
    corners = box_corners(frame.camera_from_box, frame.boxes.size_wlh)
    for box, category in zip(corners, frame.boxes.category, strict=True):
        if box[:, 2].max() <= _NEAR_M:
            continue
        for edge in EDGES:
            visible = clip_near_plane(box[list(edge)], _NEAR_M)
            pixels = project(frame.intrinsics, visible)[0] + CORNER
            if len(visible) > 1 and _meets(pixels, frame.image_size):
                strips.append(pixels)
                numbers.append(box_class(category))
    return strips, numbers


def _meets(pixels: FloatArray, size: tuple[int, int]) -> bool:
    """Whether the rectangle round (K, 2) pixels overlaps an image of that (height, width)."""
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    return bool((high >= 0).all() and (low <= size[::-1]).all())


def ground_lines(grid: GridSpec, bev_from_image: FloatArray, size: tuple[int, int]) -> list[FloatArray]:
    """Where a homography sees the grid's lines of every 10 m in an image of that (height, width).

    Returns:
        Strips of (K, 2) pixels, from the corner; a point a metre, as far as these lie in the image and
        before the camera, where w is positive.
    """
    image_from_bev = np.linalg.inv(bev_from_image)
    strips = []
    for line in _lines(grid):
        pixels = np.column_stack([grid.cells(line), np.ones(len(line))]) @ image_from_bev.T
        before = pixels[pixels[:, 2] > 0]
        found = before[:, :2] / before[:, 2:] + CORNER
        inside = found[((found >= 0) & (found <= size[::-1])).all(axis=1)]
        if len(inside) > 1:
            strips.append(inside)
    return strips


def _lines(grid: GridSpec) -> Iterable[FloatArray]:
    """(K, 2) points in metres on lines across and along the grid."""
    (near, far), (right, left) = grid.x_range_m, grid.y_range_m
    along, across = (_spaced(*one, _APART_M) for one in ((near, far), (right, left)))
    for x in _spaced(near, far, _LINES_M):
        yield np.column_stack([np.full(len(across), x), across])
    for y in _spaced(right, left, _LINES_M):
        yield np.column_stack([along, np.full(len(along), y)])


def _spaced(first: float, last: float, apart: float) -> FloatArray:
    """Multiples of a distance within a range, and its ends."""
    inner = np.arange(np.floor(first / apart) + 1, np.ceil(last / apart)) * apart
    found: FloatArray = np.concatenate([[first], inner, [last]])
    return found


def _resized(image_size: tuple[int, int], mask: tuple[int, ...]) -> Any:  # noqa: ANN401  # Rerun's
    """From a mask's pixels to the image's, corners on corners."""
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    return rr.Transform3D(scale=[image_size[1] / mask[1], image_size[0] / mask[0], 1.0])


def _pose(parent_from_own: FloatArray) -> Any:  # noqa: ANN401  # Rerun's
    import rerun as rr  # noqa: PLC0415  # comes with the extra `view`

    return rr.Transform3D(translation=parent_from_own[:3, 3], mat3x3=parent_from_own[:3, :3])


def quaternion_xyzw(rotation: FloatArray) -> FloatArray:
    """(4,) unit quaternion of a (3, 3) rotation."""
    axis_angle = cv2.Rodrigues(rotation)[0][:, 0]
    angle = float(np.linalg.norm(axis_angle))
    found: FloatArray = np.append(np.sinc(angle / 2 / np.pi) / 2 * axis_angle, np.cos(angle / 2))
    return found
