"""The footprints of a camera's frames, made from what its shard holds."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, ShardError
from ogmkit.footprints.faces import body_faces, fill, ground_faces
from ogmkit.footprints.sets import Method
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.footprints.terrain import HeightFunction, project_drivable
from ogmkit.footprints.view import View
from ogmkit.footprints.warp import require_warpable, warp_to_image
from ogmkit.geometry.camera import image_from_resized
from ogmkit.homography.ego_plane import ego_plane
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.ground import fit_ground
from ogmkit.homography.sources import CALIBRATION, EGO_PLANE, SURFACE, sources_of
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.raster.vehicles import select
from ogmkit.shards import schema
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Footprints:
    """One frame's masks, (height, width) uint8 0/1 each; without maps, nothing is drivable."""

    drivable: UInt8Array
    vehicles: UInt8Array


Faces = Callable[[View, FloatArray, FloatArray], list[FloatArray]]
"""View, (M, 4, 4) `level_from_box` and (M, 3) sizes → polygons in the image."""

Renderer = Callable[[int], Footprints | None]
"""Index of a frame → its footprints; None where it has no valid homography."""


def renderer(shard: Shard, camera: str, settings: FootprintSettings) -> Renderer:
    """What makes the footprints of a camera's frames.

    Raises:
        SettingsError, ShardError: as `require_renderable`.
    """
    require_renderable(shard, camera, settings)
    return _RENDERERS[settings.method](shard, camera, settings)


def require_renderable(shard: Shard, camera: str, settings: FootprintSettings) -> None:
    """Check that the shard has all that the footprints are made from; reads no masks.

    Raises:
        SettingsError: it lacks the homography, the source has no ground though the method needs one, the
            scale leaves nothing of the images, or the grid is too long to be warped.
        ShardError: the images differ in size.
    """
    known = shard.added(camera, schema.HOMOGRAPHY.name)
    for source in sources_of(settings.homography) if settings.method == "warp" else ():
        if source not in known:
            raise SettingsError(
                f"{shard.path}: {camera}: {unknown('homography', source, known)}; "
                "`ogmkit homography-fit` adds some"
            )
    if settings.method != "warp" and settings.homography not in _GROUNDS:
        raise SettingsError(
            f"homography {settings.homography!r} knows no ground for footprints by {settings.method!r}: "
            f"choose {' or '.join(_GROUNDS)}"
        )
    mask_size(shard, camera, settings)
    require_warpable(shard.grid.shape)


def mask_size(shard: Shard, camera: str, settings: FootprintSettings) -> tuple[int, int]:
    """(height, width) of the camera's masks.

    Raises:
        SettingsError: the scale leaves nothing of the images.
        ShardError: the images differ in size.
    """
    return settings.mask_size(_image_size(shard, camera))


def _image_size(shard: Shard, camera: str) -> tuple[int, int]:
    sizes = np.unique(shard.dataset(camera, "image_size")[:], axis=0)
    if len(sizes) != 1:
        raise ShardError(f"{shard.path}: {camera} has images of {len(sizes)} sizes, not one; {REMEDY}")
    height, width = sizes[0].tolist()
    return height, width


def _warped(shard: Shard, camera: str, settings: FootprintSettings) -> Renderer:
    """Both BEV masks through the inverse of each frame's homography, or each through its own."""
    size = mask_size(shard, camera, settings)
    each = [_homographies(shard, camera, source, size) for source in sources_of(settings.homography)]
    (by_drivable, drivable_valid), (by_vehicles, vehicles_valid) = each
    valid = drivable_valid & vehicles_valid
    drivable, vehicles = _drivable(shard, camera), shard.dataset(camera, "vehicles")

    def render(frame: int) -> Footprints | None:
        if not valid[frame]:
            return None
        return Footprints(
            warp_to_image(drivable(frame), by_drivable[frame], size),
            warp_to_image(vehicles[frame], by_vehicles[frame], size),
        )

    return render


def _homographies(
    shard: Shard, camera: str, source: str, size: tuple[int, int]
) -> tuple[FloatArray, BoolArray]:
    """(N, 3, 3) from the pixels of masks of a (height, width) to cells, and (N,) which are valid."""
    place = f"{schema.HOMOGRAPHY.name}/{source}"
    bev_from_image = shard.dataset(camera, f"{place}/bev_from_image")[:]
    bev_from_mask = bev_from_image @ image_from_resized(_image_size(shard, camera), size)
    finite = np.isfinite(bev_from_mask).all(axis=(1, 2))
    return bev_from_mask, shard.dataset(camera, f"{place}/valid")[:] & finite


def _exact(shard: Shard, camera: str, settings: FootprintSettings, faces: Faces) -> Renderer:
    """The drivable area on the ground, and faces of the same boxes that the BEV's vehicles come from."""
    size = mask_size(shard, camera, settings)
    ground, targets = _GROUNDS[settings.homography], shard.settings.targets
    drivable = _drivable(shard, camera)
    level_from_global = shard.dataset(camera, "level_from_global")

    def render(frame: int) -> Footprints:
        geometry = frame_geometry(shard, camera, frame)
        view = View(geometry.intrinsics, geometry.level_from_camera, geometry.image_size).resized(size)
        boxes = select(shard.boxes(camera, frame), *targets.labels)
        polygons = faces(view, level_from_global[frame] @ boxes.global_from_box, boxes.size_wlh)
        return Footprints(
            project_drivable(drivable(frame), targets.grid, ground(geometry), view), fill(polygons, size)
        )

    return render


def _drivable(shard: Shard, camera: str) -> Callable[[int], UInt8Array]:
    """What reads a frame's drivable area."""
    nothing = np.zeros(shard.grid.shape, np.uint8)

    def read(frame: int) -> UInt8Array:
        found = shard.drivable(camera, frame)
        return nothing if found is None else found

    return read


def _surface(frame: FrameGeometry) -> HeightFunction:
    ground = fit_ground(frame)
    return lambda places_m: ground.height_m(places_m)[0]


def _level(frame: FrameGeometry) -> HeightFunction:
    del frame
    return lambda places_m: np.zeros(len(places_m))


def _tilted(frame: FrameGeometry) -> HeightFunction:
    slopes = ego_plane(frame)[1:]
    return lambda places_m: places_m @ slopes


_GROUNDS: Mapping[str, Callable[[FrameGeometry], HeightFunction]] = MappingProxyType(
    {SURFACE: _surface, CALIBRATION: _level, EGO_PLANE: _tilted}
)
"""Homographies that stand for a ground of their own."""

_RENDERERS: Mapping[Method, Callable[[Shard, str, FootprintSettings], Renderer]] = MappingProxyType(
    {
        "warp": _warped,
        "project": functools.partial(_exact, faces=ground_faces),
        "full-body": functools.partial(_exact, faces=body_faces),
    }
)
