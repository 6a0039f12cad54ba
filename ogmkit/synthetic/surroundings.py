"""Buildings and trees behind the walkways: seen by the sensors, never annotated."""

import numpy as np
import shapely
from shapely.geometry import Polygon

from ogmkit.synthetic.curves import direction
from ogmkit.synthetic.ground import HeightFunction
from ogmkit.synthetic.layout import Layout
from ogmkit.synthetic.scenery import BUILDING, TREE, Solids
from ogmkit.synthetic.streets import Road
from ogmkit.typing import FloatArray

_BUILDING_PAINTS = np.array(
    [[150, 165, 178], [120, 140, 170], [170, 170, 168], [105, 120, 150], [185, 195, 200], [140, 130, 120]]
)
_TREE_PAINT = np.array([48.0, 98.0, 62.0])
_SETBACK_M = 3.0
_TREE_STEP_M = 13.0


def draw_surroundings(random: np.random.Generator, layout: Layout, height: HeightFunction | None) -> Solids:
    """Line the roads with houses and trees, clear of each other, of roads and of car parks."""
    paved = shapely.union_all([layout.layers.drivable, layout.layers.walkway])
    shapely.prepare(paved)
    placed: list[Polygon] = []
    rows: list[tuple[str, FloatArray, FloatArray]] = []
    for category, candidates in ((BUILDING, _houses(random, layout)), (TREE, _trees(random, layout))):
        for pose, size_wlh in candidates:
            footprint = _footprint(pose, size_wlh)
            if paved.intersects(footprint) or any(footprint.intersects(other) for other in placed):
                continue
            placed.append(footprint)
            rows.append((category, pose, size_wlh))
    poses = np.array([pose for _, pose, _ in rows]).reshape(-1, 3)
    sizes = np.array([size for *_, size in rows]).reshape(-1, 3)
    paints = [_paint(random, category) for category, *_ in rows]
    return Solids(
        global_from_box=standing_boxes(poses, sizes, height),
        size_wlh=sizes,
        category=tuple(category for category, *_ in rows),
        colour_bgr=np.array(paints).reshape(-1, 3),
        annotated=np.zeros(len(rows), dtype=np.bool_),
    )


def standing_boxes(poses: FloatArray, sizes_wlh: FloatArray, height: HeightFunction | None) -> FloatArray:
    """(M, 4, 4) `global_from_box` of upright boxes that stand on the ground.

    Args:
        poses: (M, 3) x, y, heading of the middles.
        sizes_wlh: (M, 3).
        height: the ground's, None where it is flat.
    """
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    ground = np.zeros(len(poses)) if height is None else height(poses[:, :2])
    boxes = np.zeros((len(poses), 4, 4))
    boxes[:, 0, 0] = boxes[:, 1, 1] = cosine
    boxes[:, 1, 0], boxes[:, 0, 1] = sine, -sine
    boxes[:, 2, 2] = boxes[:, 3, 3] = 1.0
    boxes[:, :2, 3] = poses[:, :2]
    boxes[:, 2, 3] = ground + sizes_wlh[:, 2] / 2
    return boxes


def _houses(random: np.random.Generator, layout: Layout) -> list[tuple[FloatArray, FloatArray]]:
    houses = []
    for road in layout.network.roads:
        for side in (1, -1):
            along_m = float(random.uniform(2, 12))
            while along_m < road.centre.length:
                length, depth = random.uniform(11, 26), random.uniform(9, 17)
                storeys_m = 3.2 * random.integers(2, 9)
                out_m = _SETBACK_M + random.uniform(0, 4) + depth / 2
                pose = _behind_walkway(road, side, along_m + length / 2, float(out_m))
                houses.append((pose, np.array([depth, length, storeys_m])))
                along_m += length + float(random.uniform(3, 14))
    return houses


def _trees(random: np.random.Generator, layout: Layout) -> list[tuple[FloatArray, FloatArray]]:
    trees = []
    for road in layout.network.roads:
        for side in (1, -1):
            for along_m in np.arange(6.0, road.centre.length, _TREE_STEP_M):
                crown = random.uniform(2.2, 3.8)
                place_m = float(along_m + random.uniform(-4, 4))
                pose = _behind_walkway(road, side, place_m, float(crown / 2 + random.uniform(0.1, 1.0)))
                trees.append((pose, np.array([crown, crown, random.uniform(4.5, 8.5)])))
    return trees


def _behind_walkway(road: Road, side: int, along_m: float, out_m: float) -> FloatArray:
    """(3,) pose at a distance from the walkway's outer edge."""
    kerb_m = float(np.interp(along_m, road.centre.distances, road.left_m if side > 0 else road.right_m))
    heading = float(road.centre.heading(along_m))
    across = side * direction(heading + np.pi / 2)
    position = road.centre.at(along_m) + (kerb_m + road.section.walkway_m + out_m) * across
    return np.array([*position, heading])


def _footprint(pose: FloatArray, size_wlh: FloatArray) -> Polygon:
    ahead, left = size_wlh[1] / 2 * direction(pose[2]), size_wlh[0] / 2 * direction(pose[2] + np.pi / 2)
    return Polygon([pose[:2] + a * ahead + b * left for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))])


def _paint(random: np.random.Generator, category: str) -> FloatArray:
    shade = random.uniform(-14, 14, 3)
    if category == TREE:
        return _TREE_PAINT + shade
    paint: FloatArray = _BUILDING_PAINTS[random.integers(len(_BUILDING_PAINTS))] + shade
    return paint
