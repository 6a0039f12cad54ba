"""Names, sizes and colours of what can be met in the streets; nuScenes' own categories and attributes."""

from dataclasses import dataclass

import numpy as np

from ogmkit.typing import FloatArray

CATEGORIES = {
    "human.pedestrian.adult": "Adult subcategory.",
    "human.pedestrian.child": "Child subcategory.",
    "human.pedestrian.wheelchair": "A person in a wheelchair, and the wheelchair.",
    "human.pedestrian.stroller": "A stroller, and the child in it.",
    "human.pedestrian.personal_mobility": "A small vehicle on which a person stands, such as a scooter.",
    "human.pedestrian.police_officer": "Police officer.",
    "human.pedestrian.construction_worker": "Construction worker.",
    "animal": "All animals.",
    "vehicle.car": "Vehicle designed primarily for personal use.",
    "vehicle.motorcycle": "Powered two-wheeler that moves at the speed of cars.",
    "vehicle.bicycle": "Two-wheeler for lower speeds.",
    "vehicle.bus.bendy": "One section of a bendy bus.",
    "vehicle.bus.rigid": "Rigid bus.",
    "vehicle.truck": "Vehicle designed primarily to haul cargo.",
    "vehicle.construction": "Vehicle designed primarily for construction.",
    "vehicle.emergency.ambulance": "Ambulance.",
    "vehicle.emergency.police": "Police vehicle.",
    "vehicle.trailer": "Trailer of a truck, car or bicycle.",
    "movable_object.barrier": "Temporary road barrier.",
    "movable_object.trafficcone": "Traffic cone.",
    "movable_object.pushable_pullable": "Object that a pedestrian may push or pull.",
    "movable_object.debris": "Object left on the road.",
    "static_object.bicycle_rack": "Rack to park bicycles in.",
}
ATTRIBUTES = {
    "vehicle.moving": "Vehicle is moving.",
    "vehicle.stopped": "Vehicle is stationary, but intends to move.",
    "vehicle.parked": "Vehicle is stationary without intent to move.",
    "cycle.with_rider": "There is a rider on the bicycle or motorcycle.",
    "cycle.without_rider": "There is no rider on the bicycle or motorcycle.",
    "pedestrian.sitting_lying_down": "The human is sitting or lying down.",
    "pedestrian.standing": "The human is standing.",
    "pedestrian.moving": "The human is moving.",
}
VISIBILITIES = {"1": (0, 40), "2": (40, 60), "3": (60, 80), "4": (80, 100)}
"""Token → per cent of the whole object that the cameras see."""

EGO_SIZE_WLH = (1.73, 4.08, 1.56)
EGO_FRONT_M = 3.4
"""From the ego's origin, the rear axle, to its front bumper."""
EGO_WHEELBASE_M = 2.59

_SIZES_WLH = {
    "human.pedestrian.adult": (0.67, 0.73, 1.75),
    "human.pedestrian.child": (0.5, 0.52, 1.3),
    "human.pedestrian.wheelchair": (0.75, 1.1, 1.35),
    "human.pedestrian.stroller": (0.6, 0.95, 1.15),
    "human.pedestrian.personal_mobility": (0.6, 1.1, 1.75),
    "human.pedestrian.police_officer": (0.7, 0.74, 1.8),
    "human.pedestrian.construction_worker": (0.72, 0.75, 1.76),
    "animal": (0.35, 0.75, 0.55),
    "vehicle.car": (1.92, 4.6, 1.7),
    "vehicle.motorcycle": (0.78, 2.1, 1.45),
    "vehicle.bicycle": (0.6, 1.7, 1.35),
    "vehicle.bus.bendy": (2.75, 8.8, 3.3),
    "vehicle.bus.rigid": (2.75, 10.5, 3.4),
    "vehicle.truck": (2.4, 6.9, 2.9),
    "vehicle.construction": (2.6, 6.2, 3.1),
    "vehicle.emergency.ambulance": (2.2, 6.0, 2.6),
    "vehicle.emergency.police": (1.95, 4.8, 1.7),
    "vehicle.trailer": (2.5, 8.5, 3.4),
    "movable_object.barrier": (2.0, 0.5, 1.0),
    "movable_object.trafficcone": (0.42, 0.42, 1.05),
    "movable_object.pushable_pullable": (0.6, 0.65, 1.05),
    "movable_object.debris": (0.8, 0.6, 0.35),
    "static_object.bicycle_rack": (3.5, 1.8, 1.2),
}
_CAR_PAINTS = np.array(
    [
        [235, 235, 235],
        [40, 40, 42],
        [150, 150, 152],
        [60, 50, 170],
        [150, 80, 40],
        [70, 110, 60],
        [30, 140, 205],
    ],
    dtype=np.float64,
)
_PAINTS = {
    "vehicle.bus": [[60, 90, 190], [60, 150, 70], [160, 110, 40]],
    "vehicle.truck": [[230, 230, 230], [170, 110, 60], [70, 70, 160]],
    "vehicle.trailer": [[220, 220, 220], [190, 170, 150]],
    "vehicle.construction": [[30, 170, 235]],
    "vehicle.emergency": [[245, 245, 245]],
    "vehicle.bicycle": [[60, 60, 140], [120, 60, 40], [50, 50, 50]],
    "vehicle.motorcycle": [[40, 40, 40], [50, 50, 160]],
    "movable_object.trafficcone": [[30, 100, 240]],
    "movable_object.barrier": [[50, 110, 235], [220, 220, 225]],
    "static_object.bicycle_rack": [[120, 120, 125]],
    "human.pedestrian.construction_worker": [[40, 200, 230]],
    "human.pedestrian.police_officer": [[110, 60, 30]],
    "human": [[150, 90, 60], [60, 60, 150], [80, 120, 70], [60, 60, 65], [170, 160, 190]],
    "": [[90, 100, 110]],
}


@dataclass(frozen=True)
class Look:
    """What one object is and looks like.

    Attributes:
        category: one of `CATEGORIES`.
        size_wlh: width, length, height in metres, to the millimetre.
        colour_bgr: blue, green, red from 0 to 255.
    """

    category: str
    size_wlh: tuple[float, float, float]
    colour_bgr: tuple[float, float, float]


def draw_look(random: np.random.Generator, category: str) -> Look:
    """An object of a category, of about its usual size."""
    scale = random.uniform(0.92, 1.08, 3) if category != "vehicle.trailer" else random.uniform(0.97, 1.03, 3)
    width, length, height = (float(value) for value in np.round(np.array(_SIZES_WLH[category]) * scale, 3))
    blue, green, red = (float(value) for value in np.clip(_paint(random, category), 0, 255))
    return Look(category, (width, length, height), (blue, green, red))


def _paint(random: np.random.Generator, category: str) -> FloatArray:
    if category == "vehicle.car":
        paints = _CAR_PAINTS
    else:
        paints = np.array(next(colours for start, colours in _PAINTS.items() if category.startswith(start)))
    paint: FloatArray = paints[random.integers(len(paints))] + random.uniform(-15, 15, 3)
    return np.round(paint, 1)
