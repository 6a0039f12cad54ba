"""What a sheet can show: each subject draws a frame as a tile of panels."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import Plan, draw_paths, draw_plane
from ogmkit.drawing.canvas import Canvas, framed, resize
from ogmkit.drawing.cells import agreement_colours, overlap, target_colours
from ogmkit.drawing.palette import theme
from ogmkit.drawing.sheet import GAP, Caption, Column, Panel, draw_tile
from ogmkit.footprints.sets import FULL_BODY
from ogmkit.pictures.camera_panel import draw_camera, draw_masks, draw_photo
from ogmkit.pictures.further_panel import further_panels
from ogmkit.pictures.masks import Masks, MaskSet
from ogmkit.pictures.views import View
from ogmkit.typing import UInt8Array

PLANE_SIZE = 720, 640
"""Largest (height, width) of a plane."""

_PHOTO_SIZE = 360, 640
"""Largest (height, width) of a camera's picture."""


def photo_size(plan: Plan) -> tuple[int, int]:
    """Largest (height, width) of a camera's picture beside a plane, which gets a third of the width."""
    return _PHOTO_SIZE[0], min(_PHOTO_SIZE[1], 2 * plan.size[1] - GAP)


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
    """Image, bare and with boxes; rasters with past and future."""
    del sets
    plane = _true_plane(view, plan)
    draw_paths(plane, view.past, view.future, plan)
    incomplete = np.isnan([view.past, view.future]).any()
    return draw_tile(
        [_photos(view, plan), Panel(plane.pixels, "from above")],
        Caption(*_when(view), "trajectory incomplete" if incomplete else ""),
    )


def _draw_footprints(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """Image, bare and with masks; rasters; the masks from above against the rasters."""
    masks, size = sets[0].read(view.index), photo_size(plan)
    rewarped = masks.rewarped(plan.grid.shape)
    photo = draw_masks(view, size, drivable=masks.drivable, vehicles=masks.vehicles)
    columns: list[Column] = [
        [Panel(draw_photo(view, size).pixels, "image"), Panel(photo.pixels, "masks")],
        Panel(_true_plane(view, plan).pixels, "truth"),
        Panel(_agreement(view, plan, rewarped).pixels, "masks and truth"),
    ]
    note = masks.reason if rewarped is None else f"IoU in view: {scores_text(view, rewarped)}"
    return draw_tile(columns, Caption(*_when(view), note, alarm=rewarped is None))


def _draw_masks(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """The paper's Fig. 2: image; masks in the camera's view; masks on the plane."""
    masks = sets[0].read(view.index)
    photo = draw_photo(view, photo_size(plan))
    colours = target_colours(masks.drivable, masks.vehicles, np.ones_like(masks.drivable))
    columns: list[Column] = [
        [Panel(photo.pixels, "image"), Panel(framed(resize(colours, photo.shape)), "masks")],
        Panel(_true_plane(view, plan).pixels, "from above"),
    ]
    return draw_tile(columns, Caption(*_when(view), masks.reason, alarm=True))


def _draw_stretch(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """The paper's Fig. 1: whole bodies and footprints, each in the image and from above, and the truth."""
    both = {name: one.read(view.index) for name, one in zip(("bodies", "footprints"), sets, strict=True)}
    photos = [
        Panel(draw_masks(view, photo_size(plan), vehicles=masks.vehicles).pixels, name)
        for name, masks in both.items()
    ]
    above = [_stretched(view, plan, masks, name) for name, masks in both.items()]
    reason = next((masks.reason for masks in both.values() if masks.reason), "")
    truth = Panel(_true_plane(view, plan).pixels, "truth")
    return draw_tile([photos, truth, *above], Caption(*_when(view), reason, alarm=True))


def _draw_layers(view: View, plan: Plan, sets: Sequence[MaskSet]) -> UInt8Array:
    """Image, bare and with boxes; planes of what lies beside the paper's targets."""
    del sets
    return draw_tile([_photos(view, plan), *further_panels(view, plan)], Caption(*_when(view)))


def _photos(view: View, plan: Plan) -> list[Panel]:
    """The image, bare and with boxes."""
    size = photo_size(plan)
    return [Panel(draw_photo(view, size).pixels, "image"), Panel(draw_camera(view, size).pixels, "boxes")]


def _stretched(view: View, plan: Plan, masks: Masks, title: str) -> Panel:
    """A set's vehicles from above against the raster, on the raster's drivable area."""
    rewarped = masks.rewarped(plan.grid.shape)
    if rewarped is None:
        return Panel(_agreement(view, plan, None).pixels, title)
    plane = _agreement(view, plan, (view.drivable, rewarped[1]))
    return Panel(plane.pixels, title, f"IoU {iou_text(view, view.vehicles, rewarped[1])}")


def _true_plane(view: View, plan: Plan) -> Canvas:
    return draw_plane(target_colours(view.drivable, view.vehicles, view.field_of_view), plan)


def _agreement(view: View, plan: Plan, rewarped: tuple[UInt8Array, UInt8Array] | None) -> Canvas:
    """The plane with rasters against masks from above; without these an empty one."""
    if rewarped is not None:
        true = view.drivable, view.vehicles
        return draw_plane(agreement_colours(true, rewarped, view.field_of_view), plan)
    canvas = Canvas(*plan.size)
    height, width = plan.grid_size
    canvas.fill(0, 0, width, height, theme().empty)
    canvas.text("nothing to compare", width // 2, height // 2, 20, theme().muted, "centre")
    return canvas


def scores_text(view: View, found: tuple[UInt8Array, UInt8Array]) -> str:
    """IoU of drivable area and of vehicles in view."""
    drivable, vehicles = found
    return (
        f"drivable {iou_text(view, view.drivable, drivable)}, "
        f"vehicles {iou_text(view, view.vehicles, vehicles)}"
    )


def iou_text(view: View, true: UInt8Array, other: UInt8Array) -> str:
    """IoU where the camera sees, in figures; `none` where there is nothing."""
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
        "stretch": Subject(_draw_stretch, (legend.PLANE, legend.VEHICLES), bodies=True),
        "masks": Subject(_draw_masks, (legend.PLANE,)),
        "layers": Subject(_draw_layers, (legend.BOXES,), masks=False, further=True),
    }
)
"""By the names that the command line uses; the default first."""
