"""What a sheet can show: each subject draws a frame as a tile of panels."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ogmkit.footprints.sets import FULL_BODY
from ogmkit.pictures import legend
from ogmkit.pictures.bev_panel import Plan, draw_paths, draw_plane
from ogmkit.pictures.camera_panel import draw_camera, draw_masks, draw_photo
from ogmkit.pictures.canvas import MUTED, PAGE, PANEL, Canvas, resize
from ogmkit.pictures.cells import agreement_colours, overlap, target_colours
from ogmkit.pictures.further_panel import draw_instances, draw_map
from ogmkit.pictures.masks import Masks, MaskSet
from ogmkit.pictures.sheet import GAP, Panel, draw_tile
from ogmkit.pictures.views import View
from ogmkit.typing import UInt8Array

CAMERA_SIZE = PLANE_SIZE = 450, 800
"""Largest (height, width) of a camera's picture and of a plane."""
SMALL_SIZE = (450 - GAP) // 2, 800
"""The same of two pictures below each other."""


@dataclass(frozen=True)
class Subject:
    """One kind of sheet.

    Attributes:
        tile: draws a frame on a plan, with these sets of masks.
        groups: of the legend.
        columns: tiles beside each other.
        paths: whether past and future are shown.
        masks: whether the chosen set of masks is shown.
        bodies: whether whole bodies are shown beside it.
        further: whether what lies beside the paper's targets is shown.
    """

    tile: Callable[[View, Plan, Sequence[MaskSet]], UInt8Array]
    groups: tuple[legend.Group, ...]
    columns: int = 2
    paths: bool = False
    masks: bool = True
    bodies: bool = False
    further: bool = False

    def sets(self, chosen: str) -> tuple[str, ...]:
        """Names of the sets that `tile` takes; the chosen one stands last."""
        return (FULL_BODY,) * self.bodies + (chosen,) * self.masks


def _draw_targets(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """Image with boxes; rasters with past and future."""
    del sets
    plane = _true_plane(view, plan)
    draw_paths(plane, view, plan)
    panels = [Panel(draw_camera(view, CAMERA_SIZE).pixels, *_when(view)), Panel(plane.pixels)]
    return draw_tile(panels, "trajectory incomplete" if np.isnan([view.past, view.future]).any() else "")


def _draw_footprints(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """Masks over the image; rasters; the masks from above against the rasters."""
    masks = sets[0].read(view.index)
    rewarped = masks.rewarped(plan.grid.shape)
    photo = draw_masks(view, CAMERA_SIZE, drivable=masks.drivable, vehicles=masks.vehicles)
    planes = _true_plane(view, plan), _agreement(view, plan, rewarped)
    panels = [Panel(photo.pixels, *_when(view)), *(Panel(plane.pixels) for plane in planes)]
    if rewarped is None:
        return draw_tile(panels, masks.reason, alarm=True)
    drivable, vehicles = _iou(view, view.drivable, rewarped[0]), _iou(view, view.vehicles, rewarped[1])
    return draw_tile(panels, f"IoU in view: drivable {drivable}, vehicles {vehicles}")


def _draw_masks(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """The paper's Fig. 2: image; masks in the camera's view; masks on the plane."""
    masks = sets[0].read(view.index)
    photo = draw_photo(view, CAMERA_SIZE)
    colours = target_colours(masks.drivable, masks.vehicles, np.ones_like(masks.drivable))
    panels = [
        Panel(photo.pixels, *_when(view)),
        Panel(resize(colours, photo.shape), "in the camera's view"),
        Panel(_true_plane(view, plan).pixels, "" if masks.reason else "from above"),
    ]
    return draw_tile(panels, masks.reason, alarm=True)


def _draw_stretch(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """The paper's Fig. 1: whole bodies and footprints, each in the image and from above."""
    bodies, footprints = (one.read(view.index) for one in sets)
    photos = [draw_masks(view, SMALL_SIZE, vehicles=masks.vehicles).pixels for masks in (bodies, footprints)]
    reason = bodies.reason or footprints.reason
    titles = ("", "") if reason else ("bodies", "footprints")  # a reason needs the room
    above = (_stretched(view, plan, *one) for one in zip((bodies, footprints), titles, strict=True))
    return draw_tile([Panel(_stacked(photos), *_when(view)), *above], reason, alarm=True)


def _draw_layers(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """Image with boxes; map layers and classes; instances and what follows, where there are any."""
    del sets
    panels = [Panel(draw_camera(view, CAMERA_SIZE).pixels, *_when(view)), Panel(draw_map(view, plan).pixels)]
    if {"instances/id", "future/vehicles"} & view.further.keys():
        panels.append(Panel(draw_instances(view, plan).pixels))
    return draw_tile(panels)


def _stacked(pictures: Sequence[UInt8Array]) -> UInt8Array:
    """Pictures of one size below each other, with a gap."""
    height, width = pictures[0].shape[:2]
    step = height + GAP
    canvas = Canvas(step * len(pictures) - GAP, width)
    for place, picture in enumerate(pictures):
        canvas.paste(picture, 0, place * step)
    return canvas.pixels


def _stretched(view: View, plan: Plan, masks: Masks, title: str) -> Panel:
    """A set's vehicles from above against the raster, on the raster's drivable area."""
    rewarped = masks.rewarped(plan.grid.shape)
    if rewarped is None:
        return Panel(_agreement(view, plan, None).pixels)
    plane = _agreement(view, plan, (view.drivable, rewarped[1]))
    return Panel(plane.pixels, title, f"IoU {_iou(view, view.vehicles, rewarped[1])}")


def _true_plane(view: View, plan: Plan) -> Canvas:
    return draw_plane(target_colours(view.drivable, view.vehicles, view.field_of_view), plan)


def _agreement(view: View, plan: Plan, rewarped: tuple[UInt8Array, UInt8Array] | None) -> Canvas:
    """The plane with rasters against masks from above; without these an empty one."""
    if rewarped is not None:
        true = view.drivable, view.vehicles
        return draw_plane(agreement_colours(true, rewarped, view.field_of_view), plan)
    canvas = Canvas(*plan.size, PAGE)
    height, width = plan.grid_size
    canvas.fill(0, 0, width, height, PANEL)
    canvas.text("nothing to compare", width // 2, height // 2, 20, MUTED, "centre")
    return canvas


def _iou(view: View, true: UInt8Array, other: UInt8Array) -> str:
    share = overlap(true, other, view.field_of_view)
    return "none" if math.isnan(share) else f"{share:.2f}"


def _when(view: View) -> tuple[str, str]:
    return f"{view.time_s:.1f} s", f"frame {view.index}"


SUBJECTS: Mapping[str, Subject] = MappingProxyType(
    {
        "targets": Subject(_draw_targets, (legend.PLANE, legend.EGO, legend.BOXES), paths=True, masks=False),
        "footprints": Subject(
            _draw_footprints, (legend.IMAGE, legend.PLANE, legend.VEHICLES, legend.DRIVABLE)
        ),
        "stretch": Subject(_draw_stretch, (legend.GROUND, legend.VEHICLES), bodies=True),
        "masks": Subject(_draw_masks, (legend.PLANE,), columns=1),
        "layers": Subject(_draw_layers, (legend.LAYERS, legend.BOXES), masks=False, further=True),
    }
)
"""By the names that the command line uses; the default first."""
