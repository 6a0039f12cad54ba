"""A spinning LiDAR: one turn of 32 beams, cast as rays against the ground and boxes, without noise."""

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.synthetic.parts import Parts, split_into_parts
from ogmkit.synthetic.scenery import HeightFunction, Scenery, Solids
from ogmkit.synthetic.terrain import flat_inverse_distance, slope_profile
from ogmkit.typing import Float32Array, FloatArray, IntArray

MAX_RANGE_M = 100.0
MIN_RANGE_M = 1.0
"""Nearer returns, from the vehicle itself, are dropped, as the official devkit drops them."""
# Velodyne HDL-32E, user's manual: 32 lasers from −30.67° to +10.67°.
_LOWEST_RAD, _HIGHEST_RAD = np.radians(-30.67), np.radians(10.67)
_PROFILE_ROWS = 1440
# Mean reflectance by a part's look, in the sensor's units of 0 to 255.
_REFLECTANCE = {"car": 60.0, "large": 70.0, "building": 45.0, "leaves": 18.0, "cone": 110.0, "barrier": 70.0}
_OTHER_REFLECTANCE = 30.0
# Of white ground; darker ground reflects in proportion.
_GROUND_REFLECTANCE = 0.25
_NEWTON_STEPS = 3


def scan(
    scenery: Scenery,
    solids: Solids,
    global_from_lidar: FloatArray,
    *,
    beams: int = 32,
    azimuths: int = 1090,
) -> tuple[Float32Array, IntArray]:
    """Cast one turn; all rays start at the same moment.

    Args:
        scenery: the ground; its brightness gives the intensity of its returns.
        solids: the boxes.
        global_from_lidar: (4, 4) pose of the sensor: z up, rings counted from the lowest beam.
        beams: number of rings, evenly spread over the sensor's elevations.
        azimuths: rays of a ring, evenly spread round z.

    Returns:
        (P, 5) float32 in the LiDAR's frame: x, y, z in metres, intensity (0 to 255), ring; in firing order
        (azimuth by azimuth, rings upwards). And (P,) the solid that each point lies on, −1 on the ground.

    Raises:
        SettingsError: no beams, no azimuths, or a sensor that is not above the ground.
    """
    if beams < 1 or azimuths < 1:
        raise SettingsError(
            f"a scan of {beams} beams and {azimuths} azimuths has no rays; give at least one of each"
        )
    directions = ray_directions(beams, azimuths)
    ranges_m = _ground_ranges(scenery, global_from_lidar, directions)
    hit_part = np.full(ranges_m.shape, -1, dtype=np.int64)
    cosines = np.abs(directions @ global_from_lidar[2, :3])
    parts = split_into_parts(solids)
    _cast_at_parts(parts, global_from_lidar, directions, ranges_m, hit_part, cosines)
    kept = (ranges_m >= MIN_RANGE_M) & (ranges_m <= MAX_RANGE_M)
    points = directions[kept] * ranges_m[kept, None]
    intensity = _intensity(
        scenery, parts, hit_part[kept], transform_points(global_from_lidar, points), cosines[kept]
    )
    rings = np.broadcast_to(np.arange(beams), kept.shape)[kept]
    solid_index = np.append(parts.solid_index, -1)[hit_part[kept]]
    return np.column_stack([points, intensity, rings]).astype(np.float32), solid_index


def ray_directions(beams: int, azimuths: int) -> FloatArray:
    """Unit rays (azimuths, beams, 3) in the LiDAR's frame: azimuth 0 along x, then counter-clockwise."""
    elevation = np.linspace(_LOWEST_RAD, _HIGHEST_RAD, beams)
    azimuth = 2 * np.pi * np.arange(azimuths)[:, None] / azimuths
    x, y = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
    return np.stack([x, y, np.broadcast_to(np.sin(elevation), x.shape)], axis=-1)


def _ground_ranges(scenery: Scenery, global_from_lidar: FloatArray, directions: FloatArray) -> FloatArray:
    """Distance (A, B) along unit rays to the ground, infinite where they miss it."""
    origin = global_from_lidar[:3, 3]
    ground = 0.0 if scenery.height is None else float(scenery.height(origin[:2]))
    if origin[2] <= ground:
        raise SettingsError(f"LiDAR at {origin} is not above the ground; give another pose")
    rays = np.moveaxis(directions @ global_from_lidar[:3, :3].T, -1, 0)
    if scenery.height is None:
        inverse_range = flat_inverse_distance(origin, rays)
    else:
        profile = slope_profile(scenery.height, origin, 0.0, 2 * np.pi, _PROFILE_ROWS)
        inverse_range = profile.inverse_distance(rays.astype(np.float32)).astype(np.float64)
    with np.errstate(divide="ignore"):
        ranges_m: FloatArray = np.where(inverse_range > 1e-9, 1 / inverse_range, np.inf)
    return ranges_m if scenery.height is None else _refined(scenery.height, origin, rays, ranges_m)


def _refined(
    height: HeightFunction, origin: FloatArray, rays: FloatArray, ranges_m: FloatArray
) -> FloatArray:
    """Ranges (A, B) from the slope profile, made exact by Newton steps where they stay close."""
    near = ranges_m <= MAX_RANGE_M * 1.1
    ray, start = rays[:, near], ranges_m[near]
    step_m = 0.01

    def clearance(along: FloatArray) -> FloatArray:
        points = origin[:, None] + along * ray
        return np.asarray(points[2] - height(points[:2].T), dtype=np.float64)

    landed = start
    for _ in range(_NEWTON_STEPS):
        above = clearance(landed)
        slope = (clearance(landed + step_m) - above) / step_m
        # A ray that grazes a crest has no stable landing point: keep the profile's.
        step = np.where(np.abs(slope) > 1e-4, above / np.where(slope == 0, 1, slope), 0)
        landed = landed - np.where(np.abs(landed - step - start) < 0.05 * start, step, 0)
    refined = ranges_m.copy()
    refined[near] = landed
    return refined


def _cast_at_parts(
    parts: Parts,
    global_from_lidar: FloatArray,
    directions: FloatArray,
    ranges_m: FloatArray,
    hit_part: IntArray,
    cosines: FloatArray,
) -> None:
    """Shorten the ranges (A, B) in place where a box is nearer; note the box and the angle of incidence."""
    part_from_lidar = inverse(parts.global_from_part) @ global_from_lidar
    corners_lidar = transform_points(inverse(global_from_lidar), parts.corners())
    half = parts.size_wlh[:, [1, 0, 2]] / 2
    for index in range(len(parts.look)):
        rows = _azimuth_rows(corners_lidar[index], len(directions))
        if rows is None:
            continue
        rays = directions[rows] @ part_from_lidar[index, :3, :3].T
        entry_m, axis = _slab_entry(part_from_lidar[index, :3, 3], rays, half[index])
        nearer = entry_m < ranges_m[rows]
        beam = np.nonzero(nearer)
        struck = rows[beam[0]], beam[1]
        ranges_m[struck] = entry_m[nearer]
        hit_part[struck] = index
        cosines[struck] = np.abs(np.take_along_axis(rays[nearer], axis[nearer][:, None], axis=1)[:, 0])


def _azimuth_rows(corners_lidar: FloatArray, azimuths: int) -> IntArray | None:
    """Rows of the scan that can meet a box with the given corners (8, 3); None if it is out of reach."""
    centre = corners_lidar.mean(axis=0)
    radius_m = np.linalg.norm(corners_lidar - centre, axis=1).max()
    if np.linalg.norm(centre) - radius_m > MAX_RANGE_M:
        return None
    if np.hypot(centre[0], centre[1]) <= radius_m:
        return np.arange(azimuths)
    towards = np.arctan2(centre[1], centre[0])
    turned = np.arctan2(corners_lidar[:, 1], corners_lidar[:, 0]) - towards
    spread = np.abs(np.angle(np.exp(1j * turned))).max()
    step = 2 * np.pi / azimuths
    rows: IntArray = np.arange(np.ceil((towards - spread) / step), np.floor((towards + spread) / step) + 1)
    return rows.astype(np.int64) % azimuths


def _slab_entry(origin: FloatArray, rays: FloatArray, half: FloatArray) -> tuple[FloatArray, IntArray]:
    """Slab test (Kay & Kajiya 1986) in a box's own frame.

    Returns:
        (...) distance at which rays (..., 3) from an origin outside enter the box, infinite where they miss;
        and the axis of the face that they enter through.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (-half - origin) / rays, (half - origin) / rays
    # A ray inside a slab's plane gives 0/0: it neither enters nor leaves there.
    entries = np.nan_to_num(np.minimum(first, second), nan=-np.inf, posinf=np.inf, neginf=-np.inf)
    exits = np.nan_to_num(np.maximum(first, second), nan=np.inf, posinf=np.inf, neginf=-np.inf)
    entry = entries.max(axis=-1)
    hit = (entry <= exits.min(axis=-1)) & (entry > 0)
    return np.where(hit, entry, np.inf), entries.argmax(axis=-1)


def _intensity(
    scenery: Scenery, parts: Parts, hit_part: IntArray, points_global: FloatArray, cosines: FloatArray
) -> FloatArray:
    """Strength of the returns (P,): the material's reflectance, weaker at a slant."""
    ground = scenery.texture.brightness(points_global[:, :2]) * _GROUND_REFLECTANCE
    reflectance = np.array([_REFLECTANCE.get(look, _OTHER_REFLECTANCE) for look in parts.look] + [0.0])[
        hit_part
    ]
    mean = np.where(hit_part < 0, ground, reflectance)
    return np.asarray(np.round(mean * (0.25 + 0.75 * np.sqrt(cosines))), dtype=np.float64)
